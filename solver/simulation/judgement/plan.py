"""The plan of a solve: what is left out and why, and what is certain of its state.

Some lines are decided by the scene before the solve, others noted after it. They are read in the
result file and in the report; `docs/plan.md` describes all of them, with the time saved.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from ...lac.cut import needs_cut
from ...lac.operator import MIN_COVERAGE
from ..equilibrium.problem import ContactProblem
from ..equilibrium.state import Equilibrium
from ..options import Options
from ..results.solution import Line, Solution
from ..scene.bodies import body_names, coincident
from ..scene.scene import Scene, ZoneScene

# An estimated error below this is rounding.
_ROUNDING = 1e-10


def decided(problem: ContactProblem) -> Iterator[Line]:
    """The lines that the scene alone decides, before the solve, in the order of the work."""
    scene = problem.scene
    if scene.options.shortcuts == Options.everything().shortcuts:
        yield Line("everything is done", "as asked for by --everything, needed or not")
    groups, cells = scene.given.unnamed
    if groups or cells:
        many = "s" * (groups != 1)
        what = f"left behind: {groups} group{many}, {cells} faces and edges of the mesh"
        yield Line(what, "the case does not name them")
    yield from (Line(*part.note) for part in scene.parts if part.note)
    for (a, b), count in coincident(scene).items():
        names = body_names(scene)
        what = f"{count} nodes of {names[a]} and {names[b]} at the same places, and no zone there"
        yield Line(what, "bodies that share no nodes are apart: merge the nodes, or add a zone")
    yield from _cells(scene)
    for zone in scene.zones:
        yield from _zone(zone, scene, problem.constraints.inactive_multipliers)
    unloaded = np.flatnonzero(scene.rest.unloaded_bodies)
    if len(unloaded):
        names = body_names(scene)
        what = f"left out, at rest without pressure: {', '.join(names[b] for b in unloaded)}"
        yield Line(what, "no load, displacement imposed or overlap reaches them", "unloaded")
    fixed = np.flatnonzero(scene.rest.fixed_bodies)
    if len(fixed):
        names = body_names(scene)
        what = f"no stiffness of {', '.join(names[b] for b in fixed)}"
        yield Line(what, "supports or rigidity hold all of it where it is", "unloaded")
    if len(problem.parts) > 1:
        why = "no contact joins them"
        yield Line(f"{len(problem.parts)} groups of bodies solved apart", why)


def _cells(scene: Scene) -> Iterator[Line]:
    straight = [b.type.name for b in scene.blocks if b.type.name == "TETRA10" and b.straight]
    if straight:
        yield Line("plain Gauss rules in TETRA10 cells", "all edges are straight", "quadrature")


def _zone(zone: ZoneScene, scene: Scene, inactive: np.ndarray) -> Iterator[Line]:
    """The lines of one zone; `inactive` (k,): the multipliers that act on no free unknown."""
    name, operator = zone.zone.name, zone.operator
    if zone.zone.treatment != "lac":
        yield Line(f"{name}: treatment {zone.zone.treatment}", zone.treatment.what)
    kinds = sorted({block.type.name for block in zone.slave_faces})
    whole = [kind for kind in kinds if not needs_cut(kind)]
    if zone.treatment.cut and whole:
        yield Line(f"{name}: no cut", f"{', '.join(whole)} faces own an inner node")
    if operator.closed_faces:
        why = "some faces are no affine images of their reference face"
        why = why if scene.options.shortcuts.quadrature else "as asked for"
        yield Line(f"{name}: closure of {operator.closed_faces} face integrals", why)
    elif operator.plain:
        yield Line(f"{name}: plain Gauss rules", "every face is an affine image", "quadrature")
    surface = operator.surface
    bare = int((surface.covered <= MIN_COVERAGE * surface.area).sum())
    if bare:
        why = f"less than {MIN_COVERAGE:.0%} of their area lies under the master surface"
        yield Line(f"{name}: {bare} macro-elements out of contact", why)
    held = int(inactive[zone.numbers].sum())
    if held:
        why = "supports hold the nodes of both surfaces there"
        yield Line(f"{name}: {held} multipliers left out", why)


def plan_notes(
    problem: ContactProblem, states: Sequence[Equilibrium], steps: int = 0
) -> Iterator[Line]:
    """The lines of the solve: work that was not needed, and the linear solver.

    `steps`: how many there are on the path so far, where these are more than the `states`.
    """
    scene = problem.scene
    if scene.zones and len(states) > 1:
        why = "displacements are small: all load factors share them"
        yield Line("pairs and intersections found once", why)
    if scene.options.shortcuts.status and all(state.status.iterations == 1 for state in states):
        why = "the first status already fulfils p ≥ 0, ḡ ≥ 0, p ḡ = 0"
        yield Line("no second active-set solve", why, "status")
    different = {state.status.closed.tobytes() for state in states}
    if scene.options.shortcuts.status and len(different) < len(states):
        why = "the same multipliers are closed as at another load factor"
        yield Line("no new factor for each load factor", why, "status")
    if scene.case.frictional:
        yield from _friction(max(z.zone.friction for z in scene.zones), steps or len(states))
    yield Line(f"linear solver: {problem.linear_solver}", problem.why_solver)


def _friction(largest: float, steps: int) -> Iterator[Line]:
    """What is certain about a state with friction, and what is not."""
    path = "one step from rest" if steps == 1 else f"a path of {steps} steps from rest"
    yield Line(f"friction: {path}", "the state depends on the order and the size of the steps")
    from ...mechanics.mortar.coulomb import UNIQUE  # friction alone

    if largest > UNIQUE:
        what = f"friction: for a coefficient of {largest:g} other states may exist"
        yield Line(what, "of those found, most of the contact stays closed in this one")


def estimated(solution: Solution) -> Iterator[Line]:
    """The estimated error of constant pressures, by a reconstruction, and what is not recovered."""
    for given, zone in zip(solution.case.zones, solution.zones, strict=True):
        if given.recovery != "none" and zone.recovered is None and zone.closed.any():
            yield Line(f"{zone.name}: pressure not recovered", "no state settles under it")
        error = zone.relative_pressure_error
        if error is not None and error > _ROUNDING:
            what = f"{zone.name}: estimated error of the constant pressure {error:.1e} in L2"
            yield Line(what, "it differs so much from a reconstruction from neighbours")
        if zone.recovered and (left := int((zone.closed & (zone.recovered.degree == 0)).sum())):
            what = f"{zone.name}: pressure constant on {left} macro-elements"
            yield Line(what, "too few closed neighbours to recover it from")


def softness_notes(solution: Solution) -> Iterator[Line]:
    """A note where contact gives way to pressures that scatter."""
    for given, zone in zip(solution.case.zones, solution.zones, strict=True):
        if given.gives_way:
            largest = float(np.abs(zone.gap[zone.closed]).max(initial=0.0))
            what = f"{zone.name}: stabilised, average gaps of up to {largest:.1e} in contact"
            yield Line(
                what, "so far contact gives way to pressures that differ from their neighbours"
            )
