"""The scaling family as data: meshes of the sizes asked for, and what is refused."""

from pathlib import Path

import pytest
import yaml

from solver.mesh import generate
from solver.studies.scaling.description import read_scaling
from solver.system.errors import InputError

ROOT = Path(__file__).parents[3]
FILE = ROOT / "cases/scaling/scaling.yaml"


@pytest.fixture
def content():
    return yaml.safe_load(FILE.read_text())


@pytest.fixture
def read(tmp_path, content):
    """Reads the project's file, changed, from a folder with its templates."""

    def reading(size="full"):
        (tmp_path / "templates").mkdir(exist_ok=True)
        for file in FILE.parent.glob("templates/*.yaml"):
            (tmp_path / "templates" / file.name).write_text(file.read_text())
        path = tmp_path / "scaling.yaml"
        path.write_text(yaml.safe_dump(content))
        return read_scaling(path, size)

    return reading


def test_every_point_is_a_valid_case_whose_meshes_do_not_match():
    scaling = read_scaling(FILE)
    assert len({point.name for point in scaling.points}) == len(scaling.points)
    assert [p.size for p in scaling.points] == sorted(p.size for p in scaling.points)
    for point in scaling.points:
        case = point.parsed(Path("point.yaml"))
        slave, master = point.divisions
        assert slave[0] != master[0]
        assert case.mesh["bottom"]["divisions"] == slave
        assert case.solution is not None
        assert point.size <= point.mesh.unknowns < 1.6 * point.size


@pytest.mark.parametrize(
    "cells", ["TRIA3", "TRIA6", "QUAD4", "QUAD8", "TETRA4", "TETRA10", "HEXA20"]
)
def test_a_mesh_has_about_the_unknowns_it_should_have(content, read, cells):
    template = "space" if cells.startswith(("TETRA", "HEXA")) else "plane"
    content["series"] = [
        {
            **content["series"][0],
            "name": "one",
            "cells": cells,
            "case": f"templates/{template}.yaml",
            "sizes": [3000],
        }
    ]
    content["quick"]["series"], content["goals"] = ["one"], []
    content["large"]["series"] = ["one"]
    [point] = read().points
    mesh = generate(point.parsed(Path("point.yaml")).mesh, "here")
    counted = point.mesh.unknowns
    regular = cells.startswith(("QUAD", "HEXA"))
    assert mesh.points.size == pytest.approx(counted, rel=0 if regular else 0.15)


def test_a_slab_is_as_thick_as_its_fine_cells_are_wide():
    point = read_scaling(FILE).point("fine-slave/10000")
    case = point.parsed(Path("point.yaml"))
    slave, master = point.divisions
    assert (slave[2], master[2]) == (1, 1)
    assert slave[0] == 10 * master[0]
    assert case.mesh["size"][2] == pytest.approx(case.mesh["size"][0] / slave[0])
    assert case.solution.base == pytest.approx(-case.mesh["size"][2])


def test_the_quick_part_is_small():
    quick, full = read_scaling(FILE, "quick"), read_scaling(FILE)
    assert {p.name for p in quick.points} < {p.name for p in full.points}
    assert max(p.size for p in quick.points) <= 3e4


def test_the_large_part_has_ten_million_unknowns():
    large = read_scaling(FILE, "large")
    assert [p.name for p in large.points] == ["hexa8/10000000", "tetra4/10000000"]
    assert all(1e7 <= p.mesh.unknowns < 1.1e7 for p in large.points)
    assert not any(p.counts_bytes for p in large.points)  # it would take as long again


def test_an_unknown_point(read):
    with pytest.raises(InputError, match="no such point; did you mean hexa8/10000"):
        read().point("hexa8/1000")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda c: c["series"][1].update(name="hexa8"),
            r"series\[1\].name .* the name is given twi",
        ),
        (lambda c: c["series"][0].update(case="no.yaml"), r"series\[0\].case .* no such file"),
        (lambda c: c["series"][0].update(sizes=[3]), "must be a number of unknowns from 100 to"),
        (lambda c: c["series"][0].update(cells="PYRA5"), "must be TRIA3, TRIA6, QUAD4"),
        (
            lambda c: c["goals"][0].update(series="hexa"),
            r"goals\[0\].series .* no such ser",
        ),
        (lambda c: c["goals"][0].update(over="hexa"), r"goals\[0\].over .* no such ser"),
        (lambda c: c["goals"][0].update(what="speed"), "must be cpu, wall, memory, pressure, st"),
    ],
)
def test_what_is_refused(content, read, change, message):
    change(content)
    with pytest.raises(InputError, match=message):
        read()


@pytest.mark.parametrize("part", ["quick", "large"])
def test_a_part_names_series_that_there_are(content, read, part):
    content[part]["series"] = ["hexa9"]
    with pytest.raises(InputError, match=rf"{part}.series\[0\] .* no such series; did you"):
        read(part)
