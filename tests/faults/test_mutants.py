"""Faults planted in the core turn the batch's own checks red, each of them; without, all pass."""

from pathlib import Path

import pytest

from tests.faults.mutants import MUTANTS, reason, verdict

PAGE = Path(__file__).resolve().parents[2] / "docs" / "faults.md"


@pytest.mark.parametrize("case", sorted({mutant.case for mutant in MUTANTS}))
def test_the_case_passes_as_the_program_is(case):
    assert verdict(case)["passed"], verdict(case)["reason"]


@pytest.mark.parametrize("mutant", MUTANTS, ids=[mutant.name for mutant in MUTANTS])
def test_a_planted_fault_is_caught(mutant):
    why = reason(mutant)
    assert why
    # A patch that does not fit its function would crash as well, and show nothing.
    assert not why.startswith("crashed") or mutant.name == "stale-system"


def test_the_page_lists_them_all():
    listed = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if "| `" in line]
    rows = [f"| `{m.name}` | {m.what} | {m.case} |" for m in MUTANTS]
    assert listed == rows
    assert len({m.name for m in MUTANTS}) == len(rows)
    assert f"{len(rows)} of {len(rows)} are caught" in PAGE.read_text(encoding="utf-8")
