"""A plane problem as one layer of cells in space, its displacement along z fixed: plane strain.

Codes whose contact works in space alone solve plane cases in this way. The nodes of the plane mesh
keep their numbers in the lower face of the layer.
"""

from dataclasses import replace
from functools import cache

import meshio
import numpy as np
from msgspec import structs

from ..case.acting import Load, Support
from ..case.model import Case
from ..case.solutions.base import ExactSolution, Part
from ..lac.cells.catalogue import BY_MESHIO, BY_NAME, CellType

LAYER = "whole layer"


def as_layer(case: Case, mesh: meshio.Mesh) -> tuple[Case, meshio.Mesh]:
    """The plane case and its mesh (n, 2) as a case in space; loads are those per unit of depth.

    The layer is about as thick as a cell is wide.
    """
    n = len(mesh.points)
    cells = [(b.type, b.data) for b in mesh.cells]
    count = sum(len(data) for name, data in cells if BY_MESHIO[name].dim == 2)
    thickness = float(np.sqrt(np.ptp(mesh.points, axis=0).prod() / count))
    kinds = [(BY_MESHIO[name], data) for name, data in cells]
    raised = [(kind.layer.meshio, _raise(kind, data, n)) for kind, data in kinds]
    used = np.zeros(3 * n, dtype=bool)
    used[: 2 * n] = True
    for name, data in raised:
        if BY_MESHIO[name].dim == 3:
            used[data.ravel()] = True
    number = np.cumsum(used) - 1
    # Lower face, upper face, and the nodes half way between them.
    heights = np.repeat([0.0, thickness, thickness / 2], n)
    points = np.column_stack([np.tile(mesh.points, (3, 1)), heights])[used]
    volumes = [BY_MESHIO[name].dim == 3 for name, _ in raised]
    whole = [np.arange(len(data) * v) for (_, data), v in zip(raised, volumes, strict=True)]
    layer = meshio.Mesh(
        points,
        [(name, number[data]) for name, data in raised],
        cell_sets={**mesh.cell_sets, LAYER: whole},
        point_sets={g: np.concatenate([p, p + n]) for g, p in mesh.point_sets.items()},
    )
    return _in_space(case, thickness), layer


def _in_space(case: Case, thickness: float) -> Case:
    held = (*case.supports, Support(group=LAYER, fix={"z": 0.0}))
    exact = case.reference.exact and _Plane(case.reference.exact)
    loads = tuple(_lifted(load, thickness) for load in case.loads)
    return replace(case, plane=None, supports=held, loads=loads).with_exact(exact)


def _lifted(load: Load, thickness: float) -> Load:
    if not isinstance(load.value, tuple):
        return load
    # A force is one per unit of depth.
    depth = thickness if load.kind == "force" else 1.0
    value = tuple(v * depth if isinstance(v, float) else v for v in load.value)
    return structs.replace(load, **{load.kind: (*value, 0.0)})


class _Plane(ExactSolution):
    """A plane solution at points in space."""

    def __init__(self, plane: ExactSolution):
        self.plane = plane

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        return np.pad(self.plane.displacement(x[:, :2], part), ((0, 0), (0, 1)))

    def body_force(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        return np.pad(self.plane.body_force(x[:, :2], part), ((0, 0), (0, 1)))

    def stress(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        return self.plane.stress(x[:, :2], part)

    def body_part(self, nodes: np.ndarray) -> int:
        return self.plane.body_part(nodes[:, :2])


def _raise(kind: CellType, data: np.ndarray, n: int) -> np.ndarray:
    """The cells over plane ones (m, nodes); node i is in the faces as i and n + i, else 2 n + i."""
    nodes = [data[:, node] + n * level for node, level in columns(kind.name)]
    return np.stack(nodes, axis=1)


@cache
def columns(name: str) -> list[tuple[int, int]]:
    """For each node of the raised cell: the plane cell's node, and 0 below, 1 above, 2 between."""
    plane, raised = BY_NAME[name], BY_NAME[name].layer
    own = {frozenset(owners): i for i, owners in enumerate(plane.owners)}
    if plane.dim == 1:
        # Around the face: along the line, up, back, down.
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    else:
        corners = [(i % plane.n_vertices, i // plane.n_vertices) for i in range(raised.n_vertices)]
    found = []
    for owners in raised.owners:
        below = frozenset(corners[i][0] for i in owners)
        levels = {corners[i][1] for i in owners}
        found.append((own[below], levels.pop() if len(levels) == 1 else 2))
    return found
