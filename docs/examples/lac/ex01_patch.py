r"""Patch test: two blocks whose meshes do not match, pressed together.

Two squares of 50 lie on each other; the upper one has six cells where the lower one has four. A
pressure of 25 acts on top, the base and the left sides are planes of symmetry. In plane strain the
exact solution is uniaxial,

.. math:: \sigma_{yy} = -25, \quad p = 25 \text{ on every facet}.

The Local Average Contact method reproduces it to round-off.
"""

import numpy as np
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from solver.lac import LocalAverageContact


def block(low, n):
    """A square of n × n cells that stands on the height `low`."""
    ticks = np.linspace(0, 50.0, n + 1)
    mesh = skfem.MeshQuad.init_tensor(ticks, low + ticks)
    return mesh.with_boundaries(
        {
            "side": lambda x: x[0] == 0,
            "bottom": lambda x: x[1] == low,
            "top": lambda x: x[1] == low + 50.0,
        }
    )


lower, upper = block(0.0, 4), block(50.0, 6)
contact = LocalAverageContact(slave=(upper, "bottom"), master=(lower, "top"))

# The slave's basis is on the mesh after the cut.
a, b = (skfem.Basis(m, skfem.ElementVector(m.elem())) for m in (contact.mesh, lower))
form = linear_elasticity(*lame_parameters(2000.0, 0.3))
K = skfem.bmat([[form.assemble(a), None], [None, form.assemble(b)]], "csr")
push = skfem.LinearForm(lambda v, _: -25.0 * v[1])
f = np.concatenate([push.assemble(a.boundary("top")), b.zeros()])
D = np.concatenate(
    [
        a.get_dofs("side").all("u^1"),
        a.N + b.get_dofs("side").all("u^1"),
        a.N + b.get_dofs("bottom").all("u^2"),
    ]
)

state = contact.solve(K, f, contact.matrix(a, b), D=D)


def visualize():
    """Both meshes, moved by five times the displacement."""
    import matplotlib.pyplot as plt
    from skfem.visuals.matplotlib import draw

    ax = plt.subplots()[1]
    for mesh, basis, u in ((contact.mesh, a, state.u[: a.N]), (lower, b, state.u[a.N :])):
        ax = draw(type(mesh)(mesh.p + 5 * u[basis.nodal_dofs], mesh.t), ax=ax)
    return ax


if __name__ == "__main__":
    print(f"pressure: {state.pressure.min():.12g} … {state.pressure.max():.12g}")
