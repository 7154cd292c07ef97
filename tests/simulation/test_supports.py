"""Supports as a change of unknowns: axes, planes of any direction, clashes."""

import numpy as np
import pytest

from solver.mechanics.fem.supports import Fixed, SupportClashError, free_motion


def fixed(nodes, direction, value=0.0):
    direction = np.array(direction, dtype=float)
    n = len(nodes)
    return Fixed(np.array(nodes), np.tile(direction, (n, 1)), np.full(n, value))


def test_axes_pick_degrees_of_freedom():
    free = free_motion(3, 2, [fixed([0, 2], [1, 0], 0.5), fixed([0], [0, 1])])
    assert free.selection.tolist() == [2, 3, 5]
    assert free.offset.tolist() == [0.5, 0, 0, 0, 0.5, 0]


def test_a_tilted_plane_leaves_what_lies_in_it():
    normal = np.array([0.6, 0.8, 0.0])
    free = free_motion(2, 3, [fixed([1], normal, 2.0)])
    assert free.basis.shape == (6, 5)
    basis = free.basis.toarray()
    assert np.allclose(basis.T @ basis, np.eye(5), atol=1e-15)
    assert np.allclose(normal @ basis[3:], 0, atol=1e-15)
    assert normal @ free.offset[3:] == pytest.approx(2.0)


def test_two_tilted_planes_and_an_axis_hold_a_node_fully():
    parts = [fixed([0], d, v) for d, v in (([0.6, 0.8, 0], 1.0), ([0, 0.6, 0.8], 2.0))]
    parts.append(fixed([0], [0, 0, 1], 3.0))
    free = free_motion(1, 3, parts)
    assert free.basis.shape == (3, 0)
    for part in parts:
        assert part.directions[0] @ free.offset == pytest.approx(part.values[0], rel=1e-13)


def test_the_same_support_twice_is_one_and_another_value_is_refused():
    same = [fixed([0], [1, 0], 0.5), fixed([0, 1], [1, 0], 0.5)]
    assert free_motion(2, 2, same).selection.tolist() == [1, 3]
    clash = [fixed([0], [1, 0], 0.5), fixed([0], [1, 0], 0.25)]
    with pytest.raises(SupportClashError, match="1 nodes are given another displacement") as error:
        free_motion(2, 2, clash)
    assert (error.value.number, error.value.value) == (1, 0.25)
