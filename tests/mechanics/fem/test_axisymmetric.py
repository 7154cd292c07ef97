"""Rings: stiffness, forces and contact integrals around an axis, by hand."""

import numpy as np
import pytest
from scipy import sparse

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.faces import surface_points
from solver.lac.cells.neighbours import vertex_neighbours
from solver.lac.facets import facets
from solver.lac.motions import rigid_motions, support_resistance, unheld_motion
from solver.lac.operator import gap_operator
from solver.lac.reconstruction import FORMS
from solver.lac.recovery import RecoveryRequest
from solver.mechanics.fem.elasticity import (
    Block,
    internal_force,
    stiffness,
)
from solver.mechanics.fem.faces import face_integrals
from solver.mechanics.fem.loads import body_forces, face_forces, stress_forces
from solver.mechanics.fem.mixed import split
from solver.mechanics.fem.stress import largest_strain, nodal_stress, sizes
from solver.mechanics.fem.supports import free_motion
from solver.mechanics.mortar.edge import contact_edges

PI = np.pi
LAME, SHEAR = 3.0, 2.0
# One QUAD4 over radii 1 to 3, heights 0 to 2: a ring of volume 16 π.
RING = np.array([(1, 0), (3, 0), (3, 2), (1, 2)], dtype=float)
CELL = np.array([[0, 1, 2, 3]])
BLOCK = Block(BY_NAME["QUAD4"], CELL, np.array([LAME]), np.array([SHEAR]), axisymmetric=True)


def energy(displacement):
    matrix = stiffness(RING, [BLOCK])
    assert abs(matrix - matrix.T).max() < 1e-12
    force = internal_force(RING, [BLOCK], displacement)
    assert matrix @ displacement.ravel() == pytest.approx(force.ravel(), abs=1e-11)
    return float((displacement * force).sum())


def test_energy_of_a_ring_that_widens_evenly():
    """u_r = r: strains 1 along r and around, σ:ε = 4 λ + 4 μ."""
    assert energy(RING * [1, 0]) == pytest.approx(16 * PI * (4 * LAME + 4 * SHEAR))


def test_energy_of_all_strains_together():
    """u = (r, 3 z + r): strains 1, 3, 1 and a shear of 1."""
    u = np.c_[RING[:, 0], 3 * RING[:, 1] + RING[:, 0]]
    by_hand = LAME * 5**2 + 2 * SHEAR * (1 + 9 + 1 + 2 * 0.25)
    assert energy(u) == pytest.approx(16 * PI * by_hand)


def test_a_push_outwards_strains_the_ring():
    """u_r = 1: the hoop strain is 1 / r, at the two Gauss points r = 2 ± 1 / √3."""
    r = 2 + np.array([-1, 1]) / np.sqrt(3)
    by_gauss = (LAME + 2 * SHEAR) * 2 * 2 * PI * (1 / r).sum()
    assert energy(np.tile([1.0, 0.0], (4, 1))) == pytest.approx(by_gauss)


def test_a_move_along_the_axis_is_free():
    assert np.abs(internal_force(RING, [BLOCK], np.tile([0.0, 7.0], (4, 1)))).max() < 1e-13


def test_stress_of_a_ring_has_a_hoop_component():
    """u = (2 r, r): strains 2, 0, 2 and a shear of 1."""
    u = np.c_[2 * RING[:, 0], RING[:, 0]]
    mean = LAME * 4
    expected = [mean + 4 * SHEAR, mean, mean + 4 * SHEAR, SHEAR, 0, 0]
    assert nodal_stress(RING, [BLOCK], u) == pytest.approx(np.tile(expected, (4, 1)))
    norm = np.sqrt(sum(x**2 for x in expected[:3]) + 2 * SHEAR**2)
    assert sizes(RING, [BLOCK], u).stress == pytest.approx(np.full(4, norm))


def test_the_largest_strain_may_be_around():
    """u_r = −1 at all radii: only the hoop strain, −1 / 2 in the middle."""
    strain, rotation = largest_strain(RING, [BLOCK], np.tile([-1.0, 0.0], (4, 1)))
    assert (strain, rotation) == (pytest.approx(0.5), 0.0)


def test_mean_stress_sees_the_whole_divergence():
    """B of u = (r, z): div u = 3, whatever is subtracted from displacements along the axis."""
    [block], mean = split(RING, [BLOCK], [np.array([True])], [np.array([0])])
    assert block.axisymmetric
    assert mean.size == 1
    opened = -mean.defect((RING + np.array([0.0, 5.0]))[None], np.zeros(1))
    assert opened == pytest.approx(3 * 16 * PI)
    assert mean.divergence @ RING.ravel() == pytest.approx(opened)
    assert mean.compliance == pytest.approx(16 * PI / LAME)


def test_pressure_on_a_disc():
    """∫ N p 2πr dr of hats over radii 0 to 2: 4π/3 at the axis, 8π/3 at the rim."""
    points = np.array([(0, 0), (2, 0)], dtype=float)
    one = lambda x: np.ones(len(x))  # noqa: E731
    force = face_forces(points, np.array([[1, 0]]), "SEG2", one, True, True)
    assert force == pytest.approx(np.array([(0, -4 * PI / 3), (0, -8 * PI / 3)]))
    stress = stress_forces(
        points, np.array([[1, 0]]), "SEG2", lambda x: np.tile([0, -1, 0, 0, 0, 0.0], (len(x), 1)),
        False, True,
    )  # fmt: skip
    assert stress == pytest.approx(force)


def test_quadratic_faces_put_no_force_on_the_axis():
    """∫ (1 − s)(1 − 2s) s ds = 0, the middle ∫ 4 s (1 − s) s ds = 1/3, the rim 1/6."""
    points = np.array([(1, 0), (0, 0), (0.5, 0)])
    values, whole = face_integrals(points, np.array([[0, 1, 2]]), "SEG3", True)
    assert values[0, :, 1] == pytest.approx(2 * PI * np.array([1 / 6, 0, 1 / 3]), abs=1e-15)
    assert whole[0] == pytest.approx([0, PI])


def test_body_force_sums_to_the_weight():
    force = body_forces(RING, CELL, "QUAD4", lambda x: np.tile([0.0, 2.0], (len(x), 1)), True)
    assert force.sum(axis=0) == pytest.approx([0, 32 * PI])


def test_means_over_a_disc_weight_the_rim():
    """The mean of r over a disc of radius 2 is 4/3."""
    points = np.array([(0, 0), (2, 0)], dtype=float)
    at = surface_points(points, [("SEG2", np.array([[1, 0]]), np.array([0]))], True)
    assert at.weight.sum() == pytest.approx(4 * PI)
    assert at.means(at.place[:, 0]) == pytest.approx(4 / 3)


def test_the_one_rigid_motion_of_a_ring():
    motions = rigid_motions(RING, np.zeros(4, dtype=int), axisymmetric=True)
    assert motions.toarray().reshape(4, 2).tolist() == [[0, 1]] * 4
    free = free_motion(4, 2, []).basis
    assert unheld_motion(support_resistance(motions, free), motions[:0], 1) == (0, "move along y")


def test_a_free_motion_is_named_without_round_off():
    """Rows that resist all motions of four nodes but the one along (1, 1e-18, -0.5)."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    motions = rigid_motions(points, np.zeros(4, dtype=int))
    along = np.array([1.0, 1e-18, -0.5])
    others = np.stack([np.cross(along, [0, 1, 0]), [0, 1, 0]])
    # About the centre of the points the turns are orthogonal to the translations.
    moves, turns = motions[:, :3], motions[:, 3:]
    held = sparse.vstack([(moves @ others.T).T, turns.T]).tocsr()
    supports = support_resistance(motions, sparse.eye_array(12).tocsr())
    found = unheld_motion(supports, held @ motions, 1)
    assert found == (0, "move along (1, 0, -0.5)")


def rings_under_a_disc():
    """A slave edge from 0 to 2 facing up, two master edges from 0 to 1 and 1 to 2 over it."""
    points = np.array([(0, 0), (2, 0), (0, 0.5), (1, 0.5), (2, 0.5)])
    kind = BY_NAME["SEG2"]
    slave = facets(points, kind, np.array([[1, 0]]), np.array([0]), True)
    master = facets(points, kind, np.array([[2, 3], [3, 4]]), np.arange(2), True)
    return points, slave, master


def test_mortar_integrals_over_a_disc():
    """∫ N r dr: 2/3 and 4/3 of the slave's hats, 1/6, 1 and 5/6 of the master's."""
    points, slave, master = rings_under_a_disc()
    near = vertex_neighbours([(np.array([0]), np.array([[0, 1]]))], 1)
    asked = RecoveryRequest(FORMS["linear"], near, np.zeros(1, dtype=int))
    operator = gap_operator([slave], [master], 1, len(points), 1.0, asked=asked)
    along = operator.matrix.toarray().reshape(5, 2)[:, 1]
    assert along == pytest.approx(2 * PI * np.array([-2 / 3, -4 / 3, 1 / 6, 1, 5 / 6]))
    assert operator.initial == pytest.approx(0.5 * 4 * PI)
    assert operator.covered == operator.surface.area == pytest.approx(4 * PI)
    assert operator.surface.centre[0] == pytest.approx([4 / 3, 0])
    # ψ has the mean zero over the disc: its loads have no resultant, and it is odd about 4/3.
    local = operator.recovery.moments.local
    assert local.centre[0] == pytest.approx([4 / 3, 0])
    size = 4 * PI / (2 * PI * 4 / 3)
    assert local.spread[0, 0, 0] == pytest.approx((2 - (4 / 3) ** 2) / size**2)
    loads = operator.recovery.loads.toarray().reshape(5, 2)[:, 1]
    assert loads[:2].sum() == pytest.approx(0, abs=1e-13)
    assert loads[2:].sum() == pytest.approx(0, abs=1e-13)


def test_area_of_contact_beyond_the_last_ring():
    """Without a form to find the edge: none, back to the inner end (3π), on to the outer (5π)."""
    points = np.array([(x, 0.0) for x in range(4)])
    chain = np.array([[0, 1], [1, 2], [2, 3]])
    closed = np.array([True, True, False])
    whole = np.ones(3)
    edges = contact_edges(points, chain, whole, whole, np.zeros(3), closed, axisymmetric=True)
    assert edges.lengths[0] == pytest.approx([0, -3 * PI, 5 * PI])
