"""Faults planted in the core turn the batch's own checks red, each of them; without, all pass."""

from pathlib import Path

import pytest

from tests.faults.mutants import MUTANTS
from tests.faults.planted import checks, planted, reason, verdict
from tests.pairs.faults import FAULTS
from tests.views.test_views import PLANTED

PAGE = Path(__file__).resolve().parents[2] / "docs" / "design" / "faults.md"


@pytest.mark.parametrize("case", sorted({mutant.case for mutant in MUTANTS}))
def test_the_case_passes_as_the_program_is(case):
    assert verdict(case)["passed"], verdict(case)["reason"]


@pytest.mark.parametrize("mutant", MUTANTS, ids=[mutant.name for mutant in MUTANTS])
def test_a_planted_fault_is_caught(mutant):
    why = reason(mutant)
    assert why
    # A patch that does not fit its function would crash as well, and show nothing.
    assert not why.startswith("crashed") or mutant.name == "stale-system"


def test_pressure_by_forces_does_not_depend_on_the_gap_operator():
    """Of 97 % of the area the multiplier is 1/0.97 times the pressure; the forces stay."""
    [lost] = [mutant for mutant in MUTANTS if mutant.name == "area-lost"]
    with planted(lost):
        found = checks(lost.case)
    assert found["multiplier"].error == pytest.approx(1 / 0.97 - 1, rel=1e-9)
    assert found["element_pressure"].error < 1e-13


def test_the_page_lists_them_all():
    listed = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if "| `" in line]
    rows = [f"| `{m.name}` | {m.what} | {m.case} |" for m in MUTANTS]
    meeting = [
        f"| `{fault.name}` | {fault.what} | {'; '.join(map(': '.join, fault.options.items()))} |"
        for fault in FAULTS
    ]
    seen = [line for line in listed if line.split("`")[1] in PLANTED]
    assert listed == rows + meeting + seen
    assert len(seen) == len(PLANTED)
    assert len({m.name for m in (*MUTANTS, *FAULTS)}) == len(rows + meeting)
    assert f"It catches {len(rows)} of {len(rows)} faults." in PAGE.read_text(encoding="utf-8")
