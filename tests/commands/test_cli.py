"""The command line: exit statuses, one clear line for bad input, and a verdict in every case."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import solver.verification.run
from solver.case.reader import load_case
from solver.commands.cli import main
from solver.lac.errors import SolveError

PLANE = """\
name: small
mesh:
  recipe: blocks
  size: 50.0
  bottom: {cells: QUAD4, divisions: 3}
  top: {cells: QUAD4, divisions: 2}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: symx, fix: [x]}
  - {group: base, fix: [y]}
loads: [{group: press, pressure: 25.0}]
contact: [{name: interface, slave: bottom_contact, master: top_contact}]
reference:
  kind: analytical
  contact_pressure: 25.0
  normal_stress: -25.0
  gap: 0.0
"""


@pytest.fixture
def small(tmp_path):
    """A folder with a small case; results go into `out`."""
    (tmp_path / "c.yaml").write_text(PLANE)
    return tmp_path


def solve(folder, *options, case="c.yaml"):
    """The exit status of a solve and its verdict."""
    out = folder / "out"
    arguments = ["solve", folder / case, "-o", out / "r.vtkhdf", "--verdict", out / "v.json"]
    status = main([*map(str, arguments), *options])
    return status, json.loads((out / "v.json").read_text())


def change(folder, old, new):
    assert PLANE.count(old) == 1
    (folder / "c.yaml").write_text(PLANE.replace(old, new))


def test_passed_is_0(small, capsys):
    status, verdict = solve(small)
    assert (status, verdict["verdict"], verdict["passed"]) == (0, "passed", True)
    assert (verdict["case"], verdict["result"]) == ("small", "r.vtkhdf")
    assert {"mesh", "solve", "checks", "write", "total"} <= verdict["seconds"].keys()
    assert verdict["stage_cpu_seconds"].keys() == verdict["seconds"].keys() - {"total"}
    assert verdict["matrix_entries"] > verdict["dofs"]
    assert verdict["macro_elements"] == 3
    assert (small / "out/r.vtkhdf").is_file()
    assert (
        capsys.readouterr().out.splitlines()[-1].startswith("small: passed, largest checked error ")
    )


def test_solve_prints_forces_without_round_off_and_the_initial_gap(small, capsys):
    """25 on a width of 50 in plane strain, ε_y = −25 · 0.91 / 2000, ε_x = 25 · 0.39 / 2000."""
    assert solve(small)[0] == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1:5] == [
        "load factor 1: 1 iteration, 3 closed, residual " + lines[1].rpartition(" ")[2],
        (
            "zone interface: pressure 25 to 25, contact area 50, force (0, -1250) on the slave, "
            "moment (0, 0, -31250)"
        ),
        "reaction of symx: force (0, 0), moment (0, 0, 0)",
        "reaction of base: force (0, 1250), moment (0, 0, 31250)",
    ]
    height, width = 100 * 25 * 0.91 / 2000, 50 * 25 * 0.39 / 2000
    strain = f"largest strain {height / 100:.3g}, strain energy {1250 * height / 2:.6g}"
    assert (
        lines[5]
        == f"largest displacement {(height**2 + width**2) ** 0.5:.6g} at (50, 50), {strain}"
    )
    change(small, "master: top_contact", "master: top_contact, interference: 0.25")
    solve(small)
    gap = "zone interface: initial gap -0.25 to -0.25, an overlap"
    assert gap in capsys.readouterr().out.splitlines()


def test_without_a_reference_a_solve_is_solved_with_0_and_not_passed(small, capsys):
    (small / "c.yaml").write_text(PLANE[: PLANE.index("reference:")])
    status, verdict = solve(small)
    assert (status, verdict["verdict"], verdict["passed"]) == (0, "solved", False)
    told = capsys.readouterr().out.splitlines()[-1]
    assert told == f"small: solved: {verdict['reason']}, pressure within 0.001 % (estimated)"
    assert main(["check", str(small / "out/r.vtkhdf")]) == 0


def test_a_failed_check_is_1_and_leaves_its_result(small):
    change(small, "contact_pressure: 25.0", "contact_pressure: 26.0")
    status, verdict = solve(small)
    assert (status, verdict["verdict"], verdict["passed"]) == (1, "failed", False)
    assert verdict["reason"].startswith("multiplier interface: 25")
    assert (small / "out/r.vtkhdf").is_file()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("young: 2000.0", "young: -1.0", "materials.all.young = -1.0: must be a positive number"),
        ("master: top_contact", "master: top_contakt", "did you mean top_contact?"),
        ("recipe: blocks", "file: no.msh", "mesh = {"),
        ("cells: QUAD4, divisions: 3", "cells: QUAD5, divisions: 3", "mesh.bottom.cells = 'QUAD5'"),
    ],
)
def test_refused_input_is_2_with_one_line(small, capsys, old, new, message):
    change(small, old, new)
    status, verdict = solve(small)
    assert (status, verdict["verdict"], verdict["passed"]) == (2, "refused", False)
    printed = capsys.readouterr().err
    assert message in printed
    assert printed == verdict["reason"] + "\n"
    assert printed.startswith(f"{small / 'c.yaml'}: ")
    assert [file.name for file in (small / "out").iterdir()] == ["v.json"]


def _raising(error):
    def simulate(*_, **__):
        raise error

    return simulate


def test_a_file_that_cannot_be_written_is_2_with_one_line(small, capsys, monkeypatch):
    monkeypatch.setattr(
        solver.verification.run, "solved", _raising(AssertionError("solved for nothing"))
    )
    for command in ("mesh", "solve"):
        output = small / "c.yaml" / "r.vtkhdf"
        assert main([command, str(small / "c.yaml"), "-o", str(output)]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_solve_that_fails_is_3_with_one_line(small, capsys, monkeypatch):
    monkeypatch.setattr(solver.verification.run, "solved", _raising(SolveError("no convergence")))
    status, verdict = solve(small)
    assert (status, verdict["verdict"], verdict["reason"]) == (3, "failed", "no convergence")
    assert capsys.readouterr().err == f"{small / 'c.yaml'}: no convergence\n"
    assert [file.name for file in (small / "out").iterdir()] == ["v.json"]


def test_a_bug_is_70_with_a_traceback(small, capsys, monkeypatch):
    monkeypatch.setattr(
        solver.verification.run, "solved", _raising(ZeroDivisionError("of\nnothing"))
    )
    status, verdict = solve(small)
    assert (status, verdict["verdict"]) == (70, "crashed")
    assert verdict["reason"] == "ZeroDivisionError: of nothing"
    assert "Traceback" in capsys.readouterr().err


def test_an_interruption_is_130_and_quiet(small, capsys, monkeypatch):
    monkeypatch.setattr(solver.verification.run, "solved", _raising(KeyboardInterrupt()))
    assert main(["solve", str(small / "c.yaml"), "-o", str(small / "r.vtkhdf")]) == 130
    assert capsys.readouterr() == ("", "")


def test_a_solve_without_a_file_prints_its_verdict_and_writes_nothing(small, capsys):
    before = sorted(small.rglob("*"))
    assert main(["solve", str(small / "c.yaml")]) == 0
    assert "passed, largest checked error" in capsys.readouterr().out
    assert sorted(small.rglob("*")) == before


def test_a_process_that_died_gets_its_verdict(small):
    (small / "log").write_text("started\nSegmentation fault\n\n")
    verdict = small / "v.json"
    arguments = ["crashed", str(small / "c.yaml"), "--swap", "--verdict", str(verdict)]
    assert main([*arguments, "--log", str(small / "log")]) == 0
    told = json.loads(verdict.read_text())
    assert (told["verdict"], told["reason"]) == ("crashed", "Segmentation fault")
    assert (told["case"], told["swapped"]) == ("small", True)
    (small / "c.yaml").write_text("[")
    assert main(arguments) == 0
    told = json.loads(verdict.read_text())
    assert (told["case"], told["reason"]) == ("c", "the process died without a word")


def test_mesh_is_written_once_for_both_directions(small):
    mesh = small / "m.vtkhdf"
    assert main(["mesh", str(small / "c.yaml"), "-o", str(mesh)]) == 0
    for options, slaves in ((), 3), (("--swap",), 2):
        status, verdict = solve(small, "--mesh", str(mesh), *options)
        assert (status, verdict["macro_elements"]) == (0, slaves)
    assert verdict["swapped"]
    assert "read" in verdict["seconds"]
    mesh.write_text("c.yaml: mesh.bottom: no such thing\n")
    status, verdict = solve(small, "--mesh", str(mesh))
    assert (status, verdict["verdict"]) == (2, "refused")
    assert "c.yaml: mesh.bottom: no such thing" in verdict["reason"]


def test_check_judges_a_stored_result_again(small, capsys):
    _, verdict = solve(small)
    capsys.readouterr()
    result = str(small / "out/r.vtkhdf")
    assert main(["check", result, result, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [again["checks"] for again in told] == [verdict["checks"]] * 2
    assert main(["check", result]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("small: passed")
    assert len(lines) == 1 + len(verdict["checks"])
    assert main(["check", str(small / "c.yaml")]) == 2
    assert "must be a result written by `solve`" in capsys.readouterr().err
    assert main(["check", str(small / "none.vtkhdf")]) == 2
    assert "none.vtkhdf: file: must be a result written by `solve` (there is no such file)" in (
        capsys.readouterr().err
    )


def test_a_result_is_named_as_what_it_is(small, capsys):
    allowed = {"mesh": "allowed: .vtkhdf, .med, .msh, .vtu, .inp", "solve": "must be .vtkhdf"}
    for command, said in allowed.items():
        output = small / "out.stl"
        assert main([command, str(small / "c.yaml"), "-o", str(output)]) == 2
        assert capsys.readouterr().err == f"{output}: extension = '.stl': {said}\n"
        assert not output.exists()


def test_accepted_values_are_written_below_the_current_folder_alone(small, capsys, monkeypatch):
    solve(small)
    result = str(small / "out/r.vtkhdf")
    (small / "elsewhere").mkdir()
    monkeypatch.chdir(small / "elsewhere")
    assert main(["accept", result]) == 2
    assert "case = '" in capsys.readouterr().err
    monkeypatch.chdir(small)
    (small / "regression").symlink_to(small.parent)
    assert main(["accept", result]) == 2
    (small / "regression").unlink()
    (small / "c.yaml").unlink()
    assert main(["accept", result]) == 2
    assert not (small / "regression").exists()


@pytest.mark.parametrize(
    ("old", "new", "status"),
    [
        ("plane: strain", "plane: strain\ntransform: {scale: 1.0e+300}", 2),
        ("plane: strain", "plane: strain\ntransform: {stretch: [1.0e+100, 1.0e+150]}", 2),
        ("plane: strain", "plane: strain\ntransform: {perturb: 1.0e+100}", 2),
        ("size: 50.0", "size: 1.0e+300", 2),
        ("divisions: 3", f"divisions: [{'9' * 200}, 2]", 2),
        ("pressure: 25.0}]", f"pressure: x{'.a' * 499}}}]", 2),
        ("pressure: 25.0}]", "pressure: 1.0e+300}]", 2),
        ("young: 2000.0", "young: 1.0e-300", 2),
    ],
)
def test_numbers_beyond_all_measure_end_in_one_line(small, old, new, status):
    """As a process of its own: NumPy's warnings are part of what it prints."""
    change(small, old, new)
    command = [sys.executable, "-m", "solver", "solve", small / "c.yaml", "-o", small / "r.vtkhdf"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, len(done.stderr.splitlines())) == (status, status == 2), done.stderr


def test_accept_shows_the_difference_and_check_holds_it(small, capsys, monkeypatch):
    monkeypatch.chdir(small)
    solve(small)
    result = str(small / "out/r.vtkhdf")
    capsys.readouterr()
    assert main(["accept", result]) == 0
    assert "multiplier interface: none → 25" in capsys.readouterr().out
    assert main(["accept", result]) == 0
    assert capsys.readouterr().out.startswith("small: 0 new accepted values of ")
    change(small, "pressure: 25.0}]", "pressure: 25.0001}]")
    status, verdict = solve(small)
    assert status == 1
    assert "accepted 25: change" in verdict["reason"]


def test_report_takes_the_verdicts_of_a_folder(small, capsys):
    solve(small)
    folder = small / "all" / "family" / "small"
    folder.mkdir(parents=True)
    (small / "out/v.json").rename(folder / "verdict.json")
    (small / "out/r.vtkhdf").rename(folder / "r.vtkhdf")
    assert main(["report", str(small / "all"), "-o", str(small / "report")]) == 0
    (told,) = json.loads((small / "report" / "summary.json").read_text())
    assert (told["case"], told["passed"]) == ("small", True)
    capsys.readouterr()
    assert main(["report", str(small / "out"), "-o", str(small / "none")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_new_writes_a_case_that_is_valid_and_passes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "mine"]) == 0
    assert load_case("mine.yaml").name == "mine"
    assert main(["validate", "--mesh", "mine.yaml"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "mine.yaml: valid"
    status, verdict = solve(tmp_path, case="mine.yaml")
    assert (status, verdict["reason"]) == (0, "")
    assert main(["new", "mine"]) == 2
    assert capsys.readouterr().err == "mine.yaml: file: is there already; choose another with -o\n"
    assert main(["new"]) == main(["new", "-o", "yours.yaml"]) == 0
    assert [load_case(f"{name}.yaml").name for name in ("new-case", "yours")] == [
        "new-case",
        "yours",
    ]
    assert main(["new", "../mine", "-o", "x.yaml"]) == 2
    assert not Path("x.yaml").exists()


def test_quiet_prints_nothing(small, capsys):
    assert solve(small, "--quiet")[0] == 0
    assert capsys.readouterr() == ("", "")


def test_threads_yield_to_the_environment(small, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    for name in ("OPENBLAS_NUM_THREADS",):
        monkeypatch.setenv(name, "")  # so that what the command sets goes with the test
        monkeypatch.delenv(name)
    assert solve(small, "--threads", "1")[0] == 0
    assert os.environ["OMP_NUM_THREADS"] == "2"
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from solver.commands.cli import main\n"
        "try: main(['solve', '--help'])\n"
        "except SystemExit: pass\n"
        "print(sorted({'numpy', 'yaml', 'meshio', 'gmsh', 'skfem', 'h5py'} & set(sys.modules)))"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_a_plane_solve_imports_little(small):
    unused = {"gmsh", "numba", "pyamg", "scipy.optimize"}
    assert main(["mesh", str(small / "c.yaml"), "-o", str(small / "m.vtkhdf")]) == 0
    command = f"solve {small}/c.yaml --mesh {small}/m.vtkhdf -o {small}/r.vtkhdf --quiet".split()
    code = (
        "import sys; from solver.commands.cli import main\n"
        f"sys.argv[1:] = {command}\n"
        f"print(main(), sorted({unused} & sys.modules.keys()), 'scipy.sparse' in sys.modules)"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    )
    assert done.stdout == "0 [] True\n"


def test_commands_of_one_case_take_its_name(tmp_path, capsys):
    assert main(["export", "ssnp170-a", "--code", "plain", "-o", str(tmp_path / "deck")]) == 0
    assert (tmp_path / "deck" / "deck.json").is_file()
    assert main(["converge", "ssnp170-e-swapped"]) == 2
    assert "'ssnp170-e-swapped': name the case, and add --swap" in capsys.readouterr().err
    assert main(["converge", "manufactured-quad4", "--levels", "1", "2"]) == 2
    assert main(["expect", "no-such-case"]) == 2
    assert "no such case" in capsys.readouterr().err
