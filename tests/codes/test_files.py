"""Files of results: each format holds the exact state of a patch test."""

import h5py
import meshio
import numpy as np
import pytest
from scipy.io import netcdf_file

from solver.codes.files.read import read_raw, read_result_files
from solver.codes.placing import flattened
from solver.codes.verdicts import check_foreign
from solver.commands.cli import main
from solver.system.errors import InputError
from tests.codes import results

CASE = str(results.ROOT / "cases/ssnp170/c.yaml")
CUBES = str(results.ROOT / "cases/ssnp170/m.yaml")


@pytest.fixture(scope="module")
def answer():
    return results.patch("ssnp170/c")


@pytest.fixture(scope="module")
def cubes():
    return results.patch("ssnp170/m")


def checked(capsys, case, *files):
    status = main(["check-result", case, *map(str, files), "--json"])
    said = capsys.readouterr()
    return status, said.out + said.err


def test_frd(cubes, tmp_path, capsys):
    [(kind, cells)] = cubes.cells
    assert kind == "hexahedron"
    pressed = np.flatnonzero(cubes.pressure) + 1
    contact = [(n, [1e-6, 0.0, 0.0, 25.0, 0.0, 0.0]) for n in pressed]
    write = results.write_frd
    file = write(tmp_path / "a.frd", cubes.points, cells, cubes.displacement, cubes.stress, contact)
    raw = read_raw(file)
    assert (raw.code, raw.version) == ("calculix", "2.20")
    assert np.array_equal(raw.mesh.cells[0].data, cells)
    found = read_result_files([file])
    assert np.allclose(found.pressure.values, cubes.pressure)
    assert found.gap.values.max() == 1e-6
    status, said = checked(capsys, CUBES, file)
    assert status == 0, said
    assert '"element_gap"' in said
    # Contact at nodes that the mesh has not, as CalculiX expands those of the plane.
    stray = [(n + 1000, values) for n, values in contact]
    write(file, cubes.points, cells, cubes.displacement, cubes.stress, stray)
    found = read_result_files([file])
    assert found.pressure is None
    assert np.allclose(found.displacement.values, cubes.displacement)
    write(file, cubes.points, cells, cubes.displacement, cubes.stress, contact)
    text = file.read_text(encoding="ascii")
    file.write_text(text.replace("SYY", "SYX"), encoding="ascii")
    assert "xx, yy and xy at least" in checked(capsys, CUBES, file)[1]
    file.write_text("nothing", encoding="ascii")
    assert "not an FRD file, or a damaged one" in checked(capsys, CUBES, file)[1]


def test_med(answer, tmp_path, capsys):
    """As meshio writes it; the displacement has the multiplier of code_aster beside it."""
    file = tmp_path / "a.med"
    lags = np.where(answer.pressure > 0, -25.0, np.nan)
    cells = [(kind, data) for kind, data in answer.cells]
    data = {"RESU____DEPL": np.column_stack([answer.displacement, lags])}
    meshio.med.write(file, meshio.Mesh(answer.points, cells, point_data=data))
    with h5py.File(file, "r+") as med:
        folder = med["CHA/RESU____DEPL"]
        names = b"".join(name.ljust(16) for name in (b"DX", b"DY", b"LAGS_C"))
        folder.attrs["NOM"] = np.bytes_(names)
    names = tmp_path / "map.yaml"
    names.write_text("fields: {displacement: {name: [RESU____DEPL DX, RESU____DEPL DY]}}")
    found = read_result_files([file], names)
    assert found.code == "code_aster"
    assert np.allclose(found.displacement.values, answer.displacement)
    assert np.nanmax(found.pressure.values) == 25.0


def test_med_of_code_aster_by_its_own_names(answer, tmp_path, capsys):
    """`RESU____DEPL` and `RESU____SIEF_NOEU`, with no map."""
    file, components = tmp_path / "a.med", (b"SIXX", b"SIYY", b"SIZZ", b"SIXY")
    data = {
        "RESU____DEPL": answer.displacement, "RESU____SIEF_NOEU": answer.stress[:, :4],
    }  # fmt: skip
    meshio.med.write(file, meshio.Mesh(answer.points, answer.cells, point_data=data))
    with h5py.File(file, "r+") as med:
        for name, given in (("DEPL", (b"DX", b"DY")), ("SIEF_NOEU", components)):
            text = b"".join(component.ljust(16) for component in given)
            med[f"CHA/RESU____{name}"].attrs["NOM"] = np.bytes_(text)
    status, said = checked(capsys, CASE, file, "--only", "displacement,stress")
    assert status == 0, said
    assert '"name": "nodal_stress"' in said


def test_a_scalar_with_a_component_in_the_map(answer, tmp_path):
    file = tmp_path / "a.med"
    data = {"LAGR": answer.pressure[:, None]}
    meshio.med.write(file, meshio.Mesh(answer.points, answer.cells, point_data=data))
    with h5py.File(file, "r+") as med:
        med["CHA/LAGR"].attrs["NOM"] = np.bytes_(b"LAGS_C".ljust(16))
    (tmp_path / "map.yaml").write_text("fields: {pressure: {name: LAGR}}")
    found = read_result_files([file], tmp_path / "map.yaml")
    assert found.pressure.values.max() == 25.0


def test_a_spreadsheet_of_paraview(answer, tmp_path, capsys):
    """Vectors by number, with their magnitude, and the number of the point in two words."""
    head = [
        *('"Point ID"', '"Points:0"', '"Points:1"', '"Points:2"'),
        *('"displacement:0"', '"displacement:1"', '"displacement:Magnitude"'),
        *(f'"stress:{i}"' for i in range(6)),
    ]
    count = len(answer.points)
    size = np.linalg.norm(answer.displacement, axis=1)
    columns = np.arange(count), answer.points, np.zeros(count), answer.displacement, size
    rows = np.column_stack([*columns, answer.stress])
    file = tmp_path / "a.csv"
    np.savetxt(file, rows, delimiter=",", header=",".join(head), comments="", fmt="%.12g")
    status, said = checked(capsys, CASE, file, "--only", "displacement,stress")
    assert status == 0, said
    assert '"name": "stress_components"' in said


def test_three_components_are_those_of_plane_stress(answer, tmp_path):
    file = tmp_path / "a.csv"
    rows = np.column_stack([answer.points, answer.stress[:, [0, 1, 3]]])
    np.savetxt(file, rows, delimiter=",", header="x,y,s:0,s:1,s:2", comments="", fmt="%.12g")
    found = read_result_files([file])
    assert np.isnan(found.stress.values[:, 2]).all()
    assert found.stress.values[:, 3].tolist() == pytest.approx(answer.stress[:, 3].tolist())
    assert (flattened(found, 2, "here", thin=True).stress.values[:, 2] == 0).all()
    with pytest.raises(InputError, match="component zz is missing"):
        flattened(found, 2, "here", thin=False)


def test_the_slave_surface_of_a_case_in_space(tmp_path):
    """All of its points have z = 0, and it has no cells of the bodies."""
    mesh, case = results.mesh_and_case("ssnp170/k")
    nodes = results.slave_nodes(mesh, case)
    points = mesh.points[nodes]
    assert not points[:, 2].any()
    number = np.arange(len(nodes))[:, None]
    surface = meshio.Mesh(points, [("vertex", number)], point_data={"pressure": 25.0 + 0 * number})
    meshio.vtu.write(tmp_path / "a.vtu", surface)
    found = check_foreign(case, read_result_files([tmp_path / "a.vtu"]), mesh, ["pressure"])
    assert found.verdict == "passed", found.reason


def test_a_component_of_an_array_of_a_vtu_file(tmp_path):
    """As ccx2paraview writes CPRESS: meshio drops the names of components."""
    mesh, case = results.mesh_and_case("ssnp170/k")
    nodes = results.slave_nodes(mesh, case)
    values = np.tile([0.5, 25.0, 7.0], (len(nodes), 1))
    number = np.arange(len(nodes))[:, None]
    surface = meshio.Mesh(mesh.points[nodes], [("vertex", number)], point_data={"CONTACT": values})
    path = tmp_path / "a.vtu"
    meshio.vtu.write(path, surface)
    text, tag = path.read_bytes(), b'Name="CONTACT"'
    assert text.count(tag) == 1
    names = ((b"COPEN", b"CPRESS", b"CSHEAR"), (b"A", b"B", b"C"))
    told = [b" ".join(b'ComponentName%d="%s"' % pair for pair in enumerate(n)) for n in names]
    path.write_bytes(text.replace(tag, tag + b" " + told[0]))
    found = check_foreign(case, read_result_files([path]), mesh, ["pressure"])
    assert found.verdict == "passed", found.reason
    path.write_bytes(text.replace(tag, tag + b" " + told[1]))
    names = tmp_path / "map.yaml"
    names.write_text("fields: {pressure: {name: CONTACT B}}\n")
    found = check_foreign(case, read_result_files([path], names), mesh, ["pressure"])
    assert found.verdict == "passed", found.reason


def write_exodus(path, points, cells, fields):
    with netcdf_file(path, "w") as file:
        file.createDimension("time_step", None)
        file.createDimension("nodes", len(points))
        file.createDimension("len", 33)
        file.createDimension("cells", len(cells))
        file.createDimension("each", cells.shape[1])
        file.createDimension("vars", len(fields))
        for i, axis in enumerate("xyz"[: points.shape[1]]):
            file.createVariable(f"coord{axis}", "d", ("nodes",))[:] = points[:, i]
        block = file.createVariable("connect1", "i", ("cells", "each"))
        block[:] = cells + 1
        block.elem_type = b"QUAD4"
        names = np.array([list(n.ljust(33, "\0")) for n in fields], dtype="S1")
        file.createVariable("name_nod_var", "c", ("vars", "len"))[:] = names
        for i, values in enumerate(fields.values(), start=1):
            variable = file.createVariable(f"vals_nod_var{i}", "d", ("time_step", "nodes"))
            variable[0], variable[1] = 0.5 * values, values  # the last time counts


def test_exodus(answer, tmp_path, capsys):
    file = tmp_path / "a.e"
    [(_, cells)] = answer.cells
    stress = {f"stress_{n}": answer.stress[:, i] for i, n in enumerate(("xx", "yy", "zz", "xy"))}
    moved = {"disp_x": answer.displacement[:, 0], "disp_y": answer.displacement[:, 1]}
    write_exodus(file, answer.points, cells, moved | stress | {"contact_pressure": answer.pressure})
    status, said = checked(capsys, CASE, file)
    assert status == 0, said
    for name in ("displacement", "nodal_stress", "multiplier", "balance"):
        assert f'"name": "{name}"' in said


def test_vtkhdf_of_others(answer, tmp_path, capsys):
    """The layout of VTK's documentation, without what is ours in the files that we write."""
    file = tmp_path / "a.vtkhdf"
    [(_, cells)] = answer.cells
    with h5py.File(file, "w") as stored:
        grid = stored.create_group("VTKHDF")
        grid["NumberOfPoints"], grid["NumberOfCells"] = [len(answer.points)], [len(cells)]
        grid["NumberOfConnectivityIds"] = [cells.size]
        grid["Points"] = np.pad(answer.points, ((0, 0), (0, 1)))
        grid["Connectivity"], grid["Types"] = cells.ravel(), np.full(len(cells), 9, dtype=np.uint8)
        grid["Offsets"] = np.arange(len(cells) + 1) * 4
        grid["PointData/U"] = np.pad(answer.displacement, ((0, 0), (0, 1)))
    status, said = checked(capsys, CASE, file, "--only", "displacement")
    assert status == 0, said
    assert '"name": "displacement"' in said


def test_tables(answer, tmp_path, capsys):
    fields, contact = tmp_path / "fields.csv", tmp_path / "contact.txt"
    rows = np.column_stack([answer.points, answer.displacement, answer.stress[:, :4]])
    head = "x,y,ux,uy,sxx,syy,szz,sxy"
    np.savetxt(fields, rows, delimiter=",", header=head, comments="", fmt="%.12g")
    slave = answer.points[answer.pressure > 0]
    middle = (np.sort(slave[:, 0])[1:] + np.sort(slave[:, 0])[:-1]) / 2
    lines = [f"{x:.9g} 0 25 {50 / 12:.9g}" for x in middle]
    contact.write_text("\n".join(["# of each face", "x y pressure area", *lines]), encoding="utf-8")
    status, said = checked(capsys, CASE, fields, contact)
    assert status == 0, said
    for name in ("displacement", "stress_components", "multiplier", "balance"):
        assert f'"name": "{name}"' in said
    few = tmp_path / "few.txt"  # on a part of the interface only
    few.write_text("x y pressure\n1.2 0 25\n3.4 0 25\n", encoding="utf-8")
    status, said = checked(capsys, CASE, few)
    assert (status, "pressure: it is from (1.2, 0) to (3.4, 0)" in said) == (2, True), said
    status, said = checked(capsys, CASE, fields, fields)
    assert (status, "displacement: is in another file of the result too" in said) == (2, True)


TABLES = {
    "": "the file is empty",
    "x y pressure": "there are no lines of numbers",
    "1 2 3\n4 5 6": "the first line must name the columns",
    "x y pressure\n1 2": "line 2: 2 entries for 3 columns",
    "x y pressure\n1 2 a": "line 2 = '1 2 a': must be numbers",
    "x y temperature\n1 2 3": "none is known as displacement, stress, pressure, gap; fields: temp",
    "x y p pressure\n1 2 3 3": "may be one of p, pressure: name it with --map",
    "x y ux\n1 2 3": "none is known as",
}


@pytest.mark.parametrize("text", TABLES)
def test_a_table_that_is_none_is_refused(text, tmp_path, capsys):
    file = tmp_path / "a.csv"
    file.write_text(text, encoding="utf-8")
    status, said = checked(capsys, CASE, file)
    assert (status, said.count("\n")) == (2, 1)
    assert TABLES[text] in said


def test_files_that_are_no_results_are_refused(tmp_path, capsys):
    for name, told in {"a.xyz": "allowed: .vtu", "a.vtu": "no such file"}.items():
        assert told in checked(capsys, CASE, tmp_path / name)[1]
    for name, told in {
        "b.vtu": "cannot be read",
        "b.med": "no MED file",
        "b.e": "not an Exodus file",
        "b.vtkhdf": "b.vtkhdf: ",
    }.items():
        (tmp_path / name).write_text("not what it says", encoding="utf-8")
        status, said = checked(capsys, CASE, tmp_path / name)
        assert (status, said.count("\n"), told in said) == (2, 1, True), said


MAPS = {
    "code: a b": "code = 'a b': must be letters, digits, -, _ and .",
    "columns: [a, b]": "columns = ['a', 'b']: must name x and y",
    "fields: {pressure: {name: q}}": "fields.pressure.name = 'q': no such field in the result",
    "fields: {displacement: {name: [s1, s2, s3, s4]}}": "there are 4 components in the result",
    "fields: {stress: {name: s1, components: [xx]}}": "xx, yy and xy at least",
    "length: 0": "length = 0: must be a positive number",
}


@pytest.mark.parametrize("text", MAPS)
def test_a_map_that_does_not_fit_is_refused(text, tmp_path, capsys):
    table, mapping = tmp_path / "a.csv", tmp_path / "map.yaml"
    table.write_text("x y s1 s2 s3 s4\n0 0 1 2 3 4\n", encoding="utf-8")
    mapping.write_text(text, encoding="utf-8")
    status = main(["check-result", CASE, str(table), "--map", str(mapping)])
    said = capsys.readouterr().err
    assert (status, said.count("\n")) == (2, 1)
    assert MAPS[text] in said


def test_a_map_names_the_columns_of_a_table(tmp_path):
    table = tmp_path / "a.csv"
    table.write_text("0 0 1 2\n1 0 3 4\n", encoding="utf-8")
    (tmp_path / "map.yaml").write_text("columns: [x, y, ux, uy]\nlength: 10.0\n")
    found = read_result_files([table], tmp_path / "map.yaml")
    assert found.displacement.values.tolist() == [[10.0, 20.0], [30.0, 40.0]]
    assert found.displacement.places.tolist() == [[0.0, 0.0], [10.0, 0.0]]
    with pytest.raises(InputError, match="no such file"):
        read_result_files([tmp_path / "b.csv"])
