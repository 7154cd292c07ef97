"""Sizes that the reconstruction of a pressure rests on, and fits along rows of faces."""

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.neighbours import vertex_neighbours
from solver.lac.facets import facets
from solver.lac.operator import gap_operator, meet_in_segments
from solver.lac.reconstruction import FORMS, Local, Moments, reconstruct
from solver.lac.recovery import moments


def test_the_size_of_rings():
    """Macro-elements of axisymmetric faces are as large as their section is long, 2 and 1."""
    points = np.array([[3.0, 0.0], [5.0, 0.0], [6.0, 0.0], [3.0, 0.1], [6.0, 0.1]])
    kind = BY_NAME["SEG2"]
    slave = facets(points, kind, np.array([[1, 0], [2, 1]]), np.arange(2), axisymmetric=True)
    master = facets(points, kind, np.array([[3, 4]]), np.arange(1), axisymmetric=True)
    found = meet_in_segments([slave], [], [master], 9.0, degree=1)
    surface = gap_operator([slave], [master], 2, len(points), 9.0).surface
    axes = moments(found, surface).local.axes[:, 0]
    # By the radius of their centroids, a little beyond the middle.
    assert 1 / np.linalg.norm(axes, axis=1) == pytest.approx([2.0, 1.0], rel=0.03)


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2])
def test_a_row_of_faces_in_space_has_slopes_along_it(angle):
    """Five squares in a row, turned by an angle: the pressure falls by 3 a face, and not across."""
    along, across = (np.cos(angle), np.sin(angle), 0.0), (-np.sin(angle), np.cos(angle), 0.0)
    frame = np.tile(np.eye(3)[:2], (5, 1, 1))
    row = Moments(
        share=np.ones(5),
        spread=np.tile(sum(np.outer(e, e) for e in (along, across)) / 12, (5, 1, 1)),
        normal=np.tile(np.eye(3)[2], (5, 1)),
        local=Local(
            centre=np.arange(5)[:, None] * np.array(along),
            axes=frame,
            spread=np.tile(np.eye(2) / 12, (5, 1, 1)),
        ),
    )
    near = vertex_neighbours([(np.arange(5), np.arange(5)[:, None] + np.arange(2))], 5)
    found = reconstruct(row, near, np.ones(5, dtype=bool), FORMS["none"])
    slopes = (found.matrix @ (20 - 3.0 * np.arange(5))).reshape(5, -1)[:, :2]
    assert slopes == pytest.approx(np.tile(-3 * np.array(along)[:2], (5, 1)), abs=1e-12)
