"""What is run: the case files found, the jobs they stand for, and the sources jobs depend on."""

import hashlib
import os
import re
import shlex
import sys
from collections import namedtuple
from functools import cache
from importlib import import_module
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError
from snakemake.utils import validate

# The project's folder gives these packages alone: Snakemake put it first, and a file `jsonschema.py`
# in it would be taken for the package.
for package in ("solver", "workflow.progress"):
    import_module(package)
sys.path.sort(key=lambda folder: Path(folder) == Path(workflow.basedir))

validate(config, "../schemas/config.schema.yaml")

VARIANTS = config["variants"] in (True, "true")
# Jobs share their bytecode: to compile the sources anew in each costs a third of a small solve.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
MEMORY_CHECK = " --no-memory-check" * (config["memory_check"] in (False, "false"))
# Neither PYTHONPATH nor the user's own packages are for these processes.
PYTHON = shlex.quote(sys.executable) + " -Es"
# Before a file for what it takes and a command of the solver, which runs in a fork of the run's
# warm process, where there is one.
SOLVER = f"{PYTHON} -IS solver/commands/warm.py"

# One solve. `mesh`: the user's mesh file, or None where a recipe generates it; `hexahedra`: how
# hexahedra are cut, None for the case's own way.
Job = namedtuple("Job", "family case name file mesh swap hexahedra")


def sources(*patterns):
    """Source files of the solver."""
    return sorted(
        str(f) for p in patterns for f in Path("solver").glob(p) if f.is_file()
    )


@cache
def content_of(file):
    """The hash of a file's content; nothing where it cannot be read."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return ""


def contents(*files):
    """What a job is made from, as a parameter: it runs again on a change whatever the clock says.

    Snakemake's parameters count for this only where they are made from nothing but wildcards.
    """
    return digest("".join(f"{file} {content_of(file)}\n" for file in files))


def digest(text):
    return hashlib.sha256(text.encode()).hexdigest()


def text_of(file):
    return file.read_text() if file.is_file() else ""


def stamped(name, files):
    """The one file that stands for many as an input of jobs, in a list: their hashes.

    Snakemake looks at each input of each job. Written only where a hash changes, so that by its
    date alone all that depends on it is made again, also where Snakemake's records are lost.
    """
    told = "".join(f"{content_of(file)}  {file}\n" for file in files)
    stamp = Path("results/.sources") / f"{name}.sha256"
    if workflow.is_main_process and told != text_of(stamp):
        try:
            stamp.parent.mkdir(parents=True, exist_ok=True)
            stamp.write_text(told)
        except OSError:
            pass  # said by check_writable
    return [str(stamp)]


def stamp_of(file):
    """What tells one state of a file from another without reading it."""
    if not file.is_file():
        return ""
    about = file.stat()
    return f"{about.st_size} {about.st_mtime_ns} {os.access(file, os.R_OK)}"


OF_REPORT = sources(
    *("report/**/*.py", "report/templates/*", "studies/**/*.jinja"),
    *(f"studies/**/{page}.py" for page in ("page", "figure", "records")),
)
OF_SOLVER = sorted({*sources("**/*.py", "case/schemas/*")} - {*OF_REPORT})
OF_MESH = sources(
    *("case/**/*.py", "case/schemas/*", "system/errors.py", "system/files.py"),
    *("system/hdf5.py", "mesh/**/*.py"),
)
REPORT_SOURCES = stamped("report", OF_REPORT)
SOLVER_SOURCES = stamped("solver", OF_SOLVER)
MESH_SOURCES = stamped("mesh", OF_MESH)


def listed(value):
    """A configured list, whether given as a list or as one text with commas."""
    return value.split(",") if isinstance(value, str) and value else list(value)


def case_files():
    """All case files: ours, a folder a family, and those of the configured folders."""
    # Folders of ours that are measured, not checked, hold no cases beside what they are told by.
    measured = {Path("cases/study"), Path("cases/scaling")}
    files = sorted(
        f for f in Path("cases").glob("*/*.yaml") if f.parent not in measured
    )
    for folder in listed(config["cases"]):
        found = sorted(Path(folder).expanduser().glob("*.yaml"))
        if not found:
            raise WorkflowError(
                f"cases = {folder}: no case file (*.yaml) in this folder"
            )
        files += found
    return [f for f in files if f.name not in ("family.yaml", "orders.yaml")]


def peek(file):
    """The few keys needed here; a broken file still becomes one job, which the solver refuses."""
    try:
        content = yaml.load(
            file.read_text(), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        )
    except (OSError, yaml.YAMLError, UnicodeDecodeError):
        content = None
    return content if isinstance(content, dict) else {}


def jobs_of(file):
    """The jobs of one case file: both directions where asked for, and the variants."""
    content = peek(file)
    family = file.resolve().parent.name
    name = str(content.get("name"))
    if "name" not in content or not re.fullmatch(r"[A-Za-z0-9][\w.+-]*", name):
        name = re.sub(r"[^\w.+-]", "_", file.stem)
    mesh = content.get("mesh")
    mesh_file = (
        file.parent / str(mesh["file"])
        if isinstance(mesh, dict) and "file" in mesh
        else None
    )
    cuts = [None]
    if VARIANTS and (mesh_file or "HEXA" in str(mesh)):
        own = re.search(
            r"\bhexahedra: *(\w+)", str(content.get("contact")).replace("'", "")
        )
        cuts.append("pyramids" if own and own[1] == "hexahedra" else "hexahedra")
    for cut in cuts:
        for swap in [False, True] if content.get("directions") == "both" else [False]:
            job = name + "-swapped" * swap + (f"-{cut}" if cut else "")
            yield Job(family, name, job, str(file), mesh_file, swap, cut)


def find_jobs():
    """Jobs by (family, name), as configured."""
    jobs = {}
    for job in (job for file in case_files() for job in jobs_of(file)):
        other = jobs.setdefault((job.family, job.name), job)
        if other is not job:
            raise WorkflowError(
                f"{job.file}: name = {job.case}: already taken by {other.file}; "
                "each case of a family needs a name of its own"
            )
    chosen = listed(config["family"])
    known = {job.family for job in jobs.values()}
    if unknown := set(chosen) - known:
        raise WorkflowError(
            f"family = {', '.join(sorted(unknown))}: unknown; there are {', '.join(sorted(known))}"
        )
    return {key: job for key, job in jobs.items() if not chosen or job.family in chosen}


def older(file, time):
    """Whether a file is missing, or was written before that time."""
    return not Path(file).is_file() or Path(file).stat().st_mtime < time


def measured_points(read, file, size, folder):
    """The points by name that a file describes; says how long those that are missing will take.

    `read` the file at its `size`; `folder` has the records.
    """
    from solver.system.errors import InputError
    from solver.studies.points import announcement

    try:
        content = read(Path(file), size)
    except InputError as error:
        raise WorkflowError(str(error)) from None
    newest = max(Path(source).stat().st_mtime for source in [file, *SOLVER_SOURCES])
    points = {point.name: point for point in content.points}
    pending = [name for name in points if older(f"{folder}/{name}.json", newest)]
    logger.info(announcement(content, Path(folder), pending))
    return points


def verdict_of(job):
    return f"results/{job.family}/{job.name}/verdict.json"


BATCH = find_jobs()
MESHES = {str(job.mesh) for job in BATCH.values() if job.mesh}
RUN = {k: j for k, j in BATCH.items() if config["case"] in ("", j.name)}
if not RUN:
    raise WorkflowError(
        f"case = {config['case']}: unknown; a case is named as in its file"
    )


wildcard_constraints:
    family="[^/]+",
    case="[^/]+",
    job="[^/]+",
