"""Error against run time of all solves of a family, log–log, with what to compare them with."""

from collections.abc import Sequence
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from . import formats, stages
from .axes import EPSILON, Scale, draw_axes, draw_floor, draw_level, round_off
from .families import CodeError
from .rows import Row
from .svg import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, RED, Drawing

WIDTH, HEIGHT = 940, 470
# One colour for each kind of reference: they are not compared with one another.
COLORS = {"analytical": BLUE, "manufactured": GREEN, "refined": PURPLE, "other_code": ORANGE}


def drawn(rows: Sequence[Row]) -> list[Row]:
    """The rows that have both an error and a time."""
    return [row for row in rows if row.accuracy is not None and row.total]


def floor(rows: Sequence[Row]) -> tuple[float, float]:
    """The round-off floor: the unit round-off ε, and ε√N for the largest N unknowns."""
    return round_off(_unknowns(rows))


def _unknowns(rows: Sequence[Row]) -> int:
    return max((row.verdict.dofs or 1 for row in rows), default=1)


def draw_errors(rows: Sequence[Row], reference_code: Sequence[CodeError]) -> Markup:
    """Points of all solves with lines for the tolerance, the reference code and round-off."""
    shown = drawn(rows)
    drawing = Drawing(WIDTH, HEIGHT, "Worst error against run time of every solve")
    times = np.array([row.total for row in shown])
    errors = np.array([max(row.accuracy[0], EPSILON / 4) for row in shown])  # type: ignore[index]
    x = Scale(*_around(times, 1.25), 62, WIDTH - 190, log=True)
    highest = max(1e-2, 3 * errors.max(initial=0), *(3 * (row.allowed or 0) for row in shown))
    y = Scale(EPSILON / 8, highest, HEIGHT - 52, 34, log=True)
    draw_floor(drawing, x, y, _unknowns(shown))
    draw_axes(drawing, x, y, "wall time of the solve, s", "worst relative error")
    for tolerance in sorted({row.allowed for row in shown if row.allowed}):
        draw_level(drawing, x, y, tolerance, f"tolerance {100 * tolerance:.3g} %", RED)
    for entry in reference_code:
        label = f"{entry.name} {entry.version}: {formats.error(entry.error)}"
        draw_level(drawing, x, y, entry.error, label, MUTED, (6, 4))
    at = np.column_stack([x(times), y(errors)])
    for row, point in zip(shown, at, strict=True):
        _mark(drawing, row, point)
    _labels(drawing, shown, at)
    return drawing.svg()


def _around(values: np.ndarray, factor: float) -> tuple[float, float]:
    """A range of at least a decade about the values."""
    low, high = values.min() / factor, values.max() * factor
    widen = max(1.0, (10 / (high / low)) ** 0.5)
    return float(low / widen), float(high * widen)


def _mark(drawing: Drawing, row: Row, point: np.ndarray) -> None:
    error, check = row.accuracy  # type: ignore[misc]
    tip = (
        f"{row.name}: {formats.error(error)} ({check}), {formats.seconds(row.total)}, {row.word}; "
        f"{stages.told(row.stages)}"
    )
    color = COLORS.get(row.verdict.reference_kind or "", INK)
    drawing.open_link(f"#{quote(row.anchor)}", tip)
    if row.sound:
        drawing.circles(point[None], 4, fill=color, fill_opacity=0.55, stroke=color)
    else:
        drawing.crosses(point[None], 5, stroke=RED, stroke_width=2.2)
    drawing.close_link()


def _labels(drawing: Drawing, rows: Sequence[Row], at: np.ndarray) -> None:
    """Names beside the points, failures first, where they cover neither points nor names."""
    boxes = [(x - 4, y - 4, x + 4, y + 4) for x, y in at]
    for row, (x, y) in zip(rows, at, strict=True):
        name = row.name.removeprefix(f"{row.group}-").replace("-swapped", "′")
        width = 5.6 * len(name)
        for left, base in ((x + 6, y + 4), (x - 6 - width, y + 4), (x - width / 2, y - 7)):
            box = (left, base - 8, left + width, base)
            if not any(_overlap(box, other) for other in boxes):
                drawing.text(left, base, name, size=10, color=INK if row.sound else RED)
                boxes.append(box)
                break


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
