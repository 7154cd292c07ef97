"""Exponents of growth: found again where they are known, and fitted to the large sizes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.studies.scaling.growth import fit_growth, window


@given(st.floats(-1, 3), st.floats(1e-6, 1e3), st.integers(3, 7))
def test_a_power_is_found_again(power, factor, count):
    sizes = np.logspace(4, 6, count)
    growth = fit_growth(sizes, factor * sizes**power)
    assert growth.value == pytest.approx(power, abs=1e-9)
    assert growth.spread == pytest.approx(0.0, abs=1e-9)
    assert (growth.low, growth.high) == (sizes[0], sizes[-1])


def test_it_is_the_line_of_least_squares():
    sizes, costs = [1e4, 1e5, 1e6], [1.0, 20.0, 100.0]
    growth = fit_growth(sizes, costs)
    (slope, _), ((variance, _), _) = np.polyfit(np.log(sizes), np.log(costs), 1, cov=True)
    assert growth.value == pytest.approx(slope)
    # numpy scales by the sum of squares over as many degrees of freedom: three points less two.
    assert growth.spread == pytest.approx(math.sqrt(variance))


def test_two_points_have_a_slope_and_no_spread():
    growth = fit_growth([1e4, 1e6], [1.0, 1000.0])
    assert growth.value == pytest.approx(1.5)
    assert math.isnan(growth.spread)


@pytest.mark.parametrize(
    ("sizes", "costs"), [([1e4], [1.0]), ([1e4, 1e4], [1.0, 2.0]), ([1e4, 1e5], [0.0, 1.0])]
)
def test_what_has_no_exponent(sizes, costs):
    assert fit_growth(sizes, costs) is None


def test_the_large_sizes_are_fitted():
    sizes = [1e6, 1e4, 3e5, 1e5]
    assert window(sizes, 1e5, 1e6) == [3, 2, 0]
    assert window(sizes[:2], 1e5, 1e6) == [1, 0]
    assert window([1e4, 1e3, 3e4], 1e5, 1e6) == [0, 2]
    assert window([], 1e5, 1e6) == []
