"""Extremes that a plain implementation loses digits on: each holds, or is known to its floor."""

import numpy as np
import pytest

from solver.simulation.options import LEAN
from solver.simulation.simulate import simulate
from tests.scenes import block_mesh, changed_case, turn, with_points

MESHES = {2: ("TRIA6", "QUAD4", (6, 4)), 3: ("TETRA10", "HEXA8", (3, 2))}


def patch_solution(
    dim,
    lower=2000.0,
    upper=2000.0,
    poisson=0.3,
    pressure=25.0,
    move=None,
    swapped=False,
    options=LEAN,
):
    """The patch test, supports by plane."""
    materials = (
        f"{{bottom: {{young: {lower!r}, poisson: {poisson!r}}}, "
        f"top: {{young: {upper!r}, poisson: {poisson!r}}}}}"
    )
    changes = (
        ("{all: {young: 2000.0, poisson: 0.3}}", materials),
        ("pressure: 25.0", f"pressure: {pressure!r}"),
    )
    mesh = block_mesh(*MESHES[dim])
    if move:
        mesh = with_points(mesh, move(mesh.points))
    case = changed_case(dim, *changes, normal=True).as_solved(swapped)
    return simulate(case, mesh, options)


def patch_errors(dim, pressure=25.0, **scene):
    """Relative errors of pressure and normal stress of the patch test."""
    solution = patch_solution(dim, pressure=pressure, **scene)
    zone = solution.zones[0]
    return (
        np.abs(zone.multiplier / pressure - 1).max(),
        np.abs(solution.fields.normal_stress / pressure + 1).max(),
    )


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("ratio", [1e-8, 1e-4, 1e4, 1e8])
@pytest.mark.parametrize("dim", [2, 3])
def test_stiffness_ratio(dim, ratio, swapped):
    """Rigid motion and remainder: stored as one number a node, 1e-8 leaves 4e-7 of the stress."""
    assert max(patch_errors(dim, lower=2000.0 * ratio, swapped=swapped)) < 1e-12


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("poisson", [-0.9, 0.0, 0.49, 0.4999, 0.499999, 0.499999999])
def test_nearly_incompressible(dim, poisson):
    """The mixed form keeps it so; see `test_mixed` for what is lost without."""
    assert max(patch_errors(dim, poisson=poisson)) < 5e-13


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("pressure", [1e-12, 1e12])
@pytest.mark.parametrize("angle", [0.0, 0.1, 1.3])
def test_turned_with_tiny_and_huge_pressure(dim, pressure, angle):
    errors = patch_errors(dim, pressure=pressure, move=lambda x: x @ turn(dim, angle).T)
    assert max(errors) < 1e-12


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("offset", [1e3, 1e6])
def test_far_from_the_origin(dim, offset):
    """Moved by whole numbers, so that the stored coordinates keep what they say to 1e-10."""
    assert max(patch_errors(dim, move=lambda x: x + offset)) < 1e-11 * max(1, offset / 1e3)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("stretch", [1e3, 1e5])
def test_stretched_along_the_interface(dim, stretch):
    factors = np.array([stretch, *[1.0] * (dim - 1)])
    assert max(patch_errors(dim, move=lambda x: x * factors)) < 1e-12


@pytest.mark.parametrize("dim", [2, 3])
def test_stretched_across_the_interface(dim):
    factors = np.array([*[1.0] * (dim - 1), 1e3])
    assert max(patch_errors(dim, move=lambda x: x * factors)) < 1e-9
