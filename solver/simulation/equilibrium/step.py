"""One step of a problem: its state with the law of its contact and the recovered pressure."""

import numpy as np

from ...case.acting import Step
from ...lac.errors import SolveError
from .problem import ContactProblem
from .recovery import recovered
from .state import Equilibrium


def solve_step(
    problem: ContactProblem,
    step: Step,
    last: Equilibrium | None = None,
    start: np.ndarray | None = None,
    before: Step | None = None,
) -> Equilibrium:
    """Solve a step for its state with the recovered pressure; SolveError if it has no solution.

    `last`: the state that friction goes on from; without friction the search for the status starts
    from `start` (k,), that of the step `before`.
    """
    if problem.scene.case.frictional:
        from .friction_recovery import solve_and_recover  # friction alone

        return solve_and_recover(problem, step, last)
    state = problem.solve(step, start, before=before)
    if (state.trial.violation(state.iterate.closed) > 1).any():
        raise SolveError("contact bears tension or surfaces overlap")
    return recovered(problem, state, step)
