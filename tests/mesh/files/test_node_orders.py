"""Node orders in every format: where the shape functions put the nodes of curved cells."""

from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest
import vtk

import solver.mechanics.fem  # noqa: F401 -- adds PENTA15 and the pyramids
from solver.lac.cells.catalogue import BY_NAME, CellType
from solver.lac.cells.shape import gauss_rule, shape_functions
from solver.mesh import read_mesh
from tests.mesh.curved import KINDS, Curved, affine, inner_points
from tests.mesh.one_cell import in_vtk_order, vtk_grid, with_masks, write_by_gmsh

# What Abaqus has no type for is written by no tool: the pyramid of 13 nodes, and the hexahedron of
# 27 in the order of its own manual.
ABAQUS_KINDS = [name for name in KINDS if name not in ("HEXA27", "PYRA13")]
# What meshio cannot write: for lines of three nodes it names a type of Abaqus that has two.
NOT_INP_OF_MESHIO = ("TRIA6", "QUAD8", "QUAD9", "PYRA5")
NOT_MED_OF_MESHIO = ("QUAD9", "HEXA27")


def assert_well_read(path: Path, name: str, pin: bool = True) -> None:
    """The file's cell is the curved one, and its groups are there by their names."""
    mesh, curved = read_mesh(path), Curved.of(name)
    cell, face = curved.cell, curved.cell.faces[-1]
    points = nodes_of(mesh, "body", cell)
    assert_image(cell, points, curved.places)
    at, weights = gauss_rule(name, 6)
    jacobian = np.einsum("pnd,ne->pde", shape_functions(name).gradients(at), points)
    determinant = np.linalg.det(jacobian)
    assert (determinant > 0).all()
    assert weights @ determinant == pytest.approx(curved.volume, rel=1e-13)
    side = nodes_of(mesh, "side", BY_NAME[face.type])
    assert_image(BY_NAME[face.type], side, lambda at: curved.face_places(face, at))
    if pin:
        np.testing.assert_allclose(
            mesh.points[mesh.point_sets["pin"]],
            curved.places(cell.nodes[:1])[:, : cell.dim],
            atol=1e-12,
        )
    assert "material" not in mesh.cell_sets


def nodes_of(mesh: meshio.Mesh, group: str, cell: CellType) -> np.ndarray:
    """Coordinates (n_nodes, dim) of the one cell that a group holds."""
    members = zip(mesh.cells, mesh.cell_sets[group], strict=True)
    [(block, ids)] = [(b, i) for b, i in members if i is not None and len(i)]
    assert block.type == cell.meshio
    [number] = ids
    return mesh.points[block.data[number]]


def assert_image(
    cell: CellType, points: np.ndarray, place: Callable[[np.ndarray], np.ndarray]
) -> None:
    """Nodes (n_nodes, dim) lie, and interpolate, as `place` has them, the cell turned any way."""
    vertices = cell.nodes[: cell.n_vertices]
    dim = points.shape[1]
    distance = np.linalg.norm(
        points[: len(vertices), None] - place(vertices)[None, :, :dim], axis=2
    )
    assert (distance.min(axis=1) < 1e-9).all()
    turned = vertices[distance.argmin(axis=1)]
    for at, found in (
        (cell.nodes, points),
        (inner_points(cell), shape_functions(cell.name).values(inner_points(cell)) @ points),
    ):
        expected = place(affine(vertices, turned, at))[:, :dim]
        np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("name", KINDS)
def test_med_of_gmsh(name, tmp_path):
    write_by_gmsh(name, tmp_path / "cell.med")
    assert_well_read(tmp_path / "cell.med", name)


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("name", KINDS)
def test_msh_of_gmsh(name, version, binary, tmp_path):
    options = {"Mesh__MshFileVersion": version, "Mesh__Binary": binary}
    write_by_gmsh(name, tmp_path / "cell.msh", **options)
    assert_well_read(tmp_path / "cell.msh", name)


@pytest.mark.parametrize("name", ABAQUS_KINDS)
def test_inp_of_gmsh(name, tmp_path):
    options = {"Mesh__SaveGroupsOfElements": 1, "Mesh__SaveGroupsOfNodes": 1}
    write_by_gmsh(name, tmp_path / "cell.inp", **options)
    assert_well_read(tmp_path / "cell.inp", name)


@pytest.mark.parametrize("name", [n for n in ABAQUS_KINDS if n not in NOT_INP_OF_MESHIO])
def test_inp_of_meshio(name, tmp_path):
    mesh = in_vtk_order(name)
    mesh.cell_sets = {"body": [[0], []], "side": [[], [0]]}
    mesh.point_sets = {"pin": [0]}
    mesh.write(tmp_path / "cell.inp")
    assert_well_read(tmp_path / "cell.inp", name)


@pytest.mark.parametrize("name", KINDS)
def test_vtu_of_vtk(name, tmp_path):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "cell.vtu"))
    writer.SetInputData(vtk_grid(name))
    writer.Write()
    assert_well_read(tmp_path / "cell.vtu", name)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZMA"])
def test_every_encoding_of_vtu(mode, compressor, tmp_path):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "cell.vtu"))
    writer.SetInputData(vtk_grid("PENTA15"))
    getattr(writer, f"SetDataModeTo{mode}")()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.Write()
    assert_well_read(tmp_path / "cell.vtu", "PENTA15")


@pytest.mark.parametrize("name", KINDS)
def test_vtu_of_pyvista(name, tmp_path):
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")
    pyvista.wrap(vtk_grid(name)).save(tmp_path / "cell.vtu")
    assert_well_read(tmp_path / "cell.vtu", name)


@pytest.mark.parametrize("name", KINDS)
def test_vtu_of_meshio(name, tmp_path):
    with_masks(in_vtk_order(name)).write(tmp_path / "cell.vtu")
    assert_well_read(tmp_path / "cell.vtu", name)


@pytest.mark.parametrize("name", KINDS)
def test_msh_of_meshio(name, tmp_path):
    mesh, dim = in_vtk_order(name), BY_NAME[name].dim
    mesh.cell_data = {f"gmsh:{key}": [[1], [2]] for key in ("physical", "geometrical")}
    mesh.field_data = {"body": [1, dim], "side": [2, dim - 1]}
    meshio.write(tmp_path / "cell.msh", mesh, file_format="gmsh22")
    assert_well_read(tmp_path / "cell.msh", name, pin=False)


@pytest.mark.parametrize("name", [n for n in KINDS if n not in NOT_MED_OF_MESHIO])
def test_med_of_meshio(name, tmp_path):
    mesh = in_vtk_order(name)
    mesh.cell_data = {"cell_tags": [np.array([-1]), np.array([-2])]}
    mesh.cell_tags = {-1: ["body"], -2: ["side"]}
    mesh.point_data = {"point_tags": np.eye(len(mesh.points), dtype=int)[0]}
    mesh.point_tags = {1: ["pin"]}
    meshio.write(tmp_path / "cell.med", mesh)
    assert_well_read(tmp_path / "cell.med", name)
