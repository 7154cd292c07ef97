"""Solutions asked for by a case file: what is taken from the case, and what is refused."""

from dataclasses import fields
from pathlib import Path

import pytest

from solver.case.expressions import EXACT
from solver.case.material import Material
from solver.case.reader import parse_case
from solver.case.solutions.catalogue import SOLUTIONS
from solver.case.solutions.hertz import HertzCylinder
from solver.case.solutions.nested import NestedCylinders
from solver.system.errors import InputError

CASE = """\
name: tubes
mesh: {{file: tubes.msh}}
plane: strain
materials:
  bottom: {{young: 2000.0, poisson: 0.3}}
  top: {{young: 8000.0, poisson: 0.2}}
supports: [{{group: symx, fix: {{x: solution}}}}]
loads:
  - {{group: base, pressure: 25}}
  - {{group: press, {load}: solution}}
contact: [{{slave: s, master: m, interference: 0.02}}]
reference:
  kind: analytical
  solution: {solution}
  {more}
"""
TUBES = "{name: nested_cylinders, radii: [20, 30, 40], inner: bottom, outer: top}"


def parse(solution=TUBES, load="traction", more="gap: solution", plain=CASE):
    return parse_case(plain.format(solution=solution, load=load, more=more), Path("lame/c.yaml"))


def test_what_the_case_says_need_not_be_repeated():
    case = parse()
    assert case.reference.exact == NestedCylinders(
        radii=(20.0, 30.0, 40.0),
        inner=Material(2000.0, 0.3),
        outer=Material(8000.0, 0.2),
        pressure=25.0,
        interference=0.02,
    )
    assert case.supports[0].fix == {"x": EXACT}
    assert case.loads[1].value is EXACT
    assert case.reference.values == {"gap": EXACT}


def test_what_the_solution_is_told_goes_before():
    case = parse(
        "{name: nested_cylinders, radii: [1, 2, 3], inner: {young: 5, poisson: 0}, outer: top,"
        " pressure: 1.5, interference: 0}"
    )
    assert case.reference.exact.inner == Material(5.0, 0.0)
    assert (case.reference.exact.pressure, case.reference.exact.interference) == (1.5, 0.0)


def test_a_parameter_takes_the_material_of_its_own_name_or_of_all():
    plain = CASE.replace("bottom:", "inner:").replace("top:", "outer:")
    case = parse("{name: nested_cylinders, radii: [1, 2, 3]}", plain=plain)
    assert case.reference.exact.outer == Material(8000.0, 0.2)
    plain = CASE.replace("  bottom:", "  all:").replace(
        "  top: {{young: 8000.0, poisson: 0.2}}\n", ""
    )
    case = parse("{name: nested_cylinders, radii: [1, 2, 3]}", plain=plain)
    assert case.reference.exact.inner == case.reference.exact.outer == Material(2000.0, 0.3)
    with pytest.raises(InputError, match="material = 'all': must have a Poisson's ratio of 0"):
        parse("parabola_2d", plain=plain)


def test_a_body_may_be_rigid():
    solution = "{name: hertz_cylinder, radius: 50, force: 10, lower: bottom, upper: rigid}"
    plain = CASE.replace("{{x: solution}}", "[x]").replace(
        "  - {{group: press, {load}: solution}}\n", ""
    )
    case = parse(solution, more="contact_pressure: solution", plain=plain)
    assert isinstance(case.reference.exact, HertzCylinder)
    assert case.reference.exact.upper.young == float("inf")


def test_several_pressures_are_none():
    plain = CASE.replace("{load}: solution", "pressure: 3")
    assert parse(plain=plain).reference.exact.pressure == 0.0


def test_a_plane_state_fills_three_dimensions_but_is_not_around_an_axis():
    wedge = "{name: wedge, end: 1, slope: 0.1}"
    solid, plane = (
        parse(wedge, plain=CASE.replace("plane: strain\n", text))
        for text in ("", "plane: strain\n")
    )
    assert (solid.reference.exact.dim, plane.reference.exact.dim) == (3, 2)
    with pytest.raises(InputError, match="is for 2 dimensions; the case has 3"):
        parse(wedge, plain=CASE.replace("strain", "axisymmetric"))


@pytest.mark.parametrize(
    ("solution", "message"),
    [
        ("nested_cylinder", "reference.solution = 'nested_cylinder': no such solution; did you"),
        ("{radii: [1, 2, 3]}", "reference.solution.name: this key is needed"),
        ("{name: nested_cylinders, radii: [1, 2, 3]}", "inner: must be a group with a material"),
        (TUBES.replace("radii", "radius"), "no such parameter; did you mean radii?"),
        (TUBES.replace("bottom", "botom"), "reference.solution.inner = 'botom': must be a group"),
        (TUBES.replace("[20, 30, 40]", "[20, 30]"), "radii = [20, 30]: must be three radii"),
        (TUBES.replace("[20, 30, 40]", "[20, a, 40]"), "radii[1] = 'a': must be a number"),
        (
            TUBES.replace("[20, 30, 40]", "[1.0e-300, 30, 40]"),
            "radii[0] = 1e-300: must be a number: 0, or",
        ),
        (TUBES.replace("[20, 30, 40]", "20"), "radii = 20: must be a list of numbers"),
        (TUBES.replace("[20, 30, 40]", "[20, 20, 40]"), "must be three radii that increase"),
        (TUBES.replace("radii: [20, 30, 40], ", ""), "radii: this parameter is needed: inner"),
        (TUBES.replace("cylinders", "spheres"), "is for 3 dimensions; the case has 2"),
        (TUBES.replace("bottom", "{young: -1, poisson: 0}"), "inner = {'young': -1"),
        (TUBES.replace("bottom", "bottom, dim: 3"), "nested_cylinders has no such parameter"),
        ("{name: sheared, friction: 0.5, shear: [0.5]}", "contact: this key is needed"),
        ("{name: sheared, contact: 0.5}", "contact = 0.5: no such solution"),
        ("{name: sheared, contact: null}", "contact: must have a value"),
        ("{name: parabola_2d, material: top}", "material = 'top': must have a Poisson's ratio"),
    ],
)
def test_refused(solution, message):
    with pytest.raises(InputError) as error:
        parse(solution)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("quantity", ["displacement", "stress", "normal_stress", "gap"])
def test_a_quantity_that_the_solution_does_not_have(quantity):
    solution = "{name: hertz_cylinder, radius: 50, force: 10, lower: bottom, upper: top}"
    plain = CASE.replace("{{x: solution}}", "[x]").replace(
        "  - {{group: press, {load}: solution}}\n", ""
    )
    with pytest.raises(InputError, match=f"reference.{quantity} = 'solution': hertz_cylinder has"):
        parse(solution, more=f"{quantity}: solution", plain=plain)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("  solution: {solution}\n", "", "supports[0].fix.x = 'solution': reference.solution"),
        ("{load}: solution", "traction: [solution, 0]", "loads[1].traction[0] = 'solution'"),
        ("{load}: solution", "traction: 25", "or `solution`"),
        ("{load}: solution", "body_force: exact", "or `solution`"),
        ("{more}", "stress: exact", "or `solution`"),
    ],
)
def test_solution_is_no_word_for_anything_else(old, new, message):
    with pytest.raises(InputError) as error:
        parse(plain=CASE.replace(old, new))
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("tolerance", "solution", "message"),
    [
        ("{peak: 0.01}", TUBES, "tolerance.peak = 0.01: nested_cylinders has no peak"),
        ("{pressure_l2: 0.01}", None, "needs an exact solution"),
    ],
)
def test_an_error_that_is_not_known_has_no_tolerance(tolerance, solution, message):
    plain = CASE + f"tolerance: {{{tolerance}}}\n"
    if solution is None:
        plain = plain.replace("  solution: {solution}\n", "").replace(": solution", ": 0.0")
        plain = plain.replace("traction: 0.0", "pressure: 0.0").replace("{load}", "pressure")
    with pytest.raises(InputError) as error:
        parse(plain=plain, more="gap: 0.0")
    assert message in str(error.value)


def test_with_several_zones_it_is_said_that_the_solution_is_of_all():
    plain = CASE.replace("0.02}}]", "0.02}}, {{name: other, slave: t, master: n}}]")
    plain += "tolerance: {{displacement_l2: 0.01, pressure_l2: 0.01}}\n"
    with pytest.raises(InputError, match=r"pressure_l2 .* needs `contact_pressure: sol"):
        parse(plain=plain)
    assert parse(plain=plain, more="contact_pressure: solution").exact_contact


def test_every_solution_says_what_its_parameters_are():
    for name, cls in SOLUTIONS.items():
        assert cls.name == name
        assert cls.__doc__
        for parameter in fields(cls):
            assert not parameter.init or parameter.metadata["doc"], (name, parameter.name)
