"""Slave nodes that supports hold along the normal: their multipliers join those of neighbours.

A displacement that is held cannot answer a multiplier, and where the master follows node by node
the constraints would depend on one another. The held node's function is added in equal parts to
those of the free nodes on the same faces: functions still sum to one, and a uniform pressure stays
exact. Source: Bernardi, Maday, Patera, A new nonconforming approach to domain decomposition: the
mortar element method, in: Nonlinear Partial Differential Equations and Their Applications, 1994
(elements at the ends of an interface); Puso, Laursen, Mesh tying on curved interfaces in 3D, Eng.
Comput. 20 (2003) 305–319.
"""

from dataclasses import replace

import numpy as np
from scipy import sparse

from .operator import GapOperator

# A node is held along its normal where less than this share of a motion that way is free.
_HELD = 1e-12


def merge_fixed_multipliers(operator: GapOperator, basis: sparse.csr_matrix) -> GapOperator:
    """The operator without multipliers of held nodes; `basis` (n_dofs, n_free) is what is free.

    It stays as it is where all nodes are held, or none.

    A support holds node 0, so that the multiplier of node 1 stands for the whole edge:

    >>> operator = gap_operator([slave], [master], 1, 5, 1.0, scheme_of("nodal", None))
    >>> operator.area.round(15).tolist()
    [1.0, 1.0]
    >>> free = sparse.identity(10, format="csr")[:, 2:]
    >>> merge_fixed_multipliers(operator, free).area.round(15).tolist()
    [2.0]
    """
    if operator.nodes is None:
        raise ValueError("the multipliers do not belong to nodes")
    held = _held(operator, operator.nodes, basis)
    if held.all() or not held.any():
        return operator
    of_nodes = _of_nodes(operator.mean, held)
    onto = of_nodes.T.tocsr()
    return replace(
        operator,
        matrix=(onto @ operator.matrix).tocsr(),
        initial=onto @ operator.initial,
        area=onto @ operator.area,
        covered=onto @ operator.covered,
        mean=(operator.mean @ of_nodes).tocsr(),
        at_nodes=of_nodes,
    )


def _of_nodes(mean: sparse.csr_matrix, held: np.ndarray) -> sparse.csr_matrix:
    """Values of all nodes (n, k) by those of the free ones: held ones take the mean around them."""
    sharing = (mean != 0).astype(float)
    shares = (sharing[:, held].T @ sharing[:, ~held] != 0).astype(float)
    count = np.asarray(shares.sum(axis=1)).ravel()
    shares = (sparse.diags(1 / np.maximum(count, 1)) @ shares).tocoo()
    free = np.flatnonzero(~held)
    rows = np.concatenate([free, np.flatnonzero(held)[shares.row]])
    columns = np.concatenate([np.arange(len(free)), shares.col])
    values = np.concatenate([np.ones(len(free)), shares.data])
    return sparse.coo_matrix((values, (rows, columns)), shape=(len(held), len(free))).tocsr()


def _held(operator: GapOperator, nodes: np.ndarray, basis: sparse.csr_matrix) -> np.ndarray:
    """Which multipliers (k,), each at its node, see a node that cannot move along the normal."""
    k, dim = len(nodes), operator.surface.centre.shape[1]
    rows = np.repeat(np.arange(k), dim)
    columns = (dim * nodes[:, None] + np.arange(dim)).ravel()
    own = np.asarray(operator.matrix[rows, columns]).ravel()
    normal = sparse.coo_matrix((own, (rows, columns)), shape=operator.matrix.shape).tocsr()
    size = sparse.linalg.norm(normal, axis=1)
    return (size > 0) & (sparse.linalg.norm(normal @ basis, axis=1) <= _HELD * size)
