"""Stabilised contact: exact where the pressure is linear, and smooth where plain LAC scatters."""

import numpy as np
import pytest

from solver import solve_case
from solver.lac.errors import SolveError
from solver.simulation.equilibrium.problem import ContactProblem
from tests.patches import force_solver
from tests.views.cases import FOUND

STIFF = {"bottom": ("QUAD4", 16), "top": ("QUAD4", 8), "young": (1e5, 1e3)}
"""A fine, stiff slave on a coarse, soft master."""
LYING = {"bottom": ("PENTA6", 4), "top": ("HEXA8", 2), "young": (2e3, 1e3)}
"""Quadrangles of PENTA6, on a master that is twice as coarse."""


def waves(bottom, top, young, **keys) -> dict:
    """Two layers pressed together, one of them wavy; cells and faces along the interface."""
    dim = 2 if bottom[0] in ("TRIA3", "QUAD4") else 3
    axes = "xyz"[:dim]
    sides = [(group + axis, axis) for axis in axes[:-1] for group in ("sym", "far")]
    phi = "*".join(f"cos(pi*{axis}/50)" for axis in axes[:-1])
    layers = {}
    for name, (cells, n) in {"bottom": bottom, "top": top}.items():
        layers[name] = {"cells": cells, "divisions": [n] * (dim - 1) + [max(n // 2, 2)]}
        if cells == "PENTA6":
            layers[name]["contact"] = "QUAD4"
    return {
        "name": "waves",
        "mesh": {"recipe": "blocks", "size": 50, **layers},
        **({"plane": "strain"} if dim == 2 else {}),
        "materials": {
            "bottom": {"young": young[0], "poisson": 0.3},
            "top": {"young": young[1], "poisson": 0.2},
        },
        "supports": [
            *({"group": group, "fix": [axis]} for group, axis in sides),
            {"group": "base", "fix": [axes[-1]]},
            {"group": "press", "fix": {axes[-1]: "solution"}},
        ],
        "contact": [
            {
                "name": "interface",
                "slave": "bottom_contact",
                "master": "top_contact",
                "clearance": f"0.2*(1 - {phi})",
                **keys,
            }
        ],
        "reference": {
            "kind": "analytical",
            "solution": {
                "name": f"waves_{dim}d", "size": 50, "amplitude": 0.2, "mean_pressure": 25,
                "bottom": "bottom", "top": "top",
            },
            "contact_pressure": "solution",
        },
    }  # fmt: skip


def deviation(found) -> np.ndarray:
    """What single faces have beside the exact pressure, over its peak."""
    [zone] = found.solution.zones
    exact = found.solution.case.reference.exact.contact_pressure(zone.centre)
    return (zone.multiplier - exact) / exact.max()


def jump(found) -> float:
    """The largest difference of neighbours in a plane case, over the peak."""
    order = np.argsort(found.solution.zones[0].centre[:, 0])
    return float(np.abs(np.diff(deviation(found)[order])).max())


def test_a_fine_stiff_slave():
    """On a master half, then a quarter as fine; ten, then ten thousand times as soft."""
    plain = solve_case(waves(**STIFF))
    assert jump(plain) > 1
    assert jump(solve_case(waves(**STIFF, stabilised=True))) < 0.01
    for young in (1e4, 1e7):
        given = STIFF | {"top": ("QUAD4", 4), "young": (young, 1e3)}
        found = solve_case(waves(**given, stabilised=True))
        assert found.solution.cost.iterations == 1
        assert jump(found) < 0.03
        assert np.abs(deviation(found)).max() < 0.05


def test_quadrangles_of_prisms():
    plain, found = (solve_case(waves(**LYING, stabilised=s)) for s in (False, True))
    assert np.abs(deviation(plain)).max() > 0.3
    assert np.abs(deviation(found)).max() < 0.1


def test_it_converges_faster_than_plain_contact():
    """Second order of the means, of matching facets; the gaps that it leaves fall faster."""
    errors, gaps = [], []
    for n in (8, 16, 32):
        given = {"bottom": ("QUAD4", n), "top": ("QUAD4", n // 2), "young": (2e3, 1e3)}
        found = solve_case(waves(**given, stabilised=True))
        errors.append(np.abs(deviation(found)).max())
        gaps.append(np.abs(found.solution.zones[0].gap).max())
    assert errors[0] / errors[1] > 3
    assert errors[1] / errors[2] > 3
    assert gaps[1] / gaps[2] > 7


def check_like_a_factor(case, poisson, close):
    """Statuses by multigrid are a factor's; pressures to `close` parts of the peak.

    Of `waves` whose upper layer lifts off in places: several statuses are solved roughly.
    """
    case["materials"]["bottom"]["poisson"] = poisson
    case["supports"][-1]["fix"] = ["x", "y"]
    case["loads"] = [{"group": "press", "pressure": 0.5}]
    case.pop("reference")
    found = []
    for kind in ("multigrid", "auto"):
        with force_solver(kind):
            found.append(solve_case(case).solution)
    assert [("multigrid" in solution.cost.linear_solver) for solution in found] == [True, False]
    assert found[0].cost.iterations > 1
    one, other = (solution.zones[0] for solution in found)
    assert 0 < one.closed.sum() < len(one.closed)
    assert (one.closed == other.closed).all()
    peak = other.multiplier.max()
    assert np.abs(one.multiplier - other.multiplier).max() < close * peak


def test_multigrid_finds_the_pressures_of_a_factor():
    case = waves(("HEXA8", 6), ("HEXA8", 3), (1e4, 1e3), stabilised=True)
    check_like_a_factor(case, 0.3, 1e-11)


def test_contact_that_opens():
    """A half ellipse of pressure: the same contact, and forces in balance."""
    case = waves(("QUAD4", 24), ("QUAD4", 12), (1e4, 1e3))
    case["supports"][-1]["fix"] = ["x"]
    case["loads"] = [{"group": "press", "pressure": 2.0}]
    case.pop("reference")
    plain, found = (
        solve_case({**case, "contact": [{**case["contact"][0], "stabilised": s}]})
        for s in (False, True)
    )
    [zone] = found.solution.zones
    assert 0 < zone.closed.sum() < len(zone.closed)
    assert zone.multiplier.min() == 0
    assert zone.gap[~zone.closed].min() > 0
    for one in (plain, found):
        assert one.solution.zones[0].resultants.force[1] == pytest.approx(-100, rel=1e-9)


def test_the_plan_tells_the_gaps_that_it_leaves():
    found = solve_case(waves(**LYING, stabilised=True))
    [zone] = found.solution.zones
    line = next(line.what for line in found.solution.plan if "stabilised" in line.what)
    assert f"{np.abs(zone.gap).max():.1e}" in line


# Multipliers at slave vertices, with no unknown of their own, in systems solved by multigrid.


@pytest.mark.parametrize("treatment", ["nodal", "uncut"])
def test_the_pressures_are_those_of_a_factor(treatment):
    case = waves(("HEXA8", 6), ("HEXA8", 3), (1e3, 1e4), treatment=treatment)
    check_like_a_factor(case, 0.3, 1e-10)


def test_contact_that_bears_nothing_has_no_status_to_settle(monkeypatch):
    """Above contact with friction, whose search finds it anew where its status changes."""
    monkeypatch.setattr(ContactProblem, "gives_way_where", lambda _problem, _pressed: True)
    assert solve_case(FOUND["faint"] | {"steps": [0.0]}).verdict == "solved"
    with pytest.raises(SolveError, match="stabilised contact does not settle"):
        solve_case(FOUND["faint"] | {"steps": [1.0]})
