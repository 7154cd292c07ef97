"""Whether the fields of a solution fit one another: shapes, numbers of nodes, finite values.

Contact that bears tension or overlaps is no solution either, whatever the search for its status
found. Checks compare what a case gives a reference for; everything else must be sound as well, in a
solve and in a file that is read back.
"""

from collections.abc import Iterator
from itertools import chain, product

import numpy as np

from ...lac.reconstruction import FORMS
from ..results.forces import Resultants
from ..results.solution import NodalContact, RecoveredPressure, Solution, ZoneFriction, ZoneResult

# A pressure or gap may be negative by this share of its zone's scale; a gap also by so many
# roundings of coordinates and displacements, a pressure by its estimated error and by what so many
# roundings of displacements are as stress.
_TOLERANCE, _ROUNDINGS = 1e-8, 1e3

Shape = tuple[int | None, ...]


def inconsistency(solution: Solution) -> str:
    """The first thing wrong with the fields of a solution, in words; empty where nothing is."""
    return next(_all(solution), "")


def _all(solution: Solution) -> Iterator[str]:
    points = solution.mesh.points
    n, dim = points.shape
    yield from _values("nodes", points, (n, dim))
    for block in solution.mesh.cells:
        yield from _numbers(f"cells {block.type}", block.data, (len(block.data), None), n)
    yield from _values("displacement", solution.displacement, (n, dim))
    yield from _values("stress", solution.stress, (n, 6))
    yield from _values("normal_stress", solution.nodal_normal_stress, (n,))
    if solution.body.shape != (n,) or solution.body.dtype.kind not in "iu":
        yield "body is not a whole number for each node"
    known = [solution.length, solution.load_scale, *solution.balance.values()]
    known += solution.seconds.values()
    yield from _values("the solve's own numbers", np.array(known), (len(known),))
    if {zone.name for zone in solution.zones} != {zone.name for zone in solution.case.zones}:
        yield "the contact zones differ from the case's"
    yield from _unbalanced(solution)
    if solution.strain_energy is not None:
        yield from _values("strain energy", np.array([solution.strain_energy]), (1,))
    if solution.reaction is not None:
        yield from _values("reaction", solution.reaction, (n, dim))
    yield from _by_key(solution, n)
    yield from _steps(solution, dim)
    for zone in solution.zones:
        for fault in chain(_zone(zone, n, dim), _edges(zone, dim)):
            yield f"zone {zone.name}: {fault}"
    for zone in solution.zones:
        yield from _status(zone, solution)


def _unbalanced(solution: Solution) -> Iterator[str]:
    """What has no balance of forces."""
    balanced = {name.rpartition(": ")[0] for name in solution.balance}
    zones = [f"zone {zone.name}" for zone in solution.zones]
    for name in (*zones, "reactions and loads", "free nodes"):
        if name not in balanced:
            yield f"no balance of {name}"


def _by_key(solution: Solution, n: int) -> Iterator[str]:
    """What belongs to supports, loads and probes of the case."""
    if solution.acted.keys() - solution.case.acting.keys():
        yield "the supports and loads differ from the case's"
    for key, nodes in solution.acted.items():
        yield from _numbers(key, nodes, (None,), n)
    if solution.probes.keys() - {probe.name for probe in solution.case.probes}:
        yield "the probes differ from the case's"


def _steps(solution: Solution, dim: int) -> Iterator[str]:
    sizes = {zone.name: len(zone.multiplier) for zone in solution.zones}
    wanted = [item.zone for item in solution.case.observe]
    if [step.factor for step in solution.steps] != list(solution.case.factors):
        yield "the load steps differ from the case's"
    for step in solution.steps:
        seen = step.observations
        if [item["zone"] for item in seen] != wanted:
            yield "the places observed differ from the case's"
        for item in seen:
            number = np.array([item["macro_element"]])
            yield from _numbers("observed macro-element", number, (1,), sizes[item["zone"]])
        known = [step.residual, *(item[k] for item in seen for k in ("pressure", "gap"))]
        yield from _values("steps", np.array(known), (len(known),))
        if step.resultants.keys() - sizes.keys():
            yield "the contact forces of a step differ from the zones'"
        for name, found in step.resultants.items():
            yield from _resultants(f"of contact in {name}", found, dim)
        for one in step.reactions:
            yield from _values(f"the force on {one.group}", one.force, (dim,))
            yield from _values(f"the moment on {one.group}", one.moment, (3,))
        shapes = {"point": (dim,), "translation": (dim,), "force": (dim,)}
        shapes |= {"rotation": (3,), "moment": (3,)}
        for body, (name, shape) in product(step.rigid, shapes.items()):
            yield from _values(f"{name} of {body.body}", getattr(body, name), shape)


def _zone(zone: ZoneResult, n: int, dim: int) -> Iterator[str]:
    m = len(zone.multiplier)
    for name in ("centre", "normal"):
        yield from _values(name, getattr(zone, name), (m, dim))
    for name in ("area", "multiplier", "gap", "coverage"):
        yield from _values(name, getattr(zone, name), (m,))
    yield from _flags(zone.closed, m)
    for side in ("slave", "master"):
        nodes = getattr(zone, f"{side}_nodes")
        yield from _numbers(f"{side}_nodes", nodes, (len(nodes),), n)
        yield from _values(f"stress_{side}", getattr(zone, f"stress_{side}"), (len(nodes),))
    yield from _faces(zone, n, m)
    if zone.recovered:
        yield from _recovered(zone.recovered, n, m, dim)
    for name in ("pressure_error", "pressure_of_forces"):
        if (values := getattr(zone, name)) is not None:
            yield from _values(name.replace("_", " "), values, (m,))
    if zone.nodal:
        yield from _nodal(zone.nodal, n)
    if zone.friction:
        yield from _friction(zone.friction, m, dim)
        if (field := zone.friction.recovered) is not None and zone.recovered:
            shape = (*zone.recovered.coefficients.shape, dim)
            yield from _values("recovered traction", field, shape)


def _faces(zone: ZoneResult, n: int, m: int) -> Iterator[str]:
    for kind, faces, owner in zone.faces:
        yield from _numbers(f"slave faces {kind}", faces, (len(owner), None), n)
        yield from _numbers(f"macro-elements of {kind}", owner, (len(owner),), m)
    for kind, faces in zone.master_faces:
        yield from _numbers(f"master faces {kind}", faces, (len(faces), None), n)


def _friction(found: ZoneFriction, m: int, dim: int) -> Iterator[str]:
    for name in ("friction_traction", "slip", "slip_total"):
        yield from _values(name.replace("_", " "), getattr(found, name), (m, dim))
    yield from _numbers("status of friction", found.status, (m,), 3)


def _recovered(field: RecoveredPressure, n: int, m: int, dim: int) -> Iterator[str]:
    k = len(field.nodes)
    yield from _numbers("nodes of the recovered pressure", field.nodes, (k,), n)
    yield from _numbers("degree of the recovered pressure", field.degree, (m,), 3)
    count = FORMS[field.form].count(dim) if field.form in FORMS else -1
    shapes = {"coefficients": (m, count), "centre": (m, dim), "axes": (m, dim - 1, dim)}
    shapes |= {"spread": (m, dim - 1, dim - 1), "at_nodes": (k,)}
    for name, shape in shapes.items():
        yield from _values(f"{name} of the recovered pressure", getattr(field, name), shape)


def _resultants(where: str, found: Resultants, dim: int) -> Iterator[str]:
    for name, shape in {"area": (3,), "force": (dim,), "moment": (3,)}.items():
        yield from _values(f"{name} {where}", getattr(found, name), shape)
    if found.pressure is not None:
        yield from _values(f"pressure {where}", found.pressure, (2,))
    for name, size in (("friction", dim), ("stick", 3)):
        if (given := getattr(found, name)) is not None:
            yield from _values(f"{name} {where}", given, (size,))


def _edges(zone: ZoneResult, dim: int) -> Iterator[str]:
    if (found := zone.resultants) is None:
        return
    yield from _resultants("of contact", found, dim)
    if edges := found.edges:
        e = len(edges.macro)
        yield from _numbers("macro-elements of edges", edges.macro, (e,), len(zone.area))
        yield from _flags(edges.better, e)
        for name in ("position", "lower", "upper"):
            yield from _values(f"{name} of edges", getattr(edges, name), (e, dim))
        yield from _values("lengths of edges", edges.lengths, (e, 3))


def _status(zone: ZoneResult, solution: Solution) -> Iterator[str]:
    """Whether p ≥ 0 and ḡ ≥ 0, on the scales of the zone's own stress and displacement."""
    nodes = np.union1d(zone.slave_nodes, zone.master_nodes)
    moved, contact = solution.displacement[nodes], zone.nodal or zone
    own = float(np.abs(contact.multiplier).max(initial=0.0))
    scale = max(own, float(np.abs(solution.stress[nodes]).max(initial=0.0)))
    largest = max(float(np.abs(other.multiplier).max(initial=0.0)) for other in solution.zones)
    round_off = _ROUNDINGS * float(np.finfo(float).eps)
    young = max(material.young for material in solution.case.materials.values())
    dim = 3 if solution.case.axisymmetric else moved.shape[1]
    smallest = float(zone.area.min()) ** (1 / (dim - 1))
    error = round_off * young * float(np.abs(moved).max()) / smallest
    error += max(solution.accuracy.values(), default=0.0) * largest
    worst = float(contact.multiplier.min(initial=0.0))
    if worst < -_TOLERANCE * scale - error:
        yield f"zone {zone.name}: contact bears tension, a pressure of {worst:.3g}"
    size = float(np.ptp(moved, axis=0).max(initial=0.0))
    place = float(np.abs(solution.mesh.points[nodes]).max() + np.abs(moved).max())
    stabilised = solution.case.zone_named(zone.name).stabilised
    gap = contact.gap[~contact.closed] if stabilised else contact.gap
    worst = float(gap.min(initial=0.0))
    if worst < -_TOLERANCE * size - round_off * place:
        yield f"zone {zone.name}: the surfaces overlap, a gap of {worst:.3g}"


def _nodal(nodal: NodalContact, n: int) -> Iterator[str]:
    k = len(nodal.nodes)
    yield from _numbers("multiplier nodes", nodal.nodes, (k,), n)
    for name in ("multiplier", "gap"):
        yield from _values(f"{name} at nodes", getattr(nodal, name), (k,))
    yield from _flags(nodal.closed, k)


def _values(name: str, values: np.ndarray, shape: Shape) -> Iterator[str]:
    if values.dtype.kind != "f" or values.shape != shape:
        yield f"{name} holds {values.dtype} {values.shape} in place of numbers {shape}"
    elif not np.isfinite(values).all():
        yield f"{name} holds values that are not finite numbers"


def _numbers(name: str, numbers: np.ndarray, shape: Shape, end: int) -> Iterator[str]:
    fits = len(numbers.shape) == len(shape) and all(
        wanted in (None, there) for wanted, there in zip(shape, numbers.shape, strict=True)
    )
    if numbers.dtype.kind not in "iu" or not fits:
        yield f"{name} holds {numbers.dtype} {numbers.shape} in place of whole numbers"
    elif numbers.size and not 0 <= numbers.min() <= numbers.max() < end:
        yield f"{name} holds numbers outside 0 … {end - 1}"


def _flags(closed: np.ndarray, count: int) -> Iterator[str]:
    if closed.dtype.kind != "b" or closed.shape != (count,):
        yield f"status holds {closed.dtype} {closed.shape} in place of {count} truth values"
