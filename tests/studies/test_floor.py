"""The exact answer of a sweep's point, and what rounding alone makes of it."""

import meshio
import numpy as np
import pytest

from solver.mechanics.fem.stress import nodal_stress
from solver.mesh import transform
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.scene.scene import build_scene
from solver.studies.digits import exact_state, floor, misplaced, upper_nodes
from tests.scenes import block_mesh, changed_case

MESHES = {2: ("TRIA3", "QUAD4"), 3: ("TETRA4", "HEXA8")}


def solved(dim, spec="", poisson=0.3, cells=None):
    """Case, mesh before and after its transform, and the problem, solved."""
    moved = f"transform: {spec}\n" if spec else ""
    change = ("poisson: 0.3", f"poisson: {poisson!r}")
    case = changed_case(dim, change, normal=True, extra=moved)
    raw = block_mesh(*(cells or MESHES[dim]))
    mesh = transform(raw, case.mesh.transform) if case.mesh.transform else raw
    problem = ContactProblem(build_scene(case, mesh))
    return case, raw, mesh, problem, problem.solve(1.0)


SPECS = {
    2: "{stretch: [3, 0.5], rotate: 33.3, shift: {group: top, by: [0.3, 0.7]}, translate: [5, -7]}",
    3: "{stretch: [3, 0.5, 2], rotate: {axis: [1, 2, 3], angle: 40}, translate: [5, -7, 1]}",
}


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_exact_state_is_what_the_solver_finds(dim, poisson):
    """Strains at round-off; the displacement, a gap to be closed included, is the solver's own."""
    # A shift in turned coordinates would open the sides too.
    spec = SPECS[dim].replace("shift: {group: top, by: [0.3, 0.7]}, ", "")
    if dim == 2:
        spec = spec.replace("{stretch", "{shift: {group: top, by: [0, 0.7]}, stretch")
    case, raw, _, problem, found = solved(dim, spec, poisson)
    state = exact_state(case, "compression", raw)
    scene = problem.scene
    upper = upper_nodes(scene)
    exact = state.displacement(scene.points + scene.coordinates.origin, upper).astype(float)
    assert found.pressure == pytest.approx(np.full(len(found.pressure), 25.0), rel=1e-11)
    assert found.displacement == pytest.approx(exact, abs=1e-11 * np.abs(exact).max())
    stress = nodal_stress(scene.points, scene.blocks, exact)
    stress += sum(term.stress(scene.blocks) for term in found.iterate.terms)
    assert stress == pytest.approx(state.stress_at(upper), abs=1e-9)


def test_the_hydrostatic_state_is_pressure_all_round():
    case, raw, *_ = solved(2)
    state = exact_state(case, "hydrostatic", raw)
    assert state.stress_at(np.array([True]))[0] == pytest.approx([-25, -25, -15, 0, 0, 0])
    strain = -25 * (1 + 0.3) * (1 - 0.6) / 2000
    u = state.displacement(np.array([[1.0, 0.5]]), np.array([True]))
    assert u.astype(float) == pytest.approx(np.array([[strain, strain * 1.5]]))


def test_coordinates_are_misplaced_by_their_rounding():
    """A unit block carried to 2⁵⁰ lies on whole numbers and quarters there: 2⁵⁰ · 2⁻⁵² = ¼."""
    case, raw, mesh, *_ = solved(2, "{translate: [1125899906842624, 0]}", cells=("QUAD4", "QUAD4"))
    off = misplaced(case, raw, mesh)
    assert np.abs(off[:, 0]).max() == pytest.approx(1 / 12, abs=2**-13)  # a third, to a quarter
    assert (off[:, 1] == 0).all()
    assert (misplaced(solved(2)[0], raw, raw) == 0).all()


@pytest.mark.parametrize("dim", [2, 3])
def test_the_floor_is_round_off_where_nothing_is_lost_and_grows_with_what_is(dim):
    case, raw, mesh, problem, _ = solved(dim)
    assert max(floor(problem, raw, mesh, exact_state(case, "compression", raw))) < 1e-13
    stretch = "{stretch: [1, 999]}" if dim == 2 else "{stretch: [1, 1, 999]}"
    case, raw, mesh, problem, _ = solved(dim, stretch)
    pressure, _ = floor(problem, raw, mesh, exact_state(case, "compression", raw))
    assert 1e-11 < pressure < 1e-7  # ε · 999² times a few


def test_the_floor_of_the_mixed_form_does_not_grow_with_poissons_ratio():
    for form, low, high in (("displacement", 1e-8, 1e-5), ("mixed", 0.0, 1e-10)):
        text = f"0.49999999, form: {form}"
        case, raw, mesh, problem, _ = solved_with_form(text)
        pressure, stress = floor(problem, raw, mesh, exact_state(case, "compression", raw))
        assert low <= min(pressure, stress)
        assert max(pressure, stress) < high


def solved_with_form(poisson):
    case = changed_case(2, ("poisson: 0.3", f"poisson: {poisson}"))
    raw = block_mesh(*MESHES[2])
    problem = ContactProblem(build_scene(case, raw))
    return case, raw, raw, problem, problem.solve(1.0)


def test_a_mesh_in_extended_precision_keeps_it():
    points = np.array([[0.0, 1.0]], dtype=np.longdouble)
    moved = transform(meshio.Mesh(points, []), {"rotate": 30, "scale": 3, "stretch": [1, 2]})
    assert moved.points.dtype == np.longdouble
