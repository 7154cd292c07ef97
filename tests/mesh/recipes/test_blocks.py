"""The recipe `blocks` and the case files of ssnp170 that use it."""

from collections import Counter
from pathlib import Path

import meshio
import numpy as np
import pytest
import yaml

from solver.lac.cells.catalogue import BY_NAME, CellType, cell_type
from solver.lac.cells.faces import vertex_jacobians
from solver.mesh import generate, write_mesh
from solver.system.errors import InputError
from tests.mesh.curved import KINDS

CASES = sorted(Path("cases/ssnp170").glob("[a-z]*.yaml"))
CASES = [path for path in CASES if path.stem != "family"]
# Cells of the bottom block, cells of the top block, faces of both on the interface, as in the
# description of the reference problem; of Z's bottom block it tells about 816 cells.
REFERENCE = {
    "a": (289, 230, 17, 10), "b": (230, 263, 10, 13), "c": (144, 100, 12, 10),
    "d": (100, 144, 10, 12), "e": (260, 230, 16, 10), "f": (80, 100, 4, 10),
    "g": (80, 100, 4, 10), "h": (80, 100, 4, 10), "i": (80, 100, 4, 10), "j": (144, 100, 12, 10),
    "k": (475, 425, 78, 54), "l": (475, 425, 78, 54), "m": (343, 125, 49, 25),
    "n": (343, 125, 49, 25), "o": (343, 125, 49, 25), "p": (409, 391, 54, 54),
    "q": (343, 1374, 49, 80), "r": (343, 411, 49, 56), "s": (409, 512, 54, 64),
    "t": (409, 512, 54, 64), "u": (409, 512, 54, 64), "v": (409, 512, 54, 64),
    "w": (343, 216, 49, 36), "x": (343, 216, 49, 36), "y": (343, 216, 49, 36),
    "z1": (816, 2, 72, 2), "z2": (816, 2, 72, 1), "z3": (816, 2, 72, 2), "z4": (816, 2, 72, 1),
    "z5": (816, 5, 72, 4), "z6": (816, 5, 72, 1), "z7": (816, 5, 72, 4), "z8": (816, 5, 72, 1),
}  # fmt: skip


def recipe(bottom: dict, top: dict, size: object = 2.0) -> dict:
    return {"recipe": "blocks", "size": size, "bottom": bottom, "top": top}


def block(name: str, n: int = 2, contact: str = "TRIA") -> dict:
    cell = BY_NAME[name]
    if name.startswith(("PENTA", "PYRA")):
        kinds = {face.type for face in cell.faces}
        return {"cells": name, "contact": next(k for k in kinds if k.startswith(contact))}
    return {"cells": name, "divisions": [n] * cell.dim}


def members(mesh: meshio.Mesh, group: str) -> list[np.ndarray]:
    """Nodes (n, n_nodes) of the members of a group, by block."""
    return [b.data[i] for b, i in zip(mesh.cells, mesh.cell_sets[group], strict=True) if len(i)]


def measure(points: np.ndarray, nodes: np.ndarray, name: str) -> float:
    """Area or volume of straight cells, from cones over their faces (the divergence theorem)."""
    cell = BY_NAME[name]
    corners = points[nodes[:, : cell.n_vertices]]
    if cell.dim == 2:
        x, y = corners[..., 0], corners[..., 1]
        return float((x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)).sum() / 2)
    total = 0.0
    for face in cell.faces:
        rim = corners[:, [i for i in face.nodes if i < cell.n_vertices]]
        middle = rim.mean(axis=1)
        for i in range(rim.shape[1]):
            triple = np.cross(rim[:, i - 1], rim[:, i])
            total += np.einsum("ni,ni->", middle, triple) / 6
    return float(total)


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_counts_of_the_reference(path):
    case = yaml.safe_load(path.read_text(encoding="utf-8"))
    mesh = generate(case["mesh"], str(path))
    counts = [
        sum(map(len, members(mesh, group)))
        for group in ("bottom", "top", "bottom_contact", "top_contact")
    ]
    expected = REFERENCE[path.stem]
    told = case["counts"]
    assert expected == (
        *(told[name]["cells"] for name in ("bottom", "top")),
        *(told[name]["faces"] for name in ("bottom", "top")),
    )
    assert counts[2:] == list(expected[2:])
    for name, count, reference in zip(("bottom", "top"), counts, expected, strict=False):
        if case["mesh"][name]["cells"].startswith(("TRIA", "TETRA")):
            # Another release of the mesher may count a little differently.
            assert count == pytest.approx(reference, rel=0.05)
        else:
            assert count == reference


def test_every_case_is_there():
    assert {path.stem for path in CASES} == set(REFERENCE)


@pytest.mark.parametrize("contact", ["TRIA", "QUAD"])
@pytest.mark.parametrize("name", KINDS)
def test_sides_and_volumes(name, contact):
    """Both blocks of each type: groups on their planes, sizes, shapes, nothing shared."""
    cell = BY_NAME[name]
    size = np.array([2.0, 3.0, 5.0])[: cell.dim]
    for low, high in ((name, "TETRA4"), ("TETRA4", name)) if cell.dim == 3 else ((name, "QUAD9"),):
        spec = recipe(block(low, contact=contact), block(high, contact=contact), size.tolist())
        mesh = generate(spec, "case.yaml")
        assert mesh.points.shape[1] == cell.dim
        up = cell.dim - 1
        planes = {
            "bottom_contact": (up, 0.0), "top_contact": (up, 0.0), "symx": (0, 0.0),
            "farx": (0, size[0]),
            "base": (up, -size[-1]), "press": (up, size[-1]),
        }  # fmt: skip
        if cell.dim == 3:
            planes |= {"symy": (1, 0.0), "fary": (1, size[1])}
        assert set(mesh.cell_sets) == {"bottom", "top", *planes}
        for group, (axis, value) in planes.items():
            for nodes in members(mesh, group):
                assert (mesh.points[nodes][..., axis] == value).all(), group
        owned = {}
        for group in ("bottom", "top"):
            total = 0.0
            for b, ids in zip(mesh.cells, mesh.cell_sets[group], strict=True):
                kind = cell_type(b.type)
                if len(ids):
                    total += measure(mesh.points, b.data[ids], kind.name)
                    assert (vertex_jacobians(mesh.points, b.data[ids], kind) > 0).all()
            assert total == pytest.approx(size.prod(), rel=1e-13)
            owned[group] = {int(i) for nodes in members(mesh, group) for i in nodes.ravel()}
        assert not owned["bottom"] & owned["top"]
        assert owned["bottom"] | owned["top"] == set(range(len(mesh.points)))


def middles(cell: CellType, vertices: np.ndarray) -> np.ndarray:
    """Where the nodes after the vertices belong: the middles of edges, faces and cell."""
    parts = [list(edge) for edge in cell.edges]
    if cell.name == "HEXA27":
        parts += [list(face.nodes[:4]) for face in cell.faces]
    if cell.name in ("QUAD9", "HEXA27"):
        parts.append(list(range(cell.n_vertices)))
    return np.array([vertices[part].mean(axis=0) for part in parts])


@pytest.mark.parametrize("name", [n for n in KINDS if BY_NAME[n].order == 2])
def test_mid_nodes_lie_in_the_middle(name):
    other = "TETRA4" if BY_NAME[name].dim == 3 else "TRIA3"
    mesh = generate(recipe(block(other), block(name)), "case.yaml")
    cell = BY_NAME[name]
    for nodes in mesh.get_cells_type(cell.meshio):
        points = mesh.points[nodes]
        expected = middles(cell, points[: cell.n_vertices])
        np.testing.assert_allclose(points[cell.n_vertices :], expected, atol=1e-14)


def test_regular_blocks_are_lattices():
    mesh = generate(recipe(block("QUAD8", 7), block("QUAD4", 3), 1.0), "case.yaml")
    lower = mesh.points[mesh.points[:, 1] < 0] * 14
    np.testing.assert_allclose(lower, lower.round(), atol=1e-13)
    upper = mesh.points[mesh.points[:, 1] > 0] * 3
    np.testing.assert_allclose(upper, upper.round(), atol=1e-13)


@pytest.mark.parametrize("cells", ["TRIA3", "TETRA10"])
def test_edges_of_unstructured_blocks_are_divided_evenly(cells):
    dim = BY_NAME[cells].dim
    unstructured = {"cells": cells, "divisions": [5] * dim, "far": 3, "inner": 0.5}
    mesh = generate(recipe(unstructured, block("QUAD4" if dim == 2 else "HEXA8")), "case.yaml")
    corners = np.unique(np.concatenate([n[:, :dim] for n in members(mesh, "bottom_contact")]))
    x = mesh.points[corners]
    edge = x[(x[:, 1:] == 0).all(axis=1), 0]
    assert sorted(edge.tolist()) == [2 * k / 5 for k in range(6)]


def test_large_blocks_of_tetrahedra_are_filled_by_hxt(monkeypatch):
    """Another mesh with the same surface, the same again; the volume is filled."""
    spec = recipe(block("TETRA4", 6), block("HEXA8"))
    usual = generate(spec, "case.yaml")
    monkeypatch.setattr("solver.mesh.size._HXT_FROM", 6**3)
    first, second = generate(spec, "case.yaml"), generate(spec, "case.yaml")
    np.testing.assert_array_equal(first.points, second.points)
    (cells,), (others,), (again,) = (members(m, "bottom") for m in (first, usual, second))
    np.testing.assert_array_equal(cells, again)
    assert cells.shape != others.shape
    assert measure(first.points, cells, "TETRA4") == pytest.approx(8, rel=1e-13)
    assert (vertex_jacobians(first.points, cells, BY_NAME["TETRA4"]) > 0).all()
    sides = [{tuple(p) for p in m.points[members(m, "base")[0].ravel()]} for m in (first, usual)]
    assert sides[0] == sides[1]


@pytest.mark.parametrize("stem", ["e", "q", "o", "z7"])
def test_the_same_mesh_bit_for_bit(stem, tmp_path):
    spec = yaml.safe_load(Path(f"cases/ssnp170/{stem}.yaml").read_text(encoding="utf-8"))["mesh"]
    written = []
    for name in ("first", "second"):
        path = tmp_path / f"{name}.vtkhdf"
        write_mesh(generate(spec, "case.yaml"), path)
        written.append(path.read_bytes())
        # Another mesh in between leaves no trace.
        generate(recipe(block("TRIA6"), block("QUAD4")), "case.yaml")
    assert written[0] == written[1]


def test_pyramids_and_prisms_stand_as_told():
    """Faces on the interface, and where the two prisms or five pyramids meet."""
    interface = {("PENTA6", "TRIA3"): 2, ("PENTA6", "QUAD4"): 1}
    interface |= {("PYRA5", "TRIA3"): 4, ("PYRA5", "QUAD4"): 1}
    for (kind, contact), faces in interface.items():
        spec = recipe(block("TETRA4"), {"cells": kind, "contact": contact})
        mesh = generate(spec, "case.yaml")
        assert sum(map(len, members(mesh, "top_contact"))) == faces
        (cells,) = members(mesh, "top")
        assert len(cells) == (2 if kind == "PENTA6" else 5)
        if kind == "PYRA5":
            height = 0.0 if contact == "TRIA3" else 2.0
            assert mesh.points[cells[:, 4]].tolist() == [[1.0, 1.0, height]] * 5


@pytest.mark.parametrize(
    ("kind", "contact", "cells", "faces"),
    [
        ("PENTA6", "TRIA3", 24, 12),
        ("PENTA15", "QUAD8", 24, 6),
        ("PYRA5", "TRIA3", 6 * 5 + 6 * 6, 24),
        ("PYRA13", "QUAD8", 6 * 5 + 6 * 6, 6),
    ],
)
@pytest.mark.parametrize("name", ["bottom", "top"])
def test_boxes_of_pyramids_and_prisms_fit_together(name, kind, contact, cells, faces):
    """Divided by 3 × 2 × 2: every face belongs to two cells, or lies on a side of the block."""
    section = {"cells": kind, "contact": contact, "divisions": [3, 2, 2]}
    sections = {"bottom": block("HEXA8", 1), "top": block("HEXA8", 1)} | {name: section}
    mesh = generate({"recipe": "blocks", "size": 2.0, **sections}, "case.yaml")
    [nodes] = members(mesh, name)
    assert len(nodes) == cells
    assert measure(mesh.points, nodes, kind) == pytest.approx(8)
    assert all(measure(mesh.points, cell[None], kind) > 0 for cell in nodes)
    assert sum(map(len, members(mesh, f"{name}_contact"))) == faces
    seen = Counter()
    for face in BY_NAME[kind].faces:
        corners = nodes[:, [i for i in face.nodes if i < BY_NAME[kind].n_vertices]]
        seen.update(tuple(sorted(rim)) for rim in corners.tolist())
    assert set(seen.values()) == {1, 2}
    for rim in (rim for rim, count in seen.items() if count == 1):
        places = mesh.points[list(rim)]
        assert any(np.ptp(x) == 0 and x[0] in (-2.0, 0.0, 2.0) for x in places.T)


GOOD = {"cells": "QUAD4", "divisions": [2, 2]}
HUGE = 10**200


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            recipe(GOOD, GOOD) | {"recipe": "cubes"},
            "mesh.recipe = 'cubes': no such recipe; allowed: blocks",
        ),
        (
            recipe(GOOD, GOOD) | {"sise": 1},
            "mesh.sise = 1: unknown key; did you mean size? (allowed: ",
        ),
        (
            recipe(GOOD, GOOD, -1),
            "mesh.size = -1: must be a positive number, or a list of one for each axis",
        ),
        (
            recipe(GOOD, GOOD, [1, 2, 3]),
            "mesh.size = [1, 2, 3]: must be one number, or a list of 2",
        ),
        (recipe(GOOD, GOOD, True), "mesh.size = True: must be a positive number"),
        (recipe(GOOD, GOOD, float("nan")), "mesh.size = nan: must be a positive number"),
        (recipe(GOOD | {"cells": "QUAD5"}, GOOD), "mesh.bottom.cells = 'QUAD5': must be TRIA3, "),
        (
            recipe(GOOD, {"cells": "QUAD4"}),
            "mesh.top.divisions: this key is needed",
        ),
        (
            recipe(GOOD, GOOD | {"divisions": [2, 0]}),
            "mesh.top.divisions[1] = 0: must be a whole",
        ),
        (
            recipe(GOOD, GOOD | {"divisions": 2.5}),
            "mesh.top.divisions = 2.5: must be a whole number",
        ),
        (
            recipe(GOOD, GOOD | {"far": 3}),
            "mesh.top.far = 3: unknown key for QUAD4; allowed: cells, divisions",
        ),
        (recipe(block("HEXA8"), {"cells": "PYRA5"}), "mesh.top.contact: this key is needed"),
        (recipe(GOOD, 3), "mesh.top = 3: must be {cells, divisions, far"),
        (
            recipe(GOOD, block("HEXA8")),
            "mesh.top.cells = 'HEXA8': must be of dimension 2 as bottom",
        ),
        (
            recipe(block("TRIA3") | {"algorithm": "magic"}, GOOD),
            "mesh.bottom.algorithm = 'magic': ",
        ),
        (
            recipe(block("TRIA3") | {"divisions": [HUGE, 2]}, GOOD),
            "mesh.bottom.divisions[0] = 1000",
        ),
        (recipe(block("TRIA3") | {"far": HUGE}, GOOD), "mesh.bottom.far = 1000"),
        (recipe(block("TRIA3") | {"inner": HUGE}, GOOD), "mesh.bottom.inner = 1000"),
        (recipe(GOOD, GOOD, 1e300), "mesh.size = 1e+300: must be a positive number"),
        (
            recipe(block("HEXA8"), {"cells": "PYRA13", "contact": "QUAD4"}),
            "mesh.top.contact = 'QUAD4': must be QUAD8 or TRIA6",
        ),
    ],
)
def test_refusals(spec, message):
    with pytest.raises(InputError) as caught:
        generate(spec, "case.yaml")
    assert str(caught.value).startswith(f"case.yaml: {message}")
    assert "\n" not in str(caught.value)


def test_what_gmsh_cannot_do_is_told_in_one_line(monkeypatch):
    def fail(dim: int) -> None:
        raise Exception("PLC Error: two facets intersect")  # gmsh's own way

    monkeypatch.setattr("gmsh.model.mesh.generate", fail)
    with pytest.raises(InputError) as caught:
        generate(recipe(GOOD, GOOD), "case.yaml")
    told = "case.yaml: mesh: gmsh cannot make it: PLC Error: two facets intersect"
    assert str(caught.value) == told


def test_nothing_on_standard_output(capfd):
    generate(recipe(block("TETRA10"), block("HEXA20")), "case.yaml")
    assert capfd.readouterr().out == ""


def test_the_size_of_inner_cells_is_a_length():
    def inner(size, length):
        body = {"cells": "TRIA3", "divisions": [4, 4], "inner": length, "algorithm": "delaunay"}
        mesh = generate(recipe(body, block("TRIA3"), size), "case.yaml")
        (cells,) = members(mesh, "bottom")
        corners = mesh.points[cells]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        rim = (np.abs(corners - [size / 2, -size / 2]) > size / 2 - 1e-9 * size).any(axis=2)
        return len(cells), edges[~rim.any(axis=1)].mean()

    count, length = inner(8.0, 0.5)
    assert 0.8 < length / 0.5 < 1.2
    assert inner(8.0, 1.0)[0] < count / 2
    # All lengths three times as large: the same mesh.
    again = inner(24.0, 1.5)
    assert (again[0], again[1] / 3) == (count, pytest.approx(length, rel=0.01))
