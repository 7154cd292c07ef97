"""The benchmark's record as text: tables of ratios."""

import statistics
from collections.abc import Sequence

from ..points import SOLVED, Record

# A title and rows; a row has a name and numbers, or a reason in place of these.
TextTable = tuple[str, list[list[str]]]


def as_text(record: Record) -> str:
    """All of it; times are processor seconds of all threads."""
    machine = record["machine"]
    head = (
        f"{record['title']}: {machine['cpu']}, {record['threads']} threads, {machine['time_utc']}\n"
        f"load of the machine before the start: {record['load']:g}; times: processor seconds"
    )
    tables = map(compared, record["comparisons"])
    parts = [head, *map(_printed, tables), f"benchmark took {record['whole']:.0f} s"]
    return "\n\n".join(parts)


def _printed(table: TextTable) -> str:
    title, rows = table
    lines = [f"  {name:<26} {'  '.join(f'{text:>10}' for text in texts)}" for name, *texts in rows]
    return "\n".join([title, *lines])


def seconds(way: Record, kind: str = "cpu") -> float | None:
    """The median time of a way's warm repetitions, else the time of its whole process."""
    if way["outcome"] != SOLVED:
        return None
    times = way["times"].get("total")
    return statistics.median(times[kind]) if times else way["process"][kind]


def ratios(ways: Sequence[Record]) -> list[float | None]:
    """The time of each way over the first one's; None where either is unknown."""
    first, *_ = found = [seconds(way) for way in ways]
    return [time / first if time is not None and first else None for time in found]


def compared(comparison: Record) -> TextTable:
    """One comparison: time, its ratio to the first way, memory, error, linear solver."""
    ways = comparison["ways"]
    dofs = next((way["dofs"] for way in ways if way.get("dofs")), None)
    size = f", {dofs:,} unknowns" if dofs else ""
    what = "a warm solve" if comparison["repetitions"] else "the whole process"
    pairs = zip(ways, ratios(ways), strict=True)
    rows = [[way["way"], *_way(way, ratio)] for way, ratio in pairs]
    return f"{comparison['title']} ({comparison['series']}{size}; {what})", rows


def _way(way: Record, ratio: float | None) -> list[str]:
    if way["outcome"] != SOLVED:
        return [f"{way['outcome']}: {way['reason']}"]
    # Below what the other code's output resolves, only that is known.
    error, resolved = way["pressure_max"], way.get("resolved", 0.0)
    iterations = way.get("linear_iterations")
    return [
        f"{seconds(way):.2f} s",
        f"×{ratio:.2f}" if ratio is not None else "",
        f"{way['process']['peak_memory_mb'] / 1000:.2f} GB",
        "pressure error " + (f"< {resolved:.0e}" if error < resolved else f"{error:.1e}"),
        way["linear_solver"] + (f", {iterations} iterations" if iterations else ""),
    ]
