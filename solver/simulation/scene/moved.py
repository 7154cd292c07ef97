"""Bodies that moved far: their frames, and the groups of a case where the bodies are in one step.

Each body has a frame, a rotation R and a translation t. A step is the linear problem on the mesh
x = R X + t, for a small displacement v beside that motion: u = R X + t − X + v. Supports act on u,
in the axes of the case. Springs pull back from where they were made. Pressures turn with their
faces, all other forces keep their direction; expressions have the coordinates of the mesh as given.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...case.acting import Step, in_step
from ...lac.cells.faces import FaceBlock
from ...mechanics.fem.supports import Fixed, FreeMotion
from ...mechanics.mortar.quadric import Quadric
from .attributes import Attributes
from .holdings.holding import Holding

# Imposed displacements are followed until a frame moves by less than this share of its body.
_FOLLOWED, _ITERATIONS = 1e-13, 50
# Motions that imposed displacements see by less than this share of a body are not imposed.
_SEEN = 1e-3


@dataclass(frozen=True)
class Frames:
    """The frame of each of b bodies: `turn` (b, dim, dim) and `shift` (b, dim)."""

    turn: np.ndarray
    shift: np.ndarray

    @classmethod
    def still(cls, count: int, dim: int) -> "Frames":
        """Where the mesh is given."""
        return cls(np.tile(np.eye(dim), (count, 1, 1)), np.zeros((count, dim)))

    def placed(self, points: np.ndarray, body: np.ndarray) -> np.ndarray:
        """Where points (n, dim) of bodies (n,) are now."""
        return np.einsum("nij,nj->ni", self.turn[body], points) + self.shift[body]

    def beyond(self, other: "Frames", points: np.ndarray, body: np.ndarray) -> np.ndarray:
        """How much further (n, dim) than other frames they move points; exact for translations."""
        further = Frames(self.turn - other.turn, self.shift - other.shift)
        return further.placed(points, body)

    def turned(self, vectors: np.ndarray, body: np.ndarray) -> np.ndarray:
        """Vectors (n, dim) of bodies (n,) as these turned."""
        return np.einsum("nij,nj->ni", self.turn[body], vectors)

    def with_body(self, number: int, turn: np.ndarray, shift: np.ndarray) -> "Frames":
        """With another frame of a body; its rotation is made orthogonal to round-off."""
        left, _, right = np.linalg.svd(turn)
        turns, shifts = self.turn.copy(), self.shift.copy()
        turns[number], shifts[number] = left @ right, shift
        return Frames(turns, shifts)

    def following(
        self,
        number: int,
        now: np.ndarray,
        then: np.ndarray,
        share: np.ndarray | None = None,
        around_axis: bool = False,
    ) -> "Frames":
        """With the rigid motion that best brings places `now` (n, dim) of a body to `then`.

        By least squares, each place with its `share` (n,), or all alike where none has one.
        `around_axis`: only along y.
        """
        share = share if share is not None and share.any() else np.ones(len(now))
        middle, goal = (share @ each / share.sum() for each in (now, then))
        turn = np.eye(now.shape[1])
        if around_axis:
            goal[0] = middle[0]
        else:
            turn = _best_turn((now - middle) * share[:, None], then - goal)
        shift = turn @ (self.shift[number] - middle) + goal
        return self.with_body(number, turn @ self.turn[number], shift)


class Moved(Attributes):
    """The groups of a case on its mesh as the bodies moved, and what acts there in a step.

    `rest`: those of the mesh as given; `faces` of all contact surfaces; `wanted`: the frames that
    follow all that is imposed, of which rigid bodies get what `frames` have not.
    """

    def __init__(
        self, rest: Attributes, faces: list[FaceBlock], step: Step, frames: Frames, wanted: Frames
    ):
        cut = replace(rest.cut, points=frames.placed(rest.points, rest.body))
        case = replace(rest.case, steps=(step,))
        super().__init__(case, rest.mesh, cut, rest.zones, rest.origin)
        self.as_in(rest)
        self.rest, self.step, self.frames_of_bodies = rest, step, frames
        self.contact_faces, self._wanted = faces, wanted

    @property
    def at_rest(self) -> Attributes:
        """Those of the mesh as given."""
        return self.rest

    @cached_property
    def motion(self) -> np.ndarray:
        """The displacement (n, dim) of the frames."""
        still = Frames.still(len(self.frames_of_bodies.turn), self.points.shape[1])
        return self.frames_of_bodies.beyond(still, self.rest.points, self.body)

    @cached_property
    def _left(self) -> np.ndarray:
        """What is left (n, dim) to where rigid bodies are wanted."""
        return self._wanted.beyond(self.frames_of_bodies, self.rest.points, self.body)

    def forces(self, name: str | None = None) -> np.ndarray:  # noqa: ARG002
        """Nodal forces (n, dim) of the step."""
        return self._all_forces

    @cached_property
    def _all_forces(self) -> np.ndarray:
        total = np.zeros_like(self.points)
        for load, force in zip(self.case.loads, self.rest.forces_of_loads, strict=True):
            turns = load.kind == "pressure"
            moved = self.frames_of_bodies.turned(force, self.body) if turns else force
            total += load.factor(self.step) * moved
        return total + self._in_step(lambda name: sum(h.force(name) for h in self.holdings))

    def fixed(self, name: str | None = None) -> dict[str, Fixed]:  # noqa: ARG002
        """What is imposed in the step beside the frames."""
        return self._all_fixed

    @cached_property
    def _all_fixed(self) -> dict[str, Fixed]:
        found = {}
        for holding, key, fixed in _imposed(self.rest, self.step):
            carried = np.einsum("nd,nd->n", fixed.directions, self.motion[fixed.nodes])
            left = fixed.values - carried
            if holding.frames:
                left = np.einsum("nd,nd->n", fixed.directions, self._left[fixed.nodes])
            found[key] = replace(fixed, values=left)
        return found

    def supports(self, name: str | None = None) -> FreeMotion:  # noqa: ARG002
        """The motion that holdings leave free in the step."""
        return self._all_supports

    @cached_property
    def _all_supports(self) -> FreeMotion:
        return super().supports()

    def histories(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """All that acts in the step, under a name that no step has."""
        return {"": (self.forces(), self.supports().offset)}

    def surface(self, name: str) -> Quadric | None:
        """A rigid surface where its body is now."""
        given = self.rest.surface(name)
        if given is None:
            return None
        frames, number = self.frames_of_bodies, self.number(name)
        return given.moved(frames.turn[number], frames.shift[number])

    def carried(self, name: str, point: np.ndarray) -> np.ndarray:
        """Where a point (dim,) of the mesh as given, which moves with a rigid body, is now."""
        return self.frames_of_bodies.placed(point[None], np.array([self.number(name)]))[0]

    def number(self, name: str) -> int:
        """The body of a rigid one."""
        return int(self.body[self.nodes(name, f"bodies.{name}")[0]])

    def _in_step(self, of: Callable[[str | None], Any]) -> Any:
        return in_step(self.step, ("", *self.rest.case.histories), of)


def _imposed(rest: Attributes, step: Step) -> list[tuple[Holding, str, Fixed]]:
    """Each holding with the displacements that it imposes in a step, by key."""
    before, found = dict[str, Fixed](), []
    for holding in rest.holdings:
        whole = holding.fixed(before)
        of = {name: holding.fixed(before, name) for name in ("", *rest.case.histories)}
        for key, fixed in whole.items():
            of_name: dict[str | None, np.ndarray] = {
                None: fixed.values,
                **{name: given[key].values for name, given in of.items()},
            }
            values = in_step(step, of, of_name.__getitem__)
            found.append((holding, key, replace(fixed, values=values)))
        before |= whole
    return found


def predicted(rest: Attributes, step: Step, last: Frames) -> tuple[Frames, np.ndarray]:
    """The frames that follow what a step imposes, from the `last` ones, and which bodies it holds.

    Rigid bodies move as the case says. Others follow the displacements of their supports by least
    squares: by translations first, and turn by what these leave. What is not imposed stays.
    """
    points, body = rest.points, rest.body
    frames, held = last, np.zeros(len(last.turn), dtype=bool)
    imposed = _imposed(rest, step)
    rigid = {
        int(number) for frame in rest.frames().values() for number in np.unique(body[frame.nodes])
    }
    for number in range(len(held)):
        mine = [
            Fixed(fixed.nodes[there], fixed.directions[there], fixed.values[there])
            for holding, _, fixed in imposed
            if not holding.frames and (there := body[fixed.nodes] == number).any()
        ]
        if mine and number not in rigid:
            frames, held[number] = _following(
                points, points[body == number], frames, number, mine, rest.axisymmetric
            )
    for name, frame in rest.frames().items():
        turn, shift = _imposed_frame(rest, name, frame.point, step, frames)
        for number in np.unique(body[frame.nodes]):
            frames = frames.with_body(int(number), turn, shift)
            held[number] = not rest.case.rigid[name].force
    return frames, held


def _following(
    points: np.ndarray,
    mine: np.ndarray,
    frames: Frames,
    number: int,
    imposed: list[Fixed],
    axisymmetric: bool,
) -> tuple[Frames, bool]:
    """The frame of a body that has displacements imposed, and whether they hold all of it.

    `points` (n, dim) of all bodies, `mine` (m, dim) of this one.
    """
    nodes, directions, values = (
        np.concatenate([getattr(one, key) for one in imposed])
        for key in ("nodes", "directions", "values")
    )
    dim, given, held = points.shape[1], points[nodes], False
    size = float(np.ptp(mine, axis=0).max())
    for _ in range(_ITERATIONS):
        turn, shift = frames.turn[number], frames.shift[number]
        now = given @ turn.T + shift
        middle = now.mean(axis=0)
        columns = _motions(now - middle, directions, size, axisymmetric)
        few = columns[:, : min(dim, columns.shape[1])]
        left = values - np.einsum("kd,kd->k", directions, now - given)
        amount = np.zeros(columns.shape[1])
        amount[: few.shape[1]] = np.linalg.lstsq(few, left, rcond=_SEEN)[0]
        more, _, rank, _ = np.linalg.lstsq(columns, left - columns @ amount, rcond=_SEEN)
        amount += more
        held = rank == columns.shape[1]
        by, about = _step_of(amount, dim, size, axisymmetric)
        frames = frames.with_body(number, about @ turn, about @ (shift - middle) + middle + by)
        if np.abs(amount).max() < _FOLLOWED * size:
            break
    return frames, held


def _motions(
    arm: np.ndarray, directions: np.ndarray, size: float, axisymmetric: bool
) -> np.ndarray:
    """What rigid motions have along directions (k, dim) at places `arm` (k, dim): (k, motions)."""
    if axisymmetric:
        return directions[:, 1:]
    if arm.shape[1] == 2:
        turns = (directions[:, 1] * arm[:, 0] - directions[:, 0] * arm[:, 1])[:, None]
    else:
        turns = np.cross(arm, directions)
    return np.hstack([directions, turns / size])


def _step_of(
    amount: np.ndarray, dim: int, size: float, axisymmetric: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Translation (dim,) and rotation (dim, dim) of amounts of `_motions`."""
    if axisymmetric:
        return np.array([0.0, amount[0]]), np.eye(dim)
    return amount[:dim], rotation_by(amount[dim:] / size, dim)


def rotation_by(vector: np.ndarray, dim: int) -> np.ndarray:
    """The rotation (dim, dim) by a rotation vector, about z alone in the plane."""
    whole = np.zeros(3)
    whole[-len(vector) :] = vector
    return Rotation.from_rotvec(whole).as_matrix()[:dim, :dim]


def rotation_vector(turn: np.ndarray) -> np.ndarray:
    """The rotation vector (3,) of a rotation (dim, dim)."""
    whole = np.eye(3)
    whole[: len(turn), : len(turn)] = turn
    return np.asarray(Rotation.from_matrix(whole).as_rotvec())


def _imposed_frame(
    rest: Attributes, name: str, point: np.ndarray, step: Step, last: Frames
) -> tuple[np.ndarray, np.ndarray]:
    """The frame of a rigid body: as imposed, and as before in components that forces pull."""
    body, dim = rest.case.rigid[name], len(point)
    number = int(rest.body[rest.frames()[name].nodes[0]])
    moved = last.placed(point[None], np.array([number]))[0] - point
    vector = rotation_vector(last.turn[number])
    keys = [*"xyz"[:dim], "rx", "ry", "rz"]
    now = dict(zip(keys, [*moved, *vector], strict=True))
    factor = body.factor(step)
    imposed = {key: factor * body.move.get(key, 0.0) for key in keys if key not in body.force}
    now |= imposed
    turn = rotation_by(np.array([now[key] for key in ("rx", "ry", "rz")]), dim)
    return turn, point + np.array([now[axis] for axis in "xyz"[:dim]]) - turn @ point


def settled(groups: Moved, displacement: np.ndarray, held: np.ndarray) -> Frames:
    """The frames with the rigid motion of a displacement (n, dim) of bodies that are not held.

    By least squares over the contact surfaces of a body, the faces of which have the same weight;
    over the whole body where it has none.
    """
    frames, points, body = groups.frames_of_bodies, groups.points, groups.body
    weight = np.zeros(len(points))
    for faces in groups.contact_faces:
        np.add.at(weight, faces.nodes, 1.0)
    for number in np.flatnonzero(~held).tolist():
        mine = body == number
        now, then = points[mine], points[mine] + displacement[mine]
        frames = frames.following(number, now, then, weight[mine], groups.axisymmetric)
    return frames


def _best_turn(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The rotation (dim, dim) of vectors (n, dim) that fits others best (Kabsch, 1976)."""
    left, _, right = np.linalg.svd(before.T @ after)
    sign = np.eye(len(left))
    sign[-1, -1] = np.sign(np.linalg.det(left @ right))
    return (left @ sign @ right).T
