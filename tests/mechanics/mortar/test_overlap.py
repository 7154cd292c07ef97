"""Cells inside another body, counted in parts and at once."""

import numpy as np
import pytest

import solver.lac.threads
import solver.simulation.judgement.plan
from solver.simulation.judgement.plan import inside_others
from tests.scenes import grid


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("many", [1, 5, 1 << 14])
@pytest.mark.parametrize("layers", [0, 1, 2])
def test_layers_of_cells_in_one_another(monkeypatch, many, layers, threads):
    """Two cubes of 3³ cells: of so many layers of each, the middles are in the other one."""
    monkeypatch.setattr(solver.simulation.judgement.plan, "_AT_ONCE", many)
    monkeypatch.setattr(solver.lac.threads, "workers", lambda: threads)
    points, cells = grid(3)
    depth = np.ptp(points[:, 0]) * (layers + 0.1) / 3
    moved = points + np.array([np.ptp(points[:, 0]) - depth, 1e-3, 1e-3])
    both = {"HEXA8": np.concatenate([cells, cells + len(points)])}
    body = np.repeat([0, 1], len(points))
    assert inside_others(np.concatenate([points, moved]), both, body) == 2 * 9 * layers
