"""Recipes of blocks that are bent into shape, and of bricks that are put together.

Bent: the bodies are the two blocks of the recipe `blocks`, of edge 1. Every node is mapped, on
edges too, so that quadratic cells have their nodes on the true curve. `bottom` and `top` are
sections as in `blocks`; `refine` multiplies all divisions. The interface is the image of height 0,
and all groups are as in `blocks`.

    recipe: rings       # 2D, a quarter of two tubes: bottom inside, top outside
    radii: [20, 30, 40] # base is the bore, press the rim, symx lies on x = 0, farx on y = 0

    recipe: shells      # 3D, a sector of two spheres; symx, symy on x = 0, y = 0,
    radii: [20, 30, 40] # farx, fary on the planes x = z and y = z through the centre

    recipe: wavy        # both blocks of edge 1 with an interface that is no plane
    shape: wave         # tilt, kink, arc, wave; 3D also twist (a warped, ruled surface)
    height: 0.1

    recipe: parabola    # 2D and 3D: the top block of edge 1 stands above a parabolic die (bottom):
    height: 0.05        # interface of the die at −height · ((x − ½)² + (y − ½)²), of the block at 0

    recipe: hertz       # 2D and 3D: a parabolic body (top, of radius R) on a flat one, symmetric
    radius: 50          # about x = 0 (and y = 0), each of edge `size`. A `share` of the divisions
    size: 20            # makes even cells as far as `core`, the others grow from there on.
    core: 1.5
    share: 0.5

    recipe: punch       # 2D and 3D: a straight block on another, both from x = 0 (and y = 0) on
    bottom_size: [5, 4] # along each axis
    top_size: [8, 2]
    gap: 0.1            # between them (0); negative: they overlap
    loaded: 0.25        # where this share of `press` along x ends (1): press_left, press_right

Bricks: bodies are put together from rectangular blocks, anywhere.

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

from collections.abc import Callable
from itertools import combinations

import meshio
import numpy as np
from scipy.spatial import cKDTree

from ...case.typed import FieldError
from ...lac.cells.catalogue import cell_type
from ..keys import (
    BrickKeys,
    BricksKeys,
    HertzKeys,
    ParabolaKeys,
    PunchKeys,
    Recipe,
    RingsKeys,
    ShellsKeys,
    WavyKeys,
    each,
)
from ..transforms import nodes_of
from .blocks import block, joined, stacked

# Nodes as near as this share of the side to the place where it is divided lie on it.
_ON = 1e-9

_SHAPES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "tilt": lambda x, y: x + y / 2,
    "kink": lambda x, _: np.abs(x - 0.5),
    "arc": lambda x, y: 4 * x * (1 - x) + y * (1 - y),
    "wave": lambda x, y: np.sin(2 * x + 0.3) * np.cos(1.5 * y),
    "twist": lambda x, y: 4 * (x - 0.5) * (y - 0.5),
}


def rings(recipe: RingsKeys) -> meshio.Mesh:
    """A quarter of two nested tubes, plane."""

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        angle = np.pi / 2 * x[:, 0]
        direction = np.stack([np.sin(angle), np.cos(angle)], axis=1)
        # the straight sides stay on the axes to the bit
        direction[x[:, 0] == 1, 1] = 0.0
        return _radius(height, recipe.radii)[:, None] * direction

    return _bent(_unit(recipe), bend)


def shells(recipe: ShellsKeys) -> meshio.Mesh:
    """A sector of two nested spheres, between four planes through the centre."""

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        # Equal angles, so that mid-edge nodes come to lie near the middle of their arc.
        direction = np.column_stack([np.tan(np.pi / 4 * x[:, :2]), np.ones(len(x))])
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return _radius(height, recipe.radii)[:, None] * direction

    return _bent(_unit(recipe), bend)


def wavy(recipe: WavyKeys) -> meshio.Mesh:
    """Two blocks whose interface is tilted, kinked, curved or warped; all other sides are plane."""
    shape = _SHAPES[recipe.shape]

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        lift = recipe.height * shape(x[:, 0], _y(x)) * (1 - np.abs(height))
        return np.column_stack([x[:, :-1], height + lift])

    return _bent(_unit(recipe), bend)


def parabola(recipe: ParabolaKeys) -> meshio.Mesh:
    """A block above a parabolic die; their distance is the initial gap."""
    mesh = _unit(recipe)

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        sag = (x[:, 0] - 0.5) ** 2 + (0 if x.shape[1] == 2 else (_y(x) - 0.5) ** 2)
        return np.column_stack([x[:, :-1], height - recipe.height * sag * (1 + height)])

    return _bent(mesh, bend, ~nodes_of(mesh, "top"))


def hertz(recipe: HertzKeys) -> meshio.Mesh:
    """A parabolic body on a flat one, their cells even around the point of contact."""
    mesh, size = _unit(recipe), recipe.size
    x = mesh.points
    graded = np.sign(x) * _graded(np.abs(x), size, recipe.core, recipe.share)
    mesh.points = _straightened(graded, mesh.cells)

    def risen(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        rise = (x[:, :-1] ** 2).sum(axis=1) / (2 * recipe.radius)
        return np.column_stack([x[:, :-1], height + rise * (1 - height / size)])

    return _bent(mesh, risen, nodes_of(mesh, "top"))


def _graded(x: np.ndarray, size: float, core: float, share: float) -> np.ndarray:
    """Places in [0, size] of positions in [0, 1]: even up to `core`, then growing like sinh.

    The step is continuous where the even part ends.
    """
    rest = size - core
    start = core / share * (1 - share) / rest
    from scipy.optimize import brentq

    growth = brentq(lambda g: g / np.sinh(g) - start, 1e-9, 700)
    beyond = np.maximum(x - share, 0) / (1 - share)
    grown = core + rest * np.sinh(growth * beyond) / np.sinh(growth)
    return np.where(x <= share, x / share * core, grown)


def punch(recipe: PunchKeys) -> meshio.Mesh:
    """Two straight blocks of their own sizes, with a gap or an overlap, the upper top divided."""
    mesh, dim = _unit(recipe), recipe.dim
    bottom = np.array(each(recipe.bottom_size, dim, "bottom_size"))
    top = np.array(each(recipe.top_size, dim, "top_size"))
    upper = nodes_of(mesh, "top")
    placed = _bent(
        _bent(mesh, lambda x, _: x * bottom, ~upper),
        lambda x, _: x * top + recipe.gap * (np.arange(dim) == dim - 1),
        upper,
    )
    placed.cell_sets |= _divided(mesh, recipe.loaded)
    return placed


def _divided(mesh: meshio.Mesh, share: float) -> dict[str, list[np.ndarray]]:
    """The sides `press_left` and `press_right` of the position x = `share`, without empty ones."""
    left, right = [], []
    for part, ids in zip(mesh.cells, mesh.cell_sets["press"], strict=True):
        members = np.asarray(ids, dtype=int)
        x = mesh.points[part.data[members], 0] - share
        low, high = x.max(axis=1, initial=-1) <= _ON, x.min(axis=1, initial=1) >= -_ON
        if not (low | high).all():
            problem = "must be a share at which faces of press end"
            raise FieldError(("loaded",), problem, value=share)
        left.append(members[low])
        right.append(members[high])
    sides = {"press_left": left, "press_right": right}
    return {name: ids for name, ids in sides.items() if sum(map(len, ids))}


Bend = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _unit(recipe: Recipe) -> meshio.Mesh:
    """The two blocks of edge 1, with as many coordinates as dimensions."""
    mesh = stacked(recipe)
    mesh.points = mesh.points[:, : recipe.dim]
    return mesh


def _bent(mesh: meshio.Mesh, bend: Bend, chosen: np.ndarray | None = None) -> meshio.Mesh:
    """The mesh with the chosen nodes (n,), or all, mapped from (points, height)."""
    points = mesh.points.copy()
    chosen = np.ones(len(points), dtype=bool) if chosen is None else chosen
    points[chosen] = bend(points[chosen], points[chosen, -1])
    return meshio.Mesh(points, mesh.cells, cell_sets=mesh.cell_sets)


def _straightened(points: np.ndarray, cells: list[meshio.CellBlock]) -> np.ndarray:
    """The points with all nodes that are no vertices in the middle of their vertices."""
    points = points.copy()
    for part in cells:
        cell_type(part.type).put_between(points, part.data)
    return points


def _y(x: np.ndarray) -> np.ndarray:
    return x[:, 1] if x.shape[1] == 3 else np.zeros(len(x))


def _radius(height: np.ndarray, radii: tuple[float, float, float]) -> np.ndarray:
    bore, interface, rim = radii
    inner, outer = interface - bore, rim - interface
    return interface + height * np.where(height < 0, inner, outer)


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
