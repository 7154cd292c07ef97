"""The benchmark on tiny meshes: every way gives its numbers, one without a solve its reason."""

import json
from pathlib import Path

import pytest
import yaml

from solver.codes.calculix import CalculiX
from solver.commands.cli import main
from solver.studies.benchmark.description import read_benchmark
from solver.studies.benchmark.page import ratios
from solver.system.errors import InputError

ROOT = Path(__file__).parents[3]
FILE = ROOT / "cases/scaling/benchmark.yaml"


@pytest.fixture
def content():
    """The project's benchmark with one plane comparison."""
    content = yaml.safe_load(FILE.read_text())
    content["scaling"] = str(FILE.with_name("scaling.yaml"))
    ways = [
        {"title": "first"},
        {"title": "no cures", "cures": False},
        {"title": "everything", "everything": True},
        {"title": "odd", "treatment": "no-such-treatment"},
        {"title": "solver", "solver": "superlu"},
    ]
    one = {"title": "Ways", "series": "quad4", "size": 500, "repetitions": 1, "ways": ways}
    content["comparisons"] = [one]
    content["threads"] = 1
    return content


@pytest.fixture
def file(tmp_path, content):
    path = tmp_path / "benchmark.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_the_whole_of_it(file, tmp_path, capsys):
    output = tmp_path / "out" / "record.json"
    assert main(["benchmark", str(file), "-o", str(output)]) == 0
    record = json.loads(output.read_text())
    [comparison] = record["comparisons"]
    ways = {way["way"]: way for way in comparison["ways"]}
    assert ways["odd"]["outcome"] != "solved"
    assert "no-such-treatment" in ways["odd"]["reason"]
    assert ways["solver"]["linear_solver"] == "SuperLU"
    assert [ratio is None for ratio in ratios(comparison["ways"])] == [
        False,
        False,
        False,
        True,
        False,
    ]
    for name in ("first", "everything", "solver"):
        assert ways[name]["pressure_max"] < 1e-10
        assert len(ways[name]["times"]["total"]["cpu"]) == 1
        assert ways[name]["process"]["cpu"] > 0
    said = capsys.readouterr().out
    assert "Ways (QUAD4, " in said


@pytest.mark.skipif(not CalculiX().version(), reason="not installed")
def test_calculix_is_judged_at_the_nodes_of_the_slave(file, content, tmp_path):
    """The patch test: the six digits of its output, where nodes off the interface have zero."""
    one = content["comparisons"][0] | {"repetitions": 0}
    content["comparisons"] = [one | {"ways": [{"title": "other", "program": "calculix"}]}]
    file.write_text(yaml.safe_dump(content))
    output = tmp_path / "record.json"
    assert main(["benchmark", str(file), "-o", str(output)]) == 0
    [way] = json.loads(output.read_text())["comparisons"][0]["ways"]
    assert way["outcome"] == "solved"
    assert way["pressure_max"] < 1e-5


def test_the_projects_own_is_valid_and_has_a_quick_version():
    full, quick = (read_benchmark(FILE, size) for size in ("full", "quick"))
    assert len(full.comparisons) == len(quick.comparisons) > 5
    assert {c.size for c in quick.comparisons} == {1000}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda c: c["comparisons"][0].update(series="quad5"),
            r"comparisons\[0\].series .* no such",
        ),
        (lambda c: c["comparisons"][0].update(repetitions=-1), "must be a whole number, 0 to 100"),
    ],
)
def test_what_is_refused(content, tmp_path, change, message):
    change(content)
    path = tmp_path / "benchmark.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError, match=message):
        read_benchmark(path, "full")
