"""Meshes as VTKHDF: what is written comes back, is the same bit for bit, and opens in VTK."""

import h5py
import meshio
import numpy as np
import pytest
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from solver.errors import InputError
from solver.mesh import generate, read_mesh, write_mesh
from solver.mesh.catalogue import BY_NAME
from solver.mesh.vtkhdf import read_grid, write_grid
from tests.mesh.one_cell import KINDS, write_by_gmsh

RECIPES = [
    {"bottom": {"cells": "TRIA6", "divisions": 2}, "top": {"cells": "QUAD4", "divisions": 3}},
    {
        "bottom": {"cells": "HEXA27", "divisions": 2},
        "top": {"cells": "PENTA15", "contact": "QUAD8"},
    },
    {
        "bottom": {"cells": "TETRA10", "divisions": 2},
        "top": {"cells": "PYRA13", "contact": "TRIA6"},
    },
]


def assert_same(first: meshio.Mesh, second: meshio.Mesh) -> None:
    np.testing.assert_array_equal(first.points, second.points)
    assert [b.type for b in first.cells] == [b.type for b in second.cells]
    for one, other in zip(first.cells, second.cells, strict=True):
        np.testing.assert_array_equal(one.data, other.data)
    assert first.cell_sets.keys() == second.cell_sets.keys()
    for name in first.cell_sets:
        for one, other in zip(first.cell_sets[name], second.cell_sets[name], strict=True):
            np.testing.assert_array_equal(one, other)
    assert first.point_sets.keys() == second.point_sets.keys()
    for name in first.point_sets:
        np.testing.assert_array_equal(first.point_sets[name], second.point_sets[name])


@pytest.mark.parametrize("spec", RECIPES, ids=lambda spec: spec["bottom"]["cells"])
def test_what_is_written_is_read(spec, tmp_path):
    mesh = generate({"recipe": "blocks", "size": 3.0} | spec, "case.yaml")
    mesh.point_sets["corner"] = np.array([0, 3])
    write_mesh(mesh, tmp_path / "mesh.vtkhdf")
    assert_same(read_mesh(tmp_path / "mesh.vtkhdf"), mesh)
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.vtkhdf"]


def test_names_of_groups_that_hdf5_would_take_for_paths(tmp_path):
    mesh = generate({"recipe": "blocks", "size": 3.0} | RECIPES[0], "case.yaml")
    for name in ("a/b", ".", "50 %", "%2F", "größer"):
        mesh.cell_sets[name] = mesh.cell_sets["base"]
        mesh.point_sets[name] = np.array([1])
    write_mesh(mesh, tmp_path / "mesh.vtkhdf")
    back = read_mesh(tmp_path / "mesh.vtkhdf")
    assert back.cell_sets.keys() == mesh.cell_sets.keys()
    assert back.point_sets.keys() == mesh.point_sets.keys()


def test_data_on_points_and_cells(tmp_path):
    mesh = generate({"recipe": "blocks", "size": 3.0} | RECIPES[0], "case.yaml")
    n_cells = sum(len(block.data) for block in mesh.cells)
    point_data = {"u": np.random.default_rng(1).normal(size=(len(mesh.points), 3))}
    cell_data = {"pressure": np.arange(n_cells, dtype=float)}
    with h5py.File(tmp_path / "result.vtkhdf", "w") as file:
        write_grid(file.create_group("VTKHDF"), mesh, point_data, cell_data)
        back, points, cells = read_grid(file["VTKHDF"])
    assert_same(back, mesh)
    np.testing.assert_array_equal(points["u"], point_data["u"])
    np.testing.assert_array_equal(cells["pressure"], cell_data["pressure"])


def test_vtk_sees_the_volume_of_every_type(tmp_path):
    """Written as VTKHDF and read by VTK, each type is what it was and right side out."""
    for name in KINDS:
        write_by_gmsh(name, tmp_path / "cell.msh")
        mesh = read_mesh(tmp_path / "cell.msh")
        write_mesh(mesh, tmp_path / "cell.vtkhdf")
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(tmp_path / "cell.vtkhdf"))
        sizes = vtk.vtkCellSizeFilter()
        sizes.SetInputConnection(reader.GetOutputPort())
        sizes.Update()
        grid = sizes.GetOutput()
        data = grid.GetCellData()
        label = "Volume" if BY_NAME[name].dim == 3 else "Area"
        assert vtk_to_numpy(data.GetArray(label))[0] > 0.1, name
        assert grid.GetCell(0).GetCellType() == BY_NAME[name].vtk


def test_vtk_reads_2d_meshes_with_z_zero(tmp_path):
    mesh = generate({"recipe": "blocks", "size": 3.0} | RECIPES[0], "case.yaml")
    write_mesh(mesh, tmp_path / "mesh.vtkhdf")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "mesh.vtkhdf"))
    reader.Update()
    points = vtk_to_numpy(reader.GetOutput().GetPoints().GetData())
    np.testing.assert_array_equal(points[:, :2], mesh.points)
    assert (points[:, 2] == 0).all()


def test_a_text_in_place_of_a_mesh_is_the_reason(tmp_path):
    path = tmp_path / "mesh.vtkhdf"
    path.write_text("case.yaml: mesh.size = 0: must be a positive number\nmore\n")
    with pytest.raises(InputError) as caught:
        read_mesh(path)
    assert str(caught.value) == f"{path}: mesh: case.yaml: mesh.size = 0: must be a positive number"


def test_hdf5_of_others_is_refused(tmp_path):
    path = tmp_path / "mesh.vtkhdf"
    with h5py.File(path, "w") as file:
        file.create_group("VTKHDF")
    with pytest.raises(InputError, match="no mesh that this program wrote"):
        read_mesh(path)


def test_other_extensions_are_not_written(tmp_path):
    mesh = generate({"recipe": "blocks", "size": 3.0} | RECIPES[0], "case.yaml")
    with pytest.raises(InputError, match=r"extension = '\.vtu': must be \.vtkhdf"):
        write_mesh(mesh, tmp_path / "mesh.vtu")
