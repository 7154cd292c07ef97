"""How much a pressure oscillates: second differences of its error between neighbours.

Along a line the second difference of e at a place and its two neighbours is |e₋ − 2 e + e₊|. On a
surface it is twice the difference from the mean of all neighbours: the same on a line, and zero for
what is linear on a regular grid. Places at the rim of the surface have none.
"""

import numpy as np

from ..case.solutions.base import ExactSolution
from ..lac.cells.catalogue import cell_type
from ..simulation.results.solution import NodalContact, ZoneResult

# Pairs of neighbours (k, 2), each once, and which places (m,) are at the rim.
Neighbours = tuple[np.ndarray, np.ndarray]


def oscillation(
    points: np.ndarray, zone: ZoneResult, exact: ExactSolution, mean: np.ndarray
) -> float:
    """Largest second difference of the error, by macro-element or, of nodal multipliers, by node.

    `mean` (m,) is the exact pressure's mean over each macro-element. The average of two nodes would
    hide a pressure that alternates from node to node.
    """
    if zone.nodal is None:
        smooth = exact.regular(zone.centre)
        return second_difference(macro_neighbours(zone), zone.multiplier - mean, smooth)
    place = points[zone.nodal.nodes]
    error = zone.nodal.multiplier - exact.contact_pressure(place)
    return second_difference(_nodes(zone, zone.nodal), error, exact.regular(place))


def second_difference(neighbours: Neighbours, error: np.ndarray, smooth: np.ndarray) -> float:
    """The largest among places within the rim that are smooth (m,), as all their neighbours are."""
    pairs, rim = neighbours
    total, count, rough = np.zeros(len(error)), np.zeros(len(error)), np.zeros(len(error))
    for one, other in (pairs.T, pairs.T[::-1]):
        np.add.at(total, one, error[other] - error[one])
        np.add.at(count, one, 1)
        np.add.at(rough, one, ~smooth[other])
    chosen = ~rim & smooth & (rough == 0) & (count > 1)
    return float(2 * np.abs(total[chosen] / count[chosen]).max(initial=0.0))


def grown(neighbours: Neighbours, chosen: np.ndarray, times: int) -> np.ndarray:
    """The chosen places (m,) and their neighbours, `times` over."""
    pairs, _ = neighbours
    for _ in range(times):
        chosen = chosen.copy()
        beside = chosen[pairs].any(axis=1)
        chosen[pairs[beside]] = True
    return chosen


def macro_neighbours(zone: ZoneResult) -> Neighbours:
    """Macro-elements that share an edge of their sub-faces, or in 2D an end."""
    sides, owner = [], []
    for name, nodes, macro in zone.faces:
        kind = cell_type(name)
        ends = [(0,), (1,)] if kind.dim == 1 else list(kind.edges)
        sides.append(np.sort(nodes[:, ends].reshape(len(nodes) * len(ends), -1)[:, :2], axis=1))
        owner.append(np.repeat(macro, len(ends)))
    side, owners = _one_number(np.concatenate(sides)), np.concatenate(owner)
    order = np.argsort(side, kind="stable")
    side, owners = side[order], owners[order]
    shared = side[1:] == side[:-1]
    pairs = np.stack([owners[:-1], owners[1:]], axis=1)[shared]
    alone = ~(np.append(shared, False) | np.append(False, shared))
    rim = np.bincount(owners[alone], minlength=len(zone.area)) > 0
    pairs = np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1)
    return pairs[np.unique(_one_number(pairs), return_index=True)[1]], rim


def _one_number(rows: np.ndarray) -> np.ndarray:
    """A number (n,) for each row (n, 1 or 2) of whole numbers: ascending as the rows are."""
    return rows[:, 0].astype(np.int64) * (1 + rows.max(initial=0)) + rows[:, -1]


def _nodes(zone: ZoneResult, nodal: NodalContact) -> Neighbours:
    """Multipliers that follow each other along the edges of faces, in 2D along the faces."""
    steps = []
    for name, nodes, _ in zone.faces:
        kind = cell_type(name)
        path = nodes[:, kind.boundary if kind.dim == 1 else (*kind.boundary, kind.boundary[0])]
        own = np.searchsorted(nodal.nodes, path[:, np.isin(path[0], nodal.nodes)])
        steps.append(np.stack([own[:, :-1], own[:, 1:]], axis=-1).reshape(-1, 2))
    pairs, times = np.unique(np.sort(np.concatenate(steps), axis=1), axis=0, return_counts=True)
    if zone.centre.shape[1] == 2:
        rim = np.bincount(pairs.ravel(), minlength=len(nodal.nodes)) < 2
    else:
        rim = np.bincount(pairs[times == 1].ravel(), minlength=len(nodal.nodes)) > 0
    return pairs, rim
