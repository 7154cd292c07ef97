r"""Hertz in space: an elastic ball with a flat top on an elastic block, on finer and finer meshes.

A quarter of a ball of radius 8 is pressed onto a block. Both have E = 1000 and ν = 0.3. With the
force F and E* = E / (2 (1 − ν²)) Hertz gives

.. math:: a = \left( \frac{3 F R}{4 E^*} \right)^{1/3}, \quad p_0 = \frac{3 F}{2 \pi a^2}, \quad
    p(r) = p_0 \sqrt{1 - r^2 / a^2}.

The ball is a block of cells whose lower face is bent into the parabola z = r² / (2 R).
"""

import numpy as np
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from solver.lac import LocalAverageContact

E, NU, R, SIZE, PRESS = 1000.0, 0.3, 8.0, 4.0, 1.0
FORCE, STIFF = 4 * PRESS * SIZE**2, E / (2 * (1 - NU**2))
A = (3 * FORCE * R / (4 * STIFF)) ** (1 / 3)
P0 = 3 * FORCE / (2 * np.pi * A**2)
NAMES = {
    "x": lambda x: x[0] == 0,
    "y": lambda x: x[1] == 0,
    "low": lambda x: np.isclose(x[2], x[2].min()),
    "high": lambda x: np.isclose(x[2], x[2].max()),
}


def ticks(n):
    """N cells of [0, SIZE]: half of them equal, up to 1.3 a, then growing."""
    equal = 1.3 * A * np.linspace(0, 1, (n + 1) // 2 + 1)
    return np.append(equal, np.geomspace(equal[-1], SIZE, n + 2 - len(equal))[1:])


def hertz(n):
    """Radii and pressures of the facets, and the relative error of these; n cells each way."""
    axis = ticks(n + 1)
    block = skfem.MeshHex.init_tensor(axis, axis, -axis[::-1]).with_boundaries(NAMES)
    ball = skfem.MeshHex.init_tensor(ticks(n), ticks(n), ticks(n)).with_boundaries(NAMES)
    rise = (ball.p[0] ** 2 + ball.p[1] ** 2) / (2 * R) * (1 - ball.p[2] / SIZE)
    bent = skfem.MeshHex(ball.p + np.outer([0, 0, 1], rise), ball.t)
    ball = bent.with_boundaries(ball.boundaries)
    contact = LocalAverageContact(slave=(ball, "low"), master=(block, "high"))
    element = skfem.ElementVector(skfem.ElementHex1())
    a, b = (skfem.Basis(m, element, intorder=3) for m in (contact.mesh, block))
    form = linear_elasticity(*lame_parameters(E, NU))
    K = skfem.bmat([[form.assemble(a), None], [None, form.assemble(b)]], "csr")
    push = skfem.LinearForm(lambda v, _: -PRESS * v[2])
    f = np.concatenate([push.assemble(a.boundary("high")), b.zeros()])
    held = [basis.get_dofs(s).all(f"u^{k}") for basis in (a, b) for k, s in ((1, "x"), (2, "y"))]
    held = [*held[:2], *(a.N + dofs for dofs in [*held[2:], b.get_dofs("low").all("u^3")])]
    state = contact.solve(K, f, contact.matrix(a, b), D=np.concatenate(held))

    ends = ball.p[:2, ball.facets[:, ball.boundaries["low"]]]
    low, high = ends.min(axis=1), ends.max(axis=1)
    inside = (np.indices((9, 9)).reshape(2, 1, -1) + 0.5) / 9
    r = np.hypot(*(low[..., None] + (high - low)[..., None] * inside))
    exact = P0 * np.sqrt(np.maximum(1 - (r / A) ** 2, 0)).mean(axis=1)
    error = np.sqrt(contact.area @ (state.pressure - exact) ** 2 / (contact.area @ exact**2))
    return r.mean(axis=1), state.pressure, error


def visualize(n=8):
    """The pressure of each facet over its distance from the axis, and Hertz's."""
    import matplotlib.pyplot as plt

    r, pressure, _ = hertz(n)
    at, ax = np.linspace(0, A, 200), plt.subplots()[1]
    ax.plot(at, P0 * np.sqrt(1 - (at / A) ** 2), label="Hertz")
    ax.plot(r[r < 2 * A], pressure[r < 2 * A], "o", label="LAC, one pressure a facet")
    ax.set(xlabel="distance from the axis", ylabel="contact pressure")
    ax.legend()
    return ax


if __name__ == "__main__":
    (_, _, coarse), (_, found, fine) = hertz(6), hertz(10)
    print(f"largest pressure {found.max():.4g}, Hertz: {P0:.4g}; relative error of the pressures")
    print(f"{coarse:.3f}, {fine:.3f}: order {np.log(coarse / fine) / np.log(10 / 6):.2f}")
