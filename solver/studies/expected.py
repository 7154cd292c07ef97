"""The discretisation errors that a refinement ladder predicts for a case's own mesh.

A power law C h^q is fitted to the errors of each check on the case's mesh and on refined ones; its
value on the case's own mesh is the expected error, the larger of both directions. The case file
takes them as `expected`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..case.model import MARGIN
from ..case.reader import load_case
from ..verification.run import mesh_of, refined, solve_checked
from .theory import ROUND_OFF, fit_power

LEVELS = (1, 2, 4)


def expected_errors(path: Path, levels: Sequence[int] = LEVELS) -> dict[str, float]:
    """The expected error by check, of those that compare the case with a reference.

    `levels` multiply the divisions of the case's recipe; checks with an error of zero or round-off
    on any of them have none. Raises InputError where the case cannot be refined.
    """
    case = load_case(path)
    found: dict[str, float] = {}
    for swapped in (False, True)[: 1 + (case.directions == "both")]:
        for name, errors in _ladder(path, swapped, levels).items():
            if len(errors) == len(levels) and min(errors) > ROUND_OFF:
                found[name] = max(found.get(name, 0.0), at_first(levels, errors))
    return found


def at_first(levels: Sequence[int], errors: Sequence[float]) -> float:
    """The power law through errors (n,) of levels (n,), at the first level.

    Where it is too low there by more than the margin, errors on finer meshes cancel: then the first
    of them.

    >>> round(at_first([1, 2, 4], [4.0, 1.0, 0.25]), 12)
    4.0
    >>> at_first([1, 2, 4], [4.0, 0.01, 0.25])
    4.0
    """
    sizes = 1.0 / np.array(levels)
    fit = fit_power(sizes, errors)
    if fit is None:
        return float(errors[0])
    middle = np.log(errors).mean() - fit.value * np.log(sizes).mean()
    law = float(np.exp(middle + fit.value * np.log(sizes[0])))
    return law if errors[0] <= MARGIN * law else float(errors[0])


def _ladder(path: Path, swapped: bool, levels: Sequence[int]) -> dict[str, list[float]]:
    """The errors of each check, level by level."""
    errors: dict[str, list[float]] = {}
    for level in levels:
        case = refined(load_case(path).as_solved(swapped), level)
        _, checks = solve_checked(case, mesh_of(case), accepted=False)
        worst: dict[str, float] = {}
        for check in checks:
            if check.verifies:
                worst[check.name] = max(worst.get(check.name, 0.0), check.error)
        for name, error in worst.items():
            errors.setdefault(name, []).append(error)
    return errors
