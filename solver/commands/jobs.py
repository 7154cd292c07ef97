"""The jobs that the case files of folders stand for: what a workflow has to run.

One case file is a job for each direction, and where asked for one for each cut of hexahedra. A file
that is refused is one job too: the solve says why. So no file keeps the others from being solved.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..case.model import SolvedAs
from ..system.errors import InputError, hint
from ..system.files import hash_of
from ..system.package import cases_folder
from ..verification.inputs import input_files

if TYPE_CHECKING:
    from ..case.model import Case
    from ..mesh.size import Size
    from ..verification.verdict import Verdict

# Files of these names describe a folder of cases.
DESCRIPTIONS = ("family.yaml", "orders.yaml")
# Names of folders and files become paths of results and patterns of the workflow.
PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
# Folders of results that are no family's.
_RESERVED = ["report", "meshes", "studies", "docs"]


@dataclass(frozen=True)
class BatchJob:
    """One job: the family, the case's name, its own name, its file, how it is solved.

    `mesh` holds the file of the user's own mesh; None where a recipe makes it, none at all where
    the case is refused. `points` and `dim` estimate its size.
    """

    family: str
    case: str
    name: str
    file: str
    mesh: Sequence[str] | None = None
    swap: bool = False
    hexahedra: str | None = None
    points: float = 0.0
    dim: int = 3

    @property
    def key(self) -> tuple[str, str]:
        """The unique key of a job."""
        return self.family, self.name

    @property
    def folder(self) -> str:
        """Where its results lie."""
        return f"results/{self.family}/{self.name}"

    @property
    def verdict(self) -> str:
        """The file of its verdict."""
        return f"{self.folder}/verdict.json"

    @property
    def mesh_folder(self) -> str:
        """The folder of a recipe's mesh; empty for a mesh of the user."""
        return f"results/meshes/{self.family}/{self.case}" if self.mesh is None else ""

    @property
    def inputs(self) -> list[str]:
        """Those files of the user that exist: case, mesh with what it includes, accepted values."""
        mesh = Path(self.mesh[0]) if self.mesh else None
        return [str(f) for f in input_files(Path(self.file), mesh, self.name)]

    @property
    def options(self) -> str:
        """The options of the command line for this job of a case."""
        return "--swap" * self.swap + (f" --hexahedra {self.hexahedra}" if self.hexahedra else "")

    @property
    def size(self) -> Size:
        """Its estimated size."""
        from ..mesh.size import Size

        return Size(self.points, self.dim)

    def read_verdict(self) -> Verdict | None:
        """Its verdict; None if it is missing or damaged."""
        from ..verification.stored import read_verdict

        try:
            return read_verdict(self.verdict)
        except InputError:
            return None

    @property
    def passed(self) -> bool:
        """Whether it has a verdict that can be kept, of the inputs as they are, and it is sound."""
        verdict = self.read_verdict()
        return verdict is not None and verdict.sound and not (self.damaged or self.stale)

    @property
    def damaged(self) -> bool:
        """Whether its results are there and cannot be kept: what the report calls damaged.

        Verdict or result are damaged, of another solve, or missing, or the machine ended the solve
        (memory, disk, a kill).
        """
        from ..verification.stored import unbound

        if not Path(self.folder).is_dir():
            return False
        verdict = self.read_verdict()
        if verdict is None or verdict.transient:
            return True
        return bool(unbound(verdict, Path(self.verdict)))

    @property
    def stale(self) -> bool:
        """Whether its results are there, and those of other inputs: contents decide, not dates."""
        verdict = self.read_verdict()
        if verdict is None:
            return False
        return verdict.files.provenance.get("inputs_sha256") != hash_of(self.inputs)


def case_files(folder: Path) -> list[Path]:
    """The case files of a folder, sorted, without hidden files such as an editor's locks."""
    found = (f for f in folder.glob("*.yaml") if not f.name.startswith("."))
    return sorted(f for f in found if f.name not in DESCRIPTIONS)


def check_names(folder: Path) -> None:
    """Raise InputError for a folder without cases, and where it or a file has an odd name."""
    if not folder.is_dir():
        raise InputError(folder, "cases", None, "no such folder")
    if not case_files(folder):
        raise InputError(folder, "cases", None, "no case file (*.yaml) in this folder")
    family = folder.resolve().name
    if family in _RESERVED:
        raise InputError(folder, "folder", family, "is a folder of results: choose another name")
    if set(str(folder)) & set("{}\n"):
        raise InputError(folder, "folder", None, "must be without braces and line ends")
    for path, name in [(folder, family), *((f, f.stem) for f in case_files(folder))]:
        if not PLAIN.fullmatch(name):
            must = "must be letters, digits, `_`, `-` and `.`, 64 at most, a letter or digit first"
            raise InputError(path, "name", name, must)


def list_jobs(folders: Sequence[Path], variants: bool = False) -> list[BatchJob]:
    """The jobs of all case files in the folders, file by file.

    `variants`: where there may be hexahedra, once more with the other cut. Raises InputError as
    `check_names`, and for a file that names its case as another file of the family does.
    """
    if not folders:
        raise InputError("config", "cases", None, "no folder with case files (*.yaml) in it")
    for folder in folders:
        check_names(folder)
    jobs: dict[tuple[str, str], BatchJob] = {}
    for file in (file for folder in folders for file in case_files(folder)):
        for job in jobs_of(file, variants):
            if other := jobs.get(job.key):
                allowed = f"already taken by {other.file}; each case of a family needs its own"
                raise InputError(file, "name", job.case, allowed)
            jobs[job.key] = job
    return list(jobs.values())


def families_in(cases: Path) -> dict[str, Path]:
    """The folders of cases in a folder by name."""
    folders = (f for f in sorted(cases.glob("*/")) if f.name not in _RESERVED)
    return {folder.name: folder for folder in folders if case_files(folder)}


def find_job(name: str, cases: Path) -> BatchJob:
    """The job of that name in the families of a folder; InputError with near names."""
    folders = sorted(families_in(cases).values(), key=lambda f: not name.startswith(f.name))
    known: list[str] = []
    for folder in folders:
        for job in list_jobs([folder]):
            if job.name == name:
                return job
            known.append(job.name)
    raise InputError(cases, "case", name, f"no such case; {hint(name, known)}")


def named(case: Path) -> tuple[Path, bool]:
    """The file of a case that is given by its file or its name, and whether it is swapped."""
    if case.suffix or case.exists():
        return case, False
    found = find_job(str(case), cases_folder())
    return Path(found.file), found.swap


def case_file(case: Path) -> Path:
    """The file of a case by its file or its name; InputError for the name of a swapped solve."""
    file, swapped = named(case)
    if swapped:
        raise InputError("command line", "case", str(case), "name the case, and add --swap")
    return file


def results_of(given: Path) -> list[Path]:
    """A result, or those of all jobs of a case file, in the folder `results` of the batch."""
    if given.suffix != ".yaml":
        return [given]
    return [Path(job.folder, "result.vtkhdf") for job in jobs_of(given)]


def jobs_of(file: Path, variants: bool = False) -> Iterator[BatchJob]:
    """The jobs of one case file."""
    from ..case.reader import load_case

    alone = BatchJob(file.parent.resolve().name, file.stem, file.stem, str(file), mesh=())
    try:
        case = load_case(file)
    except Exception:  # noqa: BLE001 -- whatever it is, the solve meets it again and reports it
        yield alone
        return
    mesh, size = (
        [str(case.mesh.source["path"])] if "path" in case.mesh.source else None,
        _size(case),
    )
    own = {zone.hexahedra for zone in case.zones}
    other = "pyramids" if "hexahedra" in own else "hexahedra"
    hexahedra = "path" in case.mesh.source or "HEXA" in str(case.mesh.source)
    for cut in [None, other] if variants and hexahedra else [None]:
        for swap in [False, True] if case.about.directions == "both" else [False]:
            yield BatchJob(
                family=alone.family,
                case=case.name,
                name=SolvedAs(swap, cut).job(case.name),
                file=str(file),
                mesh=mesh,
                swap=swap,
                hexahedra=cut,
                points=size.points,
                dim=size.dim,
            )


def _size(case: Case) -> Size:
    from ..mesh.size import of_mesh

    path = case.mesh.source.get("path")
    return of_mesh({"file": str(path)} if path else case.mesh.source, Path())
