"""Balance of forces and moments: across each zone, and of reactions against loads."""

import numpy as np

from solver.simulation.problem import Equilibrium
from solver.simulation.scene import Scene


def imbalances(scene: Scene, state: Equilibrium) -> dict[str, float]:
    """Relative imbalances by name.

    Forces are divided by the sum of the sizes of the nodal forces at work (loads, or contact forces
    where there is no load), moments by that times the length of the model.
    """
    points = scene.points
    contact = np.zeros_like(points)
    by_zone = {}
    for zone in scene.zones:
        forces = (zone.operator.matrix.T @ state.pressure[zone.numbers]).reshape(points.shape)
        by_zone[zone.zone.name] = forces
        contact += forces
    scale = max(np.abs(state.force).sum(), np.abs(contact).sum() / 2) or 1.0
    result: dict[str, float] = {}
    if state.correction.any():
        by_zone["correction of the pressure"] = state.correction
        contact += state.correction
    for name, forces in by_zone.items():
        result |= _both(f"zone {name}", points, forces, scale, scene.length)
    unbalanced = (state.iterate.internal - state.force - contact).astype(float).ravel()
    basis = scene.free.basis
    # What is left on held unknowns are the reactions; on free ones nothing may be left.
    free_part = (basis @ (basis.T @ unbalanced)).reshape(points.shape)
    reactions = unbalanced.reshape(points.shape) - free_part
    result |= _both("reactions and loads", points, reactions + state.force, scale, scene.length)
    result["free nodes: force"] = float(np.abs(free_part).max(initial=0.0) / scale)
    return result


def _both(
    name: str, points: np.ndarray, forces: np.ndarray, scale: float, length: float
) -> dict[str, float]:
    force = np.abs(forces.sum(axis=0)).max()
    if points.shape[1] == 2:
        moment = abs(float((points[:, 0] * forces[:, 1] - points[:, 1] * forces[:, 0]).sum()))
    else:
        moment = float(np.abs(np.cross(points, forces).sum(axis=0)).max())
    return {f"{name}: force": float(force / scale), f"{name}: moment": moment / (scale * length)}
