"""The notebooks: their code runs from top to bottom, and finds what their text says."""

import json
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"


def run(name, monkeypatch):
    """What the names of a notebook mean after its last cell."""
    monkeypatch.chdir(FOLDER)
    cells = json.loads((FOLDER / name).read_text(encoding="utf-8"))["cells"]
    assert all(not cell.get("outputs") for cell in cells)
    names: dict = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), name, "exec"), names)  # noqa: S102 -- our own code
    return names


def test_own_mesh(monkeypatch):
    names = run("own-mesh.ipynb", monkeypatch)
    solved = names["solved"]
    assert solved.verdict == "passed"
    np.testing.assert_allclose(solved.contact_force, [0, 0, -25], atol=1e-12)
    assert solved.contact_area == pytest.approx(1.0)
    assert len(names["table"]["pressure"]) == len(solved.pressure)
    assert set(names["table"]["zone"]) == {"interface"}


def test_parameter_study(monkeypatch):
    names = run("parameter-study.ipynb", monkeypatch)
    factor, force = names["factor"], names["force"]
    np.testing.assert_allclose(force / force[1], factor, rtol=1e-10)
    for growing in (names["peak"], names["width"]):
        np.testing.assert_allclose(growing / growing[1], np.sqrt(factor), rtol=0.03)
