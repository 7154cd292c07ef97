"""Samples for the checks: values of a solve and their reference, at the same places.

A reference is a scalar, a sequence (vectors) or a mapping (tensors) of scalars, or `ExactValues`,
which know the case's exact solution. A sampler is called with the solution, the zone (None for the
whole solve) and the reference; it returns None if there is nothing to compare.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..case.expressions import evaluate
from ..lac.cells.catalogue import cell_type
from ..lac.cells.shape import shape_functions
from ..lac.threads import prefetch
from ..mechanics.fem.block import volume_rule
from ..mechanics.fem.elasticity import (
    hoop_values,
    lame_parameters,
    physical_gradients,
    with_hoop,
)
from ..mechanics.fem.stress import COMPONENTS
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from ..simulation.scene.groups import ALL
from ..simulation.scene.parts.strain import strain_at
from ..system.errors import InputError, hint
from .coverage import expected_coverage

Reference = Any
# Pressures and gaps below this share of load and length are zero.
_TOUCHING = 1e-12
# Numbers of gradients handled at once: small enough to stay in the processor's cache.
_CHUNK = 1 << 17


@dataclass(frozen=True)
class Sample:
    """Values (n,) and their reference (n,); `place` names the place of the i-th one."""

    values: np.ndarray
    reference: np.ndarray
    place: Callable[[int], str]


Sampler = Callable[[Solution, Any, Reference], Sample | None]


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
    """The reference's pressure (m,), zero where nothing is covered."""
    expected = expected_pressure(zone, reference)
    return np.where(expected_coverage(solution, zone, reference) > 0, expected, 0.0)


def pressure(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The multiplier of every macro-element."""
    return _at_macro_elements(zone.multiplier, reference_where_covered(solution, zone, reference))


def pressure_of_forces(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The pressure by forces at slave nodes; the multiplier where they do not determine it."""
    found = zone.multiplier if zone.pressure_of_forces is None else zone.pressure_of_forces
    return _at_macro_elements(found, reference_where_covered(solution, zone, reference))


def gap(_: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """The average gap of every macro-element."""
    if isinstance(reference, ExactValues):
        return _at_macro_elements(zone.gap, reference.gap(zone))
    return _at_macro_elements(zone.gap, evaluate(reference, zone.centre))


def status(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample:
    """Closed where the reference presses.

    Either status is right at the edge of contact, and where surfaces touch without pressure.
    """
    found = zone.closed.astype(float)
    expected = (reference_where_covered(solution, zone, reference) > 0).astype(float)
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
        nodes, values = getattr(zone, f"{side}_nodes"), getattr(zone, f"stress_{side}")
        if len(nodes) and not solution.deformable[nodes].any():
            return None
        if isinstance(reference, ExactValues):
            faces = zone.master_faces if side == "master" else [face[:2] for face in zone.faces]
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


def integration_stress(solution: Solution, _: None, reference: Reference) -> Sample:
    """The given components at the integration points of all cells, by Hooke's law.

    They follow from the displacement, less initial strains, without extrapolation to nodes and
    averages. The sample has what decides a check: of each chunk of cells the extreme values, and
    the largest reference and deviation.
    """
    names = COMPONENTS if isinstance(reference, ExactValues) else tuple(reference)

    def decisive(chunk: tuple[np.ndarray, ...]) -> list[tuple[np.ndarray, ...]]:
        place, stress, node, cell = chunk
        if isinstance(reference, ExactValues):
            expected = reference.exact.stress(place, reference.part[node]).T
        else:
            expected = np.stack([evaluate(reference[name], place) for name in names])
        found: list[tuple[np.ndarray, ...]] = []
        for name, wanted in zip(names, expected, strict=True):
            values = stress[:, COMPONENTS.index(name)]
            worst = np.abs(values - wanted).argmax(), np.abs(wanted).argmax()
            kept = np.unique([values.argmin(), values.argmax(), *worst])
            found.append((values[kept], wanted[kept], cell[kept]))
        return found

    by_name = zip(*map(decisive, _by_hooke(solution)), strict=True)
    listed = [
        (name, *found) for name, chunks in zip(names, by_name, strict=True) for found in chunks
    ]
    places = [(cell, name) for name, _, _, cells in listed for cell in cells]
    return Sample(
        np.concatenate([values for _, values, _, _ in listed]),
        np.concatenate([expected for _, _, expected, _ in listed]),
        lambda i: "cell {} ({})".format(*places[i]),
    )


def _by_hooke(solution: Solution) -> Iterator[tuple[np.ndarray, ...]]:
    """By chunk of deformable cells, at their k integration points in all: place, stress, owner.

    Place (k, dim), stress (k, 6), and of the cell: its first node (k,) and its number (k,).
    """
    moving, first = solution.deformable, 0
    for i, (block, elastic) in enumerate(
        zip(solution.mesh.cells, _materials(solution), strict=True)
    ):
        kind = cell_type(block.type)
        chosen = np.flatnonzero(moving[block.data].all(axis=1))
        step = max(1, _CHUNK // (len(volume_rule(kind.name)[1]) * kind.n_nodes * kind.dim))
        parts = [chosen[start : start + step] for start in range(0, len(chosen), step)]
        yield from prefetch(partial(_hooke_in, solution, i, elastic, first), parts)
        first += len(block.data)


def _hooke_in(
    solution: Solution, block: int, elastic: np.ndarray, first: int, part: np.ndarray
) -> tuple[np.ndarray, ...]:
    """See `_by_hooke`: a part of the cells of a block, its first cell numbered `first`."""
    points, kind = solution.mesh.points, cell_type(solution.mesh.cells[block].type)
    reference, _ = volume_rule(kind.name)
    values = shape_functions(kind.name).values(reference)
    cells = solution.mesh.cells[block].data[part]
    gradient, _ = physical_gradients(points, cells, kind, reference)
    nodal = solution.displacement[cells]
    slope = np.swapaxes(nodal - nodal[:, :1], 1, 2)[:, None] @ gradient
    if solution.case.axisymmetric:
        hoop, _ = hoop_values(points, cells, kind, reference)
        slope = with_hoop(slope, (hoop @ nodal[:, :, :1])[..., 0])
    dim, place = slope.shape[-1], (values @ points[cells]).reshape(-1, kind.dim)
    lame, shear = (each[:, None] for each in lame_parameters(*elastic[part].T))
    initial = np.zeros((*slope.shape[:2], 6))
    if any(load.strains for load in solution.case.loads):
        initial = _initial_strain(solution, block, part, place).reshape(initial.shape)
    mean = lame * (np.einsum("cqii->cq", slope) - initial[..., :3].sum(axis=-1))
    if (mixed := solution.fields.mean_stress.get(kind.name)) is not None:
        own = mixed[part] @ values.T
        mean = np.where(np.isnan(own), mean, own)
    tensor = np.zeros((*mean.shape, 3, 3))
    tensor[..., :dim, :dim] = slope + np.swapaxes(slope, 2, 3)
    tensor = shear[..., None, None] * tensor + mean[..., None, None] * np.eye(3)
    if solution.case.thin:
        tensor[..., 2, 2] = 0.0
    stress = tensor[..., [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    stress = (stress - 2 * shear[..., None] * initial).reshape(-1, 6)
    return place, stress, *(np.repeat(each, len(reference)) for each in (cells[:, 0], first + part))


def _initial_strain(
    solution: Solution, block: int, part: np.ndarray, place: np.ndarray
) -> np.ndarray:
    """The initial strain (k, 6) in the last step at points (k, dim) in cells (n,) of a block."""
    case, found = solution.case, np.zeros((len(place), 6))
    for load in (load for load in case.loads if load.strains):
        here = np.ones(len(place), dtype=bool)
        if load.group != ALL:
            mine = np.isin(part, solution.mesh.cell_sets[load.group][block])
            here = np.repeat(mine, len(place) // len(part))
        found[here] += load.factor(case.steps[-1]) * strain_at(case, load, place[here])
    return found


def _materials(solution: Solution) -> list[np.ndarray]:
    """Young's modulus and Poisson's ratio (n, 2) of the cells of each block."""
    given = solution.case.materials
    start = [(given[ALL].young, given[ALL].poisson)] if ALL in given else [(1.0, 0.0)]
    found = [np.repeat(start, len(block.data), axis=0) for block in solution.mesh.cells]
    for group in given.keys() - {ALL}:
        for values, members in zip(found, solution.mesh.cell_sets[group], strict=True):
            values[np.asarray(members, dtype=int)] = given[group].young, given[group].poisson
    return found


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
    """Cells and contact faces of the bodies as meshed; the case gives the reference.

    Raises `InputError` for a group that is not a body.
    """
    case, bodies = solution.case, {body.name: body for body in solution.bodies}
    rows = []
    for group, given in case.mesh.counts.items():
        if group not in bodies:
            allowed = f"is not a body; {hint(group, bodies)}"
            raise InputError(case.path, f"counts.{group}", group, allowed)
        found = {"cells": sum(bodies[group].cells.values()), "faces": bodies[group].faces}
        rows += [(found[what], number, f"{what} of {group}") for what, number in given.items()]
    if not rows:
        return None
    values, expected, places = zip(*rows, strict=True)
    return Sample(np.array(values, float), np.array(expected, float), lambda i: places[i])


def observed(quantity: str) -> Sampler:
    """Sample the observations in a zone at every step; pressure grows with the load factor.

    The reference is that of the last step; where nothing acts in it, no other step is compared.
    """

    def sample(solution: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
        rows = [
            (step.factor, o["macro_element"], float(o[quantity]))
            for step in solution.steps
            for o in step.observations
            if o["zone"] == zone.name
        ]
        last = solution.steps[-1].factor
        if solution.case.histories or not last:
            rows = [(1.0, *row[1:]) for row in rows if row[0] == last]
        elif isinstance(reference, ExactValues):  # of the whole load
            rows = [row for row in rows if row[0] == 1.0]
        if not rows:
            return None
        factors, elements, values = (np.array(column) for column in zip(*rows, strict=True))
        if isinstance(reference, ExactValues):
            expected = getattr(reference, quantity)(zone)[elements]
        else:
            expected = evaluate(reference, zone.centre[elements])
            if quantity == "pressure":
                expected = expected * factors / (1.0 if solution.case.histories else last or 1.0)
        return Sample(
            values, expected, lambda i: f"macro-element {elements[i]}, load factor {factors[i]:g}"
        )

    return sample
