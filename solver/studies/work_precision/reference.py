"""A refined result in place of an exact solution: the fields of a fine mesh, anywhere in it.

For two rectangular blocks on a plane interface, of regular QUAD cells. Displacement and gradient
come from the cell around a point. The pressure of the LAC method is right in the mean over each
macro-element: a cubic spline through its integral is differentiated. This reference has the errors
of the fine mesh; wherever it is used, they are stated.
"""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...case.material import Material
from ...case.solutions.base import ElasticSolution, Part
from ...mechanics.fem import shape_functions
from ...mechanics.fem.small_matrices import invert
from ...mesh.catalogue import cell_type
from ...simulation.solution import Solution
from ...system.errors import InputError
from .description import Study


class _Grid:
    """The regular grid of one body: finds the cell around each point."""

    def __init__(self, solution: Solution, nodes: np.ndarray):
        [(self.type, self.cells)] = [
            (cell_type(block.type), chosen)
            for block in solution.mesh.cells
            if len(chosen := block.data[nodes[block.data].all(axis=1)])
        ]
        self.corners = solution.mesh.points[self.cells[:, :4]]
        self.lines = [np.unique(self.corners[..., i].min(axis=1)) for i in range(2)]
        self.number = np.empty([len(line) for line in self.lines], dtype=int)
        self.number[self._position(self.corners.mean(axis=1))] = np.arange(len(self.cells))
        if self.number.size != len(self.cells):
            raise ValueError("the reference needs a regular grid")
        self.displacement = solution.displacement[self.cells]

    def _position(self, x: np.ndarray) -> tuple[np.ndarray, ...]:
        """The place (n,) of the cell around each point along both axes; the nearest outside."""
        found = (np.searchsorted(self.lines[i], x[:, i], side="right") - 1 for i in range(2))
        return tuple(np.clip(p, 0, len(self.lines[i]) - 1) for i, p in enumerate(found))

    def evaluate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (n, 2) and its gradient (n, 2, 2) at points: the cells are affine."""
        cell = self.number[self._position(x)]
        corners, at = self.corners[cell], self.type.nodes[:4]
        centre, middle = corners.mean(axis=1), at.mean(axis=0)
        # The affine map that takes the reference corners to those of the cell.
        jacobian = np.einsum(
            "nci,cj->nij", corners - centre[:, None], np.linalg.pinv(at - middle).T
        )
        _, inverse = invert(jacobian)
        local = middle + np.einsum("nij,nj->ni", inverse, x - centre)
        values, slopes = shape_functions(self.type.name).both(local)
        nodal = self.displacement[cell]
        gradient = np.einsum("nai,naj,njk->nik", nodal, slopes, inverse, optimize=True)
        return np.einsum("na,nai->ni", values, nodal), gradient


class RefinedSolution(ElasticSolution):
    """A plane solve of two blocks on a regular mesh, taken for exact."""

    name: ClassVar[str] = "refined"
    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    dim = 2

    def __init__(self, solution: Solution):
        self.solution = solution
        [self.zone] = solution.zones
        self.interface = float(self.zone.centre[:, 1].mean())
        points, body = solution.mesh.points, solution.body
        self.grids: dict[int, _Grid] = {}
        for number in np.unique(body):
            nodes = body == number
            self.grids[self.body_part(points[nodes])] = _Grid(solution, nodes)

    @property
    def materials(self) -> tuple[Material, ...]:
        """Of the lower and the upper block."""
        given = self.solution.case.materials
        lower, upper = (given.get(part) or given["all"] for part in self.parts)
        return lower, upper

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height above the interface."""
        return x[:, 1] - self.interface

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Of the cell around each point."""
        return self._evaluate(x, part)[0]

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Of the cell around each point."""
        return self._evaluate(x, part)[1]

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The derivative of a spline through its integral at the ends of macro-elements."""
        return self._pressure(x[:, 0])

    @cached_property
    def _pressure(self) -> Callable[[np.ndarray], np.ndarray]:
        from scipy.interpolate import CubicSpline

        order = np.argsort(self.zone.centre[:, 0])
        length, force = self.zone.area[order], (self.zone.area * self.zone.multiplier)[order]
        start = self.zone.centre[order[0], 0] - length[0] / 2
        ends = start + np.concatenate([[0.0], np.cumsum(length)])
        return CubicSpline(ends, np.concatenate([[0.0], np.cumsum(force)])).derivative()

    def _evaluate(self, x: np.ndarray, part: Part) -> tuple[np.ndarray, np.ndarray]:
        part = self.part_of(x, part)
        displacement, gradient = np.empty_like(x), np.empty((len(x), 2, 2))
        for number, grid in self.grids.items():
            here = part == number
            displacement[here], gradient[here] = grid.evaluate(x[here])
        return displacement, gradient


def read_reference(path: Path) -> RefinedSolution:
    """The reference in a result file; InputError for another kind of file."""
    from ...verification.results import read_result

    return RefinedSolution(read_result(path).solution)


def write_reference(study: Study, problem: str, output: Path) -> None:
    """Solve a problem on its refined mesh, by the first treatment of the study, and write it.

    Raises InputError for a problem that has none, SolveError where it cannot be solved.
    """
    from ...simulation.simulate import simulate
    from ...system.provenance import gather
    from ...verification.results import write_result
    from ...verification.run import mesh_of

    point = next((p for p in study.points if p.problem.name == problem), None)
    if point is None or point.problem.reference is None:
        raise InputError(study.path, "problem", problem, "must be one that has a reference")
    case = point.reference_case(point.problem.reference)
    solution = simulate(case, mesh_of(case))
    write_result(output, solution, [], gather(case.path, None))
