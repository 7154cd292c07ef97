"""Samples of single numbers: contact forces, reactions, strain energy, values at probes.

See `solver.verification.samples`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..case.expressions import evaluate
from ..mechanics.fem.stress import COMPONENTS
from ..simulation.results.solution import Solution, ZoneResult
from ..system.errors import InputError, hint
from .samples import Reference, Sample, Sampler


def contact_force(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
    """The force on the surface that the case lists as slave, which may be solved as master."""
    if zone.resultants is None:
        return None
    sign = -1.0 if solution.swapped else 1.0
    return Sample(sign * zone.resultants.force, np.array(reference), lambda i: f"along {'xyz'[i]}")


def contact_area(_: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
    """The area of contact."""
    if zone.resultants is None:
        return None
    return Sample(zone.resultants.area[:1], np.array([reference]), lambda _: "the whole zone")


def reaction(solution: Solution, _: None, reference: Reference) -> Sample | None:
    """The forces that hold groups; InputError for a group that nothing holds."""
    found = {one.group: one.force for one in solution.reactions}
    if not found:
        return None
    for group in reference:
        if group not in found:
            allowed = f"no support holds it; {hint(group, found)}"
            raise InputError(solution.case.path, f"reference.reaction.{group}", group, allowed)
    places = [f"{group} along {axis}" for group in reference for axis in "xyz"[: len(found[group])]]
    values = np.concatenate([found[group] for group in reference])
    return Sample(values, np.concatenate(list(reference.values())), lambda i: places[i])


def moment(solution: Solution, _: None, reference: Reference) -> Sample | None:
    """The moments of contact on rigid bodies about their reference points."""
    found = {one.body: one.moment for one in solution.rigid}
    if not found:
        return None
    rows: list[tuple[float, float, str]] = []
    for body, given in reference.items():
        axes = "xyz" if isinstance(given, tuple) else "z"
        values = found[body]["xyz".index(axes[0]) :].tolist()
        wanted = np.atleast_1d(given).tolist()
        rows += zip(values, wanted, [f"{body} about {axis}" for axis in axes], strict=True)
    values, expected = np.array([row[:2] for row in rows]).T
    return Sample(values, expected, lambda i: rows[i][2])


def probed(quantity: str) -> Sampler:
    """Sample a quantity at the probes that the reference names."""

    def sample(solution: Solution, _: None, reference: Reference) -> Sample | None:
        found = []
        for name, expected in reference.items():
            if (probe := solution.probes.get(name)) is None:
                return None
            values = getattr(probe, quantity).reshape(len(probe.place), -1)
            names = COMPONENTS if quantity == "stress" else ("x", "y", "z")
            for key, value in _components(quantity, expected).items():
                found_there = values[:, names.index(key or "x")]
                rows = zip(found_there, evaluate(value, probe.place), strict=True)
                found += [(*row, f"probe {name}{key and f' ({key})'}") for row in rows]
        got, wanted, places = zip(*found, strict=True)
        return Sample(np.array(got), np.array(wanted), lambda i: places[i])

    return sample


def _components(quantity: str, expected: Any) -> dict[str, Any]:
    """The expected components by name."""
    if quantity == "displacement":
        return dict(zip("xyz", expected, strict=False))
    return {"": expected} if quantity == "pressure" else expected


def strain_energy(solution: Solution, _: None, reference: Reference) -> Sample | None:
    """The strain energy of all bodies together."""
    if solution.strain_energy is None:
        return None
    found = np.array([solution.strain_energy])
    return Sample(found, np.array([reference]), lambda _: "the whole solve")
