"""Shape functions: one at their node, gradients, polynomials they must contain, quadrature."""

from itertools import product
from math import factorial, prod

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.shape import gauss_rule, shape_functions, simplex_rule
from solver.mechanics.fem.block import volume_rule

TYPES = list(BY_NAME)
VOLUME = {"SEG": 1, "TRIA": 1 / 2, "QUAD": 1, "TETRA": 1 / 6, "HEXA": 1, "PENTA": 1 / 2}
VOLUME["PYRA"] = 4 / 3


def shape_name(name: str) -> str:
    return name.rstrip("0123456789")


@pytest.mark.parametrize("name", TYPES)
def test_each_function_is_one_at_its_node_and_zero_at_the_others(name):
    kind = BY_NAME[name]
    # The functions of a pyramid have limits, but no values, at the apex.
    nodes = np.delete(np.arange(kind.n_nodes), 4 if name.startswith("PYRA") else [])
    values = shape_functions(name).values(kind.nodes[nodes])
    assert np.allclose(values, np.eye(kind.n_nodes)[nodes], atol=1e-14)


@pytest.mark.parametrize("name", TYPES)
def test_gradients_are_those_of_the_values(name):
    points, _ = volume_rule(name)
    shape, step = shape_functions(name), 1e-6
    for axis, direction in enumerate(np.eye(BY_NAME[name].dim)):
        prefetch, behind = (
            shape.values(points + step * direction),
            shape.values(points - step * direction),
        )
        slope = (prefetch - behind) / (2 * step)
        assert np.allclose(shape.gradients(points)[..., axis], slope, atol=1e-7)


@pytest.mark.parametrize("name", TYPES)
def test_polynomials_up_to_the_order_are_reproduced(name):
    kind = BY_NAME[name]
    points, _ = volume_rule(name)
    values = shape_functions(name).values(points)

    def basis(x):
        linear = [np.ones(len(x)), *x.T]
        if kind.order == 1:
            return np.stack(linear)
        return np.stack([a * b for a in linear for b in linear])

    assert np.allclose(values @ basis(kind.nodes).T, basis(points).T, atol=1e-13)


@pytest.mark.parametrize("name", TYPES)
def test_weights_sum_to_the_volume_of_the_reference_cell(name):
    _, weights = volume_rule(name)
    assert weights.sum() == pytest.approx(VOLUME[shape_name(name)], rel=1e-14)
    assert (weights > 0).all()


@pytest.mark.parametrize(("dim", "degree"), [(d, k) for d in (1, 2, 3) for k in range(1, 9)])
def test_simplex_rules_integrate_monomials(dim, degree):
    points, weights = simplex_rule(dim, degree)
    for powers in product(range(degree + 1), repeat=dim):
        if sum(powers) <= degree:
            exact = prod(map(factorial, powers)) / factorial(sum(powers) + dim)
            assert weights @ (points ** np.array(powers)).prod(axis=1) == pytest.approx(
                exact, rel=1e-12
            )


def test_tetrahedron_rules_of_higher_degrees_are_refused():
    with pytest.raises(ValueError, match="degree 9"):
        simplex_rule(3, 9)


def test_pyramid_rule_makes_the_integrals_of_rational_gradients_exact():
    """∫ ∂N/∂x dV over the pyramid equals ∫ N n_x dS over its faces, function by function."""
    from solver.mechanics.fem.faces import face_integrals

    for name in ("PYRA5", "PYRA13"):
        kind = BY_NAME[name]
        points, weights = volume_rule(name)
        inside = np.einsum("q,qai->ai", weights, shape_functions(name).gradients(points))
        outside = np.zeros_like(inside)
        for face in kind.faces:
            nodes = np.array([face.nodes])
            outside[list(face.nodes)] += face_integrals(kind.nodes, nodes, face.type)[0][0]
        assert np.allclose(inside, outside, atol=1e-14)


# Gauss rules integrate every monomial of their degree, on every cell type.


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
