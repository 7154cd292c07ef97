"""Contact beyond one patch: zones, starts, corners, and what must be refused by name."""

import re

import meshio
import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_MESHIO, BY_NAME, cell_type
from solver.lac.errors import SolveError
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from tests.scenes import block_case, block_mesh, changed_case, errors, turn, with_points


def split_slave(mesh, apart=0.0):
    """Of the slave surface two groups, `left` and `right` of x = 1/2, so far from it or more."""
    for name, side in (("left", -1), ("right", 1)):
        parts = []
        for block, members in zip(mesh.cells, mesh.cell_sets["bottom_contact"], strict=True):
            members = np.asarray(members, dtype=int)
            x = mesh.points[block.data[members]].mean(axis=1)[:, 0] if len(members) else members
            parts.append(members[side * (x - 0.5) > apart])
        mesh.cell_sets[name] = parts
    return mesh


def moved(by, **options):
    """The upper block's top moved up instead of loaded."""
    base = "- {group: base, fix: [y]}"
    imposed = f"{base}\n  - {{group: press, fix: {{y: {by}}}}}"
    return changed_case(
        2, (base, imposed), ("loads:\n  - {group: press, pressure: 25.0}\n", ""), **options
    )


def test_both_starts_give_the_same_answer_where_the_bodies_are_held():
    case = moved(-0.01)
    scene = build_scene(case, block_mesh("TRIA3", "QUAD4", (4, 3)))
    problem = ContactProblem(scene)
    closed = problem.solve(1.0)
    opened = problem.solve(1.0, np.zeros(4, dtype=bool))
    assert closed.status.closed.all()
    assert opened.status.closed.all()
    assert opened.status.iterations == 2
    assert opened.pressure == pytest.approx(closed.pressure, rel=1e-12)
    # half of the imposed shortening of 0.01 over two blocks in plane strain
    assert closed.pressure == pytest.approx(np.full(4, 0.005 * 2000 / (1 - 0.3**2)), rel=1e-12)


def test_pulled_apart_the_surfaces_open_and_carry_nothing():
    solution = simulate(moved(0.01), block_mesh("QUAD4", "QUAD8", (4, 3)))
    zone = solution.zones[0]
    assert not zone.closed.any()
    assert (zone.multiplier == 0).all()
    assert zone.gap == pytest.approx(np.full(4, 0.01), rel=1e-12)
    assert np.abs(solution.stress).max() < 1e-9


@pytest.mark.parametrize("overlap", [", interference: 0.01", ", clearance: -0.01"])
def test_interference_presses_as_an_imposed_overlap_would(overlap):
    case = moved(0.0, zone=overlap)
    solution = simulate(case, block_mesh("TRIA6", "QUAD4", (4, 3)))
    pressure = solution.zones[0].multiplier
    assert pressure == pytest.approx(np.full(4, 0.005 * 2000 / (1 - 0.3**2)), rel=1e-12)


def test_a_clearance_stands_for_the_gap_as_meshed():
    """The mean of 0.01 x over each macro-element is its value at the centre."""
    mesh = block_mesh("QUAD4", "TRIA3", (4, 3))
    mesh.points[:, 0] += 7.0
    case = block_case(2, zone=", clearance: '0.01 * x', interference: 0.02")
    zone = build_scene(case, mesh).zones[0]
    centre = 7.0 + (np.arange(4) + 0.5) / 4
    mean = zone.operator.initial / zone.operator.covered
    assert np.sort(mean) == pytest.approx(0.01 * centre - 0.02, rel=1e-12)


def test_several_zones_carry_the_patch_together():
    mesh = split_slave(block_mesh("HEXA8", "TETRA4", (4, 2)))
    both = "contact:\n  - {name: a, slave: left, master: top_contact}\n"
    both += "  - {name: b, slave: right, master: top_contact}\n"
    one = "contact:\n  - {name: interface, slave: bottom_contact, master: top_contact}\n"
    shared = changed_case(3, (one, both))
    # side by side, and with two columns of faces left out between them
    for faces in (mesh, split_slave(mesh, 0.25)):
        solution = simulate(shared, faces)
        assert [zone.name for zone in solution.zones] == ["a", "b"]
        carried = sum(zone.multiplier @ zone.area for zone in solution.zones)
        assert carried == pytest.approx(25.0, rel=1e-12)
        assert max(solution.quality.balance.values()) < 1e-12


@pytest.mark.parametrize("cells", ["HEXA8", "HEXA20", "TETRA10"])
def test_a_contact_zone_around_an_edge_is_cut_conformingly(cells):
    """Two sides of the lower block are slaves; some cells own faces of both; one meets nothing."""
    mesh = with_side(block_mesh(cells, cells, (2, 2)), cells)
    solution = simulate(block_case(3), mesh)
    zone = solution.zones[0]
    side = zone.normal[:, 0] > 0.5
    assert side.any()
    assert not zone.closed[side].any()
    assert (zone.coverage[side] < 1e-12).all()
    assert zone.multiplier[~side] == pytest.approx(np.full((~side).sum(), 25.0), rel=1e-12)
    assert solution.stress[:, 2] == pytest.approx(np.full(len(solution.stress), -25.0), rel=1e-11)


def with_side(mesh, cells):
    """The faces at x = 1 of the lower block, added to the mesh and to the slave group."""
    kind = BY_NAME[cells]
    data = next(b.data for b in mesh.cells if b.type == kind.meshio)
    faces = []
    for face in kind.faces:
        nodes = data[:, list(face.nodes)]
        at = mesh.points[nodes]
        faces.append(nodes[(np.abs(at[:, :, 0] - 1) < 1e-9).all(1) & (at[:, :, 2] < 1e-9).all(1)])
    new = np.concatenate(faces)
    blocks, sets = [], {k: [*map(np.asarray, v)] for k, v in mesh.cell_sets.items()}
    for k, block in enumerate(mesh.cells):
        both = block.data
        if BY_MESHIO[block.type] is cell_type(kind.faces[0].type):
            sets["bottom_contact"][k] = np.union1d(
                sets["bottom_contact"][k], len(both) + np.arange(len(new))
            ).astype(int)
            both = np.vstack([both, new])
        blocks.append((block.type, both))
    return meshio.Mesh(mesh.points, blocks, cell_sets=sets)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            [("  - {group: symx, fix: [x]}\n", "")],
            r"supports: nothing keeps (bottom|top) from a free motion .*; add a support",
        ),
        (
            [
                (
                    "- {group: base, fix: [y]}",
                    "- {group: bottom, fix: [y]}\n  - {group: bottom, fix: [x]}",
                )
            ],
            r"supports: 4 macro-elements of zone interface .* have no free unknown of their own",
        ),
        (
            [("slave: bottom_contact", "slave: base")],
            r"contact\[0\].master = 'top_contact': does not lie over base",
        ),
        (
            [
                (
                    "- {group: base, fix: [y]}",
                    "- {group: base, fix: {y: 0.5}}\n  - {group: bottom, fix: [y]}",
                )
            ],
            r"supports\[1\].fix.y = 0.0: .* another displacement",
        ),
    ],
)
def test_refusals_name_what_is_wrong(change, message):
    with pytest.raises(InputError) as refusal:
        simulate(changed_case(2, *change), block_mesh("QUAD4", "QUAD4", (4, 3)))
    assert re.search(message, str(refusal.value)), str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).startswith("patch.yaml: ")


def test_a_face_inside_a_body_is_refused():
    mesh = block_mesh("QUAD4", "QUAD4", (4, 3))
    inner = mesh.cells[0].data[0][[1, 2]]
    other = np.flatnonzero(np.isin(mesh.cells[0].data, inner).sum(axis=1) == 2)
    assert len(other) == 2
    cells = [
        (b.type, np.vstack([b.data, inner]) if b.type == "line" else b.data) for b in mesh.cells
    ]
    sets = dict(mesh.cell_sets)
    sets["press"] = [
        np.append(part, len(b.data)).astype(int) if b.type == "line" else part
        for part, b in zip(sets["press"], mesh.cells, strict=True)
    ]
    bad = meshio.Mesh(mesh.points, cells, cell_sets=sets)
    with pytest.raises(InputError, match="1 of its faces have a cell on both sides"):
        simulate(block_case(2), bad)


def test_a_body_that_only_tension_could_hold_is_a_failed_solve():
    case = changed_case(2, ("pressure: 25.0", "pressure: -25.0"))
    message = r"nothing keeps top from a free motion \(move along y\) once 4 .* the loads part the"
    with pytest.raises(SolveError, match=message):
        simulate(case, block_mesh("QUAD4", "QUAD4", (4, 3)))


def test_a_symmetry_plane_of_any_direction_holds_as_an_axis_does():
    mesh = block_mesh("HEXA8", "TETRA10")
    case = changed_case(3, normal=True)
    solution = simulate(case, with_points(mesh, mesh.points @ turn(3, 0.7).T))
    assert solution.zones[0].multiplier == pytest.approx(np.full(9, 25.0), rel=1e-12)
    assert solution.fields.normal_stress == pytest.approx(
        np.full(len(solution.stress), -25.0), rel=1e-11
    )


def test_force_on_the_bodies_is_balanced():
    solution = simulate(block_case(3), block_mesh("TETRA4", "HEXA27"))
    assert set(solution.quality.balance) >= {"zone interface: force", "reactions and loads: moment"}
    assert errors(solution)["balance"] < 1e-13


def test_a_solution_knows_the_nodes_of_supports_and_loads():
    solution = simulate(block_case(2), block_mesh("QUAD4", "QUAD8", (4, 3)))
    y = solution.mesh.points[:, 1]
    base = solution.case.supports.index(
        next(s for s in solution.case.supports if s.group == "base")
    )
    assert set(solution.places.acted[f"supports[{base}].group"]) == set(
        np.flatnonzero(y == y.min())
    )
    assert set(solution.places.acted["loads[0].group"]) == set(np.flatnonzero(y == y.max()))
    assert len(solution.places.acted["loads[0].group"]) == 2 * 3 + 1  # mid-nodes too
