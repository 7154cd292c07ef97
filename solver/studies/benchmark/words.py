"""The benchmark's record as lines of text: ratios, growth, shares."""

import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from solver.studies.scaling.growth import BY_FACES, fit_growth

Record = Mapping[str, Any]


def lines(record: Record) -> Iterator[str]:
    """All of it; times are processor seconds of all threads."""
    machine = record["machine"]
    yield f"{record['title']}: {machine['cpu']}, {record['threads']} threads, {machine['time_utc']}"
    yield f"load of the machine before the start: {record['load']:g}; times: processor seconds"
    for comparison in record["comparisons"]:
        yield from ("", *compared(comparison))
    yield from ("", *batched(record["batch"]))
    yield from ("", *started(record["start"]))
    for points in by_series(record["growth"]):
        yield from ("", *grown(points))
    yield f"\nbenchmark took {record['whole']:.0f} s"


def seconds(way: Record, kind: str = "cpu") -> float | None:
    """What a way took: the median of its warm repetitions, else its whole process."""
    if way["outcome"] != "solved":
        return None
    times = way["times"].get("total")
    return statistics.median(times[kind]) if times else way["process"][kind]


def ratios(ways: Sequence[Record]) -> list[float | None]:
    """The time of each way over that of the first; None where either has none."""
    first, *_ = found = [seconds(way) for way in ways]
    return [time / first if time is not None and first else None for time in found]


def compared(comparison: Record) -> Iterator[str]:
    """One comparison: a line a way, with its ratio to the first."""
    ways = comparison["ways"]
    dofs = next((way["dofs"] for way in ways if way.get("dofs")), None)
    size = f", {dofs:,} unknowns" if dofs else ""
    what = "a warm solve" if comparison["repetitions"] else "the whole process"
    yield f"{comparison['title']} ({comparison['series']}{size}; {what})"
    for way, ratio in zip(ways, ratios(ways), strict=True):
        if way["outcome"] != "solved":
            yield f"  {way['way']:<26} {way['outcome']}: {way['reason']}"
            continue
        share = f"×{ratio:.2f}" if ratio is not None else ""
        solved_by = way["linear_solver"]
        if way.get("linear_iterations"):
            solved_by += f", {way['linear_iterations']} iterations"
        yield (
            f"  {way['way']:<26} {seconds(way):8.2f} s {share:>8} "
            f"{way['process']['peak_memory_mb'] / 1000:6.2f} GB"
            f"  pressure error {_error(way)}  {solved_by}"
        )


def _error(way: Record) -> str:
    """The largest error of the pressure; below what the output resolves, only that."""
    error, resolved = way["pressure_max"], way.get("resolved", 0.0)
    return f"< {resolved:.0e}" if error < resolved else f"{error:7.1e}"


def batched(batch: Record) -> Iterator[str]:
    """Cases in a process each beside the same in one process, cold and warm."""
    yield f"{batch['title']}: from mesh file to verdict"
    each = sum(process["cpu"] for process in batch["each"])
    yield f"  {'a process each':<26} {each:8.2f} s    ×1.00"
    together = batch["together"]
    if together["outcome"] != "solved":
        yield f"  {'one process':<26} {together['outcome']}: {together['reason']}"
        return
    second = together["passes"][1]["cpu"]
    cold = together["process"]["cpu"] - second
    for name, time in (("one process", cold), ("one warm process", second)):
        yield f"  {name:<26} {time:8.2f} s {f'×{time / each:.2f}':>8}"
    yield f"  goal for the warm process: under {batch['most']:g} s"


def started(start: Record) -> Iterator[str]:
    """What the smallest uses of the program take."""
    yield "The program's own start"
    yield f"  {'--help':<26} {start['help']['cpu']:8.2f} s   goal: under 0.3 s"
    plane = start["plane"]
    yield f"  {'a plane case':<26} {plane['cpu']:8.2f} s   goal: under 1.1 s ({plane['case']})"


def by_series(records: Sequence[Record]) -> list[list[Record]]:
    """The points of each series."""
    found: dict[str, list[Record]] = {}
    for record in records:
        found.setdefault(record["series"], []).append(record)
    return list(found.values())


def grown(points: Sequence[Record]) -> Iterator[str]:
    """Exponents of one series from size to size, and the share of each stage at the largest."""
    yield f"Growth of {points[0]['cells']}"
    for point in points:
        if point["outcome"] != "solved":
            yield f"  {point['size']:,}: {point['outcome']}: {point['reason']}"
    solved = [point for point in points if point["outcome"] == "solved"]
    if not solved:
        return
    for name, exponent, share in stages(solved):
        power = "    –" if exponent is None else f"{exponent:5.2f}"
        over = "faces" if name in BY_FACES else "unknowns"
        yield f"  {name:<26} exponent {power} over {over:<9} {100 * share:5.1f} %"
    last = solved[-1]
    process = last["process"]
    yield (
        f"  {last['dofs']:,} unknowns: {process['cpu']:.1f} s, {process['wall']:.1f} s of wall, "
        f"{process['peak_memory_mb'] / 1000:.2f} GB, {last['linear_solver']}, "
        f"pressure error {last['errors']['pressure_max']:.1e}"
    )


def stages(points: Sequence[Record]) -> Iterator[tuple[str, float | None, float]]:
    """Name, exponent and share at the largest point: the whole process, then stage by stage."""
    costs = [{"whole": p["process"]["cpu"], **p["stage_cpu_seconds"]} for p in points]
    whole = costs[-1]["whole"]
    for name in costs[-1]:
        work = [p["faces" if name in BY_FACES else "dofs"] for p in points]
        growth = fit_growth(work, [cost.get(name, 0.0) for cost in costs])
        yield name, growth.value if growth else None, costs[-1][name] / whole
