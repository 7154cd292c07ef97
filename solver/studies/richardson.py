"""Order, Richardson value and uncertainty band of a value on three or more meshes.

With f1, f2, f3 on sizes h1 < h2 < h3 the law f = a + c h^p gives the order p and the value a; the
band f1 ± F |a - f1| has the safety factor F (ASME V&V 20-2009, section 2-4; Roache, Verification
and Validation in Computational Science and Engineering, 1998, chapter 5). F is 1.25 where the order
is credible: within a tenth of the order of theory; else it is 3. An order above that of theory is
replaced by it, since it would make the band too narrow (Oberkampf and Roy, Verification and
Validation in Scientific Computing, 2010, section 8.7.3). With more than three meshes the order of
each three neighbours must be credible. Values that are not monotone have no band, nor have those
whose order is below 0.1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from .fits import ROUND_OFF

CREDIBLE, DOUBTFUL = 1.25, 3.0
# An order is credible if it is within this part of the one of theory.
LEEWAY = 0.1
# Values that grow without limit, but slowly, like a logarithm, look like an order below this one.
_NONE = 0.1
# The largest order that is sought: values of meshes cannot distinguish higher ones.
_HIGHEST = 20.0

Kind = Literal["monotone", "exact", "oscillatory", "divergent", "stalled"]
REASONS: dict[Kind, str] = {
    "monotone": "",
    "exact": "does not depend on the mesh",
    "oscillatory": "oscillates: no band",
    "divergent": "does not converge, or too slowly: no band",
    "stalled": "equal on the two finest meshes alone: no band",
}


@dataclass(frozen=True, kw_only=True)
class Extrapolation:
    """What three or more values say about their limit; None where it is unknown.

    `order` is the observed one, `used` the one that `value` and `band` (half its width, around the
    value of the finest mesh) follow from, with the safety `factor`.
    """

    kind: Kind
    order: float | None = None
    used: float | None = None
    factor: float | None = None
    value: float | None = None
    band: float | None = None


def extrapolate(
    sizes: Sequence[float], values: Sequence[float], theory: float, scale: float = 0.0
) -> Extrapolation:
    """The limit of values (n,) on meshes of sizes (n,), coarsest first, n ≥ 3.

    `theory`: the order of smooth solutions. Changes of `ROUND_OFF` times the largest value,
    or `scale` where that is larger, are rounding.

    >>> found = extrapolate([4, 2, 1], [10 + 16, 10 + 4, 10 + 1], theory=2)
    >>> found.order, found.value, found.factor, found.band
    (2.0, 10.0, 1.25, 1.25)
    """
    rounding = ROUND_OFF * max(scale, *np.abs(values))
    if np.ptp(values) <= rounding:
        return Extrapolation(kind="exact", value=values[-1], band=rounding)
    (h3, h2, h1), (f3, f2, f1) = sizes[-3:], values[-3:]
    if abs(f2 - f1) <= rounding:
        return Extrapolation(kind="stalled")
    order = observed_order((h3, h2, h1), (f3, f2, f1))
    if order is None:
        return Extrapolation(kind="oscillatory")
    if order < _NONE:
        return Extrapolation(kind="divergent", order=order)
    orders = [observed_order(sizes[i : i + 3], values[i : i + 3]) for i in range(len(values) - 2)]
    credible = all(one is not None and abs(one - theory) <= LEEWAY * theory for one in orders)
    factor, used = CREDIBLE if credible else DOUBTFUL, min(order, theory)
    rest = (f1 - f2) / ((h2 / h1) ** used - 1)
    return Extrapolation(
        kind="monotone",
        order=order,
        used=used,
        factor=factor,
        value=f1 + rest,
        band=factor * abs(rest),
    )


def observed_order(sizes: Sequence[float], values: Sequence[float]) -> float | None:
    """The order p of f = a + c h^p through three values, coarsest first; None if not monotone.

    At most 20 in size. An order of zero or less is the one of values that run away.

    >>> observed_order([9, 3, 1], [9, 3, 1])
    1.0
    """
    (h3, h2, h1), (f3, f2, f1) = sizes, values
    if not (f3 - f2) * (f2 - f1) > 0:
        return None
    ratio, coarse, fine = (f3 - f2) / (f2 - f1), np.log(h3 / h2), np.log(h2 / h1)

    def excess(order: float) -> float:
        if order == 0:
            return float(coarse / fine - ratio)
        return float(np.expm1(order * coarse) / -np.expm1(-order * fine) - ratio)

    if excess(_HIGHEST) <= 0:
        return _HIGHEST
    if excess(-_HIGHEST) >= 0:
        return -_HIGHEST
    return round(float(brentq(excess, -_HIGHEST, _HIGHEST, xtol=1e-14)), 12)
