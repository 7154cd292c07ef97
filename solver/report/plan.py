"""What the solves of a family left out, and why."""

from collections.abc import Sequence
from dataclasses import dataclass

from solver.report.rows import Row

# What each switch of `solver.simulation.options.Shortcuts` leaves out, in the order of the work.
TITLES = {
    "quadrature": "more Gauss points, closure of integrals",
    "unloaded": "groups of bodies that nothing moves",
    "status": "further active-set solves and factors",
}


@dataclass(frozen=True)
class LeftOut:
    """One switch: what it leaves out, the reasons given, in how many solves."""

    what: str
    why: str
    solves: int


def left_out(rows: Sequence[Row]) -> list[LeftOut]:
    """The table of a family, a line a switch; empty where nothing was left out."""
    found = []
    for skip, title in TITLES.items():
        mine = [
            (row.name, line[1]) for row in rows for line in row.verdict.plan if skip in line[2:]
        ]
        if mine:
            reasons = dict.fromkeys(why for _, why in mine)
            found.append(LeftOut(title, "; ".join(reasons), len({name for name, _ in mine})))
    return found
