"""The contact constraints of a scene: a row for each multiplier of all zones, then for slips."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from ..lac.operator import without_round_off
from ..mechanics.fem.bodies import support_resistance, unheld_motion
from ..mechanics.linear.condensation import choose_pivots
from ..system.errors import InputError
from .naming import body_names
from .scene import Scene, ZoneScene

# A macro-element covered by less than this share of its area is out of contact.
MIN_COVERAGE = 0.01
# Multipliers whose coefficients on free unknowns are below this share of all are inactive.
_ACTIVE = 1e-12
# Coverage above one by more than this means that the master surface lies there twice.
_TWICE = 1e-6


@dataclass(frozen=True, kw_only=True)
class ContactConstraints:
    """∫ gap = initial + gaps · u, seen by k multipliers; then ∫ slip along tangents, with friction.

    `gaps` (k, n_dofs); `on_free` (k, n_free) the same on free unknowns; `initial` (k,); `area`,
    `covered` (k,) whole and intersected; `eligible` (k,) may close; `inactive_multipliers` (k,)
    move nothing; `own` (n_free,) marks the free unknowns of slave nodes, `moving` (k, n_dofs) has
    the coefficients of `gaps` on what supports leave free there. `normal` (k,): not of slip;
    `unloaded` (k,): see `Unloaded`.
    """

    gaps: sparse.csr_matrix
    on_free: sparse.csr_matrix
    initial: np.ndarray
    area: np.ndarray
    covered: np.ndarray
    eligible: np.ndarray
    inactive_multipliers: np.ndarray
    moving: sparse.csr_matrix
    own: np.ndarray
    normal: np.ndarray
    unloaded: np.ndarray

    @property
    def closable(self) -> np.ndarray:
        """The multipliers (k,) of gaps that may close."""
        return self.eligible & self.normal

    @cached_property
    def dependent(self) -> np.ndarray:
        """The numbers of eligible multipliers without a free unknown of their own."""
        _, found = choose_pivots(self.on_free[self.eligible], self.own)
        return np.flatnonzero(self.eligible)[~found]


def contact_constraints(scene: Scene) -> ContactConstraints:
    """Those of all zones; raises InputError where a zone cannot be in contact."""
    operators = [zone.operator for zone in scene.zones]
    empty = sparse.csr_matrix((0, scene.n_dofs))
    slips = [row for o in operators for row in o.slip]
    gaps = sparse.vstack([empty, *(o.matrix for o in operators), *slips]).tocsr()
    on_free = (gaps @ scene.free.basis).tocsr()
    if slips:
        on_free = without_round_off(on_free)
    repeated = [*operators, *(o for o in operators for _ in o.slip)]
    initial, area, covered = (
        np.concatenate([np.empty(0), *(getattr(o, k) for o in repeated)])
        for k in ("initial", "area", "covered")
    )
    normal = np.arange(len(area)) < scene.n_multipliers
    initial = np.where(normal, initial, 0.0)
    unloaded = np.zeros(len(area), dtype=bool)
    unloaded[normal] = scene.rest.unloaded_multipliers
    touching = covered / area > MIN_COVERAGE
    _refuse_surfaces(scene, touching)
    # Supports may hold the nodes of both surfaces. Macro-elements that were cut to own a free
    # unknown all act, or are refused.
    active = _row_sizes(on_free) > _ACTIVE * _row_sizes(gaps)
    for zone in scene.zones:
        for rows in (zone.numbers, *zone.slips):
            active[rows] |= zone.treatment.cut
    slave = _slave_dofs(scene)
    free = slave & (np.diff(scene.free.basis.indptr) > 0)
    moving = (gaps @ sparse.diags(free.astype(float))).tocsr()
    moving.eliminate_zeros()
    return ContactConstraints(
        gaps=gaps,
        on_free=on_free,
        initial=initial,
        area=area,
        covered=covered,
        eligible=touching & active & ~unloaded,
        inactive_multipliers=touching & ~active,
        moving=moving,
        own=np.asarray(abs(scene.free.basis).T @ slave.astype(float)) > 0,
        normal=normal,
        unloaded=unloaded,
    )


def _row_sizes(matrix: sparse.csr_matrix) -> np.ndarray:
    return np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=1)).ravel())


def _slave_dofs(scene: Scene) -> np.ndarray:
    """Which degrees of freedom (n_dofs,) belong to slave nodes."""
    dim, slave = scene.points.shape[1], np.zeros(scene.n_dofs, dtype=bool)
    for zone in scene.zones:
        for faces in zone.sub_faces:
            slave[(dim * faces.nodes[..., None] + np.arange(dim)).ravel()] = True
    return slave


def unit_springs(scene: Scene) -> sparse.csr_matrix:
    """The rows (k, n_dofs) of the stiffness of springs, the largest entry of each one.

    They resist the same motions, soft springs beside stiff ones too. None where there are none.
    """
    if not scene.springs.nnz:
        return scene.springs[:0]
    largest = abs(scene.springs).max(axis=1).toarray().ravel()
    return (sparse.diags_array(1 / np.where(largest > 0, largest, 1.0)) @ scene.springs).tocsr()


@dataclass(frozen=True)
class RigidMotions:
    """The r rigid motions of all bodies, by what resists them.

    `supports` (r, r): see `support_resistance`; `springs` (s, r) and `opened` (k, r): what each
    motion changes in the rows of `unit_springs`, and the average gap that it opens. The motions
    themselves take as much memory as several displacements.
    """

    supports: np.ndarray
    springs: sparse.csr_matrix
    opened: sparse.csr_matrix

    @classmethod
    def of(
        cls, scene: Scene, constraints: ContactConstraints, motions: sparse.csc_matrix
    ) -> "RigidMotions":
        """What resists `motions` (n_dofs, r)."""
        covered = constraints.covered
        weight = np.divide(1.0, covered, out=np.zeros(len(covered)), where=covered > 0)
        supports = support_resistance(motions, scene.free.basis)
        opened = (sparse.diags(weight) @ constraints.gaps).tocsr() @ motions
        return cls(supports, unit_springs(scene) @ motions, opened)


def free_motion(scene: Scene, motions: RigidMotions, closed: np.ndarray) -> str:
    """The free motion with `closed` (k,) multipliers, in words; empty if nothing is free."""
    held = sparse.vstack([motions.opened[closed], motions.springs]).tocsr()
    found = unheld_motion(motions.supports, held, scene.n_bodies)
    if found is None:
        return ""
    return f"nothing keeps {body_names(scene)[found[0]]} from a free motion ({found[1]})"


def refuse_unsolvable(scene: Scene, moves: str, constraints: ContactConstraints) -> None:
    """Raise InputError where a body moves freely, or a cut macro-element owns no free unknown.

    `moves`: the free motion that is left with all of the contact closed; empty if none.
    """
    if moves:
        allowed = f"{moves}, even with all of the contact closed; add a support"
        raise InputError(scene.case.path, "supports", None, allowed)
    lost = constraints.dependent
    for zone in scene.zones:
        mine = _macro_elements(zone, lost)
        if zone.treatment.cut and len(mine):
            place = zone.operator.surface.centre[mine[0]] + scene.origin
            at = ", ".join(f"{x:.6g}" for x in place)
            allowed = (
                f"{len(mine)} macro-elements of zone {zone.zone.name} (the first, number "
                f"{mine[0]}, at ({at})) have no free unknown of their own: {_holding(scene)}"
            )
            raise InputError(scene.case.path, "supports", None, allowed)


def _macro_elements(zone: ZoneScene, rows: np.ndarray) -> np.ndarray:
    """The macro-elements of a zone that some rows (n,) belong to."""
    mine = [
        rows[(rows >= r.start) & (rows < r.stop)] - r.start for r in (zone.numbers, *zone.slips)
    ]
    return np.unique(np.concatenate(mine))


def _holding(scene: Scene) -> str:
    """What may hold the inner nodes of macro-elements: a tie of slave nodes, or something else."""
    slaves = [f.nodes.ravel() for zone in scene.zones for f in zone.sub_faces]
    dim = scene.points.shape[1]
    basis = scene.free.basis.tocsc()
    tied = np.repeat(np.diff(basis.indptr) > dim, np.diff(basis.indptr))
    if np.isin(basis.indices[tied] // dim, np.concatenate(slaves)).any():
        return (
            "their nodes move together; name the other surface as slave (solve --swap), or tie the "
            "other side of the body"
        )
    return "supports or another zone hold their inner nodes"


def _refuse_surfaces(scene: Scene, touching: np.ndarray) -> None:
    for i, zone in enumerate(scene.zones):
        key, master, slave = scene.case.zone_key(i, "master"), zone.zone.master, zone.zone.slave
        surface = zone.operator.surface
        worst = float((surface.covered / surface.area).max())
        if worst > 1 + _TWICE:
            allowed = f"covers a macro-element {worst:.3g} times: it must not fold over itself"
            raise InputError(scene.case.path, key, master, allowed)
        if not touching[zone.numbers].any():
            allowed = f"does not lie over {slave} anywhere along the normals of {slave}"
            if worst > 0:
                allowed = (
                    f"covers at most {worst:.1e} of a slave face of {slave}: do both bodies have "
                    "the same unit of length?"
                )
            elif (body := scene.case.rigid.get(master)) and body.surface == "plane":
                allowed += "; the normal of a rigid plane points out of the body"
            raise InputError(scene.case.path, key, master, allowed)
