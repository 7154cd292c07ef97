"""The contact status that the search starts from: a guess by loads and initial gaps."""

from collections.abc import Callable

import numpy as np

from ..case.model import Step
from .constraints import ContactConstraints
from .scene import Scene

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
