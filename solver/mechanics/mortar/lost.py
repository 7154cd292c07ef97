"""Which area of macro-elements has lost its partner: a measure that is independent of segments.

It is found by lines through points of the faces, a route that shares nothing with the segments but
the projection onto a face.
"""

from collections.abc import Sequence

import numpy as np

from ...lac.cells.gauss import gauss_rule
from ...lac.facets import Facets
from ...lac.partners import MISSED, bare_faces, extents, missed_area
from ...lac.segments import Segments
from ...lac.surface_points import Samples, sampled
from .lines import all_hits

# Lines through so many Gauss points each way tell whether a face lies within the master's outline.
_LINES = 4


def _lines(block: Facets) -> Samples:
    """Points of faces: their nodes, without weight, and Gauss points.

    If all see the master, so does the whole face.
    """
    places, weights = gauss_rule(block.type.name, _LINES)
    nodes = block.type.nodes
    rule = np.concatenate([nodes, places]), np.concatenate([np.zeros(len(nodes)), weights])
    return sampled(block, rule)


def without_partner(
    slaves: Sequence[Facets],
    masters: Sequence[Facets],
    samples: Sequence[Samples],
    found: Sequence[Segments],
    reach: float,
    n_macro: int,
) -> np.ndarray:
    """The area (m,) of macro-elements that lies opposite the master but in no segment.

    Of faces that are not covered whole, lines along the normal tell how much is opposite a master
    face: one that looks at the point, and is no farther from the segments of the macro-element
    than its own size. What lies beyond is a step. Faces that the master's edge crosses are known
    to one of their points.

    >>> samples, found = face_samples([slave]), meet_in_segments([slave], [], [master], 1.0)
    >>> both = [slave], [master], samples
    >>> [without_partner(*both, some, 1.0, 1).round(12).tolist()
    ...  for some in (found, [found[0].of(np.array([0]))])]
    [[0.0], [1.0]]
    """
    lost = np.zeros(n_macro)
    missed = missed_area(samples, found)
    bare = bare_faces(samples, missed)
    if not any(len(faces) for faces in bare):
        return lost
    low, high = np.full(n_macro, np.inf), np.full(n_macro, -np.inf)
    for segments in found:
        np.minimum.at(low, segments.macro, segments.gap.min(axis=1))
        np.maximum.at(high, segments.macro, segments.gap.max(axis=1))
    size = extents(slaves, n_macro)
    low, high = (np.where(high < low, sign * reach, x) for x, sign in ((low, -1), (high, 1)))
    for a, (block, faces) in enumerate(zip(slaves, bare, strict=True)):
        if not len(faces):
            continue
        sample = _lines(block)
        point, gap = all_hits(block, sample, masters, reach, faces)
        face = point // len(sample.values)
        macro = block.number[face]
        near = (gap >= low[macro] - size[macro]) & (gap <= high[macro] + size[macro])
        met = np.zeros(sample.weight.shape, dtype=bool)
        met.flat[point[near]] = True
        opposite = np.where(met, sample.weight, 0.0).sum(axis=1)[faces]
        whole, largest = sample.weight.sum(axis=1)[faces], sample.weight.max(axis=1)[faces]
        # The edge of the master is known to the share of one row of points.
        unsure = np.where(met[faces].all(axis=1), 0.0, _LINES ** (block.type.dim - 1) * largest)
        beyond = opposite - (whole - missed[a][faces]) - unsure
        np.add.at(lost, block.number[faces], np.where(beyond > MISSED * whole, beyond, 0.0))
    return lost
