"""Powers fitted to measurements: value ~ size^power, by least squares in log–log.

Orders of convergence are powers of the mesh size, growth of cost is a power of the unknowns.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

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
