"""Groups that a case makes on its mesh: lists of groups, and members selected by their place.

A plane, a sphere and a point hold the nodes that are nearer to them than 1e-6 of the largest extent
of the mesh. A face or cell is in a selection with all of its nodes.
"""

import meshio
import numpy as np

from ...case.model import Case, Selection
from ...case.rules import check_dimension
from ...lac.cells.catalogue import BY_MESHIO, BY_NAME
from ...lac.cells.faces import outer_faces
from ...mechanics.fem.faces import volume_cells
from ...system.errors import InputError, hint
from .groups import ALL, nodes_of_volumes, with_cells, without_loose

# A node is at a place where it is nearer than this share of the mesh's extent.
_NEAR = 1e-6


def with_groups(case: Case, mesh: meshio.Mesh) -> meshio.Mesh:
    """The mesh with the groups and rigid surfaces that the case makes.

    Raises InputError where one is empty.
    """
    check_dimension(case, mesh.points.shape[1])
    if case.mesh.selections:
        mesh = _with_selections(case, mesh)
    attached = nodes_of_volumes(mesh)
    if case.rigid:
        from .holdings.rigid_surfaces import with_rigid_surfaces

        mesh = with_rigid_surfaces(case, mesh, attached)
    return mesh if attached.all() else without_loose(mesh, nodes_of_volumes(mesh))


def _with_selections(case: Case, mesh: meshio.Mesh) -> meshio.Mesh:
    mesh = meshio.Mesh(
        mesh.points,
        [(block.type, block.data) for block in mesh.cells],
        point_sets=dict(mesh.point_sets),
        cell_sets={name: list(parts) for name, parts in mesh.cell_sets.items()},
    )
    given = {block.type: len(block.data) for block in mesh.cells}
    if any(selection.of == "faces" for selection in case.mesh.selections):
        mesh = _with_outer_faces(mesh)
    for selection in case.mesh.selections:
        if selection.name in {ALL, *mesh.cell_sets, *mesh.point_sets}:
            allowed = "the mesh has a group of this name; give another one"
            raise InputError(case.path, selection.key, selection.name, allowed)
        _add(case, mesh, selection)
    mesh.cell_sets.pop(_OUTER, None)
    return with_cells(mesh, [np.arange(len(b.data)) < given.get(b.type, 0) for b in mesh.cells])


def _add(case: Case, mesh: meshio.Mesh, selection: Selection) -> None:
    names = {*mesh.cell_sets, *mesh.point_sets} - {_OUTER}
    for group in selection.groups:
        if group not in names:
            allowed = f"no such group in the mesh; {hint(group, names)}"
            if any(other.name == group for other in case.mesh.selections):
                allowed = "is made after it: list that group first"
            raise InputError(case.path, selection.key, group, allowed)
    if selection.of == "groups":
        _add_union(mesh, selection)
        return
    near = _near(case, mesh, selection) & _within(mesh, selection.groups)
    if selection.of == "nodes":
        mesh.point_sets[selection.name] = np.flatnonzero(near)
        found = int(near.sum())
    else:
        dim = mesh.points.shape[1] - (selection.of == "faces")
        outer = mesh.cell_sets.get(_OUTER, [np.empty(0, int)] * len(mesh.cells))
        parts = []
        for block, faces in zip(mesh.cells, outer, strict=True):
            chosen = near[block.data].all(axis=1) & (BY_MESHIO[block.type].dim == dim)
            if selection.of == "faces":
                chosen &= np.isin(np.arange(len(chosen)), faces)
            parts.append(np.flatnonzero(chosen))
        mesh.cell_sets[selection.name] = parts
        found = sum(map(len, parts))
    if not found:
        allowed = f"no {selection.of} of the mesh are there"
        raise InputError(case.path, selection.key, selection.name, allowed)


def _add_union(mesh: meshio.Mesh, selection: Selection) -> None:
    cells = [mesh.cell_sets[g] for g in selection.groups if g in mesh.cell_sets]
    nodes = [mesh.point_sets[g] for g in selection.groups if g in mesh.point_sets]
    if cells:
        parts = [np.concatenate([np.empty(0, int), *part]) for part in zip(*cells, strict=True)]
        mesh.cell_sets[selection.name] = [np.unique(part.astype(int)) for part in parts]
    if nodes:
        mesh.point_sets[selection.name] = np.unique(np.concatenate(nodes))


def _near(case: Case, mesh: meshio.Mesh, selection: Selection) -> np.ndarray:
    """The nodes (n,) of volume cells that are at the place of a selection."""
    points, values = mesh.points, selection.values
    small = _NEAR * np.ptp(points, axis=0).max()
    if selection.shape == "where":
        near = values[0](points) >= 0
    elif selection.shape == "plane":
        point, normal = map(np.array, values)
        near = np.abs((points - point) @ normal) <= small * np.linalg.norm(normal)
    elif selection.shape == "sphere":
        centre, radius = values
        near = np.abs(np.linalg.norm(points - np.array(centre), axis=1) - radius) <= small
    elif selection.shape == "box":
        low, high = map(np.array, values)
        near = ((points >= low - small) & (points <= high + small)).all(axis=1)
    else:
        distance = np.linalg.norm(points - np.array(values), axis=1)
        near = distance <= small
        _refuse_other_than_one(case, mesh, selection, near, distance)
    return near & nodes_of_volumes(mesh)


def _refuse_other_than_one(
    case: Case, mesh: meshio.Mesh, selection: Selection, near: np.ndarray, distance: np.ndarray
) -> None:
    count = int(near.sum())
    if count == 1:
        return
    allowed = f"{count} nodes are there, of surfaces that meet; name a group of one node"
    if not count:
        nearest = ", ".join(f"{x:.9g}" for x in mesh.points[distance.argmin()])
        allowed = f"no node is there; the nearest is at ({nearest}), {distance.min():.3g} away"
    raise InputError(case.path, selection.key, list(selection.values), allowed)


def _within(mesh: meshio.Mesh, groups: tuple[str, ...]) -> np.ndarray:
    """The nodes (n,) of the volume cells of any of the groups; all nodes without groups."""
    if not groups:
        return np.ones(len(mesh.points), dtype=bool)
    return np.logical_or.reduce([nodes_of_volumes(mesh, group) for group in groups])


# No group of a mesh file has a name that is not printable.
_OUTER = "\n"


def _with_outer_faces(mesh: meshio.Mesh) -> meshio.Mesh:
    """The mesh with all faces that one volume cell alone has, in the group `_OUTER`."""
    cells = {block.type: block.data for block in mesh.cells}
    sets = {name: list(parts) for name, parts in mesh.cell_sets.items()}
    outer = {name: np.empty(0, dtype=int) for name in cells}
    for kind, nodes in outer_faces(volume_cells(mesh).items()):
        name = BY_NAME[kind].meshio
        if name not in cells:
            cells[name] = np.empty((0, nodes.shape[1]), dtype=nodes.dtype)
            for parts in sets.values():
                parts.append(np.empty(0, dtype=int))
        cells[name], outer[name] = _put(cells[name], nodes)
    sets[_OUTER] = list(outer.values())
    return meshio.Mesh(mesh.points, list(cells.items()), cell_sets=sets, point_sets=mesh.point_sets)


def _put(block: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A block of faces with the `faces` (n, nodes) that it lacks, and the places (n,) of all."""
    both = np.concatenate([block, faces])
    _, first, same = np.unique(
        np.sort(both, axis=1), axis=0, return_index=True, return_inverse=True
    )
    place = first[same.ravel()[len(block) :]]
    new = place >= len(block)
    place[new] = len(block) + np.arange(int(new.sum()))
    return np.concatenate([block, faces[new]]), place
