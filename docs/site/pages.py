"""What the pages ask for when they become a site: tables, the menu, a first page.

The menu is made from the lists of links on the front page, a section each. A page of docs/ that is
in no list comes last, so that a new one is never forgotten; the design log is in no menu.
"""

import re
from pathlib import Path
from posixpath import join, normpath
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from tables import TABLES

from solver.case.typed import is_section, titles_of

# A link to a table, alone on its line: the site has the table there.
_TABLE = re.compile(r"^\[.*\]\(design/tables/(.*)\.md\)$", re.MULTILINE)
_SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
_LINK = re.compile(r"^- \[(.*)\]\((.+)\.md\)", re.MULTILINE)
_DESIGN = "docs/design/"
_FIRST = (
    '<!doctype html><meta charset="utf-8"><title>{0}</title>'
    '<meta http-equiv="refresh" content="0; url={1}"><a href="{1}">{0}</a>'
)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("source-read", _tables)
    app.connect("source-read", _menu)
    app.connect("build-finished", _first_page)
    app.connect("autodoc-process-docstring", _keys)
    return {"parallel_read_safe": True}


def _keys(_: Sphinx, __: str, ___: str, kind: object, ____: object, lines: list[str]) -> None:
    """The keys of a file as a list."""
    if is_section(kind):
        head = lines[: lines.index("")] if "" in lines else lines
        lines[:] = [*head, "", *(f"- ``{key}``: {title}" for key, title in titles_of(kind).items())]


def _tables(_: Sphinx, page: str, source: list[str]) -> None:
    def made(match: re.Match[str]) -> str:
        if match[1] not in TABLES:
            raise ExtensionError(
                f"{page}: there is no table {match[1]}; known: {', '.join(TABLES)}"
            )
        return TABLES[match[1]]()

    source[0] = _TABLE.sub(made, source[0])


def _menu(app: Sphinx, page: str, source: list[str]) -> None:
    if page.startswith(_DESIGN):  # outside the menu
        source[0] = f"---\norphan: true\n---\n{source[0]}"
    if page != app.config.root_doc:
        return
    folder = page.rpartition("/")[0]
    before, *parts = _SECTION.split(source[0])
    sections = dict(zip(parts[::2], parts[1::2], strict=True))
    listed = {
        normpath(join(folder, to)) for text in sections.values() for _, to in _LINK.findall(text)
    }
    known = {name for name in app.env.found_docs if not name.startswith(_DESIGN)}
    rest = sorted(known - listed - {page})
    if rest:
        links = [f"- [](/{name}.md)" for name in rest]  # a link without words has the page's title
        sections["More"] = "\n\n" + "\n".join(links) + "\n\n"
    menus = [_toctree(title, _LINK.findall(text), folder) for title, text in sections.items()]
    lists = [f"## {title}{text}" for title, text in sections.items()]
    source[0] = before + "".join(lists) + "\n" + "\n".join(menus)


def _toctree(caption: str, links: list[tuple[str, str]], folder: str) -> str:
    places = [(title, join("/", folder, to)) for title, to in links]
    entries = [f"{title} <{place}>" if title else place for title, place in places]
    return "\n".join(["```{toctree}", ":hidden:", f":caption: {caption}", "", *entries, "```", ""])


def _first_page(app: Sphinx, failure: Exception | None) -> None:
    """Where a reader begins who opens the folder: leads to the front page."""
    if failure is None and app.builder.name == "html":
        page = _FIRST.format(app.config.html_title, f"{app.config.root_doc}.html")
        (Path(app.outdir) / "index.html").write_text(page, encoding="utf-8")
