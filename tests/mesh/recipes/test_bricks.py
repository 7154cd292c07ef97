"""Bodies of bricks: nodes counted by hand, and what is refused."""

import re
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

from solver.mesh import generate
from solver.mesh.size import of_mesh
from solver.mesh.transforms import nodes_of
from solver.system.errors import InputError

SEAT = {
    "recipe": "bricks",
    "bricks": [
        {"name": "seat", "low": [-1, -1], "high": [0, 0]},
        {"name": "seat", "low": [0, -1], "high": [2, 0]},
        {"name": "seat", "low": [-1, 0], "high": [0, 1]},
        {"name": "block", "low": [0, 0], "high": [2, 1]},
    ],
}
for each, divisions in zip(SEAT["bricks"], ([2, 2], [4, 2], [2, 2], [3, 3]), strict=True):
    each["block"] = {"cells": "QUAD4", "divisions": divisions}


@pytest.mark.parametrize("refine", [1, 2])
def test_bricks_of_one_body_share_nodes(refine):
    """9 + 15 + 9 nodes of the seat, 3 and 3 on two sides in common, the corner once among them."""
    mesh = generate(SEAT | {"refine": refine}, "case.yaml")
    n = refine
    wanted = (2 * n + 1) * (6 * n + 1) + (2 * n + 1) * 2 * n
    assert nodes_of(mesh, "seat").sum() == wanted
    assert nodes_of(mesh, "block").sum() == (3 * n + 1) ** 2
    assert len(mesh.points) == wanted + (3 * n + 1) ** 2
    assert len(np.unique(mesh.points[nodes_of(mesh, "seat")], axis=0)) == wanted
    assert sorted(mesh.cell_sets) == ["block", "seat"]
    assert of_mesh(SEAT, Path()).points == 9 + 15 + 9 + 16


def changed(*keys_and_value):
    *keys, value = keys_and_value
    spec = deepcopy(SEAT)
    place = spec["bricks"]
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    return spec


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            changed(1, "block", "divisions", [4, 3]),
            "mesh.bricks[1]: has other nodes than bricks[0]",
        ),
        (changed(1, "low", [0]), "mesh.bricks[1].low = [0]: must be a list of 2 numbers for QUAD4"),
        (changed(0, "high", [-2, 0]), "mesh.bricks[0].high = [-2, 0]: must be greater than low"),
        (SEAT | {"bricks": []}, "mesh.bricks = []: must be a list of blocks"),
        (
            changed(
                3,
                {
                    "name": "block",
                    "low": [0, 0, 0],
                    "high": [1, 1, 1],
                    "block": {"cells": "HEXA8", "divisions": 1},
                },
            ),
            "mesh.bricks = ",
        ),
    ],
)
def test_refusals(spec, message):
    with pytest.raises(InputError, match=re.escape(message)):
        generate(spec, "case.yaml")
