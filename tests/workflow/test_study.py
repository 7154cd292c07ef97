"""Studies through real Snakemake: groups measured once, failures recorded, pages and gates."""

import csv
import json
import re
import shutil
from pathlib import Path

from tests.workflow.projects import jobs, new_project, snakemake

ROOT = Path(__file__).parents[2]
STUDY = """
name: study
title: Tiny study
measure: timed
figure: work_precision
set: {mesh: {refine: "=level"}}
threads: 1
repetitions: 2
limit: 60
axes:
  treatment:
    lac: {title: LAC, set: {contact: {treatment: lac}}}
    odd: {title: Odd, set: {contact: {treatment: no-such-treatment}}}
groups:
  - name: patch
    vary: {treatment: [lac, odd], level: [1]}
    series: [{name: TRIA3, case: study/patch-2d.yaml}]
  - name: waves
    vary: {treatment: [lac], level: [1]}
    series: [{name: QUAD4, case: study/waves-2d.yaml}]
"""


def test_groups_are_measured_once_and_the_page_lists_all(tmp_path):
    project = new_project(tmp_path / "project")
    shutil.copytree(ROOT / "cases/studies/study", project / "cases/studies/study")
    (project / "cases/studies/study.yaml").write_text(STUDY)

    done = snakemake(project, "study")
    assert done.returncode == 0, done.stdout
    assert "2 of 3 points are measured. 1 have no result" in done.stdout
    records = project / "results/studies/study/full"
    lac, odd = json.loads((records / "patch.json").read_text())["points"]
    assert len(lac["times"]["total"]["wall"]) == 2
    assert odd["outcome"] == "refused"
    with (project / "results/report/study.csv").open() as stream:
        assert len(list(csv.DictReader(stream))) == 3
    # The templates are no cases of the batch.
    assert not any("waves" in job for job in jobs(project))

    assert jobs(project, "study") <= {"all points hold?"}
    # As an interrupted run leaves it: what is measured is not measured again.
    (records / "patch.json").unlink()
    (project / "results/report/study-failures.txt").unlink()
    again = {"measure study/patch", "page of study", "all points hold?"}
    assert jobs(project, "study") <= again
    assert "measure study/patch" in jobs(project, "study")


def test_a_wrong_level_is_refused(tmp_path):
    refused = snakemake(new_project(tmp_path / "project"), "study", "--config", "level=huge")
    assert refused.returncode != 0
    assert "'huge' is not one of" in refused.stdout


def test_orders_of_no_family_are_refused(tmp_path):
    refused = snakemake(new_project(tmp_path / "project"), "orders")
    assert refused.returncode != 0
    assert "orders: no family of this run has a file orders.yaml" in refused.stdout


def write_ladder(project, least, levels):
    family = project / "cases" / "ladders"
    family.mkdir(exist_ok=True)
    case = (ROOT / "cases" / "manufactured" / "tria3.yaml").read_text()
    (family / "tria3.yaml").write_text(re.sub(r"divisions: \[16, \d+\]", "divisions: [4, 4]", case))
    (family / "orders.yaml").write_text(
        "name: orders-ladders\ntitle: Ladders\nfigure: orders\n"
        'set: {mesh: {refine: "=level"}}\n'
        f"least: {{linear: {{displacement_l2: {least}}}}}\n"
        f"groups: [{{name: g, vary: {{level: {levels}}},\n"
        "  series: [{name: T, case: tria3.yaml}]}]\n"
    )


def test_a_slope_that_is_not_reached_fails_the_target(tmp_path):
    project = new_project(tmp_path / "project")
    write_ladder(project, 1.5, [1, 2, 3])
    done = snakemake(project, "orders")
    assert done.returncode == 0, done.stdout
    assert "1 of 1 slopes asked for are reached, on 1 ladders." in done.stdout
    # The report links the page, and measures none of it anew.
    source = project / "solver" / "mechanics" / "mortar" / "__init__.py"
    source.write_text(source.read_text() + "# changed\n")
    assert not any("measure" in job for job in jobs(project))

    write_ladder(project, 5, [1, 2, 3])
    short = snakemake(project, "orders")
    assert short.returncode != 0
    assert re.search(r"g/T: displacement, L2: .* at least 5 is asked for", short.stdout)
    assert (project / "results" / "report" / "orders-ladders.html").is_file()
