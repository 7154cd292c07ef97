"""Where the values of a foreign result are on the case: nodes, bodies, or what is wrong with them.

Places are compared with the nodes of the case. Where all agree, values belong to nodes; where only
the extents do, the result is on a mesh of its own. Anything else is refused by what would make the
places agree: another unit of length, a mirror image, exchanged axes, a shift, a deformed mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any

import meshio
import numpy as np
from scipy.spatial import cKDTree

from ..lac.cells.catalogue import BY_MESHIO
from ..lac.motions import body_numbers
from ..simulation.scene.groups import without_loose
from ..system.errors import InputError
from .foreign import Field, ForeignResult
from .model import Model, extents_of
from .surface_cells import SurfaceCells

# Places agree within this share of the model's length: files give six digits at times.
NEAR = 2e-5
# Extents of another mesh agree within this share: curved faces are polygons there.
_ALIKE = 2e-2
# Values at points reach over at least this share of the extents.
_REACH = 0.5
# So many places may be at one node: the layers of a plane case.
_LAYERS = 4
# Fewer places may be at nodes by chance.
_FEW = 12
CONTACT = ("pressure", "gap")
UNITS = {1e3: "10³", 1e-3: "10⁻³", 1e6: "10⁶", 1e-6: "10⁻⁶", 1e9: "10⁹", 1e-9: "10⁻⁹"}


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Values (k, …) at places (k, dim) of the case; `area` (k,) of each place or None.

    `own` (k,) are nodes of the result's own mesh, or `cells` (k,) its cells. `numbered`: the result
    says itself which nodes or cells the places are. `node` (k,) of the case's mesh and `body` (k,)
    are -1 where no node is there, or the body is unknown because two bodies touch there.
    """

    places: np.ndarray
    values: np.ndarray
    node: np.ndarray
    body: np.ndarray
    numbered: bool
    area: np.ndarray | None = None
    own: np.ndarray | None = None
    cells: np.ndarray | None = None

    def at(self, chosen: np.ndarray) -> Placed:
        """The chosen places, by mask or number."""
        named = ("places", "values", "node", "body", "area", "own", "cells")
        arrays = {name: getattr(self, name) for name in named}
        parts: dict[str, Any] = {
            name: None if a is None else a[chosen] for name, a in arrays.items()
        }
        return replace(self, **parts)

    def nodal(self, count: int) -> np.ndarray:
        """The values (count, …) by node, means of several; NaN where a node has none."""
        known = self.node >= 0
        total = np.zeros((count, *self.values.shape[1:]))
        np.add.at(total, self.node[known], self.values[known])
        times = np.bincount(self.node[known], minlength=count).astype(float)
        times[times == 0] = np.nan
        return total / times.reshape(-1, *[1] * (total.ndim - 1))


class Placer:
    """Places the fields of one result on the model; raises InputError for what does not fit."""

    def __init__(self, model: Model, foreign: ForeignResult, where: object):
        self.model, self.foreign, self.where = model, foreign, where
        self.tree = cKDTree(model.points)
        self.near = NEAR * model.length
        low, high = model.points.min(axis=0), model.points.max(axis=0)
        self.low, self.high = low, high
        mesh = foreign.mesh
        if mesh is not None and not any(BY_MESHIO[b.type].dim >= model.dim for b in mesh.cells):
            mesh = None
        self.points = None if mesh is None else self._flat(mesh.points, "mesh")
        self.first: np.ndarray | None = None
        if mesh is None or self.points is None:
            return
        if all(BY_MESHIO[b.type].dim <= model.dim for b in mesh.cells):  # no layer of a plane case
            self.first = np.concatenate([block.data[:, 0] for block in mesh.cells])
        self._refuse_elsewhere(self.points, "mesh", whole=True)
        self.body = np.full(len(mesh.points), -1)
        for part in _parts(mesh):
            self.body[part] = self._body_of(self.points[part])
        missing = np.setdiff1d(model.body[~model.rigid[model.body]], self.body)
        if len(missing):
            name = model.solution.bodies[int(missing[0])].name
            raise self._refused("mesh", f"nothing of it is where the case has the body {name}")

    def place(self, field: Field, name: str) -> Placed:
        """The values of a field on the case; NaN, where there may be no value, is left out."""
        if name in CONTACT and not self.model.case.zones:
            raise self._refused(name, "the case has no contact zone")
        places = self._flat(field.places, name)
        known = np.isfinite(field.values.reshape(len(places), -1)).all(axis=1)
        if not known.any():
            raise self._refused(name, "no value of it is a finite number")
        if np.isinf(field.values).any() or self._lacks(field, known, name):
            problem = f"{int((~known).sum())} of {len(known)} values are not finite numbers"
            raise self._refused(name, problem)
        values, area = field.values[known], None if field.area is None else field.area[known]
        places = places[known]
        if field.cells is not None and self.first is not None:
            cells = field.cells[known]
            return Placed(
                places=places,
                values=values,
                node=np.full(len(places), -1),
                body=self.body[self.first[cells]],
                numbered=True,
                cells=cells,
            )
        numbered, own = field.nodes is not None and self.points is not None, None
        if numbered:
            own = np.asarray(field.nodes)[known]
            body = self.body[own]
        else:
            self._refuse_elsewhere(places, name, whole=name not in CONTACT)
            body = np.full(len(places), -1)
        node = self._nodes(places, body)
        # A table of all nodes in their order distinguishes the sides of the interface.
        numbered = numbered or np.array_equal(node, np.arange(len(self.model.points)))
        body = np.where(node >= 0, self.model.body[node], body)
        return Placed(
            places=places,
            values=values,
            node=node,
            body=body,
            numbered=numbered,
            area=area,
            own=own,
        )

    def sides(self, placed: Placed) -> SurfaceCells | None:
        """The cells that values belong to; None for values at places."""
        if placed.cells is None or self.foreign.mesh is None or self.points is None:
            return None
        around = self.model.case.axisymmetric
        return SurfaceCells.of(self.foreign.mesh, self.points, placed.cells, around)

    def _lacks(self, field: Field, known: np.ndarray, name: str) -> bool:
        """Whether nodes of bodies that deform have no displacement or stress."""
        if name in CONTACT or field.nodes is None or self.points is None:
            return False
        body = self.body[field.nodes[~known]]
        return bool((~self.model.rigid[body[body >= 0]]).any())

    def _flat(self, points: np.ndarray, name: str) -> np.ndarray:
        """Places in the case's dimension; in a plane case z may have any value."""
        points = np.asarray(points, dtype=float)
        if not np.isfinite(points).all():
            raise self._refused(name, "coordinates that are not finite numbers")
        if points.shape[1] < self.model.dim:
            raise self._refused(name, "its places have two coordinates; the case has three")
        return points[:, : self.model.dim]

    def _nodes(self, places: np.ndarray, body: np.ndarray) -> np.ndarray:
        """The node (k,) at each place in its body; -1 for none and for one of several."""
        points = self.model.points
        if len(places) == len(points) and (np.abs(places - points) < self.near).all():
            return np.arange(len(points))  # the same nodes in the same order
        found = np.full(len(places), -1)
        for number in np.unique(self.model.body):
            mine = np.flatnonzero(self.model.body == number)
            distance, near = cKDTree(points[mine]).query(places, distance_upper_bound=self.near)
            here = np.isfinite(distance) & ((body == number) | (body < 0))
            both = here & (found >= 0)
            found[here] = mine[near[here]]
            found[both] = -2
        return np.where(found == -2, -1, found)

    def _body_of(self, points: np.ndarray) -> int:
        """The body of the case that a body of the result is, by its extents."""
        off = _apart(points, self.model)
        if off.min() > _ALIKE * self.model.length:
            low, high = (_listed(side) for side in extents_of(points))
            raise self._refused("mesh", f"the case has no body from {low} to {high}")
        return int(off.argmin())

    def _refuse_elsewhere(self, places: np.ndarray, name: str, whole: bool) -> None:
        """Refuse places that are not the case's, by what would make them so."""
        if self._all_near(places) or (not whole and self._at_faces(places)):
            return
        for problem, moved in self._hypotheses(places) if len(places) >= _FEW else ():
            if self._all_near(moved):
                raise self._refused(name, problem)
        low, high = places.min(axis=0), places.max(axis=0)
        reach, size = high - low, self.high - self.low
        ratio = float(reach.max() / size.max())
        for factor, text in UNITS.items():
            if abs(ratio / factor - 1) < 2 * _ALIKE:
                raise self._refused(name, f"lengths are {text} times the case's: another unit?")
        slack = _ALIKE * self.model.length
        outside = (low < self.low - slack).any() or (high > self.high + slack).any()
        short = (reach < _REACH * size - slack).any() if whole else self._misses_contact(places)
        if outside or short:
            problem = f"it is from {_listed(low)} to {_listed(high)}"
            problem += f"; the case is from {_listed(self.low)} to {_listed(self.high)}"
            raise self._refused(name, problem)

    def _at_faces(self, places: np.ndarray) -> bool:
        """Whether all places are middles of slave faces."""
        middles = [each for z in self.model.solution.zones for each in self.model.middles(z)]
        distance = cKDTree(np.concatenate(middles)).query(places)[0]
        return bool((distance < self.near).all())

    def _misses_contact(self, places: np.ndarray) -> bool:
        """Whether places of the interface do not reach over the part of it that is pressed."""
        pressed = []
        for zone in self.model.scene.zones:
            centre = zone.operator.surface.centre + self.model.scene.coordinates.origin
            pressure = self.model.reference_pressure(zone)
            pressed.append(centre if pressure is None else centre[pressure > 0])
        if not sum(map(len, pressed)):
            return False
        wanted = np.ptp(np.concatenate(pressed), axis=0)
        return bool((np.ptp(places, axis=0) < _REACH * wanted - _ALIKE * self.model.length).any())

    def _all_near(self, places: np.ndarray) -> bool:
        """Whether all places are at nodes, and not many of them at few nodes."""
        distance, node = self.tree.query(places, distance_upper_bound=self.near)
        distinct = len(np.unique(node))
        return bool(np.isfinite(distance).all()) and _LAYERS * distinct >= len(places)

    def _hypotheses(self, places: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
        """What may be wrong with places, and where they would be without that."""
        axes = "xyz"[: self.model.dim]
        moved = self.foreign.displacement
        if moved is not None and len(moved.places) == len(places):
            problem = "coordinates belong to the deformed mesh; the undeformed ones are needed"
            yield problem, places - moved.values[:, : self.model.dim]
        for factor, text in UNITS.items():
            yield f"lengths are {text} times the case's: another unit?", places / factor
        low, high = places.min(axis=0), places.max(axis=0)
        for i, axis in enumerate(axes):
            image = places.copy()
            image[:, i] = self.low[i] + high[i] - places[:, i]
            yield f"the mesh is mirrored in {axis}{self._swaps(i)}", image
        shift = self.low - low
        yield f"the mesh is shifted by {_listed(-shift)}", places + shift
        for order in permutations(range(len(axes))):
            turned = places[:, order]
            named = ", ".join(axes[i] for i in order)
            yield f"axes are exchanged: the case's {', '.join(axes)} are its {named}", turned
            yield (
                f"axes are exchanged and shifted: the case's {', '.join(axes)} are its {named}",
                turned + self.low - turned.min(axis=0),
            )

    def _swaps(self, axis: int) -> str:
        """A remark, where a mirror image puts each body in another one's place."""
        along = np.abs(self.model.direction)
        return ": its bodies are swapped" if along[axis] > 0.9 else ""

    def _refused(self, key: str, problem: str) -> InputError:
        return InputError(self.where, key, None, problem)


def _listed(values: np.ndarray) -> str:
    return f"({', '.join(f'{v:.6g}' for v in values)})"


def flattened(foreign: ForeignResult, dim: int, where: object, thin: bool) -> ForeignResult:
    """A result of a plane case that was solved as a layer of cells, in the plane.

    In plane stress (`thin`) the layer may move across the plane, and σ_zz need not be given.
    Raises InputError for either elsewhere.
    """
    stress = foreign.stress
    if stress is not None and np.isnan(stress.values[:, 2]).all():
        if not thin:
            problem = "its component zz is missing, which is zero in plane stress alone"
            raise InputError(where, "stress", None, problem)
        values = stress.values.copy()
        values[:, 2] = 0.0
        foreign = replace(foreign, stress=replace(stress, values=values))
    moved = foreign.displacement
    if dim == 3 or moved is None or moved.values.shape[1] == 2 or np.isnan(moved.values).all():
        return foreign
    size = float(np.nanmax(np.abs(moved.values)))
    across = float(np.nanmax(np.abs(moved.values[:, 2]), initial=0.0))
    if across > _ALIKE * size and not thin:
        problem = f"moves by {across:.3g} across the plane: the case is one of plane strain"
        raise InputError(where, "displacement", None, problem)
    return replace(foreign, displacement=replace(moved, values=moved.values[:, :2]))


def without_rigid_surfaces(foreign: ForeignResult, model: Model) -> ForeignResult:
    """The result without cells for rigid surfaces, which the case's own mesh does not have.

    Parts without a common node are such cells where their extents are those of no body. Values on
    them go too. A result that lacks a body that deforms is not changed.
    """
    mesh = foreign.mesh
    if mesh is None or not mesh.cells or not model.case.rigid:
        return foreign
    kept = _of_bodies(mesh, model)
    if kept.all():
        return foreign
    node = np.cumsum(kept) - 1
    whole = np.concatenate([kept[block.data].all(axis=1) for block in mesh.cells])
    cell, fields = np.cumsum(whole) - 1, dict[str, Any]()
    for name in ("displacement", "stress", *CONTACT):
        field = getattr(foreign, name)
        if field is not None and field.nodes is not None:
            fields[name] = _chosen(field, kept[field.nodes], nodes=node)
        elif field is not None and field.cells is not None:
            fields[name] = _chosen(field, whole[field.cells], cells=cell)
    return replace(foreign, mesh=without_loose(mesh, kept), **fields)


def _of_bodies(mesh: meshio.Mesh, model: Model) -> np.ndarray:
    """The nodes (n,) of parts that have the extents of a body, and those of no cell.

    All, where a body that deforms has no such part.
    """
    dim, every = model.dim, np.ones(len(mesh.points), dtype=bool)
    if mesh.points.shape[1] < dim:
        return every
    parts = _parts(mesh)
    off = np.stack([_apart(mesh.points[part, :dim], model) for part in parts])
    alike = off.min(axis=1) <= _ALIKE * model.length
    if not np.isin(np.flatnonzero(~model.rigid), off[alike].argmin(axis=1)).all():
        return every
    kept = every.copy()
    for number in np.flatnonzero(~alike):
        kept[parts[number]] = False
    return kept


def _parts(mesh: meshio.Mesh) -> list[np.ndarray]:
    """The nodes (k,) of each part of a mesh; parts have no common node."""
    part = body_numbers(len(mesh.points), {str(i): b.data for i, b in enumerate(mesh.cells)})
    used = np.unique(np.concatenate([block.data.ravel() for block in mesh.cells]))
    used = used[np.argsort(part[used], kind="stable")]
    return np.split(used, np.flatnonzero(np.diff(part[used])) + 1)


def _apart(points: np.ndarray, model: Model) -> np.ndarray:
    """How far the extents of points (k, dim) are from those of each body (b,)."""
    return np.asarray(np.abs(extents_of(points) - model.extents).max(axis=(1, 2)))


def _chosen(field: Field, chosen: np.ndarray, **number: np.ndarray) -> Field:
    """The `chosen` (k,) values of a field, with another `number` of each node or cell."""
    kept = {name: getattr(field, name) for name in ("places", "values", "nodes", "cells", "area")}
    kept = {name: None if a is None else np.asarray(a)[chosen] for name, a in kept.items()}
    return Field(**kept | {name: new[kept[name]] for name, new in number.items()})
