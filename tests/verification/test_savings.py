"""The time that a family saves: which solves are measured, and how it is summed up."""

import shutil
from dataclasses import replace

import pytest

from solver.simulation.options import LEAN, Options
from solver.verification import savings
from solver.verification.run import Job, solve
from solver.verification.stored import write_verdict
from tests.workflow.projects import write_case


@pytest.fixture(scope="module")
def family(tmp_path_factory):
    """Seven solves of one case, whose costs are set to 1 … 7 s; the last one left nothing out."""
    folder = tmp_path_factory.mktemp("family")
    write_case(folder, "block")
    first = folder / "0"
    verdict = solve(Job(folder / "block.yaml"), first / "result.vtkhdf", first / "verdict.json")
    assert verdict.switches
    for number in range(7):
        if number:
            shutil.copytree(first, folder / str(number))
        plan = verdict.plan if number < 6 else [["linear solver", "CHOLMOD", ""]]
        plan = [line for line in plan if number < 6 or not line[2]]
        changed = replace(verdict, cost=replace(verdict.cost, cpu_seconds=number + 1.0), plan=plan)
        write_verdict(folder / str(number) / "verdict.json", changed)
    return folder


def test_a_cheap_a_middle_and_a_dear_one_are_solved_both_ways(family, monkeypatch):
    monkeypatch.setattr(savings, "_cost", lambda case, mesh, way: {LEAN: 1.0}.get(way, 1.5))
    savings.write_savings(family, family / "saved.json")
    found = savings.read_savings(family / "saved.json")
    assert found == savings.Savings(
        jobs=["1", "3", "5"], seconds=21.0, cost=12.0, lean=3.0, everything=4.5
    )
    assert found.saved == 21.0 * 1.5 / 12.0


def test_the_costs_are_those_of_solves_with_and_without_everything(family, monkeypatch):
    ways = []
    monkeypatch.setattr(savings, "simulate", lambda case, mesh, way: ways.append(way))
    assert savings.measure([family / "2" / "result.vtkhdf"]).jobs == ["2"]
    assert ways == [LEAN, Options.everything()]


def test_where_nothing_is_left_out_nothing_is_measured(family):
    savings.write_savings(family / "none", family / "none.json")
    assert savings.read_savings(family / "none.json") is None
    assert savings.read_savings(family / "not-there.json") is None
    assert savings.measure([family / "6" / "result.vtkhdf"]) is None
    (family / "none.json").write_text("{")
    assert savings.read_savings(family / "none.json") is None
