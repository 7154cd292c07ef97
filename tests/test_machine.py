"""A machine that fails: one clear line, the status as documented, nothing under a final name."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

from solver.case.reader import load_case
from solver.commands.cli import main
from solver.mesh.size import Size, check_memory
from solver.system.errors import MachineError
from solver.system.files import replacing
from solver.system.process import available, peak_mb
from solver.system.progress import report_outcomes
from solver.verification.run import mesh_of
from tests.machine import obeying_permissions, small_disk
from tests.workflow.projects import CASE, ROOT, without_times

GIGABYTE = 1e9


@pytest.fixture
def case(tmp_path):
    """A small case in a folder of its own."""
    path = tmp_path / "small.yaml"
    path.write_text(CASE.format(name="small", directions="first", pressure=25.0))
    return path


def solve(case, folder, *options):
    """The command line of a solve with its verdict, into `folder`."""
    outputs = ["-o", folder / "r.vtkhdf", "--verdict", folder / "v.json"]
    return ["solve", *map(str, [case, *outputs, *options])]


def run(arguments, **settings):
    """A finished process of the solver that obeys permissions."""
    command = obeying_permissions([sys.executable, "-m", "solver", *arguments])
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, **settings)


def test_a_full_disk_is_2_with_one_line_and_leaves_nothing(case, tmp_path, capsys):
    out = tmp_path / "out"
    with small_disk(out, 12):
        assert main(solve(case, out)) == 2
        verdict = json.loads((out / "v.json").read_text())
        assert (verdict["verdict"], verdict["transient"]) == ("refused", True)
        line = f"{out / 'r.vtkhdf'}: No space left on device"
        assert verdict["reason"] == line
        assert capsys.readouterr().err == line + "\n"
        assert [file.name for file in out.iterdir()] == ["v.json"]
        (out / "fill").write_bytes(bytes(4 << 10))
        assert main(["mesh", str(case), "-o", str(out / "m.vtkhdf")]) == 2
        assert capsys.readouterr().err == f"{out / 'm.vtkhdf'}: No space left on device\n"
        assert not (out / "m.vtkhdf").exists()
    assert main(solve(case, out)) == 0


@pytest.mark.parametrize("suffix", [".vtkhdf", ".msh", ".MSH", ".med", ".vtu", ".inp"])
def test_a_full_disk_leaves_no_part_of_a_mesh(case, tmp_path, suffix, capsys):
    file = tmp_path / "out" / f"m{suffix}"
    with small_disk(file.parent, 4):
        (file.parent / "fill").write_bytes(bytes(3 << 10))
        assert main(["mesh", str(case), "-o", str(file)]) == 2
        assert capsys.readouterr().err == f"{file}: No space left on device\n"
        assert [left.name for left in file.parent.iterdir()] == ["fill"]


def test_pictures_that_cannot_be_kept_are_named(case, tmp_path, capsys):
    out = tmp_path / "out"
    with small_disk(out, 4):
        (out / "fill").write_bytes(bytes(4 << 10))
        drawn = ["-o", str(tmp_path / "r.vtkhdf"), "--pictures", str(out)]
        assert main(["solve", str(case), *drawn]) == 0
        assert re.search(
            f"^no pictures: {out}/.*No space left", capsys.readouterr().out, re.MULTILINE
        )
    assert main(["solve", str(case), *drawn[2:]]) == 2
    assert capsys.readouterr().err == f"--pictures: folder = '{out}': needs a result: add -o\n"


def test_a_folder_or_mesh_without_permission_is_2_with_one_line(case, tmp_path):
    mesh, out = tmp_path / "m.vtkhdf", tmp_path / "out"
    assert main(["mesh", str(case), "-o", str(mesh)]) == 0
    out.mkdir(mode=0o555)
    refused = run(solve(case, out))
    assert refused.returncode == 2
    assert refused.stderr == f"{out / 'v.json'}: Permission denied\n"
    assert list(out.iterdir()) == []
    refused = run(["mesh", str(case), "-o", str(out / "m.msh")])
    assert refused.stderr == f"{out / 'm.msh'}: Permission denied\n"
    out.chmod(0o755)
    mesh.chmod(0)
    refused = run(solve(case, out, "--mesh", mesh))
    assert refused.returncode == 2
    assert "Permission denied" in refused.stderr
    assert len(refused.stderr.splitlines()) == 1
    assert [file.name for file in out.iterdir()] == ["v.json"]
    mesh.chmod(0o644)
    assert main(solve(case, out, "--mesh", mesh)) == 0


@pytest.mark.parametrize("command", ["solve", "list"])
def test_without_a_reader_nothing_is_said_to_have_ended_well(case, tmp_path, command):
    arguments = solve(case, tmp_path) if command == "solve" else ["list"]
    program = [sys.executable, "-m", "solver", *arguments]
    ours, theirs = os.pipe()
    os.close(ours)
    with os.fdopen(theirs, "w") as nobody:
        ended = subprocess.run(program, cwd=ROOT, stdout=nobody, stderr=subprocess.PIPE, text=True)
    assert (ended.returncode, ended.stderr) == (-signal.SIGPIPE, "")
    assert [file.name for file in tmp_path.iterdir()] == [case.name]


def test_a_mesh_that_vanished_is_2_and_back_again_is_solved(case, tmp_path, capsys):
    mesh = tmp_path / "m.vtkhdf"
    assert main(solve(case, tmp_path, "--mesh", mesh)) == 2
    assert capsys.readouterr().err == f"{mesh}: mesh: no such file\n"
    assert main(["mesh", str(case), "-o", str(mesh)]) == 0
    assert main(solve(case, tmp_path, "--mesh", mesh)) == 0


def test_what_a_dead_process_left_is_written_over(tmp_path):
    with replacing(tmp_path / "a.json") as first:
        first.write_text("{}")
    first.write_text("{")
    with replacing(tmp_path / "a.json") as temporary:
        temporary.write_text("[]")
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]


def test_a_mesh_that_no_solve_could_use_is_not_made(case):
    case.write_text(case.read_text().replace("divisions: [2, 2]", "divisions: [90000, 90000]"))
    with pytest.raises(MachineError, match=r"memory = '1\d{10} unknowns': needs at least"):
        mesh_of(load_case(case))


def test_peak_memory_is_told_in_megabytes():
    assert peak_mb(SimpleNamespace(ru_maxrss=1_000_000)) == 1024


def test_memory_needed_is_below_what_was_measured():
    for unknowns, measured in ((104_544, 0.50), (516_360, 1.22)):
        need = Size(unknowns // 3, 3).memory
        assert need.least < measured * GIGABYTE
        assert need.usual == pytest.approx(measured * GIGABYTE, rel=0.1)
    smallest = Size(1_044_690 // 3, 3).memory  # with a stiffness in single precision
    assert smallest.least < 0.9 * 1.76 * GIGABYTE


def test_what_cannot_fit_is_refused_and_what_may_not_is_warned_of():
    told = []
    with report_outcomes(told.append), pytest.raises(MachineError) as refused:
        check_memory(2_200_000, 3, "big.yaml", free=7 * GIGABYTE)
    line = str(refused.value)
    assert line.startswith("big.yaml: memory = '6600000 unknowns': needs at least 7.4 GB, 7 GB are")
    assert "coarser mesh" in line
    assert "--no-memory-check" in line
    assert told == []
    with report_outcomes(told.append):
        check_memory(1_000_000, 3, "big.yaml", free=5 * GIGABYTE)
        check_memory(1_000_000, 2, "big.yaml", free=8 * GIGABYTE)
    assert told == ["memory may run out: about 5.7 GB of 5 GB free"]


def test_the_memory_there_is_heeds_the_limit_of_the_process():
    assert 0 < available() < 1e15
    asked = "from solver.system.process import available; print(available())"
    limited = subprocess.run(
        [sys.executable, "-c", asked],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (10**9, 10**9)),
    )
    assert 0 < float(limited.stdout) < 10**9


LIMITED = """
import resource, sys
from pathlib import Path
from solver.case.reader import load_case
from solver.commands.cli import main

main(["solve", sys.argv[1], "-o", sys.argv[1] + ".vtkhdf", "--quiet"])
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 60_000_000,) * 2)
sys.exit(main(sys.argv[2:]))
"""


def test_a_solve_without_enough_memory_is_refused_or_ends_with_its_reason(case, tmp_path):
    case.write_text(case.read_text().replace("divisions: [2, 2]", "divisions: [200, 200]"))
    small = tmp_path / "warm.yaml"
    small.write_text(CASE.format(name="warm", directions="first", pressure=25.0))

    def limited(*options):
        # The limit comes when the libraries are loaded, whatever these take on this machine.
        command = [sys.executable, "-c", LIMITED, str(small), *solve(case, tmp_path, *options)]
        done = subprocess.run(
            command,
            cwd=ROOT,
            capture_output=True,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        assert not (tmp_path / "r.vtkhdf").exists()
        return done.returncode, done.stderr, json.loads((tmp_path / "v.json").read_text())

    status, line, verdict = limited()
    assert (status, verdict["verdict"], verdict["transient"]) == (2, "refused", True)
    assert "unknowns': needs at least 0.2" in line
    status, line, verdict = limited("--no-memory-check")
    assert (status, verdict["verdict"], verdict["transient"]) == (3, "crashed", True)
    assert line.startswith("out of memory: ")
    assert len(line.splitlines()) == 1


def test_meshing_has_a_time_limit(case, tmp_path):
    """Nothing interrupts gmsh: the process is ended, and the batch says why."""
    endless = (
        "import sys, time; from solver.verification import run; run.MESHING_SECONDS = 1\n"
        "run.generate = lambda *_: time.sleep(60)\n"
        "from solver.commands.cli import main; main(sys.argv[1:])"
    )
    command = [sys.executable, "-c", endless, "mesh", case, "-o", tmp_path / "m.vtkhdf"]
    done = subprocess.run(list(map(str, command)), cwd=ROOT, capture_output=True, timeout=30)
    assert done.returncode == -signal.SIGALRM
    verdict = tmp_path / "v.json"
    crashed = ["crashed", case, "--status", str(128 + signal.SIGALRM), "--verdict", verdict]
    subprocess.run([sys.executable, "-m", "solver", *map(str, crashed)], cwd=ROOT, check=True)
    assert "meshing took longer than 1800 s" in json.loads(verdict.read_text())["reason"]


def test_the_numbers_are_the_same_on_every_run(tmp_path):
    """Bit for bit with one thread, to 1e-13 with two."""
    space = CASE.replace("QUAD4", "HEXA8").replace("plane: strain\n", "")
    space = space.replace("[2, 2]", "[7, 7, 7]").replace("[3, 2]", "[6, 6, 6]")
    space = space.replace("{{group: base", "{{group: symy, fix: [y]}}, {{group: base")
    for name, text in (("plane", CASE), ("space", space.replace("fix: [y]}}]", "fix: [z]}}]"))):
        path = tmp_path / f"{name}.yaml"
        path.write_text(text.format(name=name, directions="first", pressure=25.0))
        first, again = (numbers_of(path, tmp_path / f"{name}{i}", 1) for i in range(2))
        assert first == again
        several = numbers_of(path, tmp_path / f"{name}-2", 2)
        assert several == pytest.approx(first, rel=1e-13, abs=1e-13 * 25)


def numbers_of(case, folder, threads):
    """All numbers of a solve's fields, in a new process with so many threads."""
    import h5py

    environment = os.environ | {"OMP_NUM_THREADS": str(threads)}
    done = run(solve(case, folder), env=environment)
    assert done.returncode == 0, done.stderr
    told = without_times(json.loads((folder / "v.json").read_text()))
    assert told["provenance"]["threads"] == str(threads)
    assert told["provenance"]["command"].startswith(f"python -m solver solve {case} -o {folder}")
    with h5py.File(folder / "r.vtkhdf") as file:
        fields = [file["VTKHDF/PointData"][key][()] for key in ("displacement", "stress")]
        fields += [file["contact/interface"][key][()] for key in ("multiplier", "gap")]
    return [number for field in fields for number in field.ravel().tolist()]


def test_texts_are_utf_8_whatever_the_terminal_has():
    settings = {**os.environ, "PYTHONIOENCODING": "ascii"}
    program = [sys.executable, "-m", "solver", "list"]
    told = subprocess.run(program, cwd=ROOT, env=settings, capture_output=True, check=True)
    assert "é" in told.stdout.decode()


def test_a_link_to_itself_is_no_file_and_no_folder(case, tmp_path, capsys):
    link, new = tmp_path / "loop", str(tmp_path / "new")
    link.symlink_to(link)
    (tmp_path / "d.inp").write_text("*INCLUDE, INPUT=loop\n")
    commands = {
        "init": ["init", str(link)],
        "code": ["export", str(case), "--code", str(link), "-o", new],
        "cases": ["list", "--cases", str(link)],
        "include": ["inspect", str(tmp_path / "d.inp")],
    }
    for name, command in commands.items():
        assert main(command) == 2, name
        assert len(capsys.readouterr().err.splitlines()) == 1
