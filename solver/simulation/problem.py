"""The contact problem of a scene at one load factor: status, displacement, pressure."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from solver.mechanics.fem.bodies import rigid_motions, unheld_motion, unsupported
from solver.mechanics.fem.elasticity import cancellation, internal_force, stiffness
from solver.mechanics.linear.condensation import Constrained, choose_pivots, solve
from solver.mechanics.mortar.status import GAP_NOISE, StatusResult, find_status, likely_closed
from solver.simulation.accuracy import (
    EPSILON,
    EPSILON_EXTENDED,
    Accuracy,
    Roughness,
    pressure_of_forces,
    pressure_of_gaps,
    roughness,
    terms_of,
)
from solver.simulation.displacement import Displacement
from solver.simulation.naming import body_names
from solver.simulation.scene import Scene
from solver.simulation.systems import Systems, parts_of, unknowns_of
from solver.system.errors import InputError, SolveError

# A macro-element covered by less than this share of its area is out of contact.
MIN_COVERAGE = 0.01
# An estimated error of the pressure from which residuals are summed in extended precision.
_EXTEND = 3e-11
# A multiplier that moves free unknowns by less than this share of all that it moves acts on none.
_HELD = 1e-12
# Coverage above one by more than this means that the master surface lies there twice.
_TWICE = 1e-6


@dataclass(frozen=True)
class Equilibrium:
    """A solved load factor: displacement (n, dim), pressure and gap (m,), status, residual.

    `force` and `internal` (n, dim): the loads, and the internal forces that meet them.
    `straining` (2, n, dim): both parts of the displacement less a rigid motion of each body, from
    which strains are taken (see `Displacement`). `mean_stress` (k,) is that of cells in mixed form.
    """

    displacement: np.ndarray
    straining: np.ndarray
    mean_stress: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    status: StatusResult
    residual: float
    force: np.ndarray
    internal: np.ndarray
    accuracy: Accuracy
    extended: bool


@dataclass(frozen=True)
class _Iterate:
    """The contact problem's unknowns as the condensed solve sees them."""

    problem: "ContactProblem"
    closed: np.ndarray
    force: np.ndarray
    displacement: Displacement
    mean_stress: np.ndarray
    extended: bool = False

    @property
    def straining(self) -> np.ndarray:
        """Both parts (2, n, dim) of the displacement that strains."""
        return self.displacement.straining.reshape(2, *self.force.shape)

    @cached_property
    def defect(self) -> np.ndarray:
        """By how much the mean stress differs from λ div u; see `solver.mechanics.fem.mixed`."""
        return self.problem.scene.mean.defect(self.straining, self.mean_stress)

    @cached_property
    def internal(self) -> np.ndarray:
        """Internal forces (n, dim)."""
        scene = self.problem.scene
        if scene.options.safeguards.differences:
            internal = internal_force(scene.points, scene.blocks, self.straining, self.extended)
        else:
            product = self.problem.whole_stiffness @ self.displacement.total
            internal = product.reshape(self.force.shape)
        return internal + scene.mean.force(self.mean_stress)

    def residual(self) -> np.ndarray:
        basis = self.problem.scene.free.basis
        return basis.T @ (self.force - self.internal).astype(float).ravel()

    def condensed(self, force: np.ndarray) -> np.ndarray:
        scene = self.problem.scene
        return force + scene.free.basis.T @ scene.mean.condensed_force(self.defect)

    def violation(self) -> np.ndarray:
        gaps, initial = self.problem.gaps[self.closed], self.problem.initial[self.closed]
        return -(initial + self.problem.opening(self.displacement, gaps))

    def advanced(self, change: np.ndarray) -> "_Iterate":
        scene = self.problem.scene
        move = scene.free.basis @ change
        stress = self.mean_stress + scene.mean.change(move, self.defect)
        return replace(self, displacement=self.displacement.moved(move), mean_stress=stress)


@dataclass(frozen=True)
class _Solved:
    """What one solve with given closed macro-elements found; `residual` is relative."""

    iterate: _Iterate
    pressure: np.ndarray
    residual: float
    accuracy: Accuracy


class ContactProblem:
    """Stiffness, supports and gap constraints of a scene, with the factor kept between solves."""

    def __init__(self, scene: Scene):
        """Assemble; raises InputError where nothing can hold a body or a macro-element's node."""
        self.scene = scene
        operators = [zone.operator for zone in scene.zones]
        n = scene.n_dofs
        empty = sparse.csr_matrix((0, n))
        self.gaps = sparse.vstack([empty, *(o.matrix for o in operators)]).tocsr()
        self.initial, self.area, self.covered = (
            np.concatenate([np.empty(0), *(getattr(o, k) for o in operators)])
            for k in ("initial", "area", "covered")
        )
        self.coverage = self.covered / self.area
        self.eligible = self.coverage > MIN_COVERAGE
        self._refuse_double_cover()
        self.idle = self.eligible & ~self._acts()
        self.eligible &= ~(self.idle | scene.resting)
        self.own = np.zeros(n, dtype=bool)
        dim = scene.points.shape[1]
        for zone in scene.zones:
            for faces in zone.sub_faces:
                self.own[(dim * faces.nodes[..., None] + np.arange(dim)).ravel()] = True
        self.motions = rigid_motions(scene.points, scene.body)
        free = unsupported(self.motions, scene.free.basis)
        surface = np.diff(self.gaps.tocsc().indptr) > 0
        self.at_rest = Displacement.zero(free, surface, scene.options.safeguards.remainder)
        self._refuse_unheld()
        self.has_own_unknowns = self._find_own_unknowns()
        self.matrix, self.diagonal = _stiffness(scene)
        constraints = (self.gaps @ scene.free.basis).tocsr()
        own = self._own_unknowns() if self.has_own_unknowns else None
        unknowns = unknowns_of(scene, self.motions)
        self.parts = parts_of(scene, constraints, unknowns.body)
        self._systems = Systems(self.matrix, constraints, own, unknowns, self.parts)

    @cached_property
    def whole_stiffness(self) -> sparse.csr_matrix:
        """That of all degrees of freedom, without mean stress: a plain residual asks for it."""
        return stiffness(self.scene.points, self.scene.blocks)[0]

    @cached_property
    def roughness(self) -> Roughness:
        """What rounded coordinates do to the mesh."""
        return roughness(self.scene)

    def _acts(self) -> np.ndarray:
        """Which multipliers (k,) move anything: supports may hold the nodes of both surfaces.

        Macro-elements that were cut to own a free unknown all do, or are refused later on.
        """
        free = self.gaps @ self.scene.free.basis
        acts = _row_sizes(free) > _HELD * _row_sizes(self.gaps)
        for zone in self.scene.zones:
            acts[zone.numbers] |= zone.treatment.cut
        return acts

    @property
    def system(self) -> Constrained | None:
        """The last system solved."""
        return self._systems.latest

    @property
    def linear_solver(self) -> str:
        """The name of what solved the last system."""
        return self.system.factor.name if self.system else "none"

    @property
    def why_solver(self) -> str:
        """Why that was chosen."""
        return self.system.why if self.system else ""

    @property
    def linear_iterations(self) -> int:
        """The most iterations that one solution of the last system took; 0 by a factor alone."""
        return self.system.factor.iterations if self.system else 0

    def solve(
        self, factor: float, start: np.ndarray | None = None, bilateral: bool = False
    ) -> Equilibrium:
        """Equilibrium at a load factor, the status search starting from `start` (a guess).

        `bilateral`: no status is sought, all macro-elements stay closed, in tension too.
        """
        scene = self.scene
        if not scene.options.shortcuts.status:
            start = self.eligible
        start = self._first_guess(factor) if start is None else start
        force = factor * scene.force
        latest: list[_Solved] = []

        def attempt(closed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            if not scene.options.shortcuts.status:
                self._systems.forget()
            found = self._solve_closed(closed, force, factor)
            latest[:] = [found]
            return found.pressure, self._average_gap(found.iterate.displacement)

        load = float(np.abs(force).sum()) or 1.0
        pressure_scale = load / (float(self.area.sum()) or 1.0)
        if bilateral:
            attempt(self.eligible)
            status = StatusResult(self.eligible, 1, [])
        else:
            status = find_status(
                attempt,
                start,
                self.eligible,
                pressure_scale,
                scene.length,
                confirm=not scene.options.shortcuts.status,
            )
        solved, shape = latest[0], scene.points.shape
        found = solved.iterate.displacement
        gap = self._average_gap(found)
        touching = scene.resting & (gap <= GAP_NOISE * scene.length)
        return Equilibrium(
            found.total.reshape(shape),
            solved.iterate.straining,
            solved.iterate.mean_stress,
            solved.pressure,
            gap,
            replace(status, closed=status.closed | touching),
            solved.residual,
            force,
            solved.iterate.internal,
            solved.accuracy,
            solved.iterate.extended,
        )

    def _first_guess(self, factor: float) -> np.ndarray:
        """Macro-elements (m,) that loads and imposed displacements are likely to close."""
        scene = self.scene
        imposed = factor * np.abs(scene.free.offset).max(initial=0.0)
        moduli = 2 * np.concatenate([block.shear for block in scene.blocks])
        force = abs(factor) * np.linalg.norm(scene.force, axis=1).sum()
        push = force * (1 / moduli.min() + 1 / moduli.max())
        gap = self.initial / np.where(self.eligible, self.covered, np.inf) - imposed
        guess = likely_closed(gap, self.covered, self.eligible, push, scene.points.shape[1])
        return self.eligible if self._unheld(guess) else guess

    def opening(self, displacement: Displacement, gaps: sparse.csr_matrix) -> np.ndarray:
        """∫ gap (m,) that a displacement opens, by rows `gaps` (m, n_dofs) of the operator."""
        dim = self.scene.points.shape[1]
        return displacement.opening(gaps, dim, self.scene.options.safeguards.differences)

    def _average_gap(self, displacement: Displacement) -> np.ndarray:
        opening = self.initial + self.opening(displacement, self.gaps)
        return opening / np.where(self.eligible | self.scene.resting, self.covered, np.inf)

    def _solve_closed(self, closed: np.ndarray, force: np.ndarray, factor: float) -> _Solved:
        """Equilibrium with the given macro-elements closed."""
        system = self._constrained(closed)
        offset = factor * self.scene.free.offset
        scale = self._force_scale(force, offset.reshape(self.scene.points.shape))
        at_rest = self.at_rest.moved(offset)
        start = _Iterate(self, closed, force, at_rest, np.zeros(self.scene.mean.size))
        found, cures = self._refined(system, start, scale), self.scene.options.safeguards
        if cures.refinement and cures.extended and found.accuracy.of_sums > _EXTEND:
            found = self._refined(system, replace(found.iterate, extended=True), scale)
        return found

    def _refined(self, system: Constrained, start: _Iterate, scale: float) -> _Solved:
        refine = self.scene.options.safeguards.refinement
        # In a stretched model a force of the size of round-off may be a large one elsewhere.
        options = {"round_off": 0.0} if start.extended else {}
        iterate, multiplier, residual = solve(system, start, scale, refine, **options)
        pressure = np.zeros(len(start.closed))
        pressure[start.closed] = multiplier
        accuracy = self._accuracy(iterate, pressure, residual, scale)
        return _Solved(iterate, pressure, residual, accuracy)

    def _accuracy(
        self, iterate: _Iterate, pressure: np.ndarray, residual: float, force_scale: float
    ) -> Accuracy:
        """How many digits rounding leaves in the pressure; see `solver.simulation.accuracy`."""
        scene, closed, dim = self.scene, iterate.closed, self.scene.points.shape[1]
        terms, stress, slender = cancellation(scene.points, scene.blocks, iterate.straining)
        mean_terms, mean_stress = scene.mean.cancellation(iterate.mean_stress)
        unit = EPSILON_EXTENDED if iterate.extended else EPSILON
        forces = unit * terms + EPSILON * mean_terms
        scale = float(np.abs(pressure).max(initial=0.0))
        if scale == 0:
            return Accuracy({"forces": float(forces.max()) / force_scale})
        gaps = self.gaps[closed]
        own = self.own & (np.diff(scene.free.basis.indptr) > 0)
        moving = gaps @ sparse.diags(own.astype(float))
        moving.eliminate_zeros()
        noise = np.repeat(forces, dim) + residual * force_scale
        known = scene.rounding * self.covered * (self.initial != 0)
        known = known[closed] + EPSILON * iterate.displacement.opening_size(gaps, dim)
        rough, moved = self.roughness, iterate.displacement.total.reshape(scene.points.shape)
        pushed = rough.gap(gaps, moved) * self.covered[closed]
        tilted = scale * (rough.strain + float(rough.tilt.max()))
        tilted += pressure_of_gaps(moving, pushed, self.diagonal)
        causes = {
            "forces": pressure_of_forces(moving, noise),
            "gap": pressure_of_gaps(moving, known, self.diagonal),
            "coordinates": tilted + rough.stress(scene.blocks, moved),
            "stress": max(unit * stress, EPSILON * mean_stress),
            "slender": unit * slender,
            "sums": EPSILON * terms_of(scene.blocks) * scale,
        }
        return Accuracy({name: error / scale for name, error in causes.items()})

    def _force_scale(self, force: np.ndarray, imposed: np.ndarray) -> float:
        """The size of the forces at work: the loads, or those that imposed values bring up."""
        internal = internal_force(self.scene.points, self.scene.blocks, imposed)
        return float(max(np.abs(force).max(), np.abs(internal).max())) or 1.0

    def _constrained(self, closed: np.ndarray) -> Constrained:
        held = self._unheld(closed)
        if held:
            raise SolveError(f"{held} once {int((~closed).sum())} macro-elements are open")
        return self._systems.closed(closed)

    def _own_unknowns(self) -> np.ndarray:
        """Free unknowns (n_free,) that belong to slave nodes."""
        return np.asarray(abs(self.scene.free.basis).T @ self.own.astype(float)) > 0

    def _unheld(self, closed: np.ndarray) -> str | None:
        """What moves freely with the given macro-elements closed, in words."""
        per_area = sparse.diags(1 / self.covered[closed]) @ self.gaps[closed]
        n_bodies = int(self.scene.body.max()) + 1
        found = unheld_motion(self.motions, self.scene.free.basis, per_area, n_bodies)
        if found is None:
            return None
        return f"nothing keeps {self.body_name(found[0])} from a free motion ({found[1]})"

    def body_name(self, number: int) -> str:
        """A body's name: the smallest group of cells that holds all of it, or its place."""
        return body_names(self.scene)[number]

    def _refuse_unheld(self) -> None:
        held = self._unheld(self.eligible)
        if held:
            allowed = f"{held}, even with all of the contact closed; add a support"
            raise InputError(self.scene.case.path, "supports", None, allowed)

    def _refuse_double_cover(self) -> None:
        for i, zone in enumerate(self.scene.zones):
            surface = zone.operator.surface
            worst = float((surface.covered / surface.area).max())
            if worst > 1 + _TWICE:
                allowed = f"covers a macro-element {worst:.3g} times: it must not fold over itself"
                key = f"contact[{i}].master"
                raise InputError(self.scene.case.path, key, zone.zone.master, allowed)
            if not self.eligible[zone.numbers].any():
                slave, master = zone.zone.slave, zone.zone.master
                allowed = f"does not lie over {slave} anywhere along the normals of {slave}"
                key = f"contact[{i}].master"
                raise InputError(self.scene.case.path, key, master, allowed)

    def _find_own_unknowns(self) -> bool:
        """Whether each multiplier that may act has an unknown of its own that no support holds.

        Refuses macro-elements that were cut to own one and have none.
        """
        constraints = (self.gaps[self.eligible] @ self.scene.free.basis).tocsr()
        _, _, found = choose_pivots(constraints, self._own_unknowns())
        lost = np.flatnonzero(self.eligible)[~found]
        for zone in self.scene.zones:
            mine = lost[(lost >= zone.numbers.start) & (lost < zone.numbers.stop)] - zone.first
            if zone.treatment.cut and len(mine):
                place = zone.operator.surface.centre[mine[0]] + self.scene.origin
                at = ", ".join(f"{x:.6g}" for x in place)
                allowed = (
                    f"{len(mine)} macro-elements of zone {zone.zone.name} (the first, number "
                    f"{mine[0]}, at ({at})) have no free unknown of their own: supports or "
                    "another zone hold their inner nodes"
                )
                raise InputError(self.scene.case.path, "supports", None, allowed)
        return not len(lost)


def _stiffness(scene: Scene) -> tuple[sparse.csr_matrix, np.ndarray]:
    """The stiffness of the free unknowns, and its diagonal (n_dofs,), that of held ones too."""
    free, mean = scene.free, scene.mean
    matrix, diagonal = stiffness(scene.points, scene.blocks, free.selection)
    if free.selection is None:
        matrix = free.reduced(matrix)
    if mean.size:
        matrix = matrix + free.reduced(mean.stiffness())
    return matrix, diagonal


def _row_sizes(matrix: sparse.csr_matrix) -> np.ndarray:
    return np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=1)).ravel())
