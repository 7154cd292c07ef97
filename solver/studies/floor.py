"""The floor: the error of the exact answer by rounding alone, before anything is solved.

The exact displacement at the nodes of the exact geometry is rounded to double precision in the
form in which the solver keeps it, as rigid motions plus a remainder (one number for each unknown;
the second part of the solver's remainder goes below this floor) and, in mixed form, a mean stress,
and read on the mesh of the stored
coordinates by the solver's own recovery: the pressure from the residual at each macro-element's own
unknown, the stress at the nodes. Sums are in extended precision, so that the rounding of
displacements and coordinates alone is seen.

Rounded to nearest, nodes at one height have one and the same error, and the strain between them
none: luck of a mesh along the axes. So the floor is the largest of several roundings, to nearest
and up or down at random, all of which are off by less than one unit in the last place.
"""

from collections.abc import Iterator

import meshio
import numpy as np

from ..case.model import Case
from ..mechanics.fem.elasticity import internal_force
from ..mechanics.fem.nodal_stress import nodal_stress
from ..mesh import transform
from ..simulation.equilibrium.problem import ContactProblem
from ..simulation.scene.scene import Scene, carried_over
from .states import UPPER, State

_RANDOM_ROUNDINGS = 3


def floor(
    problem: ContactProblem, raw: meshio.Mesh, mesh: meshio.Mesh, state: State
) -> tuple[float, float]:
    """Relative errors of pressure and stress that rounding alone causes.

    `raw` is the case's mesh before its transform, `mesh` the one that was solved by `problem`.
    """
    scene, system = problem.scene, problem.system
    assert system is not None, "nothing has been solved"
    points = scene.points + scene.origin.astype(np.longdouble)
    points += carried_over(scene, mesh, misplaced(scene.case, raw, mesh))
    upper = upper_nodes(scene)
    exact = state.displacement(points, upper).ravel()
    mean_stress = scene.mean.holding(state.volumetric[upper.astype(int)].astype(float))
    motions, fit = problem.at_rest.motions, problem.at_rest.fit
    amount = fit @ exact.astype(float)
    remainder = (exact - motions.astype(np.longdouble) @ amount).reshape(scene.points.shape)
    found = []
    for deformation in _roundings(remainder):
        internal = internal_force(scene.points, scene.blocks, deformation, extended=True)
        internal += scene.mean.force(mean_stress)
        left = scene.free.basis.T @ (scene.force - internal).astype(float).ravel()
        pressure = system.multiplier(left)
        stress = nodal_stress(scene.points, scene.blocks, deformation, extended=True)
        stress += scene.mean.nodal_stress(mean_stress, scene.blocks)
        error = float(np.abs(pressure / state.pressure - 1).max(initial=0.0))
        found.append((error, stress_error(stress, scene, state)))
    highest = np.max(found, axis=0)
    return float(highest[0]), float(highest[1])


def _roundings(values: np.ndarray) -> Iterator[np.ndarray]:
    """The values to nearest, then up or down at random."""
    nearest = values.astype(float)
    yield nearest
    towards = np.where(values > nearest, np.inf, -np.inf)
    other = np.where(values == nearest, nearest, np.nextafter(nearest, towards))
    for seed in range(_RANDOM_ROUNDINGS):
        yield np.where(np.random.default_rng(seed).random(values.shape) < 0.5, nearest, other)


def stress_error(stress: np.ndarray, scene: Scene, state: State) -> float:
    """The largest deviation of a component of the nodal stress (n, 6), relative to the pressure."""
    deviation = np.abs(stress - state.stress_at(upper_nodes(scene)))
    return float(deviation.max() / state.pressure)


def upper_nodes(scene: Scene) -> np.ndarray:
    """Whether nodes (n,) of the cut mesh belong to the upper body."""
    upper = np.zeros(len(scene.points), dtype=bool)
    for name, cells in scene.mesh.cells.items():
        upper[cells[scene.mesh.members(name, scene.given.groups[UPPER])].ravel()] = True
    return upper


def misplaced(case: Case, raw: meshio.Mesh, mesh: meshio.Mesh) -> np.ndarray:
    """How far (n, dim) the nodes as stored lie from where their transform puts them exactly."""
    if not case.transform:
        return np.zeros_like(mesh.points)
    points = raw.points.astype(np.longdouble)
    exact = meshio.Mesh(points, raw.cells, cell_sets=raw.cell_sets, point_sets=raw.point_sets)
    return (transform(exact, case.transform, str(case.path)).points - mesh.points).astype(float)
