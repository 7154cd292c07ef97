"""Quadrature on faces: rules that integrate their shape functions exactly where they are planar.

For other functions there is Gauss quadrature of any degree on every cell type: products of
Gauss–Legendre points on lines, squares and cubes; on simplices and pyramids these are collapsed
towards a vertex, with Gauss–Jacobi points for the shrinking cross-section (Stroud, Approximate
Calculation of Multiple Integrals, 1971, §2.4–2.5). No weight is negative.
"""

from functools import cache

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine, RefTet, RefTri

from .catalogue import BY_NAME

Rule = tuple[np.ndarray, np.ndarray]


@cache
def gauss_rule(name: str, n: int) -> Rule:
    """Points (k, dim) and weights (k,) on the reference cell of a type, from n points each way.

    Exact to degree 2 n − 1.
    """
    shape = BY_NAME[name].shape
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


def face_rule(name: str) -> Rule:
    """Points (n, dim) and weights (n,) for loads on the face type `name`: exact where planar."""
    kind = BY_NAME[name]
    if kind.n_vertices == 3:
        return simplex_rule(2, 2 * kind.order + 2)
    line = simplex_rule(1, 2 * kind.order + 1)
    return line if kind.dim == 1 else product_rule(line, line)


@cache
def simplex_rule(dim: int, degree: int) -> Rule:
    """Points (n, dim) and weights (n,) on the unit simplex, exact to `degree`.

    Raises ValueError for tetrahedra above degree 4: from 5 on, scikit-fem 12.0.2's rules miss
    their degree by 1e-4 to 7e-3.
    """
    if dim == 3 and degree > 4:
        raise ValueError(f"no exact tetrahedron rule of degree {degree}")
    points, weights = get_quadrature((RefLine, RefTri, RefTet)[dim - 1], max(degree, 1))
    return points.T.copy(), weights.copy()


def product_rule(first: Rule, second: Rule) -> Rule:
    """The product of two rules, the first one fastest."""
    (p, v), (q, w) = first, second
    points = [np.concatenate([a, b]) for b in q for a in p]
    return np.array(points), np.outer(w, v).ravel()
