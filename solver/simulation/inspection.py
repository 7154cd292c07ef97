"""What a mesh file contains, for someone who writes a case on it: groups, sizes, gaps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import meshio
import numpy as np

from ..lac.cells.catalogue import BY_MESHIO
from ..lac.facets import facets
from ..lac.operator import meet_in_segments
from ..lac.surface_points import face_samples
from ..mechanics.fem.faces import FaceError, boundary_faces
from ..system.errors import InputError, hint


@dataclass(frozen=True, kw_only=True)
class Group:
    """A group of a mesh, or all its cells.

    `cells`: their number by type; `nodes`: how many there are; `low`, `high` (dim,): corners of the
    box around them; `size`: smallest, mean and largest length of the cells' edges between
    vertices, 0 for a group of nodes.
    """

    name: str
    cells: dict[str, int]
    nodes: int
    low: np.ndarray
    high: np.ndarray
    size: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The gap of a surface to another one, along its normals, negative where they overlap.

    `covered`: the share of its area that the other one faces.
    """

    smallest: float
    mean: float
    largest: float
    covered: float


def groups_of(mesh: meshio.Mesh) -> Iterator[Group]:
    """All cells of the mesh's dimension, as a group without a name, then the mesh's groups."""
    dim = mesh.points.shape[1]
    whole = [np.arange(len(b.data)) if b.dim == dim else np.empty(0, int) for b in mesh.cells]
    for name, parts in {"": whole, **mesh.cell_sets}.items():
        blocks = [
            (BY_MESHIO[block.type], block.data[np.asarray(part, dtype=int)])
            for block, part in zip(mesh.cells, parts, strict=True)
            if len(part)
        ]
        nodes = [np.empty(0, dtype=int), *(data.ravel() for _, data in blocks)]
        edges = [mesh.points[data[:, np.array(kind.edges)]] for kind, data in blocks]
        counts = {kind.name: len(data) for kind, data in blocks}
        yield _group(mesh, name, counts, np.concatenate(nodes), edges)
    for name, chosen in mesh.point_sets.items():
        yield _group(mesh, name, {}, np.asarray(chosen, dtype=int), [])


def _group(
    mesh: meshio.Mesh, name: str, cells: dict[str, int], nodes: np.ndarray, edges: list[np.ndarray]
) -> Group:
    """A group from its nodes and its cells' edges (n, edges, 2, dim) by type."""
    nodes = np.unique(nodes)
    points = mesh.points[nodes] if len(nodes) else np.full((1, mesh.points.shape[1]), np.nan)
    # Coordinates of round-off are shown as zeros.
    points = np.where(np.abs(points) > 1e-12 * np.abs(mesh.points).max(), points, 0.0)
    sizes = [np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).ravel() for ends in edges]
    size = np.concatenate(sizes) if sizes else np.zeros(1)
    return Group(
        name=name,
        cells=cells,
        nodes=len(nodes),
        low=points.min(axis=0),
        high=points.max(axis=0),
        size=(float(size.min()), float(size.mean()), float(size.max())),
    )


def gap_between(mesh: meshio.Mesh, names: Sequence[str], path: object) -> Gap:
    """The gap that contact begins with between the two named groups of faces, the slave first.

    Raises InputError, naming the file `path`, for a group that is unknown or no outer surface, and
    where the surfaces do not face each other.
    """
    sides = []
    for name in names:
        if name not in mesh.cell_sets:
            raise InputError(path, "gap", name, f"no such group; {hint(name, mesh.cell_sets)}")
        try:
            blocks = boundary_faces(mesh, name)
        except FaceError as error:
            raise InputError(path, "gap", name, str(error)) from None
        sides.append([facets(mesh.points, b.type, b.nodes, b.number) for b in blocks])
    reach = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    found = meet_in_segments(sides[0], [], sides[1], reach)
    weight = np.concatenate([np.empty(0), *(segments.weight.ravel() for segments in found)])
    gap = np.concatenate([np.empty(0), *(segments.gap.ravel() for segments in found)])
    if not weight.sum() > 0:
        raise InputError(path, "gap", ", ".join(names), "the surfaces do not face each other")
    area = sum(sample.weight.sum() for sample in face_samples(sides[0]))
    return Gap(
        smallest=float(gap.min()),
        mean=float(weight @ gap / weight.sum()),
        largest=float(gap.max()),
        covered=float(weight.sum() / area),
    )
