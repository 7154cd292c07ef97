"""Geometry that makes no sense: named and refused, or handled; never a plausible wrong answer."""

import re

import meshio
import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.errors import SolveError
from solver.lac.facets import facets
from solver.mesh.tidy import tidy
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from tests.scenes import PRESSURE, block_mesh, changed_case, with_points


@pytest.fixture
def mesh():
    """Nine QUAD4 of the lower unit block, four of the upper one."""
    return block_mesh("QUAD4", "QUAD4")


def solved(mesh, *changes):
    """The patch test, its case text changed; the mesh as a file would give it."""
    return simulate(changed_case(2, *changes), tidy(mesh, "mesh"))


def rebuilt(mesh, points=None, quads=None, groups=None):
    """The mesh with some of its parts replaced."""
    first = mesh.cells[0].data if quads is None else quads
    rest = [(block.type, block.data) for block in mesh.cells[1:]]
    return meshio.Mesh(
        mesh.points if points is None else points,
        [("quad", first), *rest],
        cell_sets=mesh.cell_sets | (groups or {}),
    )


def joined(mesh, *names):
    """The cells of several groups as one."""
    parts = zip(*(mesh.cell_sets[name] for name in names), strict=True)
    return [np.concatenate(part).astype(int) for part in parts]


def nodes_of(mesh, body):
    return np.unique(mesh.cells[0].data[mesh.cell_sets[body][0]])


def folded(mesh):
    quads = mesh.cells[0].data.copy()
    quads[4] = quads[4][[0, 2, 1, 3]]
    return rebuilt(mesh, quads=quads), []


def flat(mesh):
    points, quad = mesh.points.copy(), mesh.cells[0].data[4]
    points[quad[2]] = points[quad[1]]
    return rebuilt(mesh, points), []


def slit(mesh):
    """One node inside the lower block made two: its cells above and below come apart there."""
    quads = mesh.cells[0].data.copy()
    count = np.bincount(quads[mesh.cell_sets["bottom"][0]].ravel())
    node = int(np.flatnonzero(count == 4)[0])
    for cell in np.flatnonzero((quads == node).any(axis=1))[:2]:
        quads[cell][quads[cell] == node] = len(mesh.points)
    return rebuilt(mesh, np.vstack([mesh.points, mesh.points[node]]), quads), []


def slave_on_both_bodies(mesh):
    return rebuilt(mesh, groups={"bottom_contact": joined(mesh, "bottom_contact", "press")}), []


def master_on_both_bodies(mesh):
    return rebuilt(mesh, groups={"top_contact": joined(mesh, "top_contact", "base")}), []


def facing_away(mesh):
    points = mesh.points.copy()
    points[nodes_of(mesh, "top"), 1] += 0.05
    return with_points(mesh, points), [("master: top_contact", "master: press")]


def deep_overlap(mesh):
    points = mesh.points.copy()
    points[nodes_of(mesh, "top"), 1] -= 0.4
    return with_points(mesh, points), []


def support_on_the_slave(mesh):
    return mesh, [("loads:", "  - {group: bottom_contact, fix: [y]}\nloads:")]


def shared_slave_faces(mesh):
    second = "contact:\n  - {name: two, slave: bottom_contact, master: press}\n"
    return mesh, [("contact:\n", second)]


def a_part_apart(mesh):
    n = len(mesh.points)
    square = np.array([(5, 5), (6, 5), (6, 6), (5, 6)], dtype=float)
    quads = np.vstack([mesh.cells[0].data, n + np.arange(4)])
    return rebuilt(mesh, np.vstack([mesh.points, square]), quads), []


def nothing_holds(mesh):
    return mesh, [("  - {group: base, fix: [y]}\n", "")]


def glued(mesh):
    """Blocks that share the nodes of the interface, and so are one body."""
    same = block_mesh("QUAD4", "QUAD4", (2, 2))
    apart = np.linalg.norm(same.points[:, None] - same.points[None], axis=2)
    first = (apart < 1e-9).argmax(axis=1)
    cells = [(block.type, first[block.data]) for block in same.cells]
    return meshio.Mesh(same.points, cells, cell_sets=same.cell_sets), []


def cell_upon_cell(mesh):
    n, quad = len(mesh.points), mesh.cells[0].data[0]
    quads = np.vstack([mesh.cells[0].data, [quad[0], quad[1], n, n + 1]])
    return rebuilt(mesh, np.vstack([mesh.points, mesh.points[quad[2:]]]), quads), []


def a_thousandth(mesh):
    """The upper unit block in metres, the lower one in millimetres."""
    points, top = mesh.points.copy(), nodes_of(mesh, "top")
    middle = points[top].min(axis=0)
    points[top] = middle + 1e-3 * (points[top] - middle)
    return rebuilt(mesh, points), []


REFUSED = [
    (a_thousandth, "covers at most 3.0e-03 of a slave face of bottom_contact: do both bodies"),
    (folded, "mesh: QUAD4 5: flat or folded: the Jacobian must not vanish or change its sign"),
    (flat, "flat or folded"),
    (
        slit,
        "mesh: 1 pairs of nodes of bottom are at one place and not on a contact surface (the first",
    ),
    (slave_on_both_bodies, "contact[0].slave = 'bottom_contact': has faces on several bodies (bot"),
    (master_on_both_bodies, "contact[0].master = 'top_contact': has faces on several bodies (bot"),
    (facing_away, "contact[0].master = 'press': does not lie over bottom_contact anywhere along"),
    (deep_overlap, "contact[0].slave = 'bottom_contact': the surfaces overlap by 0.4 at multiplie"),
    (support_on_the_slave, "supports: 3 macro-elements of zone interface (the first, number 0, at"),
    (shared_slave_faces, "contact[1].slave = 'bottom_contact': 3 of its faces are slave faces of"),
    (a_part_apart, "supports: nothing keeps body 3 from a free motion (move along x), even with"),
    (nothing_holds, "supports: nothing keeps bottom from a free motion (move along y), even with"),
    (
        glued,
        (
            "contact[0].master = 'top_contact': 2 of its faces are slave faces too; a slave "
            "cannot be its own master: bodies in contact share no nodes"
        ),
    ),
    (cell_upon_cell, "of its faces have a cell on both sides (the first near ("),
]


@pytest.mark.parametrize(("change", "message"), REFUSED, ids=[c.__name__ for c, _ in REFUSED])
def test_refused_by_name(change, message, mesh):
    changed, changes = change(mesh)
    with pytest.raises(InputError, match=re.escape(message)) as refusal:
        solved(changed, *changes)
    assert "\n" not in str(refusal.value)


def test_faces_of_no_size():
    """As beside a node so far away that coordinates do not tell the others apart."""
    with pytest.raises(SolveError, match=r"^1 SEG2 faces have no size left in the precision of"):
        facets(np.zeros((2, 2)), BY_NAME["SEG2"], np.array([[0, 1]]), np.arange(1))


def mirrored(mesh):
    quads = mesh.cells[0].data.copy()
    quads[::2] = quads[::2][:, ::-1]
    return rebuilt(mesh, quads=quads)


def cell_told_twice(mesh):
    return rebuilt(mesh, quads=np.vstack([mesh.cells[0].data, mesh.cells[0].data[:3]]))


def nodes_of_no_cell(mesh):
    return rebuilt(mesh, np.vstack([mesh.points, [[9.0, 9.0]]]))


def slight_overlap(mesh):
    points = mesh.points.copy()
    points[nodes_of(mesh, "top"), 1] -= 0.05
    return with_points(mesh, points)


@pytest.mark.parametrize("change", [mirrored, cell_told_twice, nodes_of_no_cell, slight_overlap])
def test_handled(change, mesh):
    zone = solved(change(mesh)).zones[0]
    np.testing.assert_allclose(zone.multiplier, PRESSURE, rtol=1e-10)
    np.testing.assert_allclose(zone.gap, 0, atol=1e-12)


def test_a_support_on_the_master_surface_takes_the_load(mesh):
    """The upper block hangs on it, so that nothing reaches the interface; and the plan says so."""
    held = [("loads:", "  - {group: top_contact, fix: [y]}\nloads:")]
    zone = solved(mesh, *held).zones[0]
    np.testing.assert_allclose(zone.multiplier, 0, atol=1e-9 * PRESSURE)


def test_two_slave_bodies_may_share_a_master_that_is_neither(mesh):
    """A group on several bodies is all right where its partner is on another one."""
    left, right = ([0.0, 0.4], [0.6, 1.0])
    points, quads, lines = [], [], []
    for (low, high), (bottom, top) in (((0, 1), (0, 1)), (left, (-1, 0)), (right, (-1, 0))):
        n = len(points)
        points += [(low, bottom), (high, bottom), (high, top), (low, top)]
        quads.append(range(n, n + 4))
        lines += [(n, n + 1), (n + 2, n + 3)]
    groups = {
        "master": [0], "press": [1], "base": [2, 4], "slave": [3, 5],
    }  # fmt: skip
    mesh = meshio.Mesh(
        np.array(points, dtype=float),
        [("quad", np.array([list(q) for q in quads])), ("line", np.array(lines))],
        cell_sets={name: [np.empty(0, dtype=int), np.array(i)] for name, i in groups.items()},
    )
    changes = [
        ("slave: bottom_contact, master: top_contact", "slave: slave, master: master"),
        ("{group: base, fix: [y]}\n  - {group: symx, fix: [x]}",
         "{group: base, fix: [x, y]}\n  - {group: press, fix: [x]}"),
    ]  # fmt: skip
    solution = solved(mesh, *changes)
    np.testing.assert_allclose(
        solution.zones[0].multiplier @ solution.zones[0].area, PRESSURE, rtol=1e-9
    )
