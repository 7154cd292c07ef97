"""Slopes fitted to errors that fall with a known order; ladders read from their files."""

from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.case.reader import load_case
from solver.simulation.simulate import simulate
from solver.studies.fits import ROUND_OFF, THEORY, element_size, fit_slope, is_rounding
from solver.studies.orders.description import read_ladders
from solver.system.errors import InputError
from solver.verification.norms import errors
from solver.verification.run import mesh_of, refined

SIZES = 2.0 ** -np.arange(1, 6)


@given(st.floats(0.2, 4), st.floats(1e-4, 1e4))
def test_an_exact_power_is_found_without_spread(order, factor):
    slope = fit_slope(SIZES, factor * SIZES**order)
    assert slope.value == pytest.approx(order, abs=1e-12)
    assert slope.spread < 1e-12


def test_only_the_finest_sizes_count_in_whatever_order():
    errors = SIZES**2
    errors[:2] = 7.0, 0.1
    mixed = [3, 0, 4, 1, 2]
    assert fit_slope(SIZES[mixed], errors[mixed]).value == pytest.approx(2)


def test_the_spread_is_the_standard_error_of_the_slope():
    """Log2 errors −0, −1, −4 at log2 sizes −0, −1, −2: slope 2, residuals −1/3, 2/3, −1/3.

    The sum of their squares is 2/3, with one degree of freedom, over Sxx = 2: √(1/3).
    """
    slope = fit_slope([1, 1 / 2, 1 / 4], [1, 1 / 2, 1 / 16])
    assert slope.value == pytest.approx(2)
    assert slope.spread == pytest.approx(sqrt(1 / 3))


def test_no_slope_from_two_points_from_rounding_or_without_refinement():
    assert fit_slope([1, 0.5], [1, 0.5]) is None
    assert fit_slope([1, 0.5, 0.25], [1e-3, ROUND_OFF, 1e-14]) is None
    assert fit_slope([0.5, 0.5, 0.5], [1, 2, 3]) is None
    assert fit_slope([1, 0.5, 0.25], [1, np.nan, 0.1]) is None
    assert fit_slope([], []) is None


def test_rounding_is_told_from_an_unknown_slope():
    assert is_rounding(SIZES, [1, 1, 1e-13, 1e-14, 0])
    assert not is_rounding(SIZES, [1, 1, 1e-3, 1e-14, 0])
    assert not is_rounding([], [])


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
    first, second = family.ladders
    assert (family.name, family.title, family.description) == ("family", "A family", "")
    assert (first.case, first.levels) == (file.parent / "tria3.yaml", (1, 2, 4))
    assert first.observed == {"displacement_l2": 1.998}
    assert (second.levels, second.hexahedra) == ((1, 2), "hexahedra")
    assert [first.folder(False), second.folder(True)] == ["tria3", "hexa20-swapped-hexahedra"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("levels: [1, 2, 4]", "levels: [0, 1]", r"levels\[0\] = 0: .*positive whole number"),
        ("levels: [1, 2, 4]", "levels: [2, 2]", r"levels = \[2, 2\]: .*each once"),
        ("displacement_l2: 1.9}", "displacment_l2: 1.9}", "did you mean displacement_l2"),
        ("- {case: tria3.yaml,", "- {", r"ladders\[0\].case: this key is needed"),
        ("tria3.yaml", "tria5.yaml", r"ladders\[0\].case = 'tria5.yaml': no such file"),
        ("hexahedra: hexahedra", "hexahedra: cubes", "must be pyramids or hexahedra"),
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
    solution = simulate(case, mesh_of(case), log=lambda line: None)
    return {"size": element_size(solution.macro_elements, 2)} | errors(solution)


@pytest.mark.parametrize(
    ("cells", "displacement", "gradient"), [("tria3", 1.9, 0.9), ("quad8", 2.4, 1.4)]
)
def test_a_small_ladder_shows_the_orders_of_theory(cells, displacement, gradient):
    """The parabola problem on 16, 32 and 64 cells along each edge."""
    case = load_case(MANUFACTURED / f"{cells}.yaml")
    levels = [solved(refined(case, factor)) for factor in (1, 2, 4)]
    slopes = {
        error: fit_slope([level["size"] for level in levels], [level[error] for level in levels])
        for error in ("displacement_l2", "displacement_h1", "pressure_l2", "pressure_means")
    }
    assert slopes["displacement_l2"].value >= displacement
    assert slopes["displacement_h1"].value >= gradient
    assert slopes["pressure_l2"].value >= 0.95
    assert slopes["pressure_means"].value >= 0.95
    # A piecewise constant cannot do better than 1; a slope far above would be an error in the norm.
    assert slopes["pressure_l2"].value <= 1.1


def test_the_mesh_of_a_file_cannot_be_refined(tmp_path):
    text = (MANUFACTURED / "tria3.yaml").read_text()
    start, end = text.index("mesh:"), text.index("plane:")
    path = tmp_path / "case.yaml"
    path.write_text(f"{text[:start]}mesh: {{file: some.med}}\n{text[end:]}")
    case = load_case(path)
    assert refined(case, 1) is case
    with pytest.raises(InputError, match=r"mesh.file.*only the mesh of a recipe can"):
        refined(case, 2)
