"""Times that can be trusted: repeated in one warm process, by stage, with their spread."""

import gc
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..system.clock import Clock

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
