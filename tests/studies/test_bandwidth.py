"""Bytes of products and the bandwidth of memory: counts by hand, and a measured solve."""

from pathlib import Path

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


def test_the_triad_is_three_arrays_over_its_time(monkeypatch):
    """Clocks that advance by a second with each look: the best of all repetitions takes one."""
    ticks = iter(range(1000))
    monkeypatch.setattr(bandwidth, "perf_counter", lambda: next(ticks))
    assert bandwidth.triad(50_000) == 3 * 8 * 50_000


@pytest.fixture
def solve(tmp_path, monkeypatch):
    """A small block solved by multigrid, beside a bandwidth of 1 MB/s."""
    from solver.commands.cli import main

    series = next(s for s in read_scaling(FILE).series if s.name == "hexa8")
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
    assert [part.name for part in table.parts][:3] == [STAGE, SET_UP, ITERATIONS]
    for part in table.parts:
        assert part.share == pytest.approx(part.moved / part.seconds / 1e6)
    assert bandwidth.table({"outcome": "failed"}) is None
    assert bandwidth.table(None) is None
