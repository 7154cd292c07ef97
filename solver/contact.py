"""The contact problem of a scene at one load factor: status, displacement, pressure."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from solver.bodies import rigid_motions, unheld_motion, unsupported
from solver.elasticity import internal_force, stiffness
from solver.errors import InputError, SolveError
from solver.lac.status import StatusResult, find_status, likely_closed
from solver.linear.condensation import (
    Constrained,
    choose_pivots,
    condense,
    saddle_point,
    solve,
)
from solver.naming import body_names
from solver.scene import Scene

# A macro-element covered by less than this share of its area is out of contact.
MIN_COVERAGE = 0.01
# Coverage above one by more than this means that the master surface lies there twice.
_TWICE = 1e-6


@dataclass(frozen=True)
class Equilibrium:
    """A solved load factor: displacement (n, dim), pressure and gap (m,), status, residual.

    `straining` (2, n, dim): both parts of the displacement less a rigid motion of each body, from
    which strains are taken (see `Displacement`).
    """

    displacement: np.ndarray
    straining: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    status: StatusResult
    residual: float
    force: np.ndarray


@dataclass(frozen=True)
class Displacement:
    """A displacement as free rigid motions of the bodies plus a remainder, the part that strains.

    A stiff body on a soft one moves far and strains little. Were its displacement stored as one
    number a node, its strain would be lost in the rounding of the motion; the remainder keeps it.
    The rigid motion is that of the contact surface, so that the remainder is smallest where the
    other body feels it. `motions` (n_dofs, k) are the rigid motions that supports leave free, `fit`
    (k, n_dofs) finds how much of each a displacement holds, `amount` (k,) is how far each goes. The
    remainder is the sum, never evaluated, of two parts `straining` (2, n_dofs): what the first
    loses to rounding is in the second, so that each refinement gains its digits in full.
    """

    motions: sparse.csr_matrix
    fit: sparse.csr_matrix
    amount: np.ndarray
    straining: np.ndarray

    @classmethod
    def zero(cls, motions: sparse.csr_matrix, surface: np.ndarray) -> "Displacement":
        """No displacement; `surface` (n_dofs,) marks the unknowns of the contact surfaces."""
        seen = sparse.diags(surface.astype(float)) @ motions
        fit = sparse.csr_matrix(np.linalg.pinv((seen.T @ seen).toarray())) @ seen.T
        return cls(motions, fit.tocsr(), np.zeros(motions.shape[1]), np.zeros((2, len(surface))))

    @property
    def total(self) -> np.ndarray:
        """The displacement (n_dofs,) itself."""
        return self.motions @ self.amount + self.straining.sum(axis=0)

    def moved(self, change: np.ndarray) -> "Displacement":
        """This displacement with `change` (n_dofs,) added."""
        more = self.fit @ change
        first, second = self.straining
        added = change - self.motions @ more
        total = first + added
        # What the sum lost (Knuth, The Art of Computer Programming, vol. 2, §4.2.2).
        back = total - first
        lost = (first - (total - back)) + (added - back)
        straining = np.stack([total, second + lost])
        return Displacement(self.motions, self.fit, self.amount + more, straining)

    def opening(self, gaps: sparse.csr_matrix) -> np.ndarray:
        """∫ gap (m,) that it opens, by the gap operator `gaps` (m, n_dofs)."""
        return (gaps @ self.motions) @ self.amount + (gaps @ self.straining.T).sum(axis=1)


@dataclass(frozen=True)
class _Iterate:
    """The contact problem's unknowns as the condensed solve sees them."""

    problem: "ContactProblem"
    closed: np.ndarray
    force: np.ndarray
    displacement: Displacement

    def residual(self) -> np.ndarray:
        scene = self.problem.scene
        straining = self.displacement.straining.reshape(2, *self.force.shape)
        internal = internal_force(scene.points, scene.blocks, straining)
        return scene.free.basis.T @ (self.force - internal).ravel()

    def violation(self) -> np.ndarray:
        gaps, initial = self.problem.gaps[self.closed], self.problem.initial[self.closed]
        return -(initial + self.displacement.opening(gaps))

    def advanced(self, change: np.ndarray) -> "_Iterate":
        moved = self.displacement.moved(self.problem.scene.free.basis @ change)
        return replace(self, displacement=moved)


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
        self.own = np.zeros(n, dtype=bool)
        dim = scene.points.shape[1]
        for zone in scene.zones:
            for faces in zone.sub_faces:
                self.own[(dim * faces.nodes[..., None] + np.arange(dim)).ravel()] = True
        self.motions = rigid_motions(scene.points, scene.body)
        free = unsupported(self.motions, scene.free.basis)
        self.at_rest = Displacement.zero(free, np.diff(self.gaps.tocsc().indptr) > 0)
        self._refuse_unheld()
        self.has_own_unknowns = all(z.zone.treatment != "uncut" for z in scene.zones)
        if self.has_own_unknowns:
            self._refuse_lost_nodes()
        self.matrix = scene.free.reduced(stiffness(scene.points, scene.blocks))
        self._system: tuple[bytes, Constrained] | None = None

    @property
    def linear_solver(self) -> str:
        """The name of what solved the last system."""
        return self._system[1].factor.name if self._system else "none"

    def solve(self, factor: float, start: np.ndarray | None = None) -> Equilibrium:
        """Equilibrium at a load factor, the status search starting from `start` (a guess)."""
        scene = self.scene
        start = self._first_guess(factor) if start is None else start
        force = factor * scene.force
        latest: list[tuple[Displacement, np.ndarray, float]] = []

        def attempt(closed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            found, pressure, residual = self._solve_closed(closed, force, factor)
            latest[:] = [(found, pressure, residual)]
            return pressure, self._average_gap(found)

        load = float(np.abs(force).sum()) or 1.0
        pressure_scale = load / max(float(self.area.sum()), np.finfo(float).tiny)
        status = find_status(attempt, start, self.eligible, pressure_scale, scene.length)
        found, pressure, residual = latest[0]
        shape = scene.points.shape
        return Equilibrium(
            found.total.reshape(shape),
            found.straining.reshape(2, *shape),
            pressure,
            self._average_gap(found),
            status,
            residual,
            force,
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

    def _average_gap(self, displacement: "Displacement") -> np.ndarray:
        opening = self.initial + displacement.opening(self.gaps)
        return opening / np.where(self.eligible, self.covered, np.inf)

    def _solve_closed(
        self, closed: np.ndarray, force: np.ndarray, factor: float
    ) -> tuple["Displacement", np.ndarray, float]:
        """Displacement and pressures with the given macro-elements closed, relative residual."""
        system = self._constrained(closed)
        offset = factor * self.scene.free.offset
        scale = self._force_scale(force, offset.reshape(self.scene.points.shape))
        iterate = _Iterate(self, closed, force, self.at_rest.moved(offset))
        iterate, multiplier, size = solve(system, iterate, scale)
        pressure = np.zeros(len(closed))
        pressure[closed] = multiplier
        return iterate.displacement, pressure, size

    def _force_scale(self, force: np.ndarray, imposed: np.ndarray) -> float:
        """The size of the forces at work: the loads, or those that imposed values bring up."""
        internal = internal_force(self.scene.points, self.scene.blocks, imposed)
        return float(max(np.abs(force).max(), np.abs(internal).max())) or 1.0

    def _constrained(self, closed: np.ndarray) -> Constrained:
        key = closed.tobytes()
        if self._system is None or self._system[0] != key:
            held = self._unheld(closed)
            if held:
                raise SolveError(f"{held} once {int((~closed).sum())} macro-elements are open")
            constraints = (self.gaps[closed] @ self.scene.free.basis).tocsr()
            system: Constrained
            if self.has_own_unknowns:
                system = condense(self.matrix, constraints, self._own_unknowns())
            else:
                system = saddle_point(self.matrix, constraints)
            self._system = key, system
            return system
        return self._system[1]

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
            worst = float(self.coverage[zone.numbers].max())
            if worst > 1 + _TWICE:
                allowed = f"covers a macro-element {worst:.3g} times: it must not fold over itself"
                key = f"contact[{i}].master"
                raise InputError(self.scene.case.path, key, zone.zone.master, allowed)
            if not self.eligible[zone.numbers].any():
                slave, master = zone.zone.slave, zone.zone.master
                allowed = f"does not lie over {slave} anywhere along the normals of {slave}"
                key = f"contact[{i}].master"
                raise InputError(self.scene.case.path, key, master, allowed)

    def _refuse_lost_nodes(self) -> None:
        """Each macro-element that may close needs an unknown that no support holds."""
        constraints = (self.gaps[self.eligible] @ self.scene.free.basis).tocsr()
        _, _, found = choose_pivots(constraints, self._own_unknowns())
        if found.all():
            return
        number = int(np.flatnonzero(self.eligible)[np.flatnonzero(~found)[0]])
        zone = next(z for z in self.scene.zones if z.first <= number < z.first + z.count)
        place = zone.operator.centre[number - zone.first] + self.scene.origin
        at = ", ".join(f"{x:.6g}" for x in place)
        allowed = (
            f"{int((~found).sum())} macro-elements of zone {zone.zone.name} (the first, number "
            f"{number - zone.first}, at ({at})) have no free unknown of their own: supports or "
            "another zone hold their inner nodes"
        )
        raise InputError(self.scene.case.path, "supports", None, allowed)
