"""Results as VTK and PyVista open them: cells, fields by their names, values, units."""

import h5py
import numpy as np
import pytest
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from solver.case.reader import parse_case
from solver.lac.cells.catalogue import BY_NAME, cell_type
from solver.report.case_picture import draw_case
from solver.report.profile import draw_profile
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.results import write_result
from tests import handmade
from tests.scenes import block_case, block_mesh

KINDS = [name for name, cell in BY_NAME.items() if cell.dim > 1]
UNITS = "units: {length: mm, stress: N/mm²}\n"
FIELDS = {
    "point": {"displacement": 3, "stress": 6, "normal_stress": 1, "body": 1, "reaction": 3},
    "cell": {
        "pressure": 1, "gap": 1, "status": 1, "coverage": 1, "macro_element": 1, "zone": 1,
        "pressure_error_estimate": 1,
    },
}  # fmt: skip


def opened_by_vtk(path):
    """Types of the cells, arrays on points and on cells, and the list of units, all by VTK."""
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    kinds = [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())]
    arrays = [
        {
            data.GetArrayName(i): vtk_to_numpy(data.GetArray(i))
            for i in range(data.GetNumberOfArrays())
        }
        for data in (grid.GetPointData(), grid.GetCellData())
    ]
    units = grid.GetFieldData().GetAbstractArray("units")
    listed = [units.GetValue(i) for i in range(units.GetNumberOfValues())] if units else []
    return kinds, vtk_to_numpy(grid.GetPoints().GetData()), *arrays, listed


def opened_by_pyvista(path):
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")
    grid = pyvista.read(path)
    arrays = (dict(grid.point_data.items()), dict(grid.cell_data.items()))
    return grid.celltypes.tolist(), grid.points, *arrays, list(grid.field_data.get("units", []))


def assert_opened(opened, solution):
    kinds, points, point_data, cell_data, units = opened
    mesh, dim = solution.mesh, solution.mesh.points.shape[1]
    faces = sorted((kind, len(owner)) for zone in solution.zones for kind, _, owner in zone.faces)
    counts = [(cell_type(b.type).name, len(b.data)) for b in mesh.cells] + faces
    assert kinds == [BY_NAME[name].vtk for name, n in counts for _ in range(n)]
    np.testing.assert_array_equal(points[:, :dim], mesh.points)
    for data, fields in ((point_data, FIELDS["point"]), (cell_data, FIELDS["cell"])):
        assert {k: v.size // len(v) for k, v in data.items()} == fields
    np.testing.assert_array_equal(point_data["displacement"][:, :dim], solution.displacement)
    np.testing.assert_array_equal(point_data["stress"], solution.stress)
    np.testing.assert_array_equal(point_data["reaction"][:, :dim], solution.fields.reaction)
    on_face = cell_data["zone"] >= 0
    assert np.isnan(cell_data["pressure"][~on_face]).all()
    owner = cell_data["macro_element"][on_face]
    np.testing.assert_array_equal(
        cell_data["pressure"][on_face], solution.zones[0].multiplier[owner]
    )
    assert units == [
        "Points: mm", "displacement: mm", "gap: mm",
        "normal_stress: N/mm²", "pressure: N/mm²", "pressure_error_estimate: N/mm²",
        "stress: N/mm²",
    ]  # fmt: skip


@pytest.fixture(scope="module", params=KINDS)
def solved(request, tmp_path_factory):
    """A solve with that cell type in the slave, and its result file."""
    dim = BY_NAME[request.param].dim
    other = "TRIA6" if dim == 2 else "TETRA10"
    solution = simulate(block_case(dim, UNITS), block_mesh(request.param, other, (2, 1)))
    path = tmp_path_factory.mktemp(request.param) / "result.vtkhdf"
    write_result(path, solution, [], {})
    return solution, path


@pytest.mark.parametrize("opened", [opened_by_vtk, opened_by_pyvista])
def test_a_result_of_every_cell_type_opens(solved, opened):
    solution, path = solved
    assert_opened(opened(path), solution)


def labelled(solution):
    case = solution.case
    solution.case = parse_case(UNITS + case.about.source, case.path)
    return solution


def test_units_stand_beside_the_fields(tmp_path):
    write_result(tmp_path / "result.vtkhdf", labelled(handmade.solid(tmp_path)), [], {})
    with h5py.File(tmp_path / "result.vtkhdf") as file:
        zone, points = file["contact/interface"], file["VTKHDF/PointData"]
        found = {name: zone[name].attrs.get("unit") for name in ("multiplier", "gap", "status")}
        assert found == {"multiplier": "N/mm²", "gap": "mm", "status": None}
        assert points["displacement"].attrs["unit"] == "mm"
        assert "unit" not in points["body"].attrs


def test_without_units_there_are_none(tmp_path):
    write_result(tmp_path / "result.vtkhdf", handmade.plane(tmp_path), [], {})
    assert opened_by_vtk(tmp_path / "result.vtkhdf")[-1] == []
    assert "[" not in draw_case(handmade.solid(tmp_path), "")


def test_pictures_have_units(tmp_path):
    plane, solid = (labelled(make(tmp_path)) for make in (handmade.plane, handmade.solid))
    view = draw_profile(plane, plane.zones[0], "p", "").spec["vconcat"][0]
    channels = view["encoding"]
    assert channels["y"]["title"] == "contact pressure [N/mm²]"
    assert channels["x"]["title"] == "x [mm]"
    plan = draw_case(solid, "")
    assert ">contact pressure p [N/mm²]<" in plan
    assert ">x [mm]<" in plan


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("mm", r"units = 'mm': must be \{length, stress\}"),
        ("{}", r"units = \{\}: must be \{length, stress\}"),
        ("{force: N}", "units.force = 'N': unknown key; allowed: length, stress"),
        ("{length: m m}", "units.length = 'm m': must be the name of a unit, 20 letters"),
        ("{length: 1}", "units.length = 1: must be the name of a unit, 20 letters"),
    ],
)
def test_units_that_are_none(given, message, tmp_path):
    case = handmade.plane(tmp_path).case
    with pytest.raises(InputError, match=message):
        parse_case(f"units: {given}\n" + case.about.source, case.path)
