"""Springs in the interface: they close by their compliance times the pressure."""

import pytest

from solver.simulation.simulate import simulate
from tests.scenes import PRESSURE, block_mesh, changed_case


@pytest.mark.parametrize("dim", [2, 3])
def test_springs_in_the_interface_close(dim):
    cells = ("QUAD8", "TRIA6") if dim == 2 else ("HEXA8", "TETRA10")
    case = changed_case(dim, zone=", compliance: 1.0e-4")
    found = simulate(case, block_mesh(*cells))
    assert found.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-11)
    assert found.zones[0].gap == pytest.approx(-1e-4 * PRESSURE, rel=1e-11)
