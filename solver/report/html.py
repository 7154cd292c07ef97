"""What all pages of the report share: templates, style, and the words for kinds and checks."""

from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from solver.report import PAGE, formats
from solver.report.families import page_name, paragraphs
from solver.report.formats import ERROR_LABELS

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
    "counts": "cells and contact faces of the bodies as meshed",
    "observation": "pressure of one contact element at every load step",
    "observation_gap": "gap of one contact element at every load step",
}
# Errors against exact solutions, which are checks where a case gives them a tolerance.
NORMS = {
    **ERROR_LABELS,
    "stress_max": "stress, largest at nodes",
    "pressure_oscillation": "pressure, second difference",
    "half_width": "half-width of contact",
    "peak": "peak pressure",
}
MEANING |= {name: f"error of {what}, relative" for name, what in NORMS.items()}
KINDS = {
    "analytical": "an exact solution",
    "manufactured": "a solution chosen first, loads derived from it",
    "refined": "our own result on a much finer mesh",
    "other_code": "another code's result",
}


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
    templates.globals |= {
        "formats": formats,
        "kinds": KINDS,
        "main_page": PAGE,
        "page_name": page_name,
        "paragraphs": paragraphs,
        "style": style(),
        "script": _template("sort.js"),
    }
    return templates


def style() -> Markup:
    """The style sheet of all pages."""
    return _template("style.css")


def _template(name: str) -> Markup:
    return Markup((Path(__file__).parent / "templates" / name).read_text(encoding="utf-8"))
