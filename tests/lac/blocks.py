"""Two blocks of scikit-fem's meshes, one pressed on the other."""

from itertools import product

import numpy as np
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

FORM = linear_elasticity(*lame_parameters(2000.0, 0.3))
MESHES = {
    2: [skfem.MeshTri1, skfem.MeshTri2, skfem.MeshQuad1, skfem.MeshQuad2],
    3: [skfem.MeshTet1, skfem.MeshTet2, skfem.MeshHex1, skfem.MeshHex2],
}
PAIRS = [(dim, *pair) for dim, kinds in MESHES.items() for pair in product(kinds, repeat=2)]


def block(kind, dim, n, low, size=50.0, rows=None):
    """A block of n cells each way that stands on the height `low`, half as high as wide.

    `rows`: cells along y, where their number is another one.
    """
    levels = n if dim == 2 else 1
    axes = [np.linspace(0, size, k + 1) for k in (n, rows or n)[: dim - 1]]
    axes.append(np.linspace(low, low + size / 2, levels + 1))
    linear = next(k for k in MESHES[dim] if issubclass(kind, k))
    mesh = linear.init_tensor(*axes)
    mesh = mesh if kind is linear else kind.from_mesh(mesh)
    sides = {
        "bottom": lambda x: np.isclose(x[-1], low),
        "top": lambda x: np.isclose(x[-1], low + size / 2),
    }
    sides |= {f"side{k}": lambda x, k=k: np.isclose(x[k], 0) for k in range(dim - 1)}
    return mesh.with_boundaries(sides)


def basis_on(mesh):
    return skfem.Basis(mesh, skfem.ElementVector(mesh.elem()))


def pressed(contact, lower, dim, load=lambda x: 25.0 + 0 * x[0], free=False):
    """The state of two blocks, the upper one pressed by `load`, and both bases.

    `free`: two vertices of the upper one are held, in place of its sides, so that it may turn.
    """
    a, b = basis_on(contact.mesh), basis_on(lower)
    K = skfem.bmat([[FORM.assemble(a), None], [None, FORM.assemble(b)]], "csr")
    push = skfem.LinearForm(lambda v, w: -load(w.x) * v[dim - 1])
    f = np.concatenate([push.assemble(a.boundary("top")), b.zeros()])
    held = [a.get_dofs(f"side{k}").all(f"u^{k + 1}") for k in range(dim - 1)]
    if free:
        held = [a.nodal_dofs[k, contact.mesh.p[k] == 0][:1] for k in (0, 1)] + [
            a.nodal_dofs[1, contact.mesh.p[0] == contact.mesh.p[0].max()][:1]
        ]
    held += [a.N + b.get_dofs(f"side{k}").all(f"u^{k + 1}") for k in range(dim - 1)]
    held.append(a.N + b.get_dofs("bottom").all(f"u^{dim}"))
    return contact.solve(K, f, contact.matrix(a, b), D=np.concatenate(held)), a, b
