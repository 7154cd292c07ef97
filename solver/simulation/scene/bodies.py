"""The bodies of a scene: their names, where they touch, and what nothing moves.

Groups of bodies without any load are left out of a solve: their displacement is zero. Bodies belong
together where a multiplier moves free unknowns of both. Without load, displacement imposed and
initial overlap, u = 0 and p = 0 fulfil equilibrium, p ≥ 0, ḡ ≥ 0 and p ḡ = 0, whatever the status
of their contact; ḡ stays the initial gap. A body that supports or its rigidity hold all over, where
it is, has neither strain nor a free unknown: its stiffness is not needed, whatever presses on it.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ...lac.motions import rigid_motions, support_resistance, unheld_motion
from ...mechanics.fem.bodies import joined_bodies, nodes_of_unknowns
from ...mechanics.fem.supports import FreeMotion
from .records import Unloaded
from .scene import Scene


def body_names(scene: Scene) -> list[str]:
    """For each body the smallest group of volume cells that holds it whole, else `body k`."""
    return [_name(scene, number) for number in range(scene.n_bodies)]


def meshed_cells(scene: Scene, number: int) -> dict[str, np.ndarray]:
    """Which cells (n,) of each type, before the cut, belong to a body."""
    return {t: scene.body[c[:, 0]] == number for t, c in scene.given.cells.items()}


def _name(scene: Scene, number: int) -> str:
    inside, holders = meshed_cells(scene, number), []
    for group, mask in scene.given.groups.items():
        if all(mask[t][cells].all() for t, cells in inside.items()):
            holders.append((sum(int(m.sum()) for m in mask.values()), group))
    return min(holders)[1] if holders else f"body {number + 1}"


# Nodes nearer than this share of the model's length are at one place.
ONE_PLACE = 1e-10


def bodies_of(scene: Scene, faces: list) -> set[int]:
    """The numbers of the bodies that faces belong to."""
    return {int(b) for block in faces for b in np.unique(scene.body[block.nodes[:, 0]])}


def coincident(scene: Scene) -> dict[tuple[int, int], int]:
    """How many nodes pairs of bodies have at the same places, where no zone is between them."""
    apart = ~np.eye(scene.n_bodies, dtype=bool)
    for zone in scene.zones:
        sides = (sorted(bodies_of(scene, f)) for f in (zone.slave_faces, zone.master_faces))
        pair = np.ix_(*sides)
        apart[pair] = apart.T[pair] = False
    if not apart.any():
        return {}
    pairs = cKDTree(scene.points).query_pairs(
        ONE_PLACE * scene.coordinates.length, output_type="ndarray"
    )
    a, b = np.sort(scene.body[pairs], axis=1).reshape(-1, 2).T
    return Counter(zip(a[apart[a, b]].tolist(), b[apart[a, b]].tolist(), strict=True))


def without_unloaded(scene: Scene) -> Scene:
    """The scene without the cells and unknowns of such groups, and the cells of bodies held.

    No group is left out where a body could move freely (a solve refuses it by name), and nothing
    where there would be nothing to solve.
    """
    if scene.loads.histories:  # what acts in one step may not in another
        return scene
    gaps, free = _gaps(scene), scene.free
    acting = (gaps @ free.basis).tocsr()
    bodies = scene.body[nodes_of_unknowns(free.basis, scene.points.shape[1])]
    unloaded, fixed = _unloaded(scene, gaps, acting, bodies)
    if unloaded.any() and _moves_freely(scene, gaps):
        unloaded[:] = False
    kept = ~unloaded[bodies]
    if not (unloaded | fixed).any() or not kept.any():
        return scene
    selection = None if free.selection is None else free.selection[kept]
    out = (unloaded | fixed)[scene.body]
    blocks = (block.of(~out[block.cells[:, 0]]) for block in scene.blocks)
    return replace(
        scene,
        rest=Unloaded(
            unloaded_bodies=unloaded,
            fixed_bodies=fixed,
            unloaded_multipliers=np.asarray(abs(acting) @ (~kept).astype(float)) > 0,
        ),
        blocks=[block for block in blocks if len(block.cells)],
        free=FreeMotion(free.basis[:, np.flatnonzero(kept)], free.offset, selection),
    )


def _unloaded(
    scene: Scene, gaps: sparse.csr_matrix, acting: sparse.csr_matrix, bodies: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which bodies (b,) nothing moves: those with free unknowns, and those without.

    `gaps` (k, n_dofs) on all unknowns, `acting` (k, n_free) on free ones, those of `bodies`.
    """
    n_bodies = scene.n_bodies
    group = joined_bodies(acting, bodies, n_bodies)
    offset = scene.free.offset
    awake, imposed = np.zeros((2, n_bodies), dtype=bool)
    imposed[scene.body[(offset.reshape(scene.loads.force.shape) != 0).any(axis=1)]] = True
    awake[scene.body[(scene.loads.force != 0).any(axis=1)]] = True
    for part in scene.parts:
        imposed[scene.body[part.loaded]] = True
    awake |= imposed
    initial = np.concatenate([np.empty(0), *(zone.operator.initial for zone in scene.zones)])
    pushed = np.flatnonzero((initial < 0) | (gaps @ offset != 0))
    awake[bodies[acting[pushed].indices]] = True
    of_group = np.zeros(n_bodies, dtype=bool)
    of_group[group[awake]] = True
    with_unknowns = np.isin(np.arange(n_bodies), bodies)
    return with_unknowns & ~of_group[group], ~with_unknowns & ~imposed


def _moves_freely(scene: Scene, gaps: sparse.csr_matrix) -> bool:
    covered = np.concatenate([zone.operator.covered for zone in scene.zones] or [np.empty(0)])
    there = covered > 0
    per_area = sparse.diags(1 / covered[there]) @ gaps[there]
    motions = rigid_motions(scene.points, scene.body, scene.case.axisymmetric)
    opened = sparse.vstack([per_area, scene.resisting]).tocsr() @ motions
    supports = support_resistance(motions, scene.free.basis)
    return unheld_motion(supports, opened, scene.n_bodies) is not None


def _gaps(scene: Scene) -> sparse.csr_matrix:
    empty = sparse.csr_matrix((0, scene.n_dofs))
    return sparse.vstack([empty, *(zone.operator.matrix for zone in scene.zones)]).tocsr()
