"""The result file: whole, readable by others, and enough to make every check again."""

from copy import deepcopy
from dataclasses import asdict

import h5py
import meshio
import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.system.files import seal
from solver.verification.checks import run_checks
from solver.verification.provenance import gather
from solver.verification.results import read_result, write_result
from tests.handmade import plane, solid
from tests.same import in_order, read_back, same
from tests.scenes import block_case, block_mesh, errors


def retold(solution, old, new):
    """The solution of another case: its source with one part changed."""
    assert old in solution.case.about.source
    solution.case = parse_case(solution.case.about.source.replace(old, new), solution.case.path)


@pytest.fixture(params=[plane, solid])
def solution(request, tmp_path):
    return request.param(tmp_path)


@pytest.fixture
def written(solution, tmp_path):
    path = tmp_path / "result.vtkhdf"
    write_result(path, solution, run_checks(solution), gather(solution.case.path, None))
    return path


def test_faces_of_one_type_on_cells_of_two_types(tmp_path):
    """SEG2 on QUAD4 and TRIA3: one cell on the surface of the upper block is cut in two."""
    mesh = block_mesh("QUAD4", "QUAD4")
    quads, edges = mesh.cells
    low = mesh.points[quads.data][..., 1].min(axis=1)
    first = np.flatnonzero(low == 0)[0]
    kept = np.delete(np.arange(len(quads.data)), first)
    sets = {
        name: [np.flatnonzero(np.isin(kept, of[0])), of[1], [0, 1] if name == "top" else []]
        for name, of in mesh.cell_sets.items()
    }
    halves = quads.data[first][[[0, 1, 2], [0, 2, 3]]]
    cells = [("quad", quads.data[kept]), edges, ("triangle", halves)]
    mixed = meshio.Mesh(mesh.points, cells, cell_sets=sets)
    solution = simulate(block_case(2), mixed)
    path = tmp_path / "result.vtkhdf"
    write_result(path, solution, [], {})
    (faces,) = read_result(path).solution.zones[0].surfaces.master_faces
    assert (faces[0], faces[1].shape) == ("SEG2", (2, 2))
    assert max(errors(solution).values()) < 1e-12


def test_everything_comes_back(solution, written):
    """Of solves with every pair of options: see `tests.pairs`."""
    again = read_result(written).solution
    assert again.job == solution.job
    assert read_back(solution, again)


def test_zones_that_share_a_cell_type_come_back_apart(tmp_path):
    solution = solid(tmp_path)
    second = deepcopy(solution.zones[0])
    second.name, second.faces = "second", [("TRIA3", np.array([[8, 9, 10]]), np.array([1]))]
    solution.zones.append(second)
    solution.quality.balance["zone second: force"] = 0.0
    add = "contact: [{name: second, slave: a, master: b}, "
    retold(solution, "contact: [", add)
    path = tmp_path / "result.vtkhdf"
    write_result(path, solution, [], {})
    again = read_result(path).solution
    assert [zone.name for zone in again.zones] == ["interface", "second"]
    assert same(in_order(solution).zones, in_order(again).zones)


def test_a_solve_without_contact_comes_back(tmp_path):
    solution = plane(tmp_path)
    solution.zones = []
    retold(solution, "observe: [{zone: interface, nearest: [0, 0]}]\n", "")
    retold(solution, "  contact_pressure: 25.0\n", "")
    retold(solution, "  gap: 0.0\n", "")
    retold(solution, "contact: [{name: interface, slave: lower, master: upper}]\n", "")
    for step in solution.steps:
        step.observations = []
    path = tmp_path / "result.vtkhdf"
    write_result(path, solution, [], {})
    again = read_result(path).solution
    assert again.zones == []
    assert same(again.steps, solution.steps)
    assert same(again.mesh, solution.mesh)


def test_the_case_comes_back_from_its_source(solution, written):
    solution.case.path.unlink()
    case = read_result(written).solution.case
    assert case.about.source == solution.case.about.source
    assert (case.name, case.zones, case.materials, case.reference.tolerance) == (
        solution.case.name,
        solution.case.zones,
        solution.case.materials,
        solution.case.reference.tolerance,
    )
    assert case.reference.values == solution.case.reference.values


def test_checks_of_the_file_are_those_of_the_solve(solution, written):
    before, after = run_checks(solution), run_checks(read_result(written).solution)
    assert [asdict(check) for check in after] == [asdict(check) for check in before]


def test_checks_are_made_from_the_stored_fields(written):
    with h5py.File(written, "r+") as file:
        file["contact/interface/multiplier"][0] = 26.0
        file["VTKHDF/PointData/displacement"][3] = 1.0
    seal(written)
    failed = {c.name for c in run_checks(read_result(written).solution) if not c.passed}
    assert {"multiplier", "element_pressure", "displacement"} <= failed


def test_the_layout_is_plain_hdf5(tmp_path):
    solution = solid(tmp_path)
    path = tmp_path / "result.vtkhdf"
    write_result(path, solution, run_checks(solution), gather(solution.case.path, None))
    with h5py.File(path) as file:
        assert set(file) >= {
            *("VTKHDF", "case", "solve", "contact", "bodies", "balance", "steps", "observation"),
            *("plan", "timings", "checks", "provenance"),
        }
        assert file["case/source"].asstr()[()] == solution.case.about.source
        assert file["case"].attrs["name"] == "hexahedron-on-wedges"
        assert file["case"].attrs["family"] == tmp_path.name
        assert bool(file["case"].attrs["swapped"])
        assert file["contact/interface/multiplier"][()].tolist() == [25.0, 24.0]
        assert file["contact/interface/status"][()].tolist() == [True, False]
        assert file["checks/name"].asstr()[0] == "multiplier"
        assert file["checks/passed"][()].dtype == bool
        assert file["provenance"].attrs["numpy"] == np.__version__
        assert len(file["provenance"].attrs["case_sha256"]) == 64
        data = {name: array[()] for name, array in file["VTKHDF/CellData"].items()}
    # One hexahedron and two wedges, then the sub-faces: a QUAD4 and four TRIA3.
    assert data["macro_element"].tolist() == [-1, -1, -1, 1, 0, 0, 0, 0]
    assert data["pressure"][3:].tolist() == [24.0, 25.0, 25.0, 25.0, 25.0]
    assert data["status"][3:].tolist() == [0.0, 1.0, 1.0, 1.0, 1.0]
    assert data["coverage"][3:].tolist() == [0.75, 1.0, 1.0, 1.0, 1.0]
    assert data["gap"][3:].tolist() == [0.5, 0.0, 0.0, 0.0, 0.0]
    for name in ("pressure", "gap", "status", "coverage"):
        assert np.isnan(data[name][:3]).all()


def test_observations_are_steps_by_places(tmp_path):
    path = tmp_path / "result.vtkhdf"
    write_result(path, plane(tmp_path), [], {})
    with h5py.File(path) as file:
        assert file["observation/factor"][()].tolist() == [0.5, 1.0]
        assert file["observation/pressure"][()].tolist() == [[12.5], [25.0]]
        assert file["observation/zone"].asstr()[()].tolist() == ["interface"]


def test_vtk_opens_it(solution, written):
    vtk = pytest.importorskip("vtk", reason="vtk is not installed")
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkHDFReader()
    assert reader.CanReadFile(str(written))
    reader.SetFileName(str(written))
    reader.Update()
    grid = reader.GetOutput()
    n_faces = sum(len(faces[1]) for faces in solution.zones[0].faces)
    n_volumes = sum(len(block.data) for block in solution.mesh.cells)
    assert grid.GetNumberOfPoints() == len(solution.mesh.points)
    assert grid.GetNumberOfCells() == n_volumes + n_faces
    displacement = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
    assert displacement.shape == (len(solution.mesh.points), 3)
    assert grid.GetPointData().GetArray("stress").GetNumberOfComponents() == 6
    pressure = vtk_to_numpy(grid.GetCellData().GetArray("pressure"))
    assert np.isnan(pressure[:n_volumes]).all()
    assert set(pressure[n_volumes:]) == set(solution.zones[0].multiplier)


def test_nothing_half_written_takes_the_files_place(solution, written):
    before = written.read_bytes()
    solution.stress = object()
    with pytest.raises(TypeError):
        write_result(written, solution, [], {})
    assert written.read_bytes() == before
    assert {path.name for path in written.parent.iterdir()} == {"case.yaml", "result.vtkhdf"}


@pytest.mark.parametrize("place", [0.05, 0.3, 0.6, 0.9])
def test_a_damaged_result_is_refused_bit_by_bit(written, place):
    content = bytearray(written.read_bytes())
    content[int(place * len(content))] ^= 1
    written.write_bytes(content)
    with pytest.raises(InputError, match=r"must be a result written by `solve` \(damaged"):
        read_result(written)


def lose_group(file):
    del file["balance"]


def lose_zone(file):
    del file["contact/interface"]


def lose_step(file):
    for data in file["steps"].values():
        data[0] = 2.5


def other_type(file):
    values = file["contact/interface/status"]
    text = np.full(values.shape, b"text")
    del file["contact/interface/status"]
    file["contact/interface/status"] = text


def other_shape(file):
    values = file["VTKHDF/PointData/body"][()]
    del file["VTKHDF/PointData/body"]
    file["VTKHDF/PointData/body"] = values[:, None]


def not_a_number(file):
    file["contact/interface/gap"][0] = np.nan


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lose_group, "other names, types or shapes"),
        (lose_zone, "other names, types or shapes"),
        (other_type, "other names, types or shapes"),
        (other_shape, "other names, types or shapes"),
        (lose_step, "the load steps differ from the case's"),
        (not_a_number, "zones[interface].gap holds values that are not finite numbers"),
    ],
)
def test_a_result_of_another_layout_is_refused_in_one_line(written, change, fault):
    with h5py.File(written, "r+") as file:
        change(file)
    seal(written)
    with pytest.raises(InputError) as refusal:
        read_result(written)
    assert fault in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).endswith("solve again")


def test_a_file_that_is_no_result_is_refused_by_name(tmp_path):
    text, other = tmp_path / "text.vtkhdf", tmp_path / "other.vtkhdf"
    text.write_text("no HDF5")
    h5py.File(other, "w").close()
    for path in (text, other, tmp_path / "missing.vtkhdf", tmp_path):
        with pytest.raises(InputError, match=rf"{path.name}.*must be a result"):
            read_result(path)


def test_provenance_tells_the_mesh_by_its_hash(tmp_path):
    case, mesh = tmp_path / "case.yaml", tmp_path / "mesh.msh"
    case.write_bytes(b"")
    mesh.write_bytes(b"abc")
    known = gather(case, mesh)
    assert known["case_sha256"].startswith("e3b0c44298fc1c14")  # of nothing at all
    assert known["mesh_sha256"].startswith("ba7816bf8f01cfea")  # of "abc"
    assert known["cores"] >= 1
    assert known["time_utc"].endswith("+00:00")
