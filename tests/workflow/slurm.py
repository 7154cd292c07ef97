"""The batch on a cluster: six solves through Snakemake's SLURM executor, compared with a local run.

One case is wrong on purpose. One job is cancelled each time it runs: the run has to name it, its
case has to be `crashed` in a report, and the next run has to do that one alone. The cluster is this
machine, and is gone at the end, whatever happens.
"""

import argparse
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from tests.workflow.cluster import Cluster, missing
from tests.workflow.projects import ROOT, copy_program, summary

CASES = ("a", "e", "k", "z7")  # both directions of e; two in space
WRONG = ("ssnp170-a", "ssnp170-wrong"), ("contact_pressure: 25.0", "contact_pressure: 26.0")
CANCELLED = "ssnp170-k"
# So short that the plugin's own waiting, which grows by 10 s a time, is most of what is left.
CLUSTER = ("--workflow-profile", "workflow/profiles/slurm", "--latency-wait", "10")
CLUSTER += (
    "--slurm-init-seconds-before-status-checks",
    "1",
    "--seconds-between-status-checks",
    "1",
)
KILLED = "CANCELLED"
OUTCOME = ("verdict", "direction", "dofs", "macro_elements", "iterations", "linear_solver")
JOBS = "%i|%k|%T|%m|%l|%M"  # of squeue: number, comment, state, memory, time asked for, time taken


def new_project(folder):
    """A copy of the project with six solves."""
    copy_program(folder)
    family = folder / "cases" / "ssnp170"
    family.mkdir(parents=True)
    for name in ("family", *CASES):
        shutil.copy(ROOT / "cases" / "ssnp170" / f"{name}.yaml", family)
    text = (family / "a.yaml").read_text()
    for true, false in WRONG:
        text = text.replace(true, false)
    (family / "wrong.yaml").write_text(text)
    return folder


def run(project, *options, environment=None):
    """What Snakemake prints in a run that ends, as it must here, with a case that does not pass."""
    command = [sys.executable, "-m", "snakemake", "all_cases", *options]
    done = subprocess.run(
        command,
        cwd=project,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
    )
    expect(done.returncode == 1, done.stdout)
    return done.stdout


def expect(true, otherwise):
    """Like assert, in a program."""
    if not true:
        raise RuntimeError(otherwise)


def compare(told, expected):
    """Compare a verdict with the local run's, with one thread each: to the last digit."""
    for key in OUTCOME:
        expect(told[key] == expected[key], f"{key}: {told[key]}, without a cluster {expected[key]}")
    largest = 0.0
    for ours, theirs in zip(told["checks"], expected["checks"], strict=True):
        for key in ("name", "zone", "passed", "reference", "tolerance"):
            expect(ours[key] == theirs[key], f"{ours}, without a cluster {theirs}")
        scales = {"minimum": ours["scale"], "maximum": ours["scale"], "error": 1.0}
        largest = max(largest, *(abs(ours[k] - theirs[k]) / s for k, s in scales.items()))
    expect(largest == 0.0, f"{told['job']}: values differ by {largest:.1e} from the local run's")


def cancel(cluster, name, stop):
    """Cancel each job that solves the case of this name as soon as it runs, until told to stop."""
    while not stop.wait(0.5):
        for number, comment, state, *_ in jobs(cluster):
            if state == "RUNNING" and comment.endswith(name) and "solve" in comment:
                cluster.ask("scancel", number)


def jobs(cluster):
    """All jobs of this cluster, one list of fields each."""
    told = cluster.ask("squeue", "--states=all", "--noheader", f"--format={JOBS}")
    return sorted((line.split("|") for line in told.splitlines()), key=lambda job: int(job[0]))


def try_cluster(cluster, project, expected):
    """The whole trial; what SLURM did, as the lines of a table."""
    stop = threading.Event()
    canceller = threading.Thread(target=cancel, args=(cluster, CANCELLED, stop))
    canceller.start()
    try:
        said = run(project, *CLUSTER, environment=cluster.environment)
    finally:
        stop.set()
        canceller.join()
    expect(re.search(f"failed, SLURM status is: '{KILLED}'", said), said)
    report = ["report", "--run", ".snakemake/run-list", "-o", "results/report"]
    subprocess.run([sys.executable, "-m", "solver", *report], cwd=project, check=False)
    told = summary(project)
    expect(told.keys() == expected.keys(), f"{sorted(told)}, without a cluster {sorted(expected)}")
    lost = told.pop(CANCELLED)
    expect(lost["verdict"] == "crashed", f"{CANCELLED}, cancelled: {lost['verdict']}")
    expect("there is no verdict" in lost["reason"], f"{CANCELLED}, cancelled: {lost['reason']}")
    print(f"{CANCELLED}, cancelled: {lost['verdict']}: {lost['reason']}")
    for job, verdict in told.items():
        compare(verdict, expected[job])
    killed = [memory for _, _, state, memory, *_ in jobs(cluster) if state == KILLED]
    asked = [float(memory.rstrip("M")) for memory in killed]
    expect(len(asked) == 2 and asked[1] == 2 * asked[0], f"memory asked for: {asked}")

    again = run(project, *CLUSTER, environment=cluster.environment)
    solved = re.findall(r"^(\S+): .* \[\d+/\d+\]$", again, re.MULTILINE)
    expect(solved == [CANCELLED], again)
    for job, verdict in sorted(summary(project).items()):
        compare(verdict, expected[job])
        print(f"{job}: {verdict['verdict']}, all values as in the local run")


def main():
    """Try it in a temporary folder; what is not as it must be ends it with status 1."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missing", action="store_true", help="only say what is missing for it")
    if parser.parse_args().missing:
        print(missing())
        return
    if reason := missing():
        sys.exit(f"no cluster can be started here: {reason}")
    # A signal ends the program as an error does, so that the daemons go with it.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("terminated"))
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="cluster-") as name:
        folder = Path(name)
        # Daemons distrust what others could change, and a folder that they cannot pass.
        folder.chmod(0o755)
        local = new_project(folder / "local")
        run(local, "--cores", "all")
        expected = summary(local)
        print(f"without a cluster: {len(expected)} solves, {time.monotonic() - began:.0f} s")
        with Cluster(folder) as cluster:
            try_cluster(cluster, new_project(folder / "cluster"), expected)
            print("SLURM's jobs: number, rule and wildcards, state, memory, limit, time")
            for job in jobs(cluster):
                print("  " + "  ".join(job))
    print(f"The batch on a cluster gives what it gives here ({time.monotonic() - began:.0f} s).")


if __name__ == "__main__":
    main()
