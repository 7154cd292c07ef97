"""The manufactured contact problems, derived symbolically, step by step."""

import numpy as np
import pytest
import sympy as sp

from solver.case.material import Material
from solver.case.solutions.polynomial import Parabola2d, Paraboloid3d

E, KAPPA, C = sp.symbols("E kappa c", positive=True)
HALF = sp.Rational(1, 2)
NUMBERS = {E: 3.0, KAPPA: 0.05, C: 0.01}


class Problem:
    """The chosen displacement, and all that follows from it."""

    def __init__(self, dim: int):
        self.x = sp.symbols("x y z")[:dim]
        self.height = self.x[-1]
        self.offset = [t - HALF for t in self.x[:-1]]
        square = sum(t**2 for t in self.offset)
        self.obstacle = -KAPPA * square
        sides = [-4 * KAPPA * self.height**3 * t for t in self.offset]
        normal = -KAPPA * square * (1 + self.height) - C * self.height
        self.u = sp.Matrix([*sides, normal])
        self.gradient = self.u.jacobian(self.x)
        self.stress = E * (self.gradient + self.gradient.T) / 2  # ν = 0: E times the strain

    def body_force(self) -> sp.Matrix:
        """−div σ."""
        rows = self.stress.tolist()
        return sp.Matrix(
            [-sum(sp.diff(s, x) for s, x in zip(row, self.x, strict=True)) for row in rows]
        )

    def on_face(self, expression: sp.Expr) -> sp.Expr:
        """On the contact face, of outward normal −e_n."""
        return sp.expand(expression.subs(self.height, 0))

    def values(self, expression, points: np.ndarray) -> np.ndarray:
        """Values (n, …) at points (n, dim)."""
        function = sp.lambdify(self.x, expression.subs(NUMBERS), "numpy")
        return np.array([np.array(function(*p), dtype=float) for p in points])


@pytest.fixture(params=[2, 3])
def problem(request) -> Problem:
    return Problem(request.param)


@pytest.fixture
def coded(problem):
    cls = {2: Parabola2d, 3: Paraboloid3d}[len(problem.x)]
    return cls(material=Material(NUMBERS[E], 0.0), curvature=NUMBERS[KAPPA], strain=NUMBERS[C])


@pytest.fixture
def points(problem) -> np.ndarray:
    return np.random.default_rng(1).uniform(0, 1, (30, len(problem.x)))


def test_the_face_lies_on_the_obstacle(problem):
    """Normal displacement = obstacle, so that the gap along the fixed normal is zero."""
    assert sp.simplify(problem.on_face(problem.u[-1]) - problem.obstacle) == 0


def test_the_face_presses(problem):
    """p = −σ_nn = E (c + κ ρ²) > 0: closed everywhere, and the conditions of contact hold."""
    pressure = problem.on_face(-problem.stress[-1, -1])
    assert sp.simplify(pressure - E * (C - problem.obstacle)) == 0
    assert sp.expand(pressure).subs(dict.fromkeys(problem.x, HALF)) == E * C


def test_what_has_to_be_applied_along_the_face(problem):
    """Contact has no friction: t = σ·(−e_n) along the face is a load, E κ X_t."""
    for t, offset in enumerate(problem.offset):
        applied = problem.on_face(-problem.stress[t, -1])
        assert sp.simplify(applied - E * KAPPA * offset) == 0


def test_the_body_force(problem):
    force, height = problem.body_force(), problem.height
    for t, offset in enumerate(problem.offset):
        assert sp.expand(force[t] - E * KAPPA * offset * (12 * height + 1)) == 0
    sides = len(problem.offset)
    assert sp.expand(force[-1] - E * KAPPA * sides * (6 * height**2 + height + 1)) == 0


def test_the_plane_problem_is_the_published_one():
    """u_x = −0.2 y³ (x − ½), u_y = −0.05 (x − ½)² (1 + y) − 0.01 y, p = 0.01 + 0.05 (x − ½)²."""
    problem = Problem(2)
    x, y = problem.x
    numbers = {E: 1, KAPPA: sp.Rational(1, 20), C: sp.Rational(1, 100)}
    u = problem.u.subs(numbers)
    assert sp.expand(u[0] + y**3 * (x - HALF) / 5) == 0
    assert sp.expand(u[1] + (x - HALF) ** 2 * (1 + y) / 20 + y / 100) == 0
    pressure = problem.on_face(-problem.stress[1, 1]).subs(numbers)
    assert sp.expand(pressure - sp.Rational(1, 100) - (x - HALF) ** 2 / 20) == 0
    shear = problem.on_face(problem.stress[0, 1]).subs(numbers)
    assert sp.expand(shear + (x - HALF) / 20) == 0


def test_the_code_is_what_was_derived(problem, coded, points):
    dim = len(problem.x)
    pairs = {
        "displacement": list(problem.u),
        "gradient": problem.gradient.tolist(),
        "body_force": list(problem.body_force()),
    }
    for name, derived in pairs.items():
        expected = problem.values(sp.Matrix(derived), points).reshape(
            len(points), *[dim] * (2 if name == "gradient" else 1)
        )
        np.testing.assert_allclose(getattr(coded, name)(points), expected, atol=1e-15)
    tensor = problem.values(problem.stress, points)
    full = np.zeros((len(points), 3, 3))
    full[:, :dim, :dim] = tensor
    voigt = np.stack([full[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))])
    np.testing.assert_allclose(coded.stress(points), voigt.T, atol=1e-15)
    pressure = problem.values(sp.Matrix([problem.on_face(-problem.stress[-1, -1])]), points)
    np.testing.assert_allclose(coded.contact_pressure(points), pressure.ravel(), rtol=1e-14)
