"""Plane stress: the patch test, exact solutions, and what is refused."""

import numpy as np
import pytest

from solver.case.material import Material
from solver.case.reader import parse_case
from solver.case.solutions.nested import NestedCylinders
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.norms import errors as norms
from tests.scenes import POISSON, YOUNG, block_mesh, changed_case

THIN = ("plane: strain", "plane: stress")
REFERENCE = """\
reference:
  kind: analytical
  solution: {name: uniform_compression, base: -1.0, lower: all, upper: all}
  stress: solution
  displacement: solution
"""


def test_an_exact_solution_follows_the_case():
    case = changed_case(2, THIN, extra=REFERENCE)
    found = simulate(case, block_mesh("QUAD4", "TRIA6", (4, 3)))
    checks = run_checks(found)
    assert {"stress_components", "integration_stress", "displacement"} <= {c.name for c in checks}
    assert max(check.error for check in checks) < 1e-12
    assert norms(found)["stress_l2"] < 1e-12


def test_equivalent_constants_keep_the_moduli_of_plane_stress():
    """E/(1 − ν²) and its product with ν are the λ + 2μ and λ of plane stress."""
    thin = Material(2000.0, 0.3).in_plane_stress()
    shear = thin.young / (2 * (1 + thin.poisson))
    lame = 2 * shear * thin.poisson / (1 - 2 * thin.poisson)
    assert shear == pytest.approx(2000 / 2.6)
    assert lame + 2 * shear == pytest.approx(2000 / 0.91)
    assert lame == pytest.approx(0.3 * 2000 / 0.91)


def test_a_press_fit_of_thin_rings():
    """p = E δ (b² − a²)(c² − b²)/(2 b³ (c² − a²)), for hubs with free ends."""
    steel = Material(200000.0, 0.3).in_plane_stress()
    rings = NestedCylinders(radii=(10.0, 20.0, 30.0), inner=steel, outer=steel, interference=0.0025)
    x = np.array([[20.0, 0.0]])
    assert rings.contact_pressure(x) == pytest.approx(5.859375)
    assert rings.stress(x, 0)[0, 2] == 0


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("name: interface", "name: interface, mu: 0.3"), "the key friction of a contact zone"),
        (("poisson: 0.3", "poisson: 0.3, alpha: 1.2e-5"), "initial strain is a load"),
        (("name: interface", "name: interface, tied: true"), "holds in tension is out of scope"),
        (("poisson: 0.3", "poisson: 0.3, yield_stress: 9"), "linear elasticity only"),
        (("poisson: 0.3", "poisson: 0.3, density: 9"), "static equilibrium only"),
        (("name: patch", "name: patch\nlarge_strain: true"), "small strain only"),
        (("name: patch", "name: patch\nBeams: []"), "beams, shells and trusses are out of scope"),
    ],
)
def test_what_is_out_of_scope_is_refused_by_name(change, why):
    with pytest.raises(InputError, match=why):
        changed_case(2, change)


def test_another_unknown_key_stays_one():
    with pytest.raises(InputError, match="unknown key; did you mean poisson"):
        changed_case(2, ("poisson: 0.3", "poisson: 0.3, poison: 0.3"))


def test_reader_and_case_agree_on_the_material():
    case = changed_case(2, THIN)
    assert case.thin
    assert case.materials["all"] == Material(YOUNG, POISSON).in_plane_stress()
    assert parse_case(case.about.source, case.path).materials == case.materials


def test_an_equivalent_of_infinite_softness_is_refused():
    """At ν = −½ the equivalent Young's modulus is zero, below it is negative."""
    with pytest.raises(InputError, match=r"materials.all.poisson = -0.5: .* -0.5 in plane stress"):
        changed_case(2, THIN, ("poisson: 0.3", "poisson: -0.5"))
