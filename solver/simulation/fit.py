"""Whether a case fits its mesh: what makes no sense once bodies and contact are known.

What a case file alone shows is refused in `case.rules`, what a mesh alone shows where it is read. A
group or a surface that is missing is refused where it is looked up, and a motion that nothing
resists by the contact problem. All else is here. The first refusal ends a solve; `validate --mesh`
names all.
"""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from ..system.errors import InputError, hint
from .scene.bodies import ONE_PLACE, bodies_of, body_names
from .scene.probing import cell_at, faces_at
from .scene.scene import Scene, ZoneScene

# Bodies that overlap by more than this share of the smaller one are no problem of small strain.
_DEEPEST = 0.1


def refuse_unfit(scene: Scene) -> None:
    """Raise the first refusal."""
    for error in refusals(scene):
        raise error


def refusals(scene: Scene) -> Iterator[InputError]:
    """All refusals of a scene."""
    for i, zone in enumerate(scene.zones):
        yield from _groups(scene, i, zone)
        yield from _deep_overlap(scene, i, zone)
    yield from _unmerged(scene)
    for name in scene.case.probes:
        yield from _probe(scene, name)
    yield from _compared(scene)


def _compared(scene: Scene) -> Iterator[InputError]:
    """What a case gives values of is there: holds something, or is a body."""
    case, held, bodies = scene.case, scene.holders, body_names(scene)
    for group in case.reference.values.get("reaction", {}):
        if group not in held:
            allowed = f"no support holds it; {hint(group, held)}"
            yield InputError(case.path, f"reference.reaction.{group}", group, allowed)
    for group in case.mesh.counts:
        if group not in bodies:
            allowed = f"is not a body; {hint(group, bodies)}"
            yield InputError(case.path, f"counts.{group}", group, allowed)


def _groups(scene: Scene, i: int, zone: ZoneScene) -> Iterator[InputError]:
    """A group on several bodies, one of which is on the other side too, was picked by mistake."""
    sides = {"slave": zone.slave_faces, "master": zone.master_faces}
    bodies = {side: bodies_of(scene, faces) for side, faces in sides.items()}
    common = bodies["slave"] & bodies["master"]
    for side, other in (("slave", "master"), ("master", "slave")):
        if common and len(bodies[side]) > 1:
            names = body_names(scene)
            held = ", ".join(names[b] for b in sorted(bodies[side]))
            allowed = (
                f"has faces on several bodies ({held}), of which {names[min(common)]} carries the "
                f"{other} too; a surface must be on one body, or on others than its partner"
            )
            group = getattr(zone.zone, side)
            yield InputError(scene.case.path, scene.case.zone_key(i, side), group, allowed)


def _deep_overlap(scene: Scene, i: int, zone: ZoneScene) -> Iterator[InputError]:
    operator = zone.operator
    covered = np.where(operator.covered > 0, operator.covered, np.inf)
    depth = -operator.initial / covered
    used = bodies_of(scene, zone.slave_faces) | bodies_of(scene, zone.master_faces)
    size = min(float(np.ptp(scene.points[scene.body == b], axis=0).max()) for b in used)
    deep = depth > _DEEPEST * size
    if deep.any():
        worst = int(depth.argmax())
        allowed = (
            f"the surfaces overlap by {depth[worst]:.4g} at multiplier {worst} of zone "
            f"{zone.zone.name} ({int(deep.sum())} beyond the limit); allowed is {_DEEPEST:g} of "
            f"the smaller body, {_DEEPEST * size:.4g}"
        )
        yield InputError(scene.case.path, scene.case.zone_key(i, "slave"), zone.zone.slave, allowed)


def _unmerged(scene: Scene) -> Iterator[InputError]:
    """Nodes of one body at one place without contact between them: an unintended slit."""
    surfaces = [b.nodes.ravel() for z in scene.zones for b in (*z.slave_faces, *z.master_faces)]
    surfaces += [f.nodes.ravel() for z in scene.zones for f in z.sub_faces]
    pairs = cKDTree(scene.points).query_pairs(
        ONE_PLACE * scene.coordinates.length, output_type="ndarray"
    )
    within = scene.body[pairs[:, 0]] == scene.body[pairs[:, 1]]
    on_surface = np.isin(pairs, np.concatenate([np.empty(0, dtype=int), *surfaces]))
    loose = pairs[within & ~on_surface.all(axis=1)]
    if len(loose):
        name = body_names(scene)[scene.body[loose[0, 0]]]
        place = ", ".join(f"{x:.6g}" for x in scene.points[loose[0, 0]] + scene.coordinates.origin)
        allowed = (
            f"{len(loose)} pairs of nodes of {name} are at one "
            f"place and not on a contact surface (the first at ({place})): merge them, or let a "
            "contact zone join them"
        )
        yield InputError(scene.case.path, "mesh", None, allowed)


def _probe(scene: Scene, name: str) -> Iterator[InputError]:
    """A point outside of what it is asked of, or in two bodies at once."""
    probe = scene.case.probes[name]
    try:
        if probe.zone:
            zone = next(zone for zone in scene.zones if zone.zone.name == probe.zone)
            faces_at(scene, name, [(block.type.name, block.nodes) for block in zone.sub_faces])
        elif not probe.group:
            cell_at(scene, name)
    except InputError as error:
        yield error
