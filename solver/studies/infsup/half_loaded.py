"""The block pressed on one half of its top: does the contact pressure oscillate along the surface?

Two plane blocks of 2 × 1, the lower one slave with many more faces than the master, are pressed
together by p = 25 on the left half of the top. The left sides are planes of symmetry. Contact
`bilateral` holds tension too; `opening`, the unloaded half may lift off. The largest second
difference |p₋ − 2 p + p₊| / 25 of neighbouring macro-elements is small where the pressure is
controlled; without the cut it is of the order of the pressure itself.
"""

import json
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...case.reader import parse_case
from ...mesh import generate
from ...simulation.problem import ContactProblem
from ...simulation.scene import build_scene
from ...system.progress import OUTCOME

_LOG = logging.getLogger(__name__)

PRESSURE, FACES, COARSER = 25.0, 64, 4
CELLS = {"TRIA3": True, "QUAD4": True, "TRIA6": False, "QUAD8": False, "QUAD9": False}
"""Plane cells, and whether they are cut."""
_LEFT = "12.5 * (1 + (1 - x) / sqrt((1 - x)**2))"  # 25 where x < 1, else 0


@dataclass(frozen=True)
class PressureProfile:
    """Contact pressure over 25 along the interface: `place` and `pressure`, a value a face.

    `cut`: with the cut, or as meshed where the cells need none.
    """

    cells: str
    cut: bool
    bilateral: bool
    place: list[float]
    pressure: list[float]

    @property
    def oscillation(self) -> float:
        """The largest second difference of neighbours."""
        return float(np.abs(np.diff(self.pressure, 2)).max())


def profiles(faces: int = FACES) -> list[PressureProfile]:
    """All cells, cut and uncut, bilateral and opening, on so many slave faces."""
    found = []
    for cells, has_cut in CELLS.items():
        for cut in (True, False) if has_cut else (True,):
            pair = profile_pair(cells, cut, faces)
            shown = " and ".join(f"{profile.oscillation:.2f}" for profile in pair)
            uncut = "" if cut else ", uncut"
            _LOG.log(OUTCOME, "half-loaded block, %s%s: %s", cells, uncut, shown)
            found += pair
    return found


def profile_pair(cells: str, cut: bool, faces: int = FACES) -> list[PressureProfile]:
    """The profiles of one kind of cells, bilateral and opening."""
    master = faces // COARSER
    recipe = {
        "recipe": "blocks",
        "size": [2.0, 1.0],
        "bottom": {"cells": cells, "divisions": [faces, faces // 2]},
        "top": {"cells": cells, "divisions": [master, max(1, master // 2)]},
    }
    mesh = generate(recipe, "half-loaded block")
    case = parse_case(json.dumps(_case(cut)), Path("half-loaded.yaml"))
    scene = build_scene(case, mesh)
    problem = ContactProblem(scene)
    place = scene.zones[0].operator.surface.centre[:, 0] + scene.origin[0]
    order = np.argsort(place)
    found = []
    for bilateral in (True, False):
        pressure = problem.solve(1.0, bilateral=bilateral).pressure / PRESSURE
        along = place[order].tolist(), pressure[order].tolist()
        found.append(PressureProfile(cells, cut, bilateral, *along))
    return found


def _case(cut: bool) -> dict[str, Any]:
    zone = {"name": "interface", "slave": "bottom_contact", "master": "top_contact"}
    return {
        "name": "half-loaded",
        "mesh": {"recipe": "blocks"},
        "plane": "strain",
        "materials": {"all": {"young": 2000.0, "poisson": 0.3}},
        "supports": [{"group": "base", "fix": ["y"]}, {"group": "symx", "fix": ["x"]}],
        "loads": [{"group": "press", "pressure": _LEFT}],
        "contact": [zone | {"treatment": "lac" if cut else "uncut"}],
    }
