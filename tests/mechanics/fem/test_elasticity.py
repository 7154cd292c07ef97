"""Stiffness and internal forces against scikit-fem's own assembly, and exact linear fields."""

import numpy as np
import pytest
import skfem
from skfem.models.elasticity import lame_parameters as skfem_lame
from skfem.models.elasticity import linear_elasticity

import solver.lac.threads
import solver.mechanics.fem.elasticity
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.shape import shape_functions
from solver.mechanics.fem.block import volume_rule
from solver.mechanics.fem.elasticity import (
    Block,
    element_matrices,
    internal_force,
    lame_parameters,
    stiffness,
)
from solver.mechanics.fem.stress import largest_strain, nodal_stress, sizes, steepness
from tests.scenes import block_mesh

VOLUMES = [n for n, t in BY_NAME.items() if t.dim > 1]


def one_cell(name, distortion=0.08, seed=0):
    kind = BY_NAME[name]
    rng = np.random.default_rng(seed)
    points = kind.nodes + distortion * rng.uniform(-1, 1, kind.nodes.shape)
    cells = np.arange(kind.n_nodes)[None]
    return points, Block(kind, cells, np.array([1.5]), np.array([0.7]), straight=False)


@pytest.mark.parametrize("name", VOLUMES)
def test_rigid_motions_cost_no_force(name):
    points, block = one_cell(name)
    matrix = element_matrices(points, block)[0]
    dim = points.shape[1]
    turn = np.zeros((dim, dim))
    turn[0, 1], turn[1, 0] = -1.0, 1.0
    for motion in (np.ones_like(points), points @ turn.T):
        assert np.abs(matrix @ motion.ravel()).max() < 1e-13 * np.abs(matrix).max() * 10
    assert np.allclose(matrix, matrix.T, atol=1e-14 * np.abs(matrix).max())
    eigenvalues = np.linalg.eigvalsh(matrix)
    rigid = 3 if dim == 2 else 6
    assert (eigenvalues[rigid:] > 1e-6 * eigenvalues[-1]).all()


@pytest.mark.parametrize("name", VOLUMES)
def test_internal_force_is_the_product_with_the_matrix(name):
    points, block = one_cell(name)
    field = np.random.default_rng(1).normal(size=points.shape)
    product = stiffness(points, [block]) @ field.ravel()
    assert internal_force(points, [block], field).ravel() == pytest.approx(product, rel=1e-11)


def test_a_large_translation_costs_no_digits():
    points, block = one_cell("HEXA8")
    field = np.random.default_rng(1).normal(size=points.shape)
    force = internal_force(points, [block], field)
    far = internal_force(points, [block], field + 2.0**20)
    assert np.abs(far - force).max() < 2.0**20 * 4e-16 * 20 * np.abs(force).max()


@pytest.mark.parametrize("name", VOLUMES)
def test_stress_of_a_linear_field_is_exact_at_every_node(name):
    points, block = one_cell(name)
    dim = points.shape[1]
    slope = np.random.default_rng(4).normal(size=(dim, dim))
    stress = nodal_stress(points, [block], points @ slope.T)
    strain = (slope + slope.T) / 2
    exact = 1.5 * np.trace(strain) * np.eye(3)
    exact[:dim, :dim] += 2 * 0.7 * strain
    wanted = exact[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert stress == pytest.approx(np.tile(wanted, (len(points), 1)), abs=1e-12)


def varying(name):
    """A function of the reference cell at its nodes (n,), and its gradient there as recovered.

    The gradient is linear, so that a linear fit through quadrature points has it at the nodes. On
    PYRA5 no such function exists: that of ξη/(1−ζ), (η/(1−ζ), ξ/(1−ζ), ξη/(1−ζ)²), is fitted by
    multiples of η, ξ and ξη/(1−ζ), for the points are symmetric in ξ and in η.
    """
    kind = BY_NAME[name]
    x = kind.nodes
    if name == "PYRA5":
        points = volume_rule(name)[0]
        (xi, eta), top = points[:, :2].T, 1 - points[:, 2]
        product = xi * eta / top
        slope, height = (eta**2 / top).sum() / (eta**2).sum(), (product**2 / top).sum()
        edge = np.append(x[:4, 0] * x[:4, 1], 0.0)
        along = height / (product**2).sum()
        return edge, np.c_[slope * x[:, 1], slope * x[:, 0], along * edge]
    pairs = {"QUAD4": [(0, 1)], "PENTA6": [(0, 2), (1, 2)], "HEXA8": [(0, 1), (1, 2), (0, 2)]}
    every = [(i, j) for i in range(kind.dim) for j in range(i, kind.dim)]
    values, slope = np.zeros(len(x)), np.zeros_like(x)
    for factor, (i, j) in enumerate(pairs.get(name, every), start=1):
        values += factor * x[:, i] * x[:, j]
        slope[:, i] += factor * x[:, j]
        slope[:, j] += factor * x[:, i]
    return values, slope


@pytest.mark.parametrize("name", [n for n in VOLUMES if n not in ("TRIA3", "TETRA4")])
def test_a_linear_stress_is_exact_at_every_node(name):
    """In TRIA3 and TETRA4 it cannot vary; in every other type nodes have stresses of their own."""
    kind, dim = BY_NAME[name], BY_NAME[name].dim
    values, slope = varying(name)
    rng = np.random.default_rng(5)
    affine = np.eye(dim) + 0.2 * rng.uniform(-1, 1, (dim, dim))
    points, direction = kind.nodes @ affine.T, rng.uniform(1, 2, dim)
    block = Block(kind, np.arange(kind.n_nodes)[None], np.array([1.5]), np.array([0.7]))
    stress = nodal_stress(points, [block], np.outer(values, direction))
    gradient = direction[:, None] * (slope @ np.linalg.inv(affine))[:, None, :]
    strain = (gradient + np.swapaxes(gradient, 1, 2)) / 2
    wanted = 1.5 * np.einsum("nii->n", strain)[:, None, None] * np.eye(3)
    wanted[:, :dim, :dim] += 2 * 0.7 * strain
    components = wanted[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert stress == pytest.approx(components, abs=1e-12)
    neighbour = np.roll(components, 1, axis=0)
    assert np.abs(stress - neighbour).max() > 0.1


@pytest.mark.parametrize(
    ("name", "mesh", "element"),
    [
        ("TRIA3", skfem.MeshTri(), skfem.ElementTriP1()),
        ("QUAD4", skfem.MeshQuad(), skfem.ElementQuad1()),
        ("TETRA4", skfem.MeshTet(), skfem.ElementTetP1()),
        ("HEXA8", skfem.MeshHex(), skfem.ElementHex1()),
    ],
)
def test_the_matrix_is_the_one_of_scikit_fem(name, mesh, element):
    mesh = mesh.refined(1)
    kind = BY_NAME[name]
    lame, shear = lame_parameters(np.array([2000.0]), np.array([0.3]))
    assert (lame[0], shear[0]) == pytest.approx(skfem_lame(2000.0, 0.3))
    points, weights = volume_rule(name)
    basis = skfem.CellBasis(mesh, skfem.ElementVector(element), quadrature=(points.T, weights))
    theirs = linear_elasticity(lame[0], shear[0]).assemble(basis)
    # scikit-fem numbers the vertices of a cell in its own order; match them by their place.
    local = element.doflocs
    order = [int(np.abs(local - node).sum(axis=1).argmin()) for node in kind.nodes]
    cells = mesh.t.T[:, order]
    # and cells that scikit-fem made left-handed are mirrored, which moves no node
    corner = mesh.p.T[cells]
    middle = shape_functions(name).gradients(kind.nodes.mean(axis=0))
    left_handed = np.linalg.det(np.einsum("cai,aj->cij", corner, middle)) < 0
    cells[left_handed] = cells[left_handed][:, kind.mirror]
    n = len(cells)
    block = Block(kind, cells, np.repeat(lame, n), np.repeat(shear, n))
    ours = stiffness(mesh.p.T.copy(), [block])
    dofs = basis.nodal_dofs.T.ravel()
    assert np.abs(ours - theirs[dofs][:, dofs]).max() < 1e-12 * np.abs(ours).max()


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("size", [1, 20_000])
@pytest.mark.parametrize("name", ["QUAD8", "HEXA8"])
def test_parts_and_threads_change_no_number(monkeypatch, name, size, threads):
    """Cells one by one, some at a time, or all at once: every field, plane rings too."""
    mesh = block_mesh(name, name)
    kind, cells = BY_NAME[name], mesh.cells[0].data
    points, rng = mesh.points + 2.0, np.random.default_rng(1)
    lame, shear = rng.uniform(1, 2, (2, len(cells)))
    blocks = [Block(kind, cells, lame, shear, axisymmetric=kind.dim == 2)]
    field = rng.standard_normal((2, *points.shape))

    def found():
        size = sizes(points, blocks, field)
        return [
            internal_force(points, blocks, field),
            nodal_stress(points, blocks, field),
            *steepness(points, blocks),
            np.array(largest_strain(points, blocks, field[0])),
            np.array([size.highest, size.slender]),
            size.forces,
            size.stress,
        ]

    whole = found()
    monkeypatch.setattr(solver.lac.threads, "workers", lambda: threads)
    monkeypatch.setattr(solver.mechanics.fem.elasticity, "_CHUNK_BYTES", size)
    for ours, expected in zip(found(), whole, strict=True):
        np.testing.assert_allclose(ours, expected, rtol=1e-13, atol=1e-13)
