"""What holds all over `solver/`."""

import ast
from collections import Counter
from pathlib import Path

SOURCES = Path(__file__).parents[1] / "solver"


def test_imports_within_the_package_are_relative():
    for file in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            named = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                named = [node.module]
            assert not [n for n in named if n.partition(".")[0] == "solver"], (file, node.lineno)


def test_no_two_classes_share_a_name():
    trees = (ast.parse(file.read_text(encoding="utf-8")) for file in SOURCES.rglob("*.py"))
    classes = [
        node.name for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)
    ]
    assert len(classes) > 100
    assert [name for name, count in Counter(classes).items() if count > 1] == []
