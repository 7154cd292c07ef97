"""Small contact surfaces face to face, for the tests of gap operators."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.shape import shape_functions
from solver.lac.facets import facets
from solver.mechanics.linear import choice
from solver.simulation.equilibrium import constraints


def segment_pair(slave_x, master_x, height=0.0):
    """Slave edges on y = 0 facing up over master edges on y = `height` facing down."""
    slave = np.array([[x, 0.0] for x in slave_x])
    master = np.array([[x, height] for x in master_x])
    points = np.vstack([slave, master])
    # Outward normals: up for edges walked to the left, down for edges walked to the right.
    down = len(slave) + np.array([[i, i + 1] for i in range(len(master) - 1)])
    up = np.array([[i + 1, i] for i in range(len(slave) - 1)])
    kind = BY_NAME["SEG2"]
    return (
        points,
        facets(points, kind, up, np.arange(len(up))),
        facets(points, kind, down, np.arange(len(down))),
    )


def square_pair(slave_type, master_type, seed=0):
    """One slave face over four master faces of the unit square, distorted inside the plane."""
    rng = np.random.default_rng(seed)
    low, high = BY_NAME[slave_type], BY_NAME[master_type]
    slave = np.column_stack([low.nodes, np.zeros(low.n_nodes)])
    corner = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5]])
    middle = np.array([0.5, 0.5]) + rng.uniform(0.1, 0.2, 2) * rng.choice([-1, 1], 2)
    corner = np.vstack([corner, middle])
    quads = [(0, 7, 8, 4), (4, 8, 5, 1), (8, 6, 2, 5), (7, 3, 6, 8)]  # facing down
    points, faces = [], []
    for quad in quads:
        values = shape_functions("QUAD4").values(high.nodes)
        faces.append(np.arange(high.n_nodes) + sum(map(len, points)))
        points.append(values @ corner[list(quad)])
    master = np.column_stack([np.vstack(points), np.zeros(4 * high.n_nodes)])
    all_points = np.vstack([slave, master])
    up = np.arange(low.n_nodes)[None]
    down = np.array(faces) + len(slave)
    return (
        all_points,
        facets(all_points, low, up, np.array([0])),
        facets(all_points, high, down, np.arange(4)),
    )


@contextmanager
def force_solver(kind):
    """Within the block every system is solved by `cholmod` or `multigrid`; with `auto` as it is."""

    def asked(size, unknowns):
        return choice_of(size, replace(unknowns, solver=kind))

    choice_of = choice.against_multigrid
    with pytest.MonkeyPatch.context() as patch:
        for module in (choice, constraints):
            patch.setattr(module, "against_multigrid", asked)
        yield
