"""The inf-sup test on ladders of meshes: two unit blocks, and β_h level by level."""

import json
import logging
from functools import lru_cache
from pathlib import Path
from typing import Any

import meshio

from ...case.reader import parse_case
from ...mesh import generate
from ...mesh.catalogue import BY_NAME
from ...simulation.scene import build_scene
from ...system.errors import InputError, SolveError
from ...system.progress import OUTCOME
from .constant import inf_sup_constant
from .description import InfSupLadder, read_ladders
from .half_loaded import FACES, profiles
from .records import write_record

_LOG = logging.getLogger(__name__)


def measure(description: Path, output: Path, quick: bool) -> None:
    """Run all ladders of a file and the half-loaded block, and write the record."""
    ladders = [run(ladder) for ladder in read_ladders(description, quick)]
    write_record(output, ladders, profiles(FACES // 2 if quick else FACES))


def run(ladder: InfSupLadder) -> InfSupLadder:
    """Fill in every level; where one fails, its reason is kept and the rest left out."""
    for n in ladder.levels:
        try:
            _add_level(ladder, n)
        except (InputError, SolveError) as error:
            ladder.reason = str(error)
            break
    shown = " ".join(f"{constant:.3f}" for constant in ladder.constants)
    _LOG.log(OUTCOME, "%s: %s", ladder.name, shown or ladder.reason)
    return ladder


def _add_level(ladder: InfSupLadder, n: int) -> None:
    mesh = _mesh(ladder.cells, ladder.contact, n, max(1, n // ladder.coarser))
    case = parse_case(json.dumps(_case(ladder)), Path("infsup.yaml"))
    scene = build_scene(case, mesh)
    ladder.constants.append(inf_sup_constant(scene))
    ladder.macro_elements.append(sum(zone.count for zone in scene.zones))
    ladder.unknowns.append(scene.n_dofs)


@lru_cache(maxsize=4)
def _mesh(cells: str, contact: str, slave: int, master: int) -> meshio.Mesh:
    dim = BY_NAME[cells].dim
    recipe: dict[str, Any] = {"recipe": "blocks", "size": 1.0}
    for name, n in (("bottom", slave), ("top", master)):
        recipe[name] = {"cells": cells, "divisions": [n] * dim}
        if contact:
            recipe[name]["contact"] = contact
    return generate(recipe, "inf-sup test")


def _case(ladder: InfSupLadder) -> dict[str, Any]:
    axes = "xyz"[: ladder.dim]
    sides: dict[str, list[str]] = {f"sym{axis}": [axis] for axis in axes[:-1]}
    outer: dict[str, list[str]] = {"base": [axes[-1]]}
    if ladder.clamped:
        outer = {"base": list(axes), "press": list(axes)}
    zone = {"name": "interface", "slave": "bottom_contact", "master": "top_contact"}
    zone["treatment"] = "lac" if ladder.cut else "uncut"
    if ladder.hexahedra:
        zone["hexahedra"] = ladder.hexahedra
    return {
        "name": "infsup",
        "mesh": {"recipe": "blocks"},
        **({"plane": "strain"} if ladder.dim == 2 else {}),
        "materials": {"all": {"young": 1.0, "poisson": 0.3}},
        "supports": [{"group": g, "fix": fix} for g, fix in (sides | outer).items()],
        "contact": [zone],
    }
