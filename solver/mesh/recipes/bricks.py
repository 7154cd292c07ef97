"""The recipe `bricks`: bodies put together from rectangular blocks, anywhere.

    recipe: bricks      # an L-shaped seat of three bricks, and a block in its corner
    bricks:
      - {name: seat, low: [-1, -1], high: [0, 0], block: {cells: QUAD4, divisions: [2, 2]}}
      - {name: seat, low: [0, -1], high: [2, 0], block: {cells: QUAD4, divisions: [4, 2]}}
      - {name: seat, low: [-1, 0], high: [0, 1], block: {cells: QUAD4, divisions: [2, 2]}}
      - {name: block, low: [0, 0], high: [2, 1], block: {cells: TRIA6, divisions: [3, 2]}}

`block` has the keys of a block in the recipe `blocks`. Bricks of one name are one body: where they
touch, their nodes must be the same, and become one. Each name is a group of cells; the key `groups`
of the case file selects faces. `refine` multiplies all divisions.
"""

from itertools import combinations

import meshio
import numpy as np
from scipy.spatial import cKDTree

from ...case.typed import FieldError
from ..keys import BrickKeys, BricksKeys
from .blocks import block, joined

# Nodes nearer than this share of the extent of all bricks are at one place.
_ONE_PLACE = 1e-9


def bricks(recipe: BricksKeys) -> meshio.Mesh:
    """The bodies; bodies of different names share no nodes."""
    meshes = [_brick(brick, recipe.refine) for brick in recipe.bricks]
    mesh, dim = joined(meshes), len(recipe.bricks[0].low)
    owner = np.repeat(np.arange(len(meshes)), [len(m.points) for m in meshes])
    near = _ONE_PLACE * float(np.ptp(mesh.points, axis=0).max())
    number = np.arange(len(mesh.points))
    for i, j in combinations(range(len(meshes)), 2):
        one, other = recipe.bricks[i], recipe.bricks[j]
        if one.name == other.name:
            pair = _common(mesh.points[:, :dim], owner, (i, j), (one, other), near)
            if pair is None:
                problem = f"has other nodes than bricks[{i}] of the same body, where they touch"
                raise FieldError(("bricks", j), problem)
            number[pair[1]] = number[pair[0]]
    cells = [(b.type, number[b.data]) for b in mesh.cells]
    return meshio.Mesh(mesh.points, cells, cell_sets=mesh.cell_sets)


def _brick(brick: BrickKeys, refine: int) -> meshio.Mesh:
    low, high = np.array(brick.low, dtype=float), np.array(brick.high, dtype=float)
    mesh = block("top", brick.block, low, high - low, refine)
    mesh.cell_sets = {brick.name: mesh.cell_sets["top"]}
    return mesh


def _common(
    points: np.ndarray,
    owner: np.ndarray,
    numbers: tuple[int, int],
    pair: tuple[BrickKeys, BrickKeys],
    near: float,
) -> tuple[np.ndarray, np.ndarray] | None:
    """The nodes (k,) of either brick that both hold, in one order; None where they differ."""
    low, high = (np.array([getattr(b, key) for b in pair]) for key in ("low", "high"))
    within = ((points >= low.max(axis=0) - near) & (points <= high.min(axis=0) + near)).all(axis=1)
    both = [np.flatnonzero(within & (owner == number)) for number in numbers]
    if len(both[0]) != len(both[1]):
        return None
    if not len(both[0]):
        return both[0], both[1]
    distance, nearest = cKDTree(points[both[0]]).query(points[both[1]])
    return (both[0][nearest], both[1]) if distance.max() <= near else None
