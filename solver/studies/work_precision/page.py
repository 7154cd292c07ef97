"""The page itself, and the table for machines."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...report import stages
from ...report.charts import write_script
from ...report.html import NORMS, render
from ...report.tables import as_csv
from ...system.files import write_text
from ..points import REFUSED, SOLVED, disturbed, facts, outcome, page_name
from ..timing import TOTAL, spread
from . import first
from .description import AUTO, Problem, Study
from .figure import LIMIT, Looks, draw_figure, draw_note
from .records import (
    ERRORS,
    TARGETS,
    TIE,
    LevelLine,
    Panel,
    TimedSolve,
    failures,
    lines,
    panels,
    read_points,
)

# The errors that the table at the top shows.
_OVERVIEW = ("pressure_l2", "pressure_means", "displacement_l2", "stress_l2")


def write_study(study: Study, results: Path, folder: Path) -> str:
    """Write the page and its table into `folder`; `results` holds the records.

    Returns one line: what was measured, and where the page is.
    """
    points, name = read_points(study, results), page_name("study", study.size)
    sections = [_section(problem, points) for problem in study.problems]
    solvers = _linear_solvers(study, points)
    write_script(folder)
    write_text(folder / f"{name}.csv", as_csv(rows(points)))
    write_text(folder / f"{name}.html", _to_html(study, points, name, sections, solvers))
    return f"{outcome(points)} Page: {folder / name}.html"


def rows(points: Sequence[TimedSolve]) -> list[dict[str, Any]]:
    """One row for each point, those without a solve too: errors, and times with their spread."""
    names = _stage_names(points)
    return [_row(m, names) for m in points]


def _stage_names(points: Sequence[TimedSolve]) -> list[str]:
    return list(dict.fromkeys(stage for m in points for stage in m.record.get("times", ())))


def _row(m: TimedSolve, stage_names: Sequence[str]) -> dict[str, Any]:
    record, p = m.record, m.point
    row = {
        "problem": p.problem.name,
        "slave": p.slave,
        "master": p.master,
        "treatment": p.treatment.name,
        "linear_solver": p.linear_solver,
        "level": p.level,
        "outcome": record["outcome"],
        "reason": record["reason"],
    }
    row |= {k: record.get(k) for k in ("dofs", "macro_elements", "iterations", "factor")}
    row |= {error: m.error(error) for error in ERRORS}
    for stage in stage_names:
        for kind in ("wall", "cpu"):
            values = record.get("times", {}).get(stage, {}).get(kind)
            found = spread(values) if values else None
            for key in ("median", "low", "high"):
                row[f"{stage}_{kind}_{key}"] = getattr(found, key, None)
    process = record.get("process") or {}
    row |= {f"process_{k}": process.get(k) for k in ("wall", "cpu", "peak_memory_mb")}
    return row | {"threads": record.get("threads"), "load": record.get("load")}


def _section(problem: Problem, points: Sequence[TimedSolve]) -> dict[str, Any]:
    """A problem: its panels with figures and tables, and where the time goes."""
    mine = [m for m in points if m.point.problem is problem and m.point.linear_solver == AUTO]
    return {"id": problem.name, "problem": problem} | _shown(problem, lines(mine))


def _shown(problem: Problem, found: Sequence[LevelLine], prefix: str = "") -> dict[str, Any]:
    looks = Looks(found)
    finest = ((line, [m for m in line.levels if m.solved][-1:]) for line in found)
    return {
        "panels": [_part(panel, looks, prefix) for panel in panels(problem, found)],
        "costs": [(line, m) for line, last in finest for m in last],
    }


def _part(panel: Panel, looks: Looks, prefix: str) -> dict[str, Any]:
    return {
        "panel": panel,
        "id": f"{prefix}{panel.name}",
        "charts": draw_figure(panel, looks, prefix),
        "note": draw_note(panel),
        "quickest": {target: panel.quickest(target) for target in TARGETS},
    }


def _firsts(
    sections: Sequence[dict[str, Any]],
) -> list[tuple[str, str, str, dict[float, first.First]]]:
    """Problem, pair and error, and who is first to each accuracy; see `first`."""
    return [
        (section["problem"].title, pair, part["panel"].error, found)
        for section in sections
        for part in section["panels"]
        if part["panel"].error in _OVERVIEW
        for pair, found in first.firsts(part["panel"]).items()
        if any(one.solve for one in found.values())
    ]


def _linear_solvers(study: Study, points: Sequence[TimedSolve]) -> list[dict[str, Any]]:
    """A section for each problem and pair on which the linear solver is varied.

    The linear solver changes the time alone: one error is enough.
    """
    sections = []
    for chosen in dict.fromkeys(varied[:4] for varied in study.varied):
        mine = [
            m
            for m in points
            for p in [m.point]
            if (p.problem.name, p.slave, p.master, p.treatment.name) == chosen
        ]
        found = _shown(mine[0].point.problem, lines(mine), "linear-solver-")
        sections.append(found | {"panels": found["panels"][:1]})
    return sections


def _to_html(
    study: Study,
    points: Sequence[TimedSolve],
    name: str,
    sections: Sequence[dict[str, Any]],
    solvers: Sequence[dict[str, Any]],
) -> str:
    found = _firsts(sections)
    words = [one.word for row in found for one in row[3].values()]
    return render(
        Path(__file__).with_name("page.html.jinja"),
        charts=True,
        title=study.title + f" ({study.size})" * (name != "study"),
        name=name,
        sections=sections,
        solvers=solvers,
        outcome=outcome(points),
        good=all(m.record["outcome"] in (SOLVED, REFUSED) for m in points),
        failures=failures(points),
        facts=facts(points),
        disturbed=0 if study.threads == 1 else disturbed(points),
        busy=disturbed(points),
        repetitions=study.repetitions,
        targets=TARGETS,
        firsts=found,
        first_targets=first.TARGETS,
        won=sum(word in (first.RECOVERED, first.TIED) for word in words),
        decided=sum(word != first.NONE for word in words),
        tie=f"{100 * (TIE - 1):.0f} %",
        limit=LIMIT,
        errors=NORMS,
        overview=_OVERVIEW,
        stages=stages.colors(s for s in _stage_names(points) if s != TOTAL),
    )
