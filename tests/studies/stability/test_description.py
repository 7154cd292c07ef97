"""Sweeps as data: what a file says, what is refused, and that all of ours are complete."""

from pathlib import Path

import pytest

from solver.studies.stability.description import read_sweep
from solver.system.errors import InputError

ROOT = Path(__file__).resolve().parents[3]
OURS = sorted((ROOT / "cases" / "stability" / "sweeps").glob("*.yaml"))
BASE = """\
name: base
mesh: {recipe: blocks, size: 1, bottom: {cells: QUAD4, divisions: [2, 2]}}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports: [{group: base, fix: [normal]}]
"""
SWEEP = """\
title: A quantity
breaks: >-
  Nowhere,
  so far.
values: [1, 2, 3, 4, 1.0e+6, [1, 2]]
quick: [1.0e+6]
beyond: [1.0e+6]
directions: both
meshes:
  2D:
    case: base.yaml
    set:
      mesh: {bottom: {divisions: ["=2*x", 3]}}
      materials: {all: {young: "=x/2 + y"}}
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "base.yaml").write_text(BASE)
    path = tmp_path / "quantity.yaml"
    path.write_text(SWEEP)
    return path


def test_a_value_takes_its_place_in_the_case(file):
    sweep = read_sweep(file)
    case = sweep.case("2D", 3)
    assert case.mesh["bottom"] == {"cells": "QUAD4", "divisions": [6, 3]}
    assert case.materials["all"].young == 1.5
    assert case.materials["all"].poisson == 0.3
    assert sweep.case("2D", (1.0, 2.0)).materials["all"].young == 2.5
    assert sweep.labels == ("1", "2", "3", "4", "1e6", "1 × 2")
    assert sweep.breaks == "Nowhere, so far."
    assert [series.name for series in sweep.series] == ["2D", "2D, swapped"]


def test_the_quick_version_has_fewer_values(file):
    sweep = read_sweep(file, quick=True)
    assert (sweep.values, sweep.labels, sweep.beyond) == ((1e6,), ("1e6",), (1e6,))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("beyond: [1.0e+6]", "beyonds: []", "beyonds.*did you mean beyond"),
        ("[1, 2, 3, 4, 1.0e+6, [1, 2]]", "[1, 2]", "values.*at least six"),
        ("quick: [1.0e+6]", "quick: [7]", r"quick\[0\] = 7: is not one of the values"),
        ("quick: [1.0e+6]", "quick: []", "quick"),
        ("beyond: [1.0e+6]", "labels: [a]", r"labels = \['a'\]: must be as many as values: 6"),
        ("case: base.yaml", "case: other.yaml", "meshes.2D.case = 'other.yaml': no such file"),
        ("directions: both", "directions: all", "must be first, swapped or both"),
    ],
)
def test_what_is_wrong_in_the_file_is_told_in_one_line(file, old, new, message):
    assert old in SWEEP
    file.write_text(SWEEP.replace(old, new))
    with pytest.raises(InputError, match=message):
        read_sweep(file)


def test_an_expression_that_is_none_names_its_key(file):
    file.write_text(SWEEP.replace("=x/2 + y", "=import"))
    with pytest.raises(InputError, match=r"meshes.2D.set.materials.all.young"):
        read_sweep(file).case("2D", 1)


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.stem)
def test_ours_make_a_valid_case_of_every_value(path):
    sweep = read_sweep(path)
    assert len(sweep.values) >= 6
    assert {series.mesh[:2] for series in sweep.series} == {"2D", "3D"}
    for mesh in sweep.cases:
        for value in sweep.values:
            assert sweep.case(mesh, value).zones
