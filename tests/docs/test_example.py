"""The worked example, run as it stands on a coarser mesh, against Hertz and statics."""

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from solver.verification.results import read_result

FILE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "two_curved_bodies.py"
SPEC = importlib.util.spec_from_file_location("two_curved_bodies", FILE)

FORCE, RADIUS = 3800.0, 20.0  # 1/20 = 1/10 − 1/20
MODULUS = 1 / (0.91 / 70000 + 0.91 / 210000)
WIDTH = (3 * FORCE * RADIUS / (4 * MODULUS)) ** (1 / 3)
PEAK = 1.5 * FORCE / (np.pi * WIDTH**2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    example = importlib.util.module_from_spec(SPEC)
    SPEC.loader.exec_module(example)
    folder = tmp_path_factory.mktemp("example")
    example.main(folder / "new", fine=0.25)
    return folder / "new"


@pytest.fixture(scope="module")
def solution(folder):
    return read_result(folder / "ball.vtkhdf").solution


def test_the_ball_is_carried_by_the_cup(solution):
    [zone] = solution.zones
    forces = zone.multiplier * zone.area * zone.coverage
    assert 4 * forces @ zone.normal[:, 2] == pytest.approx(FORCE, rel=2e-4)
    assert max(solution.quality.balance.values()) < 1e-10


def test_the_largest_pressure_is_that_of_hertz(solution):
    """To 4 %: means over faces a quarter of the contact wide, in bodies of a few radii."""
    [zone] = solution.zones
    assert zone.multiplier.max() == pytest.approx(PEAK, rel=0.04)
    r = np.hypot(*zone.centre[:, :2].T)
    inside = r < 0.75 * WIDTH
    hertz = PEAK * np.sqrt(1 - (r[inside] / WIDTH) ** 2)
    assert np.abs(zone.multiplier[inside] - hertz).max() < 0.05 * PEAK
    assert not zone.closed[r > 1.3 * WIDTH].any()


def test_the_pressure_is_the_same_in_both_directions(solution):
    """The mesh is not symmetric about x = y; what the halves on either side of it carry is."""
    [zone] = solution.zones
    x, y = zone.centre[:, :2].T
    force = zone.multiplier * zone.area
    moments = [force @ x, force @ y]
    assert moments[0] == pytest.approx(moments[1], rel=0.01)


def test_the_cells_are_quadratic_and_the_figures_are_there(folder, solution):
    assert {block.type for block in solution.mesh.cells} == {"tetra10"}
    for name in ("pressure", "picture"):
        assert ET.parse(folder / f"{name}.svg").getroot().tag.endswith("svg")
