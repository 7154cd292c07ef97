"""Steps of `transform:` that work on a part of the mesh: its nodes and cells by group."""

import meshio
import numpy as np

from ...case.typed import FieldError
from .perturb import stepped


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
