"""Common to all pages: templates, style, and the words for kinds and checks."""

from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from . import formats, stages
from .charts import SCRIPT
from .families import page_name, paragraphs

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
