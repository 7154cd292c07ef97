"""Recipes whose bodies are the two blocks of the recipe `blocks`, of edge 1, bent into shape.

Every node is mapped, mid-edge nodes too, so that quadratic cells have their nodes on the true
curve. `bottom` and `top` are sections as in `blocks`; `refine` multiplies all divisions. The
interface is the image of height 0, and all groups are those of `blocks`.

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
"""

from collections.abc import Callable

import meshio
import numpy as np

from ..catalogue import cell_type
from ..keys import Keys
from .blocks import stacked

# Nodes as near as this share of the side to the place where it is divided lie on it.
_ON = 1e-9

_SHAPES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "tilt": lambda x, y: x + y / 2,
    "kink": lambda x, _: np.abs(x - 0.5),
    "arc": lambda x, y: 4 * x * (1 - x) + y * (1 - y),
    "wave": lambda x, y: np.sin(2 * x + 0.3) * np.cos(1.5 * y),
    "twist": lambda x, y: 4 * (x - 0.5) * (y - 0.5),
}


def rings(keys: Keys) -> meshio.Mesh:
    """A quarter of two nested tubes, plane."""
    radii = _radii(keys)
    mesh = _flat(keys, 2)

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        angle = np.pi / 2 * x[:, 0]
        direction = np.stack([np.sin(angle), np.cos(angle)], axis=1)
        # the straight sides stay on the axes to the bit
        direction[x[:, 0] == 1, 1] = 0.0
        return _radius(height, radii)[:, None] * direction

    return _bent(mesh, bend)


def shells(keys: Keys) -> meshio.Mesh:
    """A sector of two nested spheres, between four planes through the centre."""
    radii = _radii(keys)
    mesh = _flat(keys, 3)

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        # Equal angles, so that mid-edge nodes come to lie near the middle of their arc.
        direction = np.column_stack([np.tan(np.pi / 4 * x[:, :2]), np.ones(len(x))])
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return _radius(height, radii)[:, None] * direction

    return _bent(mesh, bend)


def wavy(keys: Keys) -> meshio.Mesh:
    """Two blocks whose interface is tilted, kinked, curved or warped; all other sides are plane."""
    shape = _SHAPES[keys.choice("shape", _SHAPES)]
    rise = keys.number("height")
    if not abs(rise) < 0.5:
        raise keys.refuse("height", rise, "must lie between −0.5 and 0.5 (blocks of edge 1)")
    mesh = _flat(keys)

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        lift = rise * shape(x[:, 0], _y(x)) * (1 - np.abs(height))
        return np.column_stack([x[:, :-1], height + lift])

    return _bent(mesh, bend)


def parabola(keys: Keys) -> meshio.Mesh:
    """A block above a parabolic die; their distance is the initial gap."""
    depth = keys.number("height")
    mesh = _flat(keys)

    def bend(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        sag = (x[:, 0] - 0.5) ** 2 + (0 if x.shape[1] == 2 else (_y(x) - 0.5) ** 2)
        return np.column_stack([x[:, :-1], height - depth * sag * (1 + height)])

    top = _nodes(mesh, "top")
    return _bent(mesh, bend, ~top)


def hertz(keys: Keys) -> meshio.Mesh:
    """A parabolic body on a flat one, their cells even around the point of contact."""
    radius, size, core = (keys.numbers(key, 1)[0] for key in ("radius", "size", "core"))
    share = keys.numbers("share", 1)[0]
    if not core / size < share < 1:
        raise keys.refuse("share", share, f"must lie between core / size = {core / size:g} and 1")
    mesh = _flat(keys)
    x = mesh.points
    largest = 2 * radius / (x.shape[1] - 1)
    if not size < largest:
        raise keys.refuse("size", size, f"must be smaller than {largest:g}, or it folds")
    graded = np.sign(x) * _graded(np.abs(x), size, core, share)
    mesh.points = _straightened(graded, mesh.cells)

    def risen(x: np.ndarray, height: np.ndarray) -> np.ndarray:
        rise = (x[:, :-1] ** 2).sum(axis=1) / (2 * radius)
        return np.column_stack([x[:, :-1], height + rise * (1 - height / size)])

    return _bent(mesh, risen, _nodes(mesh, "top"))


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


def punch(keys: Keys) -> meshio.Mesh:
    """Two straight blocks of their own sizes, with a gap or an overlap, the upper top divided."""
    mesh = _unit(keys)
    dim = mesh.points.shape[1]
    bottom, top = (np.array(keys.numbers(key, dim)) for key in ("bottom_size", "top_size"))
    gap = keys.number("gap") if keys.given("gap") else 0.0
    loaded = keys.numbers("loaded", 1, 1.0)[0]
    if loaded > 1:
        raise keys.refuse("loaded", loaded, "must be a share of the side, at most 1")
    keys.finish()
    upper = _nodes(mesh, "top")
    placed = _bent(
        _bent(mesh, lambda x, _: x * bottom, ~upper),
        lambda x, _: x * top + gap * (np.arange(dim) == dim - 1),
        upper,
    )
    placed.cell_sets |= _divided(mesh, loaded, keys)
    return placed


def _divided(mesh: meshio.Mesh, share: float, keys: Keys) -> dict[str, list[np.ndarray]]:
    """The sides `press_left` and `press_right` of the position x = `share`, without empty ones."""
    left, right = [], []
    for block, ids in zip(mesh.cells, mesh.cell_sets["press"], strict=True):
        members = np.asarray(ids, dtype=int)
        x = mesh.points[block.data[members], 0] - share
        low, high = x.max(axis=1, initial=-1) <= _ON, x.min(axis=1, initial=1) >= -_ON
        if not (low | high).all():
            raise keys.refuse("loaded", share, "must be a share at which faces of press end")
        left.append(members[low])
        right.append(members[high])
    sides = {"press_left": left, "press_right": right}
    return {name: ids for name, ids in sides.items() if sum(map(len, ids))}


Bend = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _unit(keys: Keys) -> meshio.Mesh:
    """The two blocks of edge 1, with as many coordinates as dimensions; keys may be left."""
    mesh = stacked(keys, 1.0)
    mesh.points = mesh.points[:, : 3 if "symy" in mesh.cell_sets else 2]
    return mesh


def _flat(keys: Keys, dim: int | None = None) -> meshio.Mesh:
    mesh = _unit(keys)
    keys.finish()
    if dim and mesh.points.shape[1] != dim:
        raise keys.refuse("bottom.cells", None, f"must be a cell type of {dim}D")
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
    for block in cells:
        cell_type(block.type).put_between(points, block.data)
    return points


def _nodes(mesh: meshio.Mesh, group: str) -> np.ndarray:
    """Which nodes (n,) belong to the cells of a group."""
    mask = np.zeros(len(mesh.points), dtype=bool)
    for block, members in zip(mesh.cells, mesh.cell_sets[group], strict=True):
        mask[block.data[np.asarray(members, dtype=int)].ravel()] = True
    return mask


def _y(x: np.ndarray) -> np.ndarray:
    return x[:, 1] if x.shape[1] == 3 else np.zeros(len(x))


def _radii(keys: Keys) -> list[float]:
    radii = keys.numbers("radii", 3)
    if not radii[0] < radii[1] < radii[2]:
        raise keys.refuse("radii", radii, "must increase: bore, interface, rim")
    return radii


def _radius(height: np.ndarray, radii: list[float]) -> np.ndarray:
    bore, interface, rim = radii
    inner, outer = interface - bore, rim - interface
    return interface + height * np.where(height < 0, inner, outer)
