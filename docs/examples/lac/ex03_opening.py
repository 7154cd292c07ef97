r"""A gap that closes in the middle: a bar on two supports, bent onto a block.

A beam of length 40 and height 2 lies above a stiff block, apart by 0.05, and is pressed from above.
It touches in the middle only. The contact force is the load less what the supports carry: forces
balance to round-off,

.. math:: \int p \, ds + R = q L.
"""

import numpy as np
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from solver.lac import LocalAverageContact

LENGTH, GAP, LOAD = 40.0, 0.05, 0.02
beam = skfem.MeshQuad.init_tensor(np.linspace(0, LENGTH, 41), np.linspace(0, 2, 5))
beam = beam.with_boundaries(
    {
        "under": lambda x: x[1] == 0,
        "over": lambda x: x[1] == 2,
        "ends": lambda x: (x[0] == 0) | (x[0] == LENGTH),
    }
)
block = skfem.MeshTri.init_tensor(np.linspace(0, LENGTH, 28), np.linspace(-10, 0, 8))
block = block.with_boundaries({"over": lambda x: x[1] == 0, "base": lambda x: x[1] == -10})

contact = LocalAverageContact(slave=(beam, "under"), master=(block, "over"), gap=GAP)
a, b = (skfem.Basis(m, skfem.ElementVector(m.elem())) for m in (contact.mesh, block))
form = linear_elasticity(*lame_parameters(1000.0, 0.3))
K = skfem.bmat([[form.assemble(a), None], [None, form.assemble(b)]], "csr")
push = skfem.LinearForm(lambda v, _: -LOAD * v[1])
f = np.concatenate([push.assemble(a.boundary("over")), b.zeros()])
ends, base = a.get_dofs("ends").all(), a.N + b.get_dofs("base").all()
B = contact.matrix(a, b)
state = contact.solve(K, f, B, D=np.concatenate([ends, base]))

force = state.pressure @ contact.covered
vertical = a.get_dofs("ends").all("u^2")
supports = (K @ state.u - f - B.T @ state.pressure)[vertical].sum()


def visualize():
    """The pressure along the beam."""
    import matplotlib.pyplot as plt

    ends = np.linspace(0, LENGTH, len(state.pressure) + 1)
    ax = plt.subplots()[1]
    ax.stairs(state.pressure, ends)
    ax.set(xlabel="x", ylabel="contact pressure")
    return ax


if __name__ == "__main__":
    print(f"{state.closed.sum()} of {len(state.closed)} facets touch, in {state.iterations} solves")
    print(f"contact {force:.6g} + supports {supports:.6g} = load {LOAD * LENGTH:.6g}")
