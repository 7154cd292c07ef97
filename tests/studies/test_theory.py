"""Powers fitted in log–log: found again where they are known, their spread derived by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.studies.theory import ROUND_OFF, fit_order, fit_power, is_rounding

SIZES = 2.0 ** -np.arange(1, 6)


@given(st.floats(-1, 4), st.floats(1e-6, 1e4), st.integers(3, 7))
def test_a_power_is_found_again(power, factor, count):
    sizes = np.logspace(4, 6, count)
    fit = fit_power(sizes, factor * sizes**power)
    assert fit.value == pytest.approx(power, abs=1e-9)
    assert fit.spread == pytest.approx(0.0, abs=1e-9)
    assert (fit.low, fit.high) == (sizes[0], sizes[-1])


def test_the_spread_is_the_standard_error_of_the_slope():
    """Log2 errors −0, −1, −4 at log2 sizes −0, −1, −2: slope 2, residuals −1/3, 2/3, −1/3.

    The sum of their squares is 2/3, with one degree of freedom, over Sxx = 2: √(1/3).
    """
    fit = fit_order([1, 1 / 2, 1 / 4], [1, 1 / 2, 1 / 16])
    assert fit.value == pytest.approx(2)
    assert fit.spread == pytest.approx(math.sqrt(1 / 3))
    assert str(fit) == "2.00 ± 0.58"


def test_two_points_have_a_power_and_no_spread():
    fit = fit_power([1e4, 1e6], [1.0, 1000.0])
    assert fit.value == pytest.approx(1.5)
    assert math.isnan(fit.spread)
    assert str(fit) == "1.50"


@pytest.mark.parametrize(
    ("sizes", "values"),
    [([], []), ([1], [1]), ([2, 2], [1, 2]), ([1, 2], [0, 1]), ([1, 2], [math.nan, 1])],
)
def test_what_has_no_power(sizes, values):
    assert fit_power(sizes, values) is None


def test_only_the_finest_sizes_count_in_whatever_order():
    errors = SIZES**2
    errors[:2] = 7.0, 0.1
    mixed = [3, 0, 4, 1, 2]
    assert fit_order(SIZES[mixed], errors[mixed]).value == pytest.approx(2)


def test_no_order_from_two_points_from_rounding_or_without_refinement():
    assert fit_order([1, 0.5], [1, 0.5]) is None
    assert fit_order([1, 0.5, 0.25], [1e-3, ROUND_OFF, 1e-14]) is None
    assert fit_order([0.5, 0.5, 0.5], [1, 2, 3]) is None
    assert fit_order([1, 0.5, 0.25], [1, np.nan, 0.1]) is None
    assert fit_order([], []) is None


def test_rounding_is_told_from_an_unknown_order():
    assert is_rounding(SIZES, [1, 1, 1e-13, 1e-14, 0])
    assert not is_rounding(SIZES, [1, 1, 1e-3, 1e-14, 0])
    assert not is_rounding([], [])
