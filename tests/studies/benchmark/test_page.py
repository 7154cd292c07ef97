"""The benchmark's arithmetic: ratios; what is said of a way without a solve."""

import json

from solver.studies.benchmark.page import as_text, compared, ratios, seconds, write_benchmark

# 1500 MB over 12,345 unknowns.
MEMORY = ["1.50 GB", "121.51 kB/unknown"]
PROCESS = {"wall": 9.0, "cpu": 8.0, "peak_memory_mb": 1500.0}


def way(title, *totals, **more):
    """A way with warm repetitions of these processor seconds, or none."""
    times = {"total": {"cpu": list(totals), "wall": list(totals)}} if totals else {}
    return {
        "way": title,
        "outcome": "solved",
        "reason": "",
        "process": PROCESS,
        "times": times,
        "dofs": 12345,
        "linear_solver": "a factor",
        "linear_iterations": 0,
        "pressure_max": 3e-15,
        **more,
    }


LOST = {"way": "another", "outcome": "missing", "reason": "not installed", "times": {}}


def test_a_ways_time_is_the_median_of_its_repetitions_else_of_the_process():
    assert seconds(way("a", 3.0, 1.0, 2.0)) == 2.0
    assert seconds(way("a")) == 8.0
    assert seconds(way("a"), "wall") == 9.0
    assert seconds(LOST) is None


def test_ratios_are_those_to_the_first_way():
    ways = [way("a", 2.0), way("b", 1.0), LOST, way("c", 5.0)]
    assert ratios(ways) == [1.0, 0.5, None, 2.5]
    assert ratios([LOST, way("b", 1.0)]) == [None, None]


def test_a_comparison_in_lines():
    ways = [way("a", 2.0), way("b", 1.0, linear_iterations=7), LOST]
    ways.append(way("c", 1.0, pressure_max=0.0, resolved=2e-7))
    comparison = {"title": "T", "series": "HEXA8", "repetitions": 1, "ways": ways}
    title, rows = compared(comparison)
    assert title == "T (HEXA8, 12,345 unknowns; a warm solve)"
    assert rows == [
        ["a", "2.00 s", "×1.00", *MEMORY, "pressure error 3.0e-15", "a factor"],
        ["b", "1.00 s", "×0.50", *MEMORY, "pressure error 3.0e-15", "a factor, 7 iterations"],
        ["another", "missing: not installed"],
        ["c", "1.00 s", "×0.50", *MEMORY, "pressure error < 2e-07", "a factor"],
    ]


def test_the_whole_record_as_text():
    record = {
        "title": "Ratios",
        "machine": {"cpu": "a cpu", "time_utc": "2026"},
        "threads": 2,
        "load": 0.5,
        "whole": 9,
        "comparisons": [{"title": "T", "series": "S", "repetitions": 0, "ways": [way("a"), LOST]}],
    }
    lines = as_text(record).splitlines()
    assert lines[0] == "Ratios: a cpu, 2 threads, 2026"
    assert "  another                    missing: not installed" in lines
    assert lines[-1] == "benchmark took 9 s"


def test_the_page_shows_shares_above_one_and_speed_ups(tmp_path):
    """3 GB in 2 s are 1.5 GB/s: 1.5 times a bandwidth of 1 GB/s, 0.5 times one of 3 GB/s."""
    solves = [
        {"title": "HEXA8", "outcome": "solved", "threads": threads, "dofs": 12345}
        | {"bandwidth": bandwidth, "parts": {"solve": {"seconds": s, "bytes": 3e9, "cpu": 2.5}}}
        for threads, bandwidth, s in ((1, 1e9, 2.0), (2, 3e9, 1.25))
    ]
    comparison = {"title": "T <", "series": "S", "repetitions": 0, "ways": [way("a"), LOST]}
    machine = {"cpu": "a cpu", "time_utc": "2026-01-02T03:04:05", "revision": "abc"}
    record = {"title": "Ratios", "machine": machine, "threads": 2, "load": 0.5, "whole": 9}
    record |= {"comparisons": [comparison], "products": solves}
    page = write_benchmark(record, tmp_path / "ratios.json")
    assert json.loads((tmp_path / "ratios.json").read_text())["threads"] == 2
    text = page.read_text()
    assert "T &lt; (S, 12,345 unknowns; the whole process)" in text
    assert "missing: not installed" in text
    for words in ("1.5 GB/s</td><td class=n>1.50<", "2.4 GB/s</td><td class=n>0.80<"):
        assert words in text
    assert "1 → 2</td><td class=n>3.00<" in text  # bandwidth
    assert "1 → 2</td><td class=n>1.60<" in text  # 2 s over 1.25 s
