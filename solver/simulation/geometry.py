"""Geometry that makes no sense as a contact problem: refused with place and group.

What a mesh alone shows (flat cells, missing nodes) is refused when it is read; this looks at the
bodies and at the contact between them.
"""

import numpy as np
from scipy.spatial import cKDTree

from ..system.errors import InputError
from .naming import body_names
from .scene import Scene, ZoneScene

# Nodes nearer than this share of the model's length are at one place.
_ONE_PLACE = 1e-10
# Bodies that overlap by more than this share of the smaller one are no problem of small strain.
_DEEPEST = 0.1


def check_geometry(scene: Scene) -> None:
    """Raise `InputError` for the first thing that makes no sense."""
    for i, zone in enumerate(scene.zones):
        _refuse_mixed_groups(scene, i, zone)
        _refuse_deep_overlap(scene, i, zone)
    _refuse_unmerged(scene)


def _refuse_mixed_groups(scene: Scene, i: int, zone: ZoneScene) -> None:
    """A group on several bodies, one of which is on the other side too, was picked by mistake."""
    bodies = {side: _bodies(scene, getattr(zone, f"{side}_faces")) for side in ("slave", "master")}
    common = bodies["slave"] & bodies["master"]
    for side in ("slave", "master"):
        if common and len(bodies[side]) > 1:
            names = body_names(scene)
            held = ", ".join(names[b] for b in sorted(bodies[side]))
            other = "master" if side == "slave" else "slave"
            allowed = (
                f"has faces on several bodies ({held}), of which {names[min(common)]} carries the "
                f"{other} too; a surface must be on one body, or on others than its partner"
            )
            group = getattr(zone.zone, side)
            raise InputError(scene.case.path, scene.case.zone_key(i, side), group, allowed)


def _bodies(scene: Scene, faces: list) -> set[int]:
    return {int(b) for block in faces for b in np.unique(scene.body[block.nodes[:, 0]])}


def _refuse_deep_overlap(scene: Scene, i: int, zone: ZoneScene) -> None:
    operator = zone.operator
    covered = np.where(operator.covered > 0, operator.covered, np.inf)
    depth = -operator.initial / covered
    used = _bodies(scene, zone.slave_faces) | _bodies(scene, zone.master_faces)
    size = min(float(np.ptp(scene.points[scene.body == b], axis=0).max()) for b in used)
    deep = depth > _DEEPEST * size
    if deep.any():
        worst = int(depth.argmax())
        allowed = (
            f"the surfaces overlap by {depth[worst]:.4g} at multiplier {worst} of zone "
            f"{zone.zone.name} ({int(deep.sum())} beyond the limit); allowed is {_DEEPEST:g} of "
            f"the smaller body, {_DEEPEST * size:.4g}"
        )
        raise InputError(scene.case.path, scene.case.zone_key(i, "slave"), zone.zone.slave, allowed)


def _refuse_unmerged(scene: Scene) -> None:
    """Nodes of one body at one place without contact between them: an unintended slit."""
    surfaces = [b.nodes.ravel() for z in scene.zones for b in (*z.slave_faces, *z.master_faces)]
    surfaces += [f.nodes.ravel() for z in scene.zones for f in z.sub_faces]
    pairs = cKDTree(scene.points).query_pairs(_ONE_PLACE * scene.length, output_type="ndarray")
    within = scene.body[pairs[:, 0]] == scene.body[pairs[:, 1]]
    on_surface = np.isin(pairs, np.concatenate([np.empty(0, dtype=int), *surfaces]))
    loose = pairs[within & ~on_surface.all(axis=1)]
    if len(loose):
        name = body_names(scene)[scene.body[loose[0, 0]]]
        place = ", ".join(f"{x:.6g}" for x in scene.points[loose[0, 0]] + scene.origin)
        allowed = (
            f"{len(loose)} pairs of nodes of {name} are at one "
            f"place and not on a contact surface (the first at ({place})): merge them, or let a "
            "contact zone join them"
        )
        raise InputError(scene.case.path, "mesh", None, allowed)
