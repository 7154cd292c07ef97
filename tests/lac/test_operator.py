"""Gap operators of small patches, derived by hand, and what every gap operator must keep."""

from dataclasses import replace

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.facets import facets, with_nodal_normals
from solver.lac.multipliers import shape_integrals
from solver.lac.operator import LAC, _reaches, gap_operator
from solver.lac.pairing import candidate_pairs
from solver.lac.partners import sampled
from tests.patches import segment_pair, square_pair


def vertical(operator, n_points):
    return operator.matrix.toarray().reshape(-1, n_points, 2)[..., 1]


def test_one_slave_edge_over_two_master_edges_by_hand():
    """Slave [0, 3] over master [0, 1], [1, 3]: ∫ N of hats with feet at the master nodes."""
    points, slave, master = segment_pair([0.0, 3.0], [0.0, 1.0, 3.0])
    operator = gap_operator([slave], [master], 1, len(points), 1.0)
    assert vertical(operator, 5)[0] == pytest.approx([-1.5, -1.5, 0.5, 1.5, 1.0], rel=1e-15)
    assert np.abs(operator.matrix.toarray().reshape(5, 2)[:, 0]).max() < 1e-15
    assert operator.area == pytest.approx([3.0])
    assert operator.covered == pytest.approx([3.0])
    assert operator.surface.normal[0] == pytest.approx([0.0, 1.0])


def test_overlapping_edges_by_hand():
    """Slave [0, 1], [1, 2] over one master edge [0.5, 2]: partly covered, hats integrated by hand.

    On [0.5, 1] the slave hats 1 − x and x give 1/8 and 3/8; the master hats (2 − x)/1.5 and
    (x − 0.5)/1.5 give 5/12 and 1/12. On [1, 2] the slave's give 1/2 each, the master's 1/3, 2/3.
    """
    points, slave, master = segment_pair([0.0, 1.0, 2.0], [0.5, 2.0])
    operator = gap_operator([slave], [master], 2, len(points), 1.0)
    assert vertical(operator, 5) == pytest.approx(
        np.array([[-1 / 8, -3 / 8, 0, 5 / 12, 1 / 12], [0, -1 / 2, -1 / 2, 1 / 3, 2 / 3]]),
        abs=1e-15,
    )
    assert operator.covered == pytest.approx([0.5, 1.0])


def test_gap_is_positive_when_open_and_negative_when_overlapping():
    for height in (0.25, -0.25):
        points, slave, master = segment_pair([0.0, 2.0], [0.0, 1.0, 2.0], height)
        operator = gap_operator([slave], [master], 1, len(points), 1.0)
        assert operator.initial == pytest.approx([2.0 * height], rel=1e-15)


def test_surfaces_beyond_the_search_distance_do_not_meet():
    points, slave, master = segment_pair([0.0, 2.0], [0.0, 1.0, 2.0], 0.5)
    assert gap_operator([slave], [master], 1, len(points), 0.4).segments == 0
    assert gap_operator([slave], [master], 1, len(points), 0.6).segments == 2


def test_faces_that_look_the_same_way_do_not_meet():
    points, slave, master = segment_pair([0.0, 2.0], [0.0, 2.0])
    turned = facets(points, master.type, master.nodes[:, ::-1], master.number)
    assert gap_operator([slave], [turned], 1, len(points), 1.0).segments == 0


@pytest.mark.parametrize("slave_type", ["QUAD4", "QUAD8", "QUAD9"])
@pytest.mark.parametrize("master_type", ["QUAD4", "QUAD8", "QUAD9"])
def test_skew_master_faces_get_their_exact_integrals(slave_type, master_type):
    points, slave, master = square_pair(slave_type, master_type)
    assert not master.affine.any()
    exact = shape_integrals(master)
    parts = [
        facets(points, master.type, master.nodes[k], master.number[k]) for k in ([0, 1], [2, 3])
    ]
    for blocks in ([master], parts):
        operator = gap_operator([slave], blocks, 1, len(points), 1.0)
        entries = operator.matrix.toarray().reshape(-1, 3)[:, 2]
        assert entries[master.nodes] == pytest.approx(exact, abs=1e-15)
        assert -entries[slave.nodes] == pytest.approx(shape_integrals(slave), abs=1e-15)
    # and without the closure they are missed by far more than round-off
    rough = gap_operator([slave], [master], 1, len(points), 1.0, replace(LAC, closure=False))
    missed = rough.matrix.toarray().reshape(-1, 3)[:, 2][master.nodes] - exact
    assert np.abs(missed).max() > 1e-12


@pytest.mark.parametrize("types", [("QUAD4", "QUAD8"), ("QUAD9", "QUAD4")])
def test_linear_displacements_of_both_sides_open_no_gap(types):
    points, slave, master = square_pair(*types)
    operator = gap_operator([slave], [master], 1, len(points), 1.0)
    rng = np.random.default_rng(1)
    for _ in range(5):
        field = points @ rng.normal(size=(3, 3)) + rng.normal(size=3)
        assert operator.matrix @ field.ravel() == pytest.approx([0.0], abs=1e-14)


def test_contact_forces_balance_in_force_and_moment_across_a_tilted_gap():
    points, slave, master = square_pair("QUAD4", "QUAD8")
    tilted = points.copy()
    tilted[4:, 2] = 0.05 + 0.1 * points[4:, 0]
    lower = facets(tilted, slave.type, slave.nodes, slave.number)
    upper = facets(tilted, master.type, master.nodes, master.number)
    operator = gap_operator([lower], [upper], 1, len(points), 1.0)
    force = operator.matrix.toarray().reshape(-1, 3)
    assert np.abs(force.sum(axis=0)).max() < 1e-14
    assert np.abs(np.cross(tilted, force).sum(axis=0)).max() < 1e-14
    assert operator.initial == pytest.approx([0.05 + 0.05], rel=1e-13)


def test_pairs_are_all_that_come_near_whatever_their_sizes():
    rng = np.random.default_rng(5)
    for _ in range(20):
        a, b = rng.uniform(0, 10, (40, 3)), rng.uniform(0, 10, (70, 3))
        r, s = 10 ** rng.uniform(-2, 0.5, 40), 10 ** rng.uniform(-2, 0.5, 70)
        distance = np.linalg.norm(a[:, None] - b[None], axis=2)
        wanted = np.argwhere(distance <= r[:, None] + s[None] + 0.1)
        found = np.column_stack(candidate_pairs(a, r, b, s, 0.1))
        assert found.tolist() == wanted.tolist()


def test_faces_are_looked_for_at_the_distance_of_usual_ones_first():
    """Of graded edges, then of even ones, then beside a rigid surface, a face without end."""
    kind = BY_NAME["SEG2"]
    places = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [204.0, 0.0]])
    graded = facets(places, kind, np.array([[0, 1], [1, 2], [2, 3]]), np.arange(3))
    even = facets(places, kind, np.array([[0, 1], [1, 2]]), np.arange(2))
    # Radii 1, 1 and 100: first within 100 / 8² of the usual radius 1.
    assert _reaches([graded], 300.0) == [100 / 64, 12.5, 100.0, 300.0]
    assert _reaches([graded], 50.0) == [100 / 64, 12.5, 50.0]
    assert _reaches([even], 300.0) == [1.0, 300.0]
    endless = replace(even, radius=np.array([1.0, np.inf]))
    assert _reaches([endless], 300.0) == [300.0]


def test_pairs_grow_with_the_faces_alone():
    """One coarse face over n fine ones, and a matching pair of surfaces: pairs ∝ n."""
    counts = []
    for n in (10, 20, 40):
        x = (np.arange(n) + 0.5) / n
        centre = np.array([[a, b, 0.0] for a in x for b in x])
        radius = np.full(n * n, 0.75 / n)
        counts.append(len(candidate_pairs(centre, radius, centre, radius, 0.0)[0]) / n**2)
    assert counts[2] < 1.2 * counts[1] < 1.44 * counts[0] * 1.2


def roof(rise):
    """Two slave edges that meet at the height `rise` over x = 0, under a flat master above."""
    points = np.array([[-1.0, 0.0], [0.0, rise], [1.0, 0.0], [-2.0, 1.0], [2.0, 1.0]])
    kind = BY_NAME["SEG2"]
    slave = facets(points, kind, np.array([[1, 0], [2, 1]]), np.arange(2))
    return points, slave, facets(points, kind, np.array([[3, 4]]), np.arange(1))


def test_nodal_normals_are_the_means_of_the_faces_around_a_node():
    points, slave, _ = roof(0.5)
    (bent,) = with_nodal_normals([slave], points)
    own = np.array([-0.5, 1.0]) / np.hypot(0.5, 1)
    assert bent.directions[0] == pytest.approx(np.array([[0.0, 1.0], own]), abs=1e-15)
    points, flat, _ = roof(0.0)
    assert with_nodal_normals([flat], points)[0].directions is None


def test_the_gap_is_measured_along_nodal_normals():
    """Over the face (−1, 0)–(0, ½), at the share s of its length, the gap is (1 − s/2)/cos.

    cos being the height of the unit vector between (−½, 1)/√1.25 (s = 0) and (0, 1) (s = 1).
    """
    points, slave, master = roof(0.5)
    operator = gap_operator(with_nodal_normals([slave], points), [master], 2, len(points), 4.0)
    share, weight = np.polynomial.legendre.leggauss(20)
    share, length = (share + 1) / 2, np.sqrt(1.25)
    along = np.stack([-(1 - share) / 2 / length, (1 - share) / length + share])
    expected = weight / 2 * length @ ((1 - share / 2) * np.linalg.norm(along, axis=0) / along[1])
    assert operator.initial == pytest.approx([expected, expected], rel=1e-7)


@pytest.mark.parametrize("rise", [0.3, 0.7])
def test_nodal_normals_keep_forces_and_moments_in_balance(rise):
    points, slave, master = roof(rise)
    points[3:, 1] += [0.2, -0.1]
    master = facets(points, BY_NAME["SEG2"], master.nodes, np.arange(1))
    operator = gap_operator(with_nodal_normals([slave], points), [master], 2, len(points), 4.0)
    rotation = np.stack([-points[:, 1], points[:, 0]], axis=1)
    for motion in (np.tile([1.0, 0.0], 5), np.tile([0.0, 1.0], 5), rotation.ravel()):
        assert operator.matrix @ motion == pytest.approx(np.zeros(2), abs=1e-14)
    assert operator.closed_faces == 0


def test_a_keel_on_a_trapezium_has_forces_and_moments_in_balance():
    """Both slopes see it at the same angle, not along one normal: nothing closes its integrals."""
    trapezium = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.6, 1.0, 0.0), (-0.6, 1.0, 0.0)]
    keel = [(x, y, abs(x) / 4) for y in (-2.0, 2.0) for x in (-2.0, 0.0, 2.0)]
    points, kind = np.array(trapezium + keel), BY_NAME["QUAD4"]
    slave = facets(points, kind, np.array([[4, 7, 8, 5], [5, 8, 9, 6]]), np.arange(2))
    master = facets(points, kind, np.array([[0, 1, 2, 3]]), np.arange(1))
    operator = gap_operator([slave], [master], 2, len(points), 4.0)
    assert operator.covered == pytest.approx([1.6 / np.hypot(1, 1 / 4)] * 2)
    for axis in np.eye(3):
        for motion in (np.tile(axis, (len(points), 1)), np.cross(axis, points)):
            assert operator.matrix @ motion.ravel() == pytest.approx(np.zeros(2), abs=1e-12)
    assert operator.closed_faces == 0


def test_on_the_axis_a_face_has_a_normal_but_no_area():
    points = np.array([[2.0, 1.0], [0.0, 1.0]])
    edge = facets(points, BY_NAME["SEG2"], np.array([[0, 1]]), np.array([0]), axisymmetric=True)
    sample = sampled(edge, (np.array([[0.0], [0.5], [1.0]]), np.ones(3)))
    assert sample.normal[0] == pytest.approx(np.tile([0.0, 1.0], (3, 1)))
    assert sample.weight[0] == pytest.approx([8 * np.pi, 4 * np.pi, 0.0])
