"""Steps along a path on which bodies move far: each is solved on the mesh where the bodies are.

The frames of a step follow what it imposes. It is solved on the mesh moved with them; a rigid
motion that is left of bodies that nothing holds is taken into their frames, and the step is solved
again until the frames stay. Slip is counted between the points that meet now, from where they were
at the end of the last step. Strains are small, and neglected in the geometry.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import meshio
import numpy as np

from ..case.acting import Step
from ..case.model import Case
from ..lac.cells.faces import FaceBlock
from ..lac.errors import SolveError
from ..system.errors import InputError
from ..system.progress import Clock, stage
from .equilibrium.problem import ContactProblem
from .equilibrium.state import Equilibrium
from .equilibrium.step import solve_step
from .finished import called, finished, tell
from .fit import refuse_unfit
from .judgement.plan import decided, plan_notes
from .judgement.validity import NOTED_SLIP, validity
from .options import Options
from .results.fields import grid_fields
from .results.forces import RigidMotion
from .results.records import Validity, largest_of
from .results.results import solution_of
from .results.solution import Line, Position, Solution
from .scene.attributes import Attributes
from .scene.bodies import body_names
from .scene.moved import Frames, Moved, predicted, rotation_vector, settled
from .scene.records import AtWork
from .scene.scene import CutModel, Scene, build_model, scene_of

_LOG = logging.getLogger(__name__)
# So often a step is solved at most.
_ROUNDS = 10
# What a moved scene knows its step as: its loads are those of one step.
_STEP: Step = {}


@dataclass(frozen=True)
class _Place:
    """Where a step left the bodies, and its state."""

    groups: Moved
    state: Equilibrium

    @property
    def displacement(self) -> np.ndarray:
        """The whole displacement (n, dim) from the mesh as given."""
        return self.groups.motion + self.state.displacement


@dataclass(frozen=True)
class _Solved:
    """A solved step: its place, the problem there, and the rounds."""

    place: _Place
    problem: ContactProblem
    rounds: int


def solve_moving(case: Case, mesh: meshio.Mesh, options: Options, clock: Clock) -> Solution:
    """Solve a case step by step, its bodies where each step brings them.

    Where a later step has no solution, those before it are kept. Raises InputError where the case
    and its mesh do not fit, SolveError where the first step has no solution.
    """
    model, frames = _unmoved(case, mesh, options, clock)
    last, rounds = None, 0
    found, ended = list[Solution](), ""
    for factor, step in zip(case.factors, case.steps, strict=True):
        try:
            solved = _in_place(model, step, frames, last, clock)
        except SolveError as error:
            ended = f"{called(step, factor)}: {error}"
            if not found:
                raise SolveError(ended) from None
            break
        tell(called(step, factor), solved.place.state, solved.problem.scene.n_multipliers)
        with stage(clock, "recovery"):
            found.append(_solution(solved, factor, found, last))
        last, rounds = solved.place, max(rounds, solved.rounds)
        frames = last.groups.frames_of_bodies
        del solved  # memory for the next factors
    whole = _joined(case.until(len(found)), found)
    why = "pairs and intersections belong to the mesh where the bodies are"
    whole.plan.append(Line(f"bodies followed, up to {rounds} rounds a step", why))
    return finished(whole, clock, ended)


def first_scene(case: Case, mesh: meshio.Mesh, options: Options, clock: Clock) -> Scene:
    """The scene of the first step, where it is expected to bring the bodies.

    Raises InputError where the case and its mesh do not fit.
    """
    model, frames = _unmoved(case, mesh, options, clock)
    groups, _ = _expected(model, case.steps[0], frames)
    return scene_of(model, groups, clock)


def _unmoved(
    case: Case, mesh: meshio.Mesh, options: Options, clock: Clock
) -> tuple[CutModel, Frames]:
    """The model, with what acts in all steps, and the frames of its bodies before any step."""
    model = build_model(case, mesh, options, clock)
    at_work = AtWork.of(model.groups.forces(), model.groups.supports().offset)
    still = Frames.still(int(model.groups.body.max()) + 1, model.groups.points.shape[1])
    return replace(model, at_work=at_work), still


def _expected(model: CutModel, step: Step, frames: Frames) -> tuple[Moved, np.ndarray]:
    """The groups where a step is expected to bring the bodies, and which of these are held."""
    rest, faces = model.groups, model.contact_faces
    if exact := rest.case.exact_in(step):
        rest = rest.with_solution(exact)
    wanted, held = predicted(rest, step, frames)
    return Moved(rest, faces, step, _followed(rest, faces, frames, wanted), wanted), held


def _in_place(
    model: CutModel, step: Step, frames: Frames, last: _Place | None, clock: Clock
) -> _Solved:
    """A step solved where its bodies are; SolveError where it has no solution or no place."""
    groups, held = _expected(model, step, frames)
    rest, faces, frames = groups.rest, model.contact_faces, groups.frames_of_bodies
    for count in range(1, _ROUNDS + 1):
        try:
            scene = scene_of(replace(model, rounding=_rounding(model, groups)), groups, clock)
            if last is None:
                refuse_unfit(scene)
            with stage(clock, "assembly"):
                carried = groups.motion - (0.0 if last is None else last.displacement)
                problem = ContactProblem(scene, carried.ravel())
        except InputError as error:
            if last is None and count == 1:
                raise
            raise SolveError(f"{error.key}: {error.problem}") from None
        with stage(clock, "solve"):
            state = solve_step(problem, _STEP, last.state if last else None)
        wanted, _ = predicted(rest, step, settled(groups, state.displacement, held))
        following = _followed(rest, faces, frames, wanted)
        moves = (following.turn != frames.turn).any(axis=(1, 2))
        moves |= (following.shift != frames.shift).any(axis=1)
        _LOG.info("round %d: %d bodies went on", count, moves.sum())
        if not moves.any():
            return _Solved(_Place(groups, state), problem, count)
        frames, groups = following, Moved(rest, faces, step, following, wanted)
    raise SolveError(f"{body_names(scene)[int(moves.argmax())]} finds no place: it still moves")


def _rounding(model: CutModel, groups: Moved) -> float:
    """How well coordinates are known, those of places far from the mesh as given too.

    Raises SolveError where that is no better than what linear theory passes over.
    """
    farthest = float(np.abs(groups.points + groups.origin).max())
    known = max(model.rounding, float(np.finfo(float).eps) * farthest)
    if known > _passed_over(groups.rest.points, groups.contact_faces):
        raise SolveError("bodies are so far away that coordinates no longer tell nodes apart")
    return known


def _passed_over(points: np.ndarray, faces: list[FaceBlock]) -> float:
    """The largest motion that linear theory passes over: a share of the smallest contact face."""
    edges = [points[block.nodes[:, 1]] - points[block.nodes[:, 0]] for block in faces]
    size = min((float(np.linalg.norm(e, axis=1).min()) for e in edges), default=np.inf)
    return NOTED_SLIP * size


def _followed(rest: Attributes, faces: list[FaceBlock], old: Frames, new: Frames) -> Frames:
    """The new frames of bodies whose contact they move by more than linear theory passes over.

    A body without contact is measured all over, by the smallest face of all; a rigid one at its
    reference point too, about which it may roll.
    """
    points, body = rest.points, rest.body
    moved = np.linalg.norm(new.beyond(old, points, body), axis=1)
    most = _passed_over(points, faces)
    counted = np.zeros(len(moved), dtype=bool)
    for block in faces:
        counted[block.nodes] = True
    alone = ~np.isin(body, body[counted])
    far, frames = body[(moved > most) & (counted | alone)], old
    for rigid in rest.frames().values():
        number = body[rigid.nodes[:1]]
        if np.linalg.norm(new.beyond(old, rigid.point[None], number)) > most:
            far = np.append(far, number)
    for number in np.unique(far).tolist():
        frames = frames.with_body(number, new.turn[number], new.shift[number])
    return frames


def _solution(
    solved: _Solved, factor: float, before: Sequence[Solution], last: _Place | None
) -> Solution:
    """The solution of one step, its motion and what slipped so far included."""
    problem, place = solved.problem, solved.place
    state, groups = place.state, place.groups
    plan = [*decided(problem), *plan_notes(problem, [state], len(before) + 1)]
    found = solution_of(problem, [state], plan)
    found.quality.validity = validity(problem, [state])
    found.fields.motion = groups.motion
    (step,) = found.steps
    step.factor = factor
    step.rigid = [_whole_motion(groups, rigid) for rigid in step.rigid]
    force, path = state.force + found.fields.reaction, place.displacement
    if last is not None:
        force = force + last.state.force + before[-1].fields.reaction
        path = path - last.displacement
        for zone, old in zip(found.zones, before[-1].zones, strict=True):
            if zone.friction and old.friction:
                turned = _turned(problem.scene, zone.name, old.friction.slip_total, groups, last)
                zone.friction.slip_total = zone.friction.slip + turned
    step.work = float((force * path).sum() / 2)
    for name, nodes in problem.scene.named.probed.items():
        if not problem.scene.case.probes[name].zone:
            probe = found.places.probes[name]
            found.places.probes[name] = replace(probe, displacement=place.displacement[nodes])
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
    quality, kept = [one.quality for one in found], grid_fields(last)
    return replace(
        last,
        case=case,
        steps=[one.steps[0] for one in found],
        scalars=replace(last.scalars, load_scale=max(one.scalars.load_scale for one in found)),
        cost=replace(last.cost, iterations=sum(one.cost.iterations or 0 for one in found)),
        quality=replace(
            last.quality,
            balance=largest_of([one.balance for one in quality]),
            accuracy=largest_of([one.accuracy for one in quality]),
            validity=Validity.worst([one.validity for one in quality]),
        ),
        earlier=[_position(one, kept) for one in found[:-1]],
    )


def _position(step: Solution, kept: tuple[dict[str, np.ndarray], ...]) -> Position:
    """Where a step left the bodies: a file has the fields of the last step at all positions.

    A recovered pressure that the step has not is NaN.
    """
    pairs = zip(grid_fields(step), kept, strict=True)
    fields = (
        {k: own[k] if k in own else np.full_like(value, np.nan) for k, value in last.items()}
        for own, last in pairs
    )
    return Position(step.mesh.points, *fields)
