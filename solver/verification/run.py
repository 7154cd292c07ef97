"""One job from case file to verdict: mesh, solve, checks, result file, verdict."""

import logging
import os
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import meshio

from ..case.file import HALVINGS, HALVINGS_TEXT
from ..case.model import AS_WRITTEN, Case, SolvedAs
from ..case.reader import check_mesh_file, load_case
from ..lac.errors import SolveError
from ..mechanics.fem.refine import refined as refined_mesh
from ..mesh import generate, read_mesh, transform
from ..mesh.files.vtkhdf import check_name
from ..mesh.size import check_memory, of_mesh
from ..mesh.tidy import tidy
from ..simulation.options import LEAN, Options
from ..simulation.results.solution import Solution
from ..simulation.simulate import solved
from ..system.errors import InputError, MachineError, of_machine
from ..system.files import hash_of, last_line
from ..system.progress import OUTCOME, Clock, processor_time, stage
from .checks import accepted_values, run_checks
from .inputs import input_files
from .judge import judge, without_result
from .norms import errors
from .provenance import gather
from .results import read_result, write_result
from .stored import write_verdict
from .verdict import CRASHED, FAILED, REFUSED, CheckResult, Verdict

# After so many seconds a process that meshes is ended: ten million unknowns take half of that.
MESHING_SECONDS = 1800
# A mesh has at least this share of the estimated nodes.
_SURELY = 0.8

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """One solve of a case: on which mesh, and how.

    `mesh` is a mesh file taken as it is; None means the case's own, its transform applied.
    `refine` multiplies the divisions of the case's recipe. `memory_check`: refused where its memory
    exceeds the machine's. `everything`: also do the work that the scene does not need.
    """

    case: Path
    mesh: Path | None = None
    solved_as: SolvedAs = AS_WRITTEN
    refine: int = 1
    memory_check: bool = True
    everything: bool = False

    def of(self, case: Case) -> Case:
        """The case as this job solves it."""
        return case.as_solved(*self.solved_as)


def refined(case: Case, factor: int) -> Case:
    """The case on a mesh that is finer by `factor`, and no counts to meet."""
    if factor == 1:
        return case
    if "path" in case.mesh.source and factor not in HALVINGS:
        raise InputError(case.path, "--refine", factor, f"of a mesh file must be {HALVINGS_TEXT}")
    source = {**case.mesh.source, "refine": factor * case.mesh.source.get("refine", 1)}
    return replace(case, mesh=replace(case.mesh, source=source, counts={}))


def mesh_of(case: Case, memory_check: bool = True, limited: bool = False) -> meshio.Mesh:
    """The case's mesh, read or generated, its transform applied.

    `memory_check`: MachineError before it is generated, where no solve on it could fit in memory.
    `limited`: SIGALRM ends this process if gmsh, which nothing interrupts, takes too long.
    """
    if "path" in case.mesh.source:
        check_mesh_file(case)
        mesh = read_mesh(case.mesh.source["path"])
        for _ in range(HALVINGS.index(case.mesh.source.get("refine", 1))):
            mesh = tidy(refined_mesh(mesh), case.mesh.source["path"])
    else:
        if memory_check:
            size = of_mesh(case.mesh.source, case.path.parent)
            check_memory(int(_SURELY * size.points), size.dim, case.path)
        if limited:
            signal.alarm(MESHING_SECONDS)
        try:
            mesh = generate(case.mesh.source, str(case.path))
        finally:
            if limited:
                signal.alarm(0)
    return transform(mesh, case.mesh.transform, str(case.path)) if case.mesh.transform else mesh


def solve(
    job: Job,
    output: Path | None = None,
    verdict_file: Path | None = None,
    then: Callable[[Solution, Verdict], None] | None = None,
) -> Verdict:
    """Solve and check; the verdict. The result and the verdict are written where files are given.

    `then` is called at the end with a solution that has a result. Without one the verdict gives the
    reason, and the exception goes on: InputError, SolveError, or any other one for an error of the
    program.
    """
    case: Case | None = None
    started, clock, sha256 = processor_time(), Clock(), None
    inputs: dict[str, str | int] = {}
    try:
        inputs = _inputs_of(job, None)
        case = job.of(refined(load_case(job.case), job.refine))
        inputs = _inputs_of(job, case)
        if output:  # refuse before the solve, not after it
            check_name(output)
            output.parent.mkdir(parents=True, exist_ok=True)
        mesh = _mesh_of(job, case, clock)
        options = Options.everything() if job.everything else LEAN
        solution = solved(case, mesh, options, clock)
        with stage(clock, "checks"):  # accepted values belong to the case's own mesh
            checks = checked(solution, job.refine == 1 and not solution.ended)
        solution.cost.cpu_seconds = processor_time() - started
        provenance = gather(job.case, job.mesh or case.mesh.source.get("path")) | inputs
        if output:
            with stage(clock, "write"):
                sha256 = write_result(output, solution, checks, provenance)
    except Exception as error:
        if verdict_file:
            word, reason, transient = _ending(error)
            ended = without_result(word, reason, case or job.case, job.solved_as, transient, inputs)
            write_verdict(verdict_file, ended)
        raise
    name = os.path.relpath(output, (verdict_file or output).parent) if output else None
    verdict = judge(solution, checks, name, provenance, sha256)
    if verdict_file:
        write_verdict(verdict_file, verdict)
    _LOG.log(OUTCOME, "%s", verdict.summary)
    if then:
        then(solution, verdict)
    return verdict


def _inputs_of(job: Job, case: Case | None) -> dict[str, str | int]:
    """The hash of the files that the job reads, before any of them is read."""
    name = job.solved_as.job(case.name if case else job.case.stem)
    mesh = case.mesh.source.get("path") if case else None
    return {"inputs_sha256": hash_of(input_files(job.case, Path(mesh) if mesh else None, name))}


def _mesh_of(job: Job, case: Case, clock: Clock) -> meshio.Mesh:
    """The mesh of a job, which a solve on it fits into memory with."""
    with stage(clock, "read" if job.mesh or "path" in case.mesh.source else "mesh"):
        mesh = read_mesh(job.mesh) if job.mesh else mesh_of(case, job.memory_check, limited=True)
    if job.memory_check:
        check_memory(len(mesh.points), mesh.points.shape[1], case.path)
    return mesh


def checked(solution: Solution, accepted: bool = True) -> list[CheckResult]:
    """The checks of a solution, those of `accepted` values too if asked; its errors are found."""
    solution.quality.errors = errors(solution)
    return run_checks(solution, accepted_values(solution) if accepted else {})


def check(result_file: Path) -> Verdict:
    """The verdict of a stored result, its checks run again on the stored fields."""
    result = read_result(result_file)
    checks = checked(result.solution)
    return judge(result.solution, checks, result_file.name, result.provenance, result.sha256)


def record_crash(
    job: Job, verdict_file: Path, log_file: Path | None, status: int | None = None
) -> Verdict:
    """Write the verdict of a solve whose process died, and return it.

    The reason is its exit status, as far as known, and the last line of the log.
    """
    try:
        case: Case | Path = job.of(load_case(job.case))
    except InputError:
        case = job.case
    said = last_line(log_file)
    if status:
        reason = _death(status) + (f"; last words: {said}" if said else "")
    else:
        reason = said or "the process died without a word"
    verdict = without_result(CRASHED, reason, case, job.solved_as, transient=True)
    write_verdict(verdict_file, verdict)
    return verdict


def _death(status: int) -> str:
    """The meaning of an exit status; shells add 128 to a signal's number."""
    died = f"died with exit status {status}"
    names = {128 + number: number.name for number in signal.Signals}
    if status not in names:
        return died
    hints = {"SIGKILL": ", as a system does that runs out of memory"}
    hints["SIGALRM"] = f": meshing took longer than {MESHING_SECONDS} s"
    hint = hints.get(names[status], "")
    return f"{died}, ended by {names[status]}{hint}"


def _ending(error: Exception) -> tuple[str, str, bool]:
    """The verdict's word and reason for a solve that an exception ended; whether it may pass."""
    if isinstance(error, InputError):
        return REFUSED, str(error), isinstance(error, MachineError)
    if isinstance(error, SolveError):
        return FAILED, str(error), False
    if reason := of_machine(error):
        return REFUSED if isinstance(error, OSError) else CRASHED, reason, True
    return CRASHED, f"{type(error).__name__}: {' '.join(str(error).split())}", False
