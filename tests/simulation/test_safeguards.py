"""Each cure against lost digits holds what it is there for, and without it the digits are gone."""

import numpy as np
import pytest

from solver.simulation.options import Options, Safeguards
from solver.simulation.simulate import simulate
from solver.verification.judge import judge
from tests.scenes import block_case, block_mesh, changed_case, errors, moved, turn, with_points
from tests.simulation.test_extremes import MESHES, patch_errors, patch_solution

EPSILON = np.finfo(float).eps
LONG = np.finfo(np.longdouble).eps < np.finfo(float).eps
needs_extended = pytest.mark.skipif(not LONG, reason="extended precision is double precision here")


def without(safeguard: str) -> Options:
    return Options(safeguards=Safeguards(**{safeguard: False}))


def turned(dim):
    """A tiny pressure: the interface's own rounding is a gap as large as what it presses in."""
    return {"move": lambda x: x @ turn(dim, 0.1).T, "pressure": 1e-10}


def soft(_):
    """A stiff body on a soft one: it moves far and strains little."""
    return {"lower": 2e-5}


def slender(dim):
    return {"move": lambda x: x * np.array([1e4, *[1.0] * (dim - 1)])}


def tall(dim, height=1e3):
    return {"move": lambda x: x * np.array([*[1.0] * (dim - 1), height])}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("safeguard", "scene", "held", "lost"),
    [
        ("gap_threshold", turned, 1e-12, 1e-4),
        ("differences", soft, 1e-12, 1e-9),
        ("remainder", soft, 1e-12, 1e-9),
        ("refinement", slender, 1e-12, 1e-11),
    ],
)
def test_a_cure_holds_what_is_lost_without_it(dim, safeguard, scene, held, lost):
    assert max(patch_errors(dim, **scene(dim))) < held
    assert max(patch_errors(dim, options=without(safeguard), **scene(dim))) > lost


@needs_extended
@pytest.mark.parametrize("dim", [2, 3])
def test_extended_precision_holds_what_tall_blocks_lose_without_it(dim):
    # One height may lose little by luck, which depends on the machine; three hardly.
    held, lost = (
        max(max(patch_errors(dim, options=o, **tall(dim, h))) for h in (1100, 1700, 2000))
        for o in (Options(), without("extended"))
    )
    assert held < 3e-12
    assert lost > 1e-11


def test_without_closure_faces_that_are_no_parallelograms_break_the_patch_test():
    mesh = moved(block_mesh("HEXA8", "HEXA8"), 0.05)
    held, lost = (
        errors(simulate(block_case(3).as_solved(hexahedra="hexahedra"), mesh, options=options))[
            "pressure"
        ]
        for options in (Options(), without("closure"))
    )
    assert held < 1e-12
    assert lost > 1e-9


@pytest.mark.parametrize("dim", [2, 3])
def test_without_local_coordinates_moments_are_lost_far_from_the_origin(dim):
    case = changed_case(dim, normal=True)
    mesh = block_mesh(*MESHES[dim])
    # One sum of few terms may be exact by luck, three hardly.
    far = [with_points(mesh, mesh.points + 1e8 / part) for part in (3, 7, 11)]
    held, lost = (
        max(max(simulate(case, m, options=options).quality.balance.values()) for m in far)
        for options in (Options(), without("local_coordinates"))
    )
    assert held < 1e-13
    assert lost > 1e-11


@needs_extended
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scene", [tall, lambda dim: {"poisson": 0.499999999}])
def test_the_estimate_bounds_the_error_and_not_by_much(dim, scene):
    found = patch_solution(dim, **scene(dim))
    error = np.abs(found.zones[0].multiplier / 25.0 - 1).max()
    assert error < max(found.quality.accuracy.values()) < 1e3 * max(error, EPSILON)


@pytest.mark.parametrize("dim", [2, 3])
def test_unreliable_where_coordinates_leave_no_digits_and_only_there(dim):
    """Turned and 10¹² blocks away the stored coordinates are off by 10⁻⁴ of a block."""
    near = patch_solution(dim, move=lambda x: x @ turn(dim, 1.1).T)
    assert max(near.quality.accuracy.values()) < 1e-11
    assert judge(near, []).verdict == "solved"
    verdict = judge(patch_solution(dim, move=lambda x: x @ turn(dim, 1.1).T + 1e12), [])
    assert verdict.verdict == "unreliable"
    assert "coordinates" in verdict.reason
