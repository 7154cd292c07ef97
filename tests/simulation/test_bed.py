"""A block on a Winkler bed, which bears what it is pressed with."""

import pytest

from tests.scenes import solved
from tests.simulation.test_supports import CASE, STIFF


@pytest.mark.parametrize("swapped", [False, True])
def test_a_block_sinks_into_its_bed(swapped):
    """Its mean displacement on the bed is p / k: Simpson's rule on the faces of QUAD8."""
    text = CASE.replace("group: base, spring: {normal: 40.0}", "group: base, bed: 40.0")
    solution = solved(text, swapped=swapped)
    x, y = solution.mesh.points.T
    order = sorted((x[i], i) for i in range(len(x)) if abs(y[i] + 1) < 1e-9)
    sunk = [solution.displacement[i, 1] for _, i in order]
    mean = (sunk[0] + 4 * sunk[1] + 2 * sunk[2] + 4 * sunk[3] + sunk[4]) / 12
    assert mean == pytest.approx(-25.0 / STIFF, rel=1e-12)
