"""The contact constraints of a scene, the free unknowns they act on, and the status to start from.

The constraints have a row for each multiplier of all zones, then for slips. The search for the
status starts from a guess by loads and initial gaps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from ...case.acting import Step
from ...lac.cells.faces import surface_nodes
from ...lac.motions import motion_fields, support_resistance, unheld_motion
from ...lac.operator import MIN_COVERAGE, without_round_off
from ...lac.roughness import Smooth, smoothed
from ...mechanics.fem.bodies import nodes_of_unknowns
from ...mechanics.fem.elasticity import stiffness
from ...mechanics.linear.choice import against_multigrid
from ...mechanics.linear.condensation import choose_pivots
from ...mechanics.linear.symmetric_blocks import NodalMatrix, Stiffness
from ...mechanics.linear.unknowns import Unknowns, from_vertices, linear_unknowns
from ...system.errors import InputError
from ..scene.bodies import body_names
from ..scene.scene import Scene, ZoneScene

# Multipliers whose coefficients on free unknowns are below this share of all are inactive.
_ACTIVE = 1e-12
# Coverage above one by more than this means that the master surface lies there twice. The areas of
# bent faces are known to the rules that integrate them: 5e-4 on an edge around a quarter.
_TWICE = 1e-2


@dataclass(frozen=True, kw_only=True)
class ContactConstraints:
    """∫ gap = initial + gaps · u, seen by k multipliers; then ∫ slip along tangents, with friction.

    `gaps` (k, n_dofs); `on_free` (k, n_free) the same on free unknowns; `initial` (k,); `area`,
    `covered` (k,) whole and intersected; `eligible` (k,) may close; `inactive_multipliers` (k,)
    move nothing; `own` (n_free,) marks the free unknowns of slave nodes, `moving` (k, n_dofs) has
    the coefficients of `gaps` on what supports leave free there. `normal` (k,): not of slip;
    `measured` (k,): initial gaps with a part that is measured on the mesh, as exact as coordinates
    are; `unloaded` (k,): see `Unloaded`.
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
    measured: np.ndarray
    unloaded: np.ndarray

    @property
    def closable(self) -> np.ndarray:
        """The multipliers (k,) of gaps that may close."""
        return self.eligible & self.normal

    def with_jumps(self, jump: np.ndarray) -> "ContactConstraints":
        """Those of which closed ones keep the mean gap or slip `jump` (k,)."""
        return replace(self, initial=self.initial - self.covered * jump)

    @cached_property
    def dependent(self) -> np.ndarray:
        """The numbers of eligible multipliers without a free unknown of their own."""
        _, found = choose_pivots(self.on_free[self.eligible], self.own)
        return np.flatnonzero(self.eligible)[~found]


def contact_constraints(scene: Scene, carried: np.ndarray | None = None) -> ContactConstraints:
    """Those of all zones; raises InputError where a zone cannot be in contact.

    `carried` (n_dofs,): a displacement that slips count beside that of the solve.
    """
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
    initial = np.where(normal, initial, 0.0 if carried is None else gaps @ carried)
    measured, unloaded = np.zeros((2, len(area)), dtype=bool)
    for zone in scene.zones:
        measured[zone.numbers] = zone.measured
    unloaded[normal] = scene.rest.unloaded_multipliers
    touching = covered / area > MIN_COVERAGE
    _refuse_surfaces(scene, touching)
    # Supports may hold the nodes of both surfaces. Macro-elements that were cut to own a free
    # unknown all act, or are refused.
    active = _row_sizes(on_free) > _ACTIVE * _row_sizes(gaps)
    for zone in scene.zones:
        for rows in zone.rows:
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
        measured=measured,
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


@dataclass(frozen=True)
class RigidMotions:
    """The r rigid motions of all bodies, by what resists them.

    `supports` (r, r): see `support_resistance`; `resisting` (s, r) and `opened` (k, r): what each
    motion changes in those rows of the scene, and the average gap that it opens; `smooth` (k, r)
    the same along smooth normals, where these differ. The motions themselves take as much memory as
    several displacements.
    """

    supports: np.ndarray
    resisting: sparse.csr_matrix
    opened: sparse.csr_matrix
    smooth: sparse.csr_matrix | None

    @classmethod
    def of(
        cls, scene: Scene, constraints: ContactConstraints, motions: sparse.csc_matrix
    ) -> "RigidMotions":
        """What resists `motions` (n_dofs, r)."""
        covered = constraints.covered
        weight = np.divide(1.0, covered, out=np.zeros(len(covered)), where=covered > 0)
        supports = support_resistance(motions, scene.free.basis)
        per_area = sparse.diags(weight)
        smooth = _smooth_gaps(scene)
        return cls(
            supports,
            scene.resisting @ motions,
            (per_area @ constraints.gaps).tocsr() @ motions,
            None if smooth is None else (per_area @ smooth).tocsr() @ motions,
        )


def _smooth_gaps(scene: Scene) -> sparse.csr_matrix | None:
    """The rows of all zones along smooth normals; None where these are those of the faces."""
    rows, bent = [], False
    for zone in scene.zones:
        operator, surface = zone.operator, zone.operator.surface
        rows.append(operator.matrix)
        if zone.zone.normal != "element" or operator.nodes is not None or scene.space < 3:
            continue
        faces = [(b.number, b.nodes) for b in zone.slave_faces]
        nodes, near = surface_nodes(zone.sub_faces), zone.near
        smooth = Smooth(scene.points, faces, nodes, surface.normal, surface.area, near)
        rows[-1] = smoothed(operator.matrix, smooth)
        bent = bent or rows[-1] is not operator.matrix
    slips = [row for zone in scene.zones for row in zone.operator.slip]
    return sparse.vstack([*rows, *slips]).tocsr() if bent else None


def free_motion(scene: Scene, motions: RigidMotions, closed: np.ndarray) -> str:
    """The free motion with `closed` (k,) multipliers, in words; empty if nothing is free."""
    held, smooth = (
        None if rows is None else sparse.vstack([rows[closed], motions.resisting]).tocsr()
        for rows in (motions.opened, motions.smooth)
    )
    found = unheld_motion(motions.supports, held, scene.n_bodies, smooth)
    if found is None:
        return ""
    return f"nothing keeps {body_names(scene)[found[0]]} from a free motion ({found[1]})"


def refuse_unsolvable(scene: Scene, moves: str, constraints: ContactConstraints) -> None:
    """Raise InputError where a body moves freely, or a cut macro-element owns no free unknown.

    `moves`: the free motion that is left with all of the contact closed; empty if none.
    """
    if moves:
        instead = "add a support, or refine the slave where contact should hold it"
        allowed = f"{moves}, even with all of the contact closed; {instead}"
        raise InputError(scene.case.path, "supports", None, allowed)
    lost = constraints.dependent
    for zone in scene.zones:
        mine = _macro_elements(zone, lost)
        if zone.treatment.cut and len(mine):
            place = zone.operator.surface.centre[mine[0]] + scene.coordinates.origin
            at = ", ".join(f"{x:.6g}" for x in place)
            allowed = (
                f"{len(mine)} macro-elements of zone {zone.zone.name} (the first, number "
                f"{mine[0]}, at ({at})) have no free unknown of their own: {_holding(scene)}"
            )
            raise InputError(scene.case.path, "supports", None, allowed)


def _macro_elements(zone: ZoneScene, rows: np.ndarray) -> np.ndarray:
    """The macro-elements of a zone that some rows (n,) belong to."""
    mine = [rows[(rows >= r.start) & (rows < r.stop)] - r.start for r in zone.rows]
    return np.unique(np.concatenate(mine))


def _holding(scene: Scene) -> str:
    """What may hold the inner nodes of macro-elements: a tie of slave nodes, or something else."""
    slaves = [f.nodes.ravel() for zone in scene.zones for f in zone.sub_faces]
    dim = scene.points.shape[1]
    basis = scene.free.basis.tocsc()
    several = np.repeat(np.diff(basis.indptr) > dim, np.diff(basis.indptr))
    if np.isin(basis.indices[several] // dim, np.concatenate(slaves)).any():
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
            elif scene.case.surfaces.get(master) == "plane":
                allowed += "; the normal of a rigid plane points out of the body"
            raise InputError(scene.case.path, key, master, allowed)


# A guess that leaves a body free is widened step by step, as if loads brought bodies nearer.
_NEARER, _NEAREST = 4.0, 4.0**12

FreeMotion = Callable[[np.ndarray], str]
"""Takes a status (k,) and describes the motion that it leaves free; empty if nothing can move."""


def first_guess(
    scene: Scene, constraints: ContactConstraints, step: Step, free_motion: FreeMotion
) -> np.ndarray:
    """Macro-elements (k,) that loads and imposed displacements are likely to close.

    If these leave a body free, as many more as hold it, in the order of their gaps.
    """
    guess, nearer = _likely(scene, constraints, step), 1.0
    while free_motion(guess) and nearer < _NEAREST:
        nearer *= _NEARER
        guess = _likely(scene, constraints, step, nearer)
    return constraints.closable if free_motion(guess) else guess


def moved(
    start: np.ndarray,
    before: Step,
    step: Step,
    scene: Scene,
    constraints: ContactConstraints,
    free_motion: FreeMotion,
) -> np.ndarray:
    """The status `start` (k,) of the step `before`, changed where the guesses of both differ.

    A cylinder's contact grows with its load, and its guess too; that of a receding contact, whose
    surfaces touch, does not change, and neither does its guess.
    """
    old, new = _likely(scene, constraints, before), _likely(scene, constraints, step)
    changed = (start | (new & ~old)) & ~(old & ~new)
    return start if free_motion(changed) else changed


def _likely(
    scene: Scene, constraints: ContactConstraints, step: Step, nearer: float = 1.0
) -> np.ndarray:
    """See `likely_closed`, for bodies that loads bring so many times `nearer`."""
    eligible = constraints.closable
    acting, offset = scene.acting(step)
    imposed = np.abs(offset).max(initial=0.0)
    moduli = 2 * np.concatenate([block.shear for block in scene.blocks])
    force = np.linalg.norm(acting, axis=1).sum()
    push = nearer * force * (1 / moduli.min() + 1 / moduli.max())
    gap = constraints.initial / np.where(eligible, constraints.covered, np.inf) - imposed
    return likely_closed(gap, constraints.covered, eligible, push, scene.space)


def likely_closed(
    gap: np.ndarray, area: np.ndarray, eligible: np.ndarray, push: float, dim: int
) -> np.ndarray:
    """Which macro-elements (m,) a force is likely to close, judged by their initial gaps (m,).

    Bodies that touch on an area A under a force F approach each other there by about F/(E* √A), in
    the plane by F/E*; `push` is F/E*, F per thickness in the plane. Macro-elements close in the
    order of their gaps up to that approach, from where bodies that are apart first touch. A first
    guess that is too small grows in one iteration; one that is too large shrinks step by step.

    In the plane, an approach of 2 closes gaps of 0 and 1, but not of 3:

    >>> gap, eligible = np.array([0.0, 1.0, 3.0]), np.ones(3, dtype=bool)
    >>> likely_closed(gap, np.ones(3), eligible, 2.0, 2).tolist()
    [True, True, False]
    """
    if not eligible.any():
        return eligible
    order = np.argsort(np.where(eligible, gap, np.inf), kind="stable")
    touching = np.cumsum(area[order])
    approach = push / touching ** ((dim - 2) / (dim - 1))
    above = gap[order] - max(gap[order[0]], 0.0)
    closed = np.zeros(len(gap), dtype=bool)
    closed[order[above <= approach]] = True
    return closed & eligible


def free_stiffness(scene: Scene, unknowns: Unknowns, single: bool) -> tuple[Stiffness, np.ndarray]:
    """The stiffness of the free unknowns, and the diagonal (n_dofs,) for all degrees of freedom.

    `single`: in single precision where multigrid solves.
    """
    free, added = scene.free, [part for part in scene.parts if part.stiffness is not None]
    iterative = not against_multigrid(len(unknowns.node), unknowns)
    plain = free.selection is not None and not added
    in_blocks = plain and iterative and scene.points.shape[1] == 3
    blocks = stiffness(scene.points, scene.blocks, single and in_blocks)
    diagonal = blocks.diagonal().astype(float)
    if in_blocks and free.selection is not None:
        return NodalMatrix(blocks, free.selection), diagonal
    matrix = free.reduced(blocks)
    for part in added:
        matrix = matrix + free.reduced(part.stiffness)
        diagonal = diagonal + part.diagonal
    return matrix, diagonal


def free_unknowns(scene: Scene) -> Unknowns:
    """The meaning of a scene's free unknowns."""
    basis, dim = scene.free.basis, scene.points.shape[1]
    node = nodes_of_unknowns(basis, dim)

    def motions() -> np.ndarray:
        # Those of axisymmetric sections in their plane hardly strain rings far from the axis.
        found = np.empty((len(node), 3 if dim == 2 else 6))
        for number, field in enumerate(motion_fields(scene.points, scene.body)):
            found[:, number] = scene.free.gathered(field.ravel())
        return found

    found = Unknowns(
        dim=dim,
        node=node,
        motions=motions,
        body=scene.body[node],
        points=scene.points,
        factored=next((part.factored for part in scene.parts if part.factored), ""),
        solver=scene.options.solver,
    )
    if dim == 2 or all(block.type.order == 1 for block in scene.blocks):
        return found
    vertices, linear = linear_unknowns(basis, dim, *from_vertices(scene.points, scene.blocks))
    return replace(found, vertices=vertices, linear=linear)
