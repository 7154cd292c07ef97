"""The key `transform:` of a case file: changes of the mesh, applied in the order of the keys.

scale: 1.0e-3                       # by one positive number
stretch: [1, 1, 10]                 # by one along each axis
rotate: 30                          # degrees, in the plane; in 3D {axis: [1, 1, 0], angle: 30}
translate: [100, 0, 0]
perturb: {amplitude: 0.2, seed: 1}  # random moves, as a share of the shortest edge at each
                                    # node; with `group`, of the nodes of that group alone
renumber: 1                         # a seed: another order of the nodes and of the cells
shift: {group: top, by: [0, 0.1]}   # the nodes of a group's cells
turn: {group: top, angle: 1.0e-9}   # degrees, about the last axis; see `turned`
pick: {from: bottom_contact, low: [0, -1], high: [0.5, 1], name: corner, rest: others}
                                    # two groups of a group's cells, by the place of their
                                    # nodes; or a list of such

Random moves keep plane sides plane and edges straight: nodes on a plane side move in it, nodes on
an edge of the body along it, its corners and the nodes of curved sides stay, and mid-nodes go with
the vertices they lie between.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import meshio
import numpy as np

from ..case.file import Perturbation, Pick, Renumbering, Rotation, Shift, Transform, Turn
from ..case.typed import FieldError, read_as
from ..lac.cells.catalogue import CellType, cell_type
from ..lac.cells.faces import outer_faces, right_side_out
from ..system.errors import InputError, key_path
from .keys import LARGEST

_Volumes = list[tuple[CellType, np.ndarray]]
# Squared sine of the angle below which two faces are of one plane.
_ONE_PLANE = 1e-12


def perturbed(
    mesh: meshio.Mesh, amplitude: float, seed: int, chosen: np.ndarray | None = None
) -> np.ndarray | None:
    """The points (n, dim) moved by at most `amplitude` of the shortest edge at each.

    Only those `chosen` (n,), where given. None where a cell is folded over by it.
    """
    points, dim = np.asarray(mesh.points, dtype=float), mesh.points.shape[1]
    volumes = _volumes(mesh)
    step = np.random.default_rng(seed).uniform(-1, 1, points.shape) / np.sqrt(dim)
    step *= amplitude * _shortest_edges(points, volumes)[:, None]
    step = np.einsum("nij,nj->ni", _freedom(points, volumes), step)
    if chosen is not None:
        step[~chosen] = 0.0
    return stepped(mesh, step)


def stepped(mesh: meshio.Mesh, step: np.ndarray) -> np.ndarray | None:
    """The points (n, dim) with the vertices moved by `step`, mid-nodes going with them.

    None where a cell is folded over by it.
    """
    volumes, step = _volumes(mesh), step.copy()
    for cell, nodes in volumes:
        cell.put_between(step, nodes)
    moved = mesh.points + step
    return None if any(_folded(moved, nodes, cell) for cell, nodes in volumes) else moved


def _volumes(mesh: meshio.Mesh) -> _Volumes:
    dim = mesh.points.shape[1]
    return [(c, b.data) for b in mesh.cells if (c := cell_type(b.type)).dim == dim]


def _folded(points: np.ndarray, nodes: np.ndarray, cell: CellType) -> bool:
    turned, bad = right_side_out(np.asarray(points, dtype=float), nodes, cell)
    return bool(bad.any() or (turned != nodes).any())


def _shortest_edges(points: np.ndarray, volumes: _Volumes) -> np.ndarray:
    shortest = np.full(len(points), np.inf)
    for cell, nodes in volumes:
        for edge in cell.edges:
            ends = nodes[:, edge]
            length = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
            np.minimum.at(shortest, ends, length[:, None])
    return np.where(np.isfinite(shortest), shortest, 0)


def _freedom(points: np.ndarray, volumes: _Volumes) -> np.ndarray:
    """For each node the projector (n, dim, dim) on the directions in which the sides let it go."""
    dim = points.shape[1]
    spread = np.zeros((len(points), dim, dim))
    for kind, nodes in outer_faces((cell.name, nodes) for cell, nodes in volumes):
        corners = nodes[:, : cell_type(kind).n_vertices]
        normals = _normals(points[corners])
        np.add.at(spread, corners, (normals[:, :, None] * normals[:, None, :])[:, None])
    strength, directions = np.linalg.eigh(spread)
    free = strength <= _ONE_PLANE * np.maximum(strength.max(axis=1, keepdims=True), 1)
    return np.einsum("nik,nk,njk->nij", directions, free, directions)


def _normals(corners: np.ndarray) -> np.ndarray:
    """Unit normals (n, dim) of faces by their corners (n, n_corners, dim)."""
    if corners.shape[2] == 2:
        tangent = corners[:, 1] - corners[:, 0]
        normals = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    else:
        normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def cells_of(
    mesh: meshio.Mesh, group: str | tuple[str, ...], key: str = "group"
) -> list[np.ndarray]:
    """The numbers of the cells, block by block, of a group or of several.

    FieldError names the `key`.
    """
    if not isinstance(group, str):
        of_each = [cells_of(mesh, one, key) for one in group]
        return [np.unique(np.concatenate(parts)) for parts in zip(*of_each, strict=True)]
    if group not in mesh.cell_sets:
        problem = f"no such group; there are {', '.join(mesh.cell_sets)}"
        raise FieldError((key,), problem, value=group)
    none = np.empty(0, dtype=int)
    return [none if i is None else np.asarray(i, dtype=int) for i in mesh.cell_sets[group]]


def nodes_of(mesh: meshio.Mesh, group: str | tuple[str, ...]) -> np.ndarray:
    """Which nodes (n,) belong to the cells of a group or of several."""
    chosen = np.zeros(len(mesh.points), dtype=bool)
    for block, numbers in zip(mesh.cells, cells_of(mesh, group), strict=True):
        chosen[block.data[numbers].ravel()] = True
    return chosen


def turned(mesh: meshio.Mesh, chosen: np.ndarray, angle: float) -> np.ndarray | None:
    """The points (n, dim), the chosen ones turned by an angle in the middle and less outwards.

    In 3D about the last axis, with no turn at the lateral sides, so that these stay plane; in 2D
    the same moves are along x alone. Mid-nodes stay on straight edges. None where a cell folds.
    """
    lateral = mesh.points[:, :-1]
    low, high = lateral[chosen].min(axis=0), lateral[chosen].max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    arm = lateral - middle
    fading = angle * np.prod(1 - (arm / half) ** 2, axis=1) * chosen
    step = np.zeros_like(mesh.points)
    if lateral.shape[1] == 1:
        step[:, 0] = fading * half[0]
    else:
        x, y = arm.T
        # 1 − cos by its half angle: a tiny turn keeps its digits.
        cos_less_one, sin = -2 * np.sin(fading / 2) ** 2, np.sin(fading)
        step[:, 0], step[:, 1] = x * cos_less_one - y * sin, x * sin + y * cos_less_one
    return stepped(mesh, step)


def picked(
    mesh: meshio.Mesh, members: list[np.ndarray], low: np.ndarray, high: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The cells whose nodes have their mean between `low` and `high` (dim,), and the others."""
    inside, outside = [], []
    for block, numbers in zip(mesh.cells, members, strict=True):
        centre = mesh.points[block.data[numbers]].mean(axis=1)
        within = ((centre > low) & (centre < high)).all(axis=1)
        inside.append(numbers[within])
        outside.append(numbers[~within])
    return inside, outside


def transform(mesh: meshio.Mesh, spec: Mapping[str, Any], where: str) -> meshio.Mesh:
    """The mesh changed as `spec` says; the one given stays as it is.

    `where` names the case file in the InputError that an unknown key or a wrong value raises.
    """
    given = read_as(Transform, dict(spec), where, "transform")
    for key in spec:
        try:
            mesh = _STEPS[key](mesh, getattr(given, key))
        except FieldError as fault:
            path = key_path(("transform", key, *fault.keys))
            raise InputError(where, path, fault.value, fault.problem) from None
    if not (np.abs(mesh.points) <= LARGEST).all():
        raise InputError(where, "transform", None, f"moves nodes farther than {LARGEST:g}")
    return mesh


def _moved(mesh: meshio.Mesh, points: np.ndarray) -> meshio.Mesh:
    return meshio.Mesh(points, mesh.cells, cell_sets=mesh.cell_sets, point_sets=mesh.point_sets)


def _vector(mesh: meshio.Mesh, values: tuple[float, ...], *keys: str) -> np.ndarray:
    """Values as a vector (dim,) of the mesh's dimension."""
    dim = mesh.points.shape[1]
    if len(values) != dim:
        raise FieldError(keys, f"must be a list of {dim} numbers", value=list(values))
    return np.array(values)


def _scale(mesh: meshio.Mesh, factor: float) -> meshio.Mesh:
    return _moved(mesh, mesh.points * factor)


def _stretch(mesh: meshio.Mesh, factors: tuple[float, ...]) -> meshio.Mesh:
    return _moved(mesh, mesh.points * _vector(mesh, factors))


def _translate(mesh: meshio.Mesh, by: tuple[float, ...]) -> meshio.Mesh:
    return _moved(mesh, mesh.points + _vector(mesh, by))


def _rotate(mesh: meshio.Mesh, turn: float | Rotation) -> meshio.Mesh:
    if mesh.points.shape[1] == 2:
        if isinstance(turn, Rotation):
            raise FieldError((), "must be a number in 2D: the angle in degrees")
        return _moved(mesh, mesh.points @ rotation(2, turn).T)
    if not isinstance(turn, Rotation):
        raise FieldError((), "must be {axis: [x, y, z], angle: degrees} in 3D", value=turn)
    if not any(turn.axis):
        raise FieldError(("axis",), "must not be zero", value=list(turn.axis))
    return _moved(mesh, mesh.points @ rotation(3, turn.angle, turn.axis).T)


def rotation(dim: int, degrees: float, axis: Sequence[float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    """The rotation (dim, dim) by an angle; in 3D about an axis, by Rodrigues' formula.

    Quarter turns about the axes are exact.
    """
    quarters, rest = divmod(degrees, 90)
    cos, sin = float(np.cos(np.radians(rest))), float(np.sin(np.radians(rest)))
    for _ in range(int(quarters) % 4):
        cos, sin = -sin, cos
    unit = np.array([0.0, 0.0, 1.0]) if dim == 2 else np.asarray(axis) / np.linalg.norm(axis)
    whole = cos * np.eye(3) + sin * np.cross(np.eye(3), unit) + (1 - cos) * np.outer(unit, unit)
    return whole[:dim, :dim]


def _renumber(mesh: meshio.Mesh, seed: int | Renumbering) -> meshio.Mesh:
    rng = np.random.default_rng(seed.seed if isinstance(seed, Renumbering) else seed)
    order = rng.permutation(len(mesh.points))
    new = np.argsort(order)
    orders = [rng.permutation(len(block.data)) for block in mesh.cells]
    return meshio.Mesh(
        mesh.points[order],
        [(b.type, new[b.data[o]]) for b, o in zip(mesh.cells, orders, strict=True)],
        cell_sets={
            name: [np.sort(np.argsort(o)[i]) for o, i in zip(orders, ids, strict=True)]
            for name, ids in mesh.cell_sets.items()
        },
        point_sets={name: np.sort(new[ids]) for name, ids in mesh.point_sets.items()},
    )


def _perturb(mesh: meshio.Mesh, given: float | Perturbation) -> meshio.Mesh:
    full = given if isinstance(given, Perturbation) else Perturbation(given)
    chosen = None if full.group is None else nodes_of(mesh, full.group)
    points = perturbed(mesh, full.amplitude, full.seed, chosen)
    if points is None:
        problem = "folds cells over: must be smaller"
        raise FieldError(("amplitude",), problem, value=full.amplitude)
    return _moved(mesh, points)


def _shift(mesh: meshio.Mesh, shift: Shift) -> meshio.Mesh:
    chosen, by = nodes_of(mesh, shift.group), _vector(mesh, shift.by, "by")
    return _moved(mesh, mesh.points + chosen[:, None] * by)


def _turn(mesh: meshio.Mesh, turn: Turn) -> meshio.Mesh:
    chosen = nodes_of(mesh, turn.group)
    points = turned(mesh, chosen, np.radians(turn.angle))
    if points is None:
        raise FieldError(("angle",), "folds cells over: must be smaller", value=turn.angle)
    return _moved(mesh, points)


def _pick(mesh: meshio.Mesh, given: Pick | tuple[Pick, ...]) -> meshio.Mesh:
    for pick in (given,) if isinstance(given, Pick) else given:
        members = cells_of(mesh, pick.source, "from")
        low, high = _vector(mesh, pick.low, "low"), _vector(mesh, pick.high, "high")
        inside, outside = picked(mesh, members, low, high)
        sets = {**mesh.cell_sets, pick.name: inside}
        if pick.rest is not None:
            sets[pick.rest] = outside
        mesh = meshio.Mesh(mesh.points, mesh.cells, cell_sets=sets, point_sets=mesh.point_sets)
    return mesh


_STEPS: dict[str, Callable[[meshio.Mesh, Any], meshio.Mesh]] = {
    "scale": _scale,
    "stretch": _stretch,
    "rotate": _rotate,
    "translate": _translate,
    "perturb": _perturb,
    "renumber": _renumber,
    "shift": _shift,
    "turn": _turn,
    "pick": _pick,
}
