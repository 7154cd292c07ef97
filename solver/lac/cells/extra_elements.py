"""Elements that scikit-fem does not have: PYRA5, PYRA13 and PENTA15, as its own `ElementH1`.

All their degrees of freedom are interior, in the node order of the catalogue, so that the
connectivity of a mesh file is the map of degrees of freedom.
"""

import numpy as np
from skfem.element.element_h1 import ElementH1
from skfem.refdom import RefHex, RefWedge

from .catalogue import BY_NAME


class _NodeElement(ElementH1):
    """An element of the catalogue; its degrees of freedom are its nodes."""

    def __init__(self, name: str):
        nodes = BY_NAME[name].nodes
        self.interior_dofs = len(nodes)
        self.doflocs = nodes
        self.dofnames = ["u"] * len(nodes)


class ElementPyramid(_NodeElement):
    """PYRA5 and PYRA13, rational functions on the pyramid over [-1, 1]² with apex (0, 0, 1).

    Each function is a product of planes divided by s = 1 − z, which is not smooth at the apex
    alone. Source: Bedrosian, Shape functions and integration formulas for three-dimensional finite
    element analysis, IJNME 35 (1992) 95–108.
    """

    # scikit-fem has no reference pyramid; its cube has the dimension, all that is asked of it here.
    refdom = RefHex
    maxdeg = 4

    def __init__(self, name: str):
        super().__init__(name)
        self.quadratic = name == "PYRA13"

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Value (n,) and gradient (3, n) of function `i` at the points `X` (3, n)."""
        s = 1.0 - X[2]
        factors = [np.array(f, dtype=float) for f in self._factors(i)]
        values = [np.tensordot(f[:3], X, 1) + f[3] for f in factors]
        product = np.prod(values, axis=0)
        gradient = np.zeros_like(X)
        for k, factor in enumerate(factors):
            others = np.prod([v for j, v in enumerate(values) if j != k], axis=0)
            gradient += factor[:3, None] * others
        if i == 4:  # the apex: a polynomial in z
            return product, gradient
        gradient /= s
        gradient[2] += product / s**2
        return product / s, gradient

    def _factors(self, i: int) -> list[tuple[float, float, float, float]]:
        """The planes (gx, gy, gz, constant) whose product over s is function `i`."""
        a, b, height = self.doflocs[i]
        if i == 4:
            return [(0, 0, 1, 0), (0, 0, 2, -1)] if self.quadratic else [(0, 0, 1, 0)]
        side_x, side_y = (np.sign(a), 0, -1, 1), (0, np.sign(b), -1, 1)
        if not self.quadratic:
            return [side_x, (0, b / 4, -0.25, 0.25)]
        if i < 4:
            return [side_x, side_y, (a / 4, b / 4, 0, -0.25)]
        if height > 0:
            return [side_x, side_y, (0, 0, 1, 0)]
        if a == 0:
            return [(1, 0, -1, 1), (-1, 0, -1, 1), (0, b / 2, -0.5, 0.5)]
        return [(0, 1, -1, 1), (0, -1, -1, 1), (a / 2, 0, -0.5, 0.5)]


class ElementWedgeS2(_NodeElement):
    """PENTA15, the serendipity wedge: quadratic in the triangle and along the axis."""

    refdom = RefWedge
    maxdeg = 4

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Value (n,) and gradient (3, n) of function `i` at the points `X` (3, n)."""
        barycentric = np.stack([1 - X[0] - X[1], X[0], X[1]])
        slopes = np.array([[-1.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])[:, :, None]
        t, dt = 2 * X[2] - 1, np.array([0.0, 0.0, 2.0])[:, None]
        if i < 6:
            side = -1.0 if i < 3 else 1.0
            w, dw = barycentric[i % 3], slopes[i % 3]
            end, fall = 1 + side * t, 2 * w - 2 + side * t
            gradient = dw * end * fall + w * side * dt * fall + w * end * (2 * dw + side * dt)
            return w * end * fall / 2, gradient / 2
        if i < 12:
            side = -1.0 if i < 9 else 1.0
            j, k = i % 3, (i + 1) % 3
            v, w, end = barycentric[j], barycentric[k], 1 + side * t
            gradient = (slopes[j] * w + v * slopes[k]) * end + v * w * side * dt
            return 2 * v * w * end, 2 * gradient
        w, dw = barycentric[i - 12], slopes[i - 12]
        return w * (1 - t**2), dw * (1 - t**2) - 2 * t * dt * w
