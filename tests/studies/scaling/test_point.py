"""One point of the scaling family: what its record says when it ends well, and when not."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from solver.commands.cli import main
from solver.studies.scaling import point as measuring
from solver.studies.scaling.description import read_scaling
from solver.studies.scaling.point import measure_point
from solver.verification.judge import without_result
from solver.verification.verdict import to_json

FILE = Path(__file__).parents[3] / "cases/scaling/scaling.yaml"


@pytest.fixture
def scaling():
    """The project's family with its plane series small."""
    full = read_scaling(FILE)
    small = [
        structs.replace(s, sizes=(500,)) for s in full.series if s.name in ("quad4", "fine-master")
    ]
    return replace(full, series=tuple(small), threads=1)


def record(scaling, name, folder):
    output = folder / "record.json"
    line = measure_point(scaling, scaling.point(name), output)
    assert [path.name for path in folder.iterdir()] == ["record.json"]
    return json.loads(output.read_text()), line


def test_a_series_may_have_threads_of_its_own(scaling, tmp_path, monkeypatch):
    asked = []

    def cores_for(threads):
        asked.append(threads)
        raise KeyboardInterrupt

    monkeypatch.setattr(measuring, "cores_for", cores_for)
    own = structs.replace(scaling.series[0], threads=3)
    for series in (scaling.series[0], own):
        some = replace(scaling, series=(series,))
        with pytest.raises(KeyboardInterrupt):
            measure_point(some, some.points[0], tmp_path / "record.json")
    assert asked == [1, 3]


def test_bytes_are_counted_once_for_a_mesh():
    """On the largest mesh of a series in 3D."""
    counted = [p.name for p in read_scaling(FILE).points if p.counts_bytes]
    assert {"hexa8/1000000", "hexa8-one/1000000", "tetra10/1000000"} < set(counted)
    assert not [name for name in counted if name.startswith(("quad", "tria"))]


def test_a_point_that_ends_well(scaling, tmp_path):
    found, line = record(scaling, "quad4/500", tmp_path)
    assert (found["outcome"], found["verdict"]) == ("solved", "passed")
    assert line.startswith(f"quad4/500: {found['dofs']} unknowns, ")
    # Each slave face is cut with four new nodes.
    assert found["divisions"] == [[12, 12], [10, 10]]
    assert found["macro_elements"] == 12
    assert found["faces"] == 12 + 10
    assert found["dofs"] == 2 * (13 * 13 + 11 * 11 + 4 * 12)
    assert found["matrix_entries"] > 5 * found["dofs"]
    stages = {"read", "cut", "pairing", "assembly", "solve", "recovery", "checks", "write"}
    assert found["stage_cpu_seconds"].keys() == stages
    assert sum(found["stage_cpu_seconds"].values()) < found["process"]["cpu"]
    assert found["process"]["wall"] + found["meshing"]["wall"] < found["whole"]
    assert found["process"]["peak_memory_mb"] > 50
    assert (found["threads"], found["machine"]["threads"]) == (1, "1")
    assert found["errors"]["pressure_max"] < 1e-10


def test_a_solve_without_an_end_is_recorded(scaling, tmp_path):
    found, line = record(replace(scaling, limit=0.01), "quad4/500", tmp_path)
    assert (found["outcome"], found["reason"]) == ("failed", "no mesh: no end within 0.01 s")
    assert line == f"quad4/500: failed: {found['reason']}"


@pytest.fixture
def instead(tmp_path_factory, monkeypatch):
    """Puts a shell script in the place of the solve; meshes are made by doing nothing."""

    def putting(script):
        python = tmp_path_factory.mktemp("fake") / "python"
        python.write_text(f'#!/bin/sh\n[ "$1" = mesh ] && exit 0\n{script}\n')
        python.chmod(0o755)
        monkeypatch.setattr(measuring, "COMMAND", [str(python)])

    return putting


def test_a_process_that_dies_is_recorded(scaling, tmp_path, instead):
    instead("echo out of luck; exit 7")
    found, _ = record(scaling, "quad4/500", tmp_path)
    assert found["outcome"] == "crashed"
    assert found["reason"] == "the process died with exit status 7: out of luck"
    assert found["dofs"] is None


@pytest.mark.parametrize("word", ["refused", "failed", "crashed"])
def test_a_solve_without_a_result_is_recorded(scaling, tmp_path, instead, word):
    verdict = without_result(word, "memory = 5 unknowns: needs 2 GB", Path("quad4-500.yaml"))
    instead(
        f"while [ $# -gt 1 ]; do shift; done; cat > \"$1\" <<'END'\n{to_json(verdict.plain())}\nEND"
    )
    found, line = record(scaling, "quad4/500", tmp_path)
    assert (found["outcome"], found["reason"]) == (word, "memory = 5 unknowns: needs 2 GB")
    assert line == f"quad4/500: {word}: {found['reason']}"


def test_by_hand(tmp_path, capsys):
    assert main(["scaling", "point", str(FILE), "hexa8/1", "-o", str(tmp_path / "r.json")]) == 2
    assert "no such point" in capsys.readouterr().err
