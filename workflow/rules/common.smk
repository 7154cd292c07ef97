"""The jobs that the solver lists, and the inputs of each of them."""

import fnmatch
import hashlib
import os
import re
import shlex
import subprocess
import sys
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


def refuse(line):
    """End with one line and no traceback, for a wrong setting."""
    print(line, file=sys.stderr)
    sys.exit(2)


def checked(call, *arguments):
    """What a function of the program returns; where it refuses, the run ends."""
    try:
        return call(*arguments)
    except part("system.errors").InputError as error:
        refuse(error)


def read_config():
    """Validate the configuration by its schema, which also fills in defaults."""
    try:
        validate(config, "../schemas/config.schema.yaml")
    except WorkflowError as error:
        found = re.search(r"^\w*Error: (.*)$", str(error), re.MULTILINE)
        place = re.search(r"^On instance\['(\w+)'\]", str(error), re.MULTILINE)
        refuse(f"config: {place[1] + ': ' if place else ''}{found[1] if found else error}")
    cores = workflow.resource_settings.cores  # none where a cluster has the jobs
    if cores is not None and cores < 1:
        refuse(f"cores = {cores}: must be 1 or more, or `all`")


def listed(value):
    """A configured list, whether given as a list or as one text with commas."""
    return value.split(",") if isinstance(value, str) and value else list(value)


read_config()
# Jobs share their bytecode: compiling the sources in each costs a third of a small solve.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# What jobs call: `program COMMAND`, and `warm FILE COMMAND`, which runs in a fork of the warm process,
# if there is one, and writes its cost to a file. These processes ignore PYTHONPATH and the user's own
# packages. As functions of the shell they are no part of the code of a rule, and known in a module.
PYTHON = f"{shlex.quote(sys.executable)} -EsP"
ENTRY = str(FOLDER / "__main__.py")
WARM = f"{PYTHON} -IS {shlex.quote(str(FOLDER / 'commands/warm.py'))}"
NO_CHECK = "--no-memory-check" * (config["memory_check"] in (False, "false"))
shell.prefix(
    "set -euo pipefail; "
    f'program() {{{{ {PYTHON} {shlex.quote(ENTRY)} "$@"; }}}}; warm() {{{{ {WARM} "$@"; }}}}; '
    f"memory_check={NO_CHECK}; "
)


def files_in(*patterns):
    """Source files of the program."""
    found = {f for p in patterns for f in FOLDER.glob(p) if f.is_file()}
    return {f for f in found if f.suffix != ".pyc"}


def hash_of(files):
    """The hash of files, a parameter of jobs: these run again when it changes."""
    found = hashlib.sha256()
    for file in sorted(files):
        found.update(os.fsencode(os.path.relpath(file, FOLDER)) + file.read_bytes())
    return found.hexdigest()


REPORT_SOURCES = files_in("report/**/*.*", "studies/page*", "studies/figures/*.py")
REPORT_HASH = hash_of(REPORT_SOURCES)
SOLVER_HASH = hash_of(files_in("**/*.py", "case/schemas/*") - REPORT_SOURCES)
MESH_HASH = hash_of(files_in("case/**/*.*", "mesh/**/*.py", "system/*.py"))


def find_jobs():
    """All jobs by family and name: ours, and those of the configured folders."""
    ours = {f.parent for f in Path("cases").glob("*/*.yaml")} - {Path("cases/studies")}
    folders = [*sorted(ours), *(Path(f).expanduser() for f in listed(config["cases"]))]
    variants = config["variants"] in (True, "true")
    return {job.key: job for job in checked(part("commands.jobs").list_jobs, folders, variants)}


def chosen(key, known):
    """The names that a setting chooses by names and patterns such as `hertz-*`; all if it is empty."""
    found = {pattern: fnmatch.filter(known, pattern) for pattern in listed(config[key])}
    for pattern in found:
        if not found[pattern]:
            refuse(f"{key} = {pattern}: unknown; {part('system.errors').hint(pattern, known)}")
    return set().union(*found.values()) if found else set(known)


def choose_jobs():
    """The jobs of the configured families and cases; `failed`: of these, those that have not passed."""
    jobs = [job for job in BATCH.values() if job.family in FAMILIES]
    # A case may be named by its file.
    config["case"] = [
        name
        for case in listed(config["case"])
        for name in [job.name for job in jobs if job.file == case] or [case]
    ]
    names = chosen("case", {job.name for job in jobs})
    failed = config["failed"] in (True, "true")
    jobs = [job for job in jobs if job.name in names and not (failed and job.passed)]
    if not jobs and workflow.is_main_process:
        print("Nothing to be done: all chosen cases have passed.")
        sys.exit(0)
    return {job.key: job for job in jobs}


# A dry run changes no dates: it is told by a parameter what a run would solve again.
DRY = workflow.output_settings.dryrun
BATCH = find_jobs()
FAMILIES = chosen("family", {job.family for job in BATCH.values()})
RUN = choose_jobs()
# The folders of the solves of this run, for the report: too many for a command line.
RUN_LIST = ".snakemake/run-list"


def batch(w):
    """The job of a rule's wildcards."""
    return BATCH[w.family, w.job]


def mesh_option(w):
    """The option --mesh of a job, for the shell; empty unless the mesh of a recipe is there."""
    if not (folder := batch(w).mesh_folder):
        return ""
    return f'$(test ! -e {folder}/mesh.vtkhdf || echo "--mesh {folder}/mesh.vtkhdf")'


# In a job Snakemake runs in Snakemake, with its plugins' libraries: memory beside the solve's own.
AROUND_MB = 900
# From a cold shared folder three interpreters start before the solve does.
START_MINUTES = 10
# Contact takes several linear solves, and a node may be slower than where the model was measured.
SLACK = 10
# What asks for more (bytes, seconds) is for the solver to refuse, by its own estimate.
MOST_MEMORY, MOST_SECONDS = 1e15, 1e9


def memory(job, attempt):
    """Megabytes that a job of this case asks for, more each time it has to be run again."""
    return attempt * round(AROUND_MB + min(job.size.memory.most, MOST_MEMORY) / 1e6)


def seconds(job):
    """Estimated seconds of a case, the priority of its jobs: the longest cases start first."""
    return min(job.size.seconds, MOST_SECONDS)


def minutes(job, attempt):
    """Minutes that a job of this case asks for, more each time it has to be run again."""
    return attempt * round(START_MINUTES + SLACK * seconds(job) / 60)


wildcard_constraints:
    family="(?!(?:report|meshes|studies|docs)/)[^/]+",
    case="[^/]+",
    job="[^/@]+",
