"""Bodies: connected parts of a mesh, their rigid motions, and what resists these.

Supports resist a motion, and closed contact does that opens or closes under it. The facets of a
curved surface do so too where the surface itself would not. A motion of which only a small share is
resisted along the normals of the smooth surface (`lac.roughness`) is free.
"""

from collections.abc import Iterator

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

# Eigenvalues below this share of the largest belong to unresisted motions.
_FREE = 1e-12
# The same in amplitudes.
_SEEN = 1e-6
# Smooth normals leave at least this share of what resists a motion, or facets alone resist it: of
# a tapered pin all, of a wave four facets long 1/64; of pins in holes and balls in sockets 1e-4.
_SMOOTH = 0.002


def body_numbers(n_nodes: int, cells: dict[str, np.ndarray]) -> np.ndarray:
    """Body number (n_nodes,) of each node: parts without a common node are different bodies.

    >>> body_numbers(5, {"SEG2": np.array([[0, 1], [2, 3], [3, 4]])}).tolist()
    [0, 0, 1, 1, 1]
    """
    first = np.concatenate([np.repeat(c[:, 0], c.shape[1] - 1) for c in cells.values()])
    others = np.concatenate([c[:, 1:].ravel() for c in cells.values()])
    graph = sparse.coo_matrix((np.ones(len(first)), (first, others)), shape=(n_nodes, n_nodes))
    return connected_components(graph, directed=False)[1]


def rigid_motions(
    points: np.ndarray, body: np.ndarray, axisymmetric: bool = False
) -> sparse.csc_matrix:
    """Rigid motions (n_dofs, n_bodies · 3 or 6): translations, then turns about body centres.

    Axisymmetric bodies have one, along the axis.

    The largest displacement of each column is one: a slender body is turned about its own axis by a
    larger angle than about others.

    >>> rigid_motions(np.array([[0.0, 0.0], [2.0, 0.0]]), np.zeros(2, dtype=int)).toarray().tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]]
    """
    n, dim = points.shape
    fields = list(motion_fields(points, body))
    fields = fields[1:2] if axisymmetric else fields
    per_body = len(fields)
    rows = [np.flatnonzero(field).astype(np.int32) for field in fields]
    columns = [body[some // dim] * per_body + k for k, some in enumerate(rows)]
    values = [field.ravel()[some] for field, some in zip(fields, rows, strict=True)]
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sparse.csc_matrix(entries, shape=(n * dim, (int(body.max()) + 1) * per_body))


def motion_fields(points: np.ndarray, body: np.ndarray) -> Iterator[np.ndarray]:
    """Each rigid motion as a displacement (n, dim) of all bodies at once, about their centres.

    >>> *_, turn = motion_fields(np.array([[0.0, 0.0], [2.0, 0.0]]), np.zeros(2, dtype=int))
    >>> turn[:, 1].tolist()
    [-1.0, 1.0]
    """
    dim = points.shape[1]
    count = np.bincount(body)
    centre = np.stack([np.bincount(body, points[:, d]) / count for d in range(dim)], axis=1)

    def field(number: int) -> np.ndarray:
        if number < dim:
            return np.tile(np.eye(dim)[number], (len(points), 1))
        arm = points - centre[body]
        if dim == 2:
            turn = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
        else:
            turn = np.cross(np.eye(3)[number - 3], arm)
        size = np.zeros(len(count))
        np.maximum.at(size, body, np.linalg.norm(turn, axis=1))
        return np.asarray(turn / np.where(size > 0, size, 1.0)[body][:, None])

    return map(field, range(3 if dim == 2 else 6))


def support_resistance(motions: sparse.csc_matrix, basis: sparse.csr_matrix) -> np.ndarray:
    """How supports resist rigid motions (n_dofs, r), (r, r): the products of what they hold.

    `basis` (n_dofs, n_free) spans the displacements that the supports leave free.

    One node, whose first component is held:

    >>> support_resistance(sparse.eye(2, format="csc"), sparse.csr_matrix([[0.0], [1.0]])).tolist()
    [[1.0, 0.0], [0.0, 0.0]]
    """
    held = motions - basis @ (basis.T @ motions)
    return np.asarray((held.T @ held).toarray())


def unsupported(
    motions: sparse.csc_matrix,
    resistance: np.ndarray,
    ground: sparse.csr_matrix | None = None,
) -> sparse.csr_matrix:
    """The rigid motions (n_dofs, k) of each body that the supports leave free.

    `resistance` (r, r) of the supports; `ground` (n_dofs, n_dofs), rows of what
    it adds to the stiffness, resist motions too.

    >>> unsupported(sparse.eye(2, format="csc"), np.diag([1.0, 0.0])).toarray().tolist()
    [[0.0], [1.0]]
    """
    if ground is not None:
        stretched = ground @ motions
        resistance = resistance + (stretched.T @ stretched).toarray()
    values, vectors = np.linalg.eigh(resistance)
    free = values <= _FREE * max(float(values[-1]), np.finfo(float).tiny)
    # Round-off entries would mix the bodies and fill the motions up.
    chosen = np.where(np.abs(vectors[:, free]) > _FREE, vectors[:, free], 0.0)
    return (motions @ sparse.csr_matrix(chosen)).tocsr()


def unseen(rows: np.ndarray) -> np.ndarray:
    """The combinations (r, f) of r motions that change nothing in `rows` (k, r).

    >>> np.abs(unseen(np.array([[1.0, 0.0], [2.0, 0.0]]))).round(12).tolist()
    [[0.0], [1.0]]
    """
    from scipy.linalg import null_space

    if not rows.size:
        return np.eye(rows.shape[1])
    return np.asarray(null_space(np.linalg.qr(rows, mode="r"), _SEEN))


def holding(seen: np.ndarray, among: np.ndarray) -> np.ndarray:
    """The fewest rows (k,) `among` some (k,) that hold all that these hold.

    `seen` (k, r): what each of r motions changes in each row.

    Two gaps see a body that moves, and a third one sees it turn:

    >>> seen = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 0.5]])
    >>> holding(seen, np.array([True, True, True])).tolist()
    [True, False, True]
    """
    from scipy.linalg import qr

    rows, numbers = np.zeros(len(seen), dtype=bool), np.flatnonzero(among)
    if seen[among].size:
        upper, order = qr(seen[among].T, mode="r", pivoting=True)
        size = np.abs(np.diag(upper))
        rows[numbers[order[: np.count_nonzero(size > _SEEN * size[0])]]] = True
    return rows


def unheld_motion(
    supports: np.ndarray,
    contact: sparse.csr_matrix,
    n_bodies: int,
    smooth: sparse.csr_matrix | None = None,
) -> tuple[int, str] | None:
    """A rigid motion that neither supports nor contact resist: (body, description), or None.

    `supports` (r, r): see `support_resistance`; `contact` (m, r): the average gap that each motion
    opens at each closed multiplier, `smooth` (m, r) the same along smooth normals.

    A body in the plane that is held along y and against turning:

    >>> unheld_motion(np.diag([0.0, 1.0, 1.0]), sparse.csr_matrix((0, 3)), 1)
    (0, 'move along x')
    """
    resistance = supports + (contact.T @ contact).toarray()
    weight = 1 / np.sqrt(np.maximum(np.diag(resistance), np.finfo(float).tiny))
    dead = np.diag(resistance) <= _FREE * max(np.diag(resistance).max(initial=0.0), 1e-300)
    weight[dead] = 1.0
    values, vectors = np.linalg.eigh(resistance * np.outer(weight, weight))
    free = values[0] <= _FREE
    if not free and smooth is not None:
        # The shares of what resists combinations of unit resistance.
        whole = weight[:, None] * vectors / np.sqrt(values)
        left = supports + (smooth.T @ smooth).toarray()
        values, turn = np.linalg.eigh(whole.T @ left @ whole)
        free, vectors = values[0] < _SMOOTH, (whole @ turn) / weight[:, None]
    if not free:
        return None
    motion = (vectors[:, 0] * weight).reshape(n_bodies, -1)
    body = int(np.abs(motion).max(axis=1).argmax())
    return body, _describe(motion[body])


def _describe(motion: np.ndarray) -> str:
    if len(motion) == 1:
        return "move along y"
    dim = 2 if len(motion) == 3 else 3
    move, turn = motion[:dim], motion[dim:]
    if np.abs(turn).max() > np.abs(move).max():
        return "turn" if dim == 2 else f"turn about {_direction(turn)}"
    return f"move along {_direction(move)}"


def _direction(vector: np.ndarray) -> str:
    unit = vector / vector[np.abs(vector).argmax()]
    unit[np.abs(unit) < 1e-6] = 0.0
    if np.abs(unit).sum() < 1 + 1e-6:
        return "xyz"[int(np.abs(unit).argmax())]
    return "(" + ", ".join(f"{x:.3g}" for x in unit) + ")"
