"""The contact problem of a scene at one load factor: status, displacement, pressure."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from solver.bodies import rigid_motions, unheld_motion
from solver.elasticity import internal_force, stiffness
from solver.errors import InputError, SolveError
from solver.lac.status import StatusResult, find_status
from solver.linear.condensation import Condensed, choose_pivots, condense, solve
from solver.naming import body_names
from solver.scene import Scene

# A macro-element covered by less than this share of its area is out of contact.
MIN_COVERAGE = 0.01
# Coverage above one by more than this means that the master surface lies there twice.
_TWICE = 1e-6


@dataclass(frozen=True)
class Equilibrium:
    """A solved load factor: displacement (n, dim), pressure and gap (m,), status, residual."""

    displacement: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    status: StatusResult
    residual: float
    force: np.ndarray


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
        self._refuse_unheld()
        self._refuse_lost_nodes()
        self.matrix = scene.free.reduced(stiffness(scene.points, scene.blocks))
        self._condensed: tuple[bytes, Condensed] | None = None

    @property
    def linear_solver(self) -> str:
        """The name of what solved the last system."""
        return self._condensed[1].factor.name if self._condensed else "none"

    def solve(self, factor: float, start: np.ndarray | None = None) -> Equilibrium:
        """Equilibrium at a load factor, the status search starting from `start` (all closed)."""
        scene = self.scene
        start = self.eligible if start is None else start
        force = factor * scene.force
        scale = float(np.abs(force).sum()) or 1.0
        latest: list[tuple[np.ndarray, np.ndarray, float]] = []

        def attempt(closed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            displacement, pressure, residual = self._solve_closed(closed, force, factor)
            gap = self._average_gap(displacement)
            latest[:] = [(displacement, pressure, residual)]
            return pressure, gap

        pressure_scale = scale / max(float(self.area.sum()), np.finfo(float).tiny)
        status = find_status(attempt, start, self.eligible, pressure_scale, scene.length)
        displacement, pressure, residual = latest[0]
        gap = self._average_gap(displacement)
        return Equilibrium(displacement, pressure, gap, status, residual, force)

    def _average_gap(self, displacement: np.ndarray) -> np.ndarray:
        opening = self.initial + self.gaps @ displacement.ravel()
        return opening / np.where(self.eligible, self.covered, np.inf)

    def _solve_closed(
        self, closed: np.ndarray, force: np.ndarray, factor: float
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Displacement and pressures with the given macro-elements closed, relative residual."""
        scene, free = self.scene, self.scene.free
        condensed = self._condense(closed)
        gaps, initial = self.gaps[closed], self.initial[closed]
        offset = factor * free.offset

        def displacement(x: np.ndarray) -> np.ndarray:
            return (offset + free.basis @ x).reshape(scene.points.shape)

        def residual(x: np.ndarray) -> np.ndarray:
            internal = internal_force(scene.points, scene.blocks, displacement(x))
            return free.basis.T @ (force - internal).ravel()

        def violation(x: np.ndarray) -> np.ndarray:
            return -(initial + gaps @ displacement(x).ravel())

        x = np.zeros(free.basis.shape[1])
        scale = self._force_scale(force, displacement(x))
        x, multiplier, size = solve(condensed, x, residual, violation, scale)
        pressure = np.zeros(len(closed))
        pressure[closed] = multiplier
        return displacement(x), pressure, size

    def _force_scale(self, force: np.ndarray, imposed: np.ndarray) -> float:
        """The size of the forces at work: the loads, or those that imposed values bring up."""
        internal = internal_force(self.scene.points, self.scene.blocks, imposed)
        return float(max(np.abs(force).max(), np.abs(internal).max())) or 1.0

    def _condense(self, closed: np.ndarray) -> Condensed:
        key = closed.tobytes()
        if self._condensed is None or self._condensed[0] != key:
            held = self._unheld(closed)
            if held:
                raise SolveError(f"{held} once {int((~closed).sum())} macro-elements are open")
            constraints = (self.gaps[closed] @ self.scene.free.basis).tocsr()
            own = self._own_unknowns()
            self._condensed = key, condense(self.matrix, constraints, own)
        return self._condensed[1]

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
