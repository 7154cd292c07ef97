"""Docstrings tell the truth: their examples run, and the places they name are there."""

import ast
import doctest
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted((ROOT / "solver").rglob("*.py"))
# Those of the kernel run with objects of their own (tests/lac, tests/mechanics/mortar).
_KERNEL = ("solver/lac/", "solver/mechanics/mortar/")
ROOMS = {path.name for path in (ROOT / "solver").iterdir() if path.is_dir()}
# Of files, which have dots in their names too.
_ENDINGS = {"comm", "med", "json", "mdpa", "html"}
_PLACE = re.compile(r"`((?:[a-z_]+\.)+[A-Za-z_]+)`")


def module_of(file):
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def with_examples():
    for file in FILES:
        name = file.relative_to(ROOT).as_posix()
        if ">>>" in file.read_text() and not name.startswith(_KERNEL):
            yield file


@pytest.mark.parametrize("file", list(with_examples()), ids=module_of)
def test_the_examples_of_a_module_run(file):
    done = doctest.testmod(import_module(module_of(file)))
    assert done.attempted > 0
    assert done.failed == 0


def leads_somewhere(place, package):
    """Whether a dotted name is a module or an attribute of one, from any package around on."""
    names = package.split(".")
    for root in (".".join(names[:count]) for count in range(1, len(names) + 1)):
        parts = place.removeprefix("solver.").split(".")
        found = import_module(root)
        for part in parts:
            if hasattr(found, part):
                found = getattr(found, part)
                continue
            try:
                found = import_module(f"{found.__name__}.{part}")
            except (ImportError, AttributeError):
                break
        else:
            return True
    return False


def documented(tree):
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    return filter(None, (ast.get_docstring(n) for n in ast.walk(tree) if isinstance(n, kinds)))


def named_places(file):
    """The dotted names in the docstrings of a file that begin with a room or one of its parts."""
    package = ".".join(file.relative_to(ROOT).parent.parts)
    around = {path.stem for path in file.parent.glob("*")}
    if room := package.removeprefix("solver").strip(".").split(".")[0]:
        around |= {path.stem for path in (ROOT / "solver" / room).glob("*")}
    for text in documented(ast.parse(file.read_text())):
        for place in _PLACE.findall(text):
            first, *_, last = place.split(".")
            if first in {"solver", *ROOMS} | around and last not in _ENDINGS:
                yield place, package


def test_places_named_in_docstrings_are_there():
    lost = [
        (module_of(file), place)
        for file in FILES
        for place, package in named_places(file)
        if not leads_somewhere(place, package)
    ]
    assert lost == []


def test_a_place_that_is_gone_is_told():
    assert leads_somewhere("solver.lac.status.find_status", "solver")
    assert leads_somewhere("equilibrium.state", "solver.simulation")
    assert not leads_somewhere("equilibrium.gone", "solver.simulation")
