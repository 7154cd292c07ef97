"""The page of a study: one template for all figures, a table, and what does not hold."""

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from ..report.charts import write_script
from ..report.html import render
from ..report.tables import as_csv
from ..system.files import write_text
from .description import FULL, Study
from .shown import MeasuredGroup, Shown, disturbed, facts, grouped, measured, read_group

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
    write_script(folder)
    return f"{failures}{shown.outcome} Page: {folder / name}.html"


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
