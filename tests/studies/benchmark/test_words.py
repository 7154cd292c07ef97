"""The benchmark's arithmetic: ratios, exponents, shares; what is said of a way without a solve."""

import pytest

from solver.studies.benchmark.words import (
    batched,
    by_series,
    compared,
    grown,
    ratios,
    seconds,
    stages,
)

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
    head, first, second, lost, coarse = compared(comparison)
    assert head == "T (HEXA8, 12,345 unknowns; a warm solve)"
    assert "×1.00" in first
    assert "×0.50" in second
    assert "a factor, 7 iterations" in second
    assert lost.split() == ["another", "missing:", "not", "installed"]
    assert "pressure error < 2e-07" in coarse


def point(size, series="hexa8", **more):
    """Solve grows with exponent 1.5 over unknowns, pairing with 2 over faces."""
    cost = {"pairing": 1e-6 * (size / 10) ** 2, "solve": 1e-3 * size**1.5}
    return {
        "series": series,
        "cells": "HEXA8",
        "size": size,
        "outcome": "solved",
        "reason": "",
        "dofs": size,
        "faces": size // 10,
        "stage_cpu_seconds": cost,
        "process": PROCESS | {"cpu": 4 * cost["solve"]},
        "linear_solver": "a factor",
        "errors": {"pressure_max": 1e-14},
        **more,
    }


def test_exponents_and_shares_stage_by_stage():
    found = {name: (value, share) for name, value, share in stages([point(1000), point(4000)])}
    assert found["whole"] == (pytest.approx(1.5), 1.0)
    assert found["solve"] == (pytest.approx(1.5), pytest.approx(0.25))
    assert found["pairing"][0] == pytest.approx(2.0)


def test_growth_in_lines():
    lost = point(9000, outcome="failed", reason="no end within 1 s")
    text = list(grown([point(1000), point(4000), lost]))
    assert text[0] == "Growth of HEXA8"
    assert text[1] == "  9,000: failed: no end within 1 s"
    assert "exponent  1.50 over unknowns  100.0 %" in text[2]
    assert text[-1].startswith("  4,000 unknowns: ")
    assert list(grown([lost])) == text[:2]
    # One size has a share and no exponent.
    assert "exponent     –" in list(grown([point(1000)]))[1]


def test_points_are_grouped_by_series():
    points = [point(1000), point(2000, "quad4"), point(4000)]
    assert [[p["size"] for p in group] for group in by_series(points)] == [[1000, 4000], [2000]]


def test_the_batch_in_lines():
    each = [{"case": "a", "cpu": 1.5}, {"case": "b", "cpu": 2.5}]
    passes = [{"cpu": 1.5, "wall": 1.0}, {"cpu": 1.0, "wall": 1.0}]
    together = {"outcome": "solved", "process": {"cpu": 3.0}, "passes": passes}
    _, alone, one, warm, goal = batched(
        {"title": "T", "most": 2.0, "each": each, "together": together}
    )
    assert alone.split()[-3:] == ["4.00", "s", "×1.00"]
    # The process less its second pass: what it would have taken without.
    assert one.split()[-3:] == ["2.00", "s", "×0.50"]
    assert warm.split()[-3:] == ["1.00", "s", "×0.25"]
    assert "under 2 s" in goal
    lost = {"outcome": "crashed", "reason": "out of luck"}
    text = list(batched({"title": "T", "most": 2.0, "each": each, "together": lost}))
    assert text[-1].endswith("crashed: out of luck")
