"""Digits that are left: a point solved with all safeguards and with none, against its exact state.

Errors are relative to the pressure, or, for the gap, to the size of the model. A point holds when
its pressure and stress are within 1e-10, or twenty times their floor where that is more. Beyond the
end of a sweep it holds as well when it is refused or fails with a reason, or when its own estimate
of its accuracy bounds its errors: there it must only know what it does not know.

The floor: the error of the exact answer by rounding alone, before anything is solved.

The exact displacement at the nodes of the exact geometry is rounded to double precision in the form
in which the solver keeps it, as rigid motions plus a remainder (one number for each unknown; the
second part of the solver's remainder goes below this floor) and, in mixed form, a mean stress, and
read on the mesh of the stored coordinates by the solver's own recovery: the pressure from the
residual at each macro-element's own unknown, the stress at the nodes. Sums are in extended
precision, so that the rounding of displacements and coordinates alone is seen.

Rounded to nearest, nodes at one height have one and the same error, and the strain between them
none: luck of a mesh along the axes. So the floor is the largest of several roundings, to nearest
and up or down at random, all of which are off by less than one unit in the last place.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import meshio
import numpy as np
from scipy import sparse

from ..case.material import Material
from ..case.model import Case
from ..lac.errors import SolveError
from ..mechanics.fem.elasticity import internal_force
from ..mechanics.fem.stress import nodal_stress
from ..mechanics.linear.condensation import CondensedSystem
from ..mesh import generate, transform
from ..simulation.equilibrium.accuracy import Accuracy
from ..simulation.equilibrium.problem import ContactProblem
from ..simulation.options import Options, Safeguards
from ..simulation.scene.parts.mixed import MixedForm
from ..simulation.scene.scene import Scene, build_scene, carried_over
from ..simulation.simulate import solve_problem
from ..system.errors import InputError
from ..system.progress import Clock
from ..verification.verdict import FAILED, PASSED, REFUSED, UNRELIABLE
from .points import Point

# The exact answer of a sweep's point, in extended precision: a uniform state in each body.

LOWER, UPPER = "bottom", "top"
# Steps of `transform:` that leave the corners of the blocks where they are.
_INSIDE = ("perturb", "renumber", "turn", "pick")


@dataclass(frozen=True)
class State:
    """Strain of the lower and the upper body (2, dim, dim), and where each has no displacement.

    `corner` (2, dim); `lowered` (dim,): by how much the upper body moves. `stress` (2, 6);
    `volumetric` (2,): its part λ div u.
    """

    pressure: float
    normal: np.ndarray
    strain: np.ndarray
    corner: np.ndarray
    lowered: np.ndarray
    stress: np.ndarray
    volumetric: np.ndarray

    def displacement(self, points: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """Displacement (n, dim) at points (n, dim); `upper` (n,): whether in the upper body."""
        body = upper.astype(int)
        moved = np.einsum("nij,nj->ni", self.strain[body], points - self.corner[body])
        return moved + body[:, None] * self.lowered

    def stress_at(self, upper: np.ndarray) -> np.ndarray:
        """Stress (n, 6) in the upper body where `upper` (n,), else in the lower one."""
        return self.stress[upper.astype(int)].astype(float)


def exact_state(case: Case, kind: str, mesh: meshio.Mesh) -> State:
    """The state of a case on the untransformed mesh (of a recipe) of its blocks."""
    corner, foot, head = _corners(case, mesh)
    up = head[0] - foot
    normal = up / np.sqrt((up * up).sum())
    dim = len(normal)
    values = [load.value for load in case.loads if load.kind == "pressure"]
    pressure = next(value for value in values if isinstance(value, float))
    materials = [case.materials.get(b) or case.materials["all"] for b in (LOWER, UPPER)]
    identity, along = np.eye(dim, dtype=np.longdouble), np.outer(normal, normal)
    strain = []
    for material in materials:
        lateral, axial = _strains(material, np.longdouble(pressure), dim, kind == "hydrostatic")
        strain.append(lateral * (identity - along) + axial * along)
    tensor = -pressure * (identity if kind == "hydrostatic" else along)
    stress = np.array([_six(tensor, material) for material in materials])
    opened = np.trace(np.array(strain), axis1=1, axis2=2)
    volumetric = np.array([_lame(material) for material in materials]) * opened
    gap = normal @ (head[1] - head[0])
    lowered = normal * (normal @ (strain[0] @ up) - gap)
    return State(pressure, normal, np.array(strain), corner, lowered, stress, volumetric)


def _corners(
    case: Case, mesh: meshio.Mesh
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Corners (2, dim) of both bodies, the lower one's foot, and the two that meet above it."""
    foot = mesh.points.min(axis=0)
    head = foot.copy()
    head[-1] = 0.0
    corners = meshio.Mesh(
        np.array([foot, head, head], dtype=np.longdouble),
        [("vertex", np.arange(3)[:, None])],
        cell_sets={LOWER: [np.array([0, 1])], UPPER: [np.array([2])]},
    )
    spec: Mapping[str, Any] = case.mesh.transform or {}
    outer = {key: value for key, value in spec.items() if key not in _INSIDE}
    foot, below, above = transform(corners, outer, str(case.path)).points
    return np.array([foot, above]), foot, (below, above)


def _strains(
    material: Material, pressure: np.longdouble, dim: int, hydrostatic: bool
) -> tuple[np.longdouble, np.longdouble]:
    """Lateral and axial strain; in two dimensions in plane strain."""
    young, poisson = np.longdouble(material.young), np.longdouble(material.poisson)
    if hydrostatic:
        strain = -pressure * (1 - 2 * poisson) / young * (1 + poisson if dim == 2 else 1)
        return strain, strain
    if dim == 2:
        young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
    return poisson * pressure / young, -pressure / young


def _lame(material: Material) -> np.longdouble:
    young, poisson = np.longdouble(material.young), np.longdouble(material.poisson)
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson))


def _six(tensor: np.ndarray, material: Material) -> np.ndarray:
    """A stress tensor (dim, dim) as six components; plane strain has one across the plane."""
    if len(tensor) == 3:
        return tensor[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    xx, yy, xy = tensor[0, 0], tensor[1, 1], tensor[0, 1]
    zz = material.poisson * (xx + yy)
    return np.array([xx, yy, zz, xy, 0, 0], dtype=np.longdouble)


_RANDOM_ROUNDINGS = 3


def floor(
    problem: ContactProblem, raw: meshio.Mesh, mesh: meshio.Mesh, state: State
) -> tuple[float, float]:
    """Relative errors of pressure and stress that rounding alone causes.

    `raw` is the case's mesh before its transform, `mesh` the one that was solved by `problem`.
    """
    scene, system = problem.scene, problem.system
    assert system is not None, "nothing has been solved"
    points = scene.points + scene.coordinates.origin.astype(np.longdouble)
    points += carried_over(scene, mesh, misplaced(scene.case, raw, mesh))
    upper = upper_nodes(scene)
    exact = state.displacement(points, upper).ravel()
    means = [part.mean for part in scene.parts if isinstance(part, MixedForm)]
    held = state.volumetric[upper.astype(int)].astype(float)
    mixed = [(mean, mean.holding(held)) for mean in means]
    motions, fit = problem.at_rest.motions, problem.at_rest.fit
    amount = fit @ exact.astype(float)
    remainder = (exact - motions.astype(np.longdouble) @ amount).reshape(scene.points.shape)
    found = []
    for deformation in _roundings(remainder):
        internal = internal_force(scene.points, scene.blocks, deformation, extended=True)
        internal += sum(mean.force(values) for mean, values in mixed)
        left = scene.free.basis.T @ (scene.loads.force - internal).astype(float).ravel()
        pressure = system.multiplier(left)
        stress = nodal_stress(scene.points, scene.blocks, deformation, extended=True)
        stress += sum(mean.nodal_stress(values, scene.blocks) for mean, values in mixed)
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
    if not case.mesh.transform:
        return np.zeros_like(mesh.points)
    points = raw.points.astype(np.longdouble)
    exact = meshio.Mesh(points, raw.cells, cell_sets=raw.cell_sets, point_sets=raw.point_sets)
    return (transform(exact, case.mesh.transform, str(case.path)).points - mesh.points).astype(
        float
    )


Record = dict[str, Any]
GOAL, FLOORS = 1e-10, 20.0
"""A point must reach the first, or this many times its floor."""
SMALL = 1500
"""Unknowns up to which all eigenvalues of the system are found."""


@lru_cache(maxsize=8)
def _generated(recipe: str, where: str) -> meshio.Mesh:
    """The mesh of a recipe (as JSON), made once."""
    return generate(json.loads(recipe), where)


def measure(point: Point) -> Record:
    """Floor, measures with all safeguards and with none (`uncured`), whether the point holds."""
    cured = _attempt(point, Safeguards())
    holds = is_within(cured) or (point.is_beyond and knows_itself(cured))
    record = cured | {"beyond": point.is_beyond, "holds": holds}
    return record | {"uncured": _attempt(point, Safeguards.none())}


def is_within(measured: Record) -> bool:
    """Whether pressure and stress are as accurate as their floors allow."""
    return measured["word"] in (PASSED, UNRELIABLE) and all(
        measured[name] <= max(GOAL, FLOORS * measured[f"floor_{name}"])
        for name in ("pressure", "stress")
    )


def knows_itself(measured: Record) -> bool:
    """Whether the point is refused or fails, or its estimate bounds its errors."""
    if measured["word"] in (REFUSED, FAILED):
        return True
    return bool(max(measured["pressure"], measured["stress"]) <= measured["attainable"])


def _attempt(point: Point, safeguards: Safeguards) -> Record:
    """The measures of the point, or the reason why they are missing."""
    try:
        return _measured(point, safeguards)
    except InputError as error:
        return {"word": REFUSED, "reason": f"{error.key}: {error.problem}"}
    except SolveError as error:
        return {"word": FAILED, "reason": str(error)}


def _measured(point: Point, safeguards: Safeguards) -> Record:
    case = point.case
    raw = _generated(json.dumps(case.mesh.source), str(case.path))
    mesh = transform(raw, case.mesh.transform, str(case.path)) if case.mesh.transform else raw
    state = exact_state(case, point.group.state, raw)
    clock = Clock()
    scene = build_scene(case, mesh, Options(safeguards=safeguards), clock)
    problem = ContactProblem(scene)
    solution = solve_problem(problem, clock)
    zones, balance = solution.zones, solution.quality.balance
    # Of rounding alone: a sweep's points may have strains that no real body has.
    accuracy = Accuracy(solution.quality.accuracy)
    measures: Record = {
        "word": UNRELIABLE if accuracy.reason else PASSED,
        "reason": accuracy.reason,
        "pressure": max(np.abs(z.multiplier / state.pressure - 1).max() for z in zones),
        "stress": stress_error(solution.stress, scene, state),
        "gap": max(np.abs(z.gap).max() for z in zones) / scene.coordinates.length,
        "force": max(v for k, v in balance.items() if k.endswith("force")),
        "moment": max(v for k, v in balance.items() if k.endswith("moment")),
        "residual": solution.steps[-1].residual,
        "iterations": solution.cost.iterations,
        "dofs": solution.cost.dofs,
        "attainable": accuracy.estimate,
    }
    if safeguards == Safeguards():
        measures |= _known(problem, raw, mesh, state)
    return measures


def _known(problem: ContactProblem, raw: meshio.Mesh, mesh: meshio.Mesh, state: State) -> Record:
    """The floors of the exact answer, and properties of the system that is solved."""
    pressure, stress = floor(problem, raw, mesh, state)
    known: Record = {"floor_pressure": pressure, "floor_stress": stress}
    system = problem.system
    if isinstance(system, CondensedSystem) and problem.scene.points.shape[1] == 2:
        known |= _spectrum(system, problem.matrix)
    return known


def _spectrum(system: CondensedSystem, stiffness: sparse.csr_matrix) -> Record:
    """Condition number and inertia of the condensed system, scaled to a diagonal of one.

    By all its eigenvalues where it is small, in full precision; else the inertia alone, which is
    known from the factor: Cholesky's succeeds only where all eigenvalues are positive.
    """
    expansion = system.expansion
    matrix = (expansion.T @ stiffness @ expansion).tocsr()
    size = matrix.shape[0]
    if size > SMALL:
        return {"condition": None, "inertia": [size, 0, 0], "inertia_by": "factor"}
    scale = sparse.diags(1 / np.sqrt(matrix.diagonal()))
    values = np.linalg.eigvalsh((scale @ matrix @ scale).toarray())
    least = size * np.finfo(float).eps * np.abs(values).max()
    inertia = [int((values > least).sum()), int((values < -least).sum())]
    return {
        "condition": float(np.abs(values).max() / np.abs(values).min()),
        "inertia": [*inertia, size - sum(inertia)],
        "inertia_by": "eigenvalues",
    }
