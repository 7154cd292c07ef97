"""The first screen of the report: four cards, each an answer with its numbers and its page.

Two show a study. Once it was run there, its result is in the folder of the report; until then a
recorded one is shown, with its machine, date and revision.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..verification.savings import Savings, read_savings
from .charts import MANY, RED, Axis, Chart, Look, level, series_chart, shade_of
from .families import CodeError
from .rows import Row, families, ours
from .sections import FamilySection

RECORDED = Path(__file__).with_name("recorded")
# What each switch of `solver.simulation.options.Shortcuts` leaves out, in the order of the work.
WORK = {
    "quadrature": "Gauss points beyond those needed",
    "unloaded": "bodies that nothing moves",
    "status": "solves that only confirm a contact",
}


@dataclass(frozen=True)
class StudyCard:
    """What a card shows of a study: its content, its page, and where it was measured."""

    content: Mapping[str, Any]
    link: str
    remark: str


def study_card(name: str, folder: Path) -> StudyCard | None:
    """The study of the folder of a report, else a part of it, else the recorded one."""
    for file in (folder / f"{name}-card.json", folder / f"{name}-quick-card.json"):
        if content := _read(file):
            part = (
                "" if content["level"] == "full" else f"a part of the study: {content['level']}. "
            )
            return StudyCard(content, f"{content['page']}.html", part + content["measured"])
    if not (content := _read(RECORDED / f"{name}.json")):
        return None
    facts = dict(content["facts"])
    shown = ", ".join(facts[key] for key in ("Machine", "Measured", "Revision") if facts.get(key))
    return StudyCard(content, "", f"Recorded: {shown}. make {name} measures it here.")


def _read(file: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


def curves(card: StudyCard) -> Chart | None:
    """Error over time of each treatment of one problem."""
    records = [record for record in card.content["curves"] if record["error"]]
    if not records:
        return None
    names = list(dict.fromkeys(record["series"] for record in records))
    looks = {name: Look(MANY[i % len(MANY)]) for i, name in enumerate(names)}
    return series_chart(
        "first-error-time",
        f"Error of the pressure against run time: {card.content['chart']}",
        records,
        Axis("time", "time, s", log=True),
        Axis("error", "error", log=True),
        looks,
        tips={"unknowns": "unknowns"},
        layers=[level(1e-3, "0.1 %", RED)],
        order="level",
        width=300,
        height=150,
    )


def shade(digits: int | None) -> str:
    """The colour of so many digits; None: there is no result."""
    return RED if digits is None else shade_of(digits)


@dataclass(frozen=True)
class PatchCard:
    """The patch test: the pressures of all solves beside the exact one, and what another code has.

    `error` relative; `codes`: errors of the reference code.
    """

    section: FamilySection
    least: float
    most: float
    exact: float
    error: float
    solves: int
    unit: str
    codes: Sequence[CodeError]


def patch_card(sections: Sequence[FamilySection]) -> PatchCard | None:
    """Of the first family with a reference code, whose solves have one pressure as reference."""
    for section in sections:
        checks = [
            check
            for row in ours(section.rows)
            for check in row.verdict.checks
            if check.name == "multiplier"
        ]
        exact = {check.reference for check in checks}
        if section.family.reference_code and len(exact) == 1:
            return PatchCard(
                section,
                min(check.minimum for check in checks),
                max(check.maximum for check in checks),
                exact.pop(),
                max(check.error for check in checks),
                len({row.name for row in ours(section.rows)}),
                section.unit("stress"),
                section.family.reference_code,
            )
    return None


@dataclass(frozen=True)
class WorkCard:
    """Work that was left out: seconds of processor time, those spent, solves by kind of work."""

    saved: float
    spent: float
    kinds: Mapping[str, int]
    solves: int

    @property
    def share(self) -> float:
        """The part that was saved of what all the work would cost."""
        return self.saved / (self.saved + self.spent) if self.spent else 0.0


# By family: solves, how many of them left out each kind of `WORK`, and the time that saved.
LeftOut = dict[str, tuple[int, list[int], Savings | None]]


def work_card(rows: Sequence[Row], left_out: LeftOut) -> WorkCard:
    """The sums over all families."""
    found = left_out.values()
    counts = [sum(column) for column in zip(*(used for _, used, _ in found), strict=True)]
    saved = sum(time.saved for _, _, time in found if time)
    spent = sum(row.verdict.cost.cpu_seconds or 0.0 for row in ours(rows))
    kinds = dict(zip(WORK.values(), counts, strict=False))
    return WorkCard(saved, spent, kinds, sum(count for count, _, _ in found))


def left_out_by_family(rows: Sequence[Row], folder: Path) -> LeftOut:
    """What solves left out; the times are in `folder`, that of the report."""
    found: LeftOut = {}
    solved = [row for row in ours(rows) if row.verdict.cost.dofs]
    for family, mine in families(solved).items():
        counts = [sum(switch in row.verdict.switches for row in mine) for switch in WORK]
        found[family] = len(mine), counts, read_savings(folder / "saved" / f"{family}.json")
    return found


def of(sections: Sequence[FamilySection], folder: Path, left_out: LeftOut) -> dict[str, Any]:
    """The cards by name; None where there is nothing to show."""
    rows = [row for section in sections for row in section.rows]
    study = study_card("study", folder)
    return {
        "study": study,
        "curves": curves(study) if study else None,
        "stability": study_card("stability", folder),
        "work": work_card(rows, left_out),
        "patch": patch_card(sections),
        "shade": shade,
    }
