"""Ladders read from their files, and the orders of theory on a small one."""

from pathlib import Path

import pytest

from solver.case.reader import load_case
from solver.case.yaml import parse_mapping
from solver.commands.cli import main
from solver.simulation.simulate import simulate
from solver.studies.fits import fit_order
from solver.studies.orders.description import read_ladders
from solver.studies.orders.expected import at_first
from solver.studies.orders.theory import THEORY, element_size
from solver.system.errors import InputError
from solver.verification.norms import errors
from solver.verification.run import mesh_of, refined


def test_size_of_macro_elements_on_a_line_and_on_a_surface():
    assert element_size(8, 2) == pytest.approx(1 / 8)
    assert element_size(64, 3) == pytest.approx(1 / 8)


def test_theory_guarantees_no_more_than_the_best():
    for orders in THEORY.values():
        assert all(o.least is None or o.least <= o.best for o in orders.values())


LADDERS = """
title: A family
levels: [1, 2, 4]
least: {linear: {displacement_l2: 1.9}}
theory: {quadratic: {pressure_max: [0.5, null]}}
reference_code: {name: code_aster, version: "14"}
ladders:
  - {case: tria3.yaml, reference_code: {displacement_l2: 1.998}}
  - {case: hexa20.yaml, hexahedra: hexahedra, levels: [1, 2]}
  - {case: tria3.yaml, recovery: smooth}
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "family" / "orders.yaml"
    path.parent.mkdir()
    path.write_text(LADDERS)
    for case in ("tria3.yaml", "hexa20.yaml"):
        (path.parent / case).touch()
    return path


def test_ladders_as_their_file_gives_them(file):
    family = read_ladders(file)
    first, second, third = family.ladders
    assert (family.name, family.title, family.description) == ("family", "A family", "")
    assert (first.case, first.levels) == (file.parent / "tria3.yaml", (1, 2, 4))
    assert first.observed == {"displacement_l2": 1.998}
    assert (second.levels, second.hexahedra) == ((1, 2), "hexahedra")
    assert [first.folder(False), second.folder(True)] == ["tria3", "hexa20-swapped-hexahedra"]
    assert (third.recovery, third.folder(True)) == ("smooth", "tria3-swapped-smooth")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("levels: [1, 2, 4]", "levels: [0, 1]", r"levels\[0\] = 0: .*whole number from 1 to 1024"),
        ("levels: [1, 2, 4]", "levels: [2, 2]", r"levels = \[2, 2\]: .*each once"),
        ("displacement_l2: 1.9}", "displacment_l2: 1.9}", "did you mean displacement_l2"),
        ("- {case: tria3.yaml,", "- {", r"ladders\[0\].case: this key is needed"),
        ("tria3.yaml", "tria5.yaml", r"ladders\[0\].case = 'tria5.yaml': no such file"),
        ("hexahedra: hexahedra", "hexahedra: cubes", "must be pyramids or hexahedra"),
        ("recovery: smooth", "recovery: rough", "recovery = 'rough': must be"),
        ("levels: [1, 2]}", "finest: {peek: 1}}", "did you mean peak"),
        ("levels: [1, 2]}", "finest: {peak: 0}}", r"finest.peak = 0: must be a positive number"),
        ("[0.5, null]", "[0.5]", r"must be \[guaranteed, best\]"),
    ],
)
def test_what_is_wrong_in_the_file_is_told_in_one_line(file, old, new, message):
    assert old in LADDERS
    file.write_text(LADDERS.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as refusal:
        read_ladders(file)
    assert str(refusal.value).startswith(str(file))


MANUFACTURED = Path(__file__).parents[3] / "cases" / "manufactured"


def solved(case):
    """Size of the macro-elements, and errors, of a case."""
    solution = simulate(case, mesh_of(case))
    return {"size": element_size(solution.macro_elements, 2)} | errors(solution)


@pytest.mark.parametrize(
    ("cells", "displacement", "gradient"), [("tria3", 1.9, 0.9), ("quad8", 2.4, 1.4)]
)
def test_a_small_ladder_shows_the_orders_of_theory(cells, displacement, gradient):
    """The parabola problem on 16, 32 and 64 cells along each edge."""
    case = load_case(MANUFACTURED / f"{cells}.yaml")
    levels = [solved(refined(case, factor)) for factor in (1, 2, 4)]
    slopes = {
        error: fit_order([level["size"] for level in levels], [level[error] for level in levels])
        for error in ("displacement_l2", "displacement_h1", "pressure_l2", "pressure_means")
    }
    assert slopes["displacement_l2"].value >= displacement
    assert slopes["displacement_h1"].value >= gradient
    assert slopes["pressure_l2"].value >= 0.95
    assert slopes["pressure_means"].value >= 0.95
    # A piecewise constant cannot do better than 1; a slope far above would be an error in the norm.
    assert slopes["pressure_l2"].value <= 1.1


def test_the_mesh_of_a_file_is_refined_by_halving_alone(tmp_path):
    text = (MANUFACTURED / "tria3.yaml").read_text()
    start, end = text.index("mesh:"), text.index("plane:")
    path = tmp_path / "case.yaml"
    path.write_text(f"{text[:start]}mesh: {{file: some.med}}\n{text[end:]}")
    case = load_case(path)
    assert refined(case, 1) is case
    with pytest.raises(InputError, match=r"--refine = 3: of a mesh file must be"):
        refined(case, 3)


def test_an_expected_error_is_on_the_power_law_through_all_levels():
    """Of errors 8, 1, 1/2 at 1, 1/2, 1/4: slope log₂ 16 / 2 = 2 about the mean, 2^(2/3)."""
    assert at_first([1, 2, 4], [8.0, 1.0, 0.5]) == pytest.approx(2 ** (2 / 3) * 4)
    assert at_first([1, 2, 4], [8.0, 0.01, 0.5]) == 8.0  # errors cancel: the law is 1.4 there


def test_the_expected_errors_of_a_case_are_those_of_its_ladder(capsys):
    path = MANUFACTURED.parent / "bending" / "tria3-quad4.yaml"
    assert main(["expect", str(path)]) == 0
    printed = parse_mapping(capsys.readouterr().out, path)["expected"]
    given = load_case(path).expected
    assert printed.keys() == given.keys()
    for name, error in given.items():
        assert printed[name] == pytest.approx(error, rel=0.1)
