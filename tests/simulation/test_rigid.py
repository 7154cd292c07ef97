"""Rigid bodies that move, and rigid surfaces without a mesh: patch tests, forces, Lamé."""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.codes.deck import UnsupportedError, deck_of
from solver.lac.cells.catalogue import BY_NAME
from solver.mesh import generate
from solver.mesh.tidy import tidy
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.judge import judge
from tests.scenes import block_mesh, circle_on_block, replaced, solved

YOUNG, POISSON = 2000.0, 0.3
# Two blocks between a plane below and one above: y, or z, from −1 to 1.
CASE = """\
name: between-planes
mesh: {recipe: blocks, size: 1.0}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
bodies:
  floor: {plane: {point: [0.3, -1], normal: [0, 2]}}
  die: {plane: {point: [3, 1], normal: [0, -1]}, reference: [3, 1], move: {y: -0.02}}
supports: [{group: symx, fix: [x]}]
contact:
  - {name: interface, slave: bottom_contact, master: top_contact}
  - {name: above, slave: press, master: die}
  - {name: below, slave: base, master: floor}
"""
STIFF = YOUNG / (1 - POISSON**2)


def case(*changes, text=CASE):
    return parse_case(replaced(text, *changes), Path("rigid.yaml"))


def in_space(text=CASE):
    return replaced(
        text,
        ("plane: strain\n", ""),
        ("[0.3, -1], normal: [0, 2]", "[0.3, 0, -1], normal: [0, 0, 2]"),
        ("[3, 1], normal: [0, -1]", "[3, 2, 1], normal: [0, 0, -1]"),
        ("reference: [3, 1], move: {y:", "reference: [3, 2, 1], move: {z:"),
        ("[{group: symx, fix: [x]}]", "[{group: symx, fix: [x]}, {group: symy, fix: [y]}]"),
    )


def around(text=CASE):
    return text.replace("plane: strain", "plane: axisymmetric")


@pytest.mark.parametrize("cells", [("QUAD8", "TRIA6"), ("QUAD9", "QUAD8")])
def test_a_free_die_under_force_and_moment_tilts_as_a_beam_bends(cells):
    """p = 20 + 10 x: u_y = −p (y + 1)/E', turned by −2 · 10/E', E' = E/(1 − ν²)."""
    force, moment = -25.0, 20 * 2.5 + 10 * (3 / 2 - 1 / 3)  # about x = 3: −∫ (x − 3) (−p) dx
    changes = (
        *((f"{side}}}", f"{side}, treatment: nodal}}") for side in ("_contact", "die", "floor")),
        ("move: {y: -0.02}", f"force: {{y: {force}, rz: {moment}}}"),
        (
            "{group: symx, fix: [x]}",
            f"{{at: [0, -1], fix: [x]}}, {{at: [0, 1], fix: {{x: {10 * 4 / 2 / STIFF}}}}}",
        ),
    )
    solution = simulate(case(*changes), block_mesh(*cells, (3, 2)))
    for zone in solution.zones:
        assert np.abs(zone.multiplier - 20 - 10 * zone.centre[:, 0]).max() < 1e-11 * 20
    x, y = solution.mesh.points.T
    exact = -(20 + 10 * x) * (y + 1) / STIFF
    elastic = (np.abs(y) <= 1) & (x <= 1) & (solution.fields.body < 2)
    assert np.abs(solution.displacement[:, 1] - exact)[elastic].max() < 1e-12
    die = next(body for body in solution.rigid if body.body == "die")
    assert die.rotation[2] == pytest.approx(-20 / STIFF, rel=1e-11)
    assert die.translation[1] == pytest.approx(-2 * 50 / STIFF, rel=1e-11)
    assert -die.force[1] == pytest.approx(force, rel=1e-12)
    assert -die.moment[2] == pytest.approx(moment, rel=1e-12)


def test_a_turn_about_another_point_is_the_same_motion():
    """A turn of 1e-3 about (3, 1) moves (0.5, 1) by −2.5e-3 along y."""
    mesh, at = block_mesh("QUAD4", "TRIA3"), "reference: [3, 1], move: {y: -0.02"
    one = simulate(case((at, f"{at}, rz: 0.001")), mesh)
    same = "reference: [0.5, 1], move: {y: -0.0225, rz: 0.001"
    other = simulate(case((at, same)), mesh)
    for a, b in zip(one.zones, other.zones, strict=True):
        assert np.abs(a.multiplier - b.multiplier).max() < 1e-12 * a.multiplier.max()
    first, second = (next(b for b in s.rigid if b.body == "die") for s in (one, other))
    assert first.force[1] == pytest.approx(second.force[1], rel=1e-12)
    arm = second.point[0] - first.point[0]
    assert second.moment[2] == pytest.approx(first.moment[2] - arm * first.force[1], rel=1e-11)
    held = next(r for r in one.reactions if r.group == "die")
    assert np.abs(held.force + first.force).max() < 1e-11 * first.force[1]


def test_a_die_in_space_bears_the_moments_of_its_force():
    """A force at (3, 2) on a die over the unit square, free to sink, fixed against rotation."""
    text = in_space().replace("move: {z: -0.02}", "move: {rx: 1.0e-4, rz: 0.1}, force: {z: -20}")
    solution = simulate(case(text=text), block_mesh("HEXA8", "TETRA4", (1, 2)))
    die = next(body for body in solution.rigid if body.body == "die")
    zone = next(zone for zone in solution.zones if zone.name == "above")
    force = zone.multiplier * zone.area
    x, y, _ = (zone.centre - die.point).T
    assert die.force == pytest.approx([0, 0, 20], abs=1e-12)
    # Constant pressures on triangles and quadrangles act at the centres of the faces.
    assert die.moment == pytest.approx([(y * force).sum(), -(x * force).sum(), 0], rel=1e-11)
    assert die.rotation == pytest.approx([1e-4, 0, 0.1], abs=1e-15)


def test_a_free_die_that_nothing_presses_is_refused():
    with pytest.raises(InputError, match="nothing keeps die from a free motion"):
        simulate(case(("move: {y: -0.02}", "force: {x: 0, y: -1}")), block_mesh("QUAD4", "QUAD4"))


def test_each_step_has_factors_of_its_own():
    changes = (
        ("move: {y: -0.02}", "move: {x: 1, y: -0.02}, name: press"),
        ("supports:", "steps: [{press: 0.5}, {press: 2}, {press: 0}]\nsupports:"),
    )
    solution = simulate(case(*changes), block_mesh("QUAD4", "QUAD4", (1, 1)))
    found = [step.rigid[0].force[1] for step in solution.steps]
    assert found == pytest.approx([0.5 * STIFF * 0.01, 2 * STIFF * 0.01, 0.0], abs=1e-12)
    assert solution.steps[1].rigid[0].translation == pytest.approx([2.0, -0.04])
    assert solution.quality.validity.slip < 0.1  # a plane is the same all over


def test_a_large_rotation_is_noticed():
    turned = case(("move: {y: -0.02}", "move: {y: 0.3, rz: 0.2}"))
    solution = simulate(turned, block_mesh("QUAD4", "QUAD4", (1, 1)))
    assert solution.quality.validity.rotation == pytest.approx(0.2)


RING = """\
name: shaft
mesh: {recipe: rings, radii: [1, 2, 3], bottom: {cells: QUAD9, divisions: [6, 6]}, top: {cells: QUAD9, divisions: [5, 6]}}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
bodies: {shaft: {sphere: {centre: [0, 0], radius: 1}}}
supports: [{group: symx, fix: [x]}, {group: farx, fix: [y]}]
contact:
  - {name: interface, slave: bottom_contact, master: top_contact}
  - {name: bore, slave: base, master: shaft, interference: 0.01}
"""  # noqa: E501


def test_a_shaft_with_oversize_opens_a_tube_as_lame_has_it():
    """u(a) = p a (1 + ν)/E ((1 − 2ν) a² + b²)/(b² − a²), plane strain, a = 1, b = 3."""
    found = case(text=RING)
    solution = simulate(found, generate(found.mesh.source, "test"))
    flexible = (1 + POISSON) / YOUNG * ((1 - 2 * POISSON) + 9) / (9 - 1)
    bore = next(zone for zone in solution.zones if zone.name == "bore")
    assert np.abs(bore.multiplier / (0.01 / flexible) - 1).max() < 1e-3
    (shaft,) = solution.rigid
    # A quarter of the circle: the force along each axis is p a, and has no moment about its centre.
    assert -shaft.force == pytest.approx([0.01 / flexible] * 2, rel=1e-3)
    assert abs(shaft.moment[2]) < 1e-12


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([("{y: -0.02}", "{z: 1}")], "bodies.die.move = 'z': allowed here: x, y, rz"),
        (
            [("plane: strain", "plane: axisymmetric"), ("{y: -0.02}", "{rz: 1}")],
            "bodies.die.move = 'rz': allowed here: y",
        ),
        (
            [("plane: {point: [3, 1], normal", "cylinder: {radius: 1, point: [3, 1], axis")],
            "bodies.die = 'cylinder': is 3D: a circle is a `sphere` here",
        ),
        ([("[3, 1], normal", "[3, 1, 0], normal")], "bodies.die.plane.point = [3.0, 1.0, 0.0]: mu"),
        ([("[3, 1], move", "[3, 1, 0], move")], "bodies.die.reference = [3.0, 1.0, 0.0]: must ha"),
        (
            [
                ("  die:", "  press:"),
                ("master: die", "master: press"),
                ("slave: press", "slave: top"),
            ],
            "bodies.press: the mesh has a group of this name; give the body another one",
        ),
        (
            [("group: symx, fix: [x]", "group: all, fix: [x]")],
            "supports[0].fix.x: 3 of its nodes belong to the rigid body die, which moves by `move`",
        ),
        (
            [("supports:", "reference: {kind: analytical, moment: {top: 1}}\nsupports:")],
            "reference.moment.top: is no rigid body; allowed: die, floor",
        ),
        (
            [("supports:", "reference: {kind: analytical, moment: {die: [0, 0, 1]}}\nsupports:")],
            "reference.moment.die = [0.0, 0.0, 1.0]: must be a number here",
        ),
        (
            [
                (
                    "die: {plane: {point: [3, 1], normal: [0, -1]}",
                    "die: {plane: {point: [3, 1], normal: [0, 1]}",
                )
            ],
            "along the normals of press; the normal of a rigid plane points out of the body",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_refused(changes, said):
    with pytest.raises(InputError) as refusal:
        simulate(case(*changes), block_mesh("QUAD4", "QUAD4", (1, 1)))
    assert said in str(refusal.value)


def test_a_vector_of_the_plane_is_refused_in_space():
    text = CASE.replace("plane: strain\n", "")
    with pytest.raises(InputError, match=r"bodies.floor.plane.point = .* must have 3 components"):
        simulate(parse_case(text, Path("case.yaml")), block_mesh("HEXA8", "HEXA8", (1, 1)))


def test_moments_are_about_the_reference_point():
    solution = simulate(case(), block_mesh("QUAD4", "QUAD4", (1, 1)))
    assert judge(solution, []).values.forces[-1].name == "floor, about its reference point"


def test_other_codes_are_given_no_such_bodies():
    with pytest.raises(UnsupportedError, match="floor is a rigid plane: not written for codes"):
        deck_of(case(), block_mesh("QUAD4", "QUAD4", (1, 1)))


def with_die(mesh, kind, hang=0.0):
    """A die without cells around a circle of curvature `hang` over the top, half of it turned."""
    dim, shape, n = mesh.points.shape[1], BY_NAME[kind], 3
    starts = np.stack(np.meshgrid(*[np.arange(n)] * (dim - 1)), axis=-1).reshape(-1, 1, 1, dim - 1)
    halves = [shape.nodes, 1 - shape.nodes] if shape.name.startswith("TRIA") else [shape.nodes]
    place = ((starts + np.stack(halves)) / (2 * n) * 3 - 0.25).reshape(-1, dim - 1).round(12)
    flat, faces = np.unique(place, axis=0, return_inverse=True)
    faces = faces.reshape(-1, shape.n_nodes)
    faces[::2] = faces[::2][:, list(shape.mirror)]
    height = 1 + hang * (flat**2).sum(axis=1) / 2
    cells = [(block.type, block.data) for block in mesh.cells]
    sets = {name: [*parts, np.empty(0, int)] for name, parts in mesh.cell_sets.items()}
    sets["die"] = [np.empty(0, int)] * len(cells) + [np.arange(len(faces))]
    cells.append((shape.meshio, faces + len(mesh.points)))
    return tidy(
        meshio.Mesh(np.vstack([mesh.points, np.c_[flat, height]]), cells, cell_sets=sets), ""
    )


@pytest.mark.parametrize(
    ("text", "cells", "die"),
    [
        (CASE, ("QUAD4", "TRIA3"), "SEG2"),
        (CASE, ("QUAD8", "TRIA6"), "SEG3"),
        (in_space(), ("HEXA8", "TETRA4"), "QUAD4"),
        (in_space(), ("TETRA4", "HEXA8"), "TRIA3"),
        (in_space(), ("HEXA8", "HEXA8"), "TRIA6"),
        (in_space(), ("HEXA8", "HEXA8"), "QUAD8"),
        (in_space(), ("HEXA8", "HEXA8"), "QUAD9"),
    ],
)
def test_a_surface_of_the_mesh_without_cells_is_a_rigid_body(text, cells, die):
    """The force acts at (3, 2), the pressure around (0.5, 0.5)."""
    text = re.sub(r"die: {plane: {[^}]*}", "die: {rigid: true", text)
    loads = ("force: {y: -20, rz: 50}", "force: {z: -20, rx: 30, ry: -50}")
    for axis, load in zip("yz", loads, strict=True):
        text = text.replace(f"move: {{{axis}: -0.02}}", load)
    solution = simulate(case(text=text), with_die(block_mesh(*cells, (2, 2)), die))
    for zone in solution.zones:
        assert np.abs(zone.multiplier / 20 - 1).max() < 1e-12
    body = next(body for body in solution.rigid if body.body == "die")
    assert body.force[-1] == pytest.approx(20, rel=1e-12)
    assert body.moment[[0, 1, 2]] == pytest.approx(
        [0, 0, -50] if len(body.force) == 2 else [-30, 50, 0], abs=1e-11
    )


def test_a_line_of_the_mesh_touches_as_the_curve_that_it_follows():
    """A parabola of 1/R = 0.02 as quadratic lines, whose nodes are on it, and without a mesh."""
    curve = CASE.replace("plane: {point: [3, 1], normal: [0, -1]}", "CURVE").replace(
        "0.02}", "0.01}"
    )
    line = curve.replace("CURVE", "rigid: true")
    given = curve.replace("CURVE", "parabola: {point: [0, 1], normal: [0, -1], radius: 50}")
    mesh = block_mesh("QUAD4", "QUAD4", (2, 4))
    meshed = simulate(case(text=line), with_die(mesh, "SEG3", 0.02))
    without = simulate(case(text=given), mesh)
    for a, b in zip(meshed.zones, without.zones, strict=True):
        assert (a.closed == b.closed).all()
        assert np.abs(a.multiplier - b.multiplier).max() < 1e-9 * b.multiplier.max()
    assert not without.zones[1].closed.all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("master: die", "master: bottom_contact"),
            "bodies.die = 'die': has no cells and is the m",
        ),
        (("slave: press, master: die", "slave: die, master: press"), "lies on the rigid body die"),
        (("die: {rigid: true", "floor2: {plane: {point: [0, 9], normal: [0, 1]}"), "bodies.floor2"),
    ],
    ids=["no-zone", "slave", "not-rigid"],
)
def test_refused_surfaces_of_the_mesh(change, said):
    text = re.sub(r"die: {plane: {[^}]*}", "die: {rigid: true", CASE)
    with pytest.raises(InputError) as refusal:
        simulate(case(change, text=text), with_die(block_mesh("QUAD4", "QUAD4", (1, 1)), "SEG2"))
    assert said in str(refusal.value)


@pytest.mark.parametrize("centre", np.linspace(18.0, 18.5, 11))
def test_dual_multipliers_where_a_face_sees_a_circle_from_one_point(centre):
    circle = f"{{centre: [{centre}, 14.8], radius: 5.0}}"
    text = circle_on_block([40, 4], circle, "treatment: nodal_dual")
    assert solved(text).zones[0].multiplier.max() > 0
