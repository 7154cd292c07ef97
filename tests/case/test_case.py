"""The case file: what it becomes, and its defaults."""

from pathlib import Path

import pytest

from solver.case.acting import Load, Support
from solver.case.expressions import Expression
from solver.case.file import Observation, Zone
from solver.case.material import Material
from solver.case.model import About, Case, CaseMesh, CaseReference
from solver.case.reader import check_mesh_file, load_case, parse_case
from solver.case.rigid import Rigid
from solver.case.solutions.polynomial import Hydrostatic
from solver.system.errors import InputError
from tests.case.files import FULL, MINIMAL, PATH


def test_every_key_arrives():
    case = parse_case(FULL, PATH)
    assert case == Case(
        name="ssnp170-c",
        about=About(PATH, FULL, "A title", directions="first"),
        mesh=CaseMesh(
            source={"path": Path("family/meshes/c.med")},
            transform={"scale": 2.0},
            counts={"lower": {"cells": 144, "faces": 12}},
        ),
        materials={"lower": Material(2000.0, 0.3), "upper": Material(1000.0, -0.5)},
        supports=(
            Support({"x": 0.0}, group="Sym"),
            Support({"y": 0.0, "x": Expression("1e-3*x")}, group="Base"),
            Support({"normal": 0.0}, group="Slope"),
        ),
        loads=(
            Load("Top", pressure=25.0),
            Load("Side", traction=(0.0, Expression("2*y"))),
            Load("all", body_force=(0.0, -1.0)),
        ),
        zones=(
            Zone("S", "M", "interface", "hexahedra", "lac", "element", interference=1.0),
            Zone("S2", "M2", "second"),
        ),
        rigid={"die": Rigid(rigid=True)},
        plane="strain",
        steps=(0.5, 1.0),
        observe=(Observation("interface", (25.0, 0.0)),),
        reference=CaseReference(
            values={
                "contact_pressure": 25.0,
                "gap": Expression("x*0"),
                "displacement": (0.0, Expression("-0.1*y")),
                "stress": {"yy": -25.0, "zz": Expression("-7.5*x/x")},
            },
            exact=Hydrostatic(pressure=25.0, material=Material(2000.0, 0.3), dim=2),
            kind="analytical",
            tolerance={"multiplier": 1e-6},
        ),
    )
    assert case.family == "family"


def test_where_a_reference_comes_from_arrives():
    origin = "reference: {kind: %s, normal_stress: 0, remark: as told}\n"
    refined = parse_case(MINIMAL + origin % "refined, uncertainty: 2.0e-3", PATH).reference
    assert (refined.kind, refined.uncertainty) == ("refined", 2e-3)
    assert (refined.code, refined.remark) == (None, "as told")
    text = MINIMAL + origin % "other_code, code: {name: solver, version: '14'}"
    other = parse_case(text, PATH).reference
    assert other.code == {"name": "solver", "version": "14"}
    assert other.values == {"normal_stress": 0.0}


def test_defaults_are_those_of_the_contract():
    case = parse_case(MINIMAL + "contact: [{slave: S, master: M}]\n", PATH)
    zone = case.zones[0]
    assert (zone.hexahedra, zone.treatment, zone.normal) == ("pyramids", "lac", "element")
    assert zone.interference == 0.0
    assert (case.about.directions, case.steps, case.loads, case.reference.tolerance) == (
        "first",
        (1.0,),
        (),
        {},
    )
    assert (case.plane, case.mesh.transform, case.about.title, case.reference.values) == (
        None,
        None,
        "",
        {},
    )
    assert case.mesh.source == {"recipe": "blocks", "size": 1.0}


def test_one_tolerance_stands_for_all():
    assert parse_case(MINIMAL + "tolerance: 1e-3", PATH).reference.tolerance == {"all": 1e-3}


def test_a_rigid_body_has_no_material():
    """Its modulus is no scale of displacements or pressures; alone it is kept."""
    text = FULL.replace("materials:\n", "materials:\n  die: {young: 1.0, poisson: 0.0}\n", 1)
    assert text != FULL
    assert parse_case(text, PATH).materials == parse_case(FULL, PATH).materials
    alone = MINIMAL + "bodies: {all: {rigid: true}}\n"
    assert parse_case(alone, PATH).materials == parse_case(MINIMAL, PATH).materials


def test_numbers_are_floats():
    case = parse_case(FULL, PATH)
    assert all(type(m.young) is float for m in case.materials.values())
    assert all(type(factor) is float for factor in case.steps)
    assert type(case.zones[0].interference) is float


def test_a_mesh_file_of_too_long_a_name():
    case = parse_case(
        MINIMAL.replace("{recipe: blocks, size: 1.0}", f"{{file: {'a' * 256}}}"), PATH
    )
    with pytest.raises(InputError, match=r"^family/c\.yaml: mesh\.file = .* no such file$"):
        check_mesh_file(case)


def test_load_case_reads_the_file(tmp_path):
    file = tmp_path / "c.yaml"
    file.write_text(MINIMAL)
    case = load_case(str(file))
    assert (case.path, case.family, case.about.source) == (file, tmp_path.name, MINIMAL)
