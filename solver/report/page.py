"""The pages for people: the main one, and one a family; no network is needed."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..case.checks import BY_NAME, ERRORS
from . import stages
from .overview import (WORK, cause, digit_chart, digits_kept, error_chart, extreme_cases, fewest_digits, in_words, left_out_by_family)
from .charts import Chart
from .html import TEMPLATES, render
from .pictures import VIEWER, picture, profile
from .rows import Row, causes, choices, ours
from .sections import FamilySection, grouped
from .tables import outcome

# Pages beside the report that other commands write.
_PAGES = {
    "study": "error against run time, LAC and other treatments",
    "stability": "numerical stability",
    "scaling": "scaling",
    "infsup": "inf-sup test",
    "benchmark": "time ratios",
    "bench": "other codes on the same cases",
    "compare": "comparison with another batch",
}
_TABLES = {"JSON": "summary.json", "CSV": "summary.csv", "Markdown": "summary.md"}
# Where `make docs` writes the documentation, from the folder of a report.
_DOCS = "../docs/index.html"

# What each switch of `solver.simulation.options.Shortcuts` leaves out, in the order of the work.
LEFT_OUT = {
    "quadrature": "more Gauss points, closure of integrals",
    "unloaded": "groups of bodies that nothing moves",
    "status": "further active-set solves and factors",
}


def main_page(sections: Sequence[FamilySection], folder: Path) -> str:
    """The main page: what was verified, failures first, one table a family."""
    rows = [row for section in sections for row in section.rows]
    bad = [row for row in ours(rows) if not row.sound]
    checks = {check.name: check for row in rows for check in row.verdict.checks}
    return render(
        TEMPLATES / "summary.html.jinja",
        title="Verification of contact solves",
        sortable=True,
        rows=rows,
        charts=True,
        links=_links(folder),
        bad=bad,
        causes=causes(bad),
        choices=choices(rows),
        verified=in_words(rows),
        errors=error_chart(ours(rows)),
        digits=digit_chart(rows),
        extremes=extreme_cases(folder),
        fewest=fewest_digits(rows),
        digits_kept=digits_kept,
        cause=cause,
        left_out=left_out_by_family(rows, folder),
        switches=WORK,
        good=bool(rows) and not bad,
        outcome=outcome(rows),
        groups=grouped(sections),
        origin=_facts(rows),
        checks=[checks[name] for name in sorted(checks, key=_order)],
        meaning={name: check.what for name, check in BY_NAME.items()},
        folder=folder,
    )


def family_page(section: FamilySection, folder: Path) -> str:
    """The page of a family: problem, reference, figures, its solves case by case."""
    return render(
        TEMPLATES / "family.html.jinja",
        title=section.family.title,
        charts=True,
        viewer_script=VIEWER,
        sortable=True,
        outcome=section.outcome,
        good=not section.bad,
        section=section,
        choices=choices(section.rows),
        orders=(folder / f"orders-{section.name}.html").is_file(),
        norms=ERRORS,
        stages=_stages(section.rows),
        picture=lambda row: picture(row, section.pictures),
        pressure=lambda row: _pressure(row, section.pictures),
        left_out=left_out(section.rows),
        folder=folder,
    )


def _pressure(row: Row, pictures: Path) -> Chart | str:
    """The chart of the pressure beside the picture of a 2D solve, which does not show it."""
    chart = profile(row, pictures) if row.dim == 2 else ""
    return replace(chart, name=f"case-{row.name}") if isinstance(chart, Chart) else ""


def _links(folder: Path) -> dict[str, str]:
    """Tables beside the report, the documentation, and pages of other commands that are there."""
    pages = {title: f"{name}.html" for name, title in _PAGES.items()}
    there = {"Documentation": _DOCS} | pages
    found = {title: target for title, target in there.items() if (folder / target).is_file()}
    return _TABLES | {"JUnit": "junit.xml"} | found


def left_out(rows: Sequence[Row]) -> list[tuple[str, str, int]]:
    """Shortcuts by switch: title, reasons given, number of solves."""
    found = []
    for switch, title in LEFT_OUT.items():
        lines = [(row.name, line) for row in rows for line in row.verdict.plan]
        reasons = [(name, line[1]) for name, line in lines if switch in line[2:]]
        if reasons:
            names, whys = map(dict.fromkeys, zip(*reasons, strict=True))
            found.append((title, "; ".join(whys), len(names)))
    return found


def _facts(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """When, where and with what the solves ran."""
    origins = [row.verdict.provenance for row in rows if row.verdict.provenance]
    if not origins:
        return []

    def all_of(key: str) -> str:
        return ", ".join(sorted({str(o[key]) for o in origins if o.get(key)}))

    times = sorted(str(o["time_utc"])[:16] for o in origins if o.get("time_utc"))
    span = " … ".join(dict.fromkeys(times[:1] + times[-1:])).replace("T", " ")
    packages = ("python", "numpy", "scipy", "scikit-fem", "gmsh")
    facts = {
        "Solved": f"{span} UTC" if span else "",
        "Revision": all_of("revision"),
        "Machine": f"{all_of('cpu')}, {all_of('cores')} cores" if all_of("cpu") else "",
        "Versions": ", ".join(f"{p} {all_of(p)}" for p in packages if all_of(p)),
        "Time of all solves": _times(rows),
    }
    return [(key, value) for key, value in facts.items() if value]


def _times(rows: Sequence[Row]) -> str:
    wall, cpu = (sum(t or 0 for t in times) for times in zip(*map(_costs, rows), strict=True))
    return f"{wall:.1f} s wall, {cpu:.1f} s cpu, one after another"


def _costs(row: Row) -> tuple[float | None, float | None]:
    return row.total, row.verdict.cpu_seconds


def _order(name: str) -> tuple[int, str]:
    known = list(BY_NAME)
    return (known.index(name) if name in BY_NAME else len(known), name)


def _stages(rows: Sequence[Row]) -> dict[str, str]:
    """The stages that occur, in their order, with their colours."""
    return stages.colors(stage for row in rows for stage in row.stages)
