"""The jobs that the solver lists, and the inputs of each of them."""

import fnmatch
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from collections import namedtuple
from functools import cache
from importlib import import_module
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import validate

# The program: `solver` in the project, `mortarcheck` where it is installed with this workflow in it.
HERE = Path(workflow.current_basedir.get_path_or_uri(secret_free=False))
PACKAGE = "solver" if (HERE.parents[1] / "solver").is_dir() else "mortarcheck"
FOLDER = Path(import_module(PACKAGE).__file__).parent
# The working folder gives this package alone: Snakemake put it first, and a file `jsonschema.py` in it
# would be taken for the package.
sys.path.sort(key=lambda folder: Path(folder) == Path(workflow.basedir))


def part(name):
    """A module of the program."""
    return import_module(f"{PACKAGE}.{name}")


# One solve, as `python -m solver jobs` lists it.
FIELDS = "family case name file mesh swap hexahedra points dim refusal"
Job = namedtuple("Job", FIELDS)


def refuse(line):
    """End with one line and no traceback, for a wrong setting."""
    print(line, file=sys.stderr)
    sys.exit(2)


def read_config():
    """Validate the configuration by its schema, which also fills in defaults."""
    for key in ("family", "cases", "case"):  # Snakemake reads `case=12` as a number
        if isinstance(config.get(key), (int, float)):
            config[key] = str(config[key])
    try:
        validate(config, "../schemas/config.schema.yaml")
    except WorkflowError as error:
        found = re.search(r"^\w*Error: (.*)$", str(error), re.MULTILINE)
        place = re.search(r"^On instance\['(\w+)'\]", str(error), re.MULTILINE)
        refuse(
            f"config: {place[1] + ': ' if place else ''}{found[1] if found else error}"
        )
    cores = workflow.resource_settings.cores  # none where a cluster has the jobs
    if cores is not None and cores < 1:
        refuse(f"cores = {cores}: must be 1 or more, or `all`")


def listed(value):
    """A configured list, whether given as a list or as one text with commas."""
    return value.split(",") if isinstance(value, str) and value else list(value)


read_config()
# Jobs share their bytecode: compiling the sources in each costs a third of a small solve.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
VARIANTS = config["variants"] in (True, "true")
# What jobs call: `program COMMAND`, and `warm FILE COMMAND`, which runs in a fork of the warm process,
# if there is one, and writes its cost to a file. These processes ignore PYTHONPATH and the user's own
# packages. As functions of the shell they are no part of the code of a rule, and known in a module.
PYTHON = f"{shlex.quote(sys.executable)} -Es"
WARM = f"{PYTHON} -IS {shlex.quote(str(FOLDER / 'commands/warm.py'))}"
NO_CHECK = "--no-memory-check" * (config["memory_check"] in (False, "false"))
shell.prefix(
    f'program() {{{{ {PYTHON} -m {PACKAGE} "$@"; }}}}; warm() {{{{ {WARM} "$@"; }}}}; '
    f"memory_check={NO_CHECK}; "
)


def sources(*patterns):
    """Source files of the solver."""
    return sorted({str(f) for p in patterns for f in FOLDER.glob(p) if f.is_file()})


OF_PAGES = (
    "report/**/*.*",
    "studies/page*",
    "studies/shown.py",
    "studies/figures/*.py",
)
REPORT_SOURCES = [f for f in sources(*OF_PAGES) if not f.endswith(".pyc")]
SOLVER_SOURCES = sorted({*sources("**/*.py", "case/schemas/*")} - {*REPORT_SOURCES})
MESH_SOURCES = sources("case/**/*.py", "case/schemas/*", "mesh/**/*.py", "system/*.py")


@cache
def content_of(file):
    """The hash of a file's content; empty if it is not a regular file or cannot be read."""
    if not os.path.isfile(file):
        return ""
    try:
        with open(file, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return ""


@cache
def contents(*files):
    """The hash of a job's inputs, as a parameter: a change runs it again, whatever the dates.

    Snakemake compares parameters only if they depend on wildcards alone.
    """
    names = [os.path.relpath(file, FOLDER.parent) for file in files]
    found = "".join(f"{n} {content_of(f)}\n" for n, f in zip(names, files))
    return hashlib.sha256(found.encode("utf-8", "surrogateescape")).hexdigest()


SOLVER_CONTENT = contents(*SOLVER_SOURCES)
REPORT_CONTENT = contents(*REPORT_SOURCES)
MESH_CONTENT = contents(*MESH_SOURCES)


def watched(*files):
    """The user's files as inputs of a job, without missing ones, which the solver reports.

    Their content is among the job's parameters and counts; their dates do not.
    """
    return [ancient(f) for f in files if os.path.isfile(f)]


def list_jobs(folders):
    """The jobs in the folders, as the solver lists them."""
    command = [sys.executable, "-Es", "-m", PACKAGE, "jobs", *folders]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        refuse((done.stderr.strip() or "cases: they cannot be listed").splitlines()[-1])
    return done.stdout.splitlines()[-1]


def find_jobs():
    """All jobs by family and name: ours, and those of the configured folders."""
    ours = sorted(
        {f.parent for f in Path("cases").glob("*/*.yaml")} - {Path("cases/studies")}
    )
    folders = [*ours, *(Path(f).expanduser() for f in listed(config["cases"]))]
    if not folders:
        refuse("cases: no folder with case files (*.yaml) in it")
    what = [*map(str, folders), *["--variants"] * VARIANTS]
    jobs = [Job(**of) for of in json.loads(list_jobs(what))]
    return {(job.family, job.name): job for job in jobs}


def chosen(key, known):
    """The names that a setting chooses by names and patterns such as `hertz-*`; all if it is empty."""
    found = {pattern: fnmatch.filter(known, pattern) for pattern in listed(config[key])}
    for pattern in found:
        if not found[pattern]:
            refuse(
                f"{key} = {pattern}: unknown; {part('system.errors').hint(pattern, known)}"
            )
    return set().union(*found.values()) if found else set(known)


def choose_jobs():
    """The jobs of this run: of the configured families and cases, and of these, if it is configured,
    those that have not passed."""
    jobs = {key: job for key, job in BATCH.items() if job.family in FAMILIES}
    files = {}  # a case may be named by its file
    for job in jobs.values():
        files.setdefault(job.file, []).append(job.name)
    given = listed(config["case"])
    config["case"] = [name for case in given for name in files.get(case, [case])]
    names = chosen("case", {job.name for job in jobs.values()})
    jobs = {key: job for key, job in jobs.items() if job.name in names}
    if config["failed"] in (True, "true"):
        jobs = {key: job for key, job in jobs.items() if not has_passed(job)}
        if not jobs and workflow.is_main_process:
            print("Nothing to be done: all chosen cases have passed.")
            sys.exit(0)
    return jobs


def results_of(job):
    return f"results/{job.family}/{job.name}"


def verdict_of(job):
    return f"{results_of(job)}/verdict.json"


def read_verdict_of(folder):
    """The verdict in a folder of results; None if it is missing or damaged."""
    try:
        return part("verification.verdict").read_verdict(Path(folder, "verdict.json"))
    except part("system.errors").InputError:
        return None


def has_passed(job):
    """Whether a solve has a verdict, and it is sound."""
    verdict = read_verdict_of(results_of(job))
    return verdict is not None and verdict.sound


BATCH = find_jobs()
FAMILIES = chosen("family", {job.family for job in BATCH.values()})
RUN = choose_jobs()


def verdicts_there(jobs):
    """The verdicts of those jobs that have one."""
    return [verdict for verdict in map(verdict_of, jobs) if os.path.isfile(verdict)]


# Without Snakemake's records the inputs of the results are unknown.
LOST = not any(Path(".snakemake/metadata").glob("*"))


def is_damaged(folder):
    """Whether a folder of results is there and cannot be kept: its inputs are unknown, its verdict
    is damaged, its file is missing, or the machine ended the solve (memory, disk, a kill).
    """
    if not os.path.isdir(folder) or LOST:
        return os.path.isdir(folder)
    if folder.startswith("results/meshes/"):
        return not any(Path(folder, f).is_file() for f in ("mesh.vtkhdf", "refused"))
    verdict = read_verdict_of(folder)
    if verdict is None or verdict.transient:
        return True
    return verdict.result is not None and not Path(folder, verdict.result).is_file()


wildcard_constraints:
    family="(?!(?:report|meshes|studies|docs)/)[^/]+",
    case="[^/]+",
    job="[^/@]+",


def mesh_folder(job):
    """The folder of a recipe's mesh, in a list; empty for a mesh of the user."""
    return [f"results/meshes/{job.family}/{job.case}"] if job.mesh is None else []


def mesh_file(job):
    """The path of the generated mesh, which may be missing; empty for a mesh of the user."""
    return "".join(f"{folder}/mesh.vtkhdf" for folder in mesh_folder(job))


def files_of(job):
    """The input files of a solve: case, mesh with its included files, accepted values."""
    accepted = Path(job.file).parent / "regression" / f"{job.name}.json"
    return [job.file, *(job.mesh or ()), str(accepted)]


def options_of(job):
    """The options of the command line for this job of a case."""
    cut = f" --hexahedra {job.hexahedra}" if job.hexahedra else ""
    return "--swap" * job.swap + cut
