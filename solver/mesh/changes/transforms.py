"""What a case file's `transform:` does to a mesh: keys applied in the order in which they stand.

scale: 1.0e-3                       # by one positive number
stretch: [1, 1, 10]                 # by one along each axis
rotate: 30                          # degrees, in the plane; in 3D {axis: [1, 1, 0], angle: 30}
translate: [100, 0, 0]
perturb: {amplitude: 0.2, seed: 1}  # random moves, as a share of the shortest edge at each
                                    # node; with `group`, of the nodes of that group alone
renumber: 1                         # a seed: another order of the nodes and of the cells
shift: {group: top, by: [0, 0.1]}   # the nodes of a group's cells
turn: {group: top, angle: 1.0e-9}   # degrees, about the last axis; see `parts.turned`
pick: {from: bottom_contact, low: [0, -1], high: [0.5, 1], name: corner, rest: others}
                                    # two groups of a group's cells, by the place of their
                                    # nodes; or a list of such
"""

from collections.abc import Callable, Mapping
from typing import Any

import meshio
import numpy as np

from ...system.errors import InputError
from ..keys import LARGEST, Keys
from . import parts
from .perturb import perturbed


def transform(mesh: meshio.Mesh, spec: Mapping[str, Any], where: str) -> meshio.Mesh:
    """The mesh changed as `spec` says; the one given stays as it is.

    `where` names the case file in the InputError that an unknown key or a wrong value raises.
    """
    keys = Keys(spec, where, "transform")
    for key in spec:
        mesh = _STEPS[keys.known(key, _STEPS)](mesh, key, keys)
    if not (np.abs(mesh.points) <= LARGEST).all():
        raise InputError(where, "transform", None, f"moves nodes farther than {LARGEST:g}")
    return mesh


def _moved(mesh: meshio.Mesh, points: np.ndarray) -> meshio.Mesh:
    return meshio.Mesh(points, mesh.cells, cell_sets=mesh.cell_sets, point_sets=mesh.point_sets)


def _scale(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    return _moved(mesh, mesh.points * keys.numbers(key, 1)[0])


def _stretch(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    return _moved(mesh, mesh.points * keys.numbers(key, mesh.points.shape[1]))


def _translate(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    return _moved(mesh, mesh.points + keys.vector(key, mesh.points.shape[1]))


def _rotate(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    if mesh.points.shape[1] == 2:
        cos, sin = _cos_sin(keys.number(key))
        return _moved(mesh, mesh.points @ np.array([[cos, sin], [-sin, cos]]))
    section = keys.section(key, "{axis: [x, y, z], angle: degrees}")
    axis = np.array(section.vector("axis", 3))
    length = np.linalg.norm(axis)
    if length == 0:
        raise section.refuse("axis", axis.tolist(), "must not be zero")
    cos, sin = _cos_sin(section.number("angle"))
    section.finish()
    axis /= length
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


def _renumber(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    section = keys.one_or_section(key, "seed")
    rng = np.random.default_rng(section.integers("seed", 1, least=0)[0])
    section.finish()
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


def _perturb(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    section = keys.one_or_section(key, "amplitude")
    amplitude = section.numbers("amplitude", 1)[0]
    seed = section.integers("seed", 1, [0], least=0)[0]
    chosen = parts.nodes_of(mesh, section) if section.given("group") else None
    section.finish()
    points = perturbed(mesh, amplitude, seed, chosen)
    if points is None:
        raise section.refuse("amplitude", amplitude, "folds cells over: must be smaller")
    return _moved(mesh, points)


def _shift(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    section = keys.section(key, "{group: name, by: vector}")
    chosen, by = parts.nodes_of(mesh, section), section.vector("by", mesh.points.shape[1])
    section.finish()
    return _moved(mesh, mesh.points + chosen[:, None] * np.array(by))


def _turn(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    section = keys.section(key, "{group: name, angle: degrees}")
    chosen, angle = parts.nodes_of(mesh, section), section.number("angle")
    section.finish()
    points = parts.turned(mesh, chosen, np.radians(angle))
    if points is None:
        raise section.refuse("angle", angle, "folds cells over: must be smaller")
    return _moved(mesh, points)


def _pick(mesh: meshio.Mesh, key: str, keys: Keys) -> meshio.Mesh:
    for section in keys.sections(key, "{from: group, low: vector, high: vector, name: new group}"):
        mesh = _picked(mesh, section)
    return mesh


def _picked(mesh: meshio.Mesh, section: Keys) -> meshio.Mesh:
    members = parts.cells_of(mesh, section, "from")
    low, high = (np.array(section.vector(k, mesh.points.shape[1])) for k in ("low", "high"))
    inside, outside = parts.picked(mesh, members, low, high)
    sets = {section.text("name"): inside}
    if section.given("rest"):
        sets[section.text("rest")] = outside
    section.finish()
    sets = {**mesh.cell_sets, **sets}
    return meshio.Mesh(mesh.points, mesh.cells, cell_sets=sets, point_sets=mesh.point_sets)


_STEPS: dict[str, Callable[[meshio.Mesh, str, Keys], meshio.Mesh]] = {
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
