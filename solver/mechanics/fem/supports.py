"""Supports as a change of unknowns: displacement = offset + basis · free unknowns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from .block import selected

DEPENDENT = 1e-8
"""Directions (unit vectors) whose part outside the others is smaller depend on them."""
SAME = 1e-9
"""Displacements that differ by less than this share of the largest are the same."""


class SupportClashError(Exception):
    """A support, by its `number`, asks nodes for another displacement than one before it."""

    def __init__(self, number: int, value: float, count: int):
        super().__init__(f"{count} nodes are given another displacement by a support before it")
        self.number, self.value = number, value


class LinkError(Exception):
    """Nodes that should move with others, by the `number` of the tie or copy, cannot."""

    def __init__(self, number: int, problem: str):
        super().__init__(problem)
        self.number = number


@dataclass(frozen=True)
class Fixed:
    """Imposed displacement of nodes (n,) along unit directions (n, dim), of values (n,).

    `holder`: what holds them, by name.
    """

    nodes: np.ndarray
    directions: np.ndarray
    values: np.ndarray
    holder: str = ""


@dataclass(frozen=True)
class FreeMotion:
    """u = offset + basis · x: `basis` (n_dofs, n_free) has orthonormal columns, offset (n_dofs,).

    `selection` (n_free,) are the free degrees of freedom where the basis merely picks them.
    """

    basis: sparse.csr_matrix
    offset: np.ndarray
    selection: np.ndarray | None

    def gathered(self, values: np.ndarray) -> np.ndarray:
        """The part basisᵀ · `values` on free unknowns, of `values` (n_dofs,) or (n_dofs, k)."""
        if self.selection is not None:
            return values[self.selection]
        return np.asarray(self.basis.T @ values)

    def spread(self, x: np.ndarray) -> np.ndarray:
        """The displacement basis · x (n_dofs,), x (n_free,)."""
        if self.selection is None:
            return np.asarray(self.basis @ x)
        found = np.zeros(self.basis.shape[0])
        found[self.selection] = x
        return found

    def reduced(self, matrix: sparse.spmatrix) -> sparse.csr_matrix:
        """basisᵀ · matrix · basis."""
        if self.selection is not None:
            return selected(matrix, self.selection)
        return (self.basis.T @ matrix @ self.basis).tocsr()


def free_motion(n_nodes: int, dim: int, fixed: Sequence[Fixed]) -> FreeMotion:
    """The displacements that supports leave free.

    Raises SupportClashError where two supports ask a node for different displacements.
    """
    nodes = np.concatenate([np.empty(0, dtype=int), *(f.nodes for f in fixed)])
    directions = np.concatenate([np.empty((0, dim)), *(f.directions for f in fixed)])
    values = np.concatenate([np.empty(0), *(f.values for f in fixed)])
    source = np.repeat(np.arange(len(fixed)), [len(f.nodes) for f in fixed])
    order = np.argsort(nodes, kind="stable")
    nodes, directions, values, source = (a[order] for a in (nodes, directions, values, source))
    # Per node an orthonormal set of held directions is grown, one support at a time.
    held = np.zeros((n_nodes, dim, dim))
    count = np.zeros(n_nodes, dtype=int)
    offset = np.zeros((n_nodes, dim))
    rank = np.arange(len(nodes)) - np.searchsorted(nodes, nodes)
    largest = np.abs(values).max(initial=0.0)
    for k in range(rank.max(initial=-1) + 1):
        now = rank == k
        node, direction = nodes[now], directions[now]
        rest = direction - np.einsum("nrd,nr->nd", held[node], _parts(held[node], direction))
        rest -= np.einsum("nrd,nr->nd", held[node], _parts(held[node], rest))
        length = np.linalg.norm(rest, axis=1)
        missing = values[now] - np.einsum("nd,nd->n", direction, offset[node])
        new = length > DEPENDENT
        clash = ~new & (np.abs(missing) > SAME * largest)
        if clash.any():
            first = np.flatnonzero(now)[clash.argmax()]
            raise SupportClashError(int(source[first]), float(values[first]), int(clash.sum()))
        node, unit = node[new], rest[new] / length[new][:, None]
        held[node, count[node]] = unit
        offset[node] += unit * (missing[new] / length[new])[:, None]
        count[node] += 1
    return _basis(held, count, offset)


@dataclass(frozen=True)
class Copies:
    """Nodes `copy` (n,) that have the displacement of nodes `of` (n,), turned by `turn`."""

    of: np.ndarray
    copy: np.ndarray
    turn: np.ndarray


def copied(free: FreeMotion, copies: Sequence[Copies]) -> FreeMotion:
    """What is left free where nodes are turned copies of others; a node may be its own copy.

    The displacement u of a node is left free in the directions v that supports leave free there,
    with the turn of v at the copy. Raises LinkError.

    >>> turned = Copies(np.array([0]), np.array([1]), np.array([[0.0, -1.0], [1.0, 0.0]]))
    >>> copied(free_motion(2, 2, []), [turned]).basis.toarray().round(3).T.tolist()
    [[0.707, 0.0, 0.0, 0.707], [0.0, 0.707, -0.707, 0.0]]
    """
    for number, each in enumerate(copies):
        pairs = np.concatenate([each.of, each.copy[each.copy != each.of]])
        if len(np.unique(pairs)) < len(pairs):
            raise LinkError(number, "a node is the copy of two others, or itself copied")
        free = _with_copies(free, each, number)
    return free


def _with_copies(free: FreeMotion, copies: Copies, number: int) -> FreeMotion:
    dim, turn = len(copies.turn), copies.turn
    dofs = [dim * nodes[:, None] + np.arange(dim) for nodes in (copies.of, copies.copy)]
    projector = (free.basis @ free.basis.T).tocsr()
    if _spread(projector, dofs):
        raise LinkError(number, "its nodes are tied, or copies, by another support")
    held = [np.eye(dim) - _blocks(projector, each) for each in dofs]
    given = [np.einsum("nij,nj->ni", h, free.offset[d]) for h, d in zip(held, dofs, strict=True)]
    own = (copies.of == copies.copy)[:, None, None] * (
        (np.eye(dim) - turn).T @ (np.eye(dim) - turn)
    )
    resistance = held[0] + turn.T @ held[1] @ turn + own
    start = np.einsum(
        "nij,nj->ni",
        np.linalg.pinv(resistance, DEPENDENT, hermitian=True),
        given[0] + given[1] @ turn,
    )
    missing = np.abs(np.einsum("nij,nj->ni", held[0], start) - given[0])
    missing += np.abs(np.einsum("nij,nj->ni", held[1], start @ turn.T) - given[1])
    if (missing > SAME * np.abs(free.offset).max(initial=0.0)).any():
        raise LinkError(number, "supports give its nodes another displacement than the copied ones")
    offset = free.offset.copy()
    offset[dofs[0]], offset[dofs[1]] = start, start @ turn.T
    values, vectors = np.linalg.eigh(resistance)
    pair, which = np.nonzero(values < DEPENDENT)
    mine = vectors[pair, :, which]
    alone = (copies.of == copies.copy)[pair]
    mine /= np.where(alone, 1.0, np.sqrt(2))[:, None]
    columns = np.repeat(np.arange(len(pair)), dim)
    rows = np.concatenate([dofs[0][pair].ravel(), dofs[1][pair][~alone].ravel()])
    columns = np.concatenate([columns, columns.reshape(-1, dim)[~alone].ravel()])
    entries = np.concatenate([mine.ravel(), (mine @ turn.T)[~alone].ravel()])
    shape = (len(free.offset), len(pair))
    added = sparse.coo_matrix((entries, (rows, columns)), shape=shape)
    taken = np.zeros(len(free.offset))
    taken[np.concatenate([each.ravel() for each in dofs])] = 1.0
    kept = free.basis[:, np.flatnonzero(abs(free.basis).T @ taken == 0)]
    return FreeMotion(sparse.hstack([kept, added]).tocsr(), offset, None)


def _blocks(matrix: sparse.csr_matrix, dofs: np.ndarray) -> np.ndarray:
    """The blocks (n, dim, dim) of a matrix on the diagonal, of degrees of freedom (n, dim)."""
    shape = (*dofs.shape, dofs.shape[1])
    rows = np.broadcast_to(dofs[:, :, None], shape).ravel()
    columns = np.broadcast_to(dofs[:, None], shape).ravel()
    return np.asarray(matrix[rows, columns]).reshape(shape)


def _spread(projector: sparse.csr_matrix, dofs: Sequence[np.ndarray]) -> bool:
    """Whether unknowns of these nodes belong to other nodes too."""
    mine = np.concatenate([each.ravel() for each in dofs])
    dim = dofs[0].shape[1]
    found = projector[mine].tocoo()
    return bool((mine[found.row] // dim != found.col // dim).any())


def tied(free: FreeMotion, ties: Sequence[np.ndarray]) -> FreeMotion:
    """What is left free where all degrees of freedom (n,) of each tie have one displacement.

    Raises LinkError where one is not free by itself.

    >>> tied(free_motion(2, 1, []), [np.array([0, 1])]).basis.toarray().round(4).tolist()
    [[0.7071], [0.7071]]
    """
    if not ties:
        return free
    rows, columns = free.basis.tocsr(), free.basis.tocsc()
    alone = np.diff(rows.indptr) == 1
    alone[alone] = np.diff(columns.indptr)[rows.indices[rows.indptr[:-1][alone]]] == 1
    into = np.arange(free.basis.shape[1])
    for number, dofs in enumerate(ties):
        if not alone[dofs].all():
            taken = int((~alone[dofs]).sum())
            problem = f"{taken} of its nodes are held there, or tied, by another support"
            raise LinkError(number, problem)
        unknowns = rows.indices[rows.indptr[dofs]]
        into[unknowns] = unknowns.min()
        alone[dofs] = False
    _, into, count = np.unique(into, return_inverse=True, return_counts=True)
    entries = (1 / np.sqrt(count[into]), (np.arange(len(into)), into))
    merged = sparse.csr_matrix(entries, shape=(len(into), len(count)))
    return FreeMotion((rows @ merged).tocsr(), free.offset, None)


def released(free: FreeMotion, motions: Sequence[tuple[np.ndarray, np.ndarray]]) -> FreeMotion:
    """What is left free where held degrees of freedom may move together, by their motions.

    `motions`: degrees of freedom (m,), all of which are held, and independent columns (m, k).

    >>> held = free_motion(2, 1, [Fixed(np.arange(2), np.ones((2, 1)), np.zeros(2))])
    >>> released(held, [(np.arange(2), np.ones((2, 1)))]).basis.toarray().round(4).tolist()
    [[-0.7071], [-0.7071]]
    """
    columns = [free.basis]
    for dofs, motion in motions:
        unit, _ = np.linalg.qr(motion)
        rows, numbers = np.repeat(dofs, unit.shape[1]), np.tile(np.arange(unit.shape[1]), len(dofs))
        shape = (free.basis.shape[0], unit.shape[1])
        columns.append(sparse.csr_matrix((unit.ravel(), (rows, numbers)), shape=shape))
    if len(columns) == 1:
        return free
    return FreeMotion(sparse.hstack(columns, format="csr"), free.offset, None)


def _parts(held: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.einsum("nrd,nd->nr", held, vector)


def _basis(held: np.ndarray, count: np.ndarray, offset: np.ndarray) -> FreeMotion:
    n, dim, _ = held.shape
    axis = (held != 0).sum(axis=2).max(axis=1, initial=0) <= 1
    free = np.ones((n, dim), dtype=bool)
    free[axis] = (held[axis] == 0).all(axis=1)
    turned = np.flatnonzero(~axis)
    free[turned] = np.arange(dim) < dim - count[turned][:, None]
    number = np.cumsum(free.ravel()).reshape(n, dim) - 1
    straight = free.copy()
    straight[turned] = False
    rows = [np.flatnonzero(straight.ravel())]
    columns, entries = [number[straight]], [np.ones(len(rows[0]))]
    if len(turned):
        # The singular vectors past the held ones span what is left free.
        _, _, vectors = np.linalg.svd(held[turned])
        for k in range(dim):
            some = dim - count[turned] > k
            node = turned[some]
            complement = vectors[some, count[node] + k]
            rows.append((dim * node[:, None] + np.arange(dim)).ravel())
            columns.append(np.repeat(number[node, k], dim))
            entries.append(complement.ravel())
    shape = (n * dim, int(free.sum()))
    coo = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    basis = sparse.coo_matrix(coo, shape=shape).tocsr()
    return FreeMotion(basis, offset.ravel(), None if len(turned) else rows[0])
