"""The benchmark's record as text: tables of ratios."""

import statistics
from collections.abc import Iterator, Sequence

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
    parts = [head, *map(_printed, tables(record)), f"benchmark took {record['whole']:.0f} s"]
    return "\n\n".join(parts)


def tables(record: Record) -> Iterator[TextTable]:
    """A table for each comparison, for the batch, and for the program's start."""
    yield from map(compared, record["comparisons"])
    yield batched(record["batch"])
    yield started(record["start"])


def _printed(table: TextTable) -> str:
    title, rows = table
    lines = [f"  {name:<26} {'  '.join(f'{text:>10}' for text in texts)}" for name, *texts in rows]
    return "\n".join([title, *lines])


def seconds(way: Record, kind: str = "cpu") -> float | None:
    """What a way took: the median of its warm repetitions, else its whole process."""
    if way["outcome"] != SOLVED:
        return None
    times = way["times"].get("total")
    return statistics.median(times[kind]) if times else way["process"][kind]


def ratios(ways: Sequence[Record]) -> list[float | None]:
    """The time of each way over that of the first; None where either has none."""
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


def batched(batch: Record) -> TextTable:
    """Cases in a process each beside the same in one process, cold and warm."""
    each = sum(process["cpu"] for process in batch["each"])
    together = batch["together"]
    rows = [["a process each", f"{each:.2f} s", "×1.00"]]
    if together["outcome"] != SOLVED:
        rows.append(["one process", f"{together['outcome']}: {together['reason']}"])
    else:
        second = together["passes"][1]["cpu"]
        cold, goal = together["process"]["cpu"] - second, f"goal: under {batch['most']:g} s"
        rows.append(["one process", f"{cold:.2f} s", f"×{cold / each:.2f}"])
        rows.append(["one warm process", f"{second:.2f} s", f"×{second / each:.2f}", goal])
    return f"{batch['title']}: from mesh file to verdict", rows


def started(start: Record) -> TextTable:
    """What the smallest uses of the program take."""
    plane = start["plane"]
    return "The program's own start", [
        ["--help", f"{start['help']['cpu']:.2f} s", "goal: under 0.3 s"],
        ["a plane case", f"{plane['cpu']:.2f} s", "goal: under 1.1 s", plane["case"]],
    ]
