"""Shape functions by cell type, in the node order of the catalogue, and quadrature.

Shape functions of edges and faces are products of a matrix and monomials, since contact evaluates
them at many points; solid cells have scikit-fem's.

Rules on faces integrate the shape functions exactly where faces are planar. For other functions
there is Gauss quadrature of any degree on every cell type: products of Gauss–Legendre points on
lines, squares and cubes; on simplices and pyramids these are collapsed towards a vertex, with
Gauss–Jacobi points for the shrinking cross-section (Stroud, Approximate Calculation of Multiple
Integrals, 1971, §2.4–2.5). No weight is negative.
"""

from functools import cache, lru_cache
from typing import Any

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine, RefTet, RefTri

from .catalogue import BY_NAME, CellType


def invert(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Determinants (...) and inverses (..., d, d) of 1×1, 2×2 or 3×3 matrices, by cofactors.

    Entries are infinite or NaN where the determinant is zero; the caller looks at it.
    """
    d = matrix.shape[-1]
    m = np.moveaxis(matrix, (-2, -1), (0, 1))
    if d == 1:
        determinant, adjugate = m[0, 0], np.ones_like(m)
    elif d == 2:
        (a, b), (c, e) = m
        determinant = a * e - b * c
        adjugate = np.stack([np.stack([e, -b]), np.stack([-c, a])])
    else:
        one, two = [1, 2, 0], [2, 0, 1]  # the next row or column, and the one after it
        cofactor = m[one][:, one] * m[two][:, two] - m[one][:, two] * m[two][:, one]
        determinant = np.einsum("i...,i...->...", m[0], cofactor[0])
        adjugate = cofactor.swapaxes(0, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return determinant, np.moveaxis(adjugate / determinant, (0, 1), (-2, -1))


# Mid-edge nodes off the middle by less than this share of the edge make no bent edge.
_STRAIGHT = 1e-9
# Values at points of at most so many coordinates are kept.
_KEPT = 1 << 10


class ShapeFunctions:
    """The shape functions of one solid cell type.

    scikit-fem numbers the degrees of freedom of an element in its own way; they are matched here
    with the catalogue's nodes by their place in the reference cell.
    """

    def __init__(self, name: str):
        self.type = BY_NAME[name]
        self._element = _element_of(self.type)
        places = np.asarray(self._element.doflocs)
        distance = np.linalg.norm(self.type.nodes[:, None] - places[None], axis=2)
        self._order = distance.argmin(axis=1)
        if distance.min(axis=1).max() > 1e-12 or len(set(self._order)) != self.type.n_nodes:
            raise AssertionError(f"{name}: the nodes of the catalogue and the element differ")

    def values(self, points: np.ndarray) -> np.ndarray:
        """Values (..., n_nodes) at the reference points (..., dim)."""
        return self._evaluate(points)[0]

    def gradients(self, points: np.ndarray) -> np.ndarray:
        """Reference gradients (..., n_nodes, dim) at the reference points (..., dim)."""
        return self._evaluate(points)[1]

    def both(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (..., n_nodes) and gradients (..., n_nodes, dim) at once."""
        return self._evaluate(points)

    def _evaluate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = np.ascontiguousarray(points, dtype=float)
        if points.size > _KEPT:
            return self._computed(points)
        # Every part of the cells asks for the same points of quadrature.
        values, gradients = self._known(points.tobytes(), points.shape)
        return values.copy(), gradients.copy()

    @lru_cache(64)  # noqa: B019 -- there is one object for each cell type
    def _known(self, points: bytes, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        return self._computed(np.frombuffer(points).reshape(shape))

    def _computed(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        flat = np.ascontiguousarray(np.reshape(points, (-1, self.type.dim)).T, dtype=float)
        values = np.empty((flat.shape[1], self.type.n_nodes))
        gradients = np.empty((flat.shape[1], self.type.n_nodes, self.type.dim))
        for node, dof in enumerate(self._order):
            value, gradient = self._element.lbasis(flat, int(dof))
            values[:, node] = value
            gradients[:, node] = np.asarray(gradient).T
        shape = np.shape(points)[:-1]
        return (
            values.reshape(*shape, self.type.n_nodes),
            gradients.reshape(*shape, self.type.n_nodes, self.type.dim),
        )


class _Polynomials(ShapeFunctions):
    """The shape functions of an edge or a face: monomials, around the middle of squares."""

    def __init__(self, name: str):
        self.type = kind = BY_NAME[name]
        self._origin = 0.0 if kind.n_vertices == 3 else 0.5
        powers = np.indices((kind.order + 1,) * kind.dim).reshape(kind.dim, -1).T
        if kind.n_vertices == 3:
            powers = powers[powers.sum(axis=1) <= kind.order]
        self._powers = powers[: kind.n_nodes]
        self._values = np.linalg.inv(self._monomials(kind.nodes).T).round(2)
        # The derivative of a monomial is its power times another one.
        lower = self._powers - np.eye(kind.dim, dtype=int)[:, None]
        to_lower = (self._powers == lower[:, :, None]).all(axis=3) * self._powers.T[..., None]
        slopes = np.einsum("kml,ma->lak", to_lower, self._values)
        self._gradients = slopes.reshape(kind.n_nodes, -1)

    def values(self, points: np.ndarray) -> np.ndarray:
        shape = (*np.shape(points)[:-1], self.type.n_nodes)
        return (self._monomials(points).T @ self._values).reshape(shape)

    def gradients(self, points: np.ndarray) -> np.ndarray:
        shape = (*np.shape(points)[:-1], self.type.n_nodes, self.type.dim)
        return (self._monomials(points).T @ self._gradients).reshape(shape)

    def both(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.values(points), self.gradients(points)

    def _monomials(self, points: np.ndarray) -> np.ndarray:
        """Monomials (n_nodes, n) at points (..., dim), of which there are n."""
        x = np.reshape(points, (-1, self.type.dim)).T - self._origin
        ladder = [np.ones_like(x), x, x * x]
        found = np.stack([ladder[power][0] for power in self._powers[:, 0]])
        if self.type.dim == 2:
            for k, power in enumerate(self._powers[:, 1]):
                found[k] *= ladder[power][1]
        return found


@cache
def shape_functions(name: str) -> ShapeFunctions:
    """The shape functions of the cell type `name` (the field's name: `HEXA20`)."""
    return _Polynomials(name) if BY_NAME[name].dim < 3 else ShapeFunctions(name)


def has_straight_edges(kind: CellType, corner: np.ndarray) -> np.ndarray:
    """Which cells or faces (c,), of node coordinates (c, n_nodes, dim), have straight edges.

    That is, mid-edge nodes in the middle, to 1e-9 of the edge: all cells of linear types.
    """
    if kind.order == 1:
        return np.ones(len(corner), dtype=bool)
    ends = corner[:, np.array(kind.edges)]
    n = kind.n_vertices
    offset = corner[:, n : n + len(kind.edges)] - ends.mean(axis=2)
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    return (np.linalg.norm(offset, axis=2) <= _STRAIGHT * length).all(axis=1)


def _element_of(kind: CellType) -> Any:
    import skfem.element

    found = getattr(skfem.element, kind.element, None)
    if found:
        return found()
    from . import extra_elements

    return getattr(extra_elements, kind.element)(kind.name)


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
        return product_rule(line, line)
    if shape == "HEXA":
        return product_rule(product_rule(line, line), line)
    triangle = _collapsed(line, _line(n, 1))
    if shape == "TRIA":
        return triangle
    if shape == "PENTA":
        return product_rule(triangle, line)
    if shape == "TETRA":
        return _collapsed(triangle, _line(n, 2))
    return conical_rule(n, n)


def _line(n: int, power: int) -> Rule:
    """Gauss–Jacobi on [0, 1] for the weight (1 − t)^power."""
    if power == 0:
        x, w = np.polynomial.legendre.leggauss(n)
    else:
        from scipy.special import roots_jacobi

        x, w = roots_jacobi(n, power, 0)
    return ((x + 1) / 2)[:, None], w / 2 ** (power + 1)


def product_rule(first: Rule, second: Rule) -> Rule:
    """The product of two rules, the first one fastest."""
    (p, v), (q, w) = first, second
    points = np.hstack([np.tile(p, (len(q), 1)), np.repeat(q, len(p), axis=0)])
    return points, np.outer(w, v).ravel()


def _collapsed(base: Rule, axis: Rule) -> Rule:
    """The product, its base shrunk towards the top of the axis."""
    points, weights = product_rule(base, axis)
    points[:, :-1] *= 1 - points[:, -1:]
    return points, weights


def conical_rule(base: int, axis: int) -> Rule:
    """A pyramid: `base` points each way over the square [−1, 1]², `axis` points to the apex."""
    line = _line(base, 0)
    points, weights = product_rule(line, line)
    return _collapsed((2 * points - 1, 4 * weights), _line(axis, 2))


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

    From degree 5 on, the tetrahedron rules of scikit-fem 12.0.2 are labelled one degree too high:
    the next one is exact. Raises ValueError for tetrahedra above degree 8.
    """
    if dim == 3 and degree > 8:
        raise ValueError(f"no exact tetrahedron rule of degree {degree}")
    label = degree + (dim == 3 and degree > 4)
    points, weights = get_quadrature((RefLine, RefTri, RefTet)[dim - 1], max(label, 1))
    return points.T.copy(), weights.copy()
