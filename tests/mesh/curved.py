"""Curved cells whose map and volume are known exactly, whatever order a tool gives their nodes.

Each cell is the image of the reference cell under one polynomial map that its shape functions can
reproduce. Any node of any tool's reference cell has its place by that map, so that a file needs
nothing of the project's own node orders; and the volume is the integral of a polynomial.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from math import factorial

import numpy as np
import sympy
from sympy.abc import x, y, z

from solver.lac.cells.catalogue import BY_NAME, CellType, Face

KINDS = [name for name, cell in BY_NAME.items() if cell.dim > 1]
# What the shape functions of the linear types hold beside the linear polynomials. Those of the
# pyramid hold a rational function more, which is left out.
_BILINEAR = {"QUAD": [x * y], "HEXA": [x * y, y * z, x * z, x * y * z], "PENTA": [x * z, y * z]}
_QUADRATIC = [x * x, y * y, z * z, x * y, y * z, x * z]


@dataclass(frozen=True)
class Curved:
    """The image of the reference cell of one type under a map of positive Jacobian."""

    cell: CellType

    @classmethod
    @cache
    def of(cls, name: str) -> "Curved":
        """The curved cell of a type, one for all that ask."""
        return cls(BY_NAME[name])

    @cached_property
    def expressions(self) -> list[sympy.Expr]:
        """The map, a polynomial with rational coefficients for each direction."""
        variables = [x, y, z][: self.cell.dim]
        terms = _QUADRATIC
        if self.cell.order == 1:
            terms = _BILINEAR.get(self.cell.name.rstrip("0123456789"), [])
        terms = [term for term in terms if term.free_symbols <= set(variables)]
        draw = np.random.default_rng(7).integers(-100, 101, (3, len(terms) + 3))
        rational = [[sympy.Rational(int(n), 1200) for n in row] for row in draw]
        return [
            own + sum(c * term for c, term in zip(row, [*variables, *terms], strict=False))
            for own, row in zip(variables, rational, strict=False)
        ]

    def places(self, reference: np.ndarray) -> np.ndarray:
        """Where the map puts points (n, dim) of the catalogue's reference cell: (n, 3)."""
        columns = [*np.asarray(reference, float).T, 0, 0]
        found = np.zeros((len(reference), 3))
        for axis, value in enumerate(self._functions(*columns[:3])):
            found[:, axis] = value
        return found

    @cached_property
    def _functions(self) -> Callable:
        return sympy.lambdify((x, y, z), self.expressions)

    @cached_property
    def volume(self) -> float:
        """Volume, or area, exact but for its last rounding."""
        variables = [x, y, z][: self.cell.dim]
        jacobian = sympy.Matrix(self.expressions).jacobian(variables).det()
        shape = self.cell.name.rstrip("0123456789")
        terms = sympy.Poly(jacobian, *variables).terms()
        return float(sum(factor * _monomial(shape, *powers) for powers, factor in terms))

    def face_places(self, face: Face, reference: np.ndarray) -> np.ndarray:
        """Where points (n, dim - 1) of the reference cell of a face's type lie: (n, 3)."""
        kind = BY_NAME[face.type]
        corners = self.cell.nodes[list(face.nodes[: kind.n_vertices])]
        # Faces of a reference cell are flat, and parallelograms where they have four corners.
        return self.places(affine(kind.nodes[: kind.n_vertices], corners, reference))


def affine(known: np.ndarray, images: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Images (n, k) of points (n, dim) under the affine map that takes `known` to `images`."""
    with_one = np.c_[known, np.ones(len(known))]
    found = np.linalg.lstsq(with_one, images, rcond=None)[0]
    np.testing.assert_allclose(with_one @ found, images, atol=1e-12)
    return np.c_[points, np.ones(len(points))] @ found


def ours(name: str, theirs: np.ndarray) -> np.ndarray:
    """A tool's reference nodes (n, dim), vertices first as ours, in our reference cell."""
    vertices = BY_NAME[name].nodes[: BY_NAME[name].n_vertices]
    return affine(theirs[: len(vertices)], vertices, theirs)


def inner_points(cell: CellType, count: int = 12) -> np.ndarray:
    """Random points (count, dim) within the reference cell: means of its vertices."""
    weights = np.random.default_rng(3).dirichlet(np.ones(cell.n_vertices), count)
    return weights @ cell.nodes[: cell.n_vertices]


def _monomial(shape: str, a: int, b: int, c: int = 0) -> sympy.Rational:
    """The integral of x^a y^b z^c over a reference cell."""
    if shape in ("QUAD", "HEXA"):
        return sympy.Rational(1, (a + 1) * (b + 1) * (c + 1))
    if shape == "TRIA":
        return sympy.Rational(factorial(a) * factorial(b), factorial(a + b + 2))
    if shape == "PENTA":
        return _monomial("TRIA", a, b) / (c + 1)
    if shape == "TETRA":
        return sympy.Rational(factorial(a) * factorial(b) * factorial(c), factorial(a + b + c + 3))
    if a % 2 or b % 2:
        return sympy.Integer(0)
    # At height z the pyramid is the square of half side 1 − z.
    base = sympy.Rational(4, (a + 1) * (b + 1))
    return base * sympy.beta(c + 1, a + b + 3).rewrite(sympy.gamma)
