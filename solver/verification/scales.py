"""What errors are relative to where the reference is zero: the measures of quantities."""

import numpy as np

from ..simulation.results.solution import Solution


def block_size(solution: Solution) -> float:
    """The extent of the smallest body."""
    bodies = [solution.mesh.points[solution.body == b] for b in range(len(solution.bodies))]
    return min(float(np.ptp(points, axis=0).max()) for points in bodies if len(points))


def load(solution: Solution) -> float:
    """The load; without loads the stress that the displacement would cause, if that is larger.

    If bodies only move, the stress itself is round-off.
    """
    if solution.case.loads:
        return float(solution.load_scale)
    stiffness = min(m.young for m in solution.case.materials.values())
    moved = float(np.abs(solution.displacement).max(initial=0.0))
    return max(float(solution.load_scale), stiffness * moved / solution.length)


def elongation(solution: Solution) -> float:
    """Load / stiffness × size."""
    stiffness = min(m.young for m in solution.case.materials.values())
    return float(solution.load_scale / stiffness * block_size(solution))


def total_force(solution: Solution) -> float:
    """The largest reaction or contact force of any step; one where nothing acts."""
    forces = [one.force for step in solution.steps for one in step.reactions]
    forces += [one.force for step in solution.steps for one in step.resultants.values()]
    return max((float(np.abs(force).max()) for force in forces), default=0.0) or 1.0


def total_moment(solution: Solution) -> float:
    """The largest force times the extent of the smallest body."""
    return total_force(solution) * block_size(solution)


def unit(_: Solution) -> float:
    """One."""
    return 1.0
