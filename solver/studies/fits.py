"""Orders of convergence: fitted slopes with their spread, and what theory says of them.

The LAC method on cells of degree one or two has a multiplier that is constant on each macro-element
(Drouet, Hild, Numer. Math. 136 (2017) 467–502): the error of the displacement in H1 falls with
order 1 or 1.5 at least, in L2 with one more; where the solution is smooth, it may reach what
interpolation allows, 2 in H1 and 3 in L2 for degree two. The pressure error in L2 falls with order
0.5 or 1 at least; 1 is the most that a piecewise constant can show. Its values at the means of
macro-elements have no such bound.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

LAST = 3
# Relative errors below are rounding: no slope is fitted to them.
ROUND_OFF = 1e-11


@dataclass(frozen=True)
class Order:
    """What theory says: the order guaranteed, and the best there can be (None: not known)."""

    least: float | None
    best: float | None


DEGREES = {1: "linear", 2: "quadratic"}
THEORY: Mapping[str, Mapping[str, Order]] = {
    "linear": {
        "displacement_l2": Order(2.0, 2.0),
        "displacement_h1": Order(1.0, 1.0),
        "stress_l2": Order(1.0, 1.0),
        "pressure_l2": Order(0.5, 1.0),
        "pressure_max": Order(None, 1.0),
    },
    "quadratic": {
        "displacement_l2": Order(2.5, 3.0),
        "displacement_h1": Order(1.5, 2.0),
        "stress_l2": Order(1.5, 2.0),
        "pressure_l2": Order(1.0, 1.0),
        "pressure_max": Order(None, 1.0),
    },
}


@dataclass(frozen=True)
class Slope:
    """A fitted slope in log–log, and its standard error."""

    value: float
    spread: float


def fit_slope(sizes: ArrayLike, errors: ArrayLike, last: int = LAST) -> Slope | None:
    """The slope of log(error) over log(size) by least squares over the `last` finest sizes.

    The spread is the standard error of the slope. None for fewer than three points, for errors that
    are rounding, and where the sizes are all the same.
    """
    h, e = _finest(sizes, errors, last)
    if len(h) < LAST or not np.all(np.isfinite(e)) or e.min() <= ROUND_OFF or h.min() == h.max():
        return None
    x, y = np.log(h) - np.log(h).mean(), np.log(e) - np.log(e).mean()
    slope = (x @ y) / (x @ x)
    residual = y - slope * x
    return Slope(float(slope), float(np.sqrt(residual @ residual / (len(h) - 2) / (x @ x))))


def is_rounding(sizes: ArrayLike, errors: ArrayLike, last: int = LAST) -> bool:
    """Whether the errors at the `last` finest sizes are all rounding."""
    _, e = _finest(sizes, errors, last)
    return len(e) > 0 and bool(np.all(e <= ROUND_OFF))


def _finest(sizes: ArrayLike, errors: ArrayLike, last: int) -> tuple[np.ndarray, np.ndarray]:
    h, e = np.asarray(sizes, dtype=float), np.asarray(errors, dtype=float)
    order = np.argsort(h)[:last]
    return h[order], e[order]


def element_size(macro_elements: int, dim: int) -> float:
    """The mean size of a macro-element over the size of the interface, for a mesh of `dim`."""
    return float(macro_elements) ** (-1 / (dim - 1))
