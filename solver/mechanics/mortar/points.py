"""Points of the slave surface projected to the master: no intersections.

Each point belongs to the one master face that the slave's normal through it meets. With Gauss
points this is segment-free (element-based) integration of the mortar integrals: Fischer, Wriggers,
Frictionless 2D contact formulations for finite deformations based on the mortar method, Comput.
Mech. 36 (2005) 226–244; Farah, Popp, Wall, Segment-based vs. element-based integration for mortar
methods, Comput. Mech. 55 (2015) 209–228. With the slave nodes, each weighted with its tributary
area, it is the node-to-segment method: Hughes, Taylor, Sackman, Curnier, Kanoknukulchai, A finite
element method for a class of contact-impact problems, CMAME 8 (1976) 249–276; Wriggers,
Computational Contact Mechanics, 2006, §9.
"""

from collections.abc import Sequence

import numpy as np

from ...lac.cells.faces import nodal_normals
from ...lac.cells.gauss import gauss_rule
from ...lac.cells.shape import shape_functions
from ...lac.facets import Facets
from ...lac.multipliers import InterfaceData, Multipliers
from ...lac.pairing import facing_pairs
from ...lac.segments import Segments, Side
from ...lac.surface_points import Samples, face_samples, sampled
from .lines import EDGE, Hits, meet
from .nodal import of_nodes

Among = Sequence[np.ndarray] | None


def gauss(slaves: list[Facets], n: int) -> list[Samples]:
    """Gauss points, n each way on each face, collapsed ones on triangles: degree 2 n − 1.

    >>> gauss([slave], 1)[0].weight.tolist()
    [[2.0]]
    """
    return [sampled(block, gauss_rule(block.type.name, n)) for block in slaves]


def at_nodes(slaves: list[Facets]) -> list[Samples]:
    """The nodes, weighted with ∫ N over each face, their normals the mean around them.

    >>> at_nodes([master])[0].weight.round(15).tolist()
    [[0.5, 0.5], [0.5, 0.5]]
    """
    nodes = np.unique(np.concatenate([block.nodes.ravel() for block in slaves]))
    places = np.empty((len(nodes), slaves[0].centre.shape[1]))
    numbers = [np.searchsorted(nodes, block.nodes) for block in slaves]
    for block, number in zip(slaves, numbers, strict=True):
        places[number] = block.corner
    faces = [(block.type.name, number) for block, number in zip(slaves, numbers, strict=True)]
    normal = nodal_normals(places, faces)
    return [
        Samples(
            values=np.eye(block.type.n_nodes),
            weight=whole.weight @ whole.values,
            normal=normal[number],
        )
        for block, number, whole in zip(slaves, numbers, face_samples(slaves), strict=True)
    ]


def one_each(data: InterfaceData) -> Multipliers:
    """A multiplier at each slave node: its pressure is the node's force over tributary area.

    >>> one_each(InterfaceData(slaves=[master], samples=[], found=[], n_macro=2)).number[0].tolist()
    [[0, 1], [1, 2]]
    """
    shapes = [np.eye(block.type.n_nodes) for block in data.slaves]
    return of_nodes([block.nodes for block in data.slaves], shapes)


def meet_at_points(
    slaves: list[Facets],
    samples: list[Samples],
    masters: list[Facets],
    reach: float,
    among: Among = None,
    beyond: float = EDGE,
) -> list[Segments]:
    """Each point with its master face, as segments of one point.

    A point that no face holds goes to one that it misses by at most `beyond`, in parts of the
    face's reference face: slave nodes at the end of a bent surface look past the master's end.

    One Gauss point at x = 1, where it meets the first of two edges that end there:

    >>> (segments,) = meet_at_points([slave], gauss([slave], 1), [master], 1.0)
    >>> segments.weight.tolist(), segments.gap.tolist(), segments.master.values.tolist()
    ([[2.0]], [[0.5]], [[[0.0, 1.0]]])
    """
    found = []
    for a, (slave, sample) in enumerate(zip(slaves, samples, strict=True)):
        some = None if among is None else among[a]
        hits = [
            meet(slave, sample, master, reach, beyond, facing_pairs(slave, master, reach, some))
            for master in masters
        ]
        block = np.repeat(np.arange(len(masters)), [len(hit.point) for hit in hits])
        chosen = _nearest(hits)
        for b, (master, hit) in enumerate(zip(masters, hits, strict=True)):
            mine = hit.of(chosen[block == b])
            if len(mine.point):
                found.append(_segments((slave, a), (master, b), sample, mine))
    return found


def _nearest(hits: list[Hits]) -> np.ndarray:
    """Which of all hits are the first choice of their points, as a mask.

    A hit inside a face goes before one beyond its edge, then a near one before a far one.
    """
    point, gap, outside = (
        np.concatenate([getattr(hit, key) for hit in hits]) for key in ("point", "gap", "outside")
    )
    order = np.lexsort((np.abs(gap), np.maximum(outside, EDGE), point))
    first = order[np.flatnonzero(np.diff(point[order], prepend=-1))]
    chosen = np.zeros(len(point), dtype=bool)
    chosen[first] = True
    return chosen


def _segments(
    slave: tuple[Facets, int], master: tuple[Facets, int], sample: Samples, hit: Hits
) -> Segments:
    face, q = np.divmod(hit.point, len(sample.values))
    on_master = shape_functions(master[0].type.name).values(hit.place)[:, None]
    return Segments(
        slave=Side(faces=slave[0], index=slave[1], face=face, values=sample.values[q][:, None]),
        master=Side(faces=master[0], index=master[1], face=hit.face, values=on_master),
        weight=sample.weight[face, q][:, None],
        normal=sample.normal[face, q][:, None],
        gap=hit.gap[:, None],
    )
