"""Compiled loops over cells: against NumPy's, a cube known by hand, and on any threads."""

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_MESHIO, BY_NAME
from solver.lac.errors import SolveError
from solver.mechanics.fem import cell_loops
from solver.mechanics.fem.block import Block
from solver.mechanics.fem.elasticity import internal_force, stiffness
from solver.mechanics.fem.stress import largest_strain, nodal_stress, sizes, steepest
from tests.scenes import block_mesh, grid

SOLID = [name for name, kind in BY_NAME.items() if kind.dim == 3]


def choose(loops, monkeypatch, threads=1):
    """With the compiled loops or without, on so many threads."""
    monkeypatch.setattr(cell_loops, "_LEAST", 1 if loops else 1 << 40)
    monkeypatch.setattr(cell_loops, "workers", lambda: threads)
    monkeypatch.setattr("solver.lac.threads.workers", lambda: threads)


def scattered(name):
    """Two blocks of cells with bent edges and any materials, nodes numbered at random."""
    mesh, rng = block_mesh(name, name), np.random.default_rng(0)
    number, points = rng.permutation(len(mesh.points)), np.empty_like(mesh.points)
    points[number] = mesh.points + 0.01 * rng.uniform(-1, 1, mesh.points.shape)
    blocks = []
    for group in mesh.cells:
        lame, shear = rng.uniform(1, 2, (2, len(group.data)))
        kind = BY_MESHIO[group.type]
        if kind.dim == 3:
            blocks.append(Block(kind, number[group.data], lame, shear, straight=False))
    return points, blocks, rng.standard_normal((2, *points.shape))


def found(points, blocks, field):
    matrix = stiffness(points, blocks)
    force, stress = internal_force(points, blocks, field), nodal_stress(points, blocks, field)
    size = sizes(points, blocks, field)
    largest = np.array([size.highest]), np.array([size.slender])
    single = stiffness(points, blocks, single=True)
    return matrix.data, single.data, force, stress, size.forces, size.stress, *largest


@pytest.mark.parametrize("name", SOLID)
def test_loops_are_numpys_sums_whatever_the_threads(name, monkeypatch):
    about = scattered(name)
    choose(False, monkeypatch)
    expected = found(*about)
    choose(True, monkeypatch)
    alone = found(*about)
    for ours, numpys in zip(alone, expected, strict=True):
        close = 100 * np.finfo(numpys.dtype).eps * np.abs(numpys).max()
        np.testing.assert_allclose(ours, numpys, rtol=0, atol=close)
    for threads in (2, 3, 8):
        choose(True, monkeypatch, threads)
        for ours, one in zip(found(*about), alone, strict=True):
            np.testing.assert_array_equal(ours, one)


def stretched_cube(lame, shear, parts):
    """Eight cells, u = x as the first of so many parts (parts, 27, 3) of the displacement."""
    points, cells = grid(2)
    block = Block(BY_NAME["HEXA8"], cells, np.full(8, lame), np.full(8, shear))
    field = np.zeros((parts, *points.shape))
    field[0, :, 0] = points[:, 0]
    return points, block, field


def test_a_stretched_cube_by_hand(monkeypatch):
    """u = x: σ = (λ + 2μ, λ, λ); a corner of a cell carries a quarter of each face's force."""
    choose(True, monkeypatch)
    lame, shear = 3.0, 0.5
    points, block, field = stretched_cube(lame, shear, 2)
    normal = np.array([lame + 2 * shear, lame, lame])
    stress = nodal_stress(points, [block], field)
    np.testing.assert_allclose(stress, [[*normal, 0, 0, 0]] * len(points), atol=1e-14)
    side = 2 * points - 1
    share = np.where(np.abs(side) == 1, 1, 2) / 4
    area = np.stack([share[:, [1, 2]], share[:, [0, 2]], share[:, [0, 1]]]).prod(axis=2).T
    force = internal_force(points, [block], field)
    np.testing.assert_allclose(force, normal * side * area, atol=1e-15)
    product = stiffness(points, [block]) @ field[0].ravel()
    np.testing.assert_allclose(product, force.ravel(), atol=1e-14)


def test_the_sizes_of_a_stretched_cube_by_hand(monkeypatch):
    """u = x in cells of edge ½: slopes √3/2 at 8 nodes, apart by ½ at 4 of them."""
    choose(True, monkeypatch)
    lame, shear = 3.0, 0.5
    points, block, field = stretched_cube(lame, shear, 1)
    found, slope = sizes(points, [block], field), np.sqrt(3) / 2
    term = (lame + 2 * shear) * slope * 4 / 2
    around = np.where(np.abs(2 * points - 1) == 1, 1, 2).prod(axis=1)
    assert found.highest == pytest.approx(term, rel=1e-14)
    assert found.slender == pytest.approx(term * slope * np.sqrt(3) / 2, rel=1e-14)
    np.testing.assert_allclose(found.forces, around * term * slope / 8, rtol=1e-14)
    norm = np.sqrt((lame + 2 * shear) ** 2 + 2 * lame**2)
    np.testing.assert_allclose(found.stress, norm, rtol=1e-14)


@pytest.mark.parametrize("values", [(3, -2, 1), (-4, -4, 1), (2, 2, -1), (0, 0, -5), (1, 1, 1)])
def test_the_largest_principal_strain_and_rotation_are_known(values):
    """Equal principal values too; the gradient of u is the strain plus a turn by 0.2."""
    points, cells = grid(2)
    axes = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turn = 0.2 * np.cross(np.eye(3), axes[1])
    gradient = axes @ np.diag(values) @ axes.T + turn
    block = Block(BY_NAME["HEXA8"], cells, np.ones(8), np.ones(8))
    found = largest_strain(points, [block], points @ gradient.T)
    assert found == pytest.approx((np.abs(values).max(), 0.2), rel=1e-13)


def test_the_steepest_cell_is_the_smallest_cube():
    """The gradient of each of eight nodes is (±1, ±1, ±1) / (4 h) in the middle."""
    points, cells = grid(2)
    points = np.vstack([points, points / 4])
    cells = np.vstack([cells, cells + len(points) // 2])
    edge = np.ptp(points[cells[-1]], axis=0)[0]
    block = Block(BY_NAME["HEXA8"], cells, np.ones(16), np.ones(16))
    assert steepest(points, [block]) == pytest.approx(2 * np.sqrt(3) / edge, rel=1e-14)


def test_an_inverted_cell_is_refused(monkeypatch):
    choose(True, monkeypatch, 2)
    points, cells = grid(2)
    cells[5] = cells[5, [4, 5, 6, 7, 0, 1, 2, 3]]
    about = points, [Block(BY_NAME["HEXA8"], cells, np.ones(8), np.ones(8))]
    for compute, *field in (
        (stiffness,),
        (steepest,),
        *((call, points) for call in (internal_force, nodal_stress, sizes, largest_strain)),
    ):
        with pytest.raises(SolveError, match="HEXA8 cells are inverted"):
            compute(*about, *field)


def test_small_and_plane_meshes_are_left_to_numpy():
    solid, plane = ([Block(BY_NAME[name], *[np.empty(0)] * 3)] for name in ("TETRA4", "QUAD4"))
    assert cell_loops.serve(20_000, solid)
    assert not cell_loops.serve(19_999, solid)
    assert not cell_loops.serve(1_000_000, plane)
