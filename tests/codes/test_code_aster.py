"""The input of code_aster: our own reader of MED finds mesh and groups again."""

import numpy as np
import pytest

from solver.codes.code_aster import CodeAster
from solver.codes.deck import UnsupportedError, deck_of
from solver.lac.cells.catalogue import BY_MESHIO, BY_NAME
from solver.mesh import read_mesh
from tests.codes.blocks import case_of


def written(folder, cells, **more):
    deck = deck_of(*case_of(cells, cells, **more))
    CodeAster().write(deck, folder)
    return deck


def places(mesh, group, dim):
    """Centres of the members of a group, sorted."""
    parts = [
        mesh.points[block.data[members]].mean(axis=1)
        for block, members in zip(mesh.cells, mesh.cell_sets[group], strict=True)
        if len(members) and BY_MESHIO[block.type].dim == dim
    ]
    found = np.concatenate(parts)
    return found[np.lexsort(found.T.round(6))]


@pytest.mark.parametrize(
    "cells", ["TRIA6", "QUAD9", "TETRA4", "TETRA10", "HEXA8", "HEXA20", "HEXA27"]
)
def test_mesh_and_groups(cells, tmp_path):
    deck = written(tmp_path, cells)
    dim = deck.points.shape[1]
    mesh = read_mesh(tmp_path / "mesh.med")
    again = next(b.data for b in mesh.cells if BY_MESHIO[b.type].name == cells)
    # `tidy` turns every cell; node by node they are those of the deck.
    for one, other in zip(mesh.points[again], deck.points[deck.cells[cells]], strict=True):
        assert np.abs(one - other).max() < 1e-12 or sorted(one.tolist()) == sorted(other.tolist())
    for between, owners in enumerate(BY_NAME[cells].owners):
        middle = mesh.points[again][:, list(owners)].mean(axis=1)
        assert np.abs(mesh.points[again][:, between] - middle).max() < 1e-9
    for group, height in (("slave_0", 0.0), ("master_0", 0.0), ("press_0", 50.0)):
        assert places(mesh, group, dim - 1)[:, -1] == pytest.approx(height, abs=1e-9)
    held = {name for name in mesh.point_sets if name.startswith("held_")}
    assert len(held) == dim
    low = mesh.points[mesh.point_sets[f"held_{dim - 1}"]]
    assert low[:, -1] == pytest.approx(-50)
    assert len(low) == (deck.points[:, -1] < -49.9).sum()


def test_command_files(tmp_path):
    written(tmp_path, "HEXA8")
    lac, standard = ((tmp_path / f"{n}.comm").read_text() for n in ("lac", "continue"))
    assert "DECOUPE_LAC=_F(GROUP_MA_ESCL=('slave_0',))" in lac
    assert "ALGO_CONT='LAC'" in lac
    assert "DECOUPE_LAC" not in standard
    assert "ALGO_CONT='STANDARD'" in standard
    for text in (lac, standard):
        compile(text, "comm", "exec")
        assert "_F(GROUP_MA='press_0', PRES=25.0)" in text
        assert "_F(GROUP_NO='held_2', DZ=0.0)" in text
        assert "DEFI_MATERIAU(ELAS=_F(E=2000.0, NU=0.3))" in text


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"loads": [{"group": "top", "body_force": [0, -1]}]}, "loads other than constant"),
        # Sixteen nodes, as many values.
        ({"supports": [{"group": "bottom", "fix": {"y": "x + 0.01*y"}}]}, "vary from node to node"),
    ],
)
def test_what_is_not_written_is_refused(tmp_path, more, reason):
    with pytest.raises(UnsupportedError, match=reason):
        written(tmp_path, "QUAD4", **more)
