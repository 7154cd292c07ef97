"""What holds all over `solver/` and `tests/`."""

import ast
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "solver"
# The public package `lac` is the twelfth entry.
LONGEST, ENTRIES = 400, 12


@cache
def parsed(file):
    return ast.parse(file.read_text(encoding="utf-8"))


def test_imports_within_the_package_are_relative():
    for file in SOURCES.rglob("*.py"):
        for node in ast.walk(parsed(file)):
            named = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                named = [node.module]
            assert not [n for n in named if n.partition(".")[0] == "solver"], (file, node.lineno)


def imported(file):
    """The files of the package that a file imports, in functions and for type checkers too."""
    for node in ast.walk(parsed(file)):
        if isinstance(node, ast.ImportFrom) and node.level:
            place = file.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            names = [place / alias.name for alias in node.names]
            found = [each.with_suffix(".py") for each in names if each.with_suffix(".py").is_file()]
            yield from found or [place.with_suffix(".py"), place / "__init__.py"]


def test_no_files_import_each_other_in_a_circle():
    """Neither for their work nor for types alone: what both need has a place of its own."""
    order = TopologicalSorter({file: [*imported(file)] for file in SOURCES.rglob("*.py")})
    assert len([*order.static_order()]) > 250


def test_no_two_classes_share_a_name():
    trees = (parsed(file) for file in SOURCES.rglob("*.py"))
    classes = [
        node.name for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)
    ]
    assert len(classes) > 100
    assert [name for name, count in Counter(classes).items() if count > 1] == []


def test_no_file_is_too_long():
    files = [
        file for room in ("solver", "tests", "workflow") for file in (ROOT / room).rglob("*.py")
    ]
    assert len(files) > 300
    lines = {f: len(f.read_text(encoding="utf-8").splitlines()) for f in files}
    found = [f.relative_to(ROOT).as_posix() for f, count in lines.items() if count > LONGEST]
    assert found == []


def test_a_newcomer_sees_few_rooms():
    seen = [path.name for path in SOURCES.iterdir() if not path.name.startswith(("_", "."))]
    assert 0 < len(seen) <= ENTRIES
