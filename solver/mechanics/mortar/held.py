"""Slave nodes that cannot answer a multiplier: it is added to the neighbours' multipliers.

Supports hold the displacement of a node along the normal; or the node has a multiplier of another
zone in nearly the same direction, where zones share nodes. Where the master follows node by node
the constraints would depend on one another. The node's function is added in equal parts to
those of the free nodes on the same faces: functions still sum to one, and a uniform pressure stays
exact. Source: Bernardi, Maday, Patera, A new nonconforming approach to domain decomposition: the
mortar element method, in: Nonlinear Partial Differential Equations and Their Applications, 1994
(elements at the ends of an interface, and points where several meet); Puso, Laursen, Mesh tying on
curved interfaces in 3D, Eng. Comput. 20 (2003) 305–319.
"""

from dataclasses import replace

import numpy as np
from scipy import sparse

from ...lac.operator import GapOperator

# A node is held along its normal where less than this share of a motion that way is free.
_HELD = 1e-12
# Normals of two zones at a node are independent from an angle of this sine on, 30 degrees: half the
# angle between two faces of a coarse smooth surface is no corner.
_INDEPENDENT = 0.5


def merge_fixed_multipliers(
    operator: GapOperator, basis: sparse.csr_matrix, taken: np.ndarray | None = None
) -> GapOperator:
    """The operator without multipliers of held nodes; `basis` (n_dofs, n_free) is what is free.

    `taken` (n_nodes, dim, dim): the projection on the directions of multipliers that other zones
    have at each node; those of the operator are added to it. The operator stays as it is where all
    nodes are held, or none.

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
    held = _held(operator, operator.nodes, basis, taken)
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


def _held(
    operator: GapOperator, nodes: np.ndarray, basis: sparse.csr_matrix, taken: np.ndarray | None
) -> np.ndarray:
    """Which multipliers (k,), each at its node, see a node without a free direction for them."""
    k, dim = len(nodes), operator.surface.centre.shape[1]
    rows = np.repeat(np.arange(k), dim)
    columns = (dim * nodes[:, None] + np.arange(dim)).ravel()
    own = np.asarray(operator.matrix[rows, columns]).ravel()
    normal = sparse.coo_matrix((own, (rows, columns)), shape=operator.matrix.shape).tocsr()
    size, free = sparse.linalg.norm(normal, axis=1), (normal @ basis).tocsr()
    held = (size > 0) & (sparse.linalg.norm(free, axis=1) <= _HELD * size)
    if taken is not None:
        along = np.asarray((free @ basis.T).tocsr()[rows, columns]).reshape(k, dim)
        rest = along - np.einsum("nij,nj->ni", taken[nodes], along)
        length, left = (np.linalg.norm(v, axis=1) for v in (along, rest))
        held |= left < _INDEPENDENT * length
        unit = rest[~held] / np.where(left > 0, left, 1.0)[~held, None]
        taken[nodes[~held]] += unit[:, :, None] * unit[:, None]
    return held
