"""Times that can be trusted: repeated in one warm process, by stage, with their spread.

A point that needs the machine for itself is measured in a process of its own.
"""

import gc
import json
import os
import statistics
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..system.process import FinishedProcess, run_in_subprocess
from ..system.progress import Clock, now

TOTAL = "total"
# By stage and `total`: wall and processor time of every repetition, seconds.
Times = dict[str, dict[str, list[float]]]


@dataclass(frozen=True)
class Spread:
    """The median of repeated measurements, the least and the greatest."""

    median: float
    low: float
    high: float


def spread(values: Sequence[float]) -> Spread:
    """Median and range of at least one value."""
    return Spread(statistics.median(values), min(values), max(values))


def repeated(run: Callable[[Clock], object], repetitions: int) -> Times:
    """Call `run` with a new clock that many times, garbage collected before each and not within."""
    clocks = []
    for _ in range(repetitions):
        gc.collect()
        gc.disable()
        try:
            clocks.append(_timed(run))
        finally:
            gc.enable()
    stages = dict.fromkeys(stage for clock in clocks for stage in clock.seconds)
    return {
        stage: {
            "wall": [clock.seconds.get(stage, 0.0) for clock in clocks],
            "cpu": [clock.cpu_seconds.get(stage, 0.0) for clock in clocks],
        }
        for stage in stages
    }


def _timed(run: Callable[[Clock], object]) -> Clock:
    """The clock of one run, with its total."""
    clock, whole = Clock(), Clock()
    with whole.stage(TOTAL):
        run(clock)
    clock.seconds |= whole.seconds
    clock.cpu_seconds |= whole.cpu_seconds
    return clock


def medians(times: Mapping[str, Mapping[str, Sequence[float]]], kind: str) -> dict[str, float]:
    """The median by stage, of `wall` or of `cpu` time."""
    return {stage: statistics.median(values[kind]) for stage, values in times.items()}


# Lines that Numba prints, with this variable set, about functions it loaded or compiled and kept.
_NUMBA = {"NUMBA_DEBUG_CACHE": "1"}
_CACHE, _COMPILED = "[cache] ", "[cache] data saved"


def ended(outcome: str, reason: str) -> dict[str, Any]:
    """The outcome of a point, as a part of its record."""
    return {"outcome": outcome, "reason": reason}


def surroundings(cores: Sequence[int]) -> dict[str, Any]:
    """The cores and load of the machine now, as a part of a record."""
    return {"threads": len(cores), "load": round(os.getloadavg()[0], 2)}


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


def measure_apart(job: Mapping[str, Any], cores: Sequence[int], limit: float) -> dict[str, Any]:
    """The record of a point that `run.measure_here` makes of `job` in a new process.

    Its libraries read the number of threads when they are loaded, and peak memory is the process's
    own. In the job, the key `started` is added: when the process was started, by `clock.now`.
    """
    with TemporaryDirectory() as folder:
        output = Path(folder) / "record.json"

        def command() -> list[str]:
            task = {**job, "started": now(), "output": str(output)}
            return [sys.executable, "-m", f"{__package__}.run", json.dumps(task)]

        done = run_compiled(command, cores, limit)
        if done.status == 0:
            return dict(json.loads(output.read_text(encoding="utf-8")))
    return ended("failed" if done.status is None else "crashed", done.reason)
