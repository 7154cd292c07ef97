"""Errors of a solve against the exact solution that its case names.

With u, σ, p exact, u_h, σ_h, p_h computed, σ_h by Hooke's law from u_h (and from the mean stress
in cells in mixed form):

    displacement_l2       ‖u_h − u‖ / ‖u‖                    ‖·‖: root of ∫ over deformable bodies
    displacement_h1       ‖∇u_h − ∇u‖ / ‖∇u‖
    stress_l2             ‖σ_h − σ‖ / ‖σ‖
    stress_max            largest component of σ_h − σ at nodes, σ_h averaged there, over that of σ
    pressure_l2           |p_h − p| / |p|                    |·|: root of ∫ over the slave surface,
                                                             weighted by each element's coverage
    pressure_max          largest |p_h − p| / largest p      where p is smooth
    pressure_means        |p_h − p̄| / |p̄|                    p̄: mean of p over each macro-element
    pressure_total        |∫ p_h − ∫ p| / ∫ p            over all zones
    pressure_oscillation  largest |e₋ − 2 e + e₊| / largest p   e = p_h − p̄ of neighbours where p is
                                                             smooth; of nodal multipliers p_h − p
                                                             at nodes (see `oscillation`)
    pressure_inner        largest |p_h − p̄| / largest p      except on the last two macro-elements
                                                             at each end of the contact
    traction_l2           |t_h − t| / |t|                    t: traction of friction
    traction_means        |t_h − t̄| / |t̄|
    half_width, peak      of the half ellipse of p_h (Hertz): from its second moment, and fitted
                          within 0.8 of the half-width found; of other shapes from the moment alone

In pressure_l2, pressure_max and half_width p_h is the field that the treatment of the interface
solves for: constant on each macro-element, or what is recovered from the constants, or, with
multipliers at nodes, interpolated between these; in the others its mean over each macro-element.
In traction_l2 t_h is constant or recovered too.

Volume integrals use Gauss points two more each way than the degree of the cell, so that the
quadrature is no part of what is seen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import meshio
import numpy as np

from ..case.solutions.base import ElasticSolution, ExactSolution, lame_of
from ..lac.cells.catalogue import cell_type
from ..lac.cells.faces import SlaveFaces, surface_points
from ..lac.cells.shape import gauss_rule
from ..lac.threads import prefetch
from ..mechanics.fem.faces import pieces
from ..simulation.results.exact import ExactValues, computed_pressure
from ..simulation.results.solution import NodalContact, Solution, ZoneResult
from .in_cells import deformable_parts, in_cells

# Off-diagonal components count twice in a square.
_WHOLE = np.sqrt([1, 1, 1, 2, 2, 2])


def errors(solution: Solution, exact: ExactSolution | None = None) -> dict[str, float]:
    """The errors of a solve by name, against `exact` or the exact solution that its case names.

    Empty without either. Where a case has several zones, those of contact are left out unless the
    solution is said to be that of all of them.
    """
    contact = exact or solution.case.exact_contact
    exact = exact or solution.case.reference.exact
    if exact is None:
        return {}
    found: dict[str, float] = {}
    if isinstance(exact, ElasticSolution) and "gradient" in exact.quantities:
        found |= _field_errors(solution, exact)
    if solution.zones and contact:
        found |= _pressure_errors(solution, contact)
    return found


# Displacement and stress


def _field_errors(solution: Solution, exact: ElasticSolution) -> dict[str, float]:
    squares = sum(_squares(solution, exact), np.zeros((3, 2)))
    names = ("displacement_l2", "displacement_h1", "stress_l2")
    found = {name: _root(*pair) for name, pair in zip(names, squares, strict=True)}
    nodes = np.flatnonzero(solution.deformable)
    expected = ExactValues(solution, exact).stress(nodes)
    return found | {"stress_max": largest_error(solution.stress[nodes], expected)}


def largest_error(values: np.ndarray, expected: np.ndarray) -> float:
    """The largest error of values, of any shape, over the largest expected one."""
    return _over(np.abs(values - expected).max(), np.abs(expected).max())


def _squares(solution: Solution, exact: ElasticSolution) -> Iterator[np.ndarray]:
    """By chunk of cells (3, 2): ∫ of squares of error and exact value, for u, ∇u, σ."""
    part = ExactValues(solution, exact).part
    for block in solution.mesh.cells:
        kind = cell_type(block.type)
        rule = gauss_rule(kind.name, kind.order + 2)
        chunks = deformable_parts(solution, block, len(rule[1]))
        yield from prefetch(partial(_squares_in, solution, exact, part, block, rule), chunks)


def _squares_in(
    solution: Solution,
    exact: ElasticSolution,
    parts: np.ndarray,
    block: meshio.CellBlock,
    rule: tuple[np.ndarray, np.ndarray],
    chosen: np.ndarray,
) -> np.ndarray:
    """The integrals over the `chosen` cells of a block, with the `parts` (n_points,) of nodes."""
    found, weights = in_cells(solution, block, chosen, rule[0]), rule[1]
    place = found.place.reshape(-1, found.place.shape[-1])
    at = np.repeat(parts[block.data[chosen, 0]], len(weights))
    u, gradient = exact.displacement(place, at), exact.gradient(place, at)
    error = found.slope.reshape(gradient.shape) - gradient
    stress = exact.hooke(error, at)
    if found.mean is not None:
        lame = np.array([lame_of(material)[0] for material in exact.materials])[at]
        mean = found.mean.ravel() - lame * np.einsum("nii->n", error + gradient)
        stress[:, :3] += np.nan_to_num(mean)[:, None]
    pairs = (
        (found.displacement.reshape(place.shape) - u, u),
        (error, gradient),
        (stress * _WHOLE, exact.hooke(gradient, at) * _WHOLE),
    )
    weight = (found.shapes.measure * weights).ravel()
    return np.array([[_integral(weight, each) for each in pair] for pair in pairs])


def _integral(weight: np.ndarray, values: np.ndarray) -> float:
    flat = values.reshape(len(weight), -1)
    return float((weight * np.einsum("ij,ij->i", flat, flat)).sum())


# Pressure


def _pressure_errors(solution: Solution, exact: ExactSolution) -> dict[str, float]:
    squares, means, total = np.zeros(2), np.zeros(2), np.zeros(2)
    largest, highest, second, inner = 0.0, 0.0, 0.0, 0.0
    for zone in solution.zones:
        integrals, most, peak = zip(*_pressures(solution, zone, exact), strict=True)
        squares += np.sum(integrals, axis=0)
        largest, highest = max(largest, *most), max(highest, *peak)
        mean = ExactValues(solution, exact).pressure(zone)
        weight = zone.area * zone.coverage
        means += _integral(weight, zone.multiplier - mean), _integral(weight, mean)
        total += weight @ (zone.multiplier - mean), weight @ np.abs(mean)
        second = max(second, oscillation(solution.mesh.points, zone, exact, mean))
        inside = ~grown(macro_neighbours(zone), mean <= 0, 2) & (zone.coverage > 0)
        inner = max(inner, np.abs(zone.multiplier - mean)[inside].max(initial=0.0))
    found = {
        "pressure_l2": _root(*squares),
        "pressure_max": _over(largest, highest),
        "pressure_means": _root(*means),
        "pressure_total": _over(abs(total[0]), total[1]),
        "pressure_oscillation": _over(second, highest),
        "pressure_inner": _over(inner, highest),
    }
    if "friction_traction" in exact.quantities:
        found |= _traction_errors(solution, exact)
    if "half_width" in exact.quantities:
        found |= _ellipse_errors(solution, exact)
    return found


def _traction_errors(solution: Solution, exact: ExactSolution) -> dict[str, float]:
    squares, means, values = np.zeros(2), np.zeros(2), ExactValues(solution, exact)
    for zone in solution.zones:
        if zone.friction is None:
            continue
        mean, weight = values.of_friction(zone, "friction_traction"), zone.area * zone.coverage
        error = zone.friction.friction_traction - mean
        means += _integral(weight, error), _integral(weight, mean)
        at = surface_points(solution.mesh.points, zone.faces, solution.case.axisymmetric)
        traction = values.friction_traction(zone, at.place)
        weight = at.weight * zone.coverage[at.macro]
        error = zone.friction.values(at, zone.recovered) - traction
        squares += _integral(weight, error), _integral(weight, traction)
    return {"traction_l2": _root(*squares), "traction_means": _root(*means)}


def _pressures(
    solution: Solution, zone: ZoneResult, exact: ExactSolution
) -> Iterator[tuple[np.ndarray, float, float]]:
    """By piece of a zone: ∫ of squares (2,) of error and exact pressure, largest error, peak."""
    points = solution.mesh.points

    def within(piece: SlaveFaces) -> tuple[np.ndarray, float, float]:
        at = surface_points(points, [piece], solution.case.axisymmetric)
        pressure = exact.contact_pressure(at.place)
        error = computed_pressure(points, replace(zone, faces=[piece])) - pressure
        covered = (zone.coverage > 0)[at.macro] & exact.regular(at.place)
        weight = at.weight * zone.coverage[at.macro]
        integrals = np.array([_integral(weight, error), _integral(weight, pressure)])
        return integrals, float(np.abs(error[covered]).max(initial=0.0)), float(pressure.max())

    return prefetch(within, pieces(zone.faces))


def _ellipse_errors(solution: Solution, exact: ExactSolution) -> dict[str, float]:
    places, forces = [], []
    for zone in solution.zones:
        at = surface_points(solution.mesh.points, zone.faces, solution.case.axisymmetric)
        pressure = computed_pressure(solution.mesh.points, zone)
        places.append(at.place)
        forces.append(at.weight * zone.coverage[at.macro] * pressure)
    centre, mean = (
        np.concatenate([getattr(zone, name) for zone in solution.zones])
        for name in ("centre", "multiplier")
    )
    found = exact.measured(np.concatenate(places), np.concatenate(forces), centre, mean)
    return {name: abs(value / getattr(exact, name) - 1) for name, value in found.items()}


def _root(error: float, whole: float) -> float:
    return _over(np.sqrt(error), np.sqrt(whole))


def _over(error: float, whole: float) -> float:
    return float(error / whole) if whole > 0 else float(error)


# How much a pressure oscillates: second differences of its error between neighbours.

# Pairs of neighbours (k, 2), each once, and which places (m,) are at the rim.
Neighbours = tuple[np.ndarray, np.ndarray]


def oscillation(
    points: np.ndarray, zone: ZoneResult, exact: ExactSolution, mean: np.ndarray
) -> float:
    """Largest second difference of the error, by macro-element or, of nodal multipliers, by node.

    `mean` (m,) is the exact pressure's mean over each macro-element. The average of two nodes would
    hide a pressure that alternates from node to node.
    """
    if zone.nodal is None:
        smooth = exact.regular(zone.centre)
        return second_difference(macro_neighbours(zone), zone.multiplier - mean, smooth)
    place = points[zone.nodal.nodes]
    error = zone.nodal.multiplier - exact.contact_pressure(place)
    return second_difference(_nodes(zone, zone.nodal), error, exact.regular(place))


def second_difference(neighbours: Neighbours, error: np.ndarray, smooth: np.ndarray) -> float:
    """The largest among places within the rim that are smooth (m,), as all their neighbours are."""
    pairs, rim = neighbours
    total, count, rough = np.zeros(len(error)), np.zeros(len(error)), np.zeros(len(error))
    for one, other in (pairs.T, pairs.T[::-1]):
        np.add.at(total, one, error[other] - error[one])
        np.add.at(count, one, 1)
        np.add.at(rough, one, ~smooth[other])
    chosen = ~rim & smooth & (rough == 0) & (count > 1)
    return float(2 * np.abs(total[chosen] / count[chosen]).max(initial=0.0))


def grown(neighbours: Neighbours, chosen: np.ndarray, times: int) -> np.ndarray:
    """The chosen places (m,) and their neighbours, `times` over."""
    pairs, _ = neighbours
    for _ in range(times):
        chosen = chosen.copy()
        beside = chosen[pairs].any(axis=1)
        chosen[pairs[beside]] = True
    return chosen


def macro_neighbours(zone: ZoneResult) -> Neighbours:
    """Macro-elements that share an edge of their sub-faces, or in 2D an end."""
    sides, owner = [], []
    for name, nodes, macro in zone.faces:
        kind = cell_type(name)
        ends = [(0,), (1,)] if kind.dim == 1 else list(kind.edges)
        sides.append(np.sort(nodes[:, ends].reshape(len(nodes) * len(ends), -1)[:, :2], axis=1))
        owner.append(np.repeat(macro, len(ends)))
    side, owners = _one_number(np.concatenate(sides)), np.concatenate(owner)
    order = np.argsort(side, kind="stable")
    side, owners = side[order], owners[order]
    shared = side[1:] == side[:-1]
    pairs = np.stack([owners[:-1], owners[1:]], axis=1)[shared]
    alone = ~(np.append(shared, False) | np.append(False, shared))
    rim = np.bincount(owners[alone], minlength=len(zone.area)) > 0
    pairs = np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1)
    return pairs[np.unique(_one_number(pairs), return_index=True)[1]], rim


def _one_number(rows: np.ndarray) -> np.ndarray:
    """A number (n,) for each row (n, 1 or 2) of whole numbers: ascending as the rows are."""
    return rows[:, 0].astype(np.int64) * (1 + rows.max(initial=0)) + rows[:, -1]


def _nodes(zone: ZoneResult, nodal: NodalContact) -> Neighbours:
    """Multipliers that follow each other along the edges of faces, in 2D along the faces."""
    steps = []
    for name, nodes, _ in zone.faces:
        kind = cell_type(name)
        path = nodes[:, kind.boundary if kind.dim == 1 else (*kind.boundary, kind.boundary[0])]
        own = np.searchsorted(nodal.nodes, path[:, np.isin(path[0], nodal.nodes)])
        steps.append(np.stack([own[:, :-1], own[:, 1:]], axis=-1).reshape(-1, 2))
    pairs, times = np.unique(np.sort(np.concatenate(steps), axis=1), axis=0, return_counts=True)
    if zone.centre.shape[1] == 2:
        rim = np.bincount(pairs.ravel(), minlength=len(nodal.nodes)) < 2
    else:
        rim = np.bincount(pairs[times == 1].ravel(), minlength=len(nodal.nodes)) > 0
    return pairs, rim
