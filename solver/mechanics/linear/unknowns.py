"""The meaning of the unknowns of a system: what multigrid asks for beside the matrix."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ...lac.threads import prefetch

_ROWS = 1 << 15  # that a thread handles at once


@dataclass(frozen=True)
class Unknowns:
    """The meaning of the unknowns of a system, in `dim` dimensions.

    `node` (n,): the node of each unknown, at most `dim` per node; `motions` returns the rigid
    motions (n, 3 or 6) in these unknowns, which nobody keeps; `body` (n,): the number of the body.
    Bodies that slide on each other share no aggregate. `points` (n_nodes, 3): coordinates of the
    nodes. Where cells are quadratic, `linear` (n, m) interpolates from the unknowns `vertices` (m,)
    of linear cells. `mixed`: some cells are in mixed form.
    """

    dim: int
    node: np.ndarray
    motions: Callable[[], np.ndarray]
    body: np.ndarray
    points: np.ndarray | None = None
    vertices: np.ndarray | None = None
    linear: csr_matrix | None = None
    mixed: bool = False

    @property
    def quadratic(self) -> bool:
        """Whether some cells are quadratic."""
        return self.linear is not None

    def of(self, chosen: np.ndarray) -> "Unknowns":
        """The same for some of them, in ascending order, where no interpolation joins others."""

        def motions() -> np.ndarray:
            return self.motions()[chosen]

        arrays = self.node[chosen], motions, self.body[chosen], self.points
        if self.linear is None or self.vertices is None:
            return Unknowns(self.dim, *arrays, mixed=self.mixed)
        mine = np.flatnonzero(np.isin(self.vertices, chosen))
        vertices = np.searchsorted(chosen, self.vertices[mine])
        return Unknowns(self.dim, *arrays, vertices, self.linear[chosen][:, mine], self.mixed)

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
