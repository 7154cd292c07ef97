"""The page of a study: one template for all figures, sections with charts and tables."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from markupsafe import Markup

from ..report.charts import Chart, write_script
from ..report.formats import menu, render
from ..report.tables import as_csv
from ..system.files import write_text
from .description import FULL, Study, StudyGroup
from .points import points_of

Record = Mapping[str, Any]
SOLVED, REFUSED, MISSING = "solved", "refused", "missing"
# A machine that was busier than this when a point began may have disturbed it.
_BUSY = 1.0
_PACKAGES = ("python", "numpy", "scipy")
Cell = str | Markup


@dataclass(frozen=True)
class TableRow:
    """A row of a table: its cells, its anchor, and its style (`lost`, `first`)."""

    cells: Sequence[Cell]
    name: str = ""
    kind: str = ""


@dataclass(frozen=True)
class Table:
    """A table of texts. The first `left` columns, and those without a heading, are words."""

    head: Sequence[Cell]
    rows: Sequence[TableRow]
    caption: str = ""
    left: int = 1

    def text(self) -> str:
        """The table for a terminal."""
        rows = [[str(Markup(cell).striptags()) for cell in row] for row in self._cells()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [
            "  ".join(
                cell.ljust(width) if i < self.left or not self.head[i] else cell.rjust(width)
                for i, (cell, width) in enumerate(zip(row, widths, strict=True))
            )
            for row in rows
        ]
        return "\n".join(filter(None, [self.caption, *(line.rstrip() for line in lines)]))

    def _cells(self) -> list[list[Cell]]:
        rows = [list(self.head), *(list(row.cells) for row in self.rows)]
        return [row + [""] * (len(self.head) - len(row)) for row in rows]


@dataclass(frozen=True)
class PageSection:
    """A part of a page; `text` may be markup, `figures` are shown side by side."""

    name: str
    title: str
    text: Cell = ""
    figures: Sequence[Chart] = ()
    tables: Sequence[Table] = ()


@dataclass(frozen=True)
class Shown:
    """What a figure makes of its groups: sections, what does not hold, and the outcome."""

    sections: list[PageSection]
    problems: list[str] = field(default_factory=list)
    outcome: str = ""


@dataclass(frozen=True)
class MeasuredGroup:
    """A group with the records of its points; one without a record says so."""

    study: Study
    group: StudyGroup
    points: list[dict[str, Any]]
    machine: Record

    @property
    def title(self) -> str:
        """As shown."""
        return self.group.title or self.group.name.replace("-", " ").capitalize()

    @property
    def solved(self) -> list[dict[str, Any]]:
        """The points that have a result."""
        return [point for point in self.points if point["outcome"] == SOLVED]

    @property
    def lines(self) -> dict[str, list[dict[str, Any]]]:
        """The points of each line."""
        return grouped(self.points, lambda point: str(point["line"]))


def read_group(study: Study, group: StudyGroup, folder: Path) -> MeasuredGroup:
    """A group with the records in `folder`."""
    from .run import identity

    expected = [identity(point) for point in points_of(study, group)]
    try:
        content = json.loads((folder / f"{group.name}.json").read_text(encoding="utf-8"))
        known = {point["name"]: point for point in content["points"] if point["outcome"]}
        machine = content["machine"]
    except (OSError, ValueError, KeyError, TypeError):
        known, machine = {}, {}
    lost = {"outcome": MISSING, "reason": "not measured"}
    points = [known.get(point["name"], point | lost) for point in expected]
    return MeasuredGroup(study, group, points, machine)


def grouped(items: Iterable[Any], key: Callable[[Any], Any]) -> dict[Any, list[Any]]:
    """Items of equal keys together, in their order."""
    found: dict[Any, list[Any]] = {}
    for item in items:
        found.setdefault(key(item), []).append(item)
    return found


def why_not(point: Record) -> str:
    """Why a point has no result."""
    return f"{point['outcome']}: {point['reason']}" if point["reason"] else str(point["outcome"])


def lost_points(groups: Sequence[MeasuredGroup], allowed: Sequence[str] = ()) -> list[str]:
    """Points without a result, a line each, but for outcomes that are allowed."""
    return [
        f"{one.group.name}/{point['name']}: {why_not(point)}"
        for one in groups
        for point in one.points
        if point["outcome"] not in (SOLVED, *allowed)
    ]


def measured(groups: Sequence[MeasuredGroup]) -> str:
    """The number of points with a result."""
    points = [point for one in groups for point in one.points]
    lost = sum(point["outcome"] != SOLVED for point in points)
    text = f"{len(points) - lost} of {len(points)} points are measured."
    return text + (f" {lost} have no result, each with its reason." if lost else "")


def disturbed(groups: Sequence[MeasuredGroup]) -> int:
    """The number of timed points that began on a busy machine."""
    solved = [point for one in groups for point in one.solved if "load" in point]
    return sum(point["load"] > point["threads"] + _BUSY for point in solved)


def facts(groups: Sequence[MeasuredGroup]) -> list[tuple[str, str]]:
    """When and on which machine was measured; empty where nothing was."""
    machines = [one.machine for one in groups if one.machine and one.solved]
    if not machines:
        return []

    def all_of(key: str) -> str:
        return ", ".join(sorted({str(machine.get(key, "")) for machine in machines}))

    times = sorted(machine["time_utc"][:16].replace("T", " ") for machine in machines)
    timed = [point for one in groups for point in one.solved if "threads" in point]
    return [
        ("Measured", " … ".join(dict.fromkeys([times[0], times[-1]])) + " UTC"),
        ("Machine", all_of("cpu")),
        *[("Threads", ", ".join(sorted({str(p["threads"]) for p in timed})))] * bool(timed),
        ("Revision", all_of("revision")),
        ("Versions", ", ".join(f"{name} {all_of(name)}" for name in _PACKAGES)),
    ]


_LONG = 12
"""A list of more items is left out of the table for machines."""


def page_name(study: Study, level: str) -> str:
    """The name of a study's page and of its tables, without suffix."""
    return study.name if level == FULL else f"{study.name}-{level}"


def show(study: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """The sections, problems and outcomes of all groups, figure by figure."""
    parts = [
        import_module(f".figures.{figure}", __package__).show(study, members)
        for figure, members in grouped(groups, lambda g: g.group.figure or study.figure).items()
    ]
    return Shown(
        [section for part in parts for section in part.sections],
        [line for part in parts for line in part.problems],
        " ".join(part.outcome for part in parts if part.outcome) or measured(groups),
    )


def write_study(study: Study, results: Path, folder: Path, level: str = FULL) -> str:
    """Write a study's page, its table and what does not hold into `folder`.

    `results` holds the record of each group. Returns what does not hold, and the outcome.
    """
    groups = [read_group(study, group, results) for group in study.groups]
    return write_page(study, groups, folder, level)


def write_page(
    study: Study, groups: Sequence[MeasuredGroup], folder: Path, level: str = FULL
) -> str:
    """The same of groups that are measured; see `write_study`."""
    name, shown = page_name(study, level), show(study, groups)
    busy = disturbed(groups)
    page = render(
        Path(__file__).with_name("page.html.jinja"),
        charts=True,
        title=study.title + f" ({level})" * (level != FULL),
        text=study.text,
        table=f"{name}.csv",
        menu=menu(folder),
        sections=shown.sections,
        outcome=shown.outcome,
        good=not shown.problems,
        problems=shown.problems,
        facts=facts(groups),
        disturbed=busy if study.threads > 1 else 0,
    )
    failures = "".join(f"{line}\n" for line in shown.problems)
    write_text(folder / f"{name}.html", page)
    write_text(folder / f"{name}.csv", as_csv(rows(groups)))
    write_text(folder / f"{name}-failures.txt", failures)
    if card := card_of(study, groups, level):
        write_text(folder / f"{name}-card.json", json.dumps(card, ensure_ascii=False) + "\n")
    write_script(folder)
    return f"{failures}{shown.outcome} Page: {folder / name}.html"


def card_of(study: Study, groups: Sequence[MeasuredGroup], level: str) -> dict[str, Any]:
    """What the first screen of the report shows of a study; nothing where its figure has none."""
    figure = import_module(f".figures.{study.figure}", __package__)
    mine = [one for one in groups if not one.group.figure and one.solved]
    if not hasattr(figure, "card") or not mine:
        return {}
    known = {"page": page_name(study, level), "level": level, "measured": measured(groups)}
    return known | {"facts": facts(groups)} | figure.card(mine)


def rows(groups: Sequence[MeasuredGroup]) -> list[dict[str, Any]]:
    """One row for each point, those without a result too; nested numbers as `times_solve_cpu`."""
    found = [{"group": one.group.name} | _flat(point) for one in groups for point in one.points]
    keys = dict.fromkeys(key for row in found for key in row)
    return [{key: row.get(key) for key in keys} for row in found]


def _flat(item: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in item.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{before}{key}_")
        elif isinstance(value, list):
            if len(value) <= _LONG and not any(isinstance(v, Mapping) for v in value):
                flat[before + key] = " ".join(map(str, value))
        else:
            flat[before + key] = value
    return flat
