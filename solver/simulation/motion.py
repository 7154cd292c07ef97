"""Steps along a path on which bodies move far: each is solved on the mesh where the bodies are.

The frames of a step follow what it imposes. It is solved on the mesh moved with them; a rigid
motion that is left of bodies that nothing holds is taken into their frames, and the step is solved
again until the frames stay. Slip is counted between the points that meet now, from where they were
at the end of the last step. Strains are small, and neglected in the geometry.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import meshio
import numpy as np

from ..case.acting import Step
from ..case.model import Case
from ..lac.cells.faces import FaceBlock, circumference
from ..lac.errors import SolveError
from ..system.errors import InputError
from ..system.progress import Clock, stage
from .equilibrium.problem import ContactProblem
from .equilibrium.recovery import Recovered, recovered
from .equilibrium.state import Equilibrium
from .finished import called, finished, tell
from .judgement.plan import decided, plan_notes
from .judgement.validity import validity
from .options import Options
from .results.fields import grid_fields
from .results.forces import RigidMotion
from .results.results import solution_of
from .results.solution import Line, Position, Solution, Validity
from .scene.bodies import body_names, check_geometry
from .scene.moved import Frames, Moved, predicted, rotation_vector, settled
from .scene.scene import CutModel, Scene, build_model, scene_of

_LOG = logging.getLogger(__name__)
# Frames stay where contact surfaces move by less than this share of a macro-element.
_STAY = 1e-3
# So often a step is solved at most.
_ROUNDS = 10
# What a moved scene knows its step as: its loads are those of one step.
_STEP: Step = {}


@dataclass(frozen=True)
class _Place:
    """A solved step: its groups where the bodies are, the problem there, and its state."""

    groups: Moved
    problem: ContactProblem
    state: Equilibrium
    field: Recovered
    rounds: int

    @property
    def displacement(self) -> np.ndarray:
        """The whole displacement (n, dim) from the mesh as given."""
        return self.groups.motion + self.state.displacement


def solve_moving(case: Case, mesh: meshio.Mesh, options: Options, clock: Clock) -> Solution:
    """Solve a case step by step, its bodies where each step brings them.

    Where a later step has no solution, those before it are kept. Raises InputError where the case
    and its mesh do not fit, SolveError where the first step has no solution.
    """
    model = build_model(case, mesh, options, clock)
    dim = model.groups.points.shape[1]
    frames, last, rounds = Frames.still(int(model.groups.body.max()) + 1, dim), None, 0
    found, ended = list[Solution](), ""
    for factor, step in zip(case.factors, case.steps, strict=True):
        try:
            place = _placed(model, step, frames, last, clock)
        except SolveError as error:
            ended = f"{called(step, factor)}: {error}"
            if not found:
                raise SolveError(ended) from None
            break
        tell(called(step, factor), place.state, place.problem.scene.n_multipliers)
        with stage(clock, "recovery"):
            found.append(_solution(place, factor, found, last))
        frames, last = place.groups.frames_of_bodies, place
        rounds = max(rounds, place.rounds)
    whole = _joined(case.until(len(found)), found)
    why = "pairs and intersections belong to the mesh where the bodies are"
    whole.plan.append(Line(f"bodies followed, up to {rounds} rounds a step", why))
    return finished(whole, clock, ended)


def _placed(
    model: CutModel, step: Step, frames: Frames, last: _Place | None, clock: Clock
) -> _Place:
    """A step solved where its bodies are; SolveError where it has no solution or no place."""
    rest, names = model.groups, None
    frames, held = predicted(rest, step, frames)
    for count in range(1, _ROUNDS + 1):
        groups = Moved(rest, model.contact_faces, step, frames)
        try:
            scene = scene_of(model, groups, clock)
            if last is None:
                check_geometry(scene)
            with stage(clock, "assembly"):
                carried = groups.motion - (0.0 if last is None else last.displacement)
                problem = ContactProblem(scene, carried.ravel() if scene.case.frictional else None)
        except InputError as error:
            if last is None:
                raise
            raise SolveError(f"{error.key}: {error.problem}") from None
        with stage(clock, "solve"):
            state, field = _solved(problem)
        if held.all():
            return _Place(groups, problem, state, field, count)
        following, _ = predicted(rest, step, settled(groups, state.displacement, held))
        moves = _moves(scene, groups.contact_faces, rest.points, frames, following)
        _LOG.info("round %d: frames move contact by %.1e of a face", count, moves.max())
        if moves.max() < _STAY:
            return _Place(groups, problem, state, field, count)
        frames, names = following, body_names(scene)
    name = (names or [""])[int(moves.argmax())]
    raise SolveError(f"{name} finds no place: contact still moves by {moves.max():.1e} of a face")


def _solved(problem: ContactProblem) -> tuple[Equilibrium, Recovered]:
    """The state of a problem, and its recovered pressure."""
    if problem.scene.case.frictional:
        from .equilibrium.friction_recovery import solve_and_recover  # friction alone

        return solve_and_recover(problem, _STEP, None)
    state = problem.solve(_STEP)
    if (state.trial.violation(state.iterate.closed) > 1).any():
        raise SolveError("contact bears tension or surfaces overlap")
    return recovered(problem, state, _STEP)


def _moves(
    scene: Scene, faces: list[FaceBlock], points: np.ndarray, old: Frames, new: Frames
) -> np.ndarray:
    """How far other frames move the contact surfaces of each body (b,), by the smallest face."""
    moved = np.linalg.norm(new.placed(points, scene.body) - old.placed(points, scene.body), axis=1)
    found, dim, sizes = np.zeros(scene.n_bodies), points.shape[1], [np.inf]
    for zone in scene.zones:
        surface = zone.operator.surface
        area = surface.area
        if scene.case.axisymmetric:
            area = area / circumference(surface.centre)
        sizes.append(float(area.min()) ** (1 / (dim - 1)))
    for block in faces:
        nodes = block.nodes.ravel()
        np.maximum.at(found, scene.body[nodes], moved[nodes])
    return found / min(sizes)


def _solution(
    place: _Place, factor: float, before: Sequence[Solution], last: _Place | None
) -> Solution:
    """The solution of one step, its motion and what slipped so far included."""
    problem, state, groups = place.problem, place.state, place.groups
    plan = [*decided(problem), *plan_notes(problem, [state])]
    found = solution_of(problem, [state], [place.field], plan)
    found.validity = validity(problem, [state])
    found.motion = groups.motion
    (step,) = found.steps
    step.factor = factor
    step.rigid = [_whole_motion(groups, rigid) for rigid in step.rigid]
    force, path = state.force + found.reaction, place.displacement
    if last is not None:
        force = force + last.state.force + before[-1].reaction
        path = path - last.displacement
        for zone, old in zip(found.zones, before[-1].zones, strict=True):
            if zone.friction and old.friction:
                turned = _turned(problem.scene, zone.name, old.friction.slip_total, groups, last)
                zone.friction.slip_total = zone.friction.slip + turned
    step.work = float((force * path).sum() / 2)
    for name, probe in found.probes.items():
        moved = place.displacement[problem.scene.probed[name]]
        found.probes[name] = replace(probe, displacement=moved)
    return found


def _whole_motion(groups: Moved, rigid: RigidMotion) -> RigidMotion:
    """The motion of a rigid body with that of its frame."""
    number, point = groups.number(rigid.body), rigid.point - groups.origin
    frames = groups.frames_of_bodies
    given = frames.turn[number].T @ (point - frames.shift[number])
    return replace(
        rigid,
        translation=point - given + rigid.translation,
        rotation=rotation_vector(frames.turn[number]) + rigid.rotation,
    )


def _turned(scene: Scene, name: str, slips: np.ndarray, groups: Moved, last: _Place) -> np.ndarray:
    """Slips (m, dim) of the macro-elements of a zone, turned with their bodies since a place."""
    zone = next(zone for zone in scene.zones if zone.zone.name == name)
    body = np.empty(len(slips), dtype=int)
    for block in zone.slave_faces:
        body[block.number] = scene.body[block.nodes[:, 0]]
    back = np.einsum("mji,mj->mi", last.groups.frames_of_bodies.turn[body], slips)
    return groups.frames_of_bodies.turned(back, body)


def _joined(case: Case, found: Sequence[Solution]) -> Solution:
    """The last solution, with the steps of all, and the positions before it."""
    last = found[-1]
    largest = {
        field.name: max(getattr(one.validity, field.name) for one in found)
        for field in fields(Validity)
    }
    scale = max(one.load_scale for one in found)
    return replace(
        last,
        case=case,
        steps=[one.steps[0] for one in found],
        load_scale=scale,
        iterations=sum(one.iterations for one in found),
        validity=Validity(**largest),
        balance=_largest([one.balance for one in found]),
        accuracy=_largest([one.accuracy for one in found]),
        earlier=[Position(one.mesh.points, *grid_fields(one)) for one in found[:-1]],
    )


def _largest(found: Sequence[dict[str, float]]) -> dict[str, float]:
    """The largest value of each name."""
    names = dict.fromkeys(name for one in found for name in one)
    return {name: max(one.get(name, 0.0) for one in found) for name in names}
