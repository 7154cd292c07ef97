"""Names of the program in the documentation are there."""

import re
from functools import reduce
from importlib import import_module
from pathlib import Path

import pytest

from solver import solve_case

ROOT = Path(__file__).resolve().parents[2]
LISTED = re.findall(r"^\.\. auto\w+:: ([\w.]+)", (ROOT / "docs/api.md").read_text(), re.MULTILINE)
LIBRARY = (ROOT / "docs/library.md").read_text().partition("## Results")[2].partition("\n`save")[0]


@pytest.mark.parametrize("name", LISTED)
def test_what_the_reference_lists_is_defined_where_it_says(name):
    module, _, own = name.rpartition(".")
    assert getattr(import_module(module), own).__module__ == module


def test_each_attribute_of_a_result_is_there():
    solved = solve_case(ROOT / "cases/ssnp170/c.yaml")
    named = [
        name
        for row in re.findall(r"^\| (`.*?) \|", LIBRARY, re.MULTILINE)
        for name in row.split(", ")
    ]
    assert len(named) > 20
    for name in named:
        reduce(getattr, name.strip("`").split("."), solved)
