"""Samples of friction: its law, traction and slip, the area that sticks, work: see `samples`."""

from __future__ import annotations

import numpy as np

from ..simulation.equilibrium.rest import stress_of_motion
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from .coverage import expected_coverage
from .samples import Reference, Sample, Sampler, by_component

# Where the pressures of the last step are below this share of the largest of all steps, or of the
# stress that the displacement could cause, the law is judged by that share: forces are rounded on
# their scale. Slips as well.
_LITTLE, _LITTLE_OF_MOTION = 0.1, 1e-6
# Smaller coefficients are judged as if they were this one: rounding of the tractions scales with
# the pressure.
_LITTLE_FRICTION = 1e-2
# Slips shorter than this share of the model's length count as zero.
_NO_WAY = 1e-10


def friction_law(solution: Solution, zone: ZoneResult, _: Reference) -> Sample | None:
    """By how much a zone breaks Coulomb's law: on each macro-element, and in each step.

    The traction t on the slave is at most μp, and 0 where open; what sticks has no slip w; what
    slips has t |w| = μp w. Relative to the largest μp (μ at least 0.01), to the largest slip, to
    their product. The work of friction is not negative, relative to that of all steps.
    """
    if zone.friction is None:
        return None
    mu = solution.case.zone_named(zone.name).friction
    traction, slip, status = (
        getattr(zone.friction, name) for name in ("friction_traction", "slip", "status")
    )
    bound, far = mu * zone.multiplier, np.linalg.norm(slip, axis=1)
    gone = np.linalg.norm(zone.friction.slip_total, axis=1)
    little = _little_pressure(solution)
    largest = max(mu, _LITTLE_FRICTION) * max(float(zone.multiplier.max()), little) or 1.0
    farthest = max(float(far.max()), _LITTLE * float(gone.max())) or 1.0
    size = np.linalg.norm(traction, axis=1)
    apart = traction * far[:, None] - bound[:, None] * slip
    work = np.array([step.dissipation for step in solution.steps])
    most = max(float(np.abs(work).sum()), _little_work(solution, little))
    rows = {
        "traction beyond μp of": np.maximum(size - bound, 0.0) / largest,
        "traction without contact on": np.where(status == 0, size, 0.0) / largest,
        "slip without sliding of": np.where(status == 2, 0.0, far) / farthest,
        "traction not along the slip of": np.linalg.norm(apart, axis=1) / (largest * farthest),
        "negative work of friction in step": np.maximum(-work, 0.0) / (most or 1.0),
    }
    places = [f"{what} {i}" for what, values in rows.items() for i in range(len(values))]
    values = np.concatenate(list(rows.values()))
    return Sample(values, np.zeros(len(values)), lambda i: places[i])


def _little_pressure(solution: Solution) -> float:
    """The pressure by which the law is judged where hardly anything presses."""
    caused = stress_of_motion(solution.case, solution.scalars.length, solution.displacement)
    return max(_LITTLE * solution.largest_pressure, _LITTLE_OF_MOTION * caused)


def _little_work(solution: Solution, pressure: float) -> float:
    """The work of friction of that pressure along the slips of all zones."""
    found = 0.0
    for zone in solution.zones:
        if zone.friction is not None:
            gone = np.linalg.norm(zone.friction.slip_total, axis=1)
            way = float(gone.max(initial=_NO_WAY * solution.scalars.length))
            found += solution.case.zone_named(zone.name).friction * float(zone.area.sum()) * way
    return pressure * found


def friction(quantity: str) -> Sampler:
    """Sample the traction on the slave, or the slip of the master relative to it."""

    def of_quantity(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
        if zone.friction is None:
            return None
        values = getattr(zone.friction, quantity)
        # The case gives them for the surface that it lists as slave.
        if solution.swapped and not isinstance(reference, ExactValues):
            values = -values
        sample = by_component(
            values,
            zone.centre,
            "xyz"[: values.shape[1]],
            reference,
            lambda: reference.of_friction(zone, quantity),
            "macro-element {}".format,
        )
        # Nothing slips where the surfaces are apart, however far they move along each other, and
        # nothing rubs where there is no other surface.
        nowhere = zone.friction.status == 0
        if quantity == "friction_traction":
            nowhere = expected_coverage(solution, zone, reference) <= 0
        sample.reference[np.tile(nowhere, len(sample.values) // len(values))] = 0.0
        return sample

    return of_quantity


def stick_area(_: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
    """The area that sticks."""
    if zone.resultants is None or zone.resultants.stick is None:
        return None
    if isinstance(reference, ExactValues):
        reference = reference.exact.stick_area
    return Sample(zone.resultants.stick[:1], np.array([reference]), lambda _: "the whole zone")


def dissipation(solution: Solution, _: None, reference: Reference) -> Sample | None:
    """The work of friction in each step."""
    if not solution.case.frictional:
        return None
    if isinstance(reference, ExactValues):
        reference = reference.exact.dissipation
    values = np.array([step.dissipation for step in solution.steps])
    return Sample(values, np.array(reference), lambda i: f"step {i + 1}")
