"""Studies read from their files: points, cases, parts, and what is refused."""

import json

import pytest

from solver.studies.description import read_study
from solver.studies.points import merged, points_of
from solver.system.errors import InputError
from tests.studies.measured import CASES, OURS, STABILITY, WORK, point

TEXT = """
name: small
title: A small study
figure: orders
set: {mesh: {refine: "=level"}}
least: {linear: {displacement_l2: 1.9}}
theory: {quadratic: {pressure_max: [0.5, null]}}
axes:
  recovery:
    none: {title: constants, set: {contact: {recovery: none}}}
    smooth: {title: smooth, set: {contact: {recovery: smooth}}, groups: [one], series: [TRIA]}
groups:
  - name: one
    vary: {recovery: [none, smooth], level: [1, 2]}
    quick: {recovery: [none], level: [1], series: [TRIA3]}
    series:
      - {name: TRIA3, case: tria3.yaml}
      - {name: QUAD4, case: quad4.yaml, vary: {level: [4]}, directions: both}
  - name: two
    vary: {x: [[1, 2], [3, 4]], level: [1]}
    series: [{name: pair, case: tria3.yaml, set: {mesh: {top: {divisions: ["=x+y", "=y"]}}}}]
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(TEXT)
    for name in ("tria3", "quad4"):
        (tmp_path / f"{name}.yaml").write_text((CASES / f"manufactured/{name}.yaml").read_text())
    return path


def test_points_are_the_product_less_what_a_choice_is_not_for(file):
    study = read_study(file)
    names = [p.name for p in points_of(study, study.group("one"))]
    assert names == [
        *("TRIA3, constants/1", "TRIA3, constants/2", "TRIA3, smooth/1", "TRIA3, smooth/2"),
        *("QUAD4, constants/4", "QUAD4, swapped, constants/4"),
    ]


def test_a_point_is_a_case_with_what_is_set_for_it(file):
    study = read_study(file)
    first, *_, last = points_of(study, study.group("one"))
    content = json.loads(last.source)
    assert content["mesh"]["refine"] == 4
    assert content["contact"][0]["recovery"] == "none"
    assert (first.case.mesh.source["refine"], last.case.zones[0].recovery) == (1, "none")
    pair, _ = points_of(study, study.group("two"))
    assert json.loads(pair.source)["mesh"]["top"]["divisions"] == [3, 2]


def test_a_part_has_some_series_and_values(file):
    quick = read_study(file, "quick")
    assert [p.name for g in quick.groups for p in points_of(quick, g)] == ["TRIA3/1"]
    with pytest.raises(InputError, match="no group has a part `large`"):
        read_study(file, "large")
    file.write_text(TEXT.replace("series: [TRIA3]", "series: [TRIA4]"))
    with pytest.raises(InputError, match=r"groups.one.quick.series = 'TRIA4': no such series; did"):
        read_study(file, "quick")


def test_mappings_are_merged_into_each_item_of_a_list():
    assert merged({"a": [{"b": 1}, {"c": 2}]}, {"a": {"b": 3}}) == {
        "a": [{"b": 3}, {"b": 3, "c": 2}]
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("level: [1, 2]", "level: [2, 2]", r"vary.level = \[2, 2\]: must be values that differ"),
        ("displacement_l2: 1.9}", "displacment_l2: 1.9}", "did you mean displacement_l2"),
        ("case: tria3.yaml}", "cases: tria3.yaml}", "did you mean case"),
        ("case: quad4.yaml", "case: quad5.yaml", "no such file"),
        ("[none, smooth], level", "[none, rough], level", "no such value of this axis"),
        ("groups: [one]", "groups: [won]", "no such group; did you mean"),
        ("[0.5, null]", "[0.5]", r"must be \[guaranteed, best\]"),
        ("figure: orders", "figure: oders", "figure = 'oders': must be"),
        ("name: QUAD4", "name: TRIA3", "the name is given twice"),
    ],
)
def test_what_is_wrong_in_the_file_is_refused_in_one_line(file, old, new, message):
    assert old in TEXT
    file.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as refusal:
        read_study(file)
    assert str(refusal.value).startswith(str(file))


def test_an_expression_that_is_none_names_its_key(file):
    file.write_text(TEXT.replace('"=x+y"', '"=x+w"'))
    study = read_study(file)
    with pytest.raises(InputError, match=r"set.mesh.top.divisions\[0\]"):
        _ = points_of(study, study.group("two"))[0].source


@pytest.mark.parametrize("path", OURS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_ours_make_valid_cases_with_names_of_their_own(path):
    study = read_study(path)
    for group in study.groups:
        points = points_of(study, group)
        assert len({p.name for p in points}) == len(points)
        for one in [*points[:2], *points[-2:]]:
            odd = one.choices.get("treatment")
            assert one.case.mesh.source or odd


def test_values_that_are_shown_by_a_label():
    assert point(STABILITY, "poisson").case.materials["bottom"].poisson == -0.9
    study = read_study(STABILITY)
    labels = {p.labels["x"] for p in points_of(study, study.group("poisson"))}
    assert {"½-1e-4", "½-1e-15"} <= labels


def test_our_study_of_work_has_every_treatment():
    study = read_study(WORK)
    names = {p.labels.get("treatment") for g in study.groups for p in points_of(study, g)} - {None}
    assert names == set(study.axes["treatment"])
