"""Growth: the exponent with which a cost rises with the size of its work, fitted in log–log."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

BY_FACES = ("cut", "pairing")
"""Stages whose work is the interface: they grow with its faces, not with the unknowns."""


@dataclass(frozen=True)
class Growth:
    """cost ~ size^value; `spread` is the standard error of the exponent, NaN of two points.

    `low` and `high` are the sizes between which it was fitted.
    """

    value: float
    spread: float
    low: float
    high: float


def fit_growth(sizes: ArrayLike, costs: ArrayLike) -> Growth | None:
    """The exponent by least squares of log(cost) over log(size).

    None for fewer than two sizes, or a cost that is not positive.
    """
    n, t = np.asarray(sizes, dtype=float), np.asarray(costs, dtype=float)
    if len(set(n.tolist())) < 2 or not (t > 0).all():
        return None
    x, y = np.log(n) - np.log(n).mean(), np.log(t) - np.log(t).mean()
    slope = float((x @ y) / (x @ x))
    left, free = y - slope * x, len(n) - 2
    spread = float(np.sqrt(left @ left / free / (x @ x))) if free else float("nan")
    return Growth(slope, spread, float(n.min()), float(n.max()))


def window(sizes: Sequence[float], low: float, high: float) -> list[int]:
    """Which sizes an exponent is fitted to: those from `low` to `high`, at least the last two.

    Small sizes are mostly start-up, which does not grow.
    """
    order = sorted(range(len(sizes)), key=lambda i: sizes[i])
    inside = [i for i in order if low <= sizes[i] <= high]
    return inside if len(inside) > 1 else order[-2:]
