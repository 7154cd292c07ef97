"""Samples of single numbers (forces, energy, probes) and at positions: see `samples`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import meshio
import numpy as np

from ..case.acting import Step, factor_of
from ..case.expressions import evaluate
from ..case.model import Case
from ..lac.operator import MIN_COVERAGE
from ..mechanics.fem.stress import COMPONENTS
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from .samples import Reference, Sample, Sampler

# Motions along a surface have less than this share of themselves along its normal.
_ROUNDED = 1e-12


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
    """The forces that hold groups."""
    found = {one.group: one.force for one in solution.reactions}
    if not reference.keys() <= found.keys():
        return None
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
            if (probe := solution.places.probes.get(name)) is None:
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
    if solution.scalars.strain_energy is None:
        return None
    found = np.array([solution.scalars.strain_energy])
    return Sample(found, np.array([reference]), lambda _: "the whole solve")


def at_positions(quantity: str) -> Sampler:
    """Sample a field of contact at the positions before the last one, where it is covered.

    The reference is that of the last step: positions that are pressed otherwise are not compared,
    friction not where the bodies go another way.
    """

    def sample(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
        number = [one.name for one in solution.zones].index(zone.name)
        # Vectors are given on the surface that the case lists as slave.
        sign = -1.0 if solution.swapped and quantity == "friction_traction" else 1.0
        values, expected, where = [], [], []
        count, dim = len(zone.area), solution.mesh.points.shape[1]
        normal = zone.area @ zone.normal / zone.area.sum()
        for step, position in enumerate(solution.earlier, start=1):
            if not _as_in_the_last(solution.case, step, quantity, normal):
                continue
            covered = position.of_zone("coverage", number, count) > MIN_COVERAGE
            field = sign * position.of_zone(quantity, number, count).reshape(count, -1)
            values.append(field[covered, :dim])
            expected.append(_there(solution, zone, reference, quantity, step)[covered])
            elements = np.flatnonzero(covered)
            where += [f"macro-element {element} in step {step}" for element in elements]
        if not where:
            return None
        found, known = np.concatenate(values), np.concatenate(expected)
        return Sample(found.T.ravel(), known.T.ravel(), lambda i: where[i % len(where)])

    return sample


def _as_in_the_last(case: Case, step: int, quantity: str, normal: np.ndarray) -> bool:
    """Whether what presses in the last step does so in another one, on whatever groups.

    Loads and forces of rigid bodies press. Where none acts, what is moved along `normal` (dim,)
    does. For friction, supports and bodies must go the same way too.
    """
    here, last = case.steps[step - 1], case.steps[-1]
    if not isinstance(here, dict) and here != last:
        return False
    if (acting := _acting(case, last)) != _acting(case, here):
        return False
    if not acting and not _as_far(case, here, last, normal):
        return False
    pressed = quantity == "pressure"
    return pressed or np.allclose(_way(case, step), _way(case, len(case.steps)))


def _acting(case: Case, step: Step) -> list[str]:
    """What acts in a step, and its factor."""
    given = [(load.kind, load.value, load.factor(step)) for load in case.loads]
    for name, body in case.rigid.items():
        if any(body.force.values()):  # a component whose force is zero is free
            given.append((name, body.force, factor_of(body.name, step)))
    return sorted(repr(one) for one in given if one[-1])


def _as_far(case: Case, here: Step, last: Step, normal: np.ndarray) -> bool:
    """Whether two steps have all that is moved equally far along a normal (dim,).

    Each up to rounding of its own motion, in any unit. Rotations move nothing along it; `normal`,
    and what is no number, count as one.
    """
    shares = dict(zip("xyz", normal, strict=False))
    moves: list[tuple[str, Mapping[str, Any]]] = [(each.name, each.fix) for each in case.supports]
    moves += [(body.name, body.move) for body in case.rigid.values()]
    for name, move in moves:
        given = {key: value for key, value in move.items() if not key.startswith("r")}
        sizes = {key: v if isinstance(v, float) else 1.0 for key, v in given.items()}
        along = sum(shares.get(key, 1.0) * size for key, size in sizes.items())
        whole = sum(abs(size) for size in sizes.values())
        then, now = factor_of(name, here), factor_of(name, last)
        if abs(now * along - then * along) > _ROUNDED * (abs(now) + abs(then)) * whole:
            return False
    return True


def _way(case: Case, step: int) -> np.ndarray:
    """The direction in which a step changes the factors of what is no load."""
    loads = {load.name for load in case.loads}
    names = [name for name in case.histories if name not in loads] if case.histories else [""]
    here, before = (
        [factor_of(n, s) for n in names] for s in (case.steps[step - 1], case.steps[step - 2])
    )
    change = np.subtract(here, before if step > 1 else 0.0)
    return change / (np.abs(change).max(initial=0.0) or 1.0)


def _there(
    solution: Solution, zone: ZoneResult, reference: Reference, quantity: str, step: int
) -> np.ndarray:
    """What the reference has (m, components) on macro-elements where a step left the bodies."""
    points = solution.earlier[step - 1].points
    if isinstance(reference, ExactValues):
        exact = solution.case.exact_in(solution.case.steps[step - 1])
        assert exact is not None
        then = replace(solution, mesh=meshio.Mesh(points, solution.mesh.cells))
        values = ExactValues(then, exact)
        pressed = quantity == "pressure"
        found = values.pressure(zone) if pressed else values.of_friction(zone, quantity)
        return found.reshape(len(zone.area), -1)
    centres = _at_macro(zone, points)
    given = reference if isinstance(reference, tuple) else (reference,)
    return np.stack([evaluate(one, centres) for one in given], axis=1)


def _at_macro(zone: ZoneResult, points: np.ndarray) -> np.ndarray:
    """The middle (m, dim) of the nodes of each macro-element, with the nodes at points (n, dim)."""
    total, count = np.zeros((len(zone.area), points.shape[1])), np.zeros(len(zone.area))
    for _, nodes, macro in zone.faces:
        np.add.at(total, macro, points[nodes].mean(axis=1))
        np.add.at(count, macro, 1.0)
    return total / count[:, None]
