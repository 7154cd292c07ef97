"""The warm process and its client: the same command, whichever process runs it."""

import os
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from solver.commands.warm import request, words

ROOT = Path(__file__).parents[2]
# In each process that runs a command: what it found, and how some of them end.
FAULTS = """\
import os, sys, time
print("warm" if "skfem" in sys.modules else "cold", flush=True)
if "killed.yaml" in sys.argv:
    os.kill(os.getpid(), 9)
if "waits.yaml" in sys.argv and "skfem" in sys.modules:
    while not os.path.exists("go"):
        time.sleep(0.01)
    print("first ended", flush=True)
"""
PACKAGES = {"solver", "numpy", "scipy", "skfem", "meshio", "h5py", "gmsh", "jsonschema", "jinja2"}
CLIENT = [sys.executable, "-IS", "solver/commands/warm.py", "benchmark"]
ONE_THREAD = {**os.environ, "OMP_NUM_THREADS": "1"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the solver in it and a case."""
    folder = tmp_path_factory.mktemp("warm")
    shutil.copytree(ROOT / "solver", folder / "solver")
    subprocess.run([sys.executable, "-m", "solver", "new", "good"], cwd=folder, check=True)
    main = folder / "solver" / "__main__.py"
    main.write_text(FAULTS + main.read_text())
    return folder


def start(folder, place):
    """A server's process; it listens at `place` in the folder."""
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(folder / place))
        listener.listen()
        return subprocess.Popen(
            [sys.executable, "-m", "solver", "serve", str(listener.fileno())],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            pass_fds=[listener.fileno()],
            env=ONE_THREAD,
        )


@pytest.fixture(scope="module")
def server(folder):
    server = start(folder, "place")
    yield server
    server.communicate(timeout=60)


def client(folder, *command, place="place", threads="1"):
    """The finished client of a command; its standard output begins with what its process found."""
    return subprocess.run(
        [*CLIENT, *command],
        cwd=folder,
        env={**ONE_THREAD, "OMP_NUM_THREADS": threads, "WARM_SOLVER": place},
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_a_command_is_the_same_warm_and_cold(folder, server):
    warm = client(folder, "validate", "good.yaml", "none.yaml")
    cold = client(folder, "validate", "good.yaml", "none.yaml", place="nowhere")
    assert warm.stdout.startswith("warm")
    assert cold.stdout.startswith("cold")
    assert warm.returncode == cold.returncode == 2
    assert warm.stdout.splitlines()[1:] == cold.stdout.splitlines()[1:] == ["good.yaml: valid"]
    assert warm.stderr == cold.stderr
    assert "none.yaml" in warm.stderr


def test_options_that_are_wrong_are_refused_as_ever(folder, server):
    refused = client(folder, "solve", "--sideways")
    assert refused.returncode == 2
    assert "usage: python -m solver" in refused.stderr


def test_the_death_of_one_command_is_its_own(folder, server):
    dead = client(folder, "validate", "killed.yaml")
    assert dead.stdout.startswith("warm")
    assert dead.returncode == 128 + signal.SIGKILL
    assert client(folder, "validate", "killed.yaml", place="nowhere").returncode == dead.returncode
    assert client(folder, "validate", "good.yaml").returncode == 0


def test_another_number_of_threads_needs_another_process(folder, server):
    done = client(folder, "validate", "good.yaml", threads="2")
    assert done.returncode == 0
    assert done.stdout.startswith("cold")


def test_a_solve_tells_its_own_command_and_what_it_took(folder, server):
    solved = client(folder, "solve", "good.yaml", "-o", "good.vtkhdf")
    assert solved.stdout.startswith("warm")
    assert solved.returncode == 0, solved.stderr
    text = (folder / "good.vtkhdf").read_bytes()
    assert b"python -m solver solve good.yaml -o good.vtkhdf" in text
    names, values = ((folder / "benchmark").read_text()).splitlines()
    took = dict(zip(names.split("\t"), values.split("\t"), strict=True))
    assert 0 < float(took["cpu_seconds"]) < 60
    assert 50 < float(took["peak_memory_mb"]) < 5000
    assert float(took["seconds"]) > 0


def test_a_fork_has_all_that_it_needs(folder):
    script = """
import sys
from solver.commands.cli import main
from solver.commands.server import load
load()
before = set(sys.modules)
for command in (
    "mesh good.yaml -o m.vtkhdf",
    "solve good.yaml --mesh m.vtkhdf -o all/f/a/r.vtkhdf --verdict all/f/a/verdict.json",
    "report all -o report",
):
    assert main(command.split()) == 0, command
print(*(set(sys.modules) - before))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=True
    )
    late = set(done.stdout.splitlines()[-1].split())
    assert {name for name in late if name.partition(".")[0] in PACKAGES} == set()


def test_a_server_that_hangs_is_given_up_by_all(folder):
    source = folder / "solver" / "commands" / "warm.py"
    text = source.read_text()
    assert "PATIENCE = 30.0" in text
    server = start(folder, "stopped")
    try:
        assert client(folder, "validate", "good.yaml", place="stopped").stdout.startswith("warm")
        server.send_signal(signal.SIGSTOP)
        source.write_text(text.replace("PATIENCE = 30.0", "PATIENCE = 1.0"))
        done = client(folder, "validate", "good.yaml", place="stopped")
    finally:
        source.write_text(text)
        server.kill()
        server.communicate()
    assert (done.returncode, done.stdout) == (0, "cold\ngood.yaml: valid\n")
    assert not (folder / "stopped").exists()


def test_the_server_ends_with_whoever_began_it_and_its_forks_come_to_their_end(folder):
    server = start(folder, "last")
    running = subprocess.Popen(
        [*CLIENT, "solve", "good.yaml", "-o", "last.vtkhdf"],
        cwd=folder,
        env={**ONE_THREAD, "WARM_SOLVER": "last"},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert running.stdout.readline() == "warm\n"
    server.communicate(timeout=60)
    assert server.returncode == 0
    assert running.wait(60) == 0
    assert (folder / "last.vtkhdf").is_file()
    assert client(folder, "validate", "good.yaml", place="last").stdout.startswith("cold")


def test_a_client_whose_server_is_killed_waits_for_its_command_and_runs_it_again(folder):
    server = start(folder, "struck")
    waits = [*CLIENT, "validate", "waits.yaml"]
    running = subprocess.Popen(
        waits,
        cwd=folder,
        env={**ONE_THREAD, "WARM_SOLVER": "struck"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert running.stdout.readline() == "warm\n"
    server.kill()
    server.communicate()
    # Another client finds nobody, at once: no fork listens in place of its server.
    assert client(folder, "validate", "good.yaml", place="struck").stdout.startswith("cold")
    assert running.poll() is None
    (folder / "go").touch()
    assert running.communicate(timeout=60)[0].splitlines()[0] == "first ended"
    assert running.returncode == 2


def test_a_command_too_long_for_a_message_runs_in_a_process_of_its_own(folder, server):
    many = ["./" * 500 + "good.yaml"] * 80
    done = client(folder, "validate", *many)
    assert done.returncode == 0
    assert done.stdout.splitlines() == ["cold", *["good.yaml: valid"] * 80]


def test_a_message_that_was_cut_off_is_no_command():
    message = request("1", ["report", "a b", ""])
    assert words(message, "1") == ["report", "a b", ""]
    assert words(message, "2") == []
    assert [words(message[:end], "1") for end in range(len(message))] == [[]] * len(message)
