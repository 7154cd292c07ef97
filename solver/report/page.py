"""The page for people: one file that needs no network and no script."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from solver.report import formats
from solver.report.errors import draw_errors, drawn, floor
from solver.report.families import read_family
from solver.report.pictures import picture
from solver.report.rows import Row, counted, families
from solver.report.tables import outcome

# What each check looks at, in the order of the table of checks.
MEANING = {
    "multiplier": "contact pressure: the multiplier of every macro-element",
    "nodal_stress": "normal stress at every node of both bodies",
    "surface_stress_slave": "normal stress on the slave surface",
    "surface_stress_master": "normal stress on the master surface",
    "element_pressure": "pressure of every contact element",
    "element_gap": "average gap of every contact element, over the block size",
    "element_status": "contact status of every contact element: 1 in contact, 0 open",
    "coverage": "intersected area over the area of the macro-element",
    "covered_pressure": "coverage × pressure",
    "displacement": "displacement at every node",
    "stress_components": "the other components of stress at every node",
    "balance": "contact forces and reactions against the loads: forces and moments",
    "observation": "pressure of one contact element at every load step",
    "observation_gap": "gap of one contact element at every load step",
}
KINDS = {
    "analytical": "an exact solution",
    "manufactured": "a solution chosen first, loads derived from it",
    "refined": "a much finer mesh",
    "other_code": "another code's result",
}
# Stages in the order of the work, in colours that the colour-blind tell apart.
STAGES = {
    "read": "#999999",
    "mesh": "#bbbbbb",
    "cut": "#e69f00",
    "pairing": "#56b4e9",
    "assembly": "#009e73",
    "solve": "#0072b2",
    "recovery": "#cc79a7",
    "checks": "#d55e00",
    "write": "#f0e442",
}


def to_html(rows: Sequence[Row], pictures: Path, orders: bool = False) -> str:
    """The page; pictures are kept in the folder `pictures` for the next time.

    `orders` says whether the page of orders of convergence is there beside it.
    """
    checks = {check["name"]: check for row in rows for check in row.checks or ()}
    return (
        environment()
        .get_template("summary.html.jinja")
        .render(
            rows=rows,
            orders=orders,
            bad=[row for row in rows if row.word != "passed"],
            outcome=outcome(rows),
            counts=counted(rows),
            families=[_section(name, members) for name, members in families(rows).items()],
            facts=_facts(rows),
            checks=[checks[name] for name in sorted(checks, key=_order)],
            meaning=MEANING,
            kinds=KINDS,
            stages={name: STAGES.get(name, "#777777") for name in _stages(rows)},
            picture=lambda row: picture(row, pictures),
            formats=formats,
            style=style(),
        )
    )


def environment() -> Environment:
    """Where the templates of all pages come from, with the formats of numbers."""
    templates = Environment(
        loader=PackageLoader("solver.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {
        "error": formats.error,
        "number": formats.number,
        "seconds": formats.seconds,
    }
    return templates


def style() -> Markup:
    """The style sheet of all pages."""
    return Markup((Path(__file__).parent / "templates/style.css").read_text(encoding="utf-8"))


def _section(name: str, rows: Sequence[Row]) -> dict[str, Any]:
    """One family: its description, its rows by kind of reference, its figure."""
    family = read_family(name)
    points = drawn(rows)
    kinds = {row.reference_kind: None for row in rows}
    return {
        "name": name,
        "family": family,
        "rows": rows,
        "outcome": outcome(rows),
        "by_kind": {kind: [r for r in rows if r.reference_kind == kind] for kind in kinds},
        "figure": draw_errors(rows, family.reference_code) if points else "",
        "floor": floor(points),
        "not_drawn": [row for row in rows if row not in points],
    }


def _facts(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """When, where and with what the solves ran."""
    origins = [row.provenance for row in rows if row.provenance]
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
    return row.total, row.cpu_seconds


def _order(name: str) -> tuple[int, str]:
    known = list(MEANING)
    return (known.index(name) if name in MEANING else len(known), name)


def _stages(rows: Sequence[Row]) -> list[str]:
    found = dict.fromkeys(stage for row in rows for stage in row.stages)
    return [stage for stage in STAGES if stage in found] + [s for s in found if s not in STAGES]
