"""The patch test, held to round-off over all pairs of cell types and whatever keeps it a patch."""

from dataclasses import replace

import numpy as np
import pytest

from solver.lac import operator
from solver.mesh import generate
from solver.simulation.simulate import simulate
from tests.scenes import block_case, block_mesh, errors, moved, with_points

ROUND_OFF = {
    "pressure": 1e-12,
    "stress": 1e-12,
    "displacement": 1e-12,
    "gap": 1e-14,
    "coverage": 1e-12,
    "balance": 1e-12,
}


def assert_exact(solution, size=1.0, **scaled):
    found = errors(solution, size, **scaled)
    assert {k: v for k, v in found.items() if not v < ROUND_OFF[k]} == {}
    assert all(zone.closed.all() for zone in solution.zones)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(
    ("cells", "contact"),
    [("PENTA6", "QUAD4"), ("PENTA15", "TRIA6"), ("PYRA5", "TRIA3"), ("PYRA13", "QUAD8")],
)
def test_blocks_of_many_boxes_of_prisms_and_pyramids(cells, contact, swapped):
    top = {"cells": cells, "contact": contact, "divisions": [2, 3, 2]}
    bottom = {"cells": "HEXA8", "divisions": [3, 2, 1]}
    mesh = generate({"recipe": "blocks", "size": 1.0, "bottom": bottom, "top": top}, "case.yaml")
    assert_exact(simulate(block_case(3).as_solved(swapped), mesh))


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("share", [0.08, 0.15])
def test_strongly_bent_faces(share, swapped):
    """Nodes moved by a share of an edge: coverage, which nothing corrects, stays one."""
    mesh = moved(block_mesh("HEXA20", "HEXA20"), share / 3)
    assert_exact(simulate(block_case(3).as_solved(swapped), mesh))


@pytest.mark.parametrize("share", [0.02, 0.08])
def test_segments_that_are_lost_are_seen(monkeypatch, share):
    """Three per cent of the area of one pair's segments in every four: nothing makes up for it."""
    true = operator.intersect

    def losing(*given):
        return [replace(s, weight=np.where(np.arange(len(s.gap)) % 4 == 0, 0.88, 1.0)[:, None]
                        * s.weight) for s in true(*given)]  # fmt: skip

    monkeypatch.setattr(operator, "intersect", losing)
    found = errors(simulate(block_case(3), moved(block_mesh("HEXA20", "HEXA20"), share / 3)))
    assert found["coverage"] > 0.01
    assert found["pressure"] > 1e-3


@pytest.mark.parametrize("shift", [0.0, 1e-15, 1e-12, 1e-8, 1e-4])
def test_coincident_and_nearly_coincident_meshes(shift):
    """Slivers of every size between two meshes that all but match."""
    mesh = block_mesh("HEXA8", "HEXA8", (3, 3))
    points = mesh.points.copy()
    inner = (points[:, 2] == 0) & (points[:, :2] > 0.1).all(axis=1) & (points < 0.9).all(axis=1)
    inner[np.unique(mesh.cells[0].data[mesh.cell_sets["bottom"][0]])] = False
    points[inner, :2] += shift * np.array([0.3, -0.7])
    assert inner.sum() == 4
    assert_exact(simulate(block_case(3), with_points(mesh, points)))


def test_a_multiplier_without_the_cut_would_still_pass_but_the_master_must_be_whole():
    """A master face taken away must be seen: coverage falls and the pressure is wrong."""
    mesh = block_mesh("HEXA8", "HEXA8")
    faces = mesh.cell_sets["top_contact"]
    mesh.cell_sets["top_contact"] = [part[1:] for part in faces]
    solution = simulate(block_case(3), mesh)
    assert errors(solution)["coverage"] > 0.1
    assert errors(solution)["pressure"] > 1e-3
