"""Contact pressures and gaps of a foreign result, brought to the slave surfaces of the case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import meshio
import numpy as np
from scipy.spatial import cKDTree

from ..case.expressions import evaluate
from ..lac.cells.catalogue import cell_type
from ..lac.cells.faces import (
    FACE_POINTS,
    outer_faces,
    right_side_out,
    surface_points,
    surface_vectors,
)
from ..lac.cells.shape import gauss_rule
from ..simulation.results.exact import ExactValues, computed_pressure
from ..simulation.results.solution import NodalContact, Solution, ZoneResult
from ..system.errors import InputError
from ..verification.samples import Reference, Sample, expected_pressure
from .model import Model
from .on_surfaces import faces_at, on_zones, where_zones_meet
from .placing import NEAR, Placed
from .surface_cells import SurfaceCells, corners_of, holding

# A value below this share of the largest is zero: files print zeros in this way.
_NOTHING = 1e-9
# So many points of faces are looked at for the face that holds a place.
_CANDIDATES = 9
# A face whose share under the master is nearer to one counts as whole: strains of bodies that slide
# move its end.
_NEARLY = 0.1


@dataclass(frozen=True)
class SurfaceValues:
    """What a result gives of one zone: values by node, by face or by point of its slave surface.

    `zone` has the geometry and, where values are at nodes or faces, the pressures. `kind` is node,
    face or point; `numbers` (k,) are those of nodes or faces.
    """

    zone: ZoneResult
    kind: str
    placed: Placed
    numbers: np.ndarray

    @property
    def whole(self) -> bool:
        """Whether the pressure is known on all of the surface."""
        return bool(np.isfinite(self.zone.multiplier).all())

    def place(self, i: int) -> str:
        """Where the i-th value is, in words."""
        if self.kind == "point":
            return f"({', '.join(f'{x:.6g}' for x in self.placed.places[i])})"
        return f"{self.kind} {self.numbers[i]}"

    def sample(self, reference: Reference, quantity: str) -> Sample | None:
        """The values beside the reference: its means over faces, else what it is at the places.

        None where no pressure is known to be one under the master alone.
        """
        if isinstance(reference, ExactValues):
            if self.kind == "face":
                means = getattr(reference, quantity)(self.zone)
                return Sample(self.placed.values, means[self.numbers], self.place)
            exact = reference.exact
            field = exact.contact_pressure if quantity == "pressure" else exact.gap
            return Sample(self.placed.values, field(self.placed.places), self.place)
        if quantity != "pressure":
            return Sample(self.placed.values, evaluate(reference, self.placed.places), self.place)
        if self.kind == "face":
            expected = expected_pressure(self.zone, reference)[self.numbers]
        else:
            expected = np.asarray(evaluate(reference, self.placed.places))
        # Under the end of the master a value is neither the reference nor zero.
        share = self._covered()
        if not (share == 1).any():
            return None
        known = np.flatnonzero((share == 0) | (share == 1))
        expected = np.where(share[known] == 0, 0.0, expected[known])
        return Sample(self.placed.values[known], expected, lambda i: self.place(int(known[i])))

    def _covered(self) -> np.ndarray:
        """Whether the faces around each value (k,) are under the master: 1, 0, or some of both."""
        zone, share = self.zone, self.zone.coverage
        covered = np.where(share > 1 - _NEARLY, 1.0, 0.5 * (share > _NOTHING))
        if self.kind == "face":
            return covered[self.numbers]
        if self.kind == "point":
            return covered[cKDTree(zone.centre).query(self.placed.places)[1]]
        total, count = np.zeros((2, int(zone.surfaces.slave_nodes.max()) + 1))
        for _, nodes, macro in zone.faces:
            np.add.at(total, nodes, covered[macro][:, None])
            np.add.at(count, nodes, 1.0)
        return (total / np.maximum(count, 1.0))[self.numbers]

    def force(self, model: Model) -> np.ndarray | None:
        """The force (dim,) of the pressure on the slave.

        None where no area is known, or the master ends under a face that is pressed.
        """
        bare = (self.zone.coverage > _NOTHING) & (self.zone.coverage < 1 - _NEARLY)
        if (bare & ~(self.zone.multiplier <= 0)).any():
            return None
        if self.whole:
            return pressure_force(model.points, self.zone, model.case.axisymmetric)
        if self.kind != "point" or self.placed.area is None:
            return None
        near = cKDTree(self.zone.centre).query(self.placed.places)[1]
        weight = self.placed.values * self.placed.area
        return -np.einsum("k,kd->d", weight, self.zone.normal[near])


def surfaces(
    model: Model, placed: Placed, sides: SurfaceCells | None, where: object, name: str
) -> list[SurfaceValues]:
    """The values of a pressure or gap by zone; those on no slave surface are left out.

    `sides`: the cells of the result's own mesh that they belong to.
    Raises InputError where they are on the master surfaces alone, and where pressures at nodes
    leave corners of slave faces out.
    """
    on = on_zones(model, placed, sides)
    _refuse_exchanged(model, placed, np.asarray(on.any(axis=0)), where, name)
    found = []
    for number, zone in enumerate(model.solution.zones):
        mine, common = placed.at(on[number]), on[:, on[number]].sum(axis=0) > 1
        if not len(mine.places):
            continue
        if sides is not None:
            found.append(_of_cells(model, zone, mine, sides.at(on[number]), name))
            continue
        tolerance = NEAR * model.length
        face = None if placed.numbered else faces_at(model, zone, mine.places)
        apart, node = cKDTree(model.points[zone.surfaces.slave_nodes]).query(mine.places)
        if face is not None:
            found.append(_at_faces(zone, mine, face, name))
        elif (apart < tolerance).all():
            nodes = zone.surfaces.slave_nodes[node]
            surface = _at_nodes(model, zone, mine, nodes, common, name, where)
            alone = ~where_zones_meet(model, number, mine.places)
            found.append(replace(surface, placed=mine.at(alone), numbers=nodes[alone]))
        else:
            found.append(SurfaceValues(zone, "point", mine, np.arange(len(mine.places))))
    return found


def _refuse_exchanged(
    model: Model, placed: Placed, on: np.ndarray, where: object, name: str
) -> None:
    """Refuse values that are on the master side alone."""
    size = np.abs(placed.values)
    if size[on].max(initial=0.0) > _NOTHING * size.max() or on.all():
        return
    masters = [zone.surfaces.master_nodes for zone in model.solution.zones]
    if name == "pressure" and np.isin(placed.node[size > 0], np.concatenate(masters)).any():
        problem = "is on the master surface: slave and master are exchanged (option --swap)"
        raise InputError(where, name, None, problem)
    if not on.any():
        raise InputError(where, name, None, "no value of it is on a slave surface")


def _at_nodes(
    model: Model,
    zone: ZoneResult,
    placed: Placed,
    nodes: np.ndarray,
    common: np.ndarray,
    name: str,
    where: object,
) -> SurfaceValues:
    """Values at slave nodes; pressures on the whole surface.

    A value that is `common` (k,) to zones is one of two pressures: then the whole is not known.
    """
    count = np.bincount(nodes, minlength=len(model.points))
    mean = np.bincount(nodes, placed.values, len(model.points)) / np.maximum(count, 1)
    vertices = np.unique(
        np.concatenate([f[:, : cell_type(kind).n_vertices].ravel() for kind, f, _ in zone.faces])
    )
    surface = SurfaceValues(zone, "node", placed, nodes)
    if name != "pressure":
        return surface
    if missing := int((count[vertices] == 0).sum()):
        missed = f"{missing} of {len(vertices)} corners of the slave faces have none"
        problem = f"{missed}: it must be 0 where there is no contact"
        raise InputError(where, name, None, problem)
    if common.any():
        return surface
    known = zone.surfaces.slave_nodes if count[zone.surfaces.slave_nodes].all() else vertices
    nothing = np.zeros(len(known))
    nodal = NodalContact(known, mean[known], nothing, mean[known] > 0)
    filled = replace(zone, nodal=nodal)
    at = surface_points(model.points, zone.faces, model.case.axisymmetric)
    means = at.means(computed_pressure(model.points, filled))
    filled = replace(filled, multiplier=means, gap=np.zeros(len(means)), closed=means > 0)
    return replace(surface, zone=filled)


def _of_cells(
    model: Model, zone: ZoneResult, placed: Placed, sides: SurfaceCells, name: str
) -> SurfaceValues:
    """Values of cells: means over slave faces that they fill, else values at their places."""
    at = surface_points(model.points, zone.faces, model.case.axisymmetric)
    corners = np.empty((len(zone.area), 4, model.dim))
    for kind, nodes, macro in zone.faces:
        corners[macro] = corners_of(model.points, cell_type(kind), nodes)
    near = cKDTree(at.place).query(placed.places, k=min(_CANDIDATES, len(at.place)))[1]
    face = holding(placed.places, corners, at.macro[near])
    area = np.bincount(at.macro, at.weight)
    means = sides.means(placed.values, face, area)
    if means is None:
        points = replace(placed, area=sides.area)
        return SurfaceValues(zone, "point", points, np.arange(len(placed.places)))
    first = np.unique(face, return_index=True)[1]
    whole = replace(placed.at(first), places=zone.centre, values=means, cells=None)
    return _at_faces(zone, whole, np.arange(len(means)), name)


def _at_faces(zone: ZoneResult, placed: Placed, faces: np.ndarray, name: str) -> SurfaceValues:
    """Values at the centres of all slave faces: their means."""
    surface = SurfaceValues(zone, "face", placed, faces)
    if name != "pressure":
        return surface
    values = np.empty(len(zone.centre))
    values[faces] = placed.values
    filled = replace(zone, multiplier=values, gap=np.zeros(len(values)), closed=values > 0)
    return replace(surface, zone=filled)


def pressure_force(points: np.ndarray, zone: ZoneResult, axisymmetric: bool) -> np.ndarray:
    """The force (dim,) of a pressure on the slave: −∫ p n dS over its surface."""
    pressure, start, total = computed_pressure(points, zone), 0, np.zeros(points.shape[1])
    for name, nodes, _ in zone.faces:
        reference, weights = gauss_rule(name, FACE_POINTS)
        _, vectors = surface_vectors(points, nodes, name, reference, axisymmetric)
        flat = (vectors * weights[:, None]).reshape(-1, points.shape[1])
        total -= pressure[start : start + len(flat)] @ flat
        start += len(flat)
    return total


# A result on a mesh of its own as a solution there: for error norms and contact forces.


def own_solution(
    model: Model,
    mesh: meshio.Mesh,
    body: np.ndarray,
    placed: Mapping[str, Placed],
    pressures: list[SurfaceValues],
) -> Solution | None:
    """The solution on the result's own cells; None where these do not fill the dimension.

    Values that are not given at all nodes are NaN, zones without a pressure at nodes are left out.
    """
    dim = model.dim
    blocks = [(b.type, b.data) for b in mesh.cells if cell_type(b.type).dim == dim]
    if not blocks or model.rigid.any() or (body < 0).any():
        return None
    points = mesh.points[:, :dim]
    turned = [(name, right_side_out(points, data, cell_type(name))[0]) for name, data in blocks]
    cells = meshio.Mesh(points, turned)
    frame, n = model.solution, len(points)
    faces = list(outer_faces(turned))
    zones = [zone for s in pressures if (zone := _zone(points, faces, s, model)) is not None]
    fields = {"displacement": np.full((n, dim), np.nan), "stress": np.full((n, 6), np.nan)}
    for name, values in fields.items():
        if name in placed and placed[name].own is not None:
            values[placed[name].own] = placed[name].values
    named = replace(frame.fields, body=body)
    return replace(frame, mesh=cells, fields=named, zones=zones, **fields)  # type: ignore[arg-type]


def _zone(
    points: np.ndarray,
    faces: list[tuple[str, np.ndarray]],
    surface: SurfaceValues,
    model: Model,
) -> ZoneResult | None:
    """The zone on the outer faces all of whose vertices have a pressure; None without one."""
    own = surface.placed.own
    if own is None:
        return None
    value = np.full(len(points), np.nan)
    value[own] = surface.placed.values
    found, first = [], 0
    for kind, nodes in faces:
        corners = nodes[:, : cell_type(kind).n_vertices]
        mine = nodes[np.isfinite(value[corners]).all(axis=1)]
        if len(mine):
            found.append((kind, mine, np.arange(first, first := first + len(mine))))
    if not first:
        return None
    known = np.flatnonzero(np.isfinite(value))
    pressure = value[known]
    at = surface_points(points, found, model.case.axisymmetric)
    nodes = np.unique(np.concatenate([f[1].ravel() for f in found]))
    none = np.zeros(first)
    nodal = NodalContact(known, pressure, np.zeros(len(known)), pressure > 0)
    zone = replace(
        surface.zone,
        faces=found,
        centre=np.stack([at.means(x) for x in at.place.T], axis=1),
        normal=np.concatenate([_normals(points, *face[:2]) for face in found]),
        area=np.bincount(at.macro, at.weight),
        gap=none,
        closed=none > 0,
        coverage=np.ones(first),
        surfaces=replace(
            surface.zone.surfaces, slave_nodes=nodes, stress_slave=np.full(len(nodes), np.nan)
        ),
        nodal=nodal,
    )
    return replace(zone, multiplier=at.means(computed_pressure(points, zone)))


def _normals(points: np.ndarray, kind: str, nodes: np.ndarray) -> np.ndarray:
    """Unit normals (n, dim) of faces."""
    reference, weights = gauss_rule(kind, FACE_POINTS)
    vectors = surface_vectors(points, nodes, kind, reference)[1]
    total = (vectors * weights[:, None]).sum(axis=1)
    return total / np.linalg.norm(total, axis=1, keepdims=True)
