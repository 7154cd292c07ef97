"""`check-result`: results of other codes, right ones and planted faults."""

import json
from dataclasses import replace

import meshio
import numpy as np
import pytest

from solver.case.reader import load_case
from solver.codes.foreign import Field, ForeignResult
from solver.codes.verdicts import check_foreign
from solver.commands.cli import main
from solver.system.errors import InputError
from solver.verification.stored import read_verdict
from tests.codes import results

CASE = str(results.ROOT / "cases/ssnp170/a.yaml")


@pytest.fixture
def check(tmp_path, capsys):
    """Writes an answer as VTU and checks it: exit status and what is said."""

    def run(answer, *options, case=CASE):
        file = results.write_vtu(answer, tmp_path / "result.vtu")
        status = main(["check-result", case, str(file), *options])
        said = capsys.readouterr()
        return status, said.out + said.err

    return run


def test_an_exact_answer_passes_every_check_that_it_gives_values_for(check, tmp_path):
    status, said = check(results.patch(), "-o", str(tmp_path / "results"), "--code", "mine")
    assert status == 0, said
    folder = tmp_path / "results/ssnp170/ssnp170-a@mine"
    verdict = read_verdict(folder / "verdict.json")
    assert (verdict.verdict, verdict.foreign.code, verdict.problem.job) == (
        "passed",
        "mine",
        "ssnp170-a@mine",
    )
    ran = {check.name for check in verdict.checks}
    assert ran == {
        *("multiplier", "nodal_stress", "surface_stress_slave", "surface_stress_master"),
        *("displacement", "stress_components", "balance"),
    }
    assert set(verdict.foreign.not_given) == {
        *("element_pressure", "element_gap", "element_status", "coverage", "covered_pressure"),
        "integration_stress",
    }
    assert all(check.error < 1e-12 for check in verdict.checks)
    assert verdict.values.pressure == [25.0, 25.0]
    rows = np.loadtxt(folder / "pressure.csv", delimiter=",", skiprows=1)
    assert len(rows) == 18
    assert np.allclose(rows[:, 1:], [0.0, 25.0], atol=1e-12)
    assert (folder / "result.vtkhdf").is_file()


@pytest.mark.parametrize("case", ["ssnp170/c", "ssnp170/k"])
def test_other_meshes_of_the_family(check, case):
    status, said = check(results.patch(case), case=str(results.ROOT / f"cases/{case}.yaml"))
    assert status == 0, said


FAULTS = {
    "pressure sign": (
        lambda a: a.changed(pressure=-a.pressure),
        1,
        "multiplier, balance: values have the opposite sign",
    ),
    "pressure in Pa": (
        lambda a: a.changed(pressure=1e6 * a.pressure),
        1,
        "values are 10⁶ times the reference: another unit?",
    ),
    "stress in kPa": (
        lambda a: a.changed(stress=1e3 * a.stress),
        1,
        "values are 10³ times the reference: another unit?",
    ),
    "stress positive in compression": (
        lambda a: a.changed(stress=-a.stress),
        1,
        "values have the opposite sign",
    ),
    "displacement in m": (
        lambda a: a.changed(displacement=1e-3 * a.displacement),
        1,
        "displacement: values are 10⁻³ times the reference: another unit?",
    ),
    "half of the load": (
        lambda a: a.changed(
            pressure=0.5 * a.pressure, stress=0.5 * a.stress, displacement=0.5 * a.displacement
        ),
        1,
        "values are half of the reference: an earlier load step?",
    ),
    "one component": (
        lambda a: a.changed(displacement=a.displacement * [-1, 1]),
        1,
        "components with the opposite sign: x",
    ),
    "order of components": (
        lambda a: a.changed(stress=a.stress[:, [0, 2, 1, 3, 4, 5]]),
        1,
        "components are in another order: zz in place of yy",
    ),
    "nothing solved": (
        lambda a: a.changed(displacement=0 * a.displacement),
        1,
        "displacement: all values are zero",
    ),
    "one wrong node": (
        lambda a: a.changed(stress=a.stress + 0.1 * np.eye(len(a.stress), 6, -7)),
        1,
        "failed: nodal_stress: -24.9 (node 8)",
    ),
    "mesh in m": (lambda a: a.changed(points=1e-3 * a.points), 2, "lengths are 10⁻³ times"),
    "mirrored": (lambda a: a.changed(points=a.points * [-1, 1]), 2, "the mesh is mirrored in x"),
    "bodies swapped": (
        lambda a: a.changed(points=a.points * [1, -1]),
        2,
        "the mesh is mirrored in y: its bodies are swapped",
    ),
    "axes": (lambda a: a.changed(points=a.points[:, ::-1]), 2, "x, y are its y, x"),
    "shifted": (lambda a: a.changed(points=a.points + 7), 2, "the mesh is shifted by (7, 7)"),
    "deformed": (
        lambda a: a.changed(points=a.points + a.displacement),
        2,
        "coordinates belong to the deformed mesh",
    ),
    "longer": (lambda a: a.changed(points=a.points * [1.3, 1]), 2, "the case is from (0, -50)"),
    "a node without a value": (
        lambda a: a.changed(
            stress=np.where(np.arange(len(a.stress))[:, None] == 7, np.nan, a.stress)
        ),
        2,
        "stress: 1 of 308 values are not finite numbers",
    ),
    "infinite": (
        lambda a: a.changed(displacement=np.where(a.points[:, :1] > 49, np.inf, a.displacement)),
        2,
        "values are not finite numbers",
    ),
    "a part of the pressure": (
        lambda a: a.changed(pressure=np.where(a.points[:, 0] < 30, a.pressure, np.nan)),
        2,
        "of 18 corners of the slave faces have none: it must be 0 where there is no contact",
    ),
    "not finite": (
        lambda a: a.changed(displacement=np.full_like(a.displacement, np.nan)),
        2,
        "no value of it is a finite number",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_named(check, fault):
    plant, status, told = FAULTS[fault]
    found, said = check(plant(results.patch()))
    assert found == status, said
    assert told in said
    if status == 2:
        assert said.count("\n") == 1


def test_pressure_of_the_other_direction(check):
    status, said = check(results.patch(), "--swap")
    assert status == 2
    assert "slave and master are exchanged (option --swap)" in said


def test_another_mesh_is_checked_at_its_own_nodes(check):
    """QUAD4 in place of TRIA3, and rows of cells well within the width of a face of the case."""
    answer, case = results.patch("ssnp170/c"), str(results.ROOT / "cases/ssnp170/f.yaml")
    status, said = check(answer, case=case)
    assert status == 0, said
    assert "balance" in said
    status, said = check(answer.changed(pressure=0.9 * answer.pressure), case=case)
    assert (status, "multiplier, balance: values are 0.9 of the reference" in said) == (1, True), (
        said
    )
    status, said = check(answer.changed(displacement=1.01 * answer.displacement), case=case)
    assert (status, "displacement: -1.148875" in said) == (1, True), said
    missing = answer.changed(cells=[(kind, cells[:144]) for kind, cells in answer.cells])
    status, said = check(missing, case=case)
    assert (status, "where the case has the body top" in said) == (2, True), said


def test_forces_are_compared_with_the_loads_where_there_is_no_reference(tmp_path, capsys):
    text = (results.ROOT / "cases/ssnp170/a.yaml").read_text(encoding="utf-8")
    kept = text[: text.index("reference:")]
    case = tmp_path / "plain.yaml"
    case.write_text(kept, encoding="utf-8")
    answer = results.patch()
    file = results.write_vtu(answer, tmp_path / "right.vtu")
    assert main(["check-result", str(case), str(file)]) == 0
    assert "solved" in capsys.readouterr().out
    wrong = results.write_vtu(answer.changed(pressure=-1e3 * answer.pressure), tmp_path / "off.vtu")
    assert main(["check-result", str(case), str(wrong)]) == 1
    said = capsys.readouterr().out
    assert (
        "balance: values are 10³ times the reference: another unit, and the opposite sign?" in said
    )


def foreign(**given):
    return ForeignResult(code="mine", **given)


def test_a_force_by_zone_is_enough(tmp_path):
    mesh, case = results.mesh_and_case("ssnp170/a")
    right = check_foreign(case, foreign(forces={"interface": np.array([0.0, -1250.0])}), mesh)
    assert [c.name for c in right.checks if c.passed] == ["balance"]
    wrong = check_foreign(case, foreign(forces={"interface": np.array([0.0, -625.0])}), mesh)
    assert "values are half of the reference" in wrong.reason


def test_another_load_factor_is_refused():
    mesh, case = results.mesh_and_case("ssnp170/a")
    answer = results.patch()
    given = Field(places=answer.points, values=answer.displacement)
    with pytest.raises(InputError, match=r"step = 0\.5: the result must belong to load factor 1"):
        check_foreign(case, foreign(displacement=given, step=0.5), mesh)
    with pytest.raises(InputError, match="the result gives nothing to check"):
        check_foreign(case, foreign(), mesh)


def test_a_layer_that_moves_across_the_plane_is_refused(tmp_path, capsys):
    answer = results.patch()
    moved = np.column_stack([answer.displacement, np.full(len(answer.points), 0.3)])
    file = results.write_vtu(answer.changed(displacement=moved), tmp_path / "result.vtu")
    assert main(["check-result", CASE, str(file)]) == 2
    assert "the case is one of plane strain" in capsys.readouterr().err
    # A thin plate may become thinner or thicker.
    mesh, case = results.mesh_and_case("ssnp170/a")
    given = Field(places=answer.points, values=moved, nodes=np.arange(len(moved)))
    moved_only = foreign(displacement=given, mesh=mesh)
    thin = check_foreign(replace(case, plane="stress"), moved_only, mesh, ["displacement"])
    assert [c.name for c in thin.checks] == ["displacement"]
    assert thin.passed


def test_hertz_is_checked_by_its_norms(tmp_path):
    """Half-width and peak of an exact pressure on the faces: errors of the mesh alone."""
    mesh, case = results.mesh_and_case("hertz/cylinder-quad4")
    slave = results.slave_nodes(mesh, case)
    place = mesh.points[slave]
    exact = case.reference.exact.contact_pressure(place)
    good = check_foreign(case, foreign(pressure=Field(places=place, values=exact)), mesh)
    assert good.estimates.errors["half_width"] < 0.01
    assert good.estimates.errors["peak"] < 0.01
    wide = np.where(np.abs(place[:, 0]) < 2.0, exact.max() / 3, 0.0)
    bad = check_foreign(case, foreign(pressure=Field(places=place, values=wide)), mesh)
    assert bad.verdict == "failed"


def test_json_is_the_verdict(check):
    status, said = check(results.patch(), "--json")
    assert status == 0
    assert json.loads(said)["code"] == "other"


def test_a_case_without_a_mesh_that_fits_is_refused(check, tmp_path):
    other = load_case(results.ROOT / "cases/ssnp170/k.yaml")
    status, said = check(results.patch(), case=str(other.path))
    assert status == 2
    assert "it is from (0, -50, 0) to (50, 50, 0)" in said


def test_results_with_cell_data(tmp_path, capsys):
    """Pressure on faces, stress at the centres of cells."""
    mesh, case = results.mesh_and_case("ssnp170/a")
    line = next(i for i, block in enumerate(mesh.cells) if block.type == "line")
    faces = mesh.cells[line].data[mesh.cell_sets[case.zones[0].slave][line]]
    answer = results.patch()
    count = sum(len(cells) for _, cells in answer.cells)
    stress = np.tile([0.0, -25.0, -7.5, 0.0, 0.0, 0.0], (count, 1))
    data = {
        "stress": [stress, np.full((len(faces), 6), np.nan)],
        "pressure": [np.full(count, np.nan), np.full(len(faces), 25.0)],
    }
    points = np.pad(answer.points, ((0, 0), (0, 1)))
    full = meshio.Mesh(points, [*answer.cells, ("line", faces)], cell_data=data)
    meshio.vtu.write(tmp_path / "cells.vtu", full)
    only = ["--only", "stress,pressure"]
    assert main(["check-result", CASE, str(tmp_path / "cells.vtu"), *only]) == 0
    assert "multiplier" in capsys.readouterr().out


def test_a_ring_presses_with_all_of_its_circumference():
    """25 on a disc: π R² times it; moved along its radius a ring is no rigid motion."""
    mesh, case = results.mesh_and_case("axisymmetric/disc-quad4-tria6")
    slave = mesh.points[results.slave_nodes(mesh, case)]
    load = -25.0 * np.pi * slave[:, 0].max() ** 2
    given = {case.zones[0].name: np.array([0.0, load])}
    assert check_foreign(case, foreign(forces=given), mesh).checks[0].error < 1e-12
    pressure = Field(places=slave, values=np.full(len(slave), 25.0))
    checks = {c.name: c for c in check_foreign(case, foreign(pressure=pressure), mesh).checks}
    assert checks["balance"].error < 1e-12


ALL = ("displacement", "stress", "pressure")
REFUSED = {"half of the interface": "9 of 18 corners of the slave faces have none"}


def parts(answer):
    """Parts of an exact answer, as another code may give by mistake."""
    points, low = answer.points, answer.points[:, 1] < 0
    everywhere = np.arange(len(points))
    slave = np.flatnonzero(answer.pressure > 0)
    fields = {
        name: Field(places=points, values=getattr(answer, name), nodes=everywhere)
        for name in ("displacement", "stress")
    }
    fields["pressure"] = Field(places=points[slave], values=answer.pressure[slave])

    def at(name, chosen):
        given = fields[name]
        return Field(places=given.places[chosen], values=given.values[chosen])

    return {
        "displacement alone": {"displacement": fields["displacement"]},
        "pressure alone": {"pressure": fields["pressure"]},
        "no stress": {name: fields[name] for name in ("displacement", "pressure")},
        "one row of nodes": {**fields, "stress": at("stress", points[:, 1] == points[:, 1].max())},
        "one body": {**fields, "displacement": at("displacement", low)},
        "half of the interface": {
            **fields, "pressure": at("pressure", np.argsort(points[slave, 0])[: len(slave) // 2])
        },
    }, fields  # fmt: skip


@pytest.mark.parametrize("which", range(6))
def test_a_part_of_a_result_is_no_verification(which):
    """Right values where they are given; what is not compared keeps the verdict from `passed`."""
    answer = results.patch()
    mesh, case = results.mesh_and_case("ssnp170/a")
    some, whole = parts(answer)
    name, fields = list(some.items())[which]
    if name in REFUSED:
        with pytest.raises(InputError, match=REFUSED[name]):
            check_foreign(case, foreign(**fields), mesh)
        return
    found = check_foreign(case, foreign(**fields), mesh)
    assert (found.verdict, found.passed) == ("partial", False), name
    assert found.reason.startswith("compared: ")
    assert not found.sound
    assert check_foreign(case, foreign(**whole), mesh).verdict == "passed"


def test_a_part_may_be_asked_for():
    mesh, case = results.mesh_and_case("ssnp170/a")
    _, whole = parts(results.patch())
    found = check_foreign(case, foreign(displacement=whole["displacement"]), mesh, ["displacement"])
    assert (found.verdict, found.foreign.only) == ("passed", ["displacement"])
    assert "passed (displacement only)" in found.summary
    assert found.foreign.compared == {
        "displacement": f"{len(mesh.points)} of {len(mesh.points)} nodes"
    }
    lacking = check_foreign(case, foreign(displacement=whole["displacement"]), mesh, ALL)
    assert lacking.verdict == "partial"
    assert "not given: stress, pressure" in lacking.reason


def test_only_names_fields(check):
    status, said = check(results.patch(), "--only", "velocity")
    assert status == 2
    assert "allowed: displacement, stress, pressure, gap" in said


@pytest.mark.filterwarnings("error")
def test_a_field_without_a_number_is_refused_in_one_line():
    mesh, case = results.mesh_and_case("ssnp170/a")
    nothing = Field(places=mesh.points, values=np.full((len(mesh.points), 3), np.nan))
    with pytest.raises(InputError, match="no value of it is a finite number"):
        check_foreign(case, foreign(displacement=nothing), mesh)
