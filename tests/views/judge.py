"""One case in several views, and what differs between them."""

import signal
from collections.abc import Iterator
from copy import deepcopy
from itertools import islice
from random import Random
from types import FrameType
from typing import Any, NamedTuple

import meshio
import numpy as np

from solver import Solved, solve_case
from solver.lac.errors import SolveError
from solver.simulation.results.solution import ZoneResult
from solver.system.errors import InputError

from .beside import OTHER, beside, meshed, others
from .cases import Case, by_body, move_places

# Stresses in other units are so many times as large, lengths too.
UNITS, LENGTHS = 1e6, 1e-3
# Pressures and tractions are the same up to this share of the largest pressure of all steps, or so
# many times what the solve itself says that rounding may change.
SAME, ROUNDINGS = 1e-8, 10.0
# Coordinates of a mesh that was moved or written lose so much of its extent; stiff bodies under
# small loads are pressed by it.
LOST, PRESSED = 1e-14, 1e-6
# A zone whose largest pressure is below this share of the largest of all bears nothing.
LEAST = 1e-9
# A solve takes less than a second.
MOST_SECONDS = 60
NOTHING = np.zeros(0)
# The words of a case that was solved, the best first.
_ANSWERS = "solved", "unreliable"


class Seen(NamedTuple):
    """What came of a view: a word and its reason, and the pressures and tractions (m,) in order.

    `moved` (n,): how far nodes moved; empty where a zone bears nothing, so that a body may rest
    anywhere. `size`: the largest pressure of all steps; `rounding`: its estimated relative error.
    """

    word: str
    reason: str = ""
    pressure: np.ndarray = NOTHING
    traction: np.ndarray = NOTHING
    moved: np.ndarray = NOTHING
    size: float = 1.0
    rounding: float = 0.0


def views(case: Case) -> Iterator[tuple[str, Case, bool]]:
    """The other views of a case: name, mapping, whether all work is done that may be left out.

    A `bare` rigid body has no material.
    """
    yield "everything", case, True
    yield "other units", in_other_units(case), False
    yield "renumbered", in_another_order(case), False
    yield "elsewhere", elsewhere(case), False
    steps = case.get("steps", [1.0])
    yield "last step again", case | {"steps": [*steps, steps[-1]]}, False
    if rigid := {name for name, body in case.get("bodies", {}).items() if body.get("rigid")}:
        of_others = {g: m for g, m in by_body(case["materials"]).items() if g not in rigid}
        yield "bare", case | {"materials": of_others}, False


def elsewhere(case: Case) -> Case:
    """The bodies at another place, turned by an angle of their own where nothing has directions."""
    r, dim, found = Random(case["name"]), len(case["mesh"]["bottom"]["divisions"]), deepcopy(case)
    angle, moves = r.uniform(10.0, 350.0), found.setdefault("transform", {})
    axis = [r.uniform(-1.0, 1.0) for _ in range(3)]
    around = case.get("plane") == "axisymmetric"
    along = any(key in str(case) for key in ("body_force", "traction", "bodies", "together"))
    if not along and not around:
        moves["rotate"] = angle if dim == 2 else {"axis": axis, "angle": angle}
    moves["translate"] = by = [r.uniform(-2.0, 2.0) * (k > 0 or not around) for k in range(dim)]
    move_places(found, by)
    return found


def in_another_order(case: Case) -> Case:
    """The lists of the case from their ends, and nodes and cells of its mesh in another order."""
    found = case | {key: case[key][::-1] for key in ("supports", "loads", "contact")}
    found["materials"] = dict(reversed(case["materials"].items()))
    found["transform"] = case.get("transform", {}) | {"renumber": 7}
    return found


def in_other_units(case: Case) -> Case:
    """The case with lengths, and stresses, forces and stiffnesses in smaller units."""
    dim = len(case["mesh"]["bottom"]["divisions"])
    lengths = "fix", "move", "point", "reference", "interference", "clearance"
    units = dict.fromkeys(lengths, LENGTHS)
    units |= dict.fromkeys(("young", "pressure", "traction"), UNITS)
    units |= dict.fromkeys(("body_force", "spring"), UNITS / LENGTHS)
    across = 2 if case.get("plane") == "axisymmetric" else dim - 1
    units |= {"force": UNITS * LENGTHS**across, "rz": UNITS * LENGTHS ** (across + 1)}  # a moment
    same = {key: value for key, value in case.items() if key in ("mesh", "steps")}
    scaled = {"scale": LENGTHS} | case.get("transform", {})
    return _in_units(case, units) | same | {"transform": scaled}


def _in_units(value: Any, units: dict[str, float], unit: float = 1.0) -> Any:
    """A value of a case with its numbers in other units, by the nearest key that has one."""
    if isinstance(value, dict):
        return {key: _in_units(each, units, units.get(key, unit)) for key, each in value.items()}
    if isinstance(value, list):
        return [_in_units(each, units, unit) for each in value]
    return value if unit == 1.0 or isinstance(value, str) else unit * value


def seen(
    case: Case,
    everything: bool = False,
    unit: float = 1.0,
    length: float = 1.0,
    mesh: meshio.Mesh | None = None,
) -> Seen:
    """Solve a case; only a traceback is no answer, or no end in a minute.

    What stands beside it is not looked at.
    """
    before = signal.signal(signal.SIGALRM, _too_long)
    signal.alarm(MOST_SECONDS)
    try:
        solved = solve_case(case, mesh, everything=everything)
    except InputError as error:
        return Seen("refused", str(error))
    except SolveError as error:
        return Seen("no solution", str(error))
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    causes = solved.solution.quality.accuracy.values()
    values = _pressures(solved) / unit, _tractions(solved) / unit, _moved(solved) / length
    size = max(solved.solution.largest_pressure / unit, np.finfo(float).tiny)
    return Seen(solved.verdict, solved.reason, *values, size, max(causes, default=0.0))


def _too_long(_: int, __: FrameType | None) -> None:
    raise TimeoutError(f"no end after {MOST_SECONDS} s")


def _own_zones(solved: Solved) -> list[ZoneResult]:
    return [zone for zone in solved.solution.zones if not zone.name.startswith(OTHER)]


def _pressures(solved: Solved) -> np.ndarray:
    return np.concatenate([NOTHING, *(zone.multiplier for zone in _own_zones(solved))])


def _tractions(solved: Solved) -> np.ndarray:
    """The sizes (m,) of the tractions of friction on all macro-elements."""
    found = (
        z.friction.friction_traction if z.friction else np.zeros((len(z.area), 1))
        for z in _own_zones(solved)
    )
    return np.concatenate([NOTHING, *(np.linalg.norm(each, axis=1) for each in found)])


def _moved(solved: Solved) -> np.ndarray:
    """See `Seen`."""
    least = LEAST * solved.solution.largest_pressure
    if any(zone.multiplier.max(initial=0.0) <= least for zone in solved.solution.zones):
        return NOTHING
    return np.linalg.norm(solved.displacement, axis=1)


def compared(case: Case, most: int | None = None) -> tuple[str, list[str]]:
    """The word of a case, and what differs between its views, `most` of that.

    Empty where nothing does.
    """
    first = seen(case)
    return first.word, list(islice(_differences(case, first), most))


def _differences(case: Case, first: Seen) -> Iterator[str]:
    for name, other, everything in views(case) if first.word != "refused" else ():
        unit, length = (UNITS, LENGTHS) if name == "other units" else (1.0, 1.0)
        again = seen(other, everything, unit, length)
        yield from (f"{name}: {what}" for what in _between(first, again, name))
    if first.word != "refused":
        again = seen(case, mesh=rounded(case))
        yield from (f"rounded: {what}" for what in _between(first, again, "rounded"))
    if first.word in _ANSWERS:
        yield from (f"beside: {what}" for what in _between(*_beside(case, first), "beside"))


def rounded(case: Case) -> meshio.Mesh:
    """The mesh of a case, its coordinates less some of their last digits."""
    mesh, r = meshed(case), np.random.default_rng(Random(case["name"]).getrandbits(32))
    extent = np.ptp(mesh.points, axis=0)
    mesh.points += LOST * extent * r.uniform(-1.0, 1.0, mesh.points.shape)
    return mesh


def _beside(case: Case, first: Seen) -> tuple[Seen, Seen]:
    """What comes of a case alone, and with another one beside it that presses everywhere.

    The second has the word of the first if only the other case has a worse one.
    """
    other = others(case)
    alone = seen(other)
    if alone.word not in _ANSWERS or not alone.moved.size:
        return first, first
    joined, mesh, n = beside(case, other)
    both = seen(joined, mesh=mesh)
    worst = max(first.word, alone.word, key=_ANSWERS.index)
    word = first.word if both.word == worst else both.word
    return first._replace(moved=first.moved[:n]), both._replace(moved=both.moved[:n], word=word)


def _between(one: Seen, other: Seen, view: str) -> Iterator[str]:
    if one.word != other.word:
        yield f"{one.word} ({one.reason}) and {other.word} ({other.reason})"
        return
    same = PRESSED if view == "rounded" else SAME
    allowed = max(same, ROUNDINGS * max(one.rounding, other.rounding))
    sizes = {"pressure": one.size, "traction": one.size}
    if one.moved.size and other.moved.size:
        sizes["moved"] = float(one.moved.max())
    for quantity, size in sizes.items():
        a, b = (getattr(each, quantity) for each in (one, other))
        if view == "renumbered" or quantity == "moved":
            a, b = np.sort(a), np.sort(b)
        apart = float(np.abs(a - b).max(initial=0.0)) / (size or 1.0)
        if apart > allowed:
            yield f"{quantity} by {apart:.1e}"
