"""Points of a study: each measured in processes of its own, and recorded in any event.

A record is a JSON object. Every one has these keys:

    point                    its name, the path of its record without suffix
    outcome reason           solved, refused, failed, crashed or missing, and why
    threads cores load       what it ran on; load: the machine's when it began, over 1 minute
    whole                    wall seconds that the point took
    machine                  as `system.provenance.gather` describes it
"""

import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

from ..system.clock import now
from ..system.errors import InputError, SolveError, hint
from ..system.process import FinishedProcess, run_in_subprocess
from . import FULL

SOLVED, REFUSED, FAILED, CRASHED, MISSING = "solved", "refused", "failed", "crashed", "missing"
# A machine that was busier than this when a point began may have disturbed it.
_BUSY = 1.0
_PACKAGES = ("python", "numpy", "scipy")
# Lines that Numba prints, with this variable set, about functions it loaded or compiled and kept.
_NUMBA = {"NUMBA_DEBUG_CACHE": "1"}
_CACHE, _COMPILED = "[cache] ", "[cache] data saved"

Record = Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class PointStudy:
    """A study measured point by point, each on `threads` cores and for at most `limit` seconds.

    Each point has a `name`.
    """

    path: Path
    title: str
    size: str
    threads: int
    limit: float

    @cached_property
    def points(self) -> Sequence[Any]:
        """Every point."""
        raise NotImplementedError

    def point(self, name: str) -> Any:
        """The point of that name; InputError for an unknown name."""
        known = {point.name: point for point in self.points}
        if name not in known:
            raise InputError(self.path, "point", name, f"no such point; {hint(name, known)}")
        return known[name]


@dataclass(frozen=True)
class MeasuredPoint:
    """A point with its record."""

    record: Record

    @property
    def solved(self) -> bool:
        """Whether there is a solve to show."""
        return self.record["outcome"] == SOLVED

    @property
    def why_not(self) -> str:
        """Why it is missing."""
        return f"{self.record['outcome']}: {self.record['reason']}"


def ended(outcome: str, reason: str) -> dict[str, str]:
    """The outcome of a point, as a part of its record."""
    return {"outcome": outcome, "reason": reason}


def surroundings(cores: Sequence[int]) -> dict[str, Any]:
    """The cores and load of the machine now, as a part of a record."""
    return {"threads": len(cores), "cores": list(cores), "load": round(os.getloadavg()[0], 2)}


def read_record(path: Path, *keys: str) -> dict[str, Any]:
    """A record, where it is solved with these keys.

    One that says why for a file that is missing or cannot be read.
    """
    try:
        record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        solved = record["outcome"] == SOLVED
        [record[key] for key in ("point", "reason", *(keys if solved else ()))]
    except OSError:
        return ended(MISSING, "not measured")
    except (ValueError, KeyError, TypeError):
        return ended(MISSING, "the record cannot be read")
    return record


def run_compiled(
    command: Callable[[], Sequence[str]],
    cores: Sequence[int],
    limit: float,
    memory: float = float("inf"),
) -> FinishedProcess:
    """What `run_in_subprocess` returns of a command in which Numba compiles nothing.

    If Numba compiled functions, as the first large solve of an installation does, these are kept
    and the command runs a second time. `command` is called before each run.
    """
    for _ in range(2):
        done = run_in_subprocess(command(), cores, limit, memory, environment=_NUMBA)
        lines = done.output.splitlines(keepends=True)
        if done.status != 0 or not any(line.startswith(_COMPILED) for line in lines):
            break
    return replace(done, output="".join(line for line in lines if not line.startswith(_CACHE)))


def measure_apart(
    work: Callable[[Any], Mapping[str, Any]],
    job: Mapping[str, Any],
    output: Path,
    cores: Sequence[int],
    limit: float,
) -> dict[str, Any]:
    """The result of a function for `job` in a new process, with outcome and reason.

    The process writes it to `output`. Its libraries read the number of threads when they are
    loaded, and peak memory is the process's own: hence a process for each point. In the job, the
    key `started` is added: when the process was started, by `clock.now`.
    """
    task: dict[str, Any] = {"module": work.__module__, "work": work.__name__, "output": str(output)}

    def command() -> list[str]:
        started = task | {"job": {**job, "started": now()}}
        return [sys.executable, "-m", __name__, json.dumps(started)]

    done = run_compiled(command, cores, limit)
    if done.status == 0:
        return json.loads(output.read_text(encoding="utf-8"))
    return ended(FAILED if done.status is None else CRASHED, done.reason)


def _work(task: Mapping[str, Any]) -> None:
    """Do it in this process, and write what was found or why there is nothing."""
    from ..verification.verdict import to_json

    try:
        found = getattr(import_module(task["module"]), task["work"])(task["job"])
        found = ended(SOLVED, "") | found
    except InputError as error:
        found = ended(REFUSED, error.detail)
    except SolveError as error:
        found = ended(FAILED, str(error))
    Path(task["output"]).write_text(to_json(found), encoding="utf-8")


def page_name(name: str, size: str) -> str:
    """The name of a study's page, of its tables and of the folder of its figures."""
    return name if size == FULL else f"{name}-{size}"


def outcome(points: Sequence[MeasuredPoint]) -> str:
    """The number of points with a solve."""
    lost = sum(not m.solved for m in points)
    text = f"{len(points) - lost} of {len(points)} points are measured."
    return text + (f" {lost} have no solve, each with its reason." if lost else "")


def disturbed(points: Sequence[MeasuredPoint]) -> int:
    """The number of points that began on a busy machine."""
    return sum(m.solved and m.record["load"] > m.record["threads"] + _BUSY for m in points)


def facts(points: Sequence[MeasuredPoint]) -> list[tuple[str, str]]:
    """When, on which machine and with what points were measured; empty where none is."""
    records = [m.record for m in points if m.solved]
    if not records:
        return []

    def all_of(key: str) -> str:
        return ", ".join(sorted({str(r["machine"].get(key, "")) for r in records}))

    times = sorted(r["machine"]["time_utc"][:16].replace("T", " ") for r in records)
    return [
        ("Measured", " … ".join(dict.fromkeys([times[0], times[-1]])) + " UTC"),
        ("Machine", all_of("cpu")),
        ("Threads", ", ".join(sorted({str(r["threads"]) for r in records}))),
        ("Revision", all_of("revision")),
        ("Versions", ", ".join(f"{p} {all_of(p)}" for p in _PACKAGES)),
        ("Begun while the machine was busy", f"{disturbed(points)} of {len(records)}"),
    ]


if __name__ == "__main__":
    _work(json.loads(sys.argv[1]))
