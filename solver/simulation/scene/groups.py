"""Whether a case fits its mesh: groups, dimension, materials, contact surfaces.

Every refusal is an `InputError` that names the case file, the key and the groups that are there.
"""

from collections.abc import Iterable, Sequence

import meshio
import numpy as np

from ...case.acting import Load
from ...case.expressions import Exact
from ...case.file import Zone
from ...case.model import Case
from ...case.rules import check_dimension
from ...lac.cells.catalogue import BY_MESHIO
from ...lac.cells.faces import FLAT
from ...system.errors import InputError, hint

ALL = "all"
# Nodes nearer to the axis than this share of the largest coordinate are on it.
ON_AXIS = FLAT
_EMPTY = (
    "is empty, or none of its members touches a volume cell (a rigid line or surface is one of "
    "`bodies`)"
)


def check_groups(case: Case, mesh: meshio.Mesh) -> None:
    """Raise `InputError` where the case does not fit the mesh."""
    dim = mesh.points.shape[1]
    if dim == 2 and case.plane is None:
        allowed = "this key is needed (strain, stress or axisymmetric): the mesh is plane"
        raise InputError(case.path, "plane", None, allowed)
    if dim == 3 and case.plane is not None:
        allowed = "only for plane meshes; this one has three dimensions"
        raise InputError(case.path, "plane", case.plane, allowed)
    if case.axisymmetric:
        _refuse_beyond_axis(case, mesh.points)
    check_dimension(case, dim)
    groups = _Groups(case, mesh)
    groups.check_materials()
    groups.check_supports()
    groups.check_bodies()
    for i, zone in enumerate(case.zones):
        groups.check_zone(i, zone)
    groups.check_loads()
    if case.probes:
        groups.check_probes()


def _refuse_beyond_axis(case: Case, points: np.ndarray) -> None:
    beyond = np.flatnonzero(points[:, 0] < -ON_AXIS * np.abs(points).max())
    if len(beyond):
        at = ", ".join(f"{x:.6g}" for x in points[beyond[0]])
        allowed = f"{len(beyond)} nodes have a negative radius x (the first at ({at}))"
        raise InputError(case.path, "plane", case.plane, allowed)


def named_parts(case: Case, mesh: meshio.Mesh) -> tuple[meshio.Mesh, tuple[int, int]]:
    """The mesh without what the case does not name: how many groups, how many faces and edges.

    Groups of volume cells stay: bodies have their names. `check_groups` comes first.
    """
    dims = [BY_MESHIO[block.type].dim for block in mesh.cells]
    volume = [dim == mesh.points.shape[1] for dim in dims]
    named = _named(case)
    sets = {
        name: members
        for name, members in mesh.cell_sets.items()
        if name in named or any(len(m) for m, v in zip(members, volume, strict=True) if v)
    }
    points = {name: nodes for name, nodes in mesh.point_sets.items() if name in named}
    left = len(mesh.cell_sets) - len(sets) + len(mesh.point_sets) - len(points)
    found = meshio.Mesh(mesh.points, mesh.cells, cell_sets=sets, point_sets=points)
    wanted = [np.full(len(b.data), whole) for b, whole in zip(mesh.cells, volume, strict=True)]
    found = with_cells(found, wanted)
    count = sum(len(block.data) for block in mesh.cells)
    count -= sum(len(block.data) for block in found.cells)
    return (found, (left, count)) if left or count else (mesh, (0, 0))


def with_cells(mesh: meshio.Mesh, wanted: Sequence[np.ndarray]) -> meshio.Mesh:
    """The mesh with only its `wanted` cells (n,), by block, also in its groups."""
    sets: dict[str, list[np.ndarray]] = {name: [] for name in mesh.cell_sets}
    cells = []
    for i, (block, chosen) in enumerate(zip(mesh.cells, wanted, strict=True)):
        kept = chosen.copy()
        for parts in mesh.cell_sets.values():
            kept[np.asarray(parts[i], dtype=int)] = True
        place = np.cumsum(kept) - 1
        for name, parts in mesh.cell_sets.items():
            sets[name].append(place[np.asarray(parts[i], dtype=int)])
        cells.append((block.type, block.data if kept.all() else block.data[kept]))
    return meshio.Mesh(mesh.points, cells, cell_sets=sets, point_sets=mesh.point_sets)


def nodes_of_volumes(mesh: meshio.Mesh, group: str | None = None) -> np.ndarray:
    """The nodes (n,) of volume cells, of one group or all."""
    touched = np.zeros(len(mesh.points), dtype=bool)
    members = mesh.cell_sets.get(group, [[]] * len(mesh.cells)) if group else None
    for i, block in enumerate(mesh.cells):
        if BY_MESHIO[block.type].dim == mesh.points.shape[1]:
            data = block.data if members is None else block.data[np.asarray(members[i], int)]
            touched[data.ravel()] = True
    return touched


def without_loose(mesh: meshio.Mesh, attached: np.ndarray) -> meshio.Mesh:
    """The mesh with the nodes `attached` (n,) to volume cells, and no faces and edges on others."""
    new = np.cumsum(attached) - 1
    kept = [attached[block.data].all(axis=1) for block in mesh.cells]
    place = [np.cumsum(k) - 1 for k in kept]
    sets = {
        name: [at[i[k[i]]] for i, k, at in zip(members_of(parts), kept, place, strict=True)]
        for name, parts in mesh.cell_sets.items()
    }
    return meshio.Mesh(
        mesh.points[attached],
        [(block.type, new[block.data[k]]) for block, k in zip(mesh.cells, kept, strict=True)],
        point_sets={name: new[i[attached[i]]] for name, i in mesh.point_sets.items()},
        cell_sets=sets,
    )


def members_of(parts: Iterable[np.ndarray]) -> list[np.ndarray]:
    """The cells of a group by block, as numbers."""
    return [np.asarray(part, dtype=int) for part in parts]


def _named(case: Case) -> set[str]:
    """All groups that a case names."""
    sides = [side for zone in case.zones for side in (zone.slave, zone.master)]
    held = [support.group for support in case.supports]
    held += [support.cyclic.of for support in case.supports if support.cyclic]
    loaded = [load.group for load in case.loads]
    probed = [name for probe in case.probes.values() for name in (probe.group, probe.within)]
    return {*case.materials, *case.rigid, *case.mesh.counts, *sides, *held, *loaded, *probed}


class _Groups:
    """The groups of one mesh, asked for by the keys of one case."""

    def __init__(self, case: Case, mesh: meshio.Mesh):
        self.case, self.mesh = case, mesh
        self.dim = mesh.points.shape[1]
        self.block_dims = [BY_MESHIO[block.type].dim for block in mesh.cells]

    def cells(self, key: str, group: str, dim: int) -> list[np.ndarray]:
        """The group's cells of that dimension, by block; refuses a group that has none."""
        self.require(key, group)
        kind = "volume cells" if dim == self.dim else "faces"
        if group not in self.mesh.cell_sets:
            raise self.error(key, group, f"is a group of nodes; a group of {kind} is needed")
        chosen = self.mesh.cell_sets[group]
        parts = [
            np.asarray(part, dtype=int) if block_dim == dim else np.empty(0, dtype=int)
            for part, block_dim in zip(chosen, self.block_dims, strict=True)
        ]
        if not any(map(len, parts)):
            held = [
                f"{len(part)} {BY_MESHIO[block.type].name}"
                for part, block in zip(chosen, self.mesh.cells, strict=True)
                if len(part)
            ]
            shown = f"holds {', '.join(held)} but no {kind}" if held else _EMPTY
            raise self.error(key, group, f"{shown}; a group of {kind} is needed")
        return parts

    def nodes(self, parts: list[np.ndarray]) -> np.ndarray:
        """The nodes of cells given by block."""
        touched = [
            block.data[part].ravel() for block, part in zip(self.mesh.cells, parts, strict=True)
        ]
        return np.unique(np.concatenate(touched))

    def shared(self, one: list[np.ndarray], other: list[np.ndarray]) -> int:
        """The number of cells of the two selections with the same nodes."""
        count = 0
        for block, *parts in zip(self.mesh.cells, one, other, strict=True):
            first, second = (np.unique(np.sort(block.data[p], axis=1), axis=0) for p in parts)
            together = np.unique(np.concatenate([first, second]), axis=0)
            count += len(first) + len(second) - len(together)
        return count

    def require(self, key: str, group: str) -> None:
        names = {*self.mesh.cell_sets, *self.mesh.point_sets}
        if group not in names:
            raise self.error(key, group, f"no such group in the mesh; {hint(group, names)}")

    def of_nodes(self, key: str, group: str) -> bool:
        """Whether a group is one of nodes; refuses one that holds faces or cells too."""
        if group not in self.mesh.point_sets:
            return False
        if any(map(len, self.mesh.cell_sets.get(group, ()))):
            raise self.error(key, group, "holds nodes, and faces or cells; one kind is needed")
        return True

    def error(self, key: str, value: object, allowed: str) -> InputError:
        return InputError(self.case.path, key, value, allowed)

    def check_materials(self) -> None:
        """Every volume cell has exactly one material; cells of rigid bodies need none."""
        named = [group for group in self.case.materials if group != ALL]
        given = self.covering("materials", named)
        shown = list(self.case.materials)
        if np.any(given > 1):
            allowed = f"{np.count_nonzero(given > 1)} cells have more than one material"
            raise self.error("materials", shown, allowed)
        if ALL in self.case.materials:
            return
        bare = np.count_nonzero(given + self.covering("bodies", self.case.rigid) == 0)
        if bare:
            allowed = f"{bare} of {len(given)} volume cells have no material"
            raise self.error("materials", shown, f"{allowed}; name their group, or `{ALL}`")

    def covering(self, key: str, groups: Iterable[str]) -> np.ndarray:
        """The number of these groups that contain each volume cell."""
        counts = [np.zeros(len(block.data), dtype=int) for block in self.mesh.cells]
        for group in groups:
            parts = self.cells(f"{key}.{group}", group, self.dim)
            for count, part in zip(counts, parts, strict=True):
                count[part] += 1
        volume = [c for c, dim in zip(counts, self.block_dims, strict=True) if dim == self.dim]
        return np.concatenate([np.empty(0, dtype=int), *volume])

    def check_supports(self) -> None:
        for i, support in enumerate(self.case.supports):
            key = f"supports[{i}].group"
            if support.by_area and support.group != ALL and not self.of_nodes(key, support.group):
                self.cells(key, support.group, self.dim - 1)
            if support.group == ALL:
                if "normal" in support.components:
                    allowed = "normal needs a group of faces; `all` is held along x, y and z"
                    raise self.error(key, ALL, allowed)
                continue
            self.require(key, support.group)
            if support.cyclic:
                self.require(f"supports[{i}].cyclic.of", support.cyclic.of)
            if "normal" in support.components:
                self.cells(key, support.group, self.dim - 1)
            cells = self.mesh.cell_sets.get(support.group, [])
            if not sum(map(len, [*cells, self.mesh.point_sets.get(support.group, [])])):
                raise self.error(key, support.group, _EMPTY)

    def check_loads(self) -> None:
        for i, load in enumerate(self.case.loads):
            key, on_volume = f"loads[{i}].group", load.of_cells
            if on_volume and load.group == ALL:
                chosen = zip(self.mesh.cells, self.block_dims, strict=True)
                parts = [np.arange(len(block.data) * (dim == self.dim)) for block, dim in chosen]
            elif load.kind == "force" and self.of_nodes(key, load.group):
                self.check_forced(key, load)
                continue
            else:
                parts = self.cells(key, load.group, self.dim if on_volume else self.dim - 1)
            self.check_loaded(key, load, parts)

    def check_forced(self, key: str, load: Load) -> None:
        """A force on nodes: there are some, and none on a rigid body."""
        nodes = self.mesh.point_sets[load.group]
        if not len(nodes):
            raise self.error(key, load.group, _EMPTY)
        for rigid in sorted(self.case.rigid):
            lost = np.isin(nodes, self.nodes(self.cells(f"bodies.{rigid}", rigid, self.dim)))
            if lost.any():
                allowed = f"{lost.sum()} of its nodes belong to the rigid body {rigid}; "
                allowed += "a load there does nothing; load a deformable body"
                raise self.error(key, load.group, allowed)

    def check_loaded(self, key: str, load: Load, parts: list[np.ndarray]) -> None:
        """No load on a rigid body, where it would move nothing.

        An exact solution has none there, and its loads may act on both bodies at once.
        """
        count = sum(map(len, parts))
        for rigid in sorted(self.case.rigid):
            fixed = np.zeros(len(self.mesh.points), dtype=bool)
            fixed[self.nodes(self.cells(f"bodies.{rigid}", rigid, self.dim))] = True
            lost = sum(
                int(fixed[block.data[part]].all(axis=1).sum())
                for block, part in zip(self.mesh.cells, parts, strict=True)
            )
            if lost == count or (lost and not isinstance(load.value, Exact)):
                kind = "cells" if load.of_cells else "faces"
                allowed = (
                    f"{lost} of its {count} {kind} belong to the rigid body {rigid}, which is "
                    "fixed: a load there does nothing; load a deformable body"
                )
                raise self.error(key, load.group, allowed)

    def check_bodies(self) -> None:
        for group in self.case.rigid:
            self.cells(f"bodies.{group}", group, self.dim)
        for group in self.case.mesh.counts:
            self.cells(f"counts.{group}", group, self.dim)

    def check_probes(self) -> None:
        for name, probe in self.case.probes.items():
            if probe.group and probe.group != ALL:
                self.require(f"probes.{name}.group", probe.group)
            if probe.within:
                self.cells(f"probes.{name}.within", probe.within, self.dim)

    def check_zone(self, number: int, zone: Zone) -> None:
        """Two surfaces without a common face, the slave's not on a rigid body."""
        keys = {side: self.case.zone_key(number, side) for side in ("slave", "master")}
        parts = {s: self.cells(key, getattr(zone, s), self.dim - 1) for s, key in keys.items()}
        common = self.shared(parts["slave"], parts["master"])
        if common:
            allowed = (
                f"{common} of its faces are slave faces too; a slave cannot be its own master: "
                "bodies in contact share no nodes"
            )
            raise self.error(keys["master"], zone.master, allowed)
        for side in ("slave", "master") if self.case.about.directions == "both" else ("slave",):
            self.check_deformable(keys[side], getattr(zone, side), parts[side])

    def check_deformable(self, key: str, group: str, parts: list[np.ndarray]) -> None:
        for rigid in self.case.rigid:
            body = self.cells(f"bodies.{rigid}", rigid, self.dim)
            if np.isin(self.nodes(parts), self.nodes(body)).any():
                allowed = f"lies on the rigid body {rigid}; a rigid side is always the master"
                if key.endswith("master"):  # in the file: slave where it is exchanged
                    allowed += ", so directions must be `first`"
                raise self.error(key, group, allowed)
