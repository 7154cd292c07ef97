r"""Hertz in space: an elastic ball with a flat top on an elastic block.

A quarter of a ball of radius 8 is pressed onto a block. Both have E = 1000 and ν = 0.3. With the
force F and E* = E / (2 (1 − ν²)) Hertz gives the radius of contact and the largest pressure,

.. math:: a = \left( \frac{3 F R}{4 E^*} \right)^{1/3}, \quad p_0 = \frac{3 F}{2 \pi a^2}.

The ball is a block of cells whose lower face is bent into the parabola z = r² / (2 R).
"""

import numpy as np
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from solver.lac import LocalAverageContact

E, NU, R, SIZE, PRESS = 1000.0, 0.3, 8.0, 4.0, 1.0


def graded(n):
    """N cells of [0, SIZE], finest at zero."""
    return SIZE * np.linspace(0, 1, n + 1) ** 1.5


def hertz(n):
    """State, contact, and the largest pressure over that of Hertz; n cells along each edge."""
    names = {
        "x": lambda x: x[0] == 0,
        "y": lambda x: x[1] == 0,
        "low": lambda x: np.isclose(x[2], x[2].min()),
        "high": lambda x: np.isclose(x[2], x[2].max()),
    }
    axis = graded(n + 1)
    block = skfem.MeshHex.init_tensor(axis, axis, -axis[::-1]).with_boundaries(names)
    ball = skfem.MeshHex.init_tensor(graded(n), graded(n), graded(n)).with_boundaries(names)
    rise = (ball.p[0] ** 2 + ball.p[1] ** 2) / (2 * R) * (1 - ball.p[2] / SIZE)
    ball = skfem.MeshHex(ball.p + np.outer([0, 0, 1], rise), ball.t).with_boundaries(
        ball.boundaries
    )

    contact = LocalAverageContact(slave=(ball, "low"), master=(block, "high"))
    a, b = (
        skfem.Basis(m, skfem.ElementVector(m.elem()), intorder=3) for m in (contact.mesh, block)
    )
    form = linear_elasticity(*lame_parameters(E, NU))
    K = skfem.bmat([[form.assemble(a), None], [None, form.assemble(b)]], "csr")
    push = skfem.LinearForm(lambda v, _: -PRESS * v[2])
    f = np.concatenate([push.assemble(a.boundary("high")), b.zeros()])
    held = [
        basis.get_dofs(axis).all(f"u^{k}") for basis in (a, b) for k, axis in ((1, "x"), (2, "y"))
    ]
    held = [*held[:2], *(a.N + dofs for dofs in held[2:])]
    held.append(a.N + b.get_dofs("low").all("u^3"))
    state = contact.solve(K, f, contact.matrix(a, b), D=np.concatenate(held))

    force, stiff = 4 * PRESS * SIZE**2, E / (2 * (1 - NU**2))
    radius = (3 * force * R / (4 * stiff)) ** (1 / 3)
    return state, contact, state.pressure.max() / (3 * force / (2 * np.pi * radius**2))


if __name__ == "__main__":
    for n in (8, 12):
        state, contact, ratio = hertz(n)
        print(f"{n}: largest pressure {ratio:.3f} of Hertz, {state.closed.sum()} facets closed")
