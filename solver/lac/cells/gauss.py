"""Gauss quadrature of any degree on every cell type, for functions that are no shape functions.

Products of Gauss–Legendre points on lines, squares and cubes; on simplices and pyramids these are
collapsed towards a vertex, with Gauss–Jacobi points for the shrinking cross-section (Stroud,
Approximate Calculation of Multiple Integrals, 1971, §2.4–2.5). No weight is negative.
"""

from functools import cache

import numpy as np

Rule = tuple[np.ndarray, np.ndarray]


@cache
def gauss_rule(name: str, n: int) -> Rule:
    """Points (k, dim) and weights (k,) on the reference cell of a type, from n points each way.

    Exact to degree 2 n − 1.
    """
    shape = name.rstrip("0123456789")
    line = _line(n, 0)
    if shape == "SEG":
        return line
    if shape == "QUAD":
        return _product(line, line)
    if shape == "HEXA":
        return _product(_product(line, line), line)
    triangle = _collapsed(line, _line(n, 1))
    if shape == "TRIA":
        return triangle
    if shape == "PENTA":
        return _product(triangle, line)
    if shape == "TETRA":
        return _collapsed(triangle, _line(n, 2))
    points, weights = _product(line, line)
    return _collapsed((2 * points - 1, 4 * weights), _line(n, 2))


def _line(n: int, power: int) -> Rule:
    """Gauss–Jacobi on [0, 1] for the weight (1 − t)^power."""
    if power == 0:
        x, w = np.polynomial.legendre.leggauss(n)
    else:
        from scipy.special import roots_jacobi

        x, w = roots_jacobi(n, power, 0)
    return ((x + 1) / 2)[:, None], w / 2 ** (power + 1)


def _product(first: Rule, second: Rule) -> Rule:
    (p, v), (q, w) = first, second
    points = np.hstack([np.tile(p, (len(q), 1)), np.repeat(q, len(p), axis=0)])
    return points, np.outer(w, v).ravel()


def _collapsed(base: Rule, axis: Rule) -> Rule:
    """The product, its base shrunk towards the top of the axis."""
    points, weights = _product(base, axis)
    points[:, :-1] *= 1 - points[:, -1:]
    return points, weights
