"""The local cut: table of the method, volumes, conformity, positive Jacobians, inner nodes."""

from collections import Counter
from itertools import combinations

import meshio
import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME, cell_type
from solver.lac.cut import cut, needs_cut
from solver.mechanics.fem.block import volume_rule
from solver.mechanics.fem.elasticity import physical_gradients
from solver.mechanics.fem.faces import boundary_faces, volume_cells

VOLUMES = [n for n, t in BY_NAME.items() if t.dim > 1]
SOLIDS = [n for n, t in BY_NAME.items() if t.dim == 3 and n != "HEXA27"]


def one_cell(name, faces, distortion=0.05):
    """A mesh of one distorted cell, each of the named faces a group of its own."""
    kind = BY_NAME[name]
    rng = np.random.default_rng(3)
    dim = kind.dim
    change = np.eye(dim) + distortion * rng.uniform(-1, 1, (dim, dim))
    points = kind.nodes @ change.T
    points[: kind.n_vertices] += distortion * rng.uniform(-1, 1, (kind.n_vertices, dim))
    if kind.order == 2:
        for k, (i, j) in enumerate(kind.edges):
            points[kind.n_vertices + k] = (points[i] + points[j]) / 2
    blocks = [(kind.meshio, np.arange(kind.n_nodes)[None])]
    sets = {"cell": [np.array([0])]}
    for local in faces:
        face = kind.faces[local]
        blocks.append((cell_type(face.type).meshio, np.array([face.nodes])))
    for k, local in enumerate(faces):
        sets[f"face{local}"] = [np.empty(0, int)] * len(blocks)
        sets[f"face{local}"][1 + k] = np.array([0])
    sets["cell"] += [np.empty(0, int)] * (len(blocks) - 1)
    return meshio.Mesh(points, blocks, cell_sets=sets)


def cut_cell(name, faces, into_hexahedra=False, distortion=0.05):
    mesh = one_cell(name, faces, distortion)
    blocks = [b for f in faces for b in boundary_faces(mesh, f"face{f}")]
    macro = [np.array([k]) for k in range(len(blocks))]
    hexahedra = [into_hexahedra] * len(blocks)
    cells = volume_cells(mesh)
    result = cut(mesh.points, cells, blocks, macro, hexahedra)
    return mesh, result


def volume(points, cells):
    total = 0.0
    for name, data in cells.items():
        reference, weights = volume_rule(name)
        _, determinant = physical_gradients(points, data, BY_NAME[name], reference)
        total += (determinant @ weights).sum()
    return total


def face_counts(cells):
    """How often each face (set of vertices) occurs."""
    counts = Counter()
    for name, data in cells.items():
        for face in BY_NAME[name].faces:
            corners = face.nodes[: cell_type(face.type).n_vertices]
            counts.update(frozenset(map(int, row)) for row in data[:, corners])
    return counts


@pytest.mark.parametrize(
    ("name", "face", "hexahedra", "pieces", "new"),
    [
        ("TRIA3", 0, False, {"TRIA3": 2}, 1),
        ("QUAD4", 0, False, {"QUAD4": 4}, 4),
        ("TRIA6", 0, False, {"TRIA6": 1}, 0),
        ("QUAD8", 0, False, {"QUAD8": 1}, 0),
        ("QUAD9", 0, False, {"QUAD9": 1}, 0),
        ("HEXA27", 0, False, {"HEXA27": 1}, 0),
        ("TETRA4", 0, False, {"TETRA4": 3}, 1),
        ("TETRA10", 0, False, {"TETRA10": 3}, 5),
        ("HEXA8", 0, False, {"PYRA5": 5}, 1),
        ("HEXA8", 0, True, {"HEXA8": 6}, 8),
        ("HEXA20", 0, False, {"PYRA13": 5}, 9),
        ("HEXA20", 0, True, {"HEXA20": 6}, 28),
        ("PENTA6", 0, False, {"PYRA5": 3, "TETRA4": 1}, 1),
        ("PENTA15", 0, False, {"PYRA13": 3, "TETRA10": 1}, 7),
        ("PENTA6", 2, False, {"PYRA5": 2, "TETRA4": 2}, 1),
        ("PENTA15", 2, False, {"PYRA13": 2, "TETRA10": 2}, 7),
        ("PYRA5", 0, False, {"TETRA4": 4}, 1),
        ("PYRA13", 0, False, {"TETRA10": 4}, 6),
        ("PYRA5", 1, False, {"PYRA5": 1, "TETRA4": 3}, 1),
        ("PYRA13", 1, False, {"PYRA13": 1, "TETRA10": 3}, 6),
    ],
)
def test_table_of_the_method(name, face, hexahedra, pieces, new):
    mesh, result = cut_cell(name, [face], hexahedra)
    assert {t: len(c) for t, c in result.cells.items()} == pieces
    assert len(result.points) - len(mesh.points) == new


@pytest.mark.parametrize(
    ("name", "hexahedra"),
    [*((name, False) for name in VOLUMES), *((n, True) for n in VOLUMES if n.startswith("HEXA"))],
)
def test_every_choice_of_up_to_three_slave_faces_is_cut_conformingly(name, hexahedra):
    kind = BY_NAME[name]
    choices = [c for n in (1, 2, 3) for c in combinations(range(len(kind.faces)), n)]
    for faces in choices:
        mesh, result = cut_cell(name, list(faces), hexahedra)
        whole = volume(mesh.points, volume_cells(mesh))
        # physical_gradients refuses cells whose Jacobian is not positive
        assert volume(result.points, result.cells) == pytest.approx(whole, rel=1e-2)
        assert max(face_counts(result.cells).values()) <= 2
        outer = {f for f, n in face_counts(result.cells).items() if n == 1}
        own = {f: frozenset(map(int, kind.faces[f].nodes)) for f in range(len(kind.faces))}
        corners = {
            f: frozenset(own[f] & set(range(kind.n_vertices))) for f in range(len(kind.faces))
        }
        for f in range(len(kind.faces)):
            cut_away = f in faces and needs_cut(kind.faces[f].type)
            assert (corners[f] in outer) != cut_away
        slaves = [
            frozenset(map(int, row[: s.type.n_vertices]))
            for s in result.sub_faces
            for row in s.nodes
        ]
        assert set(slaves) <= outer
        assert len(outer) == len(set(slaves)) + sum(f not in faces for f in range(len(kind.faces)))


@pytest.mark.parametrize("name", VOLUMES)
def test_undistorted_cells_keep_their_volume_exactly(name):
    mesh, result = cut_cell(name, [0, 1], distortion=0.0)
    whole = volume(mesh.points, volume_cells(mesh))
    assert volume(result.points, result.cells) == pytest.approx(whole, rel=1e-14)


@pytest.mark.parametrize("name", VOLUMES)
@pytest.mark.parametrize("hexahedra", [False, True])
def test_each_macro_element_owns_a_node_strictly_inside(name, hexahedra):
    for face in range(len(BY_NAME[name].faces)):
        _, result = cut_cell(name, [face], hexahedra)
        rim = Counter()
        nodes = set()
        for block in result.sub_faces:
            for row in block.nodes:
                nodes |= set(map(int, row))
                ends = [row] if block.type.dim == 1 else [row[list(e)] for e in block.type.edges]
                for k, end in enumerate(ends):
                    if block.type.dim == 1:
                        rim.update(map(int, end[:2]))
                    else:
                        middle = row[block.type.n_vertices + k] if block.type.order == 2 else -1
                        rim[(frozenset(map(int, end)), int(middle))] += 1
        if BY_NAME[name].dim == 2:
            on_rim = {n for n, count in rim.items() if count == 1}
        else:
            on_rim = {n for (e, m), count in rim.items() if count == 1 for n in (*e, m)}
        assert nodes - on_rim


def test_sub_faces_are_turned_outward_and_cover_the_face():
    from solver.mechanics.fem.faces import face_integrals

    for name in SOLIDS:
        for face in range(len(BY_NAME[name].faces)):
            for hexahedra in (False, True):
                mesh, result = cut_cell(name, [face], hexahedra, distortion=0.0)
                kind = BY_NAME[name].faces[face]
                _, whole = face_integrals(mesh.points, np.array([kind.nodes]), kind.type)
                parts = sum(
                    face_integrals(result.points, s.nodes, s.type.name)[1].sum(axis=0)
                    for s in result.sub_faces
                )
                assert np.allclose(parts, whole[0], atol=1e-14)
