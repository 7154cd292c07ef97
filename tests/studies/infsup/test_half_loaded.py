"""The half-loaded block: the cut keeps its pressure from oscillating, bilateral and opening."""

import numpy as np
import pytest

from solver.studies.infsup.half_loaded import PressureProfile, profile_pair


@pytest.mark.parametrize("cells", ["TRIA3", "QUAD4", "QUAD8"])
def test_the_pressure_does_not_oscillate_with_the_cut(cells):
    bilateral, opening = profile_pair(cells, True, 32)
    assert bilateral.oscillation < 0.1
    assert opening.oscillation < 0.15


@pytest.mark.parametrize("cells", ["TRIA3", "QUAD4"])
def test_it_oscillates_without_the_cut(cells):
    bilateral, opening = profile_pair(cells, False, 32)
    assert bilateral.oscillation > 0.5
    assert opening.oscillation > 0.3


def test_contact_that_opens_does_not_pull_and_carries_the_load():
    bilateral, opening = profile_pair("QUAD8", True, 16)
    assert min(bilateral.pressure) < 0 <= min(opening.pressure)
    # The load of 25 on a length of 1, over 16 faces of a length of 1/8.
    assert sum(opening.pressure) / 8 == pytest.approx(1.0, rel=1e-12)
    assert sum(bilateral.pressure) / 8 == pytest.approx(1.0, rel=1e-12)
    assert np.all(np.diff(opening.place) > 0)


def test_the_oscillation_is_the_largest_second_difference():
    assert (
        PressureProfile("QUAD4", True, True, [0, 1, 2, 3], [0.0, 1.0, 0.0, -1.0]).oscillation == 2.0
    )
