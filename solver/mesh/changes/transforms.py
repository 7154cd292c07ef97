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
"""

from collections.abc import Callable, Mapping
from typing import Any

import meshio
import numpy as np

from ...case.file import Perturbation, Pick, Renumbering, Rotation, Shift, Transform, Turn
from ...case.typed import FieldError, read_as
from ...system.errors import InputError, key_path
from ..keys import LARGEST
from .parts import cells_of, nodes_of, picked, turned
from .perturb import perturbed


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
        cos, sin = _cos_sin(turn)
        return _moved(mesh, mesh.points @ np.array([[cos, sin], [-sin, cos]]))
    if not isinstance(turn, Rotation):
        raise FieldError((), "must be {axis: [x, y, z], angle: degrees} in 3D", value=turn)
    length = np.linalg.norm(turn.axis)
    if length == 0:
        raise FieldError(("axis",), "must not be zero", value=list(turn.axis))
    cos, sin = _cos_sin(turn.angle)
    axis = np.array(turn.axis) / length
    # Rodrigues' formula.
    across = np.cross(axis, mesh.points)
    along = np.outer(mesh.points @ axis, axis)
    return _moved(mesh, mesh.points * cos + across * sin + along * (1 - cos))


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Cosine and sine, exact for quarter turns."""
    quarters, rest = divmod(degrees, 90)
    cos, sin = float(np.cos(np.radians(rest))), float(np.sin(np.radians(rest)))
    for _ in range(int(quarters) % 4):
        cos, sin = -sin, cos
    return cos, sin


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
