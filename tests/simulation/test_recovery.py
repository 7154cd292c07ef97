"""The recovered pressure: exact where it must be, of higher order where the pressure is smooth."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml

from solver import solve_case
from solver.case.reader import parse_case
from solver.commands.cli import main
from solver.lac import reconstruction as mortar
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.neighbours import vertex_neighbours
from solver.lac.reconstruction import FORMS
from solver.lac.recovery import Recovery
from solver.mesh import generate
from solver.simulation.equilibrium import recovery as sweeps
from solver.simulation.results.solution import ZoneEstimates, pressure_error
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.norms import errors
from solver.verification.results import read_result, write_result
from tests.scenes import PRESSURE, block_case, block_mesh

APPLIED = [name for name in FORMS if name != "none"]
PLANE = {"TRIA6": "QUAD8", "QUAD8": "TRIA6", "QUAD9": "QUAD8"}


def blocks(bottom: str, top: str, n: int, **keys) -> dict:
    """Two blocks on each other, n cells along the slave, as a mapping without supports."""
    dim = 3 if bottom.startswith(("TETRA", "HEXA", "PENTA", "PYRA")) else 2
    across = [n] * (dim - 1)
    sides = [("symx", "x"), ("farx", "x"), ("symy", "y"), ("fary", "y")][: 2 * (dim - 1)]
    return {
        "name": "recovered",
        "mesh": {
            "recipe": "blocks",
            "size": 50,
            "bottom": {"cells": bottom, "divisions": [*across, n // 2]},
            "top": {"cells": top, "divisions": [*(4 * m // 5 for m in across), n // 2]},
        },
        **({"plane": "strain"} if dim == 2 else {}),
        "materials": {
            "bottom": {"young": 2000.0, "poisson": 0.3},
            "top": {"young": 1000.0, "poisson": 0.2},
        },
        "supports": [{"group": group, "fix": [axis]} for group, axis in sides],
        "contact": [{"slave": "bottom_contact", "master": "top_contact", **keys}],
    }


def waves(bottom: str, top: str, n: int, recovery: str) -> dict:
    """Waves of the gap, pressed together: a smooth pressure between two elastic blocks."""
    case = blocks(bottom, top, n, recovery=recovery)
    dim = 3 if len(case["supports"]) == 4 else 2
    wave = "*".join(f"cos(pi*{axis}/50)" for axis in "xy"[: dim - 1])
    case["contact"][0]["clearance"] = f"0.2*(1 - {wave})"
    case["supports"] += [
        {"group": "base", "fix": ["xyz"[dim - 1]]},
        {"group": "press", "fix": {"xyz"[dim - 1]: "solution"}},
    ]
    solution = {"name": f"waves_{dim}d", "size": 50, "amplitude": 0.2, "mean_pressure": 25}
    case["reference"] = {
        "kind": "analytical",
        "solution": solution | {"bottom": "bottom", "top": "top"},
        "contact_pressure": "solution",
    }
    return case


def solved(content: dict, swapped: bool = False):
    case = parse_case(yaml.safe_dump(content), Path("recovered.yaml")).as_solved(swapped)
    return simulate(case, generate(content["mesh"], "recovered.yaml"))


def error(bottom: str, top: str, n: int, recovery: str, swapped: bool = False) -> float:
    return errors(solved(waves(bottom, top, n, recovery), swapped))["pressure_l2"]


@pytest.mark.parametrize("form", APPLIED)
@pytest.mark.parametrize(
    ("bottom", "top"),
    [
        *[("TRIA3", "QUAD8"), ("TRIA6", "QUAD4"), ("QUAD9", "TRIA3"), ("TETRA10", "HEXA8")],
        *[("HEXA27", "TETRA4"), ("HEXA20", "PENTA6"), ("PENTA15", "PYRA5"), ("PYRA13", "TETRA4")],
    ],
)
def test_a_uniform_pressure_stays_exact(bottom, top, form):
    """The patch test: nothing is added to the constants, on any neighbours."""
    dim = BY_NAME[bottom].dim
    case = block_case(dim, zone=f", recovery: {form}")
    for swapped in (False, True):
        [zone] = simulate(case.as_solved(swapped), block_mesh(bottom, top)).zones
        assert zone.multiplier == pytest.approx(PRESSURE, rel=1e-13)
        assert zone.recovered.at_nodes == pytest.approx(PRESSURE, rel=1e-13)
        assert zone.relative_pressure_error < 1e-13


@pytest.mark.parametrize(("bottom", "top"), PLANE.items())
def test_orders_and_gain_on_quadratic_cells(bottom, top):
    """Order 3 of quadratic recovery (2.2 on QUAD8 next to triangles), 2 of linear; 1 without.

    The best linear function on each of n intervals has an error smaller than that of constants by
    √60 / (k h) for a wave of wave number k = π / 50, h = 50 / n. Linear recovery gets 0.94 of it.
    """
    coarse, fine = (
        {form: error(bottom, top, n, form) for form in ("none", "linear", "quadratic")}
        for n in (20, 40)
    )
    order = {form: np.log2(coarse[form] / fine[form]) for form in fine}
    assert order["none"] == pytest.approx(1.0, abs=0.02)
    assert order["linear"] == pytest.approx(2.0, abs=0.05)
    assert order["quadratic"] > (1.8 if bottom == "QUAD8" else 2.4)
    assert fine["linear"] < fine["none"] / (0.94 * np.sqrt(60) * 40 / np.pi)
    assert fine["quadratic"] < fine["none"] / 300


@pytest.mark.parametrize(
    ("bottom", "top", "n", "gain"), [("TETRA10", "HEXA20", 6, 7), ("TETRA4", "HEXA8", 8, 8)]
)
def test_means_that_scatter_are_fitted(bottom, top, n, gain):
    """On irregular triangles a reconstruction that keeps the means keeps their error."""
    found = {form: error(bottom, top, n, form) for form in ("none", "linear", "smooth")}
    assert found["smooth"] < found["none"] / gain
    assert found["linear"] > 2 * found["smooth"]


@pytest.mark.parametrize("swapped", [False, True])
def test_linear_cells_gain_by_a_smooth_pressure(swapped):
    found = {form: error("TRIA3", "QUAD4", 40, form, swapped) for form in ("none", "smooth")}
    assert found["smooth"] < found["none"] / 4


def test_the_correction_balances_in_force_and_moment():
    solution = solved(waves("TRIA6", "QUAD8", 10, "linear"))
    found = {key: value for key, value in solution.quality.balance.items() if "correction" in key}
    assert len(found) == 2
    assert max(found.values()) < 1e-14
    assert max(solution.quality.balance.values()) < 1e-11


def test_each_mean_is_kept():
    """∫ p* over a macro-element is its constant times its length: Simpson's rule is exact here."""
    [zone] = solved(waves("QUAD8", "TRIA6", 10, "quadratic")).zones
    [(_, nodes, macro)] = zone.faces
    mesh = solved(waves("QUAD8", "TRIA6", 10, "quadratic")).mesh
    ends = mesh.points[nodes[:, :2]]
    places = np.stack([ends[:, 0], ends[:, 1], ends.mean(axis=1)], axis=1)
    mean = zone.recovered.values(zone.multiplier, macro, places) @ [1 / 6, 1 / 6, 4 / 6]
    assert mean == pytest.approx(zone.multiplier[macro], rel=1e-13)
    assert np.abs(zone.recovered.coefficients).max() > 0.1


def test_without_neighbours_the_error_is_unknown():
    """One macro-element, or two of which one is pressed: nothing tells how a pressure varies."""
    case = waves("QUAD8", "QUAD8", 40, "linear")
    case["mesh"]["bottom"]["divisions"] = [1, 1]
    solution = solve_case(case)
    assert np.isnan(solution.solution.zones[0].estimates.pressure_error).all()
    assert solution.solution.pressure_error_estimate is None
    assert "error of the pressure not estimated" in str(solution)
    beside = replace(solution.solution.zones[0], estimates=ZoneEstimates(None, np.array([3.0])))
    some = replace(beside, multiplier=np.array([1e3]))
    assert pressure_error([some, solution.solution.zones[0]]) == pytest.approx(3e-3 / 50**0.5, 1e-2)


@pytest.mark.parametrize("form", ["none", "quadratic"])
def test_the_estimate_is_the_error_of_the_constants(form):
    """Effectivity 0.9 to 1.1, with no reference at all."""
    solution = solved(waves("TRIA6", "QUAD8", 40, form))
    [zone] = solution.zones
    constants = error("TRIA6", "QUAD8", 40, "none")
    assert zone.relative_pressure_error == pytest.approx(constants, rel=0.1)


@pytest.mark.parametrize(
    ("bottom", "top", "form", "n", "bound"),
    [
        ("TRIA3", "QUAD4", "linear", 10, 0.46),
        ("QUAD8", "TRIA6", "linear", 10, 0.34),
        ("QUAD8", "TRIA6", "quadratic", 10, 0.37),
        ("QUAD8", "TRIA6", "quadratic", 20, 0.37),
        ("TETRA10", "HEXA20", "smooth", 4, 0.6),
    ],
)
def test_sweeps_converge(monkeypatch, bottom, top, form, n, bound):
    """Eigenvalues of a sweep are real, at most 0 and above −`bound`, whatever the mesh size."""
    seen = []

    def eigenvalues(problem, state, zones, most):
        [zone] = zones
        loads = (zone.recovery.loads.T @ zone.reconstruction.matrix).toarray()
        closed = state.status.closed
        sweep = np.array([problem.pressure_change(closed, force) for force in loads.T])
        seen.append(np.linalg.eigvals(sweep))
        return true(problem, state, zones, most)

    true = sweeps._corrected
    monkeypatch.setattr(sweeps, "_corrected", eigenvalues)
    solved(waves(bottom, top, n, form))
    assert np.abs(seen[0].imag).max() < 0.02
    assert -bound < seen[0].real.min() < -bound / 2
    assert seen[0].real.max() < 1e-6


def test_a_wrong_sign_of_the_loads_shows(monkeypatch):
    """The correction pushes the wrong way: the error is larger than the constants'."""
    right = error("QUAD8", "TRIA6", 20, "linear")
    true = Recovery.__init__

    def wrong(self, **fields):
        true(self, **fields | {"loads": -fields["loads"]})

    monkeypatch.setattr(Recovery, "__init__", wrong)
    assert error("QUAD8", "TRIA6", 20, "linear") > 3 * right


def test_open_macro_elements_have_no_pressure_and_are_no_neighbours():
    """A block loaded on one half lifts off beside: nothing is recovered where it is open."""
    content = blocks("QUAD8", "TRIA6", 20, recovery="quadratic")
    content["supports"] = [
        {"group": "symx", "fix": ["x"]},
        {"group": "base", "fix": ["y"]},
    ]
    content["loads"] = [{"group": "press", "pressure": "30*(1 - x/25)"}]
    [zone] = solved(content).zones
    assert 0 < zone.closed.sum() < len(zone.closed)
    assert (zone.recovered.coefficients[~zone.closed] == 0).all()
    assert (zone.recovered.degree[~zone.closed] == 0).all()
    without = content | {"contact": [content["contact"][0] | {"recovery": "none"}]}
    assert (solved(without).zones[0].closed == zone.closed).all()


def test_a_macro_element_that_is_hardly_covered_is_no_neighbour():
    """The last of five, under the end of the master, has a mean that is no use to the fourth."""
    at = mortar.Moments(
        share=np.array([1.0, 1.0, 1.0, 1.0, 0.05]),
        spread=np.tile(np.diag([1 / 12, 0.0]), (5, 1, 1)),
        normal=np.tile([0.0, 1.0], (5, 1)),
        local=mortar.Local(
            centre=np.column_stack([np.arange(5.0), np.zeros(5)]),
            axes=np.tile([[1.0, 0.0]], (5, 1, 1)),
            spread=np.full((5, 1, 1), 1 / 12),
        ),
    )
    chain = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    near = vertex_neighbours([(np.arange(5), chain)], 5)
    found = mortar.reconstruct(at, near, np.ones(5, dtype=bool), FORMS["linear"])
    assert (found.matrix[:4, 4].toarray() == 0).all()
    assert (found.matrix @ [1.0, 2.0, 3.0, 4.0, 99.0])[:4] == pytest.approx(1.0)
    assert found.degree.tolist() == [1] * 5


def test_faces_around_a_kink_are_no_neighbours():
    normal = np.array([[0.0, 1.0], [0.0, 1.0], [1.0, 0.0], [1.0, 0.0]])
    at = mortar.Moments(
        share=np.ones(4),
        spread=np.tile(np.diag([1 / 12, 1 / 12]), (4, 1, 1)),
        normal=normal,
        local=mortar.Local(
            centre=np.array([[0.5, 2.0], [1.5, 2.0], [2.0, 1.5], [2.0, 0.5]]),
            axes=np.stack([-normal[:, 1], normal[:, 0]], axis=1)[:, None],
            spread=np.full((4, 1, 1), 1 / 12),
        ),
    )
    chain = np.stack([np.arange(4), np.arange(1, 5)], axis=1)
    near = vertex_neighbours([(np.arange(4), chain)], 4)
    found = mortar.reconstruct(at, near, np.ones(4, dtype=bool), FORMS["linear"]).matrix
    assert (found[:2, 2:].toarray() == 0).all()
    assert (found[2:, :2].toarray() == 0).all()
    assert np.abs(found.toarray()).max() > 0


def test_a_quadratic_pressure_is_found_from_its_means_on_any_triangles():
    """Ring two of irregular triangles: the coefficients give the polynomial at every vertex."""
    random = np.random.default_rng(2)
    n = 6
    points = np.stack(np.meshgrid(np.arange(n), np.arange(n)), axis=-1).reshape(-1, 2).astype(float)
    points += random.uniform(-0.25, 0.25, points.shape)
    corner = [i + n * j for j in range(n - 1) for i in range(n - 1)]
    faces = np.array([t for c in corner for t in ([c, c + 1, c + n], [c + 1, c + n + 1, c + n])])
    x = np.pad(points, ((0, 0), (0, 1)))[faces]
    centre = x.mean(axis=1)
    away = x - centre[:, None]
    spread = np.einsum("nad,nae->nde", away, away) / 12
    m = len(faces)
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    axes = np.tile(np.eye(3)[:2], (m, 1, 1)) / np.sqrt(area)[:, None, None]
    own = np.einsum("nsd,nde,nte->nst", axes, spread, axes)
    at = mortar.Moments(
        share=np.ones(m),
        spread=spread,
        normal=np.tile([0.0, 0.0, 1.0], (m, 1)),
        local=mortar.Local(centre=centre, axes=axes, spread=own),
    )
    curve = np.array([[0.3, -0.2], [-0.2, 0.5]])

    def pressure(y):
        return 5 + y @ [1.0, -2.0] + np.einsum("...i,ij,...j->...", y, curve, y)

    mean = pressure(centre[:, :2]) + np.einsum("nij,ij->n", spread[:, :2, :2], curve)
    near = vertex_neighbours([(np.arange(m), faces)], m)
    found = mortar.reconstruct(at, near, np.ones(m, dtype=bool), FORMS["quadratic"])
    assert (found.degree == 2).all()
    psi = at.local.shapes(np.arange(m), x, FORMS["quadratic"])
    values = mean[:, None] + np.einsum("sqk,sk->sq", psi, (found.matrix @ mean).reshape(m, -1))
    assert values == pytest.approx(pressure(x[..., :2]), rel=1e-10)


def test_a_recovered_pressure_is_read_back(tmp_path):
    solution = solved(waves("TRIA6", "QUAD8", 10, "automatic"))
    write_result(tmp_path / "r.vtkhdf", solution, [], {})
    [zone], [back] = solution.zones, read_result(tmp_path / "r.vtkhdf").solution.zones
    assert back.recovered.form == "quadratic"
    for name in ("coefficients", "degree", "centre", "axes", "spread", "nodes", "at_nodes"):
        assert (getattr(back.recovered, name) == getattr(zone.recovered, name)).all()
    assert (back.estimates.pressure_error == zone.estimates.pressure_error).all()
    with h5py.File(tmp_path / "r.vtkhdf") as file:
        grid = file["VTKHDF"]
        at_nodes = grid["PointData/recovered_pressure"][()]
        on_faces = grid["CellData/pressure_error_estimate"][()][-len(zone.area) :]
    assert (at_nodes[zone.recovered.nodes] == zone.recovered.at_nodes).all()
    assert np.isnan(at_nodes).sum() == len(at_nodes) - len(zone.recovered.nodes)
    # Squares of the root mean squares times areas add up to the square of the whole.
    whole = np.sqrt((on_faces**2 * zone.area).sum() / (zone.multiplier**2 * zone.area).sum())
    assert whole == pytest.approx(zone.relative_pressure_error, rel=1e-12)


def test_the_recovery_asked_for_takes_the_place_of_the_cases_own(tmp_path):
    """As a solve of its own name; the estimate is the one of the case, and is in the verdict."""
    case = tmp_path / "waves.yaml"
    case.write_text(yaml.safe_dump(waves("TRIA6", "QUAD8", 10, "none") | {"tolerance": 0.1}))
    given, asked = (solve_case(case, recovery=form) for form in (None, "linear"))
    assert given.zones["contact"].recovered is None
    assert asked.zones["contact"].recovered.form == "linear"
    assert [given.record["job"], asked.record["job"]] == ["recovered", "recovered-linear"]
    # The tolerance is of the case's own recovery; the errors of the other one are measured.
    assert [given.record["verdict"], asked.record["verdict"]] == ["passed", "solved"]
    assert (
        asked.outcome.estimates.errors["pressure_l2"]
        < 0.1 * given.outcome.estimates.errors["pressure_l2"]
    )
    own = solve_case(case, recovery="none").record
    assert (own["verdict"], own["checks"]) == ("passed", given.record["checks"])
    estimates = [
        given.outcome.estimates.pressure_error_estimate,
        asked.outcome.estimates.pressure_error_estimate,
    ]
    assert estimates == pytest.approx([0.0116] * 2, rel=0.05)
    assert "pressure within 1.2 % (estimated)" in str(given)
    assert main(["solve", str(case), "--recovery", "linear", "-o", str(tmp_path / "r.vtkhdf")]) == 0
    [zone] = read_result(tmp_path / "r.vtkhdf").solution.zones
    assert (zone.recovered.coefficients == asked.zones["contact"].recovered.coefficients).all()
    with pytest.raises(InputError, match="recovery = 'cubic': allowed: none, linear"):
        solve_case(case, recovery="cubic")


def test_multipliers_at_nodes_have_no_estimate():
    content = waves("TRIA6", "QUAD8", 10, "none")
    content["contact"][0]["treatment"] = "nodal"
    case = parse_case(yaml.safe_dump(content), Path("nodal.yaml"))
    scene = build_scene(case, generate(content["mesh"], "nodal.yaml"))
    assert scene.zones[0].operator.recovery is None
