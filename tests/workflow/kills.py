"""Kill meshing, solving, reporting and whole batches at random moments, and see all recover.

`python -m tests.workflow.kills --count 100` strikes in a temporary copy of the project with tiny
cases. After each kill every file under a final name has to be whole; then the same is run again,
and all that it leaves has to equal an undisturbed run's, times aside.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import h5py

from tests.arguments import whole
from tests.workflow.projects import SNAKEMAKE, new_project, without_times

PYTHON = [sys.executable, "-m"]
CASE, FOLDER = "cases/tiny/tiny-a.yaml", "results/tiny/tiny-a"
MESH = "results/meshes/tiny/tiny-a/mesh.vtkhdf"
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
PATIENCE = 120


@dataclass(frozen=True)
class Target:
    """What is started, what of its outputs goes before, and which of its processes are struck."""

    command: list[str]
    outputs: tuple[str, ...]
    struck: str = "all"


SOLVER = [*PYTHON, "solver"]
SOLVE = ["--mesh", MESH, "--verbose", "-o", f"{FOLDER}/result.vtkhdf"]
PICTURES = ["--pictures", "results/report/pictures"]
TARGETS = {
    "mesh": Target([*SOLVER, "mesh", CASE, "-o", MESH], ("meshes/tiny/tiny-a/mesh.vtkhdf",)),
    "solve": Target(
        [*SOLVER, "solve", CASE, *SOLVE, "--verdict", f"{FOLDER}/verdict.json", *PICTURES],
        ("tiny/tiny-a/result.vtkhdf", "tiny/tiny-a/verdict.json"),
    ),
    "report": Target([*SOLVER, "report", "-o", "results/report"], ("report/summary.*",)),
    "batch": Target(SNAKEMAKE, ("*",)),
    "batch's snakemake": Target(SNAKEMAKE, ("*",), struck="first"),
    "batch's server": Target(SNAKEMAKE, ("*",), struck="server"),
    "batch's job": Target(SNAKEMAKE, ("*",), struck="job"),
}

SINGLE = ["mesh", "solve", "report"]
PARTS = ["batch", "batch's snakemake", "batch's server", "batch's job"]
MIXTURE = [name for part in PARTS for name in (*SINGLE, part)]


class Harness:
    """A project that was run undisturbed, what came of it, and how long each target takes."""

    def __init__(self, folder, targets):
        self.project = new_project(folder)
        (self.project / "cases" / "tiny" / "tiny-b.yaml").unlink()  # a small batch, often
        batch = self.run(TARGETS["batch"])
        self.expected = self.state()
        self.targets = {name: TARGETS[name] for name in targets}
        self.duration = {
            name: batch if target.command is SNAKEMAKE else self.run(target)
            for name, target in self.targets.items()
        }

    def run(self, target):
        """Run a target undisturbed, from nothing; the seconds it takes."""
        self.clear(target)
        started = time.monotonic()
        self.wait(self.start(target))
        return time.monotonic() - started

    def clear(self, target):
        for pattern in target.outputs:
            for path in (self.project / "results").glob(pattern):
                shutil.rmtree(path) if path.is_dir() else path.unlink()

    def start(self, target):
        with (self.project.parent / "output").open("w") as output:
            return subprocess.Popen(
                target.command,
                cwd=self.project,
                # As Snakemake has it for its jobs: with one thread results agree to the bit.
                env={**os.environ, "OMP_NUM_THREADS": "1"},
                stdout=output,
                stderr=output,
                start_new_session=True,
            )

    def wait(self, process):
        if process.wait(PATIENCE) != 0:
            raise AssertionError((self.project.parent / "output").read_text())

    def state(self):
        """All that a batch leaves and that no clock changes."""
        results = self.project / "results"
        files = [*results.glob("tiny/*/verdict.json"), results / "report" / "summary.json"]
        told = {
            str(f.relative_to(results)): without_times(json.loads(f.read_text())) for f in files
        }
        for mesh in results.glob("meshes/tiny/*/mesh.vtkhdf"):
            told[mesh.parent.name] = hashlib.sha256(mesh.read_bytes()).hexdigest()
        return told

    def strike(self, name, number, moment):
        """Start a target, send the signal after that share of its time; None where it was over."""
        target = self.targets[name]
        self.clear(target)
        process = self.start(target)
        time.sleep(moment * self.duration[name])
        victims = _victims(process.pid, target.struck)
        hit = [victim for victim in victims if _kill(victim, number)]
        broken = self.broken()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            broken.append("it hangs")
        if not hit:
            return None
        broken += self.broken()
        if broken:
            return f"not whole: {', '.join(broken)}"
        try:
            self.wait(self.start(target))
        except AssertionError as error:
            return f"the next run fails: {error}"
        return "" if self.state() == self.expected else "the next run's results differ"

    def broken(self):
        """Files under a final name that do not open; those removed meanwhile do no harm."""
        found = []
        for path in (self.project / "results").rglob("[!.]*"):
            try:
                if not _is_whole(path):
                    found.append(str(path))
            except FileNotFoundError:
                continue
        return found


def _is_whole(path):
    if path.suffix == ".json":
        try:
            json.loads(path.read_text())
        except ValueError:
            return False
    elif path.suffix == ".vtkhdf":
        try:
            with h5py.File(path) as file:
                file.visititems(
                    lambda _, item: item[()] if isinstance(item, h5py.Dataset) else None
                )
        except OSError:
            return not path.exists()
    elif path.suffix in {".html", ".svg", ".xml"}:
        return path.read_text().rstrip().endswith(">")
    return True


def _victims(first, struck):
    if struck == "first":
        return [first]
    session = [process for process in _processes() if _session(process) == first]
    forks = [p for p in session if any("solver/__main__" in part for part in _command(p))]
    return {"server": forks[:1], "job": forks[-1:], "all": session}[struck]


def _processes():
    return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]


def _session(process):
    try:
        return os.getsid(process)
    except ProcessLookupError:
        return None


def _command(process):
    try:
        return Path(f"/proc/{process}/cmdline").read_text().split("\0")
    except OSError:
        return []


def _kill(process, number):
    """Whether there was a process to kill: not one that has ended but was not waited for."""
    try:
        if Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
            return False
        os.kill(process, number)
    except OSError:
        return False
    return True


def kill_at_random(folder, count, seed, targets, log=print):
    """Strike `count` times, the targets in turn; the failures, and the strikes of each kind."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
    chance, harness = random.Random(seed), Harness(folder, targets)
    failures, struck = [], Counter()
    while struck.total() < count:
        name = targets[struck.total() % len(targets)]
        number, moment = chance.choice(SIGNALS), chance.random()
        outcome = harness.strike(name, number, moment)
        if outcome is None:
            continue
        struck[name, number.name] += 1
        where = f"{name}, {number.name} after {moment:.0%} of its time"
        log(f"{struck.total()}/{count}: {where}: {outcome or 'recovered'}")
        if outcome:
            failures.append(f"{where}: {outcome}")
    return failures, struck


def main():
    """Strike as often as the command line says; status 1 where something did not recover."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", default="100")
    parser.add_argument("--seed", default="0")
    options = parser.parse_args()
    count, seed = whole("--count", options.count), whole("--seed", options.seed, 0)
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "project"
        failures, struck = kill_at_random(project, count, seed, MIXTURE)
    for (name, number), times in sorted(struck.items()):
        print(f"{name}, {number}: {times}")
    print(f"{struck.total() - len(failures)} of {struck.total()} kills recovered.")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
