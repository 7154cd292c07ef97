"""Groups that a case makes, forces and supports at nodes: the patch test posed by them.

Two unit squares (cubes) lie on each other, the interface in the last coordinate 0. The uniform
state has the pressure 25.
"""

from pathlib import Path

import meshio
import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.mesh import transform
from solver.simulation.scene.selections import with_groups
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from tests.scenes import PRESSURE, block_mesh, errors

GROUPS = """\
groups:
  low: {plane: {point: [5, -1], normal: [0, 3]}}
  left: {within: [bottom, top], plane: {point: [0, 0], normal: [1, 0]}}
  slave: {within: bottom, box: {low: [-1, 0], high: [2, 0]}}
  master: {within: top, where: "min(y, 1e-3 - abs(y))"}
  corner: {of: nodes, sphere: {centre: [0, -2], radius: 1}}
  cells: {of: cells, where: -y}
"""
CASE = """\
name: patch
mesh: {recipe: blocks, size: 1.0}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports: [{group: low, fix: [y]}, {group: left, fix: [x]}]
loads: [{group: press, pressure: 25.0}]
contact: [{slave: slave, master: master}]
"""


def parsed(text):
    return parse_case(text, Path("patch.yaml"))


def test_selected_groups_hold_what_is_there():
    mesh = with_groups(parsed(CASE + GROUPS), block_mesh("QUAD4", "TRIA3", (2, 3)))
    line = next(i for i, block in enumerate(mesh.cells) if block.type == "line")

    def faces(group):
        return mesh.points[mesh.cells[line].data[mesh.cell_sets[group][line]]]

    assert {g: len(faces(g)) for g in ("low", "left", "slave", "master")} == {
        "low": 2,
        "left": 5,
        "slave": 2,
        "master": 3,
    }
    assert (faces("low")[..., 1] == -1).all()
    assert (faces("left")[..., 0] == 0).all()
    assert mesh.points[mesh.point_sets["corner"]].tolist() == [[0.0, -1.0]]
    assert [len(part) for part in mesh.cell_sets["cells"] if len(part)] == [4]


@pytest.mark.parametrize("swapped", [False, True])
def test_patch_test_on_selected_groups(swapped):
    solution = simulate(
        parsed(CASE + GROUPS).as_solved(swapped), block_mesh("QUAD4", "TRIA3", (2, 3))
    )
    assert max(errors(solution).values()) < 1e-12


def test_lists_of_groups_form_one():
    text = CASE.replace("group: low, fix: [y]", "group: [base, base], fix: [y]")
    text = text.replace("group: left", "group: [symx]").replace(
        "slave: slave, master: master", "slave: [bottom_contact], master: [top_contact]"
    )
    text = text.replace(
        "plane: strain\n", "plane: strain\ngroups: {up: {box: {low: [-1, 1], high: [2, 1]}}}\n"
    )
    text = text.replace("group: press,", "group: [press, up],")
    solution = simulate(parsed(text), block_mesh("QUAD8", "QUAD4", (2, 3)))
    assert solution.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-12)


@pytest.mark.parametrize(("dim", "cells"), [(2, "QUAD8"), (3, "HEXA8")])
def test_two_point_supports_and_a_force_on_a_group(dim, cells):
    """The force 25 on the area 1 is the pressure; single nodes hold the blocks across the load.

    In 2D one node of each block, in 3D a node along x and y and another along y against turning:
    the uniform state has ux = 0 on x = 0 (uy = 0 on y = 0), so that these nodes bear nothing.
    """
    up, zero = "xyz"[dim - 1], [0.0] * (dim - 1)
    held = f"supports:\n  - {{group: base, fix: [{up}]}}\n"
    for level in (-1.0, 1.0):
        across = ["x", "y"][: dim - 1]
        held += f"  - {{at: {[*zero, level]}, fix: [{', '.join(across)}]}}\n"
        if dim == 3:
            held += f"  - {{at: [1.0, 0.0, {level}], fix: [y]}}\n"
    text = (
        "name: patch\nmesh: {recipe: blocks, size: 1.0}\n"
        + ("plane: strain\n" if dim == 2 else "")
        + "materials: {all: {young: 2000.0, poisson: 0.3}}\n"
        + held
        + f"loads: [{{group: press, force: {[*zero, -PRESSURE]}}}]\n"
        + "contact: [{slave: bottom_contact, master: top_contact}]\n"
    )
    mesh = block_mesh(cells, cells, (2, 3))
    solution = simulate(parsed(text), mesh)
    assert max(errors(solution).values()) < 1e-12
    assert max(solution.quality.balance.values()) < 1e-12
    # Without the node that is fixed across, the upper block moves freely.
    loose = "\n".join(
        line for line in text.split("\n") if "1.0], fix" not in line or "-1.0]" in line
    )
    with pytest.raises(InputError, match="nothing keeps top from a free motion"):
        simulate(parsed(loose), mesh)


def test_forces_at_nodes_are_those_of_a_pressure_on_one_linear_face():
    """Half of 25 at each end of a face of length 1 with linear shape functions."""
    text = (CASE + GROUPS).replace(
        "{group: press, pressure: 25.0}",
        "{at: [0, 1], force: [0, -12.5]}, {at: [1, 1], force: [0, -12.5]}",
    )
    mesh = block_mesh("TRIA6", "QUAD4", (2, 1))
    assert max(errors(simulate(parsed(text), mesh)).values()) < 1e-12
    both = "groups:\n  ends: {of: nodes, within: top, where: y - 1}\n"
    text = text.replace("groups:\n", both).split("loads:")
    text = (
        text[0] + "loads: [{group: ends, force: [0, -25]}]\ncontact:" + text[1].split("contact:")[1]
    )
    assert max(errors(simulate(parsed(text), mesh)).values()) < 1e-12


def test_all_nodes_in_a_support():
    """No node moves along x: u_y = -25 (y + 1)/(λ + 2μ), σ_xx = -25 ν/(1 - ν)."""
    text = (CASE + GROUPS).replace("group: left, fix: [x]", "group: all, fix: [x]")
    solution = simulate(parsed(text), block_mesh("QUAD4", "TRIA6", (2, 3)))
    x, stiff = solution.mesh.points, 2000 * 0.7 / (1.3 * 0.4)
    assert solution.displacement[:, 1] == pytest.approx(-25 * (x[:, 1] + 1) / stiff, abs=1e-14)
    assert solution.stress[:, 0] == pytest.approx(np.full(len(x), -25 * 0.3 / 0.7), rel=1e-12)


REFUSED = [
    ("group: low,", "group: [low, lox],", "supports[0].group = 'lox': no such group in the mesh"),
    ("group: low,", "at: [0.3, -1.1],", "the nearest is at (0.5, -1), 0.224 away"),
    ("group: low,", "at: [0, 0],", "supports[0].at = [0.0, 0.0]: 2 nodes are there"),
    ("group: low,", "at: [0, 0, 0],", "supports[0].at = [0.0, 0.0, 0.0]: must have 2 components"),
    ("group: low,", "", "must be {fix, spring or together, and exactly one of group, at}"),
    ("group: low, fix: [y]", "group: all, fix: [normal]", "normal needs a group of faces"),
    ("point: [5, -1]", "point: [5, -2]", "groups.low = 'low': no faces of the mesh are there"),
    ("normal: [0, 3]", "normal: [0, 0]", "groups.low.plane.normal = [0, 0]: must have a direction"),
    (
        "normal: [0, 3]",
        "normal: [0, 3, 0]",
        "groups.low.plane.normal = [0.0, 3.0, 0.0]: must have 2",
    ),
    ("where: -y", "where: -z", "groups.cells.where = '-z': z in a plane case"),
    ("where: -y", "", "and exactly one of plane, sphere, box, where}"),
    ("within: bottom", "within: botom", "groups.slave = 'botom': no such group in the mesh"),
    ("within: bottom", "within: cells", "= 'cells': is made after it: list that group first"),
    ("  low: ", "  base: ", "groups.base = 'base': the mesh has a group of this name"),
    ("  low: ", "  all: ", "groups.all = 'all': the mesh has a group of this name"),
    ("group: press, pressure: 25.0", "at: [0, 1], pressure: 2.0", "{at, force}"),
    (
        "group: press, pressure: 25.0",
        "group: [press, corner], force: [0, -1]",
        "holds nodes, and faces or cells; one kind is needed",
    ),
    ("group: low, fix: [y]", "group: [low, corner], spring: {normal: 1}", "one kind is needed"),
    ("group: press, pressure: 25.0", "group: top, force: [1, 0]", "a group of faces is needed"),
]


@pytest.mark.parametrize(("old", "new", "message"), REFUSED, ids=[r[2][:40] for r in REFUSED])
def test_refusals(old, new, message):
    text = CASE + GROUPS
    assert old in text
    with pytest.raises(InputError) as refusal:
        simulate(parsed(text.replace(old, new)), block_mesh("QUAD4", "TRIA3", (2, 3)))
    assert message in str(refusal.value)


def test_points_that_differ_in_the_seventh_digit_are_two_groups():
    text = CASE.replace(
        "{group: press, pressure: 25.0}",
        "{at: [1.0000001, 1], force: [0, -1]}, {at: [1.0000002, 1], force: [0, -1]}",
    )
    case = parsed(text + GROUPS)
    assert [load.group for load in case.loads] == ["(1.0000001, 1)", "(1.0000002, 1)"]
    assert {made.values for made in case.mesh.selections if made.shape == "at"} == {
        (1.0000001, 1.0),
        (1.0000002, 1.0),
    }


def test_a_group_with_the_name_of_a_list_of_groups_is_refused():
    text = (CASE + GROUPS).replace("  low:", "  a+b: {of: cells, where: y}\n  low:")
    with pytest.raises(InputError, match=r"loads\[0\].group = 'a\+b': the group of groups"):
        parsed(text.replace("group: press", "group: [a, b]"))


def test_faces_that_selections_do_not_take_leave_no_trace():
    """The faces on the outside are found for a selection; the mesh then has those selected."""
    case, mesh = parsed(CASE + GROUPS), block_mesh("QUAD4", "TRIA3", (2, 3))
    kept = {name for name in mesh.cell_sets if name in ("top", "bottom", "press")}
    bare = meshio.Mesh(
        mesh.points,
        [b for b in mesh.cells if b.type != "line"],
        cell_sets={
            name: [
                p for p, b in zip(mesh.cell_sets[name], mesh.cells, strict=True) if b.type != "line"
            ]
            for name in kept - {"press"}
        },
    )
    found = with_groups(case, bare)
    assert {*found.cell_sets} == {"top", "bottom", "low", "left", "slave", "master", "cells"}
    assert [len(block.data) for block in found.cells if block.type == "line"] == [12]


def test_a_list_makes_a_group_for_keys_that_name_groups():
    """`both` has the material of both blocks, `lower` is a rigid body in name only."""
    text = CASE.replace("materials: {all: {", "materials: {both: {").replace(
        "contact:",
        "bodies: {both: {rigid: false}}\ngroups: {both: [top, bottom], up: [press]}\ncontact:",
    )
    text = text.replace(
        "slave: slave, master: master", "slave: bottom_contact, master: top_contact"
    )
    text = text.replace("group: low", "group: base").replace("group: left", "group: symx")
    text = text.replace("group: press", "group: up")
    solution = simulate(parsed(text), block_mesh("QUAD8", "QUAD4", (2, 3)))
    assert solution.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-12)
    with pytest.raises(InputError, match=r"groups\.both.*no such group in the mesh"):
        with_groups(
            parsed(text.replace("[top, bottom]", "[top, bottoms]")), block_mesh("QUAD4", "QUAD4")
        )


def test_transforms_move_lists_of_groups():
    """Both blocks moved by lists of their groups; the lower one alone moves by its own."""
    mesh = block_mesh("QUAD4", "QUAD4", (1, 1))
    both = transform(mesh, {"shift": {"group": ["bottom", "top"], "by": [1, 2]}})
    assert both.points == pytest.approx(mesh.points + np.array([1, 2]))
    picked = transform(
        mesh, {"pick": {"from": ["base", "press"], "low": [-1, -2], "high": [2, 2], "name": "ends"}}
    )
    assert sum(map(len, picked.cell_sets["ends"])) == 2
