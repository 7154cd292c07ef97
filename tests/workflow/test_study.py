"""The study through real Snakemake: points measured once, failures recorded, the page written."""

import csv
import json
import shutil
from pathlib import Path

from tests.workflow.projects import jobs, new_project, snakemake

ROOT = Path(__file__).parents[2]
STUDY = """
title: Tiny study
threads: 1
repetitions: 2
limit: 60
treatments:
  - {name: lac, title: LAC, zone: {treatment: lac}}
  - {name: odd, title: Odd, zone: {treatment: no-such-treatment}, problems: [patch]}
problems:
  - {name: patch, title: Patch, case: templates/patch-2d.yaml, pairs: [[TRIA3, QUAD4]], levels: [1]}
  - name: half
    title: Half
    case: templates/half-loaded.yaml
    pairs: [[QUAD4, QUAD4]]
    levels: [1]
    reference: {cells: QUAD8, divisions: [4, 4], uncertainty: {pressure_l2: 0.1}}
"""


def test_points_are_measured_once_and_the_page_lists_all(tmp_path):
    project = new_project(tmp_path / "project")
    shutil.copytree(ROOT / "cases/study/templates", project / "cases/study/templates")
    (project / "cases/study/study.yaml").write_text(STUDY)

    done = snakemake(project, "study")
    assert done.returncode == 0, done.stdout
    assert "2 of 3 points are measured. 1 have no solve" in done.stdout
    records = project / "results/study/full"
    solved = json.loads((records / "half/quad4-quad4/lac/1.json").read_text())
    assert solved["errors"]["pressure_l2"] > 0
    assert len(solved["times"]["total"]["wall"]) == 2
    refused = json.loads((records / "patch/tria3-quad4/odd/1.json").read_text())
    assert refused["outcome"] == "refused"
    with (project / "results/report/study.csv").open() as stream:
        assert len(list(csv.DictReader(stream))) == 3
    # The templates are no cases of the batch.
    assert not any("half" in job for job in jobs(project))

    assert jobs(project, "study") == set()
    # As an interrupted run leaves it: what is measured is not measured again.
    (records / "patch/tria3-quad4/lac/1.json").unlink()
    (project / "results/report/study.html").unlink()
    again = {"measure patch/tria3-quad4/lac/1", "error against run time"}
    assert jobs(project, "study") == again


def test_a_wrong_size_is_refused(tmp_path):
    refused = snakemake(new_project(tmp_path / "project"), "study", "--config", "study=huge")
    assert refused.returncode != 0
    assert "'huge' is not one of" in refused.stdout
