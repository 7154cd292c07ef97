"""The result of a simulation: fields, contact state, balance and cost of one solve.

In the units of the case; `n` counts the nodes of the cut mesh, `m` the macro-elements of a zone.
Contact pressure is positive in compression, a gap when open, stress in tension.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...lac.cells.faces import FLAT
from .forces import Reaction, Resultants, RigidMotion
from .records import Cost, Fields, Places, Quality, Scalars

if TYPE_CHECKING:
    import meshio

    from ...case.model import Case
    from ...lac.cells.faces import SurfacePoints

# The error of pressures is not known where it is not for so much of the square of their norm.
_UNKNOWN = 1e-2


class Line(NamedTuple):
    """A line of the plan: what was left out or decided, and why.

    `skip`: its switch in `Shortcuts`, or empty.
    """

    what: str
    why: str
    skip: str = ""


@dataclass
class BodyInfo:
    """One body as it was meshed, before any cut.

    `cells` maps cell type to number of cells; `faces` counts its faces on contact surfaces; `role`
    is slave, master, both or none.
    """

    name: str
    cells: dict[str, int]
    faces: int
    role: str


@dataclass
class NodalContact:
    """Contact by node, for treatments of the interface with multipliers at nodes.

    `nodes` (k,) into the mesh's points; `multiplier` (pressure ≥ 0), the average `gap` that it sees
    and `closed` (bool), all (k,).
    """

    nodes: np.ndarray
    multiplier: np.ndarray
    gap: np.ndarray
    closed: np.ndarray


@dataclass
class RecoveredPressure:
    """A pressure p* = p + Σ c ψ by macro-element (m,), recovered from the constants p.

    `form`: linear, quadratic or smooth (`lac.reconstruction`); `coefficients` c
    (m, k), `degree` (m,) of the polynomials; `centre`, `axes`, `spread` are those of the local
    coordinates that ψ is written in. `nodes` (n,) of the slave surface and `at_nodes` (n,), the
    mean there of p* on the faces around.
    """

    form: str
    coefficients: np.ndarray
    degree: np.ndarray
    centre: np.ndarray
    axes: np.ndarray
    spread: np.ndarray
    nodes: np.ndarray
    at_nodes: np.ndarray

    def shapes(self, macro: np.ndarray, places: np.ndarray) -> np.ndarray:
        """ψ (s, q, k) on macro-elements (s,) at points (s, q, dim)."""
        from ...lac.reconstruction import FORMS, Local

        local = Local(centre=self.centre, axes=self.axes, spread=self.spread)
        return local.shapes(macro, places, FORMS[self.form])

    def values(self, mean: np.ndarray, macro: np.ndarray, places: np.ndarray) -> np.ndarray:
        """p* (s, q) on macro-elements (s,) at points (s, q, dim), given the constants (m,)."""
        psi = self.shapes(macro, places)
        return mean[macro][:, None] + np.einsum("sqk,sk->sq", psi, self.coefficients[macro])


@dataclass
class ZoneFriction:
    """Friction by macro-element (m,) in the last step.

    `friction_traction` (m, dim) on the slave; `slip` (m, dim) of the master relative to the slave
    in the step, `slip_total` in all steps; `status` (m,): 0 open, 1 stick, 2 slip. `recovered`
    (m, k, dim): coefficients of the recovered traction, of the functions of the recovered pressure.
    """

    friction_traction: np.ndarray
    slip: np.ndarray
    slip_total: np.ndarray
    status: np.ndarray
    recovered: np.ndarray | None = None

    def on_faces(self) -> dict[str, np.ndarray]:
        """The fields (m, dim) that a grid has of it, by name."""
        names = "friction_traction", "slip", "slip_total"
        return {name: getattr(self, name) for name in names}

    def values(self, at: SurfacePoints, pressure: RecoveredPressure | None) -> np.ndarray:
        """The traction (k, dim) at points of the surface; `pressure`: the zone's recovered one."""
        mean = self.friction_traction[at.macro]
        if self.recovered is None or pressure is None:
            return mean
        psi = pressure.shapes(at.macro, at.place[:, None])[:, 0]
        return mean + np.einsum("qk,qkd->qd", psi, self.recovered[at.macro])


@dataclass
class ZoneSurfaces:
    """The two surfaces of a zone.

    `master_faces`: (type, connectivity). `stress_slave` and `stress_master` hold n·σ·n at
    `slave_nodes` and `master_nodes`, taken from the body of that surface alone. `meshed_gap` (m,)
    is their mean distance as they are meshed, None in results of other codes.
    """

    master_faces: list[tuple[str, np.ndarray]]
    stress_slave: np.ndarray
    stress_master: np.ndarray
    slave_nodes: np.ndarray
    master_nodes: np.ndarray
    meshed_gap: np.ndarray | None = None


@dataclass
class ZoneEstimates:
    """How well the pressure of a zone is known, by macro-element (m,).

    `pressure_of_forces` is the pressure by the internal forces at the slave nodes; None where these
    do not determine it (see `results.balance`). `pressure_error` estimates the L2 error of the
    multiplier, by its distance from a reconstruction p*; NaN where no neighbours determine that,
    None where multipliers belong to nodes.
    """

    pressure_of_forces: np.ndarray | None = None
    pressure_error: np.ndarray | None = None


@dataclass
class ZoneResult:
    """The contact state of one zone, by macro-element, and its surfaces.

    `faces`: the slave sub-faces by cell type: (type, connectivity (s, nodes) into the mesh's
    points, macro-element number (s,)). `centre` and `normal` (m, dim), `area`, `multiplier`
    (pressure ≥ 0), `gap`, `closed` (bool) and `coverage` (intersected over whole area) are (m,).
    Where multipliers belong to nodes, `nodal` has them, and the values by macro-element are
    averages of theirs. `recovered` is the reconstruction p* where the case asks for one.
    `resultants`: area, force, moment and edges of contact. `friction`: see there; None without.
    """

    name: str
    faces: list[tuple[str, np.ndarray, np.ndarray]]
    centre: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    multiplier: np.ndarray
    gap: np.ndarray
    closed: np.ndarray
    coverage: np.ndarray
    surfaces: ZoneSurfaces
    estimates: ZoneEstimates = field(default_factory=ZoneEstimates)
    nodal: NodalContact | None = None
    recovered: RecoveredPressure | None = None
    resultants: Resultants | None = None
    friction: ZoneFriction | None = None

    def faces_of(self, side: str) -> list[tuple[str, np.ndarray]]:
        """The faces (type, connectivity) of the slave or the master surface."""
        if side == "master":
            return self.surfaces.master_faces
        return [(kind, nodes) for kind, nodes, _ in self.faces]

    @property
    def flat(self) -> bool:
        """Whether all macro-elements have one normal, up to rounding."""
        return bool((np.ptp(self.normal, axis=0) < FLAT).all())

    @property
    def shown_status(self) -> np.ndarray:
        """0 open, 1 in contact; with friction 1 stick, 2 slip (m,)."""
        return self.closed.astype(int) if self.friction is None else self.friction.status

    def on_faces(self) -> dict[str, np.ndarray]:
        """The fields (m, …) that a grid has of its macro-elements, by name."""
        found = {
            "pressure": self.multiplier,
            "gap": self.gap,
            "status": self.shown_status,
            "coverage": self.coverage,
            "pressure_error_estimate": self.pressure_error_estimate,
        }
        return found if self.friction is None else found | self.friction.on_faces()

    @property
    def pressure_error_estimate(self) -> np.ndarray:
        """The estimated root mean square error (m,) of each constant, a stress; NaN if unknown."""
        covered, unknown = self.area * self.coverage, np.full(len(self.area), np.nan)
        return np.divide(_errors(self), np.sqrt(covered), out=unknown, where=covered > 0)

    @property
    def relative_pressure_error(self) -> float | None:
        """The estimated L2 error of the constants over their norm; None if unknown."""
        return pressure_error([self])


def pressure_error(zones: Sequence[ZoneResult]) -> float | None:
    """The estimated L2 error of the constants of zones over their norm.

    None where that of more than `_UNKNOWN` of the square of the norm is unknown.
    """
    scale = max((float(zone.multiplier.max(initial=0.0)) for zone in zones), default=0.0)
    if not scale > 0:
        return 0.0 if any(zone.estimates.pressure_error is not None for zone in zones) else None
    errors = np.concatenate([_errors(zone) for zone in zones]) / scale
    whole = np.concatenate([z.area * z.coverage * (z.multiplier / scale) ** 2 for z in zones])
    known = np.isfinite(errors)
    if not whole[known].sum() > (1 - _UNKNOWN) * whole.sum():
        return None
    return float(np.linalg.norm(errors[known]) / np.sqrt(whole.sum()))


def _errors(zone: ZoneResult) -> np.ndarray:
    """Its `pressure_error` (m,), NaN where that is unknown."""
    if zone.estimates.pressure_error is None:
        return np.full(len(zone.area), np.nan)
    return zone.estimates.pressure_error


@dataclass
class StepResult:
    """One load step: load factor, cost of the status iteration, and what was observed.

    `residual` is relative to the forces; `complementarity` is the largest size of p ḡ on a
    macro-element, relative to the scale of stress times the model's length.

    `observations` holds one mapping per observed macro-element, in the order of the case file:
    zone, macro_element (number), pressure, gap, status (0 or 1), coverage. `resultants` of contact
    by zone, `reactions` and motions of `rigid` bodies.
    `dissipation`: the work of friction in the step; `work`: that of loads and of what holds the
    bodies, where these may move far.
    """

    factor: float
    iterations: int
    status_changes: int
    residual: float
    complementarity: float
    observations: list[dict[str, Any]]
    resultants: dict[str, Resultants] = field(default_factory=dict)
    reactions: list[Reaction] = field(default_factory=list)
    rigid: list[RigidMotion] = field(default_factory=list)
    dissipation: float = 0.0
    work: float = 0.0


class Position(NamedTuple):
    """A position on the path of bodies that move far: points (n, dim), and the fields there.

    `at_points` and `of_cells` are those of the grid of a result file, by name.
    """

    points: np.ndarray
    at_points: dict[str, np.ndarray]
    of_cells: dict[str, np.ndarray]

    def of_zone(self, field: str, zone: int, count: int) -> np.ndarray:
        """A field (count, …) of the macro-elements of the zone of a number."""
        mine, values = np.flatnonzero(self.of_cells["zone"] == zone)[::-1], self.of_cells[field]
        found = np.zeros((count, *values.shape[1:]))
        found[self.of_cells["macro_element"][mine]] = values[mine]  # of its first sub-face
        return found


@dataclass
class Solution:
    """One solve, complete: everything the result file, the checks and the report need.

    `mesh` is the cut mesh (volume cells only; slave sub-faces are in the zones). `displacement` (n,
    dim), `stress` (n, 6) in the order of `solver.mechanics.fem.stress` and averaged per body.
    Where bodies may move far, `mesh` is where the last step brought them, `displacement` is what
    they have beside the `motion` in `fields`, and `earlier` has the positions of the steps before.
    `ended`: why the step after the last one has no solution; `case` then has the steps before.
    """

    case: Case
    mesh: meshio.Mesh
    displacement: np.ndarray
    stress: np.ndarray
    bodies: list[BodyInfo]
    zones: list[ZoneResult]
    steps: list[StepResult]
    plan: list[Line]
    scalars: Scalars
    fields: Fields
    cost: Cost = field(default_factory=Cost)
    quality: Quality = field(default_factory=Quality)
    places: Places = field(default_factory=Places)
    earlier: list[Position] = field(default_factory=list)
    ended: str = ""

    @property
    def swapped(self) -> bool:
        """Whether slave and master were exchanged."""
        return self.case.solved_as.swapped

    @property
    def reactions(self) -> list[Reaction]:
        """What holds each group in the last step."""
        return self.steps[-1].reactions

    @property
    def rigid(self) -> list[RigidMotion]:
        """The rigid bodies in the last step."""
        return self.steps[-1].rigid

    @property
    def deformable(self) -> np.ndarray:
        """Which nodes (n,) belong to bodies that are not rigid."""
        nodes = self.fields.body >= 0
        for group in self.case.rigid:
            members = self.mesh.cell_sets.get(group, [])
            for block, mine in zip(self.mesh.cells, members, strict=False):
                nodes[block.data[np.asarray(mine, dtype=int)].ravel()] = False
        return nodes

    @property
    def largest_pressure(self) -> float:
        """The largest pressure of any step, of loads or contact: where nothing acts, the scale."""
        of_contact = (self.largest_in(zone.name) for zone in self.zones)
        return max(self.scalars.load_scale, *of_contact, 0.0)

    def largest_in(self, zone: str) -> float:
        """The largest contact pressure of a zone in any step."""
        found = (step.resultants.get(zone) for step in self.steps)
        known = (one.pressure for one in found if one and one.pressure is not None)
        return max((float(each.max()) for each in known), default=0.0)

    @property
    def largest_displacement(self) -> tuple[float, np.ndarray]:
        """The length of the largest displacement of deformable bodies, and its place (dim,)."""
        size = np.linalg.norm(self.displacement, axis=1) * self.deformable
        node = int(size.argmax())
        return float(size[node]), self.mesh.points[node]

    @property
    def pressure_error_estimate(self) -> float | None:
        """The estimated L2 error of constant pressures, over all zones and relative."""
        return pressure_error(self.zones)

    @property
    def job(self) -> str:
        """The name of this solve, as of its folder and its file of accepted values."""
        return self.case.job
