"""Names and counts of bodies, from the groups of the mesh."""

import numpy as np

from .scene import Scene
from .solution import BodyInfo


def body_names(scene: Scene) -> list[str]:
    """For each body the smallest group of volume cells that holds it whole, else `body k`."""
    return [info.name for info in body_infos(scene)]


def body_infos(scene: Scene) -> list[BodyInfo]:
    """Each body as it was meshed: name, cells by type, faces on contact surfaces, role."""
    infos = []
    for number in range(scene.n_bodies):
        inside = {t: scene.body[c[:, 0]] == number for t, c in scene.given.cells.items()}
        cells = {t: int(mask.sum()) for t, mask in inside.items() if mask.any()}
        roles, faces = set(), 0
        for zone in scene.zones:
            for role, blocks in (("slave", zone.slave_faces), ("master", zone.master_faces)):
                count = sum(int((scene.body[b.nodes[:, 0]] == number).sum()) for b in blocks)
                faces += count
                roles |= {role} if count else set()
        role = "both" if len(roles) == 2 else next(iter(roles), "none")
        infos.append(BodyInfo(_name(scene, inside, number), cells, faces, role))
    return infos


def _name(scene: Scene, inside: dict[str, np.ndarray], number: int) -> str:
    holders = []
    for group, mask in scene.given.groups.items():
        if all(mask[t][cells].all() for t, cells in inside.items()):
            holders.append((sum(int(m.sum()) for m in mask.values()), group))
    return min(holders)[1] if holders else f"body {number + 1}"
