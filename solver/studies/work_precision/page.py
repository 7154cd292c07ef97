"""The page itself, its figures as files, and the table for machines."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from solver.report import measured, raster, stages
from solver.report.html import environment
from solver.report.tables import as_csv
from solver.studies.timing import TOTAL, spread
from solver.studies.work_precision import FULL, words
from solver.studies.work_precision.description import AUTO, Problem, Study
from solver.studies.work_precision.figure import LIMIT, Looks, draw_figure, draw_note
from solver.studies.work_precision.point import SOLVED
from solver.studies.work_precision.records import (
    ERRORS,
    TARGETS,
    Line,
    Measured,
    Panel,
    failures,
    lines,
    panels,
    read_points,
)

# The errors that the table at the top shows.
_OVERVIEW = ("pressure_l2", "pressure_means", "displacement_l2", "stress_l2")


def page_name(study: Study) -> str:
    """The name of the page, of its table and of the folder of its figures."""
    return "study" if study.size == FULL else f"study-{study.size}"


def write_study(
    study: Study, results: Path, folder: Path, log: Callable[[str], Any] = print
) -> None:
    """Write the page, its table and its figures into `folder`; `results` holds the records.

    Logs one line: what was measured, and where the page is.
    """
    from solver.system.files import replacing, write_text

    points = read_points(study, results)
    name = page_name(study)
    sections = [_section(problem, points) for problem in study.problems]
    solvers = _linear_solvers(study, points)
    contents = {f"{name}.html": _to_html(study, points, sections, solvers)}
    contents[f"{name}.csv"] = as_csv(rows(points))
    figures = {
        f"{name}/{part['file']}": part["figure"]
        for section in (*sections, *solvers)
        for part in section["panels"]
    }
    for file, content in (contents | figures).items():
        write_text(folder / file, content)
    for file, figure in figures.items() if raster.available() else ():
        with replacing((folder / file).with_suffix(".png")) as temporary:
            temporary.write_bytes(raster.to_png(figure))
    log(f"{outcome(points)} Page: {folder / name}.html")


def outcome(points: Sequence[Measured]) -> str:
    """How many points there are, and how many have no solve."""
    lost = sum(not m.solved for m in points)
    text = f"{len(points) - lost} of {len(points)} points are measured."
    return text + (f" {lost} have no solve, each with its reason." if lost else "")


def rows(points: Sequence[Measured]) -> list[dict[str, Any]]:
    """One row for each point, those without a solve too: errors, and times with their spread."""
    names = dict.fromkeys(stage for m in points for stage in m.record["times"])
    return [_row(m, list(names)) for m in points]


def _row(m: Measured, stage_names: Sequence[str]) -> dict[str, Any]:
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
            values = record["times"].get(stage, {}).get(kind)
            found = spread(values) if values else None
            for key in ("median", "low", "high"):
                row[f"{stage}_{kind}_{key}"] = getattr(found, key, None)
    process = record.get("process") or {}
    row |= {f"process_{k}": process.get(k) for k in ("wall", "cpu", "peak_memory_mb")}
    return row | {"threads": record.get("threads"), "load": record.get("load")}


def _section(problem: Problem, points: Sequence[Measured]) -> dict[str, Any]:
    """A problem: its words, and its panels with their figures, tables and paragraphs."""
    mine = [m for m in points if m.point.problem is problem and m.point.linear_solver == AUTO]
    found = lines(mine)
    return {
        "id": problem.name,
        "title": problem.title,
        "description": problem.description,
        "reference": problem.reference,
    } | _shown(problem, found)


def _shown(problem: Problem, found: Sequence[Line]) -> dict[str, Any]:
    looks = Looks(found)
    return {
        "panels": [_part(panel, looks) for panel in panels(problem, found)],
        "costs": _costs(found),
    }


def _part(panel: Panel, looks: Looks) -> dict[str, Any]:
    return {
        "panel": panel,
        "file": f"{panel.name}.svg",
        "figure": draw_figure(panel, looks),
        "note": draw_note(panel),
        "text": words.paragraph(panel),
        "fastest": {target: panel.ranked(target)[:1] for target in TARGETS},
    }


def _costs(found: Sequence[Line]) -> list[tuple[Line, Measured]]:
    """The finest solve of every line, for the table of where the time goes."""
    return [
        (line, solved[-1]) for line in found if (solved := [m for m in line.levels if m.solved])
    ]


def _linear_solvers(study: Study, points: Sequence[Measured]) -> list[dict[str, Any]]:
    """A section for each problem and pair on which the linear solver is varied."""
    problems = {problem.name: problem for problem in study.problems}
    sections = []
    for name, slave, master, treatment in dict.fromkeys(v[:4] for v in study.varied):
        mine = [
            m
            for m in points
            for p in [m.point]
            if (p.problem.name, p.slave, p.master, p.treatment.name)
            == (name, slave, master, treatment)
        ]
        problem = problems[name]
        shown = _shown(problem, lines(mine))
        # The linear solver changes the time; one error tells what was bought with it.
        first = shown["panels"][:1]
        for part in first:
            part["file"] = f"linear-solver-{part['file']}"
        title = f"{problem.title}, {slave}–{master}"
        sections.append({"title": title} | shown | {"panels": first})
    return sections


def _to_html(
    study: Study,
    points: Sequence[Measured],
    sections: Sequence[dict[str, Any]],
    solvers: Sequence[dict[str, Any]],
) -> str:
    solved = [m.record for m in points if m.solved]
    return (
        environment()
        .get_template("study.html.jinja")
        .render(
            study=study,
            name=page_name(study),
            sections=sections,
            solvers=solvers,
            outcome=outcome(points),
            failures=failures(points),
            facts=measured.facts(solved),
            disturbed=measured.disturbed(solved),
            good=all(m.record["outcome"] in (SOLVED, "refused") for m in points),
            repetitions=study.repetitions,
            targets=TARGETS,
            limit=LIMIT,
            errors=ERRORS,
            overview=_OVERVIEW,
            png=raster.available(),
            words=words,
            stages=stages.colors(s for m in points for s in m.record["times"] if s != TOTAL),
        )
    )
