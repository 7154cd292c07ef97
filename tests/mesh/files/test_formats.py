"""Reading mesh files: groups, refusals."""

import os
import signal
from pathlib import Path

import gmsh
import h5py
import meshio
import numpy as np
import pytest
import vtk

from solver.mesh import read_mesh
from solver.mesh.files.formats import read_apart
from solver.mesh.recipes.gmsh_session import session
from solver.system.errors import InputError
from tests.mesh.curved import Curved
from tests.mesh.one_cell import vtk_grid, write_by_gmsh


def write_square(path: Path, version: float = 4.1) -> None:
    """A unit square of triangles: overlapping groups of edges, a point, one group without name."""
    with session(Mesh__MshFileVersion=version):
        geo = gmsh.model.geo
        corners = [geo.addPoint(x, y, 0, 0.5) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        edges = [geo.addLine(corners[i - 1], corners[i]) for i in range(4)]
        geo.addPlaneSurface([geo.addCurveLoop(edges)])
        geo.synchronize()
        gmsh.model.addPhysicalGroup(0, corners[:1], name="origin")
        gmsh.model.addPhysicalGroup(1, edges[:2], name="left and bottom")
        gmsh.model.addPhysicalGroup(1, edges[1:3], name="bottom and right")
        gmsh.model.addPhysicalGroup(1, edges[3:], tag=77)
        gmsh.model.addPhysicalGroup(2, [1], name="square")
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))


def as_version_2(path: Path) -> None:
    """Give a MED file the layout of version 2.3, edges with the further column that it may have."""
    with h5py.File(path, "a") as file:
        file["INFOS_GENERALES"].attrs.update(MAJ=2, MIN=3, REL=6)
        (name,) = file["ENS_MAA"]
        mesh = file["ENS_MAA"][name]
        (step,) = list(mesh.values())
        for entity in list(step):
            mesh.move(f"{step.name}/{entity}", f"{mesh.name}/{entity}")
        del mesh[step.name]
        file.move(f"FAS/{name}", f"{mesh.name}/FAS")
        for family in mesh["FAS/ELEME"].values():
            text = family["GRO/NOM"][()].tobytes().replace(b"\0", b" ")
            del family["GRO/NOM"]
            family["GRO/NOM"] = np.bytes_(text + b"\0")
        edges = mesh["MAI/SE2/NOD"]
        count, wider = edges.attrs["NBR"], np.r_[edges[()], np.zeros(edges.attrs["NBR"], int)]
        del mesh["MAI/SE2/NOD"]
        mesh["MAI/SE2/NOD"] = wider
        mesh["MAI/SE2/NOD"].attrs["NBR"] = count


@pytest.mark.parametrize("name", ["v2.msh", "v4.msh", "square.med", "v2.med"])
def test_groups_of_every_dimension(name, tmp_path):
    write_square(tmp_path / name, version=2.2 if name == "v2.msh" else 4.1)
    if name == "v2.med":
        as_version_2(tmp_path / name)
    mesh = read_mesh(tmp_path / name)
    assert mesh.points.shape[1] == 2
    lines = mesh.get_cells_type("line")
    assert len(lines) == 8, "an edge in two groups is one edge"
    place = mesh.cells.index(next(b for b in mesh.cells if b.type == "line"))
    for group, axis_values in (
        ("left and bottom", {(0, 0.0), (1, 0.0)}),
        ("bottom and right", {(1, 0.0), (0, 1.0)}),
    ):
        ids = mesh.cell_sets[group][place]
        assert len(ids) == 4
        for ends in mesh.points[lines[ids]]:
            assert any((ends[:, axis] == value).all() for axis, value in axis_values)
    assert len(mesh.cell_sets["square"][0]) == len(mesh.cells[0].data)
    assert mesh.points[mesh.point_sets["origin"]].tolist() == [[0, 0]]
    if name.endswith("msh"):
        assert len(mesh.cell_sets["77"][place]) == 2


def test_groups_of_nodes_in_med(tmp_path):
    write_by_gmsh("TETRA4", tmp_path / "cell.med")
    with h5py.File(tmp_path / "cell.med", "a") as file:
        (name,) = file["ENS_MAA"]
        (step,) = file["ENS_MAA"][name].values()
        if "FAM" in step["NOE"]:
            del step["NOE/FAM"]
        step["NOE"].create_dataset("FAM", data=np.array([0, 5, 0, 5], dtype=np.int32))
        family = file.create_group(f"FAS/{name}/NOEUD/FAM_5")
        family.attrs["NUM"] = 5
        names = b"".join(label.encode().ljust(80, b"\0") for label in ("pins", "Stütze"))
        family["GRO/NOM"] = np.frombuffer(names, dtype=np.int8).reshape(2, 80)
    mesh = read_mesh(tmp_path / "cell.med")
    curved = Curved.of("TETRA4")
    expected = curved.places(curved.cell.nodes)[[1, 3]]
    for label in ("pins", "Stütze"):
        np.testing.assert_allclose(mesh.points[mesh.point_sets[label]], expected, atol=1e-12)


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_mesh(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


def test_no_such_file(tmp_path):
    assert refusal(tmp_path / "none.med") == "mesh: no such file"


def test_unknown_extension(tmp_path):
    message = refusal(tmp_path / "mesh.stl")
    assert message == "extension = '.stl': allowed: .med, .mmed, .msh, .inp, .vtu, .vtkhdf"


@pytest.mark.parametrize("suffix", ["med", "msh", "inp", "vtu", "vtkhdf"])
@pytest.mark.parametrize("content", [b"", b"no mesh\n", bytes(range(256)) * 8])
def test_rubbish(suffix, content, tmp_path, capfd):
    path = tmp_path / f"mesh.{suffix}"
    path.write_bytes(content)
    refusal(path)
    assert capfd.readouterr().out == ""


def test_a_script_is_no_gmsh_mesh(tmp_path):
    path = tmp_path / "mesh.msh"
    path.write_text(f'SystemCall "touch {tmp_path}/executed";')
    assert refusal(path) == "mesh: no gmsh mesh: it must start with $MeshFormat"
    assert not (tmp_path / "executed").exists()


def test_truncated_msh(tmp_path):
    path = tmp_path / "square.msh"
    write_square(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    refusal(path)


def test_no_groups(tmp_path):
    path = tmp_path / "mesh.vtu"
    meshio.write(path, meshio.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [("triangle", [[0, 1, 2]])]))
    assert refusal(path) == (
        "groups: the mesh must have named groups of cells or faces (docs/formats.md)"
    )


def test_a_type_that_is_not_there(tmp_path):
    path = tmp_path / "mesh.msh"
    with session(Mesh__ElementOrder=3):
        gmsh.model.geo.addPoint(0, 0, 0)
        gmsh.model.geo.extrude([(0, 1)], 1, 0, 0, [1])
        gmsh.model.geo.extrude([(1, 1)], 0, 1, 0, [1])
        gmsh.model.geo.synchronize()
        gmsh.model.addPhysicalGroup(2, [5], name="square")
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))
    assert refusal(path).startswith("cell type = 'Triangle 10': allowed: SEG2, SEG3,")


def write_vtu(grid: vtk.vtkUnstructuredGrid, path: Path, compressor: str = "ZLib") -> None:
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.Write()


def test_vtu_with_cells_that_would_be_left_out(tmp_path):
    """The reader behind it leaves out, with no more than a word, what it does not know."""
    grid = vtk_grid("QUAD4")
    for array in ("body", "side", "material"):
        grid.GetCellData().GetArray(array).InsertNextValue(1)
    grid.InsertNextCell(vtk.VTK_TRIANGLE_STRIP, 4, [0, 1, 3, 2])
    write_vtu(grid, tmp_path / "strip.vtu")
    message = refusal(tmp_path / "strip.vtu")
    assert message.startswith("cell type: 1 of 3 cells are of other types; allowed: SEG2, ")


def test_vtu_with_a_compression_that_is_not_read(tmp_path):
    write_vtu(vtk_grid("QUAD4"), tmp_path / "cell.vtu", "LZ4")
    assert refusal(tmp_path / "cell.vtu") == (
        "compressor = 'vtkLZ4DataCompressor': allowed: none, vtkZLibDataCompressor, "
        "vtkLZMADataCompressor"
    )


def test_several_meshes_in_one_med_file(tmp_path):
    path = tmp_path / "two.med"
    write_by_gmsh("TRIA3", path)
    with h5py.File(path, "a") as file:
        (name,) = file["ENS_MAA"]
        file.copy(f"ENS_MAA/{name}", "ENS_MAA/again")
    assert refusal(path).startswith("meshes = 2: the file must hold one mesh: again, ")


def dies(_):
    os.kill(os.getpid(), signal.SIGSEGV)


def never_ends(_):
    while True:
        pass


@pytest.mark.parametrize(
    ("reader", "message"), [(dies, "the reader died of it"), (never_ends, "takes too long to read")]
)
def test_what_kills_a_reader_is_a_refusal(reader, message, tmp_path, monkeypatch):
    monkeypatch.setattr("solver.mesh.files.formats._SECONDS", 0.3)
    path = tmp_path / "m.msh"
    path.write_text("$MeshFormat")
    with pytest.raises(InputError, match=rf"m\.msh: mesh: cannot be read \({message}"):
        read_apart(reader, path)
