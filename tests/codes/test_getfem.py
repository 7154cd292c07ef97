"""GetFEM: the order of nodes in its script, what is refused, and GetFEM itself where installed."""

import ast
from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import load_case
from solver.codes.deck import UnsupportedError, deck_of
from solver.codes.run import Limits, find, run_case, run_code
from solver.lac.cells.catalogue import BY_NAME
from solver.verification.run import mesh_of
from tests.codes.blocks import case_of

CASES = Path(__file__).parents[2] / "cases"
GETFEM = find("getfem")
CELLS = GETFEM.file.cells
SCRIPT = GETFEM.folder / "main.py"


def test_nodes_along_x_first_then_y_then_z():
    """GetFEM counts the nodes of its reference cells in this order."""
    tree = ast.parse(SCRIPT.read_text())
    [kinds] = [
        n.value for n in tree.body if isinstance(n, ast.Assign) and n.targets[0].id == "KINDS"
    ]
    told = ast.literal_eval(kinds)
    assert set(told) == set(CELLS)
    for name, (_, order) in told.items():
        assert order == np.lexsort(BY_NAME[name].nodes.T).tolist()


@pytest.mark.parametrize(
    ("cells", "plane", "reason"),
    [
        ("QUAD9", "strain", "QUAD9: not written for getfem"),
        ("QUAD4", "axisymmetric", "axisymmetric bodies: not written for deck.json"),
    ],
)
def test_what_is_refused(tmp_path, cells, plane, reason):
    with pytest.raises(UnsupportedError, match=reason):
        GETFEM.write(deck_of(*case_of(cells, cells, plane=plane)), tmp_path)


@pytest.mark.skipif(not GETFEM.version(), reason="GetFEM is not installed")
@pytest.mark.parametrize("cells", CELLS)
def test_getfem_solves_it(cells, tmp_path):
    """Its integrals over nonmatching faces leave 2 % at most on these coarse meshes."""
    deck = deck_of(*case_of(cells, cells))
    found = run_code(GETFEM, deck, tmp_path, Limits())
    dim = deck.points.shape[1]
    assert found.pressure.values == pytest.approx(25.0, rel=0.002)
    assert found.pressure.values.mean() == pytest.approx(25.0, rel=0.002)
    lowest = found.displacement.values[:, dim - 1].min()
    assert lowest == pytest.approx(-1.25 * (0.91 if dim == 2 else 1), rel=2e-3)
    below = found.stress.places[:, dim - 1] < -49.9
    across = 0.0 if dim == 3 else -7.5
    expected = [0, 0, -25, 0, 0, 0] if dim == 3 else [0, -25, across, 0, 0, 0]
    assert np.abs(found.stress.values[below] - expected).max() < 1.0


@pytest.mark.skipif(not GETFEM.version(), reason="GetFEM is not installed")
def test_contact_closes_a_gap_wider_than_a_share_of_a_cell(tmp_path):
    """The parabola is 0.0125 below the block at its ends: a quarter of a cell of the master."""
    case = load_case(CASES / "manufactured" / "quad8.yaml")
    verdict = run_case(GETFEM, case, mesh_of(case), tmp_path)
    assert verdict.sound, verdict.reason
