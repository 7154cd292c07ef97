"""The pages: links as a forge follows them, parts made from the sources, formulas."""

import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from solver.case.checks import CHECKS, ERRORS
from solver.case.file import Pick
from solver.case.solutions.catalogue import SOLUTIONS
from solver.case.typed import fields
from solver.mesh.keys import RECIPES
from tests.case.test_keys import sections

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "docs" / "site"
PAGES = [
    *(
        ROOT / name
        for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "results/README.md")
    ),
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "design").glob("*.md")),
]
ASKED = re.compile(r"^\[.*\]\(design/tables/(.*)\.md\)$", re.MULTILINE)
CODE = re.compile(r"^(```+).*?^\1$|`[^`\n]+`", re.MULTILINE | re.DOTALL)


@pytest.fixture
def site(monkeypatch):
    monkeypatch.syspath_prepend(SITE)
    return importlib.import_module


def slugs(page: Path) -> set[str]:
    """The anchors that a forge gives to headings."""
    text = re.sub(
        r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    heads = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_to_files_and_headings(page):
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.exists(), link
        assert not anchor or anchor in slugs(target), link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_sources_that_pages_name_exist(page):
    """By their path, in `docs/design/` by their name too."""
    text = page.read_text(encoding="utf-8")
    for name in set(re.findall(r"`([\w/-]+\.py)`", text)):
        assert list(ROOT.glob(name) if "/" in name else (ROOT / "solver").rglob(name)), name


def test_every_key_of_a_case_file_is_in_the_table(site):
    table = site("tables").case_keys()
    for kind in sections() - {Pick}:
        for name in fields(kind):
            assert re.search(rf"^\| `([^`]*\.)?{name}` \| ", table, re.MULTILINE), (kind, name)
    assert table.count("\n| `") > 60
    assert "| `contact[].hexahedra` | the cells into which slave hexahedra are cut | " in table
    assert "pyramids or hexahedra | `pyramids` |" in table
    assert "| a positive number from 1e-30 to 1e30 | needed |" in table
    assert "`directions` | solved once, or again with slave and master exchanged | " in table


def test_every_check_solution_and_recipe_is_on_its_page(site):
    tables = site("tables")
    page = (ROOT / "docs" / "checks.md").read_text(encoding="utf-8")
    table = tables.checks()
    for check in CHECKS:
        assert f"`{check.name}`" in (page if check.name in ERRORS else table), check.name
    assert all(f"### `{name}`" in tables.solutions() for name in SOLUTIONS)
    assert all(f"recipe: {name}" in tables.recipes() for name in RECIPES)
    assert "perturb: {amplitude" in tables.transforms()


def test_pages_ask_for_tables_that_there_are_as_the_sources_have_them(site):
    tables = site("tables")
    asked = {name for page in PAGES for name in ASKED.findall(page.read_text(encoding="utf-8"))}
    assert asked == set(tables.TABLES)
    for name in asked:
        written = (tables.FOLDER / f"{name}.md").read_text(encoding="utf-8")
        assert written == tables.page(name), "make schemas writes them again"
    for name in ("case-keys", "checks"):
        _, *rows = tables.TABLES[name]().splitlines()
        assert all(row.startswith("| ") for row in rows), name


def formulas() -> Iterator[tuple[str, str]]:
    for page in PAGES:
        text = CODE.sub("", page.read_text(encoding="utf-8"))
        for block, inline in re.findall(r"\$\$(.+?)\$\$|\$([^$\n]+)\$", text, re.DOTALL):
            yield page.name, block or inline


def test_every_formula_can_be_drawn():
    from docutils.utils.math.latex2mathml import tex2mathml

    found = list(formulas())
    assert len(found) > 60
    for page, latex in found:
        assert tex2mathml(latex).startswith("<math"), page
        # An accent takes a subscript for a limit below it: \bar{g}{}_i is right, \bar g_i is not.
        assert not re.search(r"\\(bar|hat|tilde)( \w|\{\w\})_", latex), (page, latex)


LIBRARY = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")


PYTHON = re.findall(r"^```python\n(.*?)^```$", LIBRARY, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("code", PYTHON)
def test_code_on_the_page_of_the_library_runs(code):
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "passed" in run.stdout


def write(folder: Path, **pages: str) -> Path:
    for name, body in pages.items():
        (folder / f"{name}.html").write_text(f"<html><body>{body}</body></html>")
    return folder


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        ("<a href='https://example.org'>elsewhere</a><img src='x.png'>", []),
        ("<script src='https://example.org/x.js'></script>", ["loads https://example.org/x.js"]),
        ("<link rel=stylesheet href='//example.org/x.css'>", ["loads //example.org/x.css"]),
        ('<img alt="a" src="http://example.org/x.png">', ["loads http://example.org/x.png"]),
    ],
)
def test_what_a_site_loads_from_elsewhere(site, tmp_path, body, fault):
    assert site("loads").loaded(write(tmp_path, a=body)) == [f"a.html: {line}" for line in fault]
