"""Where the probes of a case are: the cells and the faces at their places.

All raise InputError for a point outside of what it is asked of, or in two bodies at once.
"""

import numpy as np

from ...lac.cells.shape import shape_functions
from ...mechanics.fem.locate import Located, locate
from ...system.errors import InputError
from .scene import Scene

# A point is in a body, and in two of them, to this share of the model's length; and on a contact
# surface, which its faces only approximate, to the second.
_NEAR, _ON_SURFACE = 1e-6, 1e-2


def places_of(scene: Scene, name: str) -> np.ndarray:
    """The local places (k, dim) of a probe: a point, or the nodes of a group."""
    probe = scene.case.probes[name]
    return (
        scene.points[scene.named.probed[name]]
        if probe.group
        else np.array([probe.at]) - scene.coordinates.origin
    )


def cell_at(scene: Scene, name: str) -> tuple[np.ndarray, np.ndarray]:
    """The nodes (n,) of the cell that holds the point of a probe, and their shares (n,) in it."""
    probe, blocks = scene.case.probes[name], list(scene.mesh.cells.items())
    if probe.within:
        given = scene.given.groups[probe.within]
        blocks = [(kind, cells[scene.mesh.members(kind, given)]) for kind, cells in blocks]
    found = locate(scene.points, blocks, places_of(scene, name))
    inside = found[found.distance <= _NEAR * scene.coordinates.length]
    if not len(inside.place):
        allowed = f"no cell is there; the nearest is {found.distance[0]:.3g} away"
        raise _refusal(scene, name, allowed)
    cells = [blocks[b][1][n] for b, n in zip(inside.block, inside.number, strict=True)]
    if len({scene.body[nodes[0]] for nodes in cells}) > 1:
        raise _refusal(scene, name, "bodies meet there; name the cells of one of them (within)")
    shape = shape_functions(blocks[inside.block[0]][0])
    return cells[0], shape.values(inside.reference[:1])[0]


def faces_at(scene: Scene, name: str, faces: list[tuple[str, np.ndarray]]) -> Located:
    """The slave face, of those of its zone, that is nearest to each place of a probe."""
    found = locate(scene.points, faces, places_of(scene, name)).nearest
    away = found.distance[found.distance > _ON_SURFACE * scene.coordinates.length]
    if len(away):
        zone = scene.case.probes[name].zone
        raise _refusal(scene, name, f"is {away[0]:.3g} from the slave surface of {zone}")
    return found


def _refusal(scene: Scene, name: str, allowed: str) -> InputError:
    probe = scene.case.probes[name]
    key = f"probes.{name}.{'group' if probe.group else 'at'}"
    return InputError(scene.case.path, key, probe.group or list(probe.at or ()), allowed)
