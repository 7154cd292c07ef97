"""Recovery where it gains little or nothing: it must do no harm there, and leave the status."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from solver.case.reader import parse_case
from solver.lac import recovery
from solver.lac.cells.faces import surface_points
from solver.mechanics.linear import choice
from solver.mesh import generate
from solver.simulation.results.exact import computed_pressure
from solver.simulation.results.solution import Solution
from solver.simulation.simulate import simulate
from solver.verification.norms import errors
from solver.verification.run import mesh_of
from tests.scenes import block_mesh
from tests.simulation.test_balance import hertz
from tests.simulation.test_recovery import blocks, solved, waves
from tests.simulation.test_unloaded import SCENE, side_by_side

STUDY = Path(__file__).parents[2] / "cases/studies/study"
FORMS = ["linear", "quadratic", "smooth"]


def pressed(n: int, m: int, form: str, bottom: str = "QUAD8", top: str = "TRIA6") -> dict:
    """Two blocks under a load that varies smoothly, n faces on the slave and m on the master."""
    content = blocks(bottom, top, 10, recovery=form)
    content["mesh"]["bottom"]["divisions"] = [n, 4]
    content["mesh"]["top"]["divisions"] = [m, 4]
    content["supports"].append({"group": "base", "fix": ["y"]})
    content["loads"] = [{"group": "press", "pressure": "25*(1 + 0.2*cos(pi*x/50))"}]
    return content


@pytest.mark.parametrize(
    ("pressure", "gap", "form", "settles"),
    [
        ("5.34*(1 - 0.689*x/50)", "0.1*sin(x/9)", "smooth", False),
        ("9.38*(1 + 0.116*x/50)", "0.1*sin(x/5)", "quadratic", True),
        ("3.45*(1 + 0.739*x/50)", "0.1*sin(x/15)", "linear", True),
    ],
)
def test_the_status_is_that_under_the_recovered_pressure(pressure, gap, form, settles):
    """On few tetrahedra over waves, where a reconstruction closes what was open."""
    content = {
        "name": "waves",
        "mesh": {
            "recipe": "blocks",
            "size": [50, 50, 25],
            "bottom": {"cells": "TETRA4", "divisions": [2, 2, 2]},
            "top": {"cells": "TETRA4", "divisions": [3, 3, 3]},
        },
        "materials": {"all": {"young": 2000, "poisson": 0.3}},
        "supports": [{"group": g, "fix": [g[-1]]} for g in ("symx", "symy")],
        "loads": [{"group": "press", "pressure": pressure}],
        "contact": [{"name": "i", "slave": "bottom_contact", "master": "top_contact"}],
    }
    content["supports"].append({"group": "base", "fix": ["z"]})
    content["contact"][0] |= {"clearance": gap, "recovery": form}
    [zone] = solved(content).zones
    content["contact"][0]["recovery"] = "none"
    [plain] = solved(content).zones
    assert (zone.recovered is not None) == settles
    assert np.isfinite(zone.estimates.pressure_error).all()
    assert (zone.closed != plain.closed).any() == settles
    assert zone.multiplier.min() >= 0
    assert zone.gap.min() > -1e-12
    assert not (zone.multiplier * (zone.gap > 1e-12)).any()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("faces", [1, 2, 3])
def test_zones_of_few_faces(faces, form):
    """One face has no neighbour and keeps its constant; two have a line, three a parabola."""
    [zone] = solved(pressed(faces, 4, form)).zones
    [plain] = solved(pressed(faces, 4, "none")).zones
    assert zone.resultants.force == pytest.approx([0.0, -1250.0], abs=1e-9)
    highest = min(faces - 1, 1 if form == "linear" else 2)
    assert zone.recovered.degree.max() == highest
    if faces == 1:
        assert zone.recovered.at_nodes == pytest.approx(plain.multiplier[0], rel=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_a_much_coarser_master(form):
    """Four faces over forty: the error is the master's, and recovery adds nothing to it."""

    def found(form):
        case = waves("QUAD8", "TRIA6", 40, form)
        case["mesh"]["top"]["divisions"] = [4, 4]
        return errors(solved(case))["pressure_l2"]

    assert found(form) < 1.05 * found("none")


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("ratio", [1e-3, 1.0, 1e3])
def test_any_ratio_of_stiffness(ratio, swapped):
    found = {}
    for form in ("none", "linear", "quadratic"):
        case = waves("TRIA6", "QUAD8", 20, form)
        case["materials"]["bottom"]["young"] = 1000.0 * ratio
        case["reference"]["solution"]["mean_pressure"] = 25 * min(ratio, 1.0)
        case["contact"][0]["clearance"] = "0.02*(1 - cos(pi*x/50))"
        case["reference"]["solution"]["amplitude"] = 0.02
        found[form] = errors(solved(case, swapped))["pressure_l2"]
    assert found["linear"] < found["none"] / 10
    assert found["quadratic"] < found["none"] / 10


def test_nearly_incompressible_cells_in_mixed_form():
    found = {}
    for form in ("none", "linear", "quadratic"):
        case = waves("TRIA6", "QUAD8", 20, form)
        for material in case["materials"].values():
            material |= {"poisson": 0.4999, "form": "mixed"}
        found[form] = errors(solved(case))["pressure_l2"]
    assert found["linear"] < found["none"] / 10
    assert found["quadratic"] < found["none"] / 10


def test_multigrid_in_place_of_a_factor(monkeypatch):
    """The sweeps are solved to two digits more than they change: the same pressure."""

    def found():
        case = blocks("HEXA8", "TETRA10", 6, recovery="linear")
        case["supports"].append({"group": "base", "fix": ["z"]})
        case["loads"] = [{"group": "press", "pressure": "25*(1 + 0.2*cos(pi*x/50))"}]
        return solved(case)

    factored = found()
    monkeypatch.setattr(choice, "MULTIGRID_FROM", 0)
    iterated = found()
    assert factored.cost.linear_solver != iterated.cost.linear_solver
    one, other = factored.zones[0].recovered, iterated.zones[0].recovered
    assert other.at_nodes == pytest.approx(one.at_nodes, rel=1e-4)
    assert iterated.steps[0].residual < 1e-12


@pytest.mark.parametrize("form", FORMS)
def test_load_steps_each_have_their_sweeps(form):
    """The last of three steps is the state of that load alone."""
    case = pressed(10, 7, form)
    steps = solved(case | {"steps": [0.25, 0.5, 1.0]})
    assert steps.zones[0].multiplier == pytest.approx(solved(case).zones[0].multiplier, rel=1e-11)


def test_a_contact_edge_keeps_its_status():
    plain = hertz("quad8", 1.0)[0].zones[0]
    for form in FORMS:
        zone = hertz("quad8", 1.0, form)[0].zones[0]
        assert (zone.closed == plain.closed).all()
        assert zone.resultants.force == pytest.approx(plain.resultants.force, abs=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_a_macro_element_covered_by_five_per_cent(form):
    """The master ends just over the last of five: the sweeps settle, status and force are kept."""

    def found(form):
        content = pressed(5, 4, form)
        mesh = generate(content["mesh"], "recovered.yaml")
        top = [
            block.data[chosen]
            for block, chosen in zip(mesh.cells, mesh.cell_sets["top"], strict=True)
        ]
        nodes = np.unique(np.concatenate([cells.ravel() for cells in top]))
        mesh.points[nodes, 0] *= 0.81
        case = parse_case(yaml.safe_dump(content), Path("recovered.yaml"))
        return simulate(case, mesh).zones[0]

    zone, plain = found(form), found("none")
    assert zone.coverage.min() == pytest.approx(0.05)
    assert (zone.closed == plain.closed).all()
    assert zone.resultants.force == pytest.approx(plain.resultants.force, abs=1e-9)
    # What the neighbours make of the others is of the size of what varies among these.
    whole = zone.coverage > 0.99
    assert np.abs(zone.multiplier - plain.multiplier)[whole].max() < np.ptp(plain.multiplier[whole])


def test_a_body_that_is_all_but_free_to_turn_keeps_its_constants():
    """Friction under one row of macro-elements holds it: from pressures that are rounded, a
    reconstruction turns it, and each sweep turns it 100,000 times as far as the one before."""
    content = yaml.safe_load((STUDY.parents[1] / "friction-patch/m-stick.yaml").read_text())
    content["mesh"]["bottom"]["divisions"] = [3, 1, 1]
    content["mesh"]["top"] |= {"cells": "HEXA20"}
    content["transform"] = {"perturb": 0.05}
    content["contact"][0]["recovery"] = "linear"
    case = parse_case(yaml.safe_dump(content), Path("turning.yaml"))
    solution = simulate(case, mesh_of(case))
    assert solution.zones[0].recovered is None
    assert "interface: pressure not recovered" in [line.what for line in solution.plan]
    np.testing.assert_allclose(solution.zones[0].multiplier, 25.0, rtol=1e-8)


def test_each_zone_has_its_own_form():
    """Two pairs of blocks: a zone is as where both have its form."""
    mesh = block_mesh("QUAD8", "TRIA6", (6, 5))
    both = side_by_side(mesh, mesh)
    load = "pressure: '25*(1 + 0.2*cos(pi*x))'"

    def pressures(forms):
        text = SCENE.replace("pressure: 25.0", load)
        text = text.replace("contact:", f"  - {{group: press_far, {load}}}\ncontact:")
        for name, form in zip(("top_contact}", "top_contact_far}"), forms, strict=True):
            text = text.replace(name, f"{name[:-1]}, recovery: {form}}}")
        zones = simulate(parse_case(text, Path("zones.yaml")), both).zones
        return [zone.multiplier for zone in zones]

    alone = {form: pressures((form, form)) for form in ("none", "linear", "quadratic", "smooth")}
    for forms in (("quadratic", "none"), ("linear", "quadratic")):
        for number, pressure in enumerate(pressures(forms)):
            assert pressure == pytest.approx(alone[forms[number]][number], rel=1e-9)
    assert not np.allclose(alone["none"][0], alone["linear"][0], rtol=1e-4)


@pytest.mark.parametrize("swapped", [False, True])
def test_curved_faces(swapped):
    """Oval tubes: quadratic recovery takes the error of the constants down ten times and more."""
    case = yaml.safe_load((STUDY / "oval.yaml").read_text())
    case["mesh"] |= {"refine": 4}
    found = {}
    for form in ("none", "quadratic"):
        case["contact"][0]["recovery"] = form
        found[form] = errors(solved(case, swapped))["pressure_l2"]
    assert found["quadratic"] < found["none"] / 10


def side_by_side_materials(body: str, n: int, form: str) -> Solution:
    """Two blocks pressed flat; one has a part ten times as stiff from its middle x = 25 on."""
    content = blocks("QUAD8", "QUAD8", n, recovery=form)
    content["supports"] += [
        {"group": "base", "fix": ["y"]},
        {"group": "press", "fix": {"y": -1.0}},
    ]
    content["materials"] |= {"stiff": {"young": 20000.0, "poisson": 0.3}}
    content["materials"]["soft"] = content["materials"].pop(body)
    mesh = generate(content["mesh"], "recovered.yaml")
    for name, side in (("soft", -1), ("stiff", 1)):
        mesh.cell_sets[name] = [
            some[side * (mesh.points[block.data[some], 0].mean(axis=1) - 25) > 0]
            for block, some in zip(mesh.cells, mesh.cell_sets[body], strict=True)
        ]
    return simulate(parse_case(yaml.safe_dump(content), Path("recovered.yaml")), mesh)


@pytest.mark.parametrize("body", ["bottom", "top"])
def test_materials_side_by_side(body, monkeypatch):
    """The pressure jumps where the material of slave or master does: no neighbours across."""

    def distance(form):
        """From a solution on three times as many macro-elements, along the slave."""
        solution = side_by_side_materials(body, 20, form)
        [zone], at = solution.zones, surface_points(solution.mesh.points, solution.zones[0].faces)
        away = computed_pressure(solution.mesh.points, zone) - np.interp(at.place[:, 0], x, fine)
        return np.sqrt((at.weight * away**2).sum())

    reference = side_by_side_materials(body, 60, "quadratic")
    at = surface_points(reference.mesh.points, reference.zones[0].faces)
    order = np.argsort(at.place[:, 0])
    x = at.place[order, 0]
    fine = computed_pressure(reference.mesh.points, reference.zones[0])[order]
    constants = distance("none")
    assert all(distance(form) < 0.75 * constants for form in FORMS)
    monkeypatch.setattr(recovery, "_same_materials", lambda asked, _: asked.near)
    assert all(distance(form) > 0.9 * constants for form in FORMS)
