"""The linear solver that a positive definite system gets, by its size and dimension."""

import logging

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from solver.errors import SolveError
from solver.linear.backends import BACKENDS
from solver.linear.direct import Factor, factorise, wanted
from solver.linear.krylov import EPSILON
from solver.linear.multigrid import Multigrid, Unknowns

_LOG = logging.getLogger(__name__)

MULTIGRID = "multigrid"
_ASKED = "as asked for"
# Unknowns in space from which multigrid takes less time than a factor, and half the memory or less:
# whether PARDISO makes the factor, whether cells are quadratic, which takes twice the iterations.
_MULTIGRID_FROM = {
    (True, False): 80_000,
    (True, True): 200_000,
    (False, False): 20_000,
    (False, True): 100_000,
}
# Mean front of two cubes, one on the other, over the power 2/3 of their nodes: the sizes above are
# of such. Flat and slender bodies, which multigrid finds hard, have fronts of less than half that.
_FRONT, _FLAT = 0.85, 0.5
# From as many entries more than the matrix has, condensing is slower than a saddle point; a few
# (the second figure) take no time.
_FILL, _LEAST_FILL = 1.0, 1_000_000


def multigrid_from(quadratic: bool) -> int:
    """Unknowns in space from which multigrid is the quicker way, with what is installed here."""
    return _MULTIGRID_FROM[BACKENDS["pardiso"].available(), quadratic]


class Chosen:
    """What solves one system, as often as wanted: `name`, and `why` it was chosen.

    Multigrid gives way to a factor once it does not converge: thin cells, nearly incompressible
    material. `gave_up` then says why; else it is empty.
    """

    def __init__(self, matrix: csr_matrix, dim: int, solver: Factor | Multigrid, why: str):
        self._matrix, self._dim, self._solver, self.why = matrix, dim, solver, why
        self.gave_up = ""

    @property
    def name(self) -> str:
        """By what."""
        return self._solver.name

    @property
    def iterations(self) -> int:
        """The most that one solution took so far; 0 by a factor alone."""
        return self._solver.iterations

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:
        """Solve for `right` (n,) or (n, k), to a residual of `accuracy` times that, or better.

        Raises SolveError where the solution is not finite or the iterations do not converge.
        """
        try:
            return self._solver.solve(right, accuracy)
        except SolveError as error:
            if not isinstance(self._solver, Multigrid):
                raise
            self.why = self.gave_up = _instead(error)
            _LOG.info("%s", self.why)
        self._solver.close()
        self._solver = factorise(self._matrix, dim=self._dim)
        return self._solver.solve(right, accuracy)


def prepare(matrix: csr_matrix, unknowns: Unknowns, against: str | None = None) -> Chosen:
    """Make ready to solve with a symmetric positive definite `matrix` (n, n), both halves stored.

    `against`: why multigrid is not tried, as it gave up on a matrix like it; empty: it is; None: as
    `against_multigrid` has it. Raises SolveError where the matrix is not positive definite or
    singular to working precision; a singular matrix that multigrid solves for a consistent
    right-hand side goes unnoticed.
    """
    dim = unknowns.dim
    if against is None:
        against = against_multigrid(matrix, unknowns)
    by = "a factor" if against else MULTIGRID
    _LOG.info("linear system of %d unknowns, by %s", matrix.shape[0], by)
    gave_up = ""
    if not against:
        least = multigrid_from(unknowns.quadratic)
        why = f"{least} unknowns or more in space: quicker and smaller than a factor"
        try:
            solver = Multigrid(matrix, unknowns)
            return Chosen(matrix, dim, solver, why if wanted() == "auto" else _ASKED)
        except SolveError as error:
            # A factor decides whether the matrix is to blame.
            against = gave_up = _instead(error)
    chosen = Chosen(matrix, dim, factorise(matrix, dim=dim), against)
    chosen.gave_up = gave_up
    return chosen


def against_multigrid(matrix: csr_matrix, unknowns: Unknowns) -> str:
    """Why a system with the stiffness `matrix` (n, n) is factored; empty where it is not."""
    if wanted() != "auto":
        return "" if wanted() == MULTIGRID else _ASKED
    least = multigrid_from(unknowns.quadratic)
    if unknowns.dim == 2:
        return "in the plane a factor is small"
    if matrix.shape[0] < least:
        return f"fewer than {least} unknowns: a factor is quicker than multigrid"
    if _front(matrix, unknowns.node) < _FLAT * _FRONT * (least / unknowns.dim) ** (2 / 3):
        return f"flat or slender bodies: a factor is as small as for fewer than {least} unknowns"
    return ""


def against_condensation(matrix: csr_matrix, constraints: csr_matrix) -> str:
    """Why `matrix` (n, n) had better not be condensed by `constraints` (m, n), but factored.

    Empty where it had. A constraint over w unknowns leaves a block of w² entries in the condensed
    system. Only PARDISO factors saddle points in space well.
    """
    widths = np.diff(constraints.indptr).astype(float)
    filled = float((widths**2).sum())
    few = filled <= max(_FILL * matrix.nnz, _LEAST_FILL)
    if few or wanted() != "auto" or not BACKENDS["pardiso"].available():
        return ""
    return f"a condensed system would fill in: one constraint holds {widths.max():.0f} unknowns"


def _front(matrix: csr_matrix, node: np.ndarray) -> float:
    """Mean front of a factor, in nodes, when these are numbered by reverse Cuthill and McKee.

    A bound of what a factor costs (George, Liu, Computer Solution of Large Sparse Positive Definite
    Systems, 1981, ch. 4). `node` (n,): the node of each unknown.
    """
    _, first, number = np.unique(node, return_index=True, return_inverse=True)
    of_nodes = matrix[first]
    size = len(first)
    graph = csr_matrix(
        (np.ones(of_nodes.nnz, dtype=np.int8), number[of_nodes.indices], of_nodes.indptr),
        shape=(size, size),
    )
    rank = np.empty(size, dtype=int)
    rank[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(size)
    lowest = np.minimum.reduceat(rank[graph.indices], graph.indptr[:-1])
    return float((rank - lowest).mean())


def _instead(error: SolveError) -> str:
    return f"multigrid does not serve here: {error}"
