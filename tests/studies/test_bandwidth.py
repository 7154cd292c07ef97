"""Bytes of products and the bandwidth of memory: counts by hand, and a measured solve."""

from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np
import pytest
from scipy.sparse import bsr_matrix, csr_matrix

from solver.mechanics.linear import multigrid
from solver.mechanics.linear.nodal_matrix import NodalMatrix
from solver.mechanics.linear.symmetric_blocks import SymmetricBlocks
from solver.studies import bandwidth
from solver.studies.bandwidth import DOUBLE, ITERATIONS, SET_UP, SMOOTHER, STAGE, TRANSFER
from solver.studies.scaling.description import ScalingPoint, read_scaling

FILE = Path(__file__).parents[2] / "cases/scaling/scaling.yaml"


def test_a_product_moves_what_its_arrays_hold():
    """Four blocks of nine floats, four columns, three row starts; vectors of six."""
    matrix = bsr_matrix(np.ones((6, 6), dtype=np.float32), blocksize=(3, 3))
    x = np.ones(6, dtype=np.float32)
    original = multigrid.multiply
    with bandwidth.counted() as parts:
        multigrid.multiply(matrix, x, x, -1.0)
        multigrid.multiply_transposed(matrix, x)
    assert multigrid.multiply is original
    once = 4 * (4 * 9 + 4 + 3)
    assert parts[STAGE]["bytes"] == (once + 4 * 6 * 3) + (once + 4 * 6 * 2)


def test_a_product_in_double_precision_is_counted_too():
    blocks = bsr_matrix(csr_matrix(np.eye(6)), blocksize=(3, 3))
    with bandwidth.counted() as parts:
        NodalMatrix(blocks, np.arange(6)) @ np.ones((6, 2))
    assert parts[STAGE]["bytes"] == 2 * (8 * 2 * 9 + 4 * (2 + 3) + 8 * 6 * 2)
    assert SymmetricBlocks.multiply.__module__ == "solver.mechanics.linear.symmetric_blocks"


def test_half_a_matrix_moves_what_is_stored():
    """A block on the diagonal, one above it; two parts with column numbers and three row starts."""
    blocks = np.ones((1, 3, 3), dtype=np.float32)
    parts = (bsr_matrix((blocks, [k], [0, 1, 1]), shape=(6, 6)) for k in (0, 1))
    x = np.ones(6, dtype=np.float32)
    assert bandwidth.moved(SymmetricBlocks(*parts), x, x) == 2 * 4 * (9 + 1 + 3) + 3 * 4 * 6


def test_a_stage_moves_its_files_and_arrays_once(tmp_path):
    """Four nodes: places and displacement of 96 bytes, stress of 192, a cell of 32."""
    mesh = meshio.Mesh(np.zeros((4, 3)), [("tetra", np.array([[0, 1, 2, 3]]))])
    solution = SimpleNamespace(mesh=mesh, displacement=np.zeros((4, 3)), stress=np.zeros((4, 6)))
    files = [tmp_path / "mesh", tmp_path / "result"]
    for file, size in zip(files, (50, 70), strict=True):
        file.write_bytes(bytes(size))
    least = bandwidth.least_bytes(solution, 1000, *files)
    assert least.pop(STAGE) == 0
    assert least == {
        "read": 50 + 128,
        "assembly": 128 + 1000,
        "recovery": 128 + 96 + 192,
        "checks": 96 + 96 + 192,
        "write": 128 + 96 + 192 + 70,
    }


@pytest.mark.parametrize(
    ("share", "threads", "busy", "limit"),
    [
        (0.6, 2, 1.9, "memory"),
        (0.6, 2, None, "memory"),
        (0.4, 2, None, ""),
        (0.4, 2, 1.9, "arithmetic, temporary arrays"),
        (0.4, 2, 1.1, "one thread"),
        (0.4, 8, 4.0, "one thread"),
        (0.4, 2, 0.3, "waiting"),
        (0.4, 1, 1.0, "arithmetic, temporary arrays"),
    ],
)
def test_what_limits_a_stage(share, threads, busy, limit):
    assert bandwidth.Moved("write", 2.0, 2e9 * share, 1e9, threads, busy).limit == limit


def test_the_triad_is_three_arrays_over_its_time(monkeypatch):
    """Clocks that advance by a second with each look: the best of all repetitions takes one."""
    ticks = iter(range(1000))
    monkeypatch.setattr(bandwidth, "perf_counter", lambda: next(ticks))
    assert bandwidth.triad(50_000) == 3 * 8 * 50_000


@pytest.fixture
def solve(tmp_path, monkeypatch, request):
    """A small block solved by multigrid, beside a bandwidth of 1 MB/s."""
    from solver.commands.cli import main

    name = getattr(request, "param", "hexa8")
    series = next(s for s in read_scaling(FILE).series if s.name == name)
    case, mesh = tmp_path / "case.yaml", tmp_path / "mesh.vtkhdf"
    case.write_text(ScalingPoint(series, 3000).source())
    assert main(["mesh", str(case), "-o", str(mesh)]) == 0
    monkeypatch.setattr(bandwidth, "triad", lambda: 1e6)
    return bandwidth.measure({"case": str(case), "mesh": str(mesh)})


def test_the_parts_of_a_solve_add_up(solve):
    parts = solve["parts"]
    within = [parts[name]["bytes"] for name in (SMOOTHER, TRANSFER, DOUBLE)]
    assert parts[ITERATIONS]["bytes"] == sum(within)
    assert parts[STAGE]["bytes"] == parts[ITERATIONS]["bytes"] + parts[SET_UP]["bytes"]
    assert parts[STAGE]["seconds"] > parts[ITERATIONS]["seconds"] + parts[SET_UP]["seconds"]
    # Before and after the levels below each cycle has two polynomials and two residuals, each of
    # one product at least, in half the precision of the product of conjugate gradients.
    assert parts[SMOOTHER]["bytes"] > 4 * 0.4 * parts[DOUBLE]["bytes"]
    table = bandwidth.table(solve | {"outcome": "solved"})
    named = [part.name for part in table.parts]
    assert named[:5] == ["read", "assembly", STAGE, SET_UP, ITERATIONS]
    assert named[-3:] == ["recovery", "checks", "write"]
    # 27 blocks of nine numbers at a node inside, 8 at a corner.
    nodes = solve["dofs"] / 3
    assert 8 * 9 * 8 * nodes < parts["assembly"]["bytes"] < 2 * 27 * 9 * 8 * nodes
    for part in table.parts:
        assert part.share == pytest.approx(part.moved / part.seconds / 1e6)
    assert bandwidth.table({"outcome": "failed"}) is None
    assert bandwidth.table(None) is None


@pytest.mark.parametrize("solve", ["mixed-tetra10"], indirect=True)
def test_the_iterations_of_the_mixed_form_are_counted(solve):
    parts = solve["parts"]
    within = [parts[name]["bytes"] for name in (SMOOTHER, TRANSFER)]
    assert parts[ITERATIONS]["bytes"] == sum(within) > 0
    assert parts[STAGE]["bytes"] == parts[ITERATIONS]["bytes"] + parts[SET_UP]["bytes"]
