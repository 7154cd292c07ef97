"""A case against its mesh: every misfit is refused, by the name of the group."""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.simulation.scene.groups import check_groups
from solver.system.errors import InputError

PATH = Path("family/c.yaml")
PLANE = """\
name: two
mesh: {file: two.msh}
plane: strain
materials:
  lower: {young: 1.0, poisson: 0.3}
  upper: {young: 2.0, poisson: 0.3}
supports:
  - {group: base, fix: [y]}
  - {group: corner, fix: [x]}
loads:
  - {group: press, pressure: 1.0}
  - {group: all, body_force: [0.0, -1.0]}
contact:
  - {name: a, slave: bottom_contact, master: top_contact}
counts: {lower: {cells: 1}}
"""
# The upper body is fixed: all that is loaded is the lower one.
RIGID = (
    PLANE.replace("  - {group: press, pressure: 1.0}\n", "").replace("group: all", "group: lower")
    + "bodies: {upper: {rigid: true}}\n"
)


def two_squares():
    """One QUAD4 on another, each with its own nodes, and a SEG2 on each horizontal side."""
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    groups = {
        "lower": [[0], []],
        "upper": [[1], []],
        "base": [[], [0]],
        "bottom_contact": [[], [1]],
        "top_contact": [[], [2]],
        "press": [[], [3]],
        "same": [[], [4]],
        "empty": [[], []],
        "mixed": [[0], [0]],
        "both": [[0, 1], []],
    }
    return meshio.Mesh(
        np.concatenate([square, square + np.array([0.0, 1.0])]),
        [
            ("quad", np.array([(0, 1, 2, 3), (4, 5, 6, 7)])),
            ("line", np.array([(0, 1), (2, 3), (4, 5), (6, 7), (3, 2)])),
        ],
        point_sets={"corner": np.array([0]), "nowhere": np.array([], dtype=int)},
        cell_sets={k: [np.array(p, dtype=int) for p in parts] for k, parts in groups.items()},
    )


def test_a_case_that_fits_is_accepted():
    check_groups(parse_case(PLANE, PATH), two_squares())
    check_groups(parse_case(PLANE, PATH).as_solved(True), two_squares())


def test_materials_for_all_and_for_rigid_bodies():
    everywhere = re.sub(r"  lower.*\n  upper: (.*)\n", r"  all: \1\n", PLANE)
    check_groups(parse_case(everywhere, PATH), two_squares())
    override = PLANE.replace("  upper:", "  all:")
    check_groups(parse_case(override, PATH), two_squares())
    rigid = re.sub(r"  upper: .*\n", "", RIGID)
    check_groups(parse_case(rigid, PATH), two_squares())


GROUPS = "allowed: base, both, bottom_contact, corner, empty, lower, mixed, nowhere, press, "
MISFITS = [
    # groups that are not there, or not of the right kind
    ("group: base", "group: bases", "supports[0].group = 'bases': no such group in the mesh; did"),
    ("group: press", "group: no", f"loads[0].group = 'no': no such group in the mesh; {GROUPS}"),
    ("group: press", "group: lower", "loads[0].group = 'lower': holds 1 QUAD4 but no faces; a g"),
    ("group: press", "group: corner", "loads[0].group = 'corner': is a group of nodes; a group "),
    ("group: all", "group: press", "loads[1].group = 'press': holds 1 SEG2 but no volume cells;"),
    ("group: corner, fix: [x]", "group: empty, fix: [x]", "supports[1].group = 'empty': is empty"),
    ("group: corner", "group: nowhere", "supports[1].group = 'nowhere': is empty"),
    ("corner, fix: [x]", "corner, fix: [normal]", "supports[1].group = 'corner': is a group of n"),
    ("  lower:", "  lover:", "materials.lover = 'lover': no such group in the mesh; did you mean "),
    ("{lower: {cells", "{lover: {cells", "counts.lover = 'lover': no such group in the mesh; did"),
    # materials
    ("  upper:", "  both:", "materials = ['lower', 'both']: 1 cells have more than one material"),
    (
        "  upper: {young: 2.0, poisson: 0.3}\n",
        "",
        "materials = ['lower']: 1 of 2 volume cells have no material; name their group, or `all`",
    ),
    # contact surfaces
    (
        "slave: bottom_contact",
        "slave: empty",
        "contact[0].slave = 'empty': is empty, or none of its members touches a volume cell (a ",
    ),
    ("slave: bottom_contact", "slave: lower", "contact[0].slave = 'lower': holds 1 QUAD4 but no f"),
    ("master: top_contact", "master: top", "contact[0].master = 'top': no such group in the mesh;"),
    ("master: top_contact", "master: same", "contact[0].master = 'same': 1 of its faces are slave"),
    ("name: two\n", "name: two\nbodies: {lower: {rigid: true}}\n", "contact[0].slave = 'bottom_co"),
    ("name: two\n", "name: two\nbodies: {press: {rigid: true}}\n", "bodies.press = 'press': holds"),
    # dimension
    (
        "plane: strain\n",
        "",
        "plane: this key is needed (strain, stress or axisymmetric): the mesh is plane",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), MISFITS, ids=[f"{m[1]}" for m in MISFITS])
def test_misfits(old, new, message):
    assert PLANE.count(old) == 1
    case = parse_case(PLANE.replace(old, new), PATH)
    with pytest.raises(InputError, match="^family/c.yaml: " + re.escape(message)):
        check_groups(case, two_squares())


def test_a_rigid_side_is_master_in_every_direction_solved():
    check_groups(parse_case(RIGID, PATH), two_squares())
    message = re.escape("contact[0].master = 'top_contact': lies on the rigid body upper; a rigid")
    with pytest.raises(InputError, match=message):
        check_groups(parse_case(RIGID, PATH).as_solved(True), two_squares())
    with pytest.raises(InputError, match=message):
        check_groups(parse_case(RIGID + "directions: both\n", PATH), two_squares())


@pytest.mark.parametrize(
    ("load", "lost"),
    [
        ("group: press, pressure: 1.0", "1 of its 1 faces"),
        ("group: press, traction: [1.0, 0.0]", "1 of its 1 faces"),
        ("group: sides, pressure: 1.0", "1 of its 2 faces"),
        ("group: all, body_force: [0.0, -1.0]", "1 of its 2 cells"),
        ("group: both, body_force: [0.0, -1.0]", "1 of its 2 cells"),
    ],
)
def test_a_load_on_a_rigid_body_would_vanish(load, lost):
    mesh = two_squares()
    mesh.cell_sets["sides"] = [np.array([], dtype=int), np.array([0, 3])]
    case = parse_case(RIGID.replace("group: lower, body_force: [0.0, -1.0]", load), PATH)
    message = f"loads[0].group = '{load.split()[1][:-1]}': {lost} belong to the rigid body upper, "
    with pytest.raises(InputError, match=re.escape(message) + "which is fixed"):
        check_groups(case, mesh)


@pytest.mark.parametrize("side", ["slave", "master"])
def test_a_rigid_side_is_the_master(side):
    """Named as slave, or to be exchanged with it."""
    line = "  - {name: a, slave: bottom_contact, master: top_contact}\n"
    other = "master" if side == "slave" else "slave"
    text = RIGID.replace(line, f"  - {{{side}: top_contact, {other}: bottom_contact}}\n")
    text += f"directions: {'first' if side == 'slave' else 'both'}\n"
    so = "" if side == "slave" else ", so directions must be `first`"
    said = (
        f"{side} = 'top_contact': lies on the rigid body upper; a rigid side is always the master"
    )
    with pytest.raises(InputError, match=f"{said}{so}$"):
        check_groups(parse_case(text, PATH), two_squares())


SOLID = """\
name: one
mesh: {file: one.msh}
materials: {all: {young: 1.0, poisson: 0.3}}
supports: [{group: base, fix: [z]}]
"""


def tetrahedron():
    return meshio.Mesh(
        np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float),
        [("tetra", np.array([(0, 1, 2, 3)])), ("triangle", np.array([(0, 2, 1)]))],
        cell_sets={"base": [np.array([], dtype=int), np.array([0])]},
    )


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("plane: strain", "plane = 'strain': only for plane meshes; this one has three dimensions"),
        (
            "loads: [{group: base, traction: [0, 1]}]",
            "[0.0, 1.0]: must have 3 components: the case is in 3D",
        ),
    ],
)
def test_a_solid_is_not_plane(line, message):
    check_groups(parse_case(SOLID, PATH), tetrahedron())
    # A plane case cannot speak of z to begin with.
    text = (SOLID.replace("[z]", "[y]") if "plane" in line else SOLID) + line
    with pytest.raises(InputError, match=re.escape(message)):
        check_groups(parse_case(text, PATH), tetrahedron())
