"""The pages for people: the main one, and one a family; no network is needed.

The first screen has how well, error against run time, digits kept, work left out.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..case.checks import BY_NAME, ERRORS
from . import cards, formats
from .cards import WORK, left_out_by_family
from .charts import (
    BLUE,
    EPSILON,
    MUTED,
    ORANGE,
    RED,
    Axis,
    Chart,
    Look,
    floor_band,
    level,
    series_chart,
)
from .errors import address, against_time, drawn, mark, unknowns
from .formats import TEMPLATES, render
from .pictures import VIEWER, picture, profile
from .positions import positions
from .rows import Row, causes, choices, ours
from .sections import FamilySection, grouped
from .tables import outcome

_DIMENSIONS = {2: "2D", 3: "3D"}
_DIGITS_OF_DOUBLE = -math.log10(EPSILON)
_SHOWN = 0.0, 16.0  # whole marks at the upper end
# With fewer digits a result is unreliable (`solver.simulation.equilibrium.state`).
_FEWEST = 4
_WORST = 10
# What may cost the digits of a solve, by the keys of `Verdict.accuracy`.
CAUSES = {
    "forces": "forces: terms far larger than their sum",
    "gap": "gap: a difference of rounded displacements",
    "coordinates": "coordinates far from the origin",
    "stress": "strain: a difference of rounded displacements",
    "slender": "small faces of slender cells",
    "arms": "bodies that are all but free to move",
    "sums": "cells with many nodes",
}


def in_words(rows: Sequence[Row]) -> str:
    """What was verified and how well, in one sentence."""
    said = []
    for judged, text in (
        ("exact", "{} reach an exact answer, with errors up to {}"),
        ("expected error", "{} have the error that refined meshes predict, at most {}"),
        ("stated tolerance", "{} keep a stated tolerance, with errors up to {}"),
    ):
        mine = [row for row in ours(rows) if row.sound and row.verdict.judged == judged]
        if errors := [row.accuracy for row in mine if row.accuracy]:
            worst, check = max(errors)
            words = f"{formats.percent(worst)} ({check.replace('_', ' ')})"
            said.append(text.format(len(mine), words))
    types = {name for row in ours(rows) for body in row.sides for name in body.cells}
    on = f" on {len(types)} cell types" if types else ""
    return f"Of {len(ours(rows))} solves{on}, {'; '.join(said)}." if said else ""


def error_chart(rows: Sequence[Row]) -> Chart | None:
    """The worst error of every solve over its run time; family and cell type to be picked."""
    shown = drawn(rows)
    if not shown:
        return None
    records = [mark(row) for row in shown]
    errors = [record["error"] for record in records]
    chart = against_time(
        records,
        domain=(min(errors) / 3, max(errors) * 3),
        tips=("case", "check", "family", "cells"),
        layers=[floor_band(unknowns(shown))],
        size=(1200, 330),
    )
    families = list(dict.fromkeys(str(record["family"]) for record in records))
    cells = sorted({name for row in shown for name in row.tags["cells"]})
    picks = [_pick("family", families), _pick("cells", cells)]
    wanted = " && ".join(
        f"(!pick_{field} || indexof(split(datum.{field}, ' '), pick_{field}) >= 0)"
        for field in ("family", "cells")
    )
    layers = [dict(layer) for layer in chart.spec["layer"]]
    layers[-1]["transform"] = [{"filter": wanted}]
    return replace(chart, spec=chart.spec | {"params": picks, "layer": layers})


def digit_chart(rows: Sequence[Row]) -> Chart | None:
    """The digits that rounding leaves, as each solve estimates them, over its unknowns."""
    known = [
        row for row in ours(rows) if row.verdict.estimates.attainable and row.verdict.cost.dofs
    ]
    if not known:
        return None
    records: list[dict[str, Any]] = [
        {
            "series": _DIMENSIONS.get(row.dim, "other"),
            "case": row.name,
            "unknowns": row.verdict.cost.dofs,
            "digits": digits_kept(row),
            "cause": cause(row),
            "url": address(row),
        }
        for row in known
    ]
    looks = {"2D": Look(BLUE), "3D": Look(ORANGE, "square"), "other": Look(MUTED)}
    found = {record["series"] for record in records}
    return series_chart(
        "digits-kept",
        "Digits that rounding leaves in each solve",
        records,
        Axis("unknowns", "unknowns", log=True),
        Axis("digits", "digits kept", domain=_SHOWN),
        {name: look for name, look in looks.items() if name in found},
        lines=False,
        tips={"case": "case", "cause": "lost by"},
        layers=[level(_FEWEST, "fewer: unreliable", RED)],
        width=560,
        height=230,
    )


def digits_kept(row: Row) -> float:
    """How many decimal digits rounding leaves in the pressure, by the estimate of the solve."""
    return _digits(row.verdict.estimates.attainable or 1.0)


def _digits(error: float) -> float:
    return min(max(-math.log10(error or EPSILON), 0.0), _DIGITS_OF_DOUBLE)


def cause(row: Row) -> str:
    """What costs a solve most of its digits."""
    name, _ = max(
        row.verdict.estimates.accuracy.items(), key=lambda item: item[1], default=("", 0.0)
    )
    return CAUSES.get(name, name)


def fewest_digits(rows: Sequence[Row]) -> list[Row]:
    """The ten solves that keep the fewest digits."""
    known = [row for row in ours(rows) if row.verdict.estimates.attainable]
    return sorted(known, key=lambda row: (digits_kept(row), row.anchor))[:_WORST]


def _pick(field: str, names: Sequence[str]) -> dict[str, object]:
    """A list above the chart from which one value of a field is chosen."""
    choice = {"input": "select", "options": ["", *names], "labels": ["all", *names]}
    return {"name": f"pick_{field}", "value": "", "bind": choice | {"name": f"{field}: "}}


_TABLES = {"JSON": "summary.json", "CSV": "summary.csv", "Markdown": "summary.md"}


def main_page(sections: Sequence[FamilySection], folder: Path) -> str:
    """The main page: what was verified, failures first, one table a family."""
    rows = [row for section in sections for row in section.rows]
    bad = [row for row in ours(rows) if not row.sound]
    work = left_out_by_family(rows, folder)
    checks = {check.name: check for row in rows for check in row.verdict.checks}
    return render(
        TEMPLATES / "summary.html.jinja",
        title="Verification of contact solves",
        sortable=True,
        rows=rows,
        charts=True,
        links=_links(folder),
        menu=_menu(sections, folder),
        cards=cards.of(sections, folder, work),
        bad=bad,
        causes=causes(bad),
        choices=choices(rows),
        verified=in_words(rows),
        errors=error_chart(ours(rows)),
        digits=digit_chart(rows),
        fewest=fewest_digits(rows),
        digits_kept=digits_kept,
        cause=cause,
        left_out=work,
        switches=WORK,
        good=bool(rows) and not bad,
        outcome=outcome(rows),
        groups=grouped(sections),
        origin=_facts(rows),
        checks=[checks[name] for name in sorted(checks, key=_order)],
        meaning={name: check.what for name, check in BY_NAME.items()},
        folder=folder,
    )


def _menu(sections: Sequence[FamilySection], folder: Path) -> dict[str, dict[str, str]]:
    return formats.menu(folder, {one.family.title: one.page for one in sections})


def family_page(
    section: FamilySection, folder: Path, sections: Sequence[FamilySection] = ()
) -> str:
    """The page of a family: its solves, problem, reference, figures, each solve in a panel."""
    return render(
        TEMPLATES / "family.html.jinja",
        title=section.family.title,
        charts=True,
        menu=_menu(sections or [section], folder),
        viewer_script=VIEWER,
        sortable=True,
        outcome=section.outcome,
        good=not section.bad,
        section=section,
        choices=choices(section.rows),
        orders=(folder / f"orders-{section.name}.html").is_file(),
        norms=ERRORS,
        picture=lambda row: picture(row, section.pictures),
        pressure=lambda row: _pressure(row, section.pictures),
        positions=positions,
        left_out=left_out(section.rows),
        folder=folder,
    )


def _pressure(row: Row, pictures: Path) -> Chart | str:
    """The chart of the pressure beside the picture of a 2D solve, which does not show it."""
    chart = profile(row, pictures) if row.dim == 2 else ""
    return replace(chart, name=f"case-{row.name}") if isinstance(chart, Chart) else ""


def _links(folder: Path) -> dict[str, str]:
    """Tables beside the report, the documentation, and pages of other commands that are there."""
    pages = formats.menu(folder)
    pages.pop("Families")
    return _TABLES | {"JUnit": "junit.xml"} | {t: f for g in pages.values() for t, f in g.items()}


def left_out(rows: Sequence[Row]) -> list[tuple[str, str, int]]:
    """Shortcuts by switch: title, reasons given, number of solves."""
    found = []
    for switch, title in WORK.items():
        lines = [(row.name, line) for row in rows for line in row.verdict.plan]
        reasons = [(name, line[1]) for name, line in lines if switch in line[2:]]
        if reasons:
            names, whys = map(dict.fromkeys, zip(*reasons, strict=True))
            found.append((title, "; ".join(whys), len(names)))
    return found


def _facts(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """When, where and with what the solves ran."""
    origins = [row.verdict.files.provenance for row in rows if row.verdict.files.provenance]
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
    return row.total, row.verdict.cost.cpu_seconds


def _order(name: str) -> tuple[int, str]:
    known = list(BY_NAME)
    return (known.index(name) if name in BY_NAME else len(known), name)
