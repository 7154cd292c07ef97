"""Materials and radii of the tests of exact solutions, and points of their parts."""

import numpy as np

from solver.case.material import Material
from solver.case.solutions.base import ElasticSolution
from solver.case.solutions.nested import NestedCylinders
from solver.case.solutions.polynomial import (
    Bending,
    Hydrostatic,
    Parabola2d,
    PolynomialPressure2d,
    UniformCompression,
)
from solver.case.solutions.waves import Waves2d

SOFT, HARD = Material(2000.0, 0.3), Material(70000.0, 0.2)
RADII = (20.0, 30.0, 40.0)
WAVE = {"amplitude": 0.01, "mean_pressure": 60.0}


def nested(cls, inner=SOFT, outer=HARD, pressure=25.0, interference=0.01, **more):
    given = {"pressure": pressure, "interference": interference} | more
    return cls(radii=RADII, inner=inner, outer=outer, **given)


def points_of(solution: ElasticSolution, part: int) -> np.ndarray:
    """Points (n, dim) inside a part."""
    random = np.random.default_rng(part)
    x = random.uniform(0.1, 0.9, (20, solution.dim))
    if isinstance(solution, NestedCylinders):
        low, high = RADII[part : part + 2]
        radius = random.uniform(low, high, (20, 1))
        x[:, : solution.around] *= radius / _radius(solution, x)
        return x
    if isinstance(solution, UniformCompression):
        x[:, -1] += 1.0 if part else -1.0
    if isinstance(solution, (Bending, Waves2d, PolynomialPressure2d)):
        x[:, -1] *= 1.0 if part else -1.0
    return x


def _radius(solution: NestedCylinders, x: np.ndarray) -> np.ndarray:
    return np.linalg.norm(x[:, : solution.around], axis=1, keepdims=True)


def interface_of(solution: ElasticSolution) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, dim) of the interface and its normals there, out of the first part."""
    x = np.random.default_rng(5).uniform(0.1, 0.9, (20, solution.dim))
    if isinstance(solution, NestedCylinders):
        normal = x / _radius(solution, x) * (np.arange(solution.dim) < solution.around)
        return RADII[1] * x / _radius(solution, x), normal
    if isinstance(solution, Hydrostatic):  # any surface will do
        return x, x / np.linalg.norm(x, axis=1, keepdims=True)
    x[:, -1] = getattr(solution, "interface", 0.0)
    sign = -1.0 if isinstance(solution, Parabola2d) else 1.0
    return x, np.tile(sign * np.eye(solution.dim)[-1], (len(x), 1))
