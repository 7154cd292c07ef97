"""The smooth surface behind facets: what it resists, and what its facets resist by roughness alone.

A pin of tetrahedra in a hole would be held along its axis and against turning by its roughness, a
ball in its socket against turning. Planes, spheres, cylinders and cones are quadrics, on which the
vertices of their facets lie: Q(x) = 0 gives the normals exactly, and a motion that keeps Q opens
nothing. The normals of other surfaces are means over neighbours.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.csgraph import connected_components

from .cells.faces import FLAT

# So often normals are averaged over neighbours.
_ROUNDS = 3
# Normals of neighbours that differ by less, in more than rounding, belong to one smooth surface.
_KINK = np.cos(np.radians(40)) + 1e-9
# Vertices this near to a quadric, by the size of the surface, lie on it.
_NEAR = 1e-5
# A quadric has ten coefficients: it passes through so many vertices by chance.
_FREEDOM = 10


class Smooth(NamedTuple):
    """Macro-elements of a slave surface in space, and their vertices.

    `points` (n, 3) of all nodes; `faces` as meshed, by block: macro-element (f,) and nodes (f, v);
    `slave`: nodes of the slave side, also those of the cut; `normal` (m, 3), `area` (m,);
    `near` (m, m): those that share a vertex.
    """

    points: np.ndarray
    faces: list[tuple[np.ndarray, np.ndarray]]
    slave: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    near: sparse.csr_matrix


def smoothed(gaps: sparse.csr_matrix, surface: Smooth) -> sparse.csr_matrix:
    """Rows of gaps (m, n_dofs) along the normals of the smooth surface.

    Those of a flat surface, and in the plane, stay as they are: the same object comes back.

    Two facets that lean to either side are level on the average:

    >>> points = np.array([[0.0, 0, 0], [0, 1, 0], [24, 0, 7], [24, 1, 7], [48, 0, 0], [48, 1, 0]])
    >>> faces = [(np.arange(2), np.array([[0, 2, 3, 1], [2, 4, 5, 3]]))]
    >>> lean = np.array([[-0.28, 0.0, 0.96], [0.28, 0.0, 0.96]])
    >>> near = sparse.csr_matrix(np.ones((2, 2), dtype=bool))
    >>> rows = sparse.csr_matrix((2, 18)).tolil()
    >>> rows[0, :3], rows[1, 12:15] = lean
    >>> about = Smooth(points, faces, np.arange(6), lean, np.ones(2), near)
    >>> smooth = smoothed(rows.tocsr(), about).toarray()
    >>> smooth[0, :3].round(12).tolist(), smooth[1, 12:15].round(12).tolist()
    ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])
    """
    normal, dim = surface.normal, surface.normal.shape[1]
    if dim < 3:
        return gaps
    i, j = surface.near.nonzero()
    alike = (normal[i] * normal[j]).sum(axis=1) > _KINK
    i, j = i[alike], j[alike]
    weight = sparse.csr_matrix((surface.area[j], (i, j)), shape=surface.near.shape)
    smooth = normal
    for _ in range(_ROUNDS):
        smooth = weight @ smooth
        smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    if np.abs(smooth - normal).max() <= FLAT:
        return gaps
    entries = gaps.tocoo()
    row, node, axis = entries.row, entries.col // dim, entries.col % dim
    shape = gaps.shape[0], gaps.shape[1] // dim
    share = sparse.csr_matrix((entries.data * normal[row, axis], (row, node)), shape=shape)
    on_slave = np.zeros(gaps.shape[1] // dim, dtype=bool)
    on_slave[surface.slave] = True
    sides = np.stack([smooth, smooth])
    part = connected_components(weight, directed=False)[1]
    exact = _of_quadrics(sides, surface, part, share, on_slave)
    # Inside a face that is no quadric the normal varies as it does.
    kept = sparse.diags((~exact).astype(float)) @ gaps
    share = share.tocoo()
    along = sides[on_slave[share.col].astype(int), share.row]
    turned = share.data[:, None] * (along - (normal * ~exact[:, None])[share.row])
    columns = dim * share.col[:, None] + np.arange(dim)
    rows = np.broadcast_to(share.row[:, None], columns.shape)
    places = rows.ravel(), columns.ravel()
    return (kept + sparse.csr_matrix((turned.ravel(), places), shape=gaps.shape)).tocsr()


def _of_quadrics(
    sides: np.ndarray,
    surface: Smooth,
    part: np.ndarray,
    share: sparse.csr_matrix,
    on_slave: np.ndarray,
) -> np.ndarray:
    """Which (m,) belong to a part (m,) that is a quadric; there `sides` (2, m, 3) become exact.

    They are the normals for the motion of the master and of the slave, at the mean places of what
    meets; `share` (m, n): the weights of nodes in the gaps, those of the slave by `on_slave` (n,).
    """
    place = np.zeros_like(sides)
    for mine, found in ((on_slave, place[1]), (~on_slave, place[0])):
        weights = share @ sparse.diags(mine.astype(float))
        whole = np.asarray(weights.sum(axis=1)).ravel()[:, None]
        # A master without nodes is where the slave is.
        found[:] = np.divide(weights @ surface.points, whole, out=place[1].copy(), where=whole != 0)
    seen = np.diff(share.indptr) > 0
    exact = np.zeros(len(part), dtype=bool)
    for number in range(int(part.max()) + 1):
        nodes = [nodes[part[macro] == number].ravel() for macro, nodes in surface.faces]
        chosen = (part == number) & seen
        on = surface.points[np.unique(np.concatenate(nodes))]
        quadric = _quadric(on, place[1, chosen], surface.normal[chosen])
        if quadric is not None:
            for side, places in zip(sides, place, strict=True):
                normal = quadric(places[chosen])
                side[chosen] = normal * np.sign((normal * side[chosen]).sum(axis=1))[:, None]
            exact |= chosen
    return exact


def _quadric(
    points: np.ndarray, centre: np.ndarray, normal: np.ndarray
) -> Callable[[np.ndarray], np.ndarray] | None:
    """A function that gives unit normals of the quadric through all points (n, 3), or None.

    Two rings of points lie on many. That one is chosen which is least bent, by its slope along the
    normals of facets (m, 3) at their centres: a cylinder, not two planes.
    """
    if len(points) <= _FREEDOM:
        return None
    middle = points.mean(axis=0)
    size = np.abs(points - middle).max()
    at = (points - middle) / size
    powers = _powers(at) / np.sqrt(len(at))
    _, values, rows = np.linalg.svd(powers[:, 6:], full_matrices=False)
    if values[-1] <= _NEAR:  # a plane, which rounded coordinates bend
        level = rows[-1, :3] / np.linalg.norm(rows[-1, :3])
        return lambda places: np.tile(level, (len(places), 1))
    _, values, rows = np.linalg.svd(powers, full_matrices=False)
    space = rows[values <= _NEAR].T
    if not space.shape[1]:
        return None
    steep = np.einsum("fdk,fd->fk", _slopes((centre - middle) / size), normal) @ space
    # Positive, where a surface is so shallow that its quadric is nearly a plane.
    bent = space[:6].T @ space[:6] + _NEAR**2 * np.eye(space.shape[1])
    least = space @ linalg.eigh(-steep.T @ steep, bent)[1][:, 0]

    def normals(places: np.ndarray) -> np.ndarray:
        slope = _slopes((places - middle) / size) @ least
        return np.asarray(slope / np.linalg.norm(slope, axis=1, keepdims=True))

    return normals


def _powers(at: np.ndarray) -> np.ndarray:
    x, y, z = at.T
    r = np.sqrt(2.0)  # so that the sum of squares does not depend on the axes
    return np.column_stack(
        [x * x, y * y, z * z, r * x * y, r * y * z, r * z * x, at, np.ones(len(at))]
    )


def _slopes(at: np.ndarray) -> np.ndarray:
    """The gradients (n, 3, 10) of the powers."""
    found = np.zeros((len(at), 3, 10))
    axis = np.arange(3)
    found[:, axis, axis] = 2 * at
    for k, (a, b) in enumerate(((0, 1), (1, 2), (2, 0))):
        found[:, a, 3 + k], found[:, b, 3 + k] = np.sqrt(2.0) * at[:, b], np.sqrt(2.0) * at[:, a]
    found[:, axis, 6 + axis] = 1.0
    return found
