"""The scaling family through real Snakemake: points measured once, the page written."""

import json
import shutil
from pathlib import Path

import yaml

from tests.workflow.projects import jobs, new_project, snakemake

ROOT = Path(__file__).parents[2]


def test_points_are_measured_once(tmp_path):
    project = new_project(tmp_path / "project")
    shutil.copytree(ROOT / "cases/scaling", project / "cases/scaling")
    file = project / "cases/scaling/scaling.yaml"
    content = yaml.safe_load(file.read_text())
    plane = next(series for series in content["series"] if series["name"] == "quad4")
    content |= {"series": [plane | {"sizes": [400, 800]}], "goals": []}
    content["quick"] = {"largest": 500, "series": ["quad4"]}
    content["large"] |= {"sizes": [900], "series": ["quad4"]}
    file.write_text(yaml.safe_dump(content))
    # What describes the family is no case of the batch.
    assert not any("scaling" in job or "benchmark" in job for job in jobs(project))

    done = snakemake(project, "scaling")
    assert done.returncode == 0, done.stdout
    assert "2 of 2 points are measured" in done.stdout
    records = project / "results/scaling/full/quad4"
    assert json.loads((records / "800.json").read_text())["outcome"] == "solved"
    assert jobs(project, "scaling") == set()
    # As an interrupted run leaves it: what is measured is not measured again.
    (records / "400.json").unlink()
    (project / "results/report/scaling.html").unlink()
    assert jobs(project, "scaling") == {"measure quad4/400", "growth with size"}
    quick = jobs(project, "scaling", "--config", "scaling=quick")
    assert quick == {"measure quad4/400", "growth with size"}
    large = jobs(project, "scaling", "--config", "scaling=large")
    assert large == {"measure quad4/900", "growth with size"}
