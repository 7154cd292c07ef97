"""The results of load steps: cost, forces, and what a case observes."""

import numpy as np

from ..lac.facets import tangents_of
from .balance import reactions, rigid_bodies
from .equilibrium import Equilibrium
from .recovery import Recovered, RecoveredZone
from .resultants import resultants
from .scene import Scene, ZoneScene
from .solution import StepResult, ZoneFriction

# Half, up to round-off.
_HALF = 0.5 - 1e-9


def step_results(
    scene: Scene, states: list[Equilibrium], fields: list[Recovered], scale: float
) -> tuple[list[StepResult], np.ndarray]:
    """The steps, and the reactions at nodes (n, dim) in the last one."""
    results, at_nodes = [], np.zeros(0)
    for factor, state, field in zip(scene.case.factors, states, fields, strict=True):
        seen = []
        for wanted in scene.case.observe:
            zone = next(z for z in scene.zones if z.zone.name == wanted.zone)
            surface = zone.operator.surface
            offset = surface.centre + scene.origin - np.array(wanted.nearest)
            local = int(np.linalg.norm(offset, axis=1).argmin())
            seen.append(
                {
                    "zone": wanted.zone,
                    "macro_element": local,
                    "pressure": float(zone.by_macro_element(state.pressure)[local]),
                    "gap": float(zone.by_macro_element(state.gap)[local]),
                    "status": int(closed_of(zone, state)[local]),
                    "coverage": float(surface.covered[local] / surface.area[local]),
                }
            )
        held, at_nodes = reactions(scene, state)
        n = scene.n_multipliers
        product = float(np.abs(state.pressure * state.gap)[:n].max(initial=0.0))
        results.append(
            StepResult(
                factor=factor,
                iterations=state.status.iterations,
                status_changes=sum(state.status.changes),
                residual=state.residual,
                complementarity=product / (scale * scene.length),
                observations=seen,
                resultants={
                    (name := zone.zone.name): resultants(
                        scene, zone, state, closed_of(zone, state), field.get(name)
                    )
                    for zone in scene.zones
                },
                reactions=held,
                rigid=rigid_bodies(scene, state),
                dissipation=state.friction.dissipation if state.friction else 0.0,
                contraction=state.friction.contraction if state.friction else 0.0,
            )
        )
    return results, at_nodes


def closed_of(zone: ZoneScene, state: Equilibrium) -> np.ndarray:
    """The macro-elements (m,) with at least half of their multipliers closed."""
    return zone.by_macro_element(state.status.closed.astype(float)) >= _HALF


def stress_scale(scene: Scene, states: list[Equilibrium], stress: np.ndarray) -> float:
    """The largest pressure of any step among the loads (as a number).

    Else the largest contact pressure of any step or `stress` (n, 6), else 1.
    """
    values = [
        abs(load.value * load.factor(step))
        for load in scene.case.loads
        for step in scene.case.steps
        if load.kind == "pressure" and isinstance(load.value, float)
    ]
    largest = [np.abs(field).max(initial=0.0) for field in (stress, *(s.pressure for s in states))]
    return max(values, default=0.0) or float(max(largest)) or 1.0


def zone_friction(
    zone: ZoneScene, state: Equilibrium, field: RecoveredZone | None
) -> ZoneFriction | None:
    """Traction, slip and status of a zone; None without friction."""
    if not zone.slips or state.friction is None:
        return None
    tangents = tangents_of(zone.operator.surface.normal)

    def in_space(values: np.ndarray) -> np.ndarray:
        return np.einsum("mkd,km->md", tangents, np.array([values[rows] for rows in zone.slips]))

    closed, recovered = state.status.closed[zone.numbers], None
    if field is not None and len(field.tractions):
        coefficients = -np.array(field.tractions).reshape(len(zone.slips), len(closed), -1)
        recovered = np.einsum("mtd,tmk->mkd", tangents, coefficients)
    return ZoneFriction(
        friction_traction=in_space(-state.pressure),
        slip=in_space(state.gap),
        slip_total=in_space(state.friction.total),
        status=closed.astype(int) + (closed & state.friction.slipping[zone.numbers]),
        recovered=recovered,
    )
