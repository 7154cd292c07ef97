"""The input of Kratos by hand, what is read of its result, and Kratos itself where installed."""

import json
import runpy

import numpy as np
import pytest

from solver.codes.deck import UnsupportedError, deck_of
from solver.codes.run import Limits, find, run_code
from solver.lac.errors import SolveError
from tests.codes.blocks import case_of

KRATOS = find("kratos")
SCRIPT = runpy.run_path(str(KRATOS.folder / "main.py"))
needs_kratos = pytest.mark.skipif(not KRATOS.version(), reason="Kratos is not installed")


def blocks_of(text):
    """The rows of each innermost block of an mdpa file, under its words after `Begin`."""
    found, open_blocks = {}, []
    for line in text.splitlines():
        if line.startswith("Begin"):
            open_blocks.append(line.removeprefix("Begin "))
        elif line.startswith("End"):
            open_blocks.pop()
        else:
            found.setdefault(" / ".join(open_blocks), []).append(line.split())
    assert not open_blocks
    return found


def written(folder, cells="QUAD4", **more):
    deck = deck_of(*case_of(cells, cells, **more))
    KRATOS.write(deck, folder)
    told = json.loads((folder / "deck.json").read_text())
    return deck, told, blocks_of("\n".join(SCRIPT["mesh_lines"](told)))


@pytest.mark.parametrize(
    ("cells", "kind", "faces"),
    [
        ("TRIA3", "SmallDisplacementElement2D3N", "LineCondition2D2N"),
        ("QUAD4", "SmallDisplacementElement2D4N", "LineCondition2D2N"),
        ("TETRA4", "SmallDisplacementElement3D4N", "SurfaceCondition3D3N"),
        ("HEXA8", "SmallDisplacementElement3D8N", "SurfaceCondition3D4N"),
    ],
)
def test_mesh_surfaces_and_loads(tmp_path, cells, kind, faces):
    deck, _, blocks = written(tmp_path, cells)
    dim = deck.points.shape[1]
    assert len(blocks["Nodes"]) == len(deck.points)
    [(_, connectivity)] = deck.cells.items()
    rows = np.array(blocks[f"Elements {kind}"], dtype=int)
    assert (rows[:, 2:] == connectivity + 1).all()
    assert (rows[:, 1] == 1).all()
    slave = {int(n) for (n,) in blocks["SubModelPart slave_0 / SubModelPartNodes"]}
    both = {int(n) for (n,) in blocks["SubModelPart contact_0 / SubModelPartNodes"]}
    bottom = {n + 1 for b in deck.pairs[0].slave for n in b.nodes.ravel().tolist()}
    top = {n + 1 for b in deck.pairs[0].master for n in b.nodes.ravel().tolist()}
    assert (slave, both) == (bottom, bottom | top)
    # Faces of the slave and of the master, turned outward: nodes of the deck.
    [pair] = deck.pairs
    expected = [row for block in (*pair.slave, *pair.master) for row in (block.nodes + 1).tolist()]
    assert [list(map(int, row[2:])) for row in blocks[f"Conditions {faces}"]] == expected
    # 25 MPa on 50 mm, or on 50 × 50 mm.
    force = sum(float(v) for *_, v in blocks[f"NodalData POINT_LOAD_{'XYZ'[dim - 1]}"])
    assert force == pytest.approx(-25 * 50 ** (dim - 1))
    low = np.flatnonzero(deck.points[:, -1] < -49.9) + 1
    held = blocks[f"NodalData DISPLACEMENT_{'XYZ'[dim - 1]}"]
    assert [(int(n), fixed, float(v)) for n, fixed, v in held] == [(n, "1", 0.0) for n in low]


def test_linear_theory_and_materials(tmp_path):
    materials = {"bottom": {"young": 1.0, "poisson": 0.1}, "top": {"young": 2.0, "poisson": 0.2}}
    _, told, _ = written(tmp_path, materials=materials)
    assert SCRIPT["project"](told)["solver_settings"]["move_mesh_flag"] is False
    told = [law["Material"]["Variables"] for law in SCRIPT["laws"](told)["properties"]]
    assert [(v["YOUNG_MODULUS"], v["POISSON_RATIO"]) for v in told] == [(1.0, 0.1), (2.0, 0.2)]


@pytest.mark.parametrize(
    ("cells", "zone", "reason"),
    [
        ("QUAD8", {}, "QUAD8: not written for kratos"),
        ("QUAD4", {"interference": 0.1}, "an initial gap other than as meshed: not in Kratos"),
    ],
)
def test_what_kratos_has_not_is_refused(tmp_path, cells, zone, reason):
    sides = {"slave": "bottom_contact", "master": "top_contact"}
    with pytest.raises(UnsupportedError, match=reason):
        written(tmp_path, cells, contact=[{"name": "i", **sides, **zone}])


def test_the_result_is_read(tmp_path):
    deck, *_ = written(tmp_path)
    found = {"displacement": [[1, 1.0, 2.0, 0.0]], "pressure": [[2, 25.0]]}
    found["stress"] = [[n, 10.0, 20.0, 3.0] for n in range(len(deck.points))]
    (tmp_path / "result.json").write_text(json.dumps(found))
    result = KRATOS.read(deck, tmp_path)
    # Plane strain: zz = 0.3 (10 + 20).
    assert result.stress.values[0].tolist() == pytest.approx([10, 20, 9, 3, 0, 0])
    assert (result.displacement.nodes[0], *result.displacement.values[0]) == (1, 1.0, 2.0)
    assert (result.pressure.nodes.tolist(), result.pressure.values.tolist()) == ([2], [25.0])
    (tmp_path / "result.json").write_text("{")
    with pytest.raises(SolveError, match=r"it wrote no result\.json"):
        KRATOS.read(deck, tmp_path)


@needs_kratos
@pytest.mark.parametrize(("cells", "error"), [("QUAD4", 1e-11), ("HEXA8", 1.0)])
def test_kratos_solves_it(tmp_path, cells, error):
    """Exact in 2D; in 3D the pressures at the rim are off."""
    result = run_code(KRATOS, deck_of(*case_of(cells, cells)), tmp_path, Limits())
    assert np.abs(result.pressure.values / 25 - 1).max() < error
    assert result.displacement.values[:, -1].min() == pytest.approx(
        -1.25 * (0.91 if cells == "QUAD4" else 1), rel=min(error, 0.02)
    )
