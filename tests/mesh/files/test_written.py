"""A mesh written as another program's file and read again: the same cells, the same groups."""

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.mesh import generate, read_mesh, write_mesh
from solver.mesh.files.formats import WRITTEN
from solver.mesh.files.msh import combinations
from solver.system.errors import InputError

CELLS = ["TRIA3", "TRIA6", "QUAD4", "QUAD8", "QUAD9"]
CELLS += ["TETRA4", "TETRA10", "HEXA8", "HEXA20", "HEXA27", "PENTA6", "PENTA15", "PYRA5", "PYRA13"]

CONTACT = {"PENTA6": "TRIA3", "PENTA15": "TRIA6", "PYRA5": "QUAD4", "PYRA13": "QUAD8"}


def mesh_with_groups(cells):
    """Two blocks, with a group of nodes, and faces and nodes in two groups at once."""
    dim = BY_NAME[cells].dim
    below = {"cells": cells, "divisions": [2] * dim}
    below |= {"contact": CONTACT[cells]} if cells in CONTACT else {}
    above = {"cells": "QUAD4" if dim == 2 else "HEXA8", "divisions": [1] * dim}
    mesh = generate({"recipe": "blocks", "size": 50, "bottom": below, "top": above}, "test")
    last = next(i for i, b in enumerate(mesh.cells) if b.dim == dim - 1)
    none = np.arange(0)
    mesh.cell_sets["some"] = [
        np.array([0, 1]) if i == last else none for i in range(len(mesh.cells))
    ]
    mesh.point_sets |= {"corner": np.array([0]), "ends": np.array([0, len(mesh.points) - 1])}
    return mesh


def contents(mesh):
    """Cells by type and place, with their groups; groups of nodes by place."""

    def key(points):
        return tuple(sorted(map(tuple, np.round(points, 9).tolist())))

    found = {}
    for i, block in enumerate(mesh.cells):
        for cell, nodes in enumerate(block.data):
            names = frozenset(n for n, ids in mesh.cell_sets.items() if cell in set(ids[i]))
            found[block.type, key(mesh.points[nodes])] = names
    return found, {name: key(mesh.points[ids]) for name, ids in mesh.point_sets.items()}


NO_ABAQUS = ("QUAD9", "HEXA27", "PYRA13")
PAIRS = [(c, e) for c in CELLS for e in WRITTEN if e != ".inp" or c not in NO_ABAQUS]


@pytest.mark.parametrize(("cells", "extension"), PAIRS)
def test_cells_and_groups_are_those_written(cells, extension, tmp_path):
    mesh = mesh_with_groups(cells)
    write_mesh(mesh, tmp_path / f"mesh{extension}")
    again = read_mesh(tmp_path / f"mesh{extension}")
    assert contents(again) == contents(mesh)
    assert [f.name for f in tmp_path.iterdir()] == [f"mesh{extension}"]
    # The nodes of each cell are in the order of the catalogue: middles are between their vertices.
    for block in again.cells:
        kind = next(k for k in BY_NAME.values() if k.meshio == block.type)
        for node, owners in enumerate(kind.owners):
            middle = again.points[block.data][:, list(owners)].mean(axis=1)
            np.testing.assert_allclose(again.points[block.data][:, node], middle, atol=1e-9)


@pytest.mark.parametrize("cells", NO_ABAQUS)
def test_cells_that_abaqus_lacks_are_refused(cells, tmp_path):
    file = tmp_path / "mesh.inp"
    with pytest.raises(InputError, match=f"^{file}: cell type = '{cells}': allowed: TRIA3, "):
        write_mesh(mesh_with_groups(cells), file)
    assert not any(tmp_path.iterdir())


def test_names_and_faces_that_abaqus_lacks_are_refused(tmp_path):
    mesh = mesh_with_groups("QUAD4")
    mesh.point_sets["SOME"] = mesh.point_sets["ends"]
    with pytest.raises(InputError, match="group = 'some': Abaqus cannot tell"):
        write_mesh(mesh, tmp_path / "mesh.inp")
    del mesh.point_sets["SOME"]
    line = next(i for i, b in enumerate(mesh.cells) if b.dim == 1)
    mesh.cells[line].data[0] = [0, len(mesh.points) - 1]
    with pytest.raises(InputError, match="has faces without cells behind them"):
        write_mesh(mesh, tmp_path / "mesh.inp")


def test_another_extension_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"extension = '\.stl': allowed: \.vtkhdf, \.med"):
        write_mesh(mesh_with_groups("TRIA3"), tmp_path / "mesh.stl")


def test_members_of_several_groups_are_one_combination():
    of, names = combinations(4, {"b": [3, 1], "a": np.array([1])})
    assert [names[k] for k in of] == [[], ["a", "b"], [], ["b"]]
