"""Which slave sub-faces and master faces may meet, and which master faces hide others.

Pairs are found by a spatial search of enclosing balls.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from .cells.catalogue import CellType
from .cells.faces import FLAT
from .clipping import clip, triangles
from .facets import Facets, project_along

# Master faces overlap, one behind the other, by more than this share of the slave face's radius.
_OVERLAP = 1e-9
# More than what rounding makes of a distance, as a share of it.
_ROUNDING = 1e-9
# Balls around faces, seen along a normal, are taken as larger by this factor.
_BALLS = 1.1
# A face is seen from behind where the cosine of the angle between the normals is above this.
_BACK = 1e-3
# A master face may meet a slave face only where their normals are farther apart than this angle,
# somewhere on the faces.
_FACING = np.arccos(-0.2)


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """The m faces of several blocks as closed polygons of v corners, whatever their types.

    `corner` (m, v, dim); `bulge` (m, v, dim): the offset of each edge's middle node from the middle
    of its chord (among quadrangles, a triangle has a first edge of no length); `vertices` (m, v)
    their nodes; `block`, `face` (m,): where they are from; `centre`, `normal` (m, dim), `radius`,
    `affine`, `turn` (m,) as in Facets.
    """

    corner: np.ndarray
    bulge: np.ndarray
    vertices: np.ndarray
    block: np.ndarray
    face: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    radius: np.ndarray
    affine: np.ndarray
    turn: np.ndarray


def outlines(blocks: Sequence[Facets], reverse: bool = False) -> Outlines:
    """The outlines of all faces; in `reverse`, they go round as seen from the other side.

    >>> outlines([slave, master]).vertices.tolist()
    [[1, 0], [2, 3], [3, 4]]
    """
    width = max(block.type.n_vertices for block in blocks)
    corner, bulge, vertices = [], [], []
    for block in blocks:
        order, middle = _around(block.type, reverse)
        first, last = block.corner[:, order], block.corner[:, np.roll(order, -1)]
        if middle is None:
            offset = np.zeros_like(first)
        else:
            offset = block.corner[:, middle] - (first + last) / 2
        more = width - len(order)
        corner.append(np.concatenate([first[:, :1]] * more + [first], axis=1))
        bulge.append(np.pad(offset, ((0, 0), (more, 0), (0, 0))))
        vertices.append(block.nodes[:, [order[0]] * more + list(order)])
    count = [len(block.number) for block in blocks]
    return Outlines(
        corner=np.concatenate(corner),
        bulge=np.concatenate(bulge),
        vertices=np.concatenate(vertices),
        block=np.repeat(np.arange(len(blocks)), count),
        face=np.concatenate([np.arange(n) for n in count]),
        centre=np.concatenate([block.centre for block in blocks]),
        normal=np.concatenate([block.normal for block in blocks]),
        radius=np.concatenate([block.radius for block in blocks]),
        affine=np.concatenate([block.affine for block in blocks]),
        turn=np.concatenate([block.turn for block in blocks]),
    )


def _around(kind: CellType, reverse: bool) -> tuple[np.ndarray, np.ndarray | None]:
    """The vertices of a face in order, and the mid-node of the edge from each to the next."""
    n = kind.n_vertices
    order = np.arange(n)[::-1] if reverse else np.arange(n)
    if kind.dim == 1 or kind.order == 1:
        return order, None
    return order, n + (np.roll(order, -1) if reverse else order)


@dataclass(frozen=True, kw_only=True)
class Pairs:
    """Pairs of slave faces `i` (p,) of one block and master faces `j` (p,) of all blocks.

    `own`, `outline`: the outlines of the slave and of the master faces.
    """

    slave: Facets
    index: int
    own: Outlines
    masters: Sequence[Facets]
    outline: Outlines
    i: np.ndarray
    j: np.ndarray

    def of(self, chosen: np.ndarray | slice) -> Self:
        """Some of the pairs."""
        return replace(self, i=self.i[chosen], j=self.j[chosen])

    @property
    def corner(self) -> np.ndarray:
        """Nodes (p, n_nodes, dim) of the slave faces, counted from their centres."""
        return self.slave.corner[self.i] - self.slave.centre[self.i][:, None]

    def seen(self, outline: Outlines, j: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners and bulges (p, v, dim − 1) of outlines seen along the slave's normal."""
        tangents = self.slave.tangents[self.i]
        corner = outline.corner[j] - self.slave.centre[self.i][:, None]
        return seen_along(corner, tangents), seen_along(outline.bulge[j], tangents)

    def distance(self, place: np.ndarray) -> np.ndarray:
        """How far (p,) the master faces are along the slave's normal from places (p, dim − 1)."""
        origin = self.slave.centre[self.i]
        origin = origin + np.einsum("pt,ptd->pd", place, self.slave.tangents[self.i])
        normal, along = self.outline.normal[self.j], self.slave.normal[self.i]
        height = np.einsum("pd,pd->p", self.outline.centre[self.j] - origin, normal)
        height /= np.einsum("pd,pd->p", along, normal)
        for index, master in enumerate(self.masters):
            mine = (self.outline.block[self.j] == index) & (self.outline.turn[self.j] > 0)
            corner = master.corner[self.outline.face[self.j[mine]]]
            target, direction = origin[mine][:, None], along[mine][:, None]
            _, gap = project_along(master.type, corner, target, direction, outline=True)
            height[mine] = gap[:, 0]
        return height


def face_pairs(
    slaves: Sequence[Facets],
    index: int,
    masters: Sequence[Facets],
    reach: float,
    among: np.ndarray | None = None,
) -> Pairs:
    """Pairs of faces of the slave block `index` and of all master blocks that may overlap.

    Seen along the slave's normal; within `reach`, a length. `among`: the slave faces that are
    looked at, all by default.

    >>> face_pairs([slave], 0, [master], 1.0).j.tolist()
    [0, 1]
    """
    slave, master = slaves[index], outlines(masters, reverse=True)
    i, j = facing_pairs(slave, master, reach, among)
    near = _above_each_other(slave, master, i, j)
    pairs = Pairs(
        slave=slave,
        index=index,
        own=outlines([slave]),
        masters=masters,
        outline=master,
        i=i[near],
        j=j[near],
    )
    return pairs.of(~_through_a_body(pairs))


def _through_a_body(pairs: Pairs) -> np.ndarray:
    """Which pairs (p,) meet, behind the slave face, the far side of a body of the master.

    A line from the slave face inwards then passes another master face first, and from behind. So it
    is where whole skins of bodies are the surfaces of a zone.
    """
    slave, outline = pairs.slave, pairs.outline
    found, centre = np.zeros(len(pairs.i), dtype=bool), outline.centre[pairs.j]
    tangents = slave.tangents[pairs.i]
    place = np.einsum("ptd,pd->pt", tangents, centre - slave.centre[pairs.i])
    depth = -np.einsum("pd,pd->p", slave.normal[pairs.i], centre - slave.centre[pairs.i])
    deep = np.flatnonzero(depth > _ROUNDING * (slave.radius[pairs.i] + outline.radius[pairs.j]))
    if not len(deep):
        return found
    behind = -outline.normal
    some = np.unique(pairs.i[deep])
    i, blocker = candidate_pairs(
        slave.centre[some], slave.radius[some], outline.centre, outline.radius, depth.max()
    )
    i = some[i]
    backs = np.einsum("pd,pd->p", slave.normal[i], behind[blocker]) < -_BACK
    i, blocker = i[backs], blocker[backs]
    first = np.searchsorted(i, pairs.i[deep], side="left")
    last = np.searchsorted(i, pairs.i[deep], side="right")
    which = np.repeat(np.arange(len(deep)), last - first)
    blocker = blocker[
        np.arange(len(which)) - np.repeat(np.cumsum(last - first) - last, last - first)
    ]
    which = deep[which]
    corner = np.einsum(
        "ptd,pvd->pvt",
        tangents[which],
        outline.corner[blocker] - slave.centre[pairs.i[which], None],
    )
    between = _holds(corner, place[which])
    back = replace(pairs, i=pairs.i[which], j=blocker)
    height = -back.distance(place[which])
    between &= (height < depth[which]) & (height > -_ROUNDING * slave.radius[pairs.i[which]])
    found[which[between]] = True
    return found


def _holds(corner: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Which convex polygons (p, v, 2), or intervals (p, 2, 1), hold their places."""
    if corner.shape[2] == 1:
        return (corner[..., 0].min(axis=1) <= place[:, 0]) & (
            place[:, 0] <= corner[..., 0].max(axis=1)
        )
    chord, offset = np.roll(corner, -1, axis=1) - corner, place[:, None] - corner
    side = chord[..., 0] * offset[..., 1] - chord[..., 1] * offset[..., 0]
    return (side >= 0).all(axis=1) | (side <= 0).all(axis=1)


def facing_pairs(
    slave: Facets, master: Outlines | Facets, reach: float, among: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (slave number, master number) of faces within `reach` that look at each other.

    Curved faces do so if they may anywhere, by how far their normals turn. `among`: the slave faces
    that are looked at, all of them by default.

    >>> [pair.tolist() for pair in facing_pairs(slave, master, 0.1)]
    [[0, 0], [0, 1]]
    >>> [pair.tolist() for pair in facing_pairs(slave, slave, 0.1)]
    [[], []]
    """
    some = np.arange(len(slave.number)) if among is None else among
    i, j = line_pairs(slave, master, reach, some)
    apart = np.clip(np.einsum("pd,pd->p", slave.normal[i], master.normal[j]), -1.0, 1.0)
    facing = np.arccos(apart) + slave.turn[i] + master.turn[j] > _FACING
    return i[facing], j[facing]


def line_pairs(
    slave: Facets, master: Outlines | Facets, reach: float, some: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of slave faces `some` (s,) and master faces that a line along a normal may join.

    Within `reach`. Where all slave faces lie one way, they are looked for in the plane across: in a
    wide surface beside its partner, every face is within reach of all others.

    >>> [pair.tolist() for pair in line_pairs(slave, master, 0.1, np.array([0]))]
    [[0, 0], [0, 1]]
    """
    centre, radius = slave.centre[some], slave.radius[some]
    across = slave.tangents[0] if len(some) else np.zeros((1, centre.shape[1]))
    one_way = slave.directions is None and not slave.turn.any()
    if not one_way or np.abs(slave.normal - slave.normal[:1]).max(initial=0.0) > _ROUNDING:
        i, j = candidate_pairs(centre, radius, master.centre, master.radius, reach)
        return some[i], j
    wide = _BALLS * radius, _BALLS * master.radius
    i, j = candidate_pairs(centre @ across.T, wide[0], master.centre @ across.T, wide[1], 0.0)
    apart = np.linalg.norm(centre[i] - master.centre[j], axis=1)
    near = apart <= radius[i] + master.radius[j] + reach
    return some[i[near]], j[near]


def candidate_pairs(
    slave_centre: np.ndarray,
    slave_radius: np.ndarray,
    master_centre: np.ndarray,
    master_radius: np.ndarray,
    reach: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (slave number, master number) whose balls come within `reach` of each other.

    Centres (n, dim), radii (n,), in units of length. Each side is sorted into classes of similar
    radius, so that a few large faces do not make every small one search far: the work stays
    near-linear in the number of faces also where one side is much finer.

    >>> one, radius = np.array([[0.0]]), np.array([1.0])
    >>> others, radii = np.array([[2.4], [2.6]]), np.array([1.0, 1.0])
    >>> [pair.tolist() for pair in candidate_pairs(one, radius, others, radii, 0.5)]
    [[0], [0]]
    """
    from scipy.spatial import cKDTree  # a quarter of the time that the package takes to load

    found = [(np.empty(0, dtype=int), np.empty(0, dtype=int))]
    masters = [(members, cKDTree(master_centre[members])) for members in _classes(master_radius)]
    for slaves in _classes(slave_radius):
        tree = cKDTree(slave_centre[slaves])
        for members, master_tree in masters:
            distance = slave_radius[slaves].max() + master_radius[members].max() + reach
            near = tree.sparse_distance_matrix(master_tree, distance, output_type="ndarray")
            s, m = slaves[near["i"]], members[near["j"]]
            close = near["v"] <= slave_radius[s] + master_radius[m] + reach
            found.append((s[close], m[close]))
    slave, master = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((master, slave))
    return slave[order], master[order]


def _classes(radius: np.ndarray) -> list[np.ndarray]:
    """Members of each class of radii within a factor of two."""
    if not len(radius):
        return []
    size = np.floor(np.log2(np.maximum(radius, np.finfo(float).tiny))).astype(int)
    return [np.flatnonzero(size == k) for k in np.unique(size)]


def _above_each_other(slave: Facets, master: Outlines, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Which pairs (p,) may overlap, seen along the slave's normal: their balls do."""
    between = master.centre[j] - slave.centre[i]
    beside = np.einsum("pd,ptd->pt", between, slave.tangents[i])
    return np.linalg.norm(beside, axis=1) <= (1 + _ROUNDING) * (slave.radius[i] + master.radius[j])


def seen_along(vectors: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """Components (f, a, dim − 1) of vectors (f, a, dim) along the tangents (f, dim − 1, dim).

    >>> seen_along(slave.corner, slave.tangents).tolist()
    [[[-2.0], [0.0]]]
    """
    return np.einsum("fad,ftd->fat", vectors, tangents)


def hidden_pairs(pairs: Pairs) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (c,), ascending, whose master face lies behind that of other pairs (c,), in part.

    Seen from one slave face; of faces that cross each other the one that is nearer in the middle of
    what they share counts as nearer. Faces that share a node do not overlap. Another edge above the
    master's two of the example is hidden by both:

    >>> far = facets(points + [0.0, 1.0], BY_NAME["SEG2"], np.array([[2, 4]]), np.array([0]))
    >>> pairs = face_pairs([slave], 0, [master, replace(far, nodes=far.nodes + 5)], 9.0)
    >>> hidden, nearer = hidden_pairs(pairs)
    >>> pairs.j[hidden].tolist(), pairs.j[nearer].tolist()
    ([2, 2], [1, 0])
    """
    none = np.empty(0, dtype=int)
    if len(pairs.i) < 2 or _in_one_plane(pairs.outline):
        return none, none
    own, _ = pairs.seen(pairs.own, pairs.i)
    corner, bulge = pairs.seen(pairs.outline, pairs.j)
    control = np.concatenate([corner, corner + bulge, np.roll(corner, -1, axis=1) + bulge], axis=1)
    low = np.maximum(control.min(axis=1), own.min(axis=1))
    high = np.minimum(control.max(axis=1), own.max(axis=1))
    shared = _OVERLAP * pairs.slave.radius[pairs.i][:, None]
    found = []
    for step in range(1, int(np.bincount(pairs.i).max())):
        a = np.flatnonzero(pairs.i[:-step] == pairs.i[step:])
        both = np.minimum(high[a], high[a + step]) - np.maximum(low[a], low[a + step])
        a = a[(both > shared[a]).all(axis=1)]
        one, other = pairs.outline.vertices[pairs.j[a]], pairs.outline.vertices[pairs.j[a + step]]
        apart = (one[:, :, None] != other[:, None]).all(axis=(1, 2))
        found.append((a[apart], a[apart] + step))
    first, second = (np.concatenate(part) for part in zip((none, none), *found, strict=True))
    if corner.shape[2] == 1:
        middle = np.maximum(low[first], low[second]) + np.minimum(high[first], high[second])
        middle = middle / 2
    else:
        area, middle = _shared(own[first], corner[first], corner[second])
        large = area > shared[first, 0] * pairs.slave.radius[pairs.i[first]]
        first, second, middle = first[large], second[large], middle[large]
    one, other = (np.abs(pairs.of(some).distance(middle)) for some in (first, second))
    behind = one > other
    hidden, nearer = np.where(behind, first, second), np.where(behind, second, first)
    order = np.argsort(hidden, kind="stable")
    return hidden[order], nearer[order]


def _in_one_plane(outline: Outlines) -> bool:
    """Whether master faces lie in one plane, where none hides another."""
    points = outline.corner.reshape(-1, outline.corner.shape[2])
    offset = points - points.mean(axis=0)
    size = np.abs(offset).max()
    flat = np.abs(offset @ outline.normal[0]).max() <= FLAT * size
    return bool(flat and np.abs(outline.bulge @ outline.normal[0]).max() <= FLAT * size)


def _shared(own: np.ndarray, one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Area (c,) and middle (c, 2) of what polygons (c, v, 2) have in common."""
    count = np.full(len(one), one.shape[1])
    which, corner, area = triangles(*clip(*clip(one, count, other), own))
    total = np.bincount(which, area, minlength=len(one))
    middle = np.zeros((len(one), 2))
    np.add.at(middle, which, area[:, None] * corner.mean(axis=1))
    return total, middle / np.where(total > 0, total, 1.0)[:, None]
