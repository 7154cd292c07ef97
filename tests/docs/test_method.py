"""The method in one script, against the patch test, statics and the whole program."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from solver import solve_case

FILE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "method.py"
SPEC = importlib.util.spec_from_file_location("method", FILE)


@pytest.fixture(scope="module")
def method():
    module = importlib.util.module_from_spec(SPEC)
    SPEC.loader.exec_module(module)
    return module


def test_the_script_is_short():
    assert len(FILE.read_text(encoding="utf-8").splitlines()) < 100


@pytest.mark.parametrize(("bottom", "top"), [(5, 4), (3, 7), (4, 4)])
def test_a_uniform_load_gives_its_own_pressure(method, bottom, top):
    pressure = method.contact_pressure(method.two_blocks(bottom, top), lambda x: 0 * x[:, 0] + 25.0)
    assert pressure == pytest.approx(np.full(top, 25.0), rel=1e-12)


def test_a_load_beside_the_middle_opens_the_far_end_as_in_the_whole_program(method):
    """Pressed with 25 at x = 0, pulled with 15 at x = 50: a force of 5 · 50 N/mm is carried."""
    mesh = method.two_blocks(9, 8)
    pressure = method.contact_pressure(mesh, lambda x: 25.0 - 0.8 * x[:, 0])
    assert pressure.sum() * 50.0 / 8 == pytest.approx(5.0 * 50.0, rel=1e-10)
    assert 0 < (pressure == 0.0).sum() < 8
    node = np.arange(len(mesh.points))
    mesh.point_sets = {
        "base": node[mesh.points[:, 1] == -50.0],
        "left": node[mesh.points[:, 0] == 0.0],
    }

    case = {
        "name": "pressed",
        "plane": "strain",
        "materials": {"all": {"young": 2000.0, "poisson": 0.3}},
        "supports": [{"group": "base", "fix": ["y"]}, {"group": "left", "fix": ["x"]}],
        "loads": [{"group": "top upper", "pressure": "25 - 0.8 * x"}],
        "contact": [{"name": "interface", "slave": "top lower", "master": "bottom upper"}],
    }
    whole = solve_case(case, mesh)
    assert pressure == pytest.approx(whole.zones["interface"].multiplier, abs=1e-9)
