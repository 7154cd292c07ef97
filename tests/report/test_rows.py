"""What a row of the report says of the reference of its solve."""

from pathlib import Path

from solver.report.formats import KINDS
from solver.report.rows import Row
from tests.report.verdicts import record


def row(*checks):
    """A row of a case with an analytical reference and checks of (name, reference)."""
    found = [{"name": name, "reference": value, "passed": True} for name, value in checks]
    verdict = record({"reference_kind": "analytical", "checks": found})
    return Row(verdict, Path("fam/job"))


def test_a_number_is_no_exact_solution():
    assert row(("force", 12.5)).origin(KINDS) == "force compared with a stated vector"
    both = row(("force", 12.5), ("contact_area", 3.0)).origin(KINDS)
    assert both == "force compared with a stated vector; contact_area compared with 3"


def test_a_field_is_compared_with_an_exact_solution():
    assert (
        row(("force", 12.5), ("multiplier", 25.0)).origin(KINDS) == "values that are known exactly"
    )
    assert row().origin(KINDS) == "values that are known exactly"
