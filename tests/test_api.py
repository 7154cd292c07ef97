"""`solve_case`: files, mappings and meshes in, arrays, verdicts and figures out."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import meshio
import numpy as np
import pytest
import yaml

from solver import InputError, Solved, solve_case
from solver.case.reader import load_case
from solver.mesh import write_mesh
from solver.verification.run import check
from tests.scenes import PRESSURE, block_mesh

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "cases" / "ssnp170" / "c.yaml"
CASE = {
    "name": "patch",
    "plane": "strain",
    "materials": {"all": {"young": 2000.0, "poisson": 0.3}},
    "supports": [{"group": "base", "fix": ["y"]}, {"group": "symx", "fix": ["x"]}],
    "loads": [{"group": "press", "pressure": PRESSURE}],
    "contact": [{"name": "interface", "slave": "bottom_contact", "master": "top_contact"}],
    "reference": {"kind": "analytical", "contact_pressure": PRESSURE, "gap": 0.0},
}


def patch(**changes) -> Solved:
    return solve_case(CASE | changes, block_mesh("QUAD4", "TRIA3"))


def test_importing_the_package_loads_nothing():
    kept_out = "{'numpy', 'meshio', 'yaml', 'solver.case.reader'}"
    code = f"import solver, sys; print({kept_out} & {{*sys.modules}})"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.stdout.strip() == "set()", run.stderr


def test_what_the_package_does_not_have():
    import solver

    with pytest.raises(AttributeError, match="has no attribute 'solve_cases'"):
        _ = solver.solve_cases


def test_arrays_of_the_patch_test():
    solved = patch()
    n = len(solved.points)
    assert solved.displacement.shape == solved.points.shape == (n, 2)
    assert solved.stress.shape == (n, 6)
    assert solved.pressure.shape == solved.gap.shape == (3,)
    assert solved.centre.shape == (3, 2)
    assert solved.pressure == pytest.approx(PRESSURE, rel=1e-13)
    assert solved.stress[:, 1] == pytest.approx(-PRESSURE, rel=1e-13)
    assert list(solved.zones) == ["interface"]
    assert (solved.verdict, solved.passed, solved.reason) == ("passed", True, "")
    assert str(solved).startswith("patch: passed, largest checked error ")


def test_without_contact_there_are_no_macro_elements():
    solved = solve_case(
        {k: v for k, v in CASE.items() if k not in ("contact", "reference", "loads", "supports")}
        | {"supports": [{"group": g, "fix": ["x", "y"]} for g in ("base", "press")]},
        block_mesh("QUAD4", "QUAD4"),
    )
    assert solved.pressure.shape == solved.gap.shape == (0,)
    assert solved.centre.shape == (0, 2)
    assert {len(column) for column in solved.table.values()} == {0}


def test_closed_in_the_table_selects_rows():
    table = solve_case(CASE, block_mesh("QUAD4", "QUAD4")).table
    assert table["closed"].dtype == bool
    assert table["pressure"][table["closed"]] == pytest.approx(PRESSURE, rel=1e-13)
    assert table["zone"].tolist() == ["interface"] * len(table["pressure"])


def test_a_file_a_mapping_and_a_case_are_one():
    by_file, by_case = solve_case(FILE), solve_case(load_case(FILE))
    by_mapping = solve_case(yaml.safe_load(FILE.read_text()))
    for other in (by_case, by_mapping, solve_case(str(FILE))):
        assert np.array_equal(other.displacement, by_file.displacement)
        assert np.array_equal(other.pressure, by_file.pressure)
    # Accepted values belong to the file.
    assert all(c.regression for c in by_file.checks)
    assert not any(c.regression for c in by_mapping.checks)


def test_numbers_of_numpy_and_paths_in_a_mapping(tmp_path):
    write_mesh(block_mesh("QUAD4", "TRIA3"), tmp_path / "m.vtkhdf")
    solved = solve_case(
        CASE
        | {
            "mesh": {"file": tmp_path / "m.vtkhdf"},
            "materials": {"all": {"young": np.float64(2000), "poisson": np.float32(0.3)}},
            "steps": np.linspace(0.5, 1, 2),
            "observe": ({"zone": "interface", "nearest": np.array([0, 0])},),
        }
    )
    assert [step.factor for step in solved.solution.steps] == [0.5, 1.0]
    assert solved.pressure == pytest.approx(PRESSURE, rel=1e-13)


def test_a_mesh_of_a_file_in_place_of_the_cases_own(tmp_path):
    write_mesh(block_mesh("QUAD8", "QUAD8", (5, 4)), tmp_path / "m.vtkhdf")
    assert len(solve_case(CASE, tmp_path / "m.vtkhdf").pressure) == 5
    solved = solve_case(CASE | {"mesh": {"recipe": "blocks"}}, tmp_path / "m.vtkhdf")
    assert len(solved.pressure) == 5
    assert len(solved.provenance["mesh_sha256"]) == 64


def test_a_mesh_turned_inside_out_is_put_right():
    mesh = block_mesh("QUAD4", "QUAD4")
    cells = [(b.type, b.data[:, ::-1] if b.type == "quad" else b.data) for b in mesh.cells]
    solved = solve_case(CASE, meshio.Mesh(mesh.points, cells, cell_sets=mesh.cell_sets))
    assert solved.pressure == pytest.approx(PRESSURE, rel=1e-13)


def test_slave_and_master_exchanged_and_the_other_cut():
    mesh = block_mesh("QUAD4", "TRIA3")
    assert len(solve_case(CASE, mesh, swapped=True).pressure) == 2
    case = {k: v for k, v in CASE.items() if k != "plane"}
    case["supports"] = [
        {"group": g, "fix": [a]} for g, a in (("base", "z"), ("symx", "x"), ("symy", "y"))
    ]
    mesh = block_mesh("HEXA8", "HEXA8", (2, 1))
    cells = {
        cut: {b.type for b in solve_case(case, mesh, hexahedra=cut).solution.mesh.cells}
        for cut in ("pyramids", "hexahedra")
    }
    assert cells == {"pyramids": {"hexahedron", "pyramid"}, "hexahedra": {"hexahedron"}}


def test_everything_is_done_where_it_is_asked_for():
    mesh = block_mesh("QUAD8", "QUAD8")
    needed, everything = solve_case(CASE, mesh), solve_case(CASE, mesh, everything=True)
    assert "everything is done" not in [line.what for line in needed.solution.plan]
    assert everything.solution.plan[0].what == "everything is done"
    assert everything.pressure == pytest.approx(needed.pressure, rel=1e-12)


def test_a_failed_check_is_a_verdict_not_an_error():
    solved = patch(reference={"kind": "analytical", "contact_pressure": 26.0})
    assert (solved.verdict, solved.passed) == ("failed", False)
    assert "multiplier interface: 25 (macro-element" in solved.reason


def test_a_saved_result_is_that_of_the_command_line(tmp_path):
    solved = patch()
    solved.save(tmp_path / "r.vtkhdf")
    again = check(tmp_path / "r.vtkhdf")
    assert again.checks == solved.checks
    assert again.verdict == "passed"


def test_what_people_ask_first():
    solved = patch()
    side = np.ptp(solved.points[:, 0])
    np.testing.assert_allclose(np.abs(solved.contact_force), [0.0, side * PRESSURE], atol=1e-10)
    assert solved.contact_area == pytest.approx(side)
    table = solved.table
    assert list(table) == ["zone", "x", "y", "pressure", "gap", "closed", "area", "coverage"]
    np.testing.assert_array_equal(table["pressure"], solved.pressure)
    assert table["area"].sum() == pytest.approx(side)
    assert repr(solved).startswith("<Solved patch: passed, ")
    assert len(repr(solved)) < 120


def test_only_public_names_are_listed():
    import solver

    assert dir(solver) == sorted([*solver.__all__, "__version__"])


def test_pyvista_reads_what_was_solved():
    pytest.importorskip("pyvista", reason="PyVista is not installed")
    solved = patch()
    grid = solved.to_pyvista()
    assert grid.n_points == len(solved.points)
    pressure = grid.cell_data["pressure"]
    assert pressure[~np.isnan(pressure)].max() == pytest.approx(PRESSURE)


def test_pyvista_shows_the_pressure_on_slave_faces_alone(monkeypatch):
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")
    monkeypatch.setattr(pyvista.UnstructuredGrid, "plot", lambda grid, **options: (grid, options))
    solved = patch()
    grid, options = solved.plot(show_edges=True)
    assert not np.isnan(grid.cell_data["pressure"]).any()
    assert options["clim"] == (0.0, pytest.approx(PRESSURE))
    assert (options["scalars"], options["show_edges"]) == ("pressure", True)
    grid, options = solved.plot("displacement", clim=(0, 1))
    assert grid.n_points == len(solved.points)
    assert options["clim"] == (0, 1)


def test_figures_are_svg_and_a_notebook_shows_one():
    solved = patch()
    for figure in (solved.picture(), solved.profile(), solved.profile("x", zone="interface")):
        assert ET.fromstring(figure).tag.endswith("svg")
    assert "<svg" in solved._repr_html_()
    assert "patch: passed" in solved._repr_html_()
    with pytest.raises(ValueError, match="there is no contact zone seat"):
        solved.profile(zone="seat")
    with pytest.raises(InputError, match="profile: along = "):
        solved.profile("import os")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"materials": {"all": {"young": -1, "poisson": 0.3}}},
            "case: materials.all.young = -1: must be a positive number",
        ),
        (
            {"materials": {"all": {"young": float("nan"), "poisson": 0.3}}},
            "case: materials.all.young = 'NaN': must be a positive number",
        ),
        ({"load": []}, r"case: load = \[\]: unknown key; did you mean loads\?"),
        ({"supports": {3: "x"}}, "case: supports.3: keys must be text"),
        (
            {"loads": [{"group": "press", "pressure": lambda x: x}]},
            r"case: loads\[0\].pressure = .*: must be a number, text, true or false, a list or a m",
        ),
        ({"name": "\ud800"}, r"case: text = '\\ud800': must have characters that UTF-8 can write"),
        ({"name": "1e3"}, None),
    ],
)
def test_mappings_are_refused_as_files_are(changes, message):
    if message is None:  # text stays text, whatever it looks like
        assert patch(**changes).solution.case.name == changes["name"]
        return
    with pytest.raises(InputError, match=message):
        patch(**changes)


def test_a_mapping_and_the_file_it_would_be_are_refused_in_the_same_words(tmp_path):
    bad = CASE | {"mesh": {"recipe": "blocks"}, "contact": [{"slave": "a", "master": "a"}]}
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(bad))
    told = []
    for case in (bad, tmp_path / "c.yaml"):
        with pytest.raises(InputError) as refused:
            solve_case(case)
        told.append(refused.value.detail)
    assert told[0] == told[1]


def test_arguments_of_other_kinds():
    with pytest.raises(InputError, match="solve_case: case = 3: must be a path, a mapping or a C"):
        solve_case(3)
    with pytest.raises(InputError, match="solve_case: mesh = 3: must be a path or a "):
        solve_case(CASE, 3)
    with pytest.raises(InputError, match="hexahedra = 'cubes': allowed: pyramids, hexahedra"):
        solve_case(CASE, hexahedra="cubes")
