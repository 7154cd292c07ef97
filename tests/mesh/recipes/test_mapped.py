"""The recipes of bent blocks: groups, nodes on the true curves, areas and volumes."""

import re
from copy import deepcopy
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from solver.lac.cells.catalogue import cell_type
from solver.lac.cells.faces import area_vectors
from solver.lac.cells.shape import face_rule, shape_functions
from solver.mechanics.fem.block import volume_rule
from solver.mesh import generate
from solver.mesh.size import of_mesh
from solver.mesh.transforms import nodes_of
from solver.system.errors import InputError

PLANE = ["TRIA3", "TRIA6", "QUAD4", "QUAD8", "QUAD9"]
SOLID = ["TETRA4", "TETRA10", "HEXA8", "HEXA20", "HEXA27"]
GROUPS = ["base", "bottom", "bottom_contact", "farx", "press", "symx", "top", "top_contact"]
SIZES = {"bottom_size": [5, 4], "top_size": [8, 2]}


def made(recipe, bottom, top, n=(4, 3), **keys):
    dim = cell_type(bottom).dim
    sections = {
        "bottom": {"cells": bottom, "divisions": [n[0]] * dim},
        "top": {"cells": top, "divisions": [n[1]] * dim},
    }
    return generate({"recipe": recipe} | sections | keys, "case.yaml")


def members(mesh, group):
    for block, ids in zip(mesh.cells, mesh.cell_sets[group], strict=True):
        if len(ids):
            yield cell_type(block.type), block.data[ids]


def nodes(mesh, group):
    return mesh.points[np.unique(np.concatenate([n.ravel() for _, n in members(mesh, group)]))]


def volume(mesh, group):
    """By quadrature."""
    total = 0.0
    for kind, cells in members(mesh, group):
        reference, weights = volume_rule(kind.name)
        slopes = shape_functions(kind.name).gradients(reference)
        jacobian = np.einsum("cad,qat->cqdt", mesh.points[cells], slopes)
        total += (np.linalg.det(jacobian) @ weights).sum()
    return total


def area(mesh, group):
    """By quadrature."""
    total = 0.0
    for kind, faces in members(mesh, group):
        reference, weights = face_rule(kind.name)
        slopes = shape_functions(kind.name).gradients(reference)
        vectors = area_vectors(mesh.points, faces, slopes)
        total += (np.linalg.norm(vectors, axis=2) @ weights).sum()
    return total


def radius(points):
    return np.linalg.norm(points, axis=1)


@pytest.mark.parametrize("cells", PLANE + SOLID)
@pytest.mark.parametrize(
    ("recipe", "keys"),
    [
        ("wavy", {"shape": "arc", "height": 0.1}),
        ("parabola", {"height": 0.05}),
        ("hertz", {"radius": 50, "size": 20, "core": 1, "share": 0.5}),
        ("rings", {"radii": [20, 30, 40]}),
        ("shells", {"radii": [20, 30, 40]}),
    ],
)
def test_groups_and_determinism(recipe, keys, cells):
    dim = cell_type(cells).dim
    if {"rings": 2, "shells": 3}.get(recipe, dim) != dim:
        with pytest.raises(InputError, match="must be a cell type of"):
            made(recipe, cells, cells, **keys)
        return
    mesh, again = (made(recipe, cells, cells, **keys) for _ in range(2))
    assert sorted(mesh.cell_sets) == sorted(GROUPS + ["fary", "symy"] * (dim == 3))
    assert mesh.points.tobytes() == again.points.tobytes()
    for one, other in zip(mesh.cells, again.cells, strict=True):
        assert np.array_equal(one.data, other.data)
    assert {kind.name for kind, _ in members(mesh, "bottom")} == {cells}


@pytest.mark.parametrize("cells", PLANE)
def test_ring_nodes_lie_on_their_circles(cells):
    mesh = made("rings", cells, cells, radii=[20, 30, 40])
    for group, r in (("base", 20), ("bottom_contact", 30), ("top_contact", 30), ("press", 40)):
        np.testing.assert_allclose(radius(nodes(mesh, group)), r, rtol=1e-14)
    assert (nodes(mesh, "symx")[:, 0] == 0).all()
    assert (nodes(mesh, "farx")[:, 1] == 0).all()


@pytest.mark.parametrize("cells", SOLID)
def test_shell_nodes_lie_on_their_spheres_and_planes(cells):
    mesh = made("shells", cells, cells, radii=[20, 30, 40])
    for group, r in (("base", 20), ("bottom_contact", 30), ("top_contact", 30), ("press", 40)):
        np.testing.assert_allclose(radius(nodes(mesh, group)), r, rtol=1e-14)
    for group, axis in (("symx", 0), ("symy", 1)):
        assert (nodes(mesh, group)[:, axis] == 0).all()
    for group, axis in (("farx", 0), ("fary", 1)):
        place = nodes(mesh, group)
        np.testing.assert_allclose(place[:, axis], place[:, 2], rtol=1e-14)


# A chord of angle h misses h²/12 of its arc's length and h²/6 of its sector's area; a parabola
# through the arc misses terms of order h⁴.
@pytest.mark.parametrize(
    ("cells", "order"), [("TRIA3", 2), ("QUAD4", 2), ("TRIA6", 4), ("QUAD8", 4)]
)
def test_areas_of_rings_converge_with_the_order_of_the_geometry(cells, order):
    exact = {"bottom": np.pi / 4 * 500, "top": np.pi / 4 * 700, "top_contact": np.pi / 2 * 30}
    for group, value in exact.items():
        measure = volume if group in ("bottom", "top") else area
        meshes = [made("rings", cells, cells, radii=[20, 30, 40], refine=k) for k in (1, 2, 4)]
        missed = [abs(measure(mesh, group) / value - 1) for mesh in meshes]
        assert all(np.log2(a / b) > order - 0.2 for a, b in pairwise(missed))


@pytest.mark.parametrize(("cells", "order"), [("HEXA8", 2), ("TETRA4", 1.5), ("HEXA27", 4)])
def test_volume_of_shells_converges_with_the_order_of_the_geometry(cells, order):
    # A sixth of the sphere's quarter of the upper side: one of 24 like sectors.
    exact = 4 / 3 * np.pi * (30**3 - 20**3) / 24
    meshes = [made("shells", cells, cells, radii=[20, 30, 40], refine=k) for k in (1, 2)]
    missed = [abs(volume(mesh, "bottom") / exact - 1) for mesh in meshes]
    assert np.log2(missed[0] / missed[1]) > order - 0.2


@pytest.mark.parametrize("cells", ["QUAD9", "TETRA10"])
def test_parabola_holds_the_gap(cells):
    mesh = made("parabola", cells, cells, height=0.05)
    die, block = nodes(mesh, "bottom_contact"), nodes(mesh, "top_contact")
    sag = ((die[:, :-1] - 0.5) ** 2).sum(axis=1)
    np.testing.assert_allclose(die[:, -1], -0.05 * sag, atol=1e-15)
    assert (block[:, -1] == 0).all()
    assert volume(mesh, "top") == pytest.approx(1, abs=1e-13)


@pytest.mark.parametrize("cells", ["QUAD8", "TRIA3", "HEXA20"])
def test_hertz_is_a_parabola_over_a_plane_with_an_even_core(cells):
    mesh = made("hertz", cells, "QUAD4" if cell_type(cells).dim == 2 else "HEXA8",
                n=(10, 10), radius=50, size=20, core=1, share=0.4)  # fmt: skip
    flat, curved = nodes(mesh, "bottom_contact"), nodes(mesh, "top_contact")
    assert (flat[:, -1] == 0).all()
    rise = (curved[:, :-1] ** 2).sum(axis=1) / 100
    np.testing.assert_allclose(curved[:, -1], rise, atol=1e-13)
    x = np.unique(np.round(curved[:, 0], 9))
    np.testing.assert_allclose(x[:5], [0, 0.25, 0.5, 0.75, 1], atol=1e-9)
    steps = np.diff(x)
    assert (np.diff(steps[4:]) > 0).all()
    assert x[-1] == pytest.approx(20, rel=1e-12)
    assert np.abs(mesh.points[:, -1]).max() == pytest.approx(20, rel=1e-12)


@pytest.mark.parametrize("shape", ["tilt", "kink", "arc", "wave", "twist"])
@pytest.mark.parametrize("cells", ["QUAD8", "HEXA27"])
def test_wavy_interfaces_have_plane_sides(shape, cells):
    mesh = made("wavy", cells, cells, shape=shape, height=0.1)
    for group, axis, height in (("base", -1, -1), ("press", -1, 1), ("symx", 0, 0), ("farx", 0, 1)):
        assert (nodes(mesh, group)[:, axis] == height).all()
    assert volume(mesh, "bottom") + volume(mesh, "top") == pytest.approx(2, abs=2e-3)


@pytest.mark.parametrize("cells", ["QUAD8", "TRIA3"])
def test_punch_has_two_sizes_a_gap_and_a_split_top(cells):
    mesh = made("punch", cells, cells, n=(5, 4), loaded=0.25, gap=0.5, **SIZES)
    assert volume(mesh, "bottom") == pytest.approx(20, rel=1e-13)
    assert volume(mesh, "top") == pytest.approx(16, rel=1e-13)
    assert (nodes(mesh, "bottom_contact")[:, 1] == 0).all()
    assert (nodes(mesh, "top_contact")[:, 1] == 0.5).all()
    assert (area(mesh, "press_left"), area(mesh, "press_right")) == pytest.approx((2, 6), rel=1e-13)
    assert area(mesh, "press") == pytest.approx(8, rel=1e-13)


def test_punch_in_space_overlaps():
    mesh = made("punch", "HEXA8", "TETRA4", gap=-0.5, bottom_size=[5, 3, 4], top_size=2)
    assert volume(mesh, "top") == pytest.approx(8, rel=1e-13)
    assert (nodes(mesh, "top_contact")[:, 2] == -0.5).all()
    assert "press_right" not in mesh.cell_sets
    assert area(mesh, "press_left") == pytest.approx(4, rel=1e-13)


@pytest.mark.parametrize(
    ("recipe", "keys", "message"),
    [
        ("rings", {"radii": [20, 40, 30]}, "mesh.radii = .*: must increase"),
        ("rings", {}, "mesh.radii: this key is needed"),
        ("shells", {"radii": [2, 3, 4]}, "mesh.bottom.cells = 'QUAD4': must be a cell type of 3D"),
        ("wavy", {"shape": "dent", "height": 0.1}, "mesh.shape = 'dent': must be tilt"),
        ("wavy", {"shape": "arc", "height": 0.5}, "mesh.height = 0.5: must be a number between"),
        ("hertz", {"radius": 50, "size": 20, "core": 10, "share": 0.5}, "mesh.share = 0.5: must"),
        ("hertz", {"radius": 9, "size": 20, "core": 1, "share": 0.5}, "mesh.size = 20: must"),
        ("punch", SIZES | {"loaded": 0.3}, "mesh.loaded = 0.3: must be a share at which"),
        ("punch", SIZES | {"loaded": 1.2}, "mesh.loaded = 1.2: must"),
        ("punch", SIZES | {"laoded": 0.3}, "mesh.laoded = 0.3: unknown key; did you mean loaded"),
        ("punch", {"bottom_size": [1, 2, 3], "top_size": 1}, "mesh.bottom_size"),
    ],
)
def test_what_is_refused(recipe, keys, message):
    with pytest.raises(InputError, match=message):
        made(recipe, "QUAD4", "QUAD4", **keys)


# Bodies of bricks: nodes counted by hand, and what is refused.


SEAT = {
    "recipe": "bricks",
    "bricks": [
        {"name": "seat", "low": [-1, -1], "high": [0, 0]},
        {"name": "seat", "low": [0, -1], "high": [2, 0]},
        {"name": "seat", "low": [-1, 0], "high": [0, 1]},
        {"name": "block", "low": [0, 0], "high": [2, 1]},
    ],
}
for each, divisions in zip(SEAT["bricks"], ([2, 2], [4, 2], [2, 2], [3, 3]), strict=True):
    each["block"] = {"cells": "QUAD4", "divisions": divisions}


@pytest.mark.parametrize("refine", [1, 2])
def test_bricks_of_one_body_share_nodes(refine):
    """9 + 15 + 9 nodes of the seat, 3 and 3 on two sides in common, the corner once among them."""
    mesh = generate(SEAT | {"refine": refine}, "case.yaml")
    n = refine
    wanted = (2 * n + 1) * (6 * n + 1) + (2 * n + 1) * 2 * n
    assert nodes_of(mesh, "seat").sum() == wanted
    assert nodes_of(mesh, "block").sum() == (3 * n + 1) ** 2
    assert len(mesh.points) == wanted + (3 * n + 1) ** 2
    assert len(np.unique(mesh.points[nodes_of(mesh, "seat")], axis=0)) == wanted
    assert sorted(mesh.cell_sets) == ["block", "seat"]
    assert of_mesh(SEAT, Path()).points == 9 + 15 + 9 + 16


def changed(*keys_and_value):
    *keys, value = keys_and_value
    spec = deepcopy(SEAT)
    place = spec["bricks"]
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    return spec


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            changed(1, "block", "divisions", [4, 3]),
            "mesh.bricks[1]: has other nodes than bricks[0]",
        ),
        (changed(1, "low", [0]), "mesh.bricks[1].low = [0]: must be a list of 2 numbers for QUAD4"),
        (changed(0, "high", [-2, 0]), "mesh.bricks[0].high = [-2, 0]: must be greater than low"),
        (SEAT | {"bricks": []}, "mesh.bricks = []: must be a list of blocks"),
        (
            changed(
                3,
                {
                    "name": "block",
                    "low": [0, 0, 0],
                    "high": [1, 1, 1],
                    "block": {"cells": "HEXA8", "divisions": 1},
                },
            ),
            "mesh.bricks = ",
        ),
    ],
)
def test_refusals(spec, message):
    with pytest.raises(InputError, match=re.escape(message)):
        generate(spec, "case.yaml")
