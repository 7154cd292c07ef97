"""Meshes as VTKHDF: what is written comes back, is the same bit for bit, and opens in VTK."""

from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import vtk
from vtk.util.numpy_support import vtk_to_numpy

import solver.mechanics.fem  # noqa: F401 -- adds PENTA15 and the pyramids
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.shape import shape_functions
from solver.mesh import generate, read_mesh, write_mesh
from solver.mesh.files.vtkhdf import read_grid, write_grid
from solver.system.errors import InputError
from tests.mesh.curved import KINDS, Curved, inner_points
from tests.mesh.one_cell import to_cube

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


def opened(mesh: meshio.Mesh, folder: Path) -> vtk.vtkUnstructuredGrid:
    """The mesh written as VTKHDF and read by VTK."""
    write_mesh(mesh, folder / "mesh.vtkhdf")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(folder / "mesh.vtkhdf"))
    reader.Update()
    return reader.GetOutput()


def interpolated(cell: vtk.vtkCell, name: str, reference: np.ndarray) -> np.ndarray:
    """Where VTK's own shape functions put points (n, dim) of our reference cell: (n, 3)."""
    parametric = to_cube(reference) if name.startswith("PYRA") else reference
    padded = np.pad(parametric, ((0, 0), (0, 3 - parametric.shape[1])))
    found, weights = np.empty((len(reference), 3)), [0.0] * cell.GetNumberOfPoints()
    for row, place in zip(found, padded.tolist(), strict=True):
        cell.EvaluateLocation(vtk.reference(0), place, row, weights)
    return found


@pytest.mark.parametrize("name", KINDS)
def test_vtk_interpolates_every_type_as_we_do(name, tmp_path):
    """A wrong number of a type, or a wrong order of its nodes, puts other points elsewhere."""
    kind = BY_NAME[name]
    curved = Curved.of(name)
    # Inside a pyramid of 13 nodes VTK has functions of its own; only between straight edges, and
    # on bent ones, are they the same.
    straight = Curved.of("PYRA5") if name == "PYRA13" else curved
    edges = kind.nodes[np.array(kind.edges)]
    on_edges = 0.3 * edges[:, 0] + 0.7 * edges[:, 1]
    for body, at in ((straight, inner_points(kind)), (curved, on_edges)):
        nodes = body.places(kind.nodes)[:, : kind.dim]
        block = (kind.meshio, np.arange(kind.n_nodes)[None])
        group = {"body": [np.array([0])]}
        cell = opened(meshio.Mesh(nodes, [block], cell_sets=group), tmp_path).GetCell(0)
        assert cell.GetCellType() == kind.vtk
        ours = shape_functions(name).values(at) @ nodes
        np.testing.assert_allclose(interpolated(cell, name, at)[:, : kind.dim], ours, atol=1e-14)
        np.testing.assert_allclose(ours, body.places(at)[:, : kind.dim], atol=1e-14)


@pytest.mark.parametrize("name", [n for n in KINDS if BY_NAME[n].dim == 3])
def test_vtk_takes_the_faces_for_outward(name, tmp_path):
    """Otherwise ParaView lights the surface from within."""
    kind = BY_NAME[name]
    block = (kind.meshio, np.arange(kind.n_nodes)[None])
    mesh = meshio.Mesh(kind.nodes, [block], cell_sets={"body": [np.array([0])]})
    cell = opened(mesh, tmp_path).GetCell(0)
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    assert cell.GetNumberOfFaces() == len(kind.faces)
    for number in range(cell.GetNumberOfFaces()):
        face = cell.GetFace(number)
        points = [face.GetPoints().GetPoint(i) for i in range(face.GetNumberOfEdges())]
        area = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
        assert area @ (np.mean(points, axis=0) - middle) > 0


def test_vtk_reads_2d_meshes_with_z_zero(tmp_path):
    mesh = generate({"recipe": "blocks", "size": 3.0} | RECIPES[0], "case.yaml")
    points = vtk_to_numpy(opened(mesh, tmp_path).GetPoints().GetData())
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
