"""Patches: each makes a faulty function of the true one."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.sparse import diags_array

from solver.case.material import Material
from solver.lac.multipliers import integrals

# A segment below this share of the largest is round-off of the intersection.
_SLIVER = 1e-6

Wrapped = Callable[..., Any]


def changed(change: Callable[[Any], Any]) -> Callable[[Wrapped], Wrapped]:
    """A function whose result is changed."""
    return lambda true: lambda *given, **named: change(true(*given, **named))


def given(change: Callable[..., tuple]) -> Callable[[Wrapped], Wrapped]:
    """A function that gets other arguments."""
    return lambda true: lambda *arguments: true(*change(*arguments))


def first_scaled(values: np.ndarray, factor: float) -> np.ndarray:
    values = np.array(values)
    values[0] *= factor
    return values


def first_nodes_exchanged(found: Any) -> Any:
    order = [1, 0, *range(2, found.on_reference.shape[1])]
    return replace(found, on_reference=found.on_reference[:, order])


def last_cell_lost(loops: Any) -> Any:
    """The compiled loops, for small meshes too; stress is that of all cells but the last."""

    def stress(points: np.ndarray, block: Any, *more: Any) -> None:
        loops.add_nodal_stress(points, block.of(slice(len(block.cells) - 1)), *more)

    own = {"serve": lambda *_: True, "add_nodal_stress": stress}
    return SimpleNamespace(**vars(loops) | own)


def last_block_closed(true: Wrapped) -> Wrapped:
    """Closed integrals for the last block of master faces, those of the others as they were."""

    def close(parts: list) -> tuple[list, int]:
        blocks = [part.segments.sides[1].index for part in parts]
        closed, count = true(parts)
        found = zip(blocks, parts, closed, strict=True)
        return [new if block == max(blocks) else old for block, old, new in found], count

    return close


def one_dropped(parts: list) -> list:
    """Without the smallest segment that is more than round-off."""
    sizes = [part.area for part in parts]
    if not parts:
        return parts
    least = _SLIVER * max(size.max() for size in sizes)
    real = [np.where(size > least, size, np.inf) for size in sizes]
    block = int(np.argmin([size.min() for size in real]))
    keep = np.arange(len(real[block])) != real[block].argmin()
    return [part.of(keep) if i == block else part for i, part in enumerate(parts)]


def master_overlooked(pairs: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    kept = pairs[1] != 3
    return pairs[0][kept], pairs[1][kept]


def shared_nodes_free(true: Wrapped) -> Wrapped:
    def zones(*given: Any) -> list[Any]:
        first, *others = true(*given)
        kept = np.ones((first.operator.matrix.shape[1] // 2, 2))
        for faces in first.sub_faces:
            kept[faces.nodes] = 0.0
        cut_off = diags_array(kept.ravel())
        rest = [replace(z.operator, matrix=z.operator.matrix @ cut_off) for z in others]
        return [first, *(replace(z, operator=o) for z, o in zip(others, rest, strict=True))]

    return zones


def never_closing(true: Wrapped) -> Wrapped:
    def constraints(*about: Any) -> Any:
        found = true(*about)
        found.eligible[len(found.eligible) // 2] = False
        return found

    return constraints


def first_system_kept(true: Wrapped) -> Wrapped:
    kept: dict[int, Any] = {}

    def closed_at_first(systems: Any, closed: np.ndarray) -> Any:
        if id(systems) not in kept:
            kept[id(systems)] = true(systems, closed)
        return kept[id(systems)]

    return closed_at_first


def factor_of_half(true: Wrapped) -> Wrapped:
    """As of another stiffness, and no refinement that would make up for it."""
    return lambda self, matrix: true(self, matrix.tocsr() * 0.5)


def never_closes(true: Wrapped) -> Wrapped:
    return lambda solve, start, eligible, *more: true(solve, start, eligible & False, *more)


def stays_closed(true: Wrapped) -> Wrapped:
    """Tension is borne."""

    def status(solve: Any, start: Any, eligible: Any, *more: Any) -> Any:
        def no_tension_seen(closed: np.ndarray) -> Any:
            trial = solve(closed)
            return replace(trial, pressure=np.abs(trial.pressure))

        return true(no_tension_seen, eligible, eligible, *more)

    return status


def first_guess_kept(true: Wrapped) -> Wrapped:
    return lambda solve, start, eligible, *more: replace(
        true(solve, start, eligible, *more), closed=start & eligible
    )


def last_opened(found: Any) -> Any:
    closed = found.closed.copy()
    closed[np.flatnonzero(closed)[-1:]] = False
    return replace(found, closed=closed)


def every_third_off(stress: np.ndarray) -> np.ndarray:
    stress[::3, 0] -= 9e-4 * 25  # between the extremes: accepted values notice nothing
    return stress


def lower_half_softer(true: Wrapped) -> Wrapped:
    def by_material(self: Any, value: Callable[[Any], float], otherwise: float) -> Any:
        found, height = true(self, value, otherwise), self.points[:, -1]
        if value(Material(1.0, 0.3)) != 0.3:
            return found
        middle = (height.min() + height.max()) / 2
        lower = {
            kind: height[cells].mean(axis=1) < middle for kind, cells in self.cut.cells.items()
        }
        return {kind: np.where(lower[kind], 0.2991, values) for kind, values in found.items()}

    return by_material


def rolled_sub_faces(result: Any) -> Any:
    faces = [replace(f, macro=np.roll(f.macro, 1)) for f in result.sub_faces]
    return replace(result, sub_faces=faces)


def template_off_by_one(result: Any) -> Any:
    (kind, nodes), *others = result.sub_faces[0]
    wrong = [(kind, [*nodes[1:], nodes[1]]), *others]
    return replace(result, sub_faces=[wrong, *result.sub_faces[1:]])


def template_piece_lost(result: Any) -> Any:
    return replace(result, pieces=result.pieces[1:])


def first_status_kept(true: Wrapped) -> Wrapped:
    """What is open in the first step stays so."""
    kept: list[np.ndarray] = []

    def status(solve: Any, start: Any, eligible: Any, *more: Any) -> Any:
        found = true(solve, start, kept[0] if kept else eligible, *more)
        kept.append(found.closed)
        return found

    return status


def normals_rolled(blocks: list) -> list:
    turned = [b.directions if b.directions is None else b.directions[:, ::-1] for b in blocks]
    return [replace(b, directions=d) for b, d in zip(blocks, turned, strict=True)]


def more_covered(operator: Any) -> Any:
    at = operator.surface
    more = np.where(at.covered < 0.999 * at.area, 1.001, 1.0) * at.covered
    return replace(operator, covered=more, surface=replace(at, covered=more))


def springs_counted(true: Wrapped) -> Wrapped:
    """The strain energy with that of springs."""

    def energy(state: Any) -> float:
        return float(true(state) + (state.displacement * state.iterate.ground).sum() / 2)

    return energy


def integrals_of(part: Any) -> Any:
    """The integrals of a part's segments as quadrature has them, before the closure."""
    space = SimpleNamespace(at=lambda *_: np.ones((*part.segments.weight.shape, 1)))
    space.number = {part.segments.slave.index: part.segments.slave.faces.number[:, None]}
    return integrals(space, part.segments)


def of_each_row(true: Wrapped) -> Wrapped:
    """A contact whose law takes the stiffness of each row, also of tangents."""

    def init(contact: Any, stiffness: np.ndarray, *others: Any) -> None:
        true(contact, stiffness, *others)
        contact.c = np.abs(np.diag(stiffness))

    return init
