"""What pictures show of a solution, in 3D coordinates: bodies, rigid surfaces, slave faces.

A plane result lies at z = 0 and is seen from +z. The static picture and the browser's surfaces are
both drawn from these parts.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import meshio
import numpy as np

from ..lac.cells.faces import outer_faces
from ..mechanics.fem.faces import volume_cells
from ..simulation.results.solution import Solution, ZoneResult
from ..simulation.scene.holdings.rigid_surfaces import quadric_of
from ..verification.units import with_unit
from .charts import BLUE, PAPER
from .layout import RELATIVE, STATUS, edge_color, mixed, tint, ways_apart
from .profile import expected

# A rigid surface is drawn this much larger than the slave opposite to it.
_MORE = 1.3
_TINY = 1e-300
# By type of face: the type, nodes (f, k) into the points of the part, number (f,) of the owner.
Faces = list[tuple[str, np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class DrawnPart:
    """One part: its `points` (n, 3), their `displacement` (n, 3), and its `faces`.

    Faces belong to macro-elements where `zone` is given, else to the body of number `body`. `way`
    (3,): where it goes when bodies are moved apart. `out` (n, 3): the normals of a rigid surface
    without cells, out of the body; None for all other parts.
    """

    name: str
    role: str
    color: str
    fill: str
    body: int
    points: np.ndarray
    displacement: np.ndarray
    faces: Faces
    way: np.ndarray
    zone: ZoneResult | None = None
    out: np.ndarray | None = None

    @property
    def meshed(self) -> bool:
        """Whether it is a body with cells."""
        return self.zone is None and self.out is None

    @cached_property
    def used(self) -> np.ndarray:
        """The points (k,) of its faces."""
        return np.unique(np.concatenate([np.empty(0, int), *(f.ravel() for _, f, _ in self.faces)]))


def parts(solution: Solution) -> Iterator[DrawnPart]:
    """The bodies in their order, then the slave faces of every zone."""
    points, moved = three(solution.mesh.points), three(solution.displacement)
    ways, outer = three(ways_apart(solution)), outside(solution.mesh)
    for number, body in enumerate(solution.bodies):
        look = (body.name, body.role, edge_color(body), tint(body), number)
        if rigid := rigid_surface(solution, number):
            yield DrawnPart(*look, *rigid[:3], ways[number], out=rigid[3])
            continue
        owners = [(kind, nodes, solution.fields.body[nodes[:, 0]]) for kind, nodes in outer]
        own = [(k, nodes[b == number], b[b == number]) for k, nodes, b in owners]
        yield DrawnPart(*look, points, moved, own, ways[number])
    for zone in solution.zones:
        number = int(solution.fields.body[zone.surfaces.slave_nodes[0]])
        look = (f"{zone.name}: slave faces", "slave", BLUE, mixed(BLUE, PAPER, 0.8), number)
        yield DrawnPart(*look, points, moved, zone.faces, ways[number], zone)


def outside(mesh: meshio.Mesh) -> list[tuple[str, np.ndarray]]:
    """The faces that are seen, by type: cells in the plane, else the outer faces."""
    cells = volume_cells(mesh).items()
    return list(cells if mesh.points.shape[1] == 2 else outer_faces(cells))


def rigid_surface(
    solution: Solution, number: int
) -> tuple[np.ndarray, np.ndarray, Faces, np.ndarray] | None:
    """The surface of a body without cells; None where it has cells.

    Returns points (n, 3), their displacement (n, 3), faces, and normals (n, 3) out of the body: the
    slave faces opposite to it, enlarged about their middle and moved onto the surface.
    """
    name, case = solution.bodies[number].name, solution.case
    surface = quadric_of(case, name, np.zeros(solution.mesh.points.shape[1]))
    zones = zip(solution.zones, case.zones, strict=True)
    faces = [face for zone, given in zones if given.master == name for face in zone.faces]
    if surface is None or not faces:
        return None
    points, own = solution.mesh.points, solution.fields.body == number
    if solution.fields.motion is not None:
        given = np.c_[points[own] - solution.fields.motion[own], np.ones(own.sum())]
        *turn, shift = np.linalg.lstsq(given, points[own], rcond=None)[0]
        surface = surface.moved(np.array(turn).T, shift)
    used = np.unique(np.concatenate([nodes.ravel() for _, nodes, _ in faces]))
    middle = (points[used].min(axis=0) + points[used].max(axis=0)) / 2
    places = middle + _MORE * (points[used] - middle)
    if case.axisymmetric:
        places[:, 0] = np.maximum(places[:, 0], 0.0)
    into = -_unit(surface.gradient(places))
    places += surface.distance(places, into)[0][:, None] * into
    moved = carried(places, points[own], solution.displacement[own])
    local = [(k, np.searchsorted(used, f), np.full(len(f), number)) for k, f, _ in faces]
    return three(places), three(moved), local, three(_unit(surface.gradient(places)))


def carried(places: np.ndarray, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """What nodes (k, dim) of a rigid body have, `values` (k, dim), at its places (n, dim).

    A rigid motion is linear.
    """
    linear = np.linalg.lstsq(np.c_[nodes, np.ones(len(nodes))], values, rcond=None)[0]
    return np.asarray(np.c_[places, np.ones(len(places))] @ linear)


def zone_fields(solution: Solution, zone: ZoneResult) -> dict[str, np.ndarray]:
    """Fields (m,) of a zone by title: pressure, gap, deviation from a reference if there is one."""
    units = solution.case.about.units
    found = {
        with_unit("contact pressure p", units.get("stress")): zone.multiplier,
        with_unit("gap", units.get("length")): zone.gap,
    }
    if zone.friction is not None:
        size = np.linalg.norm(zone.friction.friction_traction, axis=1)
        found |= {
            with_unit("friction |t|", units.get("stress")): size,
            with_unit("slip", units.get("length")): np.linalg.norm(zone.friction.slip, axis=1),
            STATUS: zone.friction.status.astype(float),
        }
    means = expected(solution, zone)
    if means is not None:
        found[RELATIVE] = (zone.multiplier - means) / (np.abs(means).max() or 1.0)
    return found


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), _TINY)


def three(vectors: np.ndarray) -> np.ndarray:
    """Vectors (…, dim) with a third component, zero in the plane."""
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, 3 - vectors.shape[-1])])
