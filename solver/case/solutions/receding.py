"""A layer on a rigid base, pressed down in its middle: beside the load it lifts off.

The layer of thickness h, without weight, carries the pressure q on |x| < c and touches the base on
|x| < a; a is the same for any load. With H = h/2, a wave of normal pressure p̂ on the lower face and
q̂ on the upper one lifts the lower face by

    v̂ = ((S + A) p̂ + (S − A) q̂)/(E′ k),
    S = sinh² kH/(sinh kH cosh kH + kH),   A = cosh² kH/(sinh kH cosh kH − kH),

the sum of its symmetric and its antisymmetric half. The slope of the lower face is zero where it
touches. With x = a t and p = √(1 − t²) Σ bₙ U₂ₙ(t), whose part in 2 p̂ is the singular integral
2π Σ bₙ T₂ₙ₊₁(t), this is an equation at each of N points for b₁ … and a, since b₀ = 4 c q/(π a) by
the balance of forces. Beyond the contact T₂ₙ₊₁ becomes w²ⁿ⁺¹ with w = t − √(t² − 1), and the gap is
the integral of the slope. A mirrored layer in place of the base has the same pressure. Chebyshev
series: F. Erdogan, G. D. Gupta, Q. Appl. Math. 29 (1972) 525–534; the problem: L. M. Keer, J.
Dundurs, K. C. Tsai, J. Appl. Mech. 39 (1972) 1115–1120.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import parameter
from .hertz import ContactArea

# Beyond this k h the layer is a half-plane: S and A differ from 1 by less than round-off.
_LARGEST = 45.0
# Terms of the series and points of the integral for a load that is narrow; more for a wide one.
_TERMS, _POINTS = 16, 200
_WIDEST = 4.0


@dataclass(frozen=True, kw_only=True)
class RecedingLayer(ContactArea):
    """A layer on a rigid base, or on its mirror image; it lifts off beside the load.

    The pressure is the same for all materials. In 3D nothing changes along the second axis.
    """

    name: ClassVar[str] = "receding_layer"
    quantities: ClassVar[frozenset[str]] = ContactArea.quantities | {"gap"}
    dim: int = parameter("2 or 3", source="extruded", default=2)

    height: float = parameter("h, the thickness of the layer", positive=True)
    loaded: float = parameter("c, half the width of the load, at most 4 h")
    pressure: float = parameter("q, the pressure of the load", source="pressure", positive=True)
    top: Material = parameter("of the layer", source="material")
    bottom: Material = parameter("of the base, or of the layer below", source="material")

    def __post_init__(self) -> None:
        super().__post_init__()
        widest = _WIDEST * self.height
        self.require(f"must be positive and at most {widest:g}", loaded=0 < self.loaded <= widest)

    @cached_property
    def _extent(self) -> tuple[float, np.ndarray]:
        """a/h, and bₙ (N,) over the mean pressure of the load on the contact, 2 c q/(2 a)."""
        from scipy.optimize import brentq

        load = self.loaded / self.height
        low, high = max(0.8, load), 1.0 + load  # 0.857 h for c = 0, up to 0.4 h beyond a wide load
        end = brentq(lambda a: self._residual(a)[0], low, high, xtol=1e-13)
        return float(end), self._residual(float(end))[1]

    @cached_property
    def _waves(self) -> tuple[np.ndarray, ...]:
        """Wave numbers k h (m,), the weights of their integral, S and A."""
        place, weight = np.polynomial.legendre.leggauss(self._more(_POINTS))
        k = _LARGEST / 2 * (place + 1)
        both, own = np.sinh(k / 2) * np.cosh(k / 2), k / 2
        symmetric, other = np.sinh(k / 2) ** 2 / (both + own), np.cosh(k / 2) ** 2 / (both - own)
        return k, _LARGEST / 2 * weight, symmetric, other

    def _more(self, count: int) -> int:
        return int(count * (1 + self.loaded / self.height / 2))

    def _pressed(self, end: float, terms: int) -> tuple[np.ndarray, np.ndarray]:
        """p̂ₙ (m, N) and q̂ (m,) for a force 2 a p_mean of 2, with a/h = `end`: b₀ = 4/π then."""
        from scipy.special import jv

        k, n = self._waves[0], np.arange(terms)
        wave = np.pi * (-1.0) ** n * (2 * n + 1) * jv(2 * n + 1, k[:, None] * end)
        return wave / (k[:, None] * end), 2 * np.sinc(k * self.loaded / self.height / np.pi)

    def _residual(self, end: float) -> tuple[float, np.ndarray]:
        """The first coefficient of the slope that is left for a/h = `end`, and bₙ/p_mean (N,)."""
        k, weight, symmetric, other = self._waves
        terms = self._more(_TERMS)
        n = np.arange(terms)
        wave, above = self._pressed(end, terms)
        first = 4 / np.pi * wave[:, 0]
        angle = np.pi * (2 * n + 1) / (4 * terms)
        sines = weight * np.sin(np.cos(angle)[:, None] * end * k)
        # The kernels act on p̂ − q̂, which vanishes with k, so that A is finite there.
        rest = end * sines @ ((symmetric + other - 2)[:, None] * wave)
        matrix = 2 * np.pi * np.cos(np.outer(angle, 2 * n + 1)) + rest
        fixed = symmetric * (first + above) - 2 * first + other * (first - above)
        given = 8 * np.cos(angle) + end * sines @ fixed
        project = np.cos(np.outer(2 * n + 1, angle)) * 2 / terms
        matrix, given = project @ matrix, project @ given
        b = np.linalg.solve(matrix[1:, 1:], -given[1:])
        return float(given[0] + matrix[0, 1:] @ b), np.append(4 / np.pi, b)

    @property
    def half_width(self) -> float:
        """a: half the width of the contact."""
        return self._extent[0] * self.height

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """√(1 − t²) Σ bₙ U₂ₙ(t), which is Σ bₙ sin (2n + 1)θ with t = cos θ."""
        _, b = self._extent
        share = np.abs(x[:, 0]) / self.half_width
        angle = np.arccos(np.minimum(share, 1.0))
        mean = self.pressure * self.loaded / self.half_width
        return mean * np.sin(np.outer(angle, 2 * np.arange(len(b)) + 1)) @ b

    def gap(self, x: np.ndarray) -> np.ndarray:
        """The integral of the slope from the end of the contact."""
        (end, b), (k, weight, symmetric, other) = self._extent, self._waves
        wave, above = self._pressed(end, len(b))
        own = wave @ b
        # S and A differ from 1 by a layer's own part; that of a half-plane is in closed form.
        rest = weight / k * (symmetric * (own + above) - 2 * own + other * (own - above))
        t = np.maximum(np.abs(x[:, 0]) / self.half_width, 1.0)
        shape = (np.cos(np.outer(t * end, k)) - np.cos(end * k)) @ rest
        w = (t - np.sqrt(t**2 - 1))[:, None]
        even = 2 * np.arange(1, len(b))
        part = (w ** (even + 2) - 1) / (even + 2) - (w**even - 1) / even
        whole = np.column_stack([(w**2 - 1) / 2 - np.log(w), part]) / 2
        compliance = sum((1 - m.poisson**2) / m.young for m in (self.top, self.bottom))
        mean = self.pressure * self.loaded / np.pi
        return np.maximum(compliance * mean * (shape - 2 * np.pi * whole @ b), 0.0)

    @property
    def moment(self) -> float:
        """(1 + b₁/b₀)/4."""
        b = self._extent[1]
        return float(1 + b[1] / b[0]) / 4
