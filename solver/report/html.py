"""Common to all pages: templates, style, and the words for kinds and checks."""

from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from . import formats, stages
from .charts import SCRIPT
from .families import page_name, paragraphs

# What each check looks at, in the order of the table of checks.
MEANING = {
    "multiplier": "contact pressure: the multiplier of every macro-element",
    "nodal_stress": "normal stress at every node of both bodies",
    "surface_stress_slave": "normal stress on the slave surface",
    "surface_stress_master": "normal stress on the master surface",
    "element_pressure": "pressure of every contact element, from the forces at the slave nodes",
    "element_gap": "average gap of every contact element, relative to the block size",
    "element_status": "contact status of every contact element: 1 in contact, 0 open",
    "coverage": "intersected area over the area of the macro-element",
    "covered_pressure": "coverage × pressure",
    "displacement": "displacement at every node",
    "stress_components": "the other components of stress at every node",
    "integration_stress": "stress at the integration points, from the displacement alone",
    "balance": "contact forces of both sides, and reactions against loads: forces and moments",
    "force": "contact force on the surface listed as slave",
    "contact_area": "area of contact",
    "reaction": "forces that hold groups",
    "moment": "moment of contact on rigid bodies, about their reference points",
    "displacement_at": "displacement at probes",
    "stress_at": "stress at probes",
    "pressure_at": "contact pressure at probes",
    "strain_energy": "strain energy of all bodies",
    "counts": "cells and contact faces of the bodies before the cut",
    "observation": "pressure of one contact element at every load step",
    "observation_gap": "gap of one contact element at every load step",
}
# Errors against exact solutions, which are checks where a case gives them a tolerance.
NORMS = {
    "displacement_l2": "displacement, L2",
    "displacement_h1": "displacement, H1",
    "stress_l2": "stress, L2",
    "pressure_l2": "pressure, L2",
    "pressure_max": "pressure, maximum",
    "pressure_means": "pressure, macro-element means",
    "pressure_total": "pressure, its integral",
    "pressure_oscillation": "pressure, second difference",
    "pressure_inner": "pressure, two macro-elements inside",
    "half_width": "half-width of contact",
    "peak": "peak pressure",
    "stress_max": "stress, largest at nodes",
}
MEANING |= {name: f"error of {what}, relative" for name, what in NORMS.items()}
KINDS = {
    "analytical": "an exact solution",
    "manufactured": "a solution chosen first, with loads derived from it",
    "refined": "our own result on a much finer mesh",
    "other_code": "another code's result",
}


PAGE = "summary.html"
TEMPLATES = Path(__file__).parent / "templates"


def render(template: Path, **values: Any) -> str:
    """A page from a study's own template, which may extend the report's templates."""
    return environment(template.parent).get_template(template.name).render(values)


@cache
def environment(*folders: Path) -> Environment:
    """Where templates come from (`folders`, then the report's own), with the formats of numbers."""
    templates = Environment(
        loader=FileSystemLoader([*folders, TEMPLATES]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {
        "error": formats.error,
        "number": formats.number,
        "seconds": formats.seconds,
        "duration": formats.duration,
        "gigabytes": formats.gigabytes,
        "count": formats.count,
    }
    templates.globals |= {
        "formats": formats,
        "bar": stages.bar,
        "kinds": KINDS,
        "main_page": PAGE,
        "page_name": page_name,
        "paragraphs": paragraphs,
        "style": style(),
        "script": _template("sort.js"),
        "chart_script": SCRIPT,
    }
    return templates


def style() -> Markup:
    """The style sheet of all pages."""
    return _template("style.css")


def _template(name: str) -> Markup:
    return Markup((TEMPLATES / name).read_text(encoding="utf-8"))
