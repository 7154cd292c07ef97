"""Whether the fields of a solution are sound: finite numbers, zones and steps of the case, p and ḡ.

Contact that bears tension or overlaps is no solution, whatever the search for its status found.
Checks compare what a case gives a reference for; everything else must be sound as well, in a solve
and in a file that is read back.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import meshio
import numpy as np

from ..equilibrium.accuracy import ERRORS
from ..results.solution import Solution, ZoneResult

# A pressure or gap may be negative by this share of its zone's scale; a gap also by so many
# roundings of coordinates and displacements, a pressure by what so many roundings of displacements
# and loads are as stress, by as many of its errors as the search for the status allows, and by the
# last share of the zone's largest pressure in any step, since earlier loads leave a residue.
_TOLERANCE, _ROUNDINGS, _OF_ALL = 1e-8, 1e3, 1e-9
# What is not known everywhere, or not yet, and what is no number.
_MAY_BE_NAN = {
    *("case", "by_cell", "pressure_error", "probes", "errors", "validity", "earlier"),
    *("cpu_seconds", "peak_memory_mb"),
}


def inconsistency(solution: Solution) -> str:
    """The first thing wrong with the fields of a solution, in words; empty where nothing is."""
    return next(_all(solution), "")


def _all(solution: Solution) -> Iterator[str]:
    if {zone.name for zone in solution.zones} != {zone.name for zone in solution.case.zones}:
        yield "the contact zones differ from the case's"
    if [step.factor for step in solution.steps] != list(solution.case.factors):
        yield "the load steps differ from the case's"
    for name, values in _numbers("", solution):
        if not np.isfinite(values).all():
            yield f"{name} holds values that are not finite numbers"
    balanced = {name.rpartition(": ")[0] for name in solution.quality.balance}
    zones = [f"zone {zone.name}" for zone in solution.zones]
    for name in (*zones, "reactions and loads", "free nodes"):
        if name not in balanced:
            yield f"no balance of {name}"
    for zone in solution.zones:
        yield from _status(zone, solution)


def _numbers(name: str, item: Any) -> Iterator[tuple[str, Any]]:
    """The numbers and arrays of an object, each with its place there."""
    if isinstance(item, float | np.ndarray):
        yield name, np.asarray(item)
    elif isinstance(item, meshio.Mesh):
        yield f"{name}.points", item.points
    elif is_dataclass(item):
        for key in (f.name for f in fields(item) if f.name not in _MAY_BE_NAN):
            yield from _numbers(f"{name}.{key}" if name else key, getattr(item, key))
    elif isinstance(item, Mapping | list | tuple):
        pairs = item.items() if isinstance(item, Mapping) else enumerate(item)
        for place, one in pairs:
            yield from _numbers(f"{name}[{getattr(one, 'name', place)}]", one)


def _status(zone: ZoneResult, solution: Solution) -> Iterator[str]:
    """Whether p ≥ 0, ḡ ≥ 0 and p ḡ = 0, on the scales of the zone's own stress and displacement."""
    nodes = np.union1d(zone.surfaces.slave_nodes, zone.surfaces.master_nodes)
    moved, contact = solution.displacement[nodes], zone.nodal or zone
    own = float(np.abs(contact.multiplier).max(initial=0.0))
    scale = max(own, float(np.abs(solution.stress[nodes]).max(initial=0.0)))
    round_off = _ROUNDINGS * float(np.finfo(float).eps)
    young = max(material.young for material in solution.case.materials.values())
    dim = 3 if solution.case.axisymmetric else moved.shape[1]
    smallest = float(zone.area.min()) ** (1 / (dim - 1))
    error = round_off * young * float(np.abs(solution.displacement).max()) / smallest
    known = ERRORS * max(solution.quality.accuracy.values(), default=0.0)
    error += (known + round_off) * solution.largest_pressure
    error += _OF_ALL * solution.largest_in(zone.name)
    worst = float(contact.multiplier.min(initial=0.0))
    if worst < -_TOLERANCE * scale - error:
        yield f"zone {zone.name}: contact bears tension, a pressure of {worst:.3g}"
    size = float(np.ptp(moved, axis=0).max(initial=0.0))
    place = float(np.abs(solution.mesh.points[nodes]).max() + np.abs(moved).max())
    gives_way = solution.case.zone_named(zone.name).gives_way
    gap = contact.gap[~contact.closed] if gives_way else contact.gap
    none = _TOLERANCE * size + round_off * place
    worst = float(gap.min(initial=0.0))
    if worst < -none:
        yield f"zone {zone.name}: the surfaces overlap, a gap of {worst:.3g}"
    worst = 0.0 if gives_way else float(gap[contact.closed].max(initial=0.0))
    if worst > none:
        yield f"zone {zone.name}: contact that is closed has a gap of {worst:.3g}"
