"""Quadrature that makes the patch test exact, by cell type.

The patch test asks that the integrals of the shape functions' physical gradients be exact. The
degrees below are the lowest found to suffice for straight-edged cells; on pyramids a conical
product of Gauss and Gauss–Jacobi points turns the integrals of the rational gradients into
polynomials (Stroud, Approximate Calculation of Multiple Integrals, 1971, §2.4–2.5).
"""

from functools import cache

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine, RefTet, RefTri

from .catalogue import BY_NAME

Rule = tuple[np.ndarray, np.ndarray]

# degree along each part of the cell: (linear, quadratic)
_DEGREES = {
    "SEG": ((3,), (5,)),
    "TRIA": ((2,), (4,)),
    "QUAD": ((3,), (5,)),
    "TETRA": ((1,), (2,)),
    "HEXA": ((3,), (5,)),
    "PENTA": ((4, 3), (6, 5)),
    "PYRA": ((3, 3), (5, 4)),
}

# degree of the polynomial that a shape function is on an affine face
_MORTAR_DEGREES = {"SEG2": 1, "SEG3": 2, "TRIA3": 1, "TRIA6": 2, "QUAD4": 2, "QUAD8": 3, "QUAD9": 4}


@cache
def volume_rule(name: str, straight: bool = True) -> Rule:
    """Points (n, dim) and weights (n,) for the stiffness of the cell type `name`.

    Cells whose edges are not `straight` need more points where the type is TETRA10; the rules of
    the others suffice for bent cells as well.
    """
    shape = name.rstrip("0123456789")
    if name == "TETRA10" and not straight:
        return simplex_rule(3, 4)
    degrees = _DEGREES[shape][BY_NAME[name].order - 1]
    if shape in ("TRIA", "TETRA"):
        return simplex_rule(BY_NAME[name].dim, degrees[0])
    if shape == "PENTA":
        return _product(simplex_rule(2, degrees[0]), simplex_rule(1, degrees[1]))
    if shape == "PYRA":
        return _conical(*degrees)
    line = simplex_rule(1, degrees[0])
    rule = line
    for _ in range(BY_NAME[name].dim - 1):
        rule = _product(rule, line)
    return rule


def face_rule(name: str) -> Rule:
    """Points (n, dim) and weights (n,) for loads on the face type `name`: exact where planar."""
    if name.startswith("TRIA"):
        return simplex_rule(2, 2 * BY_NAME[name].order + 2)
    return volume_rule(name)


def mortar_degree(name: str) -> int:
    """Degree that integrates the shape functions of an affine face of that type exactly."""
    return _MORTAR_DEGREES[name]


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


def _product(first: Rule, second: Rule) -> Rule:
    (p, v), (q, w) = first, second
    points = [np.concatenate([a, b]) for b in q for a in p]
    return np.array(points), np.outer(w, v).ravel()


def _conical(base: int, axis: int) -> Rule:
    """`base` Gauss points each way over the square, `axis` Gauss–Jacobi points to the apex."""
    from scipy.special import roots_jacobi

    x, u = np.polynomial.legendre.leggauss(base)
    t, v = roots_jacobi(axis, 2, 0)  # weight (1 − t)²: the shrinking cross-section
    z = (t + 1) / 2
    points = [[a * (1 - h), b * (1 - h), h] for h in z for b in x for a in x]
    return np.array(points), np.einsum("k,j,i->kji", v / 8, u, u).ravel()
