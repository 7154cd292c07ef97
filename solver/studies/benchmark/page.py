"""The benchmark's record as text and as a page: tables of ratios, bytes against bandwidth."""

import statistics
from collections.abc import Sequence
from pathlib import Path

from ...report.html import render
from ...system.files import write_text
from ...verification.verdict import to_json
from ..bandwidth import MovedBytes, table
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


def write_benchmark(record: Record, file: Path) -> Path:
    """Write the record as JSON into `file`, and the page beside it; the path of the page."""
    page, machine = file.with_suffix(".html"), record["machine"]
    solves = [(one["title"], table(one)) for one in record["products"]]
    facts = [
        ("Measured", f"{machine['time_utc'][:16].replace('T', ' ')} UTC"),
        ("Machine", f"{machine['cpu']}, {record['threads']} threads"),
        ("Load before the start", f"{record['load']:g}"),
        ("Revision", machine["revision"]),
    ]
    content = render(
        Path(__file__).with_name("page.html.jinja"),
        title=record["title"],
        facts=facts,
        tables=list(map(compared, record["comparisons"])),
        products=solves,
        speed_ups=_speed_ups([solve for _, solve in solves if solve]),
        data=file.name,
    )
    write_text(file, to_json(record) + "\n")
    write_text(page, content)
    return page


def _speed_ups(solves: Sequence[MovedBytes]) -> list[tuple[str, str, float]]:
    """Part, threads, and the time on the fewest over the time on the most; of bandwidth too."""
    if len(solves) < 2:
        return []
    few, many = solves[0], solves[-1]
    threads = f"{few.record['threads']} → {many.record['threads']}"
    found = [("bandwidth", threads, many.record["bandwidth"] / few.record["bandwidth"])]
    late = {part.name: part.seconds for part in many.parts}
    return found + [
        (part.name, threads, part.seconds / late[part.name])
        for part in few.parts
        if part.name in late
    ]


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
    rows = [[way["way"], *_way(way, ratio, dofs)] for way, ratio in pairs]
    return f"{comparison['title']} ({comparison['series']}{size}; {what})", rows


def _way(way: Record, ratio: float | None, dofs: int | None) -> list[str]:
    if way["outcome"] != SOLVED:
        return [f"{way['outcome']}: {way['reason']}"]
    # Below what the other code's output resolves, only that is known.
    error, resolved = way["pressure_max"], way.get("resolved", 0.0)
    iterations, memory = way.get("linear_iterations"), way["process"]["peak_memory_mb"]
    return [
        f"{seconds(way):.2f} s",
        f"×{ratio:.2f}" if ratio is not None else "",
        f"{memory / 1000:.2f} GB",
        f"{1000 * memory / dofs:.2f} kB/unknown" if dofs else "",
        "pressure error " + (f"< {resolved:.0e}" if error < resolved else f"{error:.1e}"),
        way["linear_solver"] + (f", {iterations} iterations" if iterations else ""),
    ]
