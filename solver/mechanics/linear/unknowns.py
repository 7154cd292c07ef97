"""The unknowns as multigrid asks for them beside the matrix, and quadratic cells as linear ones.

A level of linear cells on the same vertices interpolates the other nodes. Where cells are slender,
nodes in the middle of long edges stay beside the vertices. An error that alternates along such an
edge and is smooth along the short ones has little energy: no smoother of single nodes reduces it,
and linear cells do not have it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.sparse import csr_matrix

from ...lac.threads import prefetch
from ..fem.block import Block

_ROWS = 1 << 15  # that a thread handles at once


AUTO = "auto"
"""The solver is chosen by the size of a system."""


@dataclass(frozen=True)
class Unknowns:
    """The meaning of the unknowns of a system, in `dim` dimensions.

    `node` (n,): the node of each unknown, at most `dim` per node; `motions` returns the rigid
    motions (n, 3 or 6) in these unknowns, which nobody keeps; `body` (n,): the number of the body.
    Bodies that slide on each other share no aggregate. `points` (n_nodes, 3): coordinates of the
    nodes. Where cells are quadratic, `linear` (n, m) interpolates from the unknowns `vertices` (m,)
    of linear cells. `factored`: why multigrid does not serve, if anything says so. `solver`: what
    the system is solved by, `auto`, `cholmod` or `multigrid`.
    """

    dim: int
    node: np.ndarray
    motions: Callable[[], np.ndarray]
    body: np.ndarray
    points: np.ndarray | None = None
    vertices: np.ndarray | None = None
    linear: csr_matrix | None = None
    factored: str = ""
    solver: str = AUTO

    @property
    def quadratic(self) -> bool:
        """Whether some cells are quadratic."""
        return self.linear is not None

    def of(self, chosen: np.ndarray) -> "Unknowns":
        """The same for some of them, in ascending order, where no interpolation joins others."""

        def motions() -> np.ndarray:
            return self.motions()[chosen]

        found = replace(self, node=self.node[chosen], motions=motions, body=self.body[chosen])
        if self.linear is None or self.vertices is None:
            return replace(found, vertices=None, linear=None)
        mine = np.flatnonzero(np.isin(self.vertices, chosen))
        vertices = np.searchsorted(chosen, self.vertices[mine])
        return replace(found, vertices=vertices, linear=self.linear[chosen][:, mine])

    def of_vertices(self) -> "Unknowns":
        """Those of linear cells on the same vertices."""
        assert self.vertices is not None
        return replace(self, linear=None).of(self.vertices)


@dataclass(frozen=True)
class LevelNodes:
    """The nodes of a level: `motions` (n, 3 or 6) of their unknowns; `body`, `points` of each."""

    motions: np.ndarray
    body: np.ndarray
    points: np.ndarray | None


def places(unknowns: Unknowns) -> tuple[np.ndarray, int]:
    """The row (n,) of each unknown where every node that has some has three, and how many rows."""
    number, count = np.unique(unknowns.node, return_inverse=True, return_counts=True)[1:]
    order = np.argsort(number, kind="stable")
    rank = np.empty(len(number), dtype=int)
    rank[order] = np.arange(len(number)) - np.repeat(np.cumsum(count) - count, count)
    return 3 * number + rank, 3 * len(count)


def nodes_at(
    unknowns: Unknowns, place: np.ndarray, size: int, scale: np.ndarray | float = 1.0
) -> LevelNodes:
    """The nodes of `size` rows; those without unknowns belong to no body, −1.

    The unknowns are in units of `scale` (n,).
    """
    given = unknowns.motions()
    units = np.broadcast_to(scale, place.shape)
    motions, body = np.zeros((size, given.shape[1])), np.full(size // 3, -1)
    body[place // 3] = unknowns.body

    def fill(first: int) -> None:
        some = slice(first, first + _ROWS)
        motions[place[some]] = given[some] / units[some, None]

    for _ in prefetch(fill, range(0, len(place), _ROWS)):
        pass
    if unknowns.points is None:
        return LevelNodes(motions, body, None)
    points = np.zeros((size // 3, unknowns.points.shape[1]))
    points[place // 3] = unknowns.points[unknowns.node]
    return LevelNodes(motions, body, points)


# Half-edges at a node differ by more than this where cells are slender. Between 3 and 5 the
# iterations differ by a tenth.
_LONG = 3.5


def from_vertices(
    points: np.ndarray, blocks: Sequence[Block]
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Which nodes (n_nodes,) stay, and all nodes (n_nodes, n_nodes) as means of these.

    Of `points` (n_nodes, dim). Vertices stay, and nodes `_LONG` times further from their vertices
    than the nearest node from one of these.

    >>> from ...lac.cells.catalogue import BY_NAME
    >>> kind = BY_NAME["TRIA6"]
    >>> cell = Block(kind, np.arange(6)[None], np.ones(1), np.ones(1))
    >>> from_vertices(kind.nodes, [cell])[1].toarray()[3:, :3].tolist()
    [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]]
    >>> from_vertices(kind.nodes * [1, 9], [cell])[0].tolist()  # x is short
    [True, True, True, False, True, True]
    """
    vertex, means = _means_of_vertices(len(points), blocks)
    own = means.tocoo()
    row, column = own.row[~vertex[own.row]], own.col[~vertex[own.row]]
    distance = np.linalg.norm(points[row] - points[column], axis=1)
    short = np.full(len(points), np.inf)  # from a vertex, later from those of a node
    np.minimum.at(short, column, distance)
    np.minimum.at(short, row, short[column])
    stays = vertex.copy()
    stays[row[distance > _LONG * short[row]]] = True
    rest = sparse.diags((vertex | ~stays).astype(float))
    return stays, (rest @ means + sparse.diags((stays & ~vertex).astype(float))).tocsr()


def _means_of_vertices(
    n_nodes: int, blocks: Sequence[Block]
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Which nodes (n_nodes,) are vertices, and all nodes (n_nodes, n_nodes) as means of these."""
    vertex = np.zeros(n_nodes, dtype=bool)
    for block in blocks:
        vertex[block.cells[:, : block.type.n_vertices]] = True
    done, own = vertex.copy(), np.flatnonzero(vertex)
    rows, columns, weights = [own], [own], [np.ones(len(own))]
    for block in blocks:
        for local in range(block.type.n_vertices, block.type.n_nodes):
            owners = block.type.owners[local]
            nodes, cell = np.unique(block.cells[:, local], return_index=True)
            nodes, cell = nodes[~done[nodes]], cell[~done[nodes]]
            done[nodes] = True
            rows.append(np.repeat(nodes, len(owners)))
            columns.append(block.cells[cell][:, owners].ravel())
            weights.append(np.full(len(nodes) * len(owners), 1 / len(owners)))
    where = np.concatenate(rows), np.concatenate(columns)
    return vertex, sparse.csr_matrix((np.concatenate(weights), where), shape=(n_nodes, n_nodes))


def linear_unknowns(
    basis: sparse.csr_matrix, dim: int, stays: np.ndarray, means: sparse.csr_matrix
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """The free unknowns (m,) of nodes that stay, and the interpolation (n_free, m) from these.

    `basis` (dim · n_nodes, n_free) has orthonormal columns; `stays`, `means`: see `from_vertices`.
    """
    vertices = np.flatnonzero(abs(basis).T @ np.repeat(stays, dim).astype(float))
    means = sparse.kron(means, sparse.identity(dim), format="csr")
    return vertices, (basis.T @ (means @ basis[:, vertices])).tocsr()
