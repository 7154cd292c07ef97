"""NGSolve: its reference cells, what is refused and read, and NGSolve itself where installed."""

import ast
import json
from dataclasses import replace

import numpy as np
import pytest

from solver.codes.deck import UnsupportedError, deck_of
from solver.codes.run import Limits, find, run_code
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.errors import SolveError
from tests.codes.blocks import TURNED, case_of

NGSOLVE = find("ngsolve")
SCRIPT = NGSOLVE.folder / "main.py"
QUADRATIC = ("TRIA6", "TETRA10")


def test_middle_nodes_are_those_of_the_catalogue():
    """The middle node of each edge, and how many corners a quadratic cell has."""
    told = {
        n.targets[0].id: n.value
        for n in ast.parse(SCRIPT.read_text()).body
        if isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name)
    }
    kinds = told["KINDS"]
    edges = {
        ast.literal_eval(k): ast.literal_eval(v.elts[2])
        for k, v in zip(kinds.keys, kinds.values, strict=True)
    }
    assert set(edges) == set(NGSOLVE.file.cells)
    for name, pairs in edges.items():
        owners = BY_NAME[name].owners[BY_NAME[name].n_vertices :]
        assert [set(pair) for pair in pairs] == [set(pair) for pair in owners]
    assert ast.literal_eval(told["CORNERS"]) == {
        name: BY_NAME[name].n_vertices for name in ("SEG3", *QUADRATIC)
    }


@pytest.mark.parametrize(
    ("bottom", "top", "more", "reason"),
    [
        ("QUAD8", "QUAD8", {}, "QUAD8: not written for ngsolve"),
        ("TRIA6", "QUAD4", {}, "linear and quadratic cells in one mesh: not written for NGSolve"),
        ("QUAD4", "QUAD4", {"plane": "axisymmetric"}, "axisymmetric bodies: not written"),
        ("QUAD4", "QUAD4", TURNED, "supports across the axes: NGSolve's space holds components"),
    ],
)
def test_what_is_refused(tmp_path, bottom, top, more, reason):
    with pytest.raises(UnsupportedError, match=reason):
        NGSOLVE.write(deck_of(*case_of(bottom, top, **more)), tmp_path)


def test_curved_sides_are_refused(tmp_path):
    deck = deck_of(*case_of("TRIA6", "TRIA6"))
    NGSOLVE.write(deck, tmp_path)
    points = deck.points.copy()
    points[deck.cells["TRIA6"][0, 3]] += 1e-3
    with pytest.raises(UnsupportedError, match="curved sides of cells: not written for NGSolve"):
        NGSOLVE.write(replace(deck, points=points), tmp_path)


def test_the_penalty_follows_the_size_of_a_face(tmp_path):
    NGSOLVE.write(deck_of(*case_of("QUAD4", "QUAD4")), tmp_path)
    told = json.loads((tmp_path / "deck.json").read_text())
    assert told["face_size"] == pytest.approx(50 / 3)
    assert told["flat"]
    # Rigid bodies have the last material.
    assert told["materials"] == [{"young": 2000.0, "poisson": 0.3}, {"young": 1.0, "poisson": 0.0}]


def mesh_of(cells):
    """The blocks of prisms, which need the kind of their faces of contact."""
    if cells != "PENTA6":
        return {}
    one, other = (
        {"cells": cells, "contact": faces, "divisions": [n] * 3}
        for faces, n in (("TRIA3", 3), ("QUAD4", 2))
    )
    return {"mesh": {"recipe": "blocks", "size": 50, "bottom": one, "top": other}}


@pytest.mark.skipif(not NGSOLVE.version(), reason="NGSolve is not installed")
@pytest.mark.parametrize("cells", NGSOLVE.file.cells)
def test_ngsolve_solves_it(cells, tmp_path):
    """Its integrals over nonmatching faces leave some per cent of pressure on coarse meshes."""
    deck = deck_of(*case_of(cells, cells, **mesh_of(cells)))
    found = run_code(NGSOLVE, deck, tmp_path, Limits())
    dim = deck.points.shape[1]
    slave = np.unique(np.concatenate([b.nodes.ravel() for b in deck.pairs[0].slave]))
    assert found.pressure.nodes.tolist() == slave.tolist()
    assert found.pressure.values == pytest.approx(25.0, rel=0.2)
    # Shortened by 25/2000 of 100, in plane strain by (1 - 0.3²) of this; the overlap is 25/100,000.
    top = found.displacement.values[:, -1].min()
    assert top == pytest.approx(-1.25 * (0.91 if dim == 2 else 1) - 2.5e-4, abs=1e-3)
    expected = [0, -25, -7.5, 0, 0, 0] if dim == 2 else [0, 0, -25, 0, 0, 0]
    away = np.abs(deck.points[:, -1]) > 49.9
    assert np.abs(found.stress.values[away] - expected).max() < 0.3


@pytest.mark.skipif(not NGSOLVE.version(), reason="NGSolve is not installed")
def test_a_body_pulled_off_does_not_converge(tmp_path):
    """Nothing holds the upper body then."""
    loads = [{"group": "press", "pressure": -25.0}]
    with pytest.raises(SolveError, match="no convergence"):
        run_code(NGSOLVE, deck_of(*case_of("QUAD4", "QUAD4", loads=loads)), tmp_path, Limits())


@pytest.mark.skipif(not NGSOLVE.version(), reason="NGSolve is not installed")
@pytest.mark.parametrize("cells", ["TRIA6", "TETRA10", "HEXA8"])
def test_stress_of_a_linear_displacement(cells, tmp_path):
    """All six components by hand: 2 μ ε + λ tr ε, both blocks held and apart."""
    deck = deck_of(*case_of(cells, cells))
    dim = deck.points.shape[1]
    gradient = 1e-4 * np.array([[1, 2, 5], [3, -4, 7], [6, 4, 2]])[:dim, :dim]
    held = deck.points @ gradient.T
    upper = deck.points[:, -1] > 1e-9
    upper[np.concatenate([b.nodes.ravel() for b in deck.pairs[0].master])] = True
    held[upper, -1] += 1.0
    found = run_code(NGSOLVE, replace(deck, held=held), tmp_path, Limits())
    strain = np.zeros((3, 3))
    strain[:dim, :dim] = (gradient + gradient.T) / 2
    mu, lame = 2000 / 2.6, 2000 * 0.3 / (1.3 * 0.4)
    stress = 2 * mu * strain + lame * np.trace(strain) * np.eye(3)
    expected = stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert np.abs(found.stress.values - expected).max() < 1e-9
