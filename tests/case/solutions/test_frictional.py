"""Solutions with friction: fields, Coulomb's law, and numbers known from the literature."""

import numpy as np
import pytest
from scipy.integrate import quad

from solver.case.material import Material
from solver.case.solutions.base import ParameterError
from solver.case.solutions.frictional import Sheared, ShearedBlocks, under
from solver.case.solutions.nested import PulledTubes
from solver.case.solutions.pressed import HertzHalfPlanes, PartialWaves, RoundedPunch, Wedge
from solver.case.solutions.sheared_sphere import ShearedSphere
from solver.case.solutions.sliding_rigid import SlidingCylinder, SlidingPunch
from solver.case.solutions.waves import SlidingWaves
from solver.mechanics.fem.stress import traction
from tests.case.solutions.test_elastic import derivative

ONE, HARD = Material(2000.0, 0.3), Material(1000.0, 0.2)
MU = 0.4
BODIES = {"bottom": ONE, "top": ONE}
CYLINDER = HertzHalfPlanes(end=10.2, radius=100.0, **BODIES)
CONTACTS = [
    CYLINDER,
    Wedge(end=10.2, slope=0.01, **BODIES),
    RoundedPunch(end=10.2, flat=4.7, radius=100.0, **BODIES),
    PartialWaves(size=20.0, amplitude=0.02, mean_pressure=0.6, **BODIES),
]
TURN = np.array([[0.8, -0.6], [0.6, 0.8]])
LAYERS = {"bottom": Material(1.0, 0.3), "top": Material(4.0, 0.1), "height": 1.0, "wave": 2.0}


def sheared(contact=CYLINDER, shear=(0.5,)):
    return Sheared(contact=contact, friction=MU, shear=shear)


def waves(friction):
    return SlidingWaves(**LAYERS, amplitude=0.01, mean_pressure=0.02, friction=friction, slide=0.05)


BLOCKS = ShearedBlocks(
    pressure=25.0, traction=10.0, along=TURN[0], normal=TURN[1], material=ONE, dim=2, slide=0.02
)
TUBES = PulledTubes(
    radii=(20.0, 30.0, 40.0), inner=ONE, outer=HARD, interference=0.1, friction=0.3, slide=0.05
)
ALL = [BLOCKS, *(sheared(contact) for contact in CONTACTS), waves(0.6), TUBES]


def inside(solution, part):
    """Points of a part, away from where fields are singular."""
    rng = np.random.default_rng(part)
    if solution is TUBES:
        angle, radius = (
            rng.uniform(0, 6, 20),
            rng.uniform(*((21, 29) if part == 0 else (31, 39)), 20),
        )
        return np.column_stack(
            [radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, 9, 20)]
        )
    size = {"sheared_blocks": 50.0, "sheared": 15.0, "sliding_waves": 0.9}[solution.name]
    x = rng.uniform(0.05, 1.0, (20, 2)) * size * (1, 1 if part else -1)
    return x @ TURN if solution is BLOCKS else x


@pytest.mark.parametrize("solution", ALL, ids=lambda s: s.name)
@pytest.mark.parametrize("part", [0, 1])
def test_fields_are_in_equilibrium(solution, part):
    x = inside(solution, part)
    step = 1e-5 * np.abs(x).max()
    found = derivative(lambda y: solution.displacement(y, part), x, step)
    expected = solution.gradient(x, part)
    np.testing.assert_allclose(found, expected, atol=2e-8 * np.abs(expected).max())

    def tensor(y):
        full = solution.stress(y, part)[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
        return full[:, : solution.dim, : solution.dim]

    divergence = np.einsum("nijj->ni", derivative(tensor, x, step))
    np.testing.assert_allclose(divergence, 0, atol=1e-6 * np.abs(tensor(x)).max())


def interface(solution):
    """Points of the interface, and its unit normal out of the first part."""
    if solution is TUBES:
        angle = np.linspace(0.1, 6, 30)
        normal = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        return 30 * normal, normal
    s = np.linspace(-0.95, 0.95, 39) + 0.003
    if solution is BLOCKS:
        return 50 * s[:, None] * TURN[0], np.tile(TURN[1], (39, 1))
    reach = solution.half_width if solution.name == "sheared" else 1.0
    return np.column_stack([reach * s, 0 * s]), np.tile([0.0, 1.0], (39, 1))


@pytest.mark.parametrize("solution", ALL, ids=lambda s: s.name)
def test_tractions_and_slip_at_the_interface_are_those_that_are_stated(solution):
    x, normal = interface(solution)
    friction, pressure = solution.friction_traction(x), solution.contact_pressure(x)
    scale = pressure.max()
    for part, side in ((0, 1.0), (1, -1.0)):
        force = traction(solution.stress(x, part), side * normal)
        expected = side * (friction - pressure[:, None] * normal)
        np.testing.assert_allclose(force, expected, atol=1e-9 * scale)
    jump = solution.displacement(x, 1) - solution.displacement(x, 0)
    along = jump - np.einsum("ni,ni->n", jump, normal)[:, None] * normal
    np.testing.assert_allclose(along, solution.slip(x), atol=1e-12 * np.abs(jump).max())


@pytest.mark.parametrize("solution", ALL, ids=lambda s: s.name)
def test_coulombs_law_holds(solution):
    x, _ = interface(solution)
    bound = getattr(solution, "friction", MU) * solution.contact_pressure(x)
    size = np.linalg.norm(solution.friction_traction(x), axis=1)
    slip = solution.slip(x)
    far = np.linalg.norm(slip, axis=1)
    assert (size <= bound * (1 + 1e-9)).all()
    slips = far > 1e-9 * far.max()
    assert slips.any()
    np.testing.assert_allclose(size[slips], bound[slips], rtol=1e-9)
    work = (solution.friction_traction(x) * slip).sum(axis=1)
    np.testing.assert_allclose(work, bound * far, atol=1e-9 * (bound * far).max())


@pytest.mark.parametrize("contact", CONTACTS, ids=lambda c: c.name)
def test_the_tangential_force_is_the_one_asked_for(contact):
    x = np.column_stack([np.linspace(-20, 20, 400001), np.zeros(400001)])
    shear = np.trapezoid(-sheared(contact).friction_traction(x)[:, 0], x[:, 0])
    press = np.trapezoid(contact.contact_pressure(x), x[:, 0])
    assert shear / (MU * press) == pytest.approx(0.5, rel=1e-4)


def test_cattaneos_stick_zone_and_the_energy_of_mindlins_cycle():
    """c/a = √(1 − X); D = (4 μ²P²/π E*) [X − X²/2 + (1 − X) ln(1 − X)] (Johnson, §7.4)."""
    assert sheared().stick_area / (2 * 10.2) == pytest.approx(0.70710678, abs=1e-8)
    share = 0.75
    cycle = sheared(shear=(0.0, share, -share, share))
    whole = 4 * (MU * CYLINDER.force) ** 2 / (np.pi * CYLINDER.modulus)
    expected = whole * (share - share**2 / 2 + (1 - share) * np.log(1 - share))
    assert expected == pytest.approx(18.26234, rel=1e-6)
    assert sum(cycle.dissipation[2:]) == pytest.approx(expected, rel=1e-6)
    by_masing = quad(lambda y: (2 * y - share) * np.log(1 - y), 0, share)[0]
    assert -whole * by_masing == pytest.approx(expected, rel=1e-9)


def test_unloading_leaves_tractions_and_a_full_cycle_closes():
    x, _ = interface(sheared())
    first = sheared(shear=(0.75,)).friction_traction(x)
    assert np.abs(sheared(shear=(0.75, 0.0)).friction_traction(x)).max() > 0.2 * np.abs(first).max()
    np.testing.assert_allclose(
        sheared(shear=(0.75, -0.75)).friction_traction(x), -first, atol=1e-12
    )
    again = sheared(shear=(0.75, -0.75, 0.75)).friction_traction(x)
    np.testing.assert_allclose(again, first, atol=1e-12)
    assert [s.shear for s in sheared(shear=(0.3, 0.1)).states] == [(0.3,), (0.3, 0.1)]


def test_a_share_of_the_force_makes_the_same_contact_smaller():
    for contact in CONTACTS[:3]:
        assert under(contact, 0.4).force == pytest.approx(0.4 * contact.force, rel=1e-12)
    assert under(CYLINDER, 0.25).end == pytest.approx(5.1, rel=1e-12)


def test_a_sliding_cylinder_has_the_skew_of_johnson():
    """ν = 0.3, μ = 0.5: β = 2/7, ε = 0.0451672353; the pressure bears the force."""
    one = SlidingCylinder(material=ONE, radius=100.0, force=1000.0, friction=0.5)
    assert one.skew == pytest.approx(0.0451672353, abs=1e-10)
    x = np.column_stack([np.linspace(-12, 12, 200001), np.zeros(200001)])
    pressure = one.contact_pressure(x)
    whole = np.trapezoid(pressure, x[:, 0])
    assert whole == pytest.approx(1000.0, rel=1e-5)
    at = np.trapezoid(pressure * x[:, 0], x[:, 0]) / whole
    assert at - one.middle == pytest.approx(-2 / 3 * one.skew * one.half_width, rel=1e-4)
    # Far below, the half-plane is a body under a force: ∂v/∂y there is that of Flamant.
    below = np.array([[0.0, -4000.0], [0.0, -4001.0]])
    strain = -np.diff(one.displacement(below)[:, 1])[0]
    expected = -2 * 1000.0 / (np.pi * 4000.5) * (1 - 0.3**2) / 2000.0
    assert strain == pytest.approx(expected, rel=1e-3)


def test_a_sliding_punch_bears_its_force_and_a_moment():
    """The integral of (1 + t)^(−1/2 − ε) (1 − t)^(−1/2 + ε) is π/cos πε, the mean of t −2ε."""
    one = SlidingPunch(material=ONE, width=10.0, force=1000.0, friction=0.5)
    # With t = −cos φ the pressure times dt is finite at both ends.
    angle = (np.arange(400000) + 0.5) * np.pi / 400000
    x = np.column_stack([-10.0 * np.cos(angle), np.zeros(len(angle))])
    load = one.contact_pressure(x) * 10.0 * np.sin(angle) * np.pi / 400000
    assert load.sum() == pytest.approx(1000.0, rel=1e-3)
    assert (load * x[:, 0]).sum() / load.sum() == pytest.approx(-2 * one.skew * 10.0, rel=2e-3)
    assert one.contact_pressure(np.array([[10.5, 0.0], [-11.0, 0.0]])).tolist() == [0.0, 0.0]
    # Along the surface beside the contact, Flamant's formula for the settlement, by differences.
    beside = np.array([[30.0, 0.0], [31.0, 0.0]])
    slope = np.diff(one.displacement(beside)[:, 1])[0]
    modulus = 2000.0 / (1 - 0.3**2)
    pulls = np.log((31.0 - x[:, 0]) / (30.0 - x[:, 0]))
    assert slope == pytest.approx(2 / (np.pi * modulus) * (load * pulls).sum(), rel=1e-4)


SOFT = Material(2000.0, 0.0)


def sphere(**given):
    parameters = {"radius": 100.0, "end": 10.0, "friction": 0.4, "shear": 0.5} | given
    return ShearedSphere(material=SOFT, **parameters)


def test_a_sheared_sphere_is_in_equilibrium():
    """With ν = 0: ∇²u + ∇ div u = 0 in both bodies, by differences."""
    step, one = 1e-2 * np.eye(3), sphere()
    x = np.array([[12.0, 7.0, 9.0], [3.0, 5.0, -14.0]])

    def divergence(at):
        moved = (one.displacement(at + e) - one.displacement(at - e) for e in step)
        return sum(m[:, i] for i, m in enumerate(moved)) / 2e-2

    u = one.displacement(x)
    laplace = sum(one.displacement(x + e) + one.displacement(x - e) - 2 * u for e in step) / 1e-4
    slope = [(divergence(x + e) - divergence(x - e)) / 2e-2 for e in step]
    assert np.abs(laplace).max() > 1e-4
    np.testing.assert_allclose(laplace + np.stack(slope, axis=1), 0.0, atol=1e-8)


def test_a_sheared_sphere_has_the_forces_and_the_gap_of_its_tractions():
    one = sphere()
    assert one.stick / one.end == pytest.approx(0.79370053, abs=1e-8)
    r = 10.0 * (np.arange(200000) + 0.5) / 200000
    x = np.column_stack([r, 0 * r, 0 * r])
    ring = 2 * np.pi * r * 10.0 / 200000
    force = 4 * 1000.0 * 10.0**3 / 300.0
    assert one.contact_pressure(x) @ ring == pytest.approx(force, rel=1e-6)
    assert one.friction_traction(x)[:, 0] @ ring == pytest.approx(0.5 * 0.4 * force, rel=1e-6)
    # Beside the contact, from the displacement of both surfaces: the gap opens and the ring slips.
    beside = np.array([[25.0, 0.0, 0.0], [0.0, 30.0, 0.0]])
    jump = one.displacement(beside, 1) - one.displacement(beside, 0)
    opened = jump[:, 2] + (beside**2).sum(axis=1) / 200
    np.testing.assert_allclose(opened, one.gap(beside), rtol=1e-8)
    np.testing.assert_allclose(jump[:, :2], one.slip(beside)[:, :2], atol=1e-10)
    assert sphere(share=0.5).stick_area == pytest.approx(one.stick_area / 2)
    # The work of a complete slide is μ P times the slide; here the ring alone slides.
    assert 0 < one.dissipation[0] < 0.4 * force * one.slip(np.array([[10.0, 0.0, 0.0]]))[0, 0]


def test_sliding_waves_have_the_amplitudes_and_phases_of_the_derivation():
    """|p₁|/Δ and the phase in degrees, computed apart with 30 digits."""
    for friction, size, phase in (
        (1e-13, 1.3941027653, 0.0),
        (0.3, 1.3932055864, 2.05566835),
        (0.6, 1.3905244071, 4.10605799),
    ):
        found = waves(friction).wave_pressure
        assert abs(found) / 0.01 == pytest.approx(size, rel=1e-9)
        assert np.degrees(np.angle(found)) == pytest.approx(phase, abs=1e-7)


@pytest.mark.parametrize(
    ("make", "parameter"),
    [
        (lambda: sheared(shear=(1.0,)), "shear"),
        (lambda: sphere(shear=1.0), "shear"),
        (lambda: ShearedSphere(material=ONE, radius=1.0, end=0.1, friction=0.4, shear=0.5),
         "material"),
        (lambda: sheared(shear=(0.5, -0.6)), "shear"),
        (lambda: sheared(shear=(0.5, 0.2, 0.6)), "shear"),
        (lambda: sheared(contact=BLOCKS), "contact"),
        (lambda: sheared(HertzHalfPlanes(end=1.0, radius=9.0, bottom=ONE, top=HARD)), "contact"),
        (lambda: ShearedBlocks(pressure=1.0, traction=0.1, along=(1.0, 1.0), normal=(0.0, 1.0),
                               material=ONE, dim=2), "along"),
        (lambda: ShearedBlocks(pressure=1.0, traction=0.1, along=(0.0, 1.0), normal=(0.0, 1.0),
                               material=ONE, dim=2), "along"),
        (lambda: SlidingWaves(**LAYERS, amplitude=0.01, mean_pressure=0.01, friction=0.3,
                              slide=0.05), "mean_pressure"),
    ],
)  # fmt: skip
def test_what_is_no_solution_is_refused(make, parameter):
    with pytest.raises(ParameterError, match=parameter):
        make()
