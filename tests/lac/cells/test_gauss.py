"""Gauss rules integrate every monomial of their degree, on every cell type."""

from itertools import product
from math import factorial

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.shape import gauss_rule


def integral(shape: str, powers: tuple[int, ...]) -> float:
    """∫ x^i y^j z^k over the reference cell, in closed form."""
    if shape in ("TRIA", "TETRA"):
        top = np.prod([factorial(p) for p in powers])
        return float(top / factorial(sum(powers) + len(powers)))
    if shape == "PENTA":
        return integral("TRIA", powers[:2]) / (powers[2] + 1)
    if shape == "PYRA":  # ∫ z^k (1 − z)^(i+j+2) dz times ∫∫ over [−1, 1]²
        i, j, k = powers
        if i % 2 or j % 2:
            return 0.0
        m = i + j + 2
        return 4 / (i + 1) / (j + 1) * factorial(k) * factorial(m) / factorial(k + m + 1)
    return float(np.prod([1 / (p + 1) for p in powers]))


@pytest.mark.parametrize(
    "name", ["SEG3", "TRIA6", "QUAD8", "TETRA10", "HEXA27", "PENTA15", "PYRA13"]
)
@pytest.mark.parametrize("n", [1, 2, 4, 6])
def test_exact_to_the_degree(name, n):
    points, weights = gauss_rule(name, n)
    dim = BY_NAME[name].dim
    assert points.shape == (len(weights), dim)
    assert (weights > 0).all()
    shape = name.rstrip("0123456789")
    for powers in product(range(2 * n), repeat=dim):
        if sum(powers) <= 2 * n - 1:
            found = weights @ np.prod(points ** np.array(powers), axis=1)
            assert found == pytest.approx(integral(shape, powers), rel=1e-12, abs=1e-14)
