"""The orders of theory on a small ladder, and the errors that a ladder predicts."""

from pathlib import Path

import pytest

from solver.case.reader import load_case
from solver.case.yaml import parse_mapping
from solver.commands.cli import main
from solver.simulation.simulate import simulate
from solver.studies.converge import at_first
from solver.studies.theory import element_size, fit_order
from solver.system.errors import InputError
from solver.verification.norms import errors
from solver.verification.run import mesh_of, refined

MANUFACTURED = Path(__file__).parents[2] / "cases" / "manufactured"


def solved(case):
    """Size of the macro-elements, and errors, of a case."""
    solution = simulate(case, mesh_of(case))
    return {"size": element_size(solution.cost.macro_elements, 2)} | errors(solution)


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
    given = load_case(path).reference.expected
    assert printed.keys() == given.keys()
    for name, error in given.items():
        assert printed[name] == pytest.approx(error, rel=0.1)
    assert main(["expect", str(MANUFACTURED.parent / "ssnp170" / "a.yaml")]) == 0
    assert capsys.readouterr().out == "# no check against a reference errs by more than round-off\n"
