"""What `transform:` promises: exact moves, plane sides, the same mesh in another order."""

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.lac.cells.catalogue import cell_type
from solver.lac.cells.faces import vertex_jacobians
from solver.mesh import generate, transform
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from tests.scenes import POISSON, PRESSURE, YOUNG, changed_case

PLANE = {"bottom": {"cells": "QUAD8", "divisions": 4}, "top": {"cells": "TRIA6", "divisions": 3}}
SOLIDS = {
    "bottom": {"cells": "HEXA27", "divisions": 3}, "top": {"cells": "TETRA10", "divisions": 3},
}  # fmt: skip
MIXED = {
    "bottom": {"cells": "HEXA20", "divisions": 3}, "top": {"cells": "PYRA13", "contact": "TRIA6"},
}  # fmt: skip
MESHES = {
    name: generate({"recipe": "blocks", "size": 2.0} | spec, "case.yaml")
    for name, spec in (("plane", PLANE), ("solids", SOLIDS), ("mixed", MIXED))
}


def assert_right_side_out(mesh: meshio.Mesh) -> None:
    for block in mesh.cells:
        cell = cell_type(block.type)
        if cell.dim == mesh.points.shape[1]:
            assert (vertex_jacobians(mesh.points, block.data, cell) > 0).all()


def test_scale_stretch_translate_are_exact():
    mesh = MESHES["plane"]
    spec = {"scale": 0.5, "stretch": [1, 4], "translate": [3, -1]}
    moved = transform(mesh, spec, "case.yaml")
    np.testing.assert_array_equal(moved.points, mesh.points * 0.5 * [1, 4] + [3, -1])
    assert moved.cells is mesh.cells or moved.cells == mesh.cells
    assert moved.cell_sets == mesh.cell_sets


def test_steps_are_taken_in_the_order_in_which_they_stand():
    mesh = MESHES["plane"]
    first = transform(mesh, {"translate": [1, 0], "scale": 2}, "case.yaml")
    np.testing.assert_array_equal(first.points, (mesh.points + np.array([1, 0])) * 2)


def test_quarter_turns_are_exact():
    plane = transform(MESHES["plane"], {"rotate": 90}, "case.yaml")
    x, y = MESHES["plane"].points.T
    np.testing.assert_array_equal(plane.points, np.column_stack([-y, x]))
    solid = transform(MESHES["solids"], {"rotate": {"axis": [0, 0, 2], "angle": -90}}, "case.yaml")
    x, y, z = MESHES["solids"].points.T
    np.testing.assert_array_equal(solid.points, np.column_stack([y, -x, z]))


@given(angle=st.floats(-1000, 1000), axis=st.tuples(*[st.integers(-3, 3)] * 3))
def test_rotations_keep_lengths_and_their_axis(angle, axis):
    mesh = MESHES["solids"]
    if axis == (0, 0, 0):
        return
    turned = transform(mesh, {"rotate": {"axis": list(axis), "angle": angle}}, "case.yaml").points
    np.testing.assert_allclose(
        np.linalg.norm(turned, axis=1), np.linalg.norm(mesh.points, axis=1), rtol=1e-14, atol=1e-14
    )
    np.testing.assert_allclose(turned @ axis, mesh.points @ axis, atol=1e-13)


def test_a_turn_about_the_diagonal_permutes_the_axes():
    """A third of a turn about (1, 1, 1) takes x to y, y to z and z to x."""
    spec = {"rotate": {"axis": [1, 1, 1], "angle": 120}}
    turned = transform(MESHES["solids"], spec, "case.yaml").points
    np.testing.assert_allclose(turned, np.roll(MESHES["solids"].points, 1, axis=1), atol=1e-14)


@pytest.mark.parametrize("name", MESHES)
def test_perturb_keeps_plane_sides_and_the_shape_of_edges(name):
    mesh = MESHES[name]
    spec = {"perturb": {"amplitude": 0.2, "seed": 4}}
    moved = transform(mesh, spec, "case.yaml")
    step = moved.points - mesh.points
    for axis in range(mesh.points.shape[1]):
        heights = (0.0, 2.0) if axis < mesh.points.shape[1] - 1 else (-2.0, 0.0, 2.0)
        for height in heights:
            on_side = mesh.points[:, axis] == height
            assert on_side.any()
            assert (moved.points[on_side, axis] == height).all()
        assert (np.abs(step[:, axis]) > 0).any()
    assert_right_side_out(moved)
    for block in mesh.cells:
        cell = cell_type(block.type)
        for i, edge in enumerate(cell.edges):
            middle = step[block.data[:, list(edge)]].mean(axis=1)
            np.testing.assert_allclose(step[block.data[:, cell.n_vertices + i]], middle, atol=1e-15)


def test_perturb_moves_the_nodes_of_the_interface():
    """Else the faces there would stay the parallelograms that hide an inexact quadrature."""
    moved = transform(MESHES["mixed"], {"perturb": 0.2}, "case.yaml")
    ids = MESHES["mixed"].cell_sets["bottom_contact"]
    (nodes,) = (b.data[i] for b, i in zip(moved.cells, ids, strict=True) if len(i))
    corners = moved.points[nodes[:, :4]]
    skew = corners[:, 0] - corners[:, 1] + corners[:, 2] - corners[:, 3]
    assert (np.linalg.norm(skew, axis=1) > 0.01).all()


def test_perturb_on_a_turned_mesh_stays_in_the_turned_planes():
    spec = {"rotate": {"axis": [1, 2, 3], "angle": 33}, "perturb": 0.2}
    moved = transform(MESHES["mixed"], spec, "case.yaml")
    back = transform(moved, {"rotate": {"axis": [1, 2, 3], "angle": -33}}, "case.yaml").points
    straight = MESHES["mixed"].points
    on_interface = straight[:, 2] == 0
    np.testing.assert_allclose(back[on_interface, 2], 0, atol=1e-15)
    assert np.abs(back - straight).max() > 0.01


def test_perturb_is_the_same_for_a_seed_and_another_for_another():
    mesh = MESHES["plane"]
    moved = [
        transform(mesh, {"perturb": {"amplitude": 0.1, "seed": seed}}, "case.yaml").points
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(moved[0], moved[1])
    assert (moved[0] != moved[2]).any()


@pytest.mark.parametrize("name", MESHES)
def test_renumber_is_the_same_mesh_in_another_order(name):
    mesh = MESHES[name]
    mesh = meshio.Mesh(
        mesh.points, mesh.cells, cell_sets=mesh.cell_sets, point_sets={"few": np.array([0, 5, 7])}
    )
    other = transform(mesh, {"renumber": 3}, "case.yaml")
    assert (other.points != mesh.points).any()
    assert_right_side_out(other)

    def places(of: meshio.Mesh, group: str) -> set[tuple]:
        return {
            tuple(map(tuple, of.points[row]))
            for block, ids in zip(of.cells, of.cell_sets[group], strict=True)
            for row in block.data[ids]
        }

    for group in mesh.cell_sets:
        assert places(other, group) == places(mesh, group)
    few = {tuple(p) for p in mesh.points[mesh.point_sets["few"]]}
    assert {tuple(p) for p in other.points[other.point_sets["few"]]} == few


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ({"skale": 1}, "transform.skale = 1: unknown key; did you mean scale? (allowed: "),
        ({"translate": 3}, "transform.translate = 3: must be a list of two (plane) or three"),
        (
            {"translate": [1, 2, 3]},
            "transform.translate = [1.0, 2.0, 3.0]: must be a list of 2 numbers",
        ),
        ({"rotate": {"axis": [0, 0, 1], "angle": 3}}, "transform.rotate: must be a number in 2D"),
        ({"perturb": 5.0}, "transform.perturb.amplitude = 5.0: folds cells over: must be smaller"),
    ],
)
def test_refusals(spec, message):
    with pytest.raises(InputError) as caught:
        transform(MESHES["plane"], spec, "case.yaml")
    assert str(caught.value).startswith(f"case.yaml: {message}")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (30, "transform.rotate = 30.0: must be {axis: [x, y, z], angle: degrees}"),
        ({"axis": [0, 0, 0], "angle": 3}, "transform.rotate.axis = [0.0, 0.0, 0.0]: must not be"),
        ({"axis": [0, 0, 1]}, "transform.rotate.angle: this key is needed"),
    ],
)
def test_refused_rotations_in_3d(value, message):
    with pytest.raises(InputError) as caught:
        transform(MESHES["solids"], {"rotate": value}, "case.yaml")
    assert str(caught.value).startswith(f"case.yaml: {message}")


EVERYWHERE = {
    "scaled": {"scale": 1e-3},
    "perturbed": {"perturb": {"amplitude": 0.3, "seed": 2}},
    "renumbered": {"renumber": 5},
}
IN_PLANE = {
    "stretched": {"stretch": [3, 2]},
    "rotated": {"rotate": 23},
    "translated": {"translate": [-3, 5]},
    "all": {
        "perturb": 0.2, "scale": 2, "stretch": [1, 3], "rotate": 77, "translate": [3, 1],
        "renumber": 2,
    },
}  # fmt: skip
IN_SPACE = {
    "stretched": {"stretch": [3, 1, 2]},
    "rotated": {"rotate": {"axis": [1, -2, 3], "angle": 57}},
    "translated": {"translate": [-3, 5, 2]},
    "all": {
        "perturb": 0.2, "scale": 2, "stretch": [1, 2, 3],
        "rotate": {"axis": [0, 1, 1], "angle": 200}, "translate": [3, 1, 1], "renumber": 2,
    },
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "spec"),
    [("plane", spec) for spec in (EVERYWHERE | IN_PLANE).values()]
    + [(name, s) for name in ("solids", "mixed") for s in (EVERYWHERE | IN_SPACE).values()],
    ids=[f"plane-{key}" for key in EVERYWHERE | IN_PLANE]
    + [f"{name}-{key}" for name in ("solids", "mixed") for key in EVERYWHERE | IN_SPACE],
)
def test_the_patch_test_holds_after_it(name, spec):
    """Uniaxial pressure along the turned axis, symmetry planes lying any way."""
    mesh = MESHES[name]
    dim = mesh.points.shape[1]
    moved = transform(mesh, spec, "case.yaml")
    solution = simulate(changed_case(dim, normal=True), moved)

    turn = np.eye(dim)
    if "rotate" in spec:
        axes = meshio.Mesh(np.eye(dim), [("vertex", [[0]])])
        turn = transform(axes, {"rotate": spec["rotate"]}, "case.yaml").points.T
    up = turn[:, -1]
    stress = np.zeros((3, 3))
    stress[:dim, :dim] = -PRESSURE * np.outer(up, up)
    if dim == 2:
        stress[2, 2] = -POISSON * PRESSURE
    strain = ((1 + POISSON) * stress - POISSON * np.trace(stress) * np.eye(3)) / YOUNG
    # The corner in which base and symmetry planes meet does not move.
    corner = np.argmin(np.linalg.norm(mesh.points - [*[0] * (dim - 1), -2], axis=1))
    moves = {key: value for key, value in spec.items() if key != "renumber"}
    fixed = transform(mesh, moves, "case.yaml").points[corner]
    x = solution.mesh.points
    exact = (x - fixed) @ strain[:dim, :dim]

    components = stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert np.abs(solution.zones[0].multiplier / PRESSURE - 1).max() < 1e-12
    assert np.abs(solution.stress - components).max() < 1e-12 * PRESSURE
    assert np.abs(solution.displacement - exact).max() < 1e-12 * np.abs(exact).max()
    assert np.abs(solution.zones[0].coverage - 1).max() < 1e-12
    assert np.abs(solution.zones[0].gap).max() < 1e-14 * np.ptp(x, axis=0).max()


def test_shift_moves_one_body_alone():
    mesh = MESHES["plane"]
    moved = transform(mesh, {"shift": {"group": "top", "by": [0.25, 3]}}, "case.yaml")
    top = mesh.points[:, 1] > 0
    np.testing.assert_array_equal(moved.points[top], mesh.points[top] + [0.25, 3])
    base = mesh.points[:, 1] < 0
    np.testing.assert_array_equal(moved.points[base], mesh.points[base])


@pytest.mark.parametrize(("name", "angle"), [("plane", 5.0), ("solids", 5.0), ("solids", 1e-12)])
def test_turn_keeps_the_sides_and_turns_the_middle(name, angle):
    mesh = MESHES[name]
    moved = transform(mesh, {"turn": {"group": "bottom", "angle": angle}}, "case.yaml")
    step = moved.points - mesh.points
    assert (step[:, -1] == 0).all()
    assert (step[mesh.points[:, -1] > 0] == 0).all()
    lateral = mesh.points[:, :-1]
    assert (step[((lateral == 0) | (lateral == 2)).any(axis=1)] == 0).all()
    assert_right_side_out(moved)
    # Half of the block's edge 2 is the largest arm.
    assert 0 < np.linalg.norm(step, axis=1).max() <= np.radians(angle)
    if name == "solids":  # Vertices keep their distance from the axis.
        vertices = np.unique(
            np.concatenate([b.data[:, : cell_type(b.type).n_vertices].ravel() for b in mesh.cells])
        )
        arms = (np.linalg.norm(of.points[vertices, :2] - 1, axis=1) for of in (mesh, moved))
        np.testing.assert_allclose(*arms, rtol=1e-15, atol=1e-15)


def test_turn_is_refused_where_cells_fold():
    with pytest.raises(InputError, match=r"transform.turn.angle = 300.0: folds cells over"):
        transform(MESHES["solids"], {"turn": {"group": "top", "angle": 300}}, "case.yaml")


def test_pick_parts_a_surface_in_two():
    mesh = MESHES["plane"]
    pick = {"from": "bottom_contact", "low": [-1, -1], "high": [1, 1], "name": "left"}
    picked = transform(mesh, {"pick": [pick | {"rest": "right"}]}, "case.yaml")
    whole, left, right = (
        {
            tuple(c)
            for b, i in zip(picked.cells, picked.cell_sets[g], strict=True)
            for c in b.data[i]
        }
        for g in ("bottom_contact", "left", "right")
    )
    assert len(whole) == 4
    assert len(left) == len(right) == 2
    assert left | right == whole
    assert all(picked.points[list(nodes), 0].max() <= 1 for nodes in left)


def test_perturb_moves_one_group_where_one_is_named():
    mesh = MESHES["solids"]
    moved = transform(mesh, {"perturb": {"amplitude": 0.2, "seed": 1, "group": "top"}}, "case.yaml")
    changed = (moved.points != mesh.points).any(axis=1)
    assert changed.any()
    assert (mesh.points[changed, 2] >= 0).all()


@pytest.mark.parametrize("step", ["shift", "turn", "perturb", "pick"])
def test_a_group_that_is_not_there_is_refused(step):
    spec = {"group": "lid", "by": [0, 1], "angle": 1, "amplitude": 0.1}
    keys = {"shift": ("group", "by"), "turn": ("group", "angle"), "perturb": ("group", "amplitude")}
    picked = {"from": "lid", "low": [0, 0], "high": [1, 1], "name": "part"}
    given = picked if step == "pick" else {key: spec[key] for key in keys[step]}
    with pytest.raises(InputError, match=r"= 'lid': no such group; there are .*top_contact"):
        transform(MESHES["plane"], {step: given}, "case.yaml")
