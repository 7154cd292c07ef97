"""Orders of convergence by theory.

The LAC method on cells of degree one or two has a multiplier that is constant on each macro-element
(Drouet, Hild, Numer. Math. 136 (2017) 467–502): the error of the displacement in H1 falls with
order 1 or 1.5 at least, in L2 with one more; where the solution is smooth, it may reach what
interpolation allows, 2 in H1 and 3 in L2 for degree two. The pressure error in L2 falls with order
0.5 or 1 at least; 1 is the most that a piecewise constant can show. Its values at the means of
macro-elements have no such bound. A pressure recovered from the constants is a polynomial of degree
one or two, of order two or three where the solution is smooth and its means are as exact.

Powers are fitted to measurements by least squares in log–log: orders are powers of the mesh size,
growth of cost is a power of the unknowns.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Order:
    """The order guaranteed, and the best there can be (None: not known)."""

    least: float | None
    best: float | None

    def __str__(self) -> str:
        """Both, or the one that is known."""
        if self.least is None or self.best is None:
            bounds = [
                f"{sign} {v:g}"
                for sign, v in (("≥", self.least), ("≤", self.best))
                if v is not None
            ]
            return f"theory {bounds[0] if bounds else '–'}"
        return "theory " + " … ".join(dict.fromkeys(f"{v:g}" for v in (self.least, self.best)))


UNKNOWN = Order(None, None)
# The best order of a recovered pressure, by form of the recovery and degree of the cells.
RECOVERED = {
    ("linear", "quadratic"): 2.0,
    ("quadratic", "quadratic"): 3.0,
    ("automatic", "quadratic"): 3.0,
} | {(form, "linear"): 2.0 for form in ("linear", "quadratic", "smooth", "automatic")}
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


def element_size(macro_elements: int, dim: int) -> float:
    """The mean size of a macro-element over the size of the interface, for a mesh of `dim`."""
    return float(macro_elements) ** (-1 / (dim - 1))


ROUND_OFF = 1e-11
"""Relative errors up to this are rounding: no order is fitted to them."""
LAST = 3
"""Orders are fitted to so many of the finest sizes."""


@dataclass(frozen=True)
class Fit:
    """A fitted power and its standard error, which is NaN for two points.

    `low` and `high` are the sizes between which it was fitted.
    """

    value: float
    spread: float
    low: float
    high: float

    def __str__(self) -> str:
        """With the standard error, where there is one."""
        return f"{self.value:.2f}" + ("" if np.isnan(self.spread) else f" ± {self.spread:.2f}")


def fit_power(sizes: ArrayLike, values: ArrayLike) -> Fit | None:
    """The power of sizes (n,) with which values (n,) change.

    None for fewer than two different sizes, and for values that are not positive and finite.
    """
    h, e = np.asarray(sizes, dtype=float), np.asarray(values, dtype=float)
    if len(h) < 2 or h.min() == h.max() or not ((e > 0) & np.isfinite(e)).all():
        return None
    x, y = np.log(h) - np.log(h).mean(), np.log(e) - np.log(e).mean()
    power = float((x @ y) / (x @ x))
    residual, free = y - power * x, len(h) - 2
    spread = float(np.sqrt(residual @ residual / free / (x @ x))) if free else float("nan")
    return Fit(power, spread, float(h.min()), float(h.max()))


def fit_order(sizes: ArrayLike, errors: ArrayLike) -> Fit | None:
    """The order of convergence over the `LAST` finest sizes.

    None for fewer sizes, and for errors that are rounding.
    """
    h, e = _finest(sizes, errors)
    return None if len(h) < LAST or e.min() <= ROUND_OFF else fit_power(h, e)


def is_rounding(sizes: ArrayLike, errors: ArrayLike) -> bool:
    """Whether the errors at the `LAST` finest sizes are all rounding."""
    _, e = _finest(sizes, errors)
    return len(e) > 0 and bool(np.all(e <= ROUND_OFF))


def _finest(sizes: ArrayLike, errors: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    h, e = np.asarray(sizes, dtype=float), np.asarray(errors, dtype=float)
    order = np.argsort(h)[:LAST]
    return h[order], e[order]
