"""Where the probes of a case are: the cells and the faces at their places."""

from collections.abc import Iterable

import numpy as np

from ...case.acting import Probe
from ...mechanics.fem.locate import Located, locate
from .scene import Scene

# A point is in a body, and in two of them, to this share of the model's length.
_NEAR = 1e-6


def place_of(scene: Scene, probe: Probe) -> np.ndarray:
    """The local place (dim,) of a point."""
    return np.array(probe.at) - scene.origin


def nearest_cells(scene: Scene, probe: Probe) -> list[Located]:
    """The cells at or near the point of a probe, of those that it names; the nearest first."""
    blocks = list(scene.mesh.cells.items())
    if probe.within:
        given = scene.given.groups[probe.within]
        blocks = [(name, cells[scene.mesh.members(name, given)]) for name, cells in blocks]
    return locate(scene.points, blocks, place_of(scene, probe))


def cells_at(scene: Scene, probe: Probe) -> list[Located]:
    """Those of them that hold it."""
    near = nearest_cells(scene, probe)
    return [one for one in near if one.distance <= _NEAR * scene.length]


def face_at(
    scene: Scene, faces: Iterable[tuple[str, np.ndarray, np.ndarray]], place: np.ndarray
) -> Located:
    """The face of a zone that is nearest to a local place (dim,)."""
    return locate(scene.points, [(name, nodes) for name, nodes, _ in faces], place)[0]
