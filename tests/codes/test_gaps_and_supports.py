"""What cases prescribe beyond the patch test, by hand and by each code that is installed.

Blocks of 50 mm on each other, E = 2000, ν = 0.3: shortened by 1.25 mm they press with 25 MPa.
"""

import json

import numpy as np
import pytest

from solver.codes import calculix
from solver.codes.calculix import CalculiX, deck_lines
from solver.codes.code_aster import CodeAster
from solver.codes.deck import UnsupportedError, deck_of
from solver.codes.plain import Plain
from solver.codes.run import Limits, find, run_code
from tests.codes.blocks import TURNED, case_of

SIDES = {"name": "i", "slave": "bottom_contact", "master": "top_contact"}
CODES = [
    pytest.param(code, marks=pytest.mark.skipif(not code.version(), reason="not installed"))
    for code in (CalculiX(), find("getfem"), find("ngsolve"))
]


def pressed(by, clearance=None, interference=0.0, cells="QUAD4", **more):
    """The upper block moved down by `by`, over an initial gap."""
    supports = [{"group": "symx", "fix": ["x"]}, {"group": "base", "fix": ["y"]}]
    zone = SIDES | {"interference": interference}
    zone |= {} if clearance is None else {"clearance": clearance}
    more = {"supports": [*supports, {"group": "press", "fix": {"y": -by}}], "loads": []} | more
    return case_of(cells, cells, contact=[zone], **more)


def slave_pressures(code, deck, folder):
    found = run_code(code, deck, folder, Limits()).pressure
    slave = np.unique(np.concatenate([b.nodes.ravel() for b in deck.pairs[0].slave]))
    if found.nodes is not None:
        return found.values[np.isin(found.nodes, slave)]
    return found.values


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize(
    ("cells", "gap"),
    [
        ("QUAD4", {"clearance": "0.1 + 0*x"}),
        ("TRIA6", {"interference": -0.1}),
    ],
    ids=["by place", "beside the meshed one"],
)
def test_an_initial_gap(code, cells, gap, tmp_path):
    """2000 · 1.25 / 100 in uniaxial stress, over 1 − 0.3² in plane strain."""
    deck = deck_of(*pressed(1.35, cells=cells, **gap), layer=code.layer)
    values = slave_pressures(code, deck, tmp_path)
    # NGSolve's integrals leave some per cent on coarse quadratic meshes.
    loose = 0.15 if code.name == "ngsolve" else 2e-3
    assert values == pytest.approx(25 / 0.91, rel=loose)
    assert values.mean() == pytest.approx(25 / 0.91, rel=max(2e-3, loose / 10))


def test_gaps_by_place(tmp_path):
    """0.01 x² at each node of the slave, in the deck, its JSON, and the layer for CalculiX."""
    deck = deck_of(*pressed(1.0, clearance="0.01*x**2", cells="QUAD8"), layer=True)
    [pair] = deck.pairs
    known = np.flatnonzero(~np.isnan(pair.gap))
    assert pair.gap[known] == pytest.approx(0.01 * deck.points[known, 0] ** 2)
    Plain().write(deck, tmp_path)
    [zone] = json.loads((tmp_path / "deck.json").read_text())["contact"]
    assert dict(map(tuple, zone["gap"])) == dict(zip(known, pair.gap[known], strict=True))
    longer, below = calculix.with_layers(deck)
    outer = np.unique(np.concatenate([b.nodes.ravel() for b in longer.pairs[0].slave]))
    assert longer.points[outer, 1] == pytest.approx(-0.01 * longer.points[outer, 0] ** 2)
    assert set(below[outer - len(deck.points)]) == set(known)
    # A face of the layer is a face of its cell, turned outward: up.
    [block] = longer.pairs[0].slave
    faces = longer.cells[block.owner_type.name][block.owner][
        :, block.owner_type.faces[block.local[0]].nodes
    ]
    assert (faces == block.nodes).all()
    a, b, c = (longer.points[block.nodes[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 1] > 0).all()
    equations = [line for line in deck_lines(deck) if line.endswith(", -1.")]
    assert len(equations) == 3 * len(below)


def test_a_gap_by_place_on_curved_faces_is_refused():
    mesh = {"recipe": "hertz", "radius": 50, "size": 25, "core": 3, "share": 0.5}
    mesh |= {side: {"cells": "QUAD4", "divisions": [4, 2]} for side in ("bottom", "top")}
    deck = deck_of(*pressed(1.0, clearance="0.01*x**2", mesh=mesh), layer=True)
    with pytest.raises(UnsupportedError, match="initial gap by place on curved faces"):
        list(deck_lines(deck))


def tubes(clearance):
    """Two tubes of QUAD8, one in the other, under 25 MPa from inside."""
    mesh = {"recipe": "rings", "radii": [20, 30, 40]}
    mesh |= {
        "bottom": {"cells": "QUAD8", "divisions": [12, 3]},
        "top": {"cells": "QUAD8", "divisions": [9, 3]},
    }
    return case_of(
        "QUAD8",
        "QUAD8",
        mesh=mesh,
        supports=[{"group": "symx", "fix": ["x"]}, {"group": "farx", "fix": ["y"]}],
        loads=[{"group": "base", "pressure": 25.0}],
        contact=[SIDES | {} if clearance is None else SIDES | {"clearance": clearance}],
    )


@pytest.mark.skipif(not CalculiX().version(), reason="not installed")
def test_curved_surfaces_that_fit_are_left_as_meshed(tmp_path):
    """Lamé's 25 · 20² (40² − 30²) / (30² (40² − 20²)); `*CLEARANCE` gives pressures up to 25."""
    deck = deck_of(*tubes(0.0), layer=True)
    assert not any("*CLEARANCE" in line for line in deck_lines(deck))
    assert slave_pressures(CalculiX(), deck, tmp_path) == pytest.approx(6.4814815, rel=0.1)
    flat = deck_of(*pressed(1.0, clearance=0.1), layer=True)
    [line] = [line for line in deck_lines(flat) if "*CLEARANCE" in line]
    assert line.endswith("VALUE=0.1")


def test_another_gap_than_the_meshed_one_on_curved_faces_is_refused():
    with pytest.raises(UnsupportedError, match="not the meshed one"):
        list(deck_lines(deck_of(*tubes(0.01), layer=True)))


@pytest.mark.parametrize("code", CODES[:2])
def test_supports_across_the_axes(code, tmp_path):
    """The patch test, turned."""
    deck = deck_of(*case_of("QUAD4", "QUAD4", **TURNED), layer=code.layer)
    assert deck.oblique
    assert slave_pressures(code, deck, tmp_path) == pytest.approx(25, rel=2e-3)


def test_equations_of_oblique_supports(tmp_path):
    """At 30° the sides are held along (cos 30°, sin 30°), the base along (−sin 30°, cos 30°)."""
    deck = deck_of(*case_of("QUAD4", "QUAD4", **TURNED))
    tangent = np.tan(np.pi / 6)
    for of in deck.oblique:
        expected = [1, tangent] if of.axis == 0 else [-tangent, 1]
        assert of.direction == pytest.approx(expected)
        assert of.value == 0
    # Four and three nodes at the side, four at the base; the corner is held along both.
    assert len(deck.oblique) == 4 + 3 + 4 - 2
    CodeAster().write(deck, tmp_path)
    assert (tmp_path / "lac.comm").read_text().count("_F(GROUP_NO=('across_") == len(deck.oblique)
    for code in (find("kratos"), find("ngsolve")):
        with pytest.raises(UnsupportedError, match="supports across the axes"):
            code.write(deck, tmp_path)


@pytest.mark.skipif(not CalculiX().version(), reason="not installed")
def test_rings_reach_the_axis(tmp_path, monkeypatch):
    """A disc under 25 MPa; with nodes on the axis CalculiX finds no contact next to it."""
    deck = deck_of(*case_of("QUAD4", "QUAD4", plane="axisymmetric"), layer=True)
    assert slave_pressures(CalculiX(), deck, tmp_path) == pytest.approx(25, rel=1e-2)
    monkeypatch.setattr(calculix, "_BORE", 0.0)
    assert slave_pressures(CalculiX(), deck, tmp_path).min() < 20


def test_rings_by_axis(tmp_path):
    deck = deck_of(*case_of("TRIA6", "QUAD8", plane="axisymmetric"))
    kinds = {line for line in deck_lines(deck) if line.startswith("*ELEMENT")}
    assert {kind.split("TYPE=")[1].split(",")[0] for kind in kinds} == {"CAX6", "CAX8"}
    CodeAster().write(deck, tmp_path)
    assert "MODELISATION='AXIS'" in (tmp_path / "lac.comm").read_text()
    with pytest.raises(UnsupportedError, match=r"axisymmetric bodies: not written for deck\.json"):
        Plain().write(deck, tmp_path)


@pytest.mark.parametrize("code", CODES[:2])
def test_a_body_that_contact_alone_holds(code, tmp_path):
    """0.5 mm above the other one, under 25 MPa: it comes down by 0.5 + 1.25 (1 − 0.3²)."""
    deck = deck_of(*case_of("QUAD4", "QUAD4", contact=[SIDES | {"clearance": 0.5}]), code.layer)
    extent = np.ptp(deck.points, axis=0).max()
    assert deck.start[:, 1].min() == pytest.approx(-0.5 - 3e-4 * extent)
    assert not deck.start[deck.points[:, 1] < -1e-9].any()
    found = run_code(code, deck, tmp_path, Limits())
    assert found.displacement.values[:, 1].min() == pytest.approx(-0.5 - 1.25 * 0.91, rel=1e-3)
    # A body that a support holds, and closed ones, stay where they are.
    assert not deck_of(*pressed(1.0, clearance=0.5), layer=True).start.any()
    assert not deck_of(*case_of("QUAD4", "QUAD4"), layer=True).start.any()


@pytest.mark.parametrize("code", CODES[:2])
def test_overlap_is_the_only_load(code, tmp_path):
    """0.5 mm on 100 mm, both ends held: 2000 · 0.005 / 0.91."""
    deck = deck_of(*pressed(0.0, interference=0.5), layer=code.layer)
    assert slave_pressures(code, deck, tmp_path) == pytest.approx(10 / 0.91, rel=2e-3)


@pytest.mark.skipif(not CalculiX().version(), reason="not installed")
def test_an_open_gap_is_not_given(tmp_path):
    """CalculiX writes zeros for the gaps of points that do not touch."""
    deck = deck_of(*pressed(0.05, clearance=0.1), layer=True)
    found = run_code(CalculiX(), deck, tmp_path, Limits())
    assert found.gap is None
    assert not found.pressure.values.any()


def test_a_force_on_a_group_is_one_per_depth():
    load = {"group": "press", "force": [0.0, -1250.0]}
    deck = deck_of(*case_of("QUAD8", "QUAD8", loads=[load]), layer=True)
    total = deck.forces.sum(axis=0)
    assert total == pytest.approx([0, -1250 * deck.points[:, 2].max(), 0], abs=1e-9)


@pytest.mark.parametrize("group", ["bottom", "all"])
@pytest.mark.parametrize("code", CODES[1:2])
def test_rigid_bodies_have_no_stress(code, group, tmp_path):
    more = {"materials": {group: {"young": 2000.0, "poisson": 0.3}}, "loads": []}
    more |= {"bodies": {"top": {"rigid": True}}}
    more["supports"] = [{"group": "symx", "fix": ["x"]}, {"group": "base", "fix": {"y": 0.5}}]
    found = run_code(code, deck_of(*case_of("QUAD4", "QUAD4", **more)), tmp_path, Limits())
    # Shortened by 0.5 of 50 mm.
    assert found.stress.values[:, 1] == pytest.approx(-20 / 0.91)
    assert found.stress.places[:, 1].max() < 1e-9
