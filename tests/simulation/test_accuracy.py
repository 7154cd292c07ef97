"""The estimate of rounding bounds the true errors, and does not exceed them without end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.mesh import generate, transform
from solver.simulation.simulate import simulate
from solver.studies.stability.states import exact_state
from solver.studies.stability.sweeps import read_sweep
from solver.verification.verdict import Accuracy

SWEEPS = Path(__file__).parents[2] / "cases/stability/sweeps"
USELESS = 1000.0  # an estimate that exceeds the error by more


def error_over_estimate(sweep, mesh, value, young=2000.0, refine=1, state="compression"):
    """The largest error of pressure and stress over the estimate, in a uniform state.

    `young` is the modulus of the lower body, whose stress state is that of the upper one.
    """
    case = read_sweep(SWEEPS / f"{sweep}.yaml").case(mesh, value)
    lower = "bottom" if "bottom" in case.materials else "all"
    soft = replace(case.materials[lower], young=young)
    case = replace(
        case, mesh=case.mesh | {"refine": refine}, materials={**case.materials, lower: soft}
    )
    raw = generate(case.mesh, "test")
    exact = exact_state(case, state, raw)
    found = simulate(case, transform(raw, case.transform, "test") if case.transform else raw)
    stress = exact.stress_at(found.body == found.body[found.zones[0].master_nodes[0]])
    errors = [np.abs(zone.multiplier / exact.pressure - 1).max() for zone in found.zones]
    errors.append(np.abs(found.stress - stress).max() / exact.pressure)
    return max(errors) / Accuracy(found.accuracy).estimate


@pytest.mark.parametrize("young", [20.0, 2000.0, 2e5])
@pytest.mark.parametrize(("mesh", "refine"), [("2D", 1), ("2D", 4), ("3D", 1), ("3D", 2)])
@pytest.mark.parametrize("distance", [1e4, 2.3e7])
def test_turned_and_far_away(mesh, refine, young, distance):
    """Rounded coordinates tilt faces, along which bodies of unlike stiffness slide far."""
    share = error_over_estimate("turned-and-far", mesh, distance, young, refine)
    assert (1 / USELESS if young == 2000.0 else 0) < share < 1


@pytest.mark.parametrize("height", [1e-13, 1e-12, 1e-10, 1e-9])
def test_faces_that_count_as_flat(height):
    share = error_over_estimate("warp", "3D", height, state="hydrostatic")
    assert 1 / USELESS < share < 1


@pytest.mark.parametrize("sweep", ["rotation", "tiny-pressure", "poisson", "warp"])
def test_plain_rounding(sweep):
    found = read_sweep(SWEEPS / f"{sweep}.yaml")
    for value in found.values[:4]:
        share = error_over_estimate(sweep, "2D", value, state=found.state)
        assert 1 / USELESS < share < 1
