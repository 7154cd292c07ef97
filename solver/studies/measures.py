"""What is measured at a point, by name: each function solves it and returns a part of its record.

    solve       errors against the exact solution, unknowns, the slave's cells
    timed       the same, and times of repeated solves in one process after a first one
    process     cost of `mesh` and `solve` as a user starts them, each a process
    digits      round-off against an exact uniform state; see `digits`
    inf_sup     the inf-sup constant of the mesh
    profile     the contact pressure along the interface
    quantities  results of a solve with what is known of them exactly

`timed` and `process` need the machine for themselves: `run` gives each a process of its own.

The numerical inf-sup test: is the multiplier controlled by the displacement under refinement?

β_h² is the smallest eigenvalue of B (K + M/L²)⁻¹ Bᵀ q = β² D q, with B the gap operator, K and M
stiffness (E = 1) and mass (ρ = 1), L the length of the model and D = diag(h_T |T|) over the
macro-elements T. It must level off above zero as the mesh is refined; the patch test cannot see it.
Sources: Chapelle, Bathe, The inf-sup test, Comput. Struct. 47 (1993) 537–545; El-Abbasi, Bathe,
Comput. Struct. 79 (2001) 1473–1486.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy import sparse

from ..case.model import Case
from ..lac.cells.shape import shape_functions
from ..lac.errors import SolveError
from ..mechanics.fem.block import Block, CellSum
from ..mechanics.fem.elasticity import physical_gradients, stiffness
from ..mechanics.linear.factor import factorise
from ..simulation.equilibrium.problem import ContactProblem
from ..simulation.options import Options, Safeguards, Shortcuts
from ..simulation.results.solution import Solution
from ..simulation.scene.scene import Scene, build_scene
from ..simulation.simulate import simulate
from ..system.errors import InputError
from ..system.package import COMMAND
from ..system.process import available, run_in_subprocess, used_since
from ..system.progress import SOLVING, Clock
from ..verification.norms import errors
from ..verification.run import mesh_of
from ..verification.stored import read_verdict
from ..verification.verdict import CRASHED, REFUSED
from . import digits
from .description import Run
from .points import Point
from .quantities import quantities
from .timing import TOTAL, ended, repeated, run_compiled


def inf_sup_constant(scene: Scene) -> float:
    """β_h of a scene whose material has a Young's modulus of one, over all its zones.

    Raises SolveError where the system is singular.
    """
    basis = scene.free.basis
    energy = stiffness(scene.points, scene.blocks)
    energy = sum((part.stiffness for part in scene.parts if part.stiffness is not None), energy)
    energy = energy + mass(scene.points, scene.blocks) / scene.coordinates.length**2
    gaps = sparse.vstack([zone.operator.matrix for zone in scene.zones]) @ basis
    area = np.concatenate([zone.operator.area for zone in scene.zones])
    size = area if scene.points.shape[1] == 2 else np.sqrt(area)
    weight = 1 / np.sqrt(size * area)
    scaled = (sparse.diags(weight) @ gaps).tocsr()
    # For as many right-hand sides as macro-elements double precision is quicker.
    with factorise(scene.free.reduced(energy.tocsr())) as factor:
        response = factor.solve(scaled.T.toarray())
    # Round-off may put an eigenvalue of zero below it.
    return float(np.sqrt(max(np.linalg.eigvalsh(scaled @ response)[0], 0.0)))


def mass(points: np.ndarray, blocks: list[Block]) -> sparse.bsr_matrix:
    """The consistent mass matrix (n_dofs, n_dofs) of unit density."""
    n, dim = points.shape
    total = CellSum([block.cells for block in blocks], n, dim)
    for block in blocks:
        reference, weights = block.rule
        values = shape_functions(block.type.name).values(reference)
        _, determinant = physical_gradients(points, block.cells, block.type, reference)
        scalar = np.einsum("cq,q,qa,qb->cab", determinant, weights, values, values, optimize=True)
        local = np.einsum("cab,ij->caibj", scalar, np.eye(dim))
        total.add(block.cells, local.__getitem__)
    return total.matrix


Record = dict[str, Any]
# The share of the machine's free memory that a process may take: the rest is for other programs.
_SHARE = 0.9
_FROM_VERDICT = (
    *("dofs", "macro_elements", "matrix_entries", "iterations", "linear_iterations"),
    *("linear_solver", "seconds", "stage_cpu_seconds", "errors"),
)


def options_of(run: Run) -> Options:
    """The options of a solve."""
    return Options(
        Shortcuts.none() if run.everything else Shortcuts(),
        Safeguards() if run.cures else Safeguards.none(),
        run.solver,
    )


def solve(point: Point) -> Record:
    """Errors against the exact solution, and what was solved."""
    mesh = mesh_of(point.case)
    solution = simulate(point.case, mesh, options_of(point.run))
    return _solved(solution)


def _solved(solution: Solution) -> Record:
    slaves = [body for body in solution.bodies if body.role in ("slave", "both")]
    return {
        "dim": solution.mesh.points.shape[1],
        "dofs": solution.cost.dofs,
        "macro_elements": solution.cost.macro_elements,
        "iterations": solution.cost.iterations,
        "linear_solver": solution.cost.linear_solver,
        "linear_iterations": solution.cost.linear_iterations,
        "errors": errors(solution),
        "pressure_error_estimate": solution.pressure_error_estimate,
        "slave": list(dict.fromkeys(cells for body in slaves for cells in body.cells)),
    }


def timed(point: Point, repetitions: int, started: float) -> Record:
    """A first solve with start-up and meshing, then the times of repetitions."""
    case, options = point.case, options_of(point.run)
    mesh = mesh_of(case)

    def run(clock: Clock) -> Solution:
        return simulate(case, mesh, options, clock)

    solution = run(Clock())
    process = used_since(started)
    times = repeated(run, repetitions)
    order = dict.fromkeys(stage for stage in (*SOLVING, *times, TOTAL) if stage in times)
    return _solved(solution) | {
        "process": process,
        "times": {stage: times[stage] for stage in order},
    }


def process(point: Point, cores: Sequence[int], limit: float) -> Record:
    """Cost of the processes `mesh` and `solve`, from a mesh file to a result file with all checks.

    A process in which Numba compiled functions is not measured, but the next one.
    """
    memory = _SHARE * available()
    with TemporaryDirectory() as place:
        folder = Path(place)
        case, mesh, verdict = folder / "case.yaml", folder / "mesh.vtkhdf", folder / "verdict.json"
        case.write_text(point.source, encoding="utf-8")
        meshed = run_in_subprocess(
            [*COMMAND, "mesh", str(case), "-o", str(mesh)], cores, limit, memory
        )
        if meshed.status != 0:
            return ended("failed", f"no mesh: {meshed.reason}")
        record: Record = {"meshing": meshed.used}
        if point.run.program:
            return record | _by_calculix(point.case, mesh, folder, cores, limit)
        command = [
            *COMMAND,
            "solve",
            str(case),
            "--mesh",
            str(mesh),
            "-o",
            str(folder / "r.vtkhdf"),
        ]
        command += ["--verdict", str(verdict)]
        done = run_compiled(lambda: command, cores, limit, memory)
        record["process"] = done.used
        if not verdict.is_file():
            return record | ended("failed" if done.status is None else "crashed", done.reason)
        content = read_verdict(verdict)
    if content.cost.dofs is None:
        word = content.verdict if content.verdict in (REFUSED, CRASHED) else "failed"
        return record | ended(word, content.reason.removeprefix(f"{case}: "))
    plain = content.plain()
    record |= {key: plain[key] for key in _FROM_VERDICT}
    faces = sum(body.faces for body in content.problem.bodies)
    return record | {"verdict": content.verdict, "reason": content.reason, "faces": faces}


def _by_calculix(
    case: Case, mesh: Path, folder: Path, cores: Sequence[int], limit: float
) -> Record:
    """The same problem on the same mesh by CalculiX, where it is installed."""
    from ..codes.calculix import CalculiX
    from ..codes.deck import deck_of
    from ..codes.run import CrashError, Limits, run_code
    from ..mesh import read_mesh

    code = CalculiX()
    if not code.version():
        return ended("missing", f"{code.name} is not installed")
    [pressure] = [load.value for load in case.loads if isinstance(load.value, float)]
    deck = deck_of(case, read_mesh(mesh), code.layer, code.follows)
    try:
        found = run_code(code, deck, folder, Limits(limit, float("inf"), list(cores)))
    except (SolveError, CrashError) as error:
        return ended("failed", f"CalculiX: {error}")
    if found.pressure is None or found.pressure.nodes is None:
        return ended("failed", "CalculiX: no contact pressure in its output")
    # The field covers all nodes, with zero where no contact is defined.
    slave = np.concatenate([b.nodes.ravel() for pair in deck.pairs for b in pair.slave])
    pressures = found.pressure.values[np.isin(found.pressure.nodes, slave)]
    used = {"wall": found.seconds, "cpu": found.cpu_seconds, "peak_memory_mb": found.peak_memory_mb}
    largest = float(np.abs(pressures / pressure - 1).max())
    return {"process": used, "linear_solver": "its own", "errors": {"pressure_max": largest}}


def inf_sup(point: Point) -> Record:
    """The inf-sup constant of a mesh: nothing is solved."""
    scene = build_scene(point.case, mesh_of(point.case))
    return {
        "constant": inf_sup_constant(scene),
        "macro_elements": sum(zone.count for zone in scene.zones),
        "dofs": scene.n_dofs,
    }


def profile(point: Point) -> Record:
    """The contact pressure of the first zone along x; `bilateral` contact holds tension too."""
    scene = build_scene(point.case, mesh_of(point.case))
    place = scene.zones[0].operator.surface.centre[:, 0] + scene.coordinates.origin[0]
    order = np.argsort(place)
    problem = ContactProblem(scene)
    closed = np.where(problem.constraints.closable, 0.0, np.nan)
    pressure = problem.solve(1.0, imposed=closed if point.run.bilateral else None).pressure
    return {"place": place[order].tolist(), "pressure": pressure[order].tolist()}


def results(point: Point) -> Record:
    """Quantities of a solve with what is known of them, and its estimated error of the pressure."""
    solution = simulate(point.case, mesh_of(point.case))
    return {
        "job": solution.job,
        "dofs": solution.cost.dofs,
        "quantities": [asdict(one) for one in quantities(solution)],
        "pressure_error_estimate": solution.pressure_error_estimate,
        "facet_depth": solution.quality.validity.facet_depth,
    }


IN_PROCESS: Mapping[str, Callable[[Point], Record]] = {
    "solve": solve,
    "digits": digits.measure,
    "inf_sup": inf_sup,
    "profile": profile,
    "quantities": results,
}


def attempt(work: Callable[[], Record]) -> Record:
    """The record of a measurement with its outcome: solved, or why it has none."""
    try:
        return ended("solved", "") | work()
    except InputError as error:
        return ended("refused", error.detail)
    except SolveError as error:
        return ended("failed", str(error))
