"""What goes with what: a page with the digits of a run."""

from collections.abc import Sequence
from itertools import combinations
from math import log10
from pathlib import Path

from solver.report.formats import PAGE, render
from solver.system.files import write_text

from .judge import Outcome
from .options import EXCLUDED, OPTIONS, REFUSED, Row
from .table import lines_of

_TEMPLATE = Path(__file__).with_name("page.html.jinja")
_EMPTY, _STIFF = "–", "stiff master"


def page(target: Path, outcomes: Sequence[tuple[Row, Outcome]], said: str, good: bool) -> None:
    """Write the page of a run."""
    digits: dict[frozenset[str], float] = {}
    for row, outcome in outcomes:
        error = outcome.error if outcome.word == "exact" else 1.0
        found = min(16.0, -log10(max(error, 1e-16)))
        for pair in map(frozenset, combinations(row, 2)):
            if row["materials"] == _STIFF and "materials" not in pair:
                continue  # fewer digits by themselves
            digits[pair] = min(digits.get(pair, 16.0), found)
    names = list(OPTIONS)
    table = [
        [_cell(digits.get(frozenset((one, other))), one, other) for other in names[:i]]
        for i, one in enumerate(names)
    ]
    wrong = [
        (", ".join(f"{name}: {value}" for name, value in row.items()), f"{o.word}: {o.what}")
        for row, o in outcomes
        if o.word != "exact"
    ]
    write_text(
        target,
        render(
            _TEMPLATE,
            title="What goes with what",
            outcome=said,
            good=good,
            main_page=PAGE,
            options=OPTIONS,
            table=table,
            refused=list(lines_of(REFUSED)),
            excluded=list(lines_of(EXCLUDED)),
            wrong=wrong,
        ),
    )


def _cell(digits: float | None, one: str, other: str) -> tuple[str, str]:
    """The digits of the worst case with two options, and whether some of their values are apart."""
    between = [rule for rule in REFUSED if {one, other} <= rule.when.keys()]
    text = _EMPTY if digits is None else f"{digits:.0f}"
    return text, "refused" if between else ""
