"""The study read from its file: names of points, their cases, and what is refused."""

from pathlib import Path

import pytest

from solver.mesh.catalogue import BY_NAME
from solver.studies.work_precision.description import read_study
from solver.system.errors import InputError

ROOT = Path(__file__).parents[3]
STUDY = """
title: A study
threads: 1
repetitions: 5
limit: 60
treatments:
  - {name: lac, title: LAC, zone: {treatment: lac}}
  - {name: cubes, title: Cubes, zone: {hexahedra: hexahedra}, slaves: [HEXA8], problems: [space]}
problems:
  - {name: plane, title: Plane, case: patch-2d.yaml, pairs: [[TRIA3, QUAD8], [QUAD4, TRIA6]],
     levels: [4, 1]}
  - {name: space, title: Space, case: patch-3d.yaml, pairs: [[HEXA8, TETRA4]], levels: [1, 2, 3]}
linear_solvers:
  - {problem: plane, pair: [QUAD4, TRIA6], treatment: lac, solvers: [cholmod, superlu]}
quick: {repetitions: 1, levels: 2, pairs: {space: [[HEXA8, TETRA4]]}}
"""


@pytest.fixture
def file(tmp_path):
    for name in ("patch-2d", "patch-3d"):
        text = (ROOT / f"cases/study/templates/{name}.yaml").read_text()
        (tmp_path / f"{name}.yaml").write_text(text)
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    return path


def test_every_point_has_a_name_that_finds_it(file):
    study = read_study(file)
    names = [point.name for point in study.points]
    # Two pairs at two levels; one pair, two treatments, three levels; two solvers at two levels.
    assert len(names) == len(set(names)) == 4 + 6 + 4
    assert names[:2] == ["plane/tria3-quad8/lac/1", "plane/tria3-quad8/lac/4"]
    assert names[-1] == "plane/quad4-tria6/lac+superlu/4"
    assert all(study.point(name).name == name for name in names)
    with pytest.raises(InputError, match=r"point = 'plane/tria3-quad8/lac/3': no such point"):
        study.point("plane/tria3-quad8/lac/3")


def test_a_treatment_for_some_cells_alone_has_points_on_these_alone(file):
    cubes = [p for p in read_study(file).points if p.treatment.name == "cubes"]
    assert {p.slave for p in cubes} == {"HEXA8"}


def test_a_point_is_a_case_with_its_cells_level_and_treatment(file):
    case = read_study(file).point("space/hexa8-tetra4/cubes/3").case()
    assert case.mesh["refine"] == 3
    assert (case.mesh["bottom"]["cells"], case.mesh["top"]["cells"]) == ("HEXA8", "TETRA4")
    assert case.mesh["bottom"]["divisions"] == [3, 3, 1]
    assert case.zones[0].hexahedra == "hexahedra"
    assert case.solution.name == "uniform_compression"


def test_a_reference_is_the_same_problem_on_its_own_mesh(file):
    given = "levels: [4, 1], reference: {cells: QUAD9, divisions: [8, 6], uncertainty: {}}}"
    file.write_text(STUDY.replace("levels: [4, 1]}", given))
    point = read_study(file).points[0]
    case = point.reference_case(point.problem.reference)
    assert case.mesh["bottom"] == case.mesh["top"] == {"cells": "QUAD9", "divisions": [8, 6]}
    assert case.mesh["refine"] == 1


def test_the_quick_study_is_a_part_of_the_whole(file):
    quick, whole = read_study(file, "quick"), read_study(file)
    assert quick.repetitions == 1
    names = [point.name for point in quick.points]
    assert names == [f"space/hexa8-tetra4/{t}/{k}" for t in ("lac", "cubes") for k in (1, 2)]
    assert set(names) < {point.name for point in whole.points}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("limit: 60", "limit: 0", "limit = 0: must be a positive number of seconds"),
        ("repetitions: 5", "repetitions: 5\nlimits: 3", "did you mean limit"),
        ("levels: [4, 1]", "levels: [4, 4]", r"problems\[0\].levels = \[4, 4\]: .*each once"),
        ("[[TRIA3, QUAD8]", "[[TRIA3, HEXA8]", r"problems\[0\].pairs\[0\].*one dimension"),
        ("[[TRIA3, QUAD8]", "[[TRIA5, QUAD8]", "must be a cell type such as"),
        ("patch-3d.yaml", "patch-4d.yaml", r"problems\[1\].case = 'patch-4d.yaml': no such file"),
        ("name: cubes", "name: lac", r"treatments\[1\].name = 'lac': the name is given twice"),
        ("problem: plane", "problem: plain", "did you mean plane"),
        ("[cholmod, superlu]", "[cholmod, mumps]", "must be cholmod or superlu"),
        ("pairs: {space", "pairs: {spice", "did you mean space"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(file, old, new, message):
    assert old in STUDY
    file.write_text(STUDY.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as refusal:
        read_study(file, "quick")
    assert str(refusal.value).startswith(str(file))


def test_the_project_s_own_study_is_what_its_page_promises():
    """Linear and quadratic cells in each problem; LAC with recovery beside nodal on all of them."""
    path = ROOT / "cases/study/study.yaml"
    study, quick = read_study(path), read_study(path, "quick")
    for problem in study.problems:
        assert {BY_NAME[slave].order for slave, _ in problem.pairs} == {1, 2}, problem.name
        for slave, _ in problem.pairs:
            names = [t.name for t in study.treatments if t.is_for(problem.name, slave)]
            assert {"lac", "nodal"} < set(names)
            assert {"lac-quadratic", "lac-smooth"} & set(names)
    assert study.repetitions == 3
    assert len({v[:3] for v in study.varied}) == 2
    assert {len(problem.levels) for problem in quick.problems} == {3}
    assert (len(quick.problems), quick.repetitions) == (3, 1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("{problem: plane, pair: [QUAD4", "{problem: plan, pair: [QUAD4", "no such problem; did"),
        ("treatment: lac, solvers", "treatment: lax, solvers", "no such treatment; did"),
        (
            "problems: [space]",
            "problems: [spaces]",
            r"treatments\[1\].problems = .*did you mean space",
        ),
        ("pairs: {space: ", "pairs: {spice: ", "no such problem; did you mean space"),
    ],
)
def test_names_that_nothing_has(file, old, new, message):
    assert old in STUDY
    file.write_text(STUDY.replace(old, new))
    with pytest.raises(InputError, match=message):
        read_study(file, "quick")
