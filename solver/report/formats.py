"""What all pages share: templates, style, numbers and times in words, names of kinds and stages."""

import math
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from ..verification.verdict import Body
from .charts import SCRIPT
from .families import page_name, paragraphs

NOTHING = "–"
# Below this share of its scale a number is round-off, and shown as zero.
ROUND_OFF = 1e-12


def number(value: float | None) -> str:
    """Four significant digits, and no negative zero."""
    return NOTHING if value is None or math.isnan(value) else f"{value + 0.0:.4g}"


def error(value: float | None) -> str:
    """Two digits and the power of ten; a zero is a zero."""
    return NOTHING if value is None or math.isnan(value) else "0" if value == 0 else f"{value:.1e}"


def percent(value: float | None) -> str:
    """A relative error as people say it: percent from 0.01 % on, a power of ten below."""
    if value is None or math.isnan(value):
        return NOTHING
    return f"{100 * value:.2g} %" if value >= 1e-4 else error(value)


def extremes(pair: Sequence[float | None] | None, scale: float | None = None) -> str:
    """Minimum … maximum; one number where both show alike; zero for round-off of `scale`."""
    return " … ".join(both(pair, scale))


def both(pair: Sequence[float | None] | None, scale: float | None = None) -> list[str]:
    """Minimum and maximum, or the one number where both show alike."""
    if not pair:
        return [NOTHING]
    return list(dict.fromkeys(_near_zero(value, scale) for value in pair))


def near(value: float | None, scale: float | None) -> str:
    """Six digits, and zero for round-off of `scale`."""
    if value is None or math.isnan(value):
        return NOTHING
    return "0" if scale and abs(value) < ROUND_OFF * scale else f"{value + 0.0:.6g}"


def _near_zero(value: float | None, scale: float | None) -> str:
    if value is None or not scale or abs(value) >= 1e-6 * scale:
        return number(value)
    return "0" if abs(value) < ROUND_OFF * scale else f"{value:.1e}"


def vector(values: Sequence[float], scale: float = 0.0) -> str:
    """Numbers in four digits, those below 1e-9 of the scale as zero."""
    return ", ".join(number(value if abs(value) > 1e-9 * scale else 0.0) for value in values)


def seconds(value: float | None) -> str:
    """Hundredths; more than a hundred seconds are whole."""
    if value is None or math.isnan(value):
        return NOTHING
    return f"{value:.2f} s" if value < 100 else f"{value:.0f} s"


def duration(value: float) -> str:
    """Two digits: `12 ms`, `0.12 s`, `1.2 s`; from ten seconds on whole ones."""
    if abs(value) < 0.0995:
        return f"{value * 1000:.2g} ms"
    return f"{value:.2g} s" if abs(value) < 9.95 else f"{value:.0f} s"


def gigabytes(value: float) -> str:
    """Bytes in two digits: `12 MB`, `1.2 GB`; from ten gigabytes on whole ones."""
    if value < 0.0995e9:
        return f"{value / 1e6:.2g} MB"
    return f"{value / 1e9:.2g} GB" if value < 9.95e9 else f"{value / 1e9:.0f} GB"


def count(value: float) -> str:
    """A whole number: `102,357`."""
    return f"{value:,.0f}"


def types(body: Body) -> str:
    """The cell types of a body."""
    return ", ".join(body.cells)


def against(count: int, reference: int | None) -> str:
    """A count beside the reference code's."""
    return f"{count}" if reference is None else f"{count} / {reference}"


def digits(value: float | None) -> str:
    """All the digits there are."""
    return NOTHING if value is None or math.isnan(value) else f"{value + 0.0:.15g}"


def formula(text: str) -> Markup:
    """Text with what follows `_` set lower and what follows `^` higher: `σ_xx`, `r^(1/3)`."""
    lowered = re.sub(r"_([^\W⁰¹²³⁴-⁹]+)", r"<sub>\1</sub>", str(escape(text)))
    return Markup(re.sub(r"\^(?:\(([^)]*)\)|(\w+))", r"<sup>\1\2</sup>", lowered))


def symbols(text: str) -> Markup:
    """Text in which `_` and `^` after a single letter are set as in formulas: `c_n`, `a^(n+1)`."""
    parts = re.split(r"(?<!\w)([^\W\d_](?:_\w+|\^\w+|\^\([^)]*\))+)(?!\w)", text)
    return Markup("").join(formula(part) if i % 2 else part for i, part in enumerate(parts))


# In the order of the work, in colours that colour-blind readers can distinguish.
COLORS = {
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
_OTHER = "#777777"


def colors(found: Iterable[str]) -> dict[str, str]:
    """The stages found, each once, in the order of the work, with their colours."""
    every = dict.fromkeys(found)
    known = [stage for stage in COLORS if stage in every]
    return {s: COLORS.get(s, _OTHER) for s in [*known, *(s for s in every if s not in COLORS)]}


def in_words(seconds: Mapping[str, float]) -> str:
    """The times of the stages in one line."""
    return ", ".join(f"{stage} {seconds[stage]:.3f} s" for stage in colors(seconds))


def bar(seconds: Mapping[str, float], total: float) -> Markup:
    """The shares of the stages in the total time as a bar, their times under the pointer."""
    parts, end = [], 0.0
    for stage, color in colors(seconds).items():
        end += 100 * seconds[stage] / total
        parts.append(f"{color} 0 {end:.0f}%")
    tag = '<span class=bar title="{}" style="background:linear-gradient(90deg,{},#0000 0)"></span>'
    return Markup(tag).format(in_words(seconds), ",".join(parts))


KINDS = {
    "analytical": "values that are known exactly",
    "manufactured": "a solution chosen first, with loads derived from it",
    "refined": "our own result on a much finer mesh",
    "other_code": "another code's result",
}


PAGE = "summary.html"
# Pages beside the report that other commands write, with what they are called.
PAGES = {
    "study": "error against run time",
    "stability": "numerical stability",
    "scaling": "scaling",
    "infsup": "inf-sup test",
    "benchmark": "time ratios",
    "pairs": "every pair of options",
    "bench": "other codes",
    "compare": "comparison",
}
# Where `make docs` writes the documentation, from the folder of a report.
DOCS = "../docs/index.html"


def menu(folder: Path, families: Mapping[str, str] | None = None) -> dict[str, dict[str, str]]:
    """The pages in `folder` by group and title: families, studies and comparisons, docs."""
    pages = {title: f"{name}.html" for name, title in PAGES.items()}
    pages |= {f"{title} (a part)": f"{name}-quick.html" for name, title in PAGES.items()}
    there = {words: file for words, file in pages.items() if (folder / file).is_file()}
    found = {"Families": dict(families or {"all families": f"{PAGE}#families"})}
    found["Studies and comparisons"] = there
    found["Documentation"] = {"documentation": DOCS} if (folder / DOCS).is_file() else {}
    return {group: pages for group, pages in found.items() if pages}


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
        "error": error,
        "percent": percent,
        "number": number,
        "seconds": seconds,
        "duration": duration,
        "gigabytes": gigabytes,
        "count": count,
    }
    templates.globals |= {
        "formats": sys.modules[__name__],
        "bar": bar,
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
