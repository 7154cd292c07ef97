"""Bodies that nothing moves are left out, bodies without contact are solved on their own."""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from solver.case.reader import load_case, parse_case
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.options import Options, Shortcuts
from solver.simulation.scene.bodies import without_unloaded
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.run import mesh_of
from tests.scenes import PRESSURE, block_mesh, replaced

SOLVE_ALL = Options(Shortcuts(unloaded=False))
CASES = Path(__file__).parents[2] / "cases"
SCENE = """
name: side-by-side
mesh: {recipe: blocks}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: base, fix: [y]}
  - {group: symx, fix: [x]}
  - {group: base_far, fix: [y]}
  - {group: symx_far, fix: [x]}
loads:
  - {group: press, pressure: 25.0}
contact:
  - {name: near, slave: bottom_contact, master: top_contact}
  - {name: far, slave: bottom_contact_far, master: top_contact_far}
"""
ALONE = "\n".join(line for line in SCENE.split("\n") if "far" not in line)


def side_by_side(*meshes):
    """Two pairs of blocks, the second two widths away along x, its groups named `…_far`."""
    points, cells, sets, start, count = [], [], {}, 0, sum(len(m.cells) for m in meshes)
    for number, mesh in enumerate(meshes):
        suffix = ("", "_far")[number]
        points.append(mesh.points + 2.0 * number * np.eye(mesh.points.shape[1])[0])
        first = len(cells)
        cells += [(block.type, block.data + start) for block in mesh.cells]
        for name, members in mesh.cell_sets.items():
            filled = [np.empty(0, dtype=int)] * count
            filled[first : len(cells)] = [np.asarray(m, dtype=int) for m in members]
            sets[name + suffix] = filled
        start += len(mesh.points)
    cells, sets = _merged(cells, sets)
    return meshio.Mesh(np.concatenate(points), cells, cell_sets=sets)


def _merged(cells, sets):
    """Blocks of one type as one, as meshes are everywhere."""
    merged, members = [], {name: [] for name in sets}
    for kind in dict.fromkeys(kind for kind, _ in cells):
        same = [i for i, (k, _) in enumerate(cells) if k == kind]
        ends = np.cumsum([0, *(len(cells[i][1]) for i in same)])
        merged.append((kind, np.concatenate([cells[i][1] for i in same])))
        for name, parts in sets.items():
            shifted = [parts[i] + end for i, end in zip(same, ends, strict=False)]
            members[name].append(np.concatenate(shifted))
    return merged, members


@pytest.fixture(scope="module")
def mesh():
    return side_by_side(block_mesh("QUAD4", "TRIA3", (4, 3)), block_mesh("TRIA6", "QUAD8", (3, 4)))


def solved(mesh, *changes, **options):
    case = parse_case(replaced(SCENE, *changes), Path("beside.yaml"))
    return simulate(case, mesh, **options)


def told(solution, skip):
    return [line.what for line in solution.plan if line.skip == skip]


def nodes_of(solution, far):
    return (solution.mesh.points[:, 0] > 1.5) == far


def test_a_pair_that_nothing_moves_is_left_out_with_its_zero_answer(mesh):
    found = solved(mesh)
    assert told(found, "unloaded") == ["left out, at rest without pressure: bottom_far, top_far"]
    near, far = found.zones
    assert near.multiplier == pytest.approx(PRESSURE, rel=1e-12)
    assert not far.multiplier.any()
    assert not far.gap.any()
    assert far.closed.all()
    still = nodes_of(found, far=True)
    assert not found.displacement[still].any()
    assert not found.stress[still].any()
    assert found.displacement[~still].any()


def test_it_is_the_answer_that_solving_it_gives(mesh):
    short, full = solved(mesh), solved(mesh, options=SOLVE_ALL)
    assert told(full, "unloaded") == []
    assert np.abs(short.displacement - full.displacement).max() < 1e-14
    assert np.abs(short.stress - full.stress).max() < 1e-12 * PRESSURE


def test_only_what_is_left_in_is_factored(mesh):
    case = parse_case(SCENE, Path("beside.yaml"))
    whole = build_scene(case, mesh)
    short = without_unloaded(whole)
    near = short.points[:, 0] < 1.5
    assert {int(b) for block in short.blocks for b in near[block.cells].ravel()} == {1}
    assert ContactProblem(short).matrix.shape[0] < 0.7 * ContactProblem(whole).matrix.shape[0]


@pytest.mark.parametrize(
    ("change", "pressure"),
    [
        (("contact:", "  - {group: press_far, pressure: 10.0}\ncontact:"), 10.0),
        (("master: top_contact_far", "master: top_contact_far, interference: 0.001"), 0.0),
        (("{group: base_far, fix: [y]}", "{group: base_far, fix: {y: 0.001}}"), 0.0),
        (("contact:", "  - {group: all, body_force: [0.0, -1.0]}\ncontact:"), 1.0),
    ],
    ids=["load", "overlap", "imposed displacement", "weight"],
)
def test_whatever_moves_a_pair_keeps_it_in(mesh, change, pressure):
    found = solved(mesh, change)
    assert told(found, "unloaded") == []
    assert found.displacement[nodes_of(found, far=True)].any()
    assert found.zones[1].multiplier.mean() == pytest.approx(pressure, abs=1e-9)


def test_a_load_that_comes_through_contact_keeps_the_body_below_in(mesh):
    """Of each pair the upper block alone is loaded, the lower one feels it through the zone."""
    found = solved(mesh, ("press, ", "press_far, "))
    assert told(found, "unloaded") == ["left out, at rest without pressure: bottom, top"]
    assert found.zones[1].multiplier == pytest.approx(PRESSURE, rel=1e-12)


def test_an_open_pair_that_nothing_moves_keeps_its_gap(mesh):
    raised = meshio.Mesh(mesh.points.copy(), mesh.cells, cell_sets=mesh.cell_sets)
    kind = [block.type for block in mesh.cells].index("quad8")
    top = np.unique(mesh.cells[kind].data[mesh.cell_sets["top_far"][kind]])
    raised.points[top, 1] += 0.125
    held = ("loads:", "  - {group: press_far, fix: [y]}\nloads:")
    far = solved(raised, held).zones[1]
    assert far.gap == pytest.approx(0.125, rel=1e-13)
    assert not far.closed.any()


def test_a_free_body_is_refused_whether_loaded_or_not(mesh):
    with pytest.raises(InputError, match="free motion"):
        solved(mesh, ("  - {group: symx_far, fix: [x]}\n", ""))


def test_a_case_without_any_load_is_solved_as_it_is(mesh):
    found = solved(mesh, ("pressure: 25.0", "pressure: 0.0"))
    assert told(found, "unloaded") == []
    assert not found.displacement.any()


@pytest.mark.parametrize("cells", ["QUAD4", "TRIA6"])
def test_a_rigid_body_has_no_stiffness_and_bears_its_load(cells):
    mesh = side_by_side(block_mesh("QUAD8", cells, (1, 3)))
    text = ALONE.replace("materials: {all:", "bodies: {bottom: {rigid: true}}\nmaterials: {top:")
    text = text.replace(
        "slave: bottom_contact, master: top_contact", "slave: top_contact, master: bottom_contact"
    )
    case = parse_case(text.replace("  - {group: base, fix: [y]}\n", ""), Path("rigid.yaml"))
    short, full = simulate(case, mesh), simulate(case, mesh, options=SOLVE_ALL)
    assert told(short, "unloaded") == ["no stiffness of bottom"]
    assert told(full, "unloaded") == []
    for solution in (short, full):
        assert solution.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-12)
        assert max(solution.quality.balance.values()) < 1e-13
    assert np.abs(short.displacement - full.displacement).max() < 1e-15


@pytest.mark.parametrize(
    ("support", "said"),
    [
        ("{group: base, fix: {y: 0.001}}", "supports[1].fix.y = 0.001: given to 2 nodes of the"),
        ("{group: base, fix: {x: 0.5*x}}", "supports[1].fix.x = 0.5: given to 2 nodes of the"),
    ],
)
def test_a_displacement_given_to_a_rigid_body_is_refused(support, said):
    text = ALONE.replace("materials:", "bodies: {bottom: {rigid: true}}\nmaterials:")
    text = text.replace("slave: bottom_contact, master: top", "slave: top_contact, master: bottom")
    text = text.replace("loads:", f"  - {support}\nloads:").replace(
        "  - {group: base, fix: [y]}\n", ""
    )
    message = re.escape(said) + " rigid body bottom, which is fixed; allowed there: 0"
    with pytest.raises(InputError, match=message):
        simulate(parse_case(text, Path("rigid.yaml")), block_mesh("QUAD4", "QUAD4", (1, 3)))


def test_on_a_rigid_body_a_gap_is_judged_by_the_stiffness_of_the_other():
    case = load_case(CASES / "manufactured/quad4.yaml")
    for options in (Options(), SOLVE_ALL):
        assert (
            1e-14 < simulate(case, mesh_of(case), options=options).quality.accuracy["gap"] < 1e-10
        )


def test_a_body_that_supports_move_keeps_its_stiffness(mesh):
    """All nodes of the upper far block are given a displacement, zero only where it touches."""
    moved = ("loads:", "  - {group: top_far, fix: {x: 0.0, y: 0.001*y}}\nloads:")
    free = ("  - {group: symx_far, fix: [x]}\n", "  - {group: bottom_far, fix: [x]}\n")
    found = solved(mesh, moved, free)
    assert told(found, "unloaded") == ["left out, at rest without pressure: bottom_far"]
    top = nodes_of(found, far=True) & (found.mesh.points[:, 1] > 0.1)
    assert np.abs(found.stress[top]).max() > 1


def test_a_body_outside_every_zone_is_solved_on_its_own(mesh):
    change = (
        ("contact:", "  - {group: press_far, pressure: 10.0}\ncontact:"),
        ("  - {name: far, slave: bottom_contact_far, master: top_contact_far}\n", ""),
        ("loads:", "  - {group: top_contact_far, fix: [y]}\nloads:"),
    )
    # Without a zone the lower far block feels nothing; the upper one hangs on its own supports.
    apart = solved(mesh, *change)
    assert "2 groups of bodies solved apart" in told(apart, "")
    assert told(apart, "unloaded") == ["left out, at rest without pressure: bottom_far"]
    assert apart.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-12)


def test_a_group_keeps_its_factor_while_another_changes_its_status(mesh, monkeypatch):
    """The near pair is lifted at one end and needs several solves, the far one is factored once."""
    from solver.mechanics.linear import systems

    sizes, plain = [], systems.condense
    monkeypatch.setattr(systems, "condense", lambda *a: sizes.append(a[0].shape[0]) or plain(*a))
    lifted = ("{group: press, pressure: 25.0}", "{group: press, pressure: 60.0 - 115*x}")
    loaded = ("contact:", "  - {group: press_far, pressure: 10.0}\ncontact:")
    found = solved(mesh, lifted, loaded)
    assert found.cost.iterations > 2
    assert sorted(sizes.count(size) for size in set(sizes)) == [1, found.cost.iterations]


def test_groups_and_faces_that_the_case_does_not_name_are_left_behind():
    mesh = block_mesh("QUAD4", "TRIA3", (4, 3))
    case = parse_case(ALONE, Path("beside.yaml"))
    found = simulate(case, mesh)
    lines = [line.what for line in found.plan if "left behind: " in line.what]
    named = {"base", "symx", "press", "bottom_contact", "top_contact"}
    groups = set(mesh.cell_sets) - named - {"bottom", "top"}
    edges = sum(len(b.data) for b in mesh.cells if b.type == "line")
    kept = [m for name in named for m, b in zip(mesh.cell_sets[name], mesh.cells, strict=True)]
    used = len(np.unique(np.concatenate([m for m in kept if len(m)])))
    assert lines == [
        f"left behind: {len(groups)} group, {edges - used} faces and edges of the mesh"
    ]
    assert [body.name for body in found.bodies] == ["bottom", "top"]


def test_a_body_that_springs_alone_hold_is_left_out_too():
    text = SCENE.replace("{group: base_far, fix: [y]}", "{group: base_far, spring: {y: 40.0}}")
    mesh = side_by_side(*[block_mesh("QUAD4", "QUAD4", (2, 2))] * 2)
    scene = without_unloaded(build_scene(parse_case(text, Path("side.yaml")), mesh))
    assert scene.rest.unloaded_bodies.tolist() == [False, False, True, True]
