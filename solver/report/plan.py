"""What the solves of a family left out, why, and what that saves where it was measured."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from solver.report.rows import Row

FILE = Path("benchmark/savings.json")
"""What `solver.studies.benchmark.savings` writes, in the folder of results."""
UNMEASURED = "not measured: make benchmark"
# What each switch of `solver.simulation.skips.Skips` leaves out, in the order of the work.
TITLES = {
    "cut": "the cut of slave cells",
    "clipping": "clipping of faces",
    "quadrature": "more Gauss points, closure of integrals",
    "unloaded": "groups of bodies that nothing moves",
    "apart": "one factor for all bodies",
    "status": "further active-set solves and factors",
    "refinement": "further refinement",
}


@dataclass(frozen=True)
class LeftOut:
    """One switch: what it leaves out, the reasons given, in how many solves, what it saves."""

    what: str
    why: str
    solves: int
    saved: str


Savings = Mapping[str, Mapping[str, Any]]


def read_savings(results: Path) -> Savings:
    """The measured savings by job; none where there is no such file, or none that can be read."""
    try:
        jobs = json.loads((results / FILE).read_text(encoding="utf-8"))["jobs"]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return jobs if isinstance(jobs, dict) else {}


def left_out(rows: Sequence[Row], savings: Savings) -> list[LeftOut]:
    """The table of a family, a line a switch; empty where nothing was left out."""
    found = []
    for skip, title in TITLES.items():
        mine = [(row, line) for row in rows for line in row.verdict.plan if _switch(line) == skip]
        if mine:
            reasons = dict.fromkeys(line[1] for _, line in mine)
            names = dict.fromkeys(row.name for row, _ in mine)
            measured = {name: saved(name, skip, savings) for name in names if name in savings}
            told = "; ".join(f"{name}: {text}" for name, text in measured.items()) or UNMEASURED
            found.append(LeftOut(title, "; ".join(reasons), len(names), told))
    return found


def saved(job: str, skip: str, savings: Savings) -> str:
    """What a switch saves in one solve, in words; empty for a line that has no switch."""
    if not skip:
        return ""
    lines: Iterable[Mapping[str, Any]] = savings.get(job, {}).get("lines", ())
    line = next((line for line in lines if line["skip"] == skip), None)
    if line is None:
        return UNMEASURED
    if line["low"] <= 0:
        return f"nothing that shows ({_ms(line['low'])} … {_ms(line['high'])} ms)"
    share = line["median"] / savings[job]["seconds"]
    return f"{_ms(line['median'])} ms, {share:.0%} of the solve"


def with_savings(row: Row, savings: Savings) -> list[tuple[str, str, str]]:
    """The plan of one solve: what was left out, why, what that saves."""
    return [
        (line[0], line[1], saved(row.name, _switch(line), savings)) for line in row.verdict.plan
    ]


def _switch(line: Sequence[str]) -> str:
    return line[2] if len(line) > 2 else ""


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.1f}".replace("-", "−")
