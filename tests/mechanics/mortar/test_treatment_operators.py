"""The operators of the treatments on small patches: derived by hand, and what all must keep."""

import numpy as np
import pytest

from solver.lac.multipliers import shape_integrals
from solver.lac.operator import gap_operator
from solver.mechanics.mortar.treatments import TREATMENTS, scheme_of
from tests.patches import segment_pair, square_pair


def operator_of(patch, treatment, points=None, n_macro=1):
    places, slave, master = patch
    scheme = scheme_of(treatment, points)
    return gap_operator([slave], [master], n_macro, len(places), 1.0, scheme)


def upward(operator):
    """The entries (k, n_points) for displacements along the last axis of a flat patch."""
    dim = operator.surface.centre.shape[1]
    return operator.matrix.toarray().reshape(len(operator.initial), -1, dim)[..., -1]


def test_standard_mortar_matrices_by_hand():
    """Slave [0, 2] over master [0, 1], [1, 2]: D = 2/6 (2 1; 1 2), M the integrals of hats."""
    operator = operator_of(segment_pair([0.0, 2.0], [0.0, 1.0, 2.0]), "nodal")
    D = np.array([[2 / 3, 1 / 3], [1 / 3, 2 / 3]])
    M = np.array([[5 / 12, 1 / 2, 1 / 12], [1 / 12, 1 / 2, 5 / 12]])
    assert upward(operator) == pytest.approx(np.hstack([-D, M]), abs=1e-15)
    assert operator.area == pytest.approx([1.0, 1.0])
    assert operator.covered == pytest.approx([1.0, 1.0])
    assert operator.mean.toarray() == pytest.approx(np.array([[0.5, 0.5]]))
    assert operator.nodes.tolist() == [0, 1]


def test_dual_mortar_matrices_by_hand():
    """The same with φ = 2 − 3x/2 and its mirror image: D is diagonal to the bit."""
    operator = operator_of(segment_pair([0.0, 2.0], [0.0, 1.0, 2.0]), "nodal_dual")
    entries = upward(operator)
    M = np.array([[3 / 4, 1 / 2, -1 / 4], [-1 / 4, 1 / 2, 3 / 4]])
    assert entries[:, :2] == pytest.approx(-np.eye(2), abs=1e-15)
    assert np.count_nonzero(entries[:, :2]) == 2
    assert entries[:, 2:] == pytest.approx(M, abs=1e-15)


def test_dual_functions_belong_to_the_covered_part():
    """Slave [0, 1], [1, 2] over master [0.5, 2]: D holds ∫ N over the covered part alone.

    ∫ N on [0.5, 1] is 1/8 and 3/8, on [1, 2] it is 1/2 each.
    """
    patch = segment_pair([0.0, 1.0, 2.0], [0.5, 2.0])
    operator = operator_of(patch, "nodal_dual", n_macro=2)
    entries = upward(operator)
    assert entries[:, :3] == pytest.approx(-np.diag([1 / 8, 7 / 8, 1 / 2]), abs=1e-15)
    assert np.count_nonzero(entries[:, :3]) == 3
    assert operator.covered == pytest.approx([1 / 8, 7 / 8, 1 / 2])
    assert operator.area == pytest.approx([1 / 2, 1, 1 / 2])
    assert operator.surface.covered == pytest.approx([0.5, 1.0])


def test_node_to_segment_by_hand():
    """Slave nodes 0, 2, 3 on the master edge [0, 3]: each sees its place, times its share."""
    operator = operator_of(segment_pair([0.0, 2.0, 3.0], [0.0, 3.0]), "node_to_segment", n_macro=2)
    D = np.diag([1.0, 1.5, 0.5])
    M = np.array([[1.0, 0.0], [0.5, 1.0], [0.0, 0.5]])
    assert upward(operator) == pytest.approx(np.hstack([-D, M]), abs=1e-15)
    assert operator.area == pytest.approx([1.0, 1.5, 0.5])
    assert operator.mean.toarray() == pytest.approx(np.array([[0.5, 0.5, 0], [0, 0.5, 0.5]]))


def test_a_slave_node_beyond_the_master_meets_nothing():
    patch = segment_pair([0.0, 1.0, 3.0], [0.5, 3.0])
    operator = operator_of(patch, "node_to_segment", n_macro=2)
    assert operator.covered == pytest.approx([0.0, 1.5, 1.0])
    # but one that misses by less than a twentieth of a face counts as on its edge
    patch = segment_pair([0.0, 1.0, 3.0], [0.1, 3.0])
    operator = operator_of(patch, "node_to_segment", n_macro=2)
    assert operator.covered == pytest.approx([0.5, 1.5, 1.0])


def test_quadrature_by_hand():
    """Slave [0, 3] over master [0, 1], [1, 3]: one point at 1.5, or two at 1.5 ± √3/2."""
    patch = segment_pair([0.0, 3.0], [0.0, 1.0, 3.0])
    one = upward(operator_of(patch, "quadrature", 1))
    assert one == pytest.approx(np.array([[-1.5, -1.5, 0.0, 2.25, 0.75]]), abs=1e-15)
    two = upward(operator_of(patch, "quadrature", 2))
    low, high = 1.5 - np.sqrt(3) / 2, 1.5 + np.sqrt(3) / 2
    share = (high - 1) / 2
    expected = [-1.5, -1.5, 1.5 * (1 - low), 1.5 * (low + 1 - share), 1.5 * share]
    assert two == pytest.approx(np.array([expected]), abs=1e-15)


@pytest.mark.parametrize("n", [2, 4, 8])
def test_points_that_miss_the_master_are_not_covered(n):
    """Half of the slave edge lies over the master: so do half of the points, by weight."""
    operator = operator_of(segment_pair([0.0, 2.0], [1.0, 2.0]), "quadrature", n)
    assert operator.covered == pytest.approx([1.0])
    assert operator.area == pytest.approx([2.0])


def test_linear_multipliers_on_quadratic_faces_weigh_the_vertices_alone():
    for kind in ("QUAD8", "QUAD9"):
        operator = operator_of(square_pair(kind, "QUAD4"), "nodal")
        assert operator.area == pytest.approx(np.full(4, 0.25))
        assert operator.nodes.tolist() == [0, 1, 2, 3]
        assert operator.mean.toarray() == pytest.approx(np.full((1, 4), 0.25))


KINDS = ["QUAD4", "QUAD8", "QUAD9"]
EXISTING = [(name, kind) for name, t in TREATMENTS.items() for kind in KINDS if kind in t.faces]


@pytest.mark.parametrize(("treatment", "kind"), EXISTING)
def test_every_treatment_keeps_linear_fields_forces_and_moments(treatment, kind):
    """No linear displacement of both bodies opens a gap; contact forces are in balance."""
    patch = square_pair(kind, "QUAD8")
    operator = operator_of(patch, treatment)
    rng = np.random.default_rng(1)
    for _ in range(3):
        field = patch[0] @ rng.normal(size=(3, 3)) + rng.normal(size=3)
        assert operator.matrix @ field.ravel() == pytest.approx(0.0, abs=1e-14)
    for row in operator.matrix.toarray():
        force = row.reshape(-1, 3)
        assert np.abs(force.sum(axis=0)).max() < 4e-15
        assert np.abs(np.cross(patch[0], force).sum(axis=0)).max() < 4e-15
    assert operator.covered.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("treatment", "kind"), [pair for pair in EXISTING if "nodal" in pair[0]])
@pytest.mark.parametrize("master_kind", KINDS)
def test_a_uniform_pressure_gives_the_exact_forces_on_skew_faces(treatment, kind, master_kind):
    patch = square_pair(kind, master_kind)
    force = upward(operator_of(patch, treatment)).sum(axis=0)
    assert force[patch[2].nodes] == pytest.approx(shape_integrals(patch[2]), abs=2e-15)
    assert -force[patch[1].nodes] == pytest.approx(shape_integrals(patch[1]), abs=2e-15)


def test_points_miss_the_exact_forces():
    """What exact segments are for: neither points nor nodes give the forces on the master.

    Each master face has nodes of its own here, whose functions end with a jump: the error of n
    points each way falls as 1/n.
    """
    patch = square_pair("QUAD4", "QUAD4")
    exact = shape_integrals(patch[2])
    missed = {}
    for treatment, points in (("node_to_segment", None), *(("quadrature", n) for n in (2, 4, 16))):
        force = upward(operator_of(patch, treatment, points)).sum(axis=0)[patch[2].nodes]
        missed[points] = np.abs(force - exact).max()
    assert missed[None] > 0.01
    assert missed[2] > 1e-3
    assert 1 / 16 < missed[16] / missed[2] < 1 / 4
