"""The quantities of a solve that are extrapolated, and what is known of them exactly."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..case.solutions.base import ElasticSolution
from ..lac.cells.catalogue import cell_type
from ..lac.cells.faces import circumference, surface_points
from ..lac.cells.shape import gauss_rule, shape_functions
from ..mechanics.fem.elasticity import physical_gradients
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult

# A surface whose normals differ by less is plane.
_PLANE = 1e-12
# An exact pressure whose peak exceeds the mean on a macro-element by more has no known peak: it is
# infinite there, or the mesh is too coarse.
_FINITE = 1.1
_TWICE = np.array([1, 1, 1, 2, 2, 2])  # off-diagonal components count twice


@dataclass(frozen=True)
class Quantity:
    """A quantity on one mesh: its value, and the exact one, None where it is unknown.

    `theory`: its order for a smooth solution. `scale`: changes are rounding compared with it.
    """

    name: str
    value: float
    known: float | None
    theory: float
    scale: float = 0.0


def quantities(solution: Solution) -> list[Quantity]:
    """All quantities of a solve.

    Smooth solutions on cells of degree k: the displacement at a point has order k + 1, energy and
    force, functionals of the solution, 2 k. The mean of a pressure over a macro-element is within
    order 2 of the pressure in its middle; a recovered one has order 3. The area of contact has
    order 2.
    """
    degree = min(cell_type(block.type).order for block in solution.mesh.cells)
    found = [quantity for zone in solution.zones for quantity in _contact(solution, zone, degree)]
    largest = solution.largest_displacement[0]
    found.append(Quantity("largest displacement", largest, _displacement(solution), degree + 1))
    if solution.scalars.strain_energy is not None:
        known = _given(solution, "strain_energy", _energy(solution))
        found.append(Quantity("strain energy", solution.scalars.strain_energy, known, 2 * degree))
    return found


def _contact(solution: Solution, zone: ZoneResult, degree: int) -> Iterator[Quantity]:
    """Peak pressure, contact force and contact area of a zone."""
    suffix = f", {zone.name}" if len(solution.zones) > 1 else ""
    theory = 2.0 if zone.recovered is None else 3.0
    largest = solution.largest_pressure
    yield Quantity(
        f"peak pressure{suffix}", peak(zone), known_peak(solution, zone), theory, largest
    )
    if zone.resultants is not None:
        force, area = zone.resultants.force, float(zone.resultants.area[0])
        scale = largest * float(zone.area.sum())
        size = float(np.linalg.norm(force))
        known = _given(solution, "force", _force(solution, zone))
        yield Quantity(f"contact force{suffix}", size, known, 2 * degree, scale)
        known = _given(solution, "contact_area", _area(solution, zone))
        yield Quantity(f"contact area{suffix}", area, known, 2.0)


def peak(zone: ZoneResult) -> float:
    """The largest pressure: recovered at nodes, of multipliers at nodes, or of macro-elements."""
    if zone.recovered is not None:
        return float(zone.recovered.at_nodes.max())
    return float((zone.multiplier if zone.nodal is None else zone.nodal.multiplier).max())


def _given(solution: Solution, key: str, known: float | None) -> float | None:
    """The number or the length of the vector in the reference, for one zone; else what is known."""
    given: Any = _reference(solution, key)
    if given is None or len(solution.zones) > 1:
        return known
    return float(np.linalg.norm(given))


def _reference(solution: Solution, key: str) -> Any:
    """A value of the reference, if this is exact and has one."""
    exact = solution.case.reference.kind in ("analytical", "manufactured")
    return solution.case.reference.values.get(key) if exact else None


def _pressures(solution: Solution, zone: ZoneResult) -> tuple[np.ndarray, np.ndarray] | None:
    """The exact pressure (k,) at points of a zone that is covered, and the area (k,) of each."""
    exact = solution.case.exact_contact
    if exact is None or (zone.coverage < 1 - 1e-9).any():
        return None
    at = surface_points(solution.mesh.points, zone.faces, solution.case.axisymmetric)
    return exact.contact_pressure(at.place), at.weight


def known_peak(solution: Solution, zone: ZoneResult) -> float | None:
    """The largest pressure of the reference or the exact solution; None where it is infinite."""
    given, exact = _reference(solution, "contact_pressure"), solution.case.exact_contact
    if isinstance(given, int | float):
        return float(given)
    if exact is None:
        return None
    if "peak" in exact.quantities:
        return exact.peak
    places = solution.mesh.points[np.concatenate([nodes.ravel() for _, nodes, _ in zone.faces])]
    with np.errstate(all="ignore"):
        largest = float(exact.contact_pressure(places).max())
    mean = ExactValues(solution, exact).pressure(zone).max()
    return largest if largest <= _FINITE * mean else None


def _force(solution: Solution, zone: ZoneResult) -> float | None:
    """The integral of the exact pressure over a plane zone."""
    normal = zone.normal[0]
    along = not solution.case.axisymmetric or abs(normal[0]) < _PLANE
    plane = along and np.abs(zone.normal - normal).max() < _PLANE
    found = _pressures(solution, zone)
    return None if found is None or not plane else float(found[0] @ found[1])


def _area(solution: Solution, zone: ZoneResult) -> float | None:
    """The area of a zone that is pressed all over."""
    found = _pressures(solution, zone)
    return None if found is None or not (found[0] > 0).all() else float(found[1].sum())


def _displacement(solution: Solution) -> float | None:
    exact = solution.case.reference.exact
    if exact is None or "displacement" not in exact.quantities:
        return None
    nodes = np.flatnonzero(solution.deformable)
    found = ExactValues(solution, exact).displacement(nodes)
    return float(np.linalg.norm(found, axis=1).max())


def _energy(solution: Solution) -> float | None:
    """The integral of σ : ∇u / 2 of the exact solution over the mesh."""
    exact = solution.case.reference.exact
    if not isinstance(exact, ElasticSolution) or "gradient" not in exact.quantities:
        return None
    points, part = solution.mesh.points, ExactValues(solution, exact).part
    moving, energy = solution.deformable, 0.0
    for block in solution.mesh.cells:
        kind = cell_type(block.type)
        reference, weights = gauss_rule(kind.name, kind.order + 2)
        cells = block.data[moving[block.data].all(axis=1)]
        measure = physical_gradients(points, cells, kind, reference)[1] * weights
        place = shape_functions(kind.name).values(reference) @ points[cells]
        if solution.case.axisymmetric:
            measure = measure * circumference(place)
        x, parts = place.reshape(-1, kind.dim), np.repeat(part[cells[:, 0]], len(weights))
        stress, slope = exact.stress(x, parts), exact.gradient(x, parts)
        energy += float(measure.ravel() @ _work(stress, slope)) / 2
    return energy


def _work(stress: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """σ : ∇u (n,) of stresses (n, 6) and gradients (n, d, d)."""
    whole = np.zeros((len(slope), 3, 3))
    whole[:, : slope.shape[1], : slope.shape[1]] = (slope + np.swapaxes(slope, 1, 2)) / 2
    strain = whole[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    return np.asarray(np.einsum("nc,nc,c->n", stress, strain, _TWICE))
