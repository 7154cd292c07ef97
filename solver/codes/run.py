"""Runs another code on a case, in a process of its own with a limit of time and of memory."""

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import meshio

from ..case.model import Case
from ..lac.errors import SolveError
from ..system.clock import now
from ..system.errors import InputError
from ..system.process import run_in_subprocess
from ..verification.verdict import CRASHED, FAILED, REFUSED, Verdict, write_verdict
from .compared import CHECKED_BY
from .deck import Deck, UnsupportedError, deck_of
from .foreign import ForeignResult
from .registry import Code
from .verdicts import LOG, VERDICT, store, without_foreign


class CrashError(Exception):
    """The process of a code died, or did not end in time."""


@dataclass(frozen=True)
class Limits:
    """Limits of a process: seconds, memory (bytes), cores; None: one thread on any core."""

    seconds: float = 120.0
    memory: float = 4e9
    cores: Sequence[int] | None = None


def run_code(code: Code, deck: Deck, folder: Path, limits: Limits) -> ForeignResult:
    """Write the input into `folder`, run the code there, read its result.

    Its output is in `folder/log`. Raises UnsupportedError for what the code cannot express,
    CrashError if its process dies or is stopped, SolveError if it does not converge or its result
    cannot be read.
    """
    code.write(deck, folder)
    command = code.command(folder)
    ended = run_in_subprocess(command, limits.cores, limits.seconds, limits.memory, folder)
    said = ended.output + ended.problem
    (folder / LOG).write_text(said, encoding="utf-8")
    if ended.status is None:
        raise CrashError(ended.reason)
    if found := code.gave_up and re.search(code.gave_up, said):
        raise SolveError(f"no convergence: {' '.join(found[0].split())}")
    if ended.status:
        raise CrashError(ended.reason)
    return replace(
        code.read(deck, folder),
        settings=code.settings,
        seconds=ended.wall,
        cpu_seconds=ended.cpu,
        peak_memory_mb=ended.peak_memory_mb,
    )


def run_case(
    code: Code, case: Case, mesh: meshio.Mesh, folder: Path, limits: Limits | None = None
) -> Verdict:
    """Run a code on a case as solved, check its result, write all of it into `folder`.

    A code that is not installed or cannot express the case, a crash, a hang, no convergence: each
    ends with a verdict that gives the reason. The output of the code is in `folder/log`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    version, started = code.version(), now()
    with TemporaryDirectory(prefix=f"{code.name}-") as scratch:
        try:
            if not version:
                raise UnsupportedError(f"not installed: {code.install}")
            deck = deck_of(case, mesh, code.layer)
            found = run_code(code, deck, Path(scratch), limits or Limits())
            found = replace(_thin(found) if case.thin else found, version=version)
            # What a code does not write is no fault of the result.
            only = [name for name in CHECKED_BY if getattr(found, name) is not None]
            return store(case, found, folder, mesh, only or None)
        except Exception as error:  # noqa: BLE001 -- a user's own class may raise anything
            known = [word for kind, word in _WORDS.items() if isinstance(error, kind)]
            verdict = without_foreign(
                case,
                code.name,
                known[0] if known else CRASHED,
                str(error) if known else f"{type(error).__name__}: {error}",
                version=version,
                settings=code.settings,
                seconds=now() - started,
            )
            write_verdict(folder / VERDICT, verdict)
            return verdict
        finally:
            if (said := Path(scratch, LOG)).is_file():
                shutil.copyfile(said, folder / LOG)


def _thin(found: ForeignResult) -> ForeignResult:
    """The result in plane stress: the stress zz of the equivalent plane strain is not there."""
    if found.stress is None:
        return found
    values = found.stress.values.copy()
    values[:, 2] = 0.0
    return replace(found, stress=replace(found.stress, values=values))


# InputError: case, mesh and result do not belong together.
_WORDS = {
    UnsupportedError: REFUSED,
    InputError: REFUSED,
    CrashError: CRASHED,
    SolveError: FAILED,
}
