"""Samples for the checks: values of a solve and their reference, at the same places.

A reference is a scalar, a sequence (vectors) or a mapping (tensors) of scalars, or `ExactValues`,
which know the case's exact solution. A sampler is called with the solution, the zone (None for the
whole solve) and the reference; it returns None if there is nothing to compare.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..case.expressions import evaluate
from ..mechanics.fem.stress import COMPONENTS
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from .coverage import expected_coverage

Reference = Any
# Pressures and gaps below this share of load and length are zero.
_TOUCHING = 1e-12
# A reference below this share of its quantity's own measure is the rounding of one that is zero.
_ROUNDED = 1e-14


@dataclass(frozen=True)
class Sample:
    """Values (n,) and their reference (n,); `place` names the place of the i-th one."""

    values: np.ndarray
    reference: np.ndarray
    place: Callable[[int], str]


Sampler = Callable[[Solution, Any, Reference], Sample | None]


def magnitude(reference: np.ndarray, measure: float) -> float:
    """The largest size of a reference (n,); zero where that is rounding beside the `measure`."""
    found = float(np.abs(reference).max(initial=0.0))
    return 0.0 if found <= _ROUNDED * measure else found


def _at_macro_elements(values: np.ndarray, expected: np.ndarray) -> Sample:
    return Sample(values, expected, "macro-element {}".format)


def expected_pressure(zone: ZoneResult, reference: Reference) -> np.ndarray:
    """The reference's pressure (m,) on every macro-element: its mean, or that at the centre."""
    if isinstance(reference, ExactValues):
        return reference.pressure(zone)
    return evaluate(reference, zone.centre)


def reference_where_covered(
    solution: Solution, zone: ZoneResult, reference: Reference
) -> np.ndarray:
    """The reference's pressure (m,), zero where nothing is covered, or where all is rounding."""
    expected = expected_pressure(zone, reference)
    expected = np.where(expected_coverage(solution, zone, reference) > 0, expected, 0.0)
    return expected if magnitude(expected, solution.scalars.load_scale) else 0.0 * expected


def pressure(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The multiplier of every macro-element."""
    return _at_macro_elements(zone.multiplier, reference_where_covered(solution, zone, reference))


def pressure_of_forces(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The pressure by forces at slave nodes; the multiplier where they do not determine it."""
    known = zone.estimates.pressure_of_forces
    found = zone.multiplier if known is None else known
    return _at_macro_elements(found, reference_where_covered(solution, zone, reference))


def gap(_: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The average gap of every macro-element."""
    if isinstance(reference, ExactValues):
        return _at_macro_elements(zone.gap, reference.gap(zone))
    return _at_macro_elements(zone.gap, evaluate(reference, zone.centre))


def status(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """Closed where the reference presses.

    Either status is right at the edge of contact, where surfaces touch without pressure, and where
    the reference is one that is zero, rounded.
    """
    found = zone.closed.astype(float)
    wanted = reference_where_covered(solution, zone, reference)
    expected = (wanted > 0).astype(float)
    rounded = (wanted > 0) & (wanted <= _TOUCHING * solution.scalars.load_scale)
    expected = np.where(rounded, found, expected)
    touching = zone.multiplier <= _TOUCHING * solution.scalars.load_scale
    touching &= zone.gap <= _TOUCHING * solution.scalars.length
    expected = np.where(touching & (expected == 0), found, expected)
    if isinstance(reference, ExactValues):
        expected = np.where(reference.ends_within(zone), found, expected)
    return _at_macro_elements(found, expected)


def coverage(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The reference's; without one, covered in full wherever there is a pressure to compare."""
    return _at_macro_elements(zone.coverage, expected_coverage(solution, zone, reference))


def covered_pressure(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The multiplier times the coverage."""
    expected = expected_pressure(zone, reference)
    if "coverage" in solution.case.reference.values:
        expected = expected * expected_coverage(solution, zone, reference)
    return _at_macro_elements(zone.coverage * zone.multiplier, expected)


def _nodes(solution: Solution) -> np.ndarray:
    """The nodes of bodies that are not rigid."""
    return np.flatnonzero(solution.deformable)


def _at_nodes(nodes: np.ndarray) -> Callable[[int], str]:
    return lambda i: f"node {nodes[i]}"


def by_component(
    values: np.ndarray,
    points: np.ndarray,
    names: Sequence[str],
    reference: Reference,
    exact: Callable[[], np.ndarray],
    place: Callable[[int], str],
) -> Sample:
    """The components of values (n, c) at points (n, dim) that the reference gives: on one scale.

    They follow one another. `exact` has those of the case's exact solution (n, c), all of `names`.
    """
    if isinstance(reference, ExactValues):
        expected = dict(zip(names, exact().T, strict=True))
    else:
        if not isinstance(reference, Mapping):
            reference = dict(zip(names, reference, strict=True))
        expected = {name: evaluate(value, points) for name, value in reference.items()}
    listed, count = list(expected), len(points)
    return Sample(
        np.concatenate([values[:, names.index(name)] for name in listed]),
        np.concatenate(list(expected.values())),
        lambda i: f"{place(i % count)} ({listed[i // count]})",
    )


def surface_stress(side: str) -> Sampler:
    """Sample the normal stress on one surface of a zone; None on a rigid body."""

    def sample(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
        nodes, values = (getattr(zone.surfaces, k) for k in (f"{side}_nodes", f"stress_{side}"))
        if len(nodes) and not solution.deformable[nodes].any():
            return None
        if isinstance(reference, ExactValues):
            faces = zone.faces_of(side)
            expected = reference.surface_stress(nodes, faces)
        else:
            expected = evaluate(reference, solution.mesh.points[nodes])
        return Sample(values, expected, _at_nodes(nodes))

    return sample


def nodal_stress(solution: Solution, _: None, reference: Reference) -> Sample:
    """The stress along the direction of contact at all nodes."""
    nodes = _nodes(solution)
    values = solution.fields.normal_stress[nodes]
    if isinstance(reference, ExactValues):
        expected = reference.stress_along_contact(nodes)
    else:
        expected = evaluate(reference, solution.mesh.points[nodes])
    return Sample(values, expected, _at_nodes(nodes))


def displacement(solution: Solution, _: None, reference: Reference) -> Sample:
    """All components at all nodes."""
    nodes, axes = _nodes(solution), "xyz"[: solution.displacement.shape[1]]
    values, points = solution.displacement[nodes], solution.mesh.points[nodes]
    return by_component(
        values, points, axes, reference, lambda: reference.displacement(nodes), _at_nodes(nodes)
    )


def stress_components(solution: Solution, _: None, reference: Reference) -> Sample:
    """The given components at all nodes."""
    nodes = _nodes(solution)
    values, points = solution.stress[nodes], solution.mesh.points[nodes]
    return by_component(
        values, points, COMPONENTS, reference, lambda: reference.stress(nodes), _at_nodes(nodes)
    )


def norm(name: str) -> Sampler:
    """Sample an error norm, where the case gives it a tolerance."""

    def sample(solution: Solution, _: None, __: Reference) -> Sample | None:
        if name not in solution.case.reference.tolerance:
            return None
        value = solution.quality.errors.get(name, float("nan"))
        return Sample(np.array([value]), np.zeros(1), lambda _: "the whole solve")

    return sample


def balance(solution: Solution, _: None, __: Reference) -> Sample:
    """Every imbalance; the reference is zero."""
    names = list(solution.quality.balance)
    values = np.array(list(solution.quality.balance.values()), dtype=float)
    return Sample(values, np.zeros(len(values)), lambda i: f"the balance of {names[i]}")


def counts(solution: Solution, _: None, __: Reference) -> Sample | None:
    """Cells and contact faces of the bodies as meshed; the case gives the reference."""
    bodies, rows = {body.name: body for body in solution.bodies}, []
    for group, given in solution.case.mesh.counts.items():
        found = {"cells": sum(bodies[group].cells.values()), "faces": bodies[group].faces}
        rows += [(found[what], number, f"{what} of {group}") for what, number in given.items()]
    if not rows:
        return None
    values, expected, places = zip(*rows, strict=True)
    return Sample(np.array(values, float), np.array(expected, float), lambda i: places[i])


def observed(quantity: str) -> Sampler:
    """Sample the observations in a zone, at the steps whose share of the reference is known.

    The reference is that of the last step, an exact solution that of the load factor 1.
    """

    def sample(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
        exact = isinstance(reference, ExactValues)
        rows = [
            (share, f"macro-element {o['macro_element']}, load factor {step.factor:g}", o)
            for step, share in zip(solution.steps, _shares(solution, exact), strict=True)
            for o in step.observations
            if o["zone"] == zone.name and share is not None
        ]
        if not rows:
            return None
        shares, places, seen = zip(*rows, strict=True)
        elements = [one["macro_element"] for one in seen]
        if exact:
            expected = getattr(reference, quantity)(zone)[elements]
        else:
            expected = evaluate(reference, zone.centre[elements]) * np.array(shares)
        values = np.array([float(one[quantity]) for one in seen])
        return Sample(values, expected, lambda i: places[i])

    return sample


def _shares(solution: Solution, exact: bool) -> list[float | None]:
    """The pressures and gaps at each step over those in the last one; None where it is unknown.

    All grows with the load factor where surfaces touch from the start and nothing slips back.
    """
    case, factors = solution.case, [step.factor for step in solution.steps]
    last, of_factors = factors[-1], bool(factors[-1]) and not case.histories
    if exact and of_factors:
        return [1.0 if factor == 1 else None for factor in factors]
    back = case.frictional and bool((np.diff(factors) < 0).any())
    if of_factors and not (back or case.moving or _apart(solution)):
        return [factor / last if factor / last >= 0 else None for factor in factors]
    again = (factor == last and not case.frictional for factor in factors[:-1])
    return [*(1.0 if alike else None for alike in again), 1.0]


def _apart(solution: Solution) -> bool:
    """Whether surfaces are apart, or overlap, before anything acts."""
    if any(zone.interference or zone.clearance is not None for zone in solution.case.zones):
        return True
    gaps = (zone.surfaces.meshed_gap for zone in solution.zones)
    most = max((np.abs(gap).max() for gap in gaps if gap is not None), default=0.0)
    return bool(most > _TOUCHING * solution.scalars.length)
