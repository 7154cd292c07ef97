"""Faces of a group on the boundary of the bodies, with the one cell behind each; means on them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_MESHIO, CellType, cell_type
from ...lac.cells.faces import (
    FACE_POINTS,
    FaceBlock,
    SlaveFaces,
    corner_sets,
    surface_points,
    surface_vectors,
)
from ...lac.cells.shape import face_rule
from ...lac.threads import prefetch

# Of points that are handled at once.
_AT_ONCE = 1 << 15


class FaceError(Exception):
    """A group has faces that are not on the outside of a body."""


def volume_cells(mesh: meshio.Mesh) -> dict[str, np.ndarray]:
    """The cells of full dimension by type name, in the order of the mesh's blocks."""
    dim = mesh.points.shape[1]
    kinds = [(BY_MESHIO[block.type], block.data) for block in mesh.cells]
    return {kind.name: data for kind, data in kinds if kind.dim == dim}


def boundary_faces(mesh: meshio.Mesh, group: str) -> list[FaceBlock]:
    """The faces of a group, each with the one volume cell behind it.

    Raises FaceError for a face with no cell behind it, with a cell on both sides, or listed twice.
    """
    wanted = corner_sets(_group_faces(mesh, group))
    marked = np.zeros(len(mesh.points), dtype=bool)
    marked[wanted[wanted >= 0]] = True
    sides = _candidate_sides(mesh, marked)
    corners = np.concatenate([wanted] + [side.corners for side in sides])
    _, label = np.unique(corners, axis=0, return_inverse=True)
    label = label.ravel()
    place = np.full(label.max() + 1 if len(label) else 0, -1)
    place[label[: len(wanted)]] = np.arange(len(wanted))
    repeated = len(wanted) - int((place >= 0).sum())
    if repeated:
        raise FaceError(f"the group lists {repeated} of its faces twice")
    owners = np.bincount(label[len(wanted) :], minlength=len(place))[label[: len(wanted)]]
    _refuse_odd_owners(mesh, wanted, owners)
    return _match(mesh, sides, place[label[len(wanted) :]])


@dataclass(frozen=True)
class _Side:
    """One local face of all the cells of a block that may carry a face of the group."""

    owner_type: CellType
    local: int
    cells: np.ndarray
    corners: np.ndarray


def _group_faces(mesh: meshio.Mesh, group: str) -> list[np.ndarray]:
    dim = mesh.points.shape[1]
    found = []
    for block, members in zip(mesh.cells, mesh.cell_sets[group], strict=True):
        kind = BY_MESHIO[block.type]
        if kind.dim == dim - 1 and members is not None and len(members):
            found.append(block.data[np.asarray(members, dtype=int)][:, : kind.n_vertices])
    return found


def _candidate_sides(mesh: meshio.Mesh, marked: np.ndarray) -> list[_Side]:
    """The sides of volume cells all of whose corners are marked nodes."""
    sides = []
    for name, cells in volume_cells(mesh).items():
        kind = cell_type(name)
        near = np.flatnonzero(marked[cells[:, : kind.n_vertices]].any(axis=1))
        for local, face in enumerate(kind.faces):
            corner = face.nodes[: cell_type(face.type).n_vertices]
            nodes = cells[near][:, corner]
            hit = marked[nodes].all(axis=1)
            if hit.any():
                sides.append(_Side(kind, local, near[hit], corner_sets([nodes[hit]])))
    return sides


def _refuse_odd_owners(mesh: meshio.Mesh, corners: np.ndarray, owners: np.ndarray) -> None:
    for count, what in ((owners == 0, "no cell behind it"), (owners > 1, "a cell on both sides")):
        if count.any():
            first = corners[np.flatnonzero(count)[0]]
            place = mesh.points[first[first >= 0]].mean(axis=0)
            at = ", ".join(f"{x:.6g}" for x in place)
            raise FaceError(
                f"{int(count.sum())} of its faces have {what} (the first near ({at})); "
                "allowed are faces on the outside of a body; bodies in contact share no nodes"
            )


def _match(mesh: meshio.Mesh, sides: list[_Side], number: np.ndarray) -> list[FaceBlock]:
    cells = volume_cells(mesh)
    found: dict[tuple[str, str], list[tuple[np.ndarray, ...]]] = {}
    start = 0
    for side in sides:
        part = number[start : start + len(side.cells)]
        start += len(side.cells)
        hit = part >= 0
        if not hit.any():
            continue
        face = side.owner_type.faces[side.local]
        owner = side.cells[hit]
        nodes = cells[side.owner_type.name][owner][:, face.nodes]
        local = np.full(len(owner), side.local)
        key = (face.type, side.owner_type.name)
        found.setdefault(key, []).append((nodes, part[hit], owner, local))
    blocks = []
    for (face_type, owner_type), parts in found.items():
        nodes, place, owner, local = (np.concatenate(p) for p in zip(*parts, strict=True))
        order = np.argsort(place)
        blocks.append(
            FaceBlock(
                cell_type(face_type),
                nodes[order],
                place[order],
                cell_type(owner_type),
                owner[order],
                local[order],
            )
        )
    return blocks


def face_integrals(
    points: np.ndarray, nodes: np.ndarray, face_type: str, axisymmetric: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """∫ N_a n dS over each face (n, n_nodes, dim), and ∫ n dS (n, dim)."""
    reference, weights = face_rule(face_type)
    values, vectors = surface_vectors(points, nodes, face_type, reference, axisymmetric)
    vectors = vectors * weights[:, None]
    return np.einsum("qa,fqd->fad", values, vectors), vectors.sum(axis=1)


def pieces(faces: Sequence[SlaveFaces]) -> list[SlaveFaces]:
    """The same faces in blocks whose `surface_points` stay in the processor's cache."""
    count = _AT_ONCE // FACE_POINTS**2
    return [
        (name, nodes[first : first + count], owner[first : first + count])
        for name, nodes, owner in faces
        for first in range(0, len(nodes), count)
    ]


def means_on_faces(
    points: np.ndarray,
    faces: Sequence[SlaveFaces],
    values: Callable[[np.ndarray], np.ndarray],
    axisymmetric: bool = False,
) -> np.ndarray:
    """The means (c, m) over the macro-elements of a slave surface of `values` (c, k).

    These are a function of places (k, dim).
    """

    def integrals(piece: SlaveFaces) -> np.ndarray:
        at = surface_points(points, [piece], axisymmetric)
        found = np.vstack([values(at.place), np.ones(len(at.place))]) * at.weight
        return found.reshape(len(found), len(piece[2]), -1).sum(axis=2)

    by_face = np.concatenate(list(prefetch(integrals, pieces(faces))), axis=1)
    owner = np.concatenate([owner for _, _, owner in faces])
    *total, area = (np.bincount(owner, row) for row in by_face)
    return np.stack(total) / area
