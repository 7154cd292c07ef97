"""Which part of the master a macro-element meets, and which faces are not covered whole.

Along the normal of a point the nearest visible master face counts (`pairing`, `segments`). What is
left is decided here, from distances at the points of the segments: a macro-element beside a step
of the master meets the nearer side alone, since one pressure cannot act on both. Whole slave
surfaces have their quadrature points here, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from .cells.faces import circumference
from .cells.shape import Rule, face_rule
from .facets import Facets, measured
from .segments import Segments


@dataclass(frozen=True, kw_only=True)
class Surface:
    """The m macro-elements of a slave surface.

    `area`, `covered` (m,): whole and intersected area; `lost` (m,): opposite the master, but
    without a partner, where it is measured; `centre`, `normal` (m, dim).
    """

    area: np.ndarray
    covered: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    lost: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Points on the n faces of one block, the same q places on each.

    `values` (q, n_nodes) shape functions; `weight` (n, q) surface measure × quadrature weight;
    `normal` (n, q, dim) the unit normals along which the faces meet the master.
    """

    values: np.ndarray
    weight: np.ndarray
    normal: np.ndarray


def face_samples(slaves: list[Facets]) -> list[Samples]:
    """Points that integrate shape functions over whole planar faces exactly, by block.

    >>> (sample,) = face_samples([slave])
    >>> round(float(sample.weight.sum()), 15)
    2.0
    """
    return [sampled(block, face_rule(block.type.name)) for block in slaves]


def sampled(block: Facets, rule: Rule) -> Samples:
    """The points of a rule on the reference face.

    >>> sample = sampled(slave, (np.array([[0.5]]), np.array([1.0])))
    >>> sample.weight.tolist(), sample.values.tolist(), sample.normal.tolist()
    ([[2.0]], [[0.5, 0.5]], [[[0.0, 1.0]]])
    """
    places, weights = rule
    # In the meridian plane: on the axis a ring has no area, but the face a normal.
    values, vectors = measured(replace(block, axisymmetric=False), places)
    measure = np.linalg.norm(vectors, axis=2)
    if block.axisymmetric:
        measure = measure * circumference(values @ block.corner)
    if block.directions is not None:
        vectors = np.einsum("qa,fad->fqd", values, block.directions)
    normal = vectors / np.linalg.norm(vectors, axis=2, keepdims=True)
    return Samples(values=values, weight=measure * weights, normal=normal)


# Parts of the master without common nodes are one surface for a macro-element where their
# distances differ by less than this share of its size.
_STEP = 0.1
# A face that misses less than this share of its area is covered whole.
MISSED = 1e-6


def uncovered(samples: Sequence[Samples], found: Sequence[Segments]) -> list[np.ndarray]:
    """By block, the slave faces that segments do not cover whole.

    >>> samples, found = face_samples([slave]), meet_in_segments([slave], [], [master], 1.0)
    >>> [faces.tolist() for faces in (*uncovered(samples, found), *uncovered(samples, found[1:]))]
    [[], [0]]
    """
    return bare_faces(samples, missed_area(samples, found))


def bare_faces(samples: Sequence[Samples], missed: Sequence[np.ndarray]) -> list[np.ndarray]:
    """By block, the faces of which segments miss an area (n,).

    >>> [faces.tolist() for faces in bare_faces(face_samples([slave]), [np.array([0.5])])]
    [[0]]
    """
    return [
        np.flatnonzero(area > MISSED * sample.weight.sum(axis=1))
        for area, sample in zip(missed, samples, strict=True)
    ]


def missed_area(samples: Sequence[Samples], found: Sequence[Segments]) -> list[np.ndarray]:
    """By block, the area (n,) of slave faces that segments do not cover.

    >>> missed_area(face_samples([slave]), [])[0].round(12).tolist()
    [2.0]
    """
    missed = [sample.weight.sum(axis=1) for sample in samples]
    for segments in found:
        np.subtract.at(missed[segments.slave.index], segments.slave.face, segments.area)
    return missed


def on_one_surface(found: list[Segments], slaves: Sequence[Facets], n_macro: int) -> list[Segments]:
    """The segments of the surface that each macro-element meets first.

    Master faces that a macro-element sees are one surface if they share a node, or if their
    distances, ranges from the nearest to the farthest point, adjoin.

    Two master edges with a common node are one surface:

    >>> [part.area.tolist() for part in on_one_surface(
    ...     meet_in_segments([slave], [], [master], 1.0), [slave], 1)]
    [[1.0, 1.0]]
    """
    ranges = [(s.macro, s.gap.min(axis=1), s.gap.max(axis=1)) for s in found]
    if not ranges:
        return found
    macro, low, high = (np.concatenate(part) for part in zip(*ranges, strict=True))
    # Gauss points are inside; by half of their range more it is that of the whole segment.
    low, high = low - (high - low) / 2, high + (high - low) / 2
    size = extents(slaves, n_macro)
    lowest, highest = np.full(n_macro, np.inf), np.full(n_macro, -np.inf)
    np.minimum.at(lowest, macro, low)
    np.maximum.at(highest, macro, high)
    stepped = highest - lowest > _STEP * size
    if not stepped.any():
        return found
    part, count = _connected(found, stepped)
    owner = np.zeros(count, dtype=int)
    owner[part] = macro
    low_of, high_of = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low_of, part, low)
    np.maximum.at(high_of, part, high)
    near_of = np.maximum(np.maximum(low_of, -high_of), 0.0)
    nearest = np.full(n_macro, np.inf)
    np.minimum.at(nearest, owner, near_of)
    kept, slack = near_of <= nearest[owner], _STEP * size[owner]
    while True:
        lowest, highest = np.full(n_macro, np.inf), np.full(n_macro, -np.inf)
        np.minimum.at(lowest, owner[kept], low_of[kept])
        np.maximum.at(highest, owner[kept], high_of[kept])
        more = (low_of <= highest[owner] + slack) & (high_of >= lowest[owner] - slack)
        if (more == kept).all():
            break
        kept = more
    chosen = np.split(kept[part] | ~stepped[macro], np.cumsum([len(s.gap) for s in found])[:-1])
    return [s.of(mine) for s, mine in zip(found, chosen, strict=True) if mine.any()]


def extents(slaves: Sequence[Facets], n_macro: int) -> np.ndarray:
    """The extents (m,) of macro-elements.

    >>> extents([slave], 1).tolist()
    [2.0]
    """
    low, high = (np.full((n_macro, slaves[0].corner.shape[2]), x) for x in (np.inf, -np.inf))
    for block in slaves:
        np.minimum.at(low, block.number, block.corner.min(axis=1))
        np.maximum.at(high, block.number, block.corner.max(axis=1))
    return np.linalg.norm(high - low, axis=1)


def _connected(found: Sequence[Segments], stepped: np.ndarray) -> tuple[np.ndarray, int]:
    """To which part (s,) of the master, as its macro-element sees it, segments belong; how many.

    Master faces are joined by their nodes, on macro-elements that are `stepped` (m,) alone.
    """
    rows, keys, first = [], [], 0
    for segments in found:
        mine = np.flatnonzero(stepped[segments.macro])
        nodes = segments.master.nodes[mine]
        rows.append(np.repeat(first + mine, nodes.shape[1]))
        keys.append(nodes.ravel() * len(stepped) + np.repeat(segments.macro[mine], nodes.shape[1]))
        first += len(segments.gap)
    row, key = np.concatenate(rows), np.unique(np.concatenate(keys), return_inverse=True)[1]
    size = first + int(key.max(initial=-1)) + 1
    graph = sparse.coo_matrix((np.ones(len(row)), (row, first + key.ravel())), shape=(size, size))
    number = connected_components(graph, directed=False)[1][:first]
    names, part = np.unique(number, return_inverse=True)
    return part.ravel(), len(names)
