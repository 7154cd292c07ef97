"""A case with another one standing beside it, in one mesh: each is as it is alone."""

import json
from copy import deepcopy
from pathlib import Path
from random import Random
from typing import Any

import meshio
import numpy as np

from solver.case.reader import parse_case
from solver.verification.run import mesh_of

from .cases import Case, by_body, drawn, move_places

OTHER = "other_"
"""Groups, zones and bodies of the other case begin with this."""
# Seeds of the cases beside which others differed.
_BESIDE = {"held": 179_093, "settles": 834_367}
# How far away it stands, along the last axis, that of an axisymmetric body.
_AWAY = 40.0
_NAMES = "group", "slave", "master", "name", "within"
_NAMED = "materials", "groups", "bodies"


def others(case: Case) -> Case:
    """A random case that may stand beside: of the same space, with the same steps and motion."""
    number = _BESIDE.get(case["name"], Random(case["name"]).randrange(1_000_000))
    while True:
        found, number = drawn(number), number + 1
        unnamed = all(isinstance(factor, float) for factor in found["steps"])
        if unnamed and _space(found) == _space(case):
            break
    steps = [1.0] if isinstance(case.get("steps", [1.0])[0], dict) else case.get("steps", [1.0])
    found = {key: value for key, value in found.items() if key != "motion"} | {"steps": steps}
    return found | ({"motion": case["motion"]} if "motion" in case else {})


def _space(case: Case) -> tuple[int, str]:
    return len(case["mesh"]["bottom"]["divisions"]), case.get("plane", "strain")


def meshed(case: Case) -> meshio.Mesh:
    """The mesh of a case."""
    return mesh_of(parse_case(json.dumps(case), Path("case")))


def beside(case: Case, other: Case) -> tuple[Case, meshio.Mesh, int]:
    """Both in one case, its mesh, and how many nodes of it are those of the first."""
    meshes = [meshed(each) for each in (case, other)]
    dim, _ = _space(case)
    by = np.zeros(meshes[1].points.shape[1])
    by[dim - 1] = _AWAY
    one, two = _of_bodies(case), _named(_of_bodies(other))
    move_places(two, by[:dim].tolist())
    lists = {
        key: [*one.get(key, []), *two.get(key, [])] for key in ("supports", "loads", "contact")
    }
    tables = {key: one.get(key, {}) | two.get(key, {}) for key in _NAMED}
    return one | lists | tables, _joined(*meshes, by), len(meshes[0].points)


def _of_bodies(case: Case) -> Case:
    """A copy without its mesh, each body with a material of its own."""
    found = {k: deepcopy(v) for k, v in case.items() if k not in ("mesh", "transform")}
    return found | {"materials": by_body(found["materials"])}


def _named(value: Any) -> Any:
    """The value of a case with the names of the other one."""
    if isinstance(value, list):
        return [_named(each) for each in value]
    if not isinstance(value, dict):
        return value
    found = {}
    for key, each in value.items():
        if key in _NAMED:
            found[key] = {OTHER + name: _named(one) for name, one in each.items()}
        else:
            found[key] = OTHER + each if key in _NAMES else _named(each)
    return found


def _joined(one: meshio.Mesh, two: meshio.Mesh, by: np.ndarray) -> meshio.Mesh:
    cells = [(block.type, block.data) for block in one.cells]
    cells += [(block.type, block.data + len(one.points)) for block in two.cells]
    nothing = np.zeros(0, dtype=int)
    sets = {name: [*each, *([nothing] * len(two.cells))] for name, each in one.cell_sets.items()}
    for name, each in two.cell_sets.items():
        sets[OTHER + name] = [*([nothing] * len(one.cells)), *each]
    return meshio.Mesh(np.vstack([one.points, two.points + by]), cells, cell_sets=sets)
