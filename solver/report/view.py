"""A view of points in 3D on a drawing: faces from far to near, lines, texts beside it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .charts import INK, MUTED
from .layout import Drawing, Style, mixed, normals

Frame = tuple[float, ...]  # x, y, width, height in pixels
AZIMUTH, ELEVATION = np.radians(-58), np.radians(24)
FLAT = np.eye(2, 3)
# Pixels between lines and between labels; the width of a character of text by its size.
_LINE, _BETWEEN, _CHARACTER = 13.0, 5.0, 0.53
_LIGHT = np.array([0.25, -0.45, 0.85])


def axonometry(normal: np.ndarray) -> np.ndarray:
    """Screen axes (2, 3), right and up, of an eye that sees a surface of this normal (3,).

    The eye is above a slave that looks up and below one that looks down, so that the slave's
    surface, where cells are cut, is seen.
    """
    tilt = ELEVATION if normal[2] >= 0 else -ELEVATION
    flat = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0])
    eye = np.cos(tilt) * flat + np.sin(tilt) * np.array([0.0, 0.0, 1.0])
    right = np.array([-flat[1], flat[0], 0.0])
    return np.stack([right, np.cross(eye, right)])


@dataclass(frozen=True)
class View:
    """How places come onto a drawing: `screen` axes (2, 3), pixels per length, pixels of zero."""

    drawing: Drawing
    screen: np.ndarray
    scale: float
    zero: np.ndarray

    @classmethod
    def of(cls, drawing: Drawing, screen: np.ndarray, corners: np.ndarray, frame: Frame) -> "View":
        """The view of which a frame shows points (k, 2) on the screen whole, in its middle."""
        x, y, width, height = frame
        low, extent = corners.min(axis=0), np.maximum(np.ptp(corners, axis=0), 1e-300)
        scale = float(min(width / extent[0], height / extent[1]))
        middle = scale * (low + extent / 2)
        zero = np.array([x + width / 2 - middle[0], y + height / 2 + middle[1]])
        return cls(drawing, screen, scale, zero)

    @property
    def eye(self) -> np.ndarray:
        """The direction towards the eye (3,)."""
        return np.cross(*self.screen)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Pixels (…, 2) of points (…, 3)."""
        return self.at(points @ self.screen.T)

    def at(self, places: np.ndarray) -> np.ndarray:
        """Pixels (…, 2) of places on the screen (…, 2)."""
        return self.zero + self.scale * places * [1.0, -1.0]

    @property
    def solid(self) -> bool:
        """Whether bodies have a depth; plane ones are seen from +z."""
        return self.screen is not FLAT

    def rectangle(self, box: np.ndarray) -> Frame:
        """A box on the screen, low and high (2, 2), in pixels: x, y, width, height."""
        (left, bottom), (right, top) = self.at(box)
        return float(left), float(top), float(right - left), float(bottom - top)

    def inside(self, polygons: np.ndarray, box: np.ndarray | None) -> np.ndarray:
        """Which polygons (n, corners, 3) reach into a box on the screen; all without one."""
        if box is None:
            return np.ones(len(polygons), dtype=bool)
        flat = polygons @ self.screen.T
        return np.asarray(((flat.max(axis=1) > box[0]) & (flat.min(axis=1) < box[1])).all(axis=1))

    def along(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (…, 3) on the drawing (…, 2), y downward; shorter where they point at the eye."""
        return vectors @ self.screen.T * [1.0, -1.0]

    def faces(
        self,
        groups: Sequence[tuple[np.ndarray, np.ndarray]],
        fill: Callable[[int, float], str],
        stroke: str,
        both: bool = False,
    ) -> None:
        """Polygons (f, corners, 3) with levels (f,) by group, far ones first.

        Filled by level and light; from outside only, unless they are seen from `both` sides.
        """
        runs = [run for group in groups for run in _runs(*group, self.eye, both)]
        for _, level, light, polygons in sorted(runs, key=lambda run: run[0]):
            pixels = self(polygons)
            width = float(np.clip(0.08 * np.ptp(pixels, axis=1).mean(), 0.1, 0.6))  # dense: thin
            style: dict[str, Style] = {"fill": fill(level, light), "stroke": stroke}
            self.drawing.polygons(pixels, True, stroke_width=round(width, 2), **style)

    def lines(self, points: np.ndarray, color: str, width: float, **style: Style) -> None:
        """Lines through points (n, points, 3)."""
        self.drawing.polygons(self(points), False, stroke=color, stroke_width=width, **style)


def _runs(
    polygons: np.ndarray, level: np.ndarray, eye: np.ndarray, both: bool
) -> Iterator[tuple[float, int, float, np.ndarray]]:
    """Polygons of one direction and level: how near, the level, the light on them, themselves."""
    facing = normals(polygons)
    near = facing @ eye
    if both:
        facing, near = facing * np.sign(near)[:, None], np.abs(near)
    seen = np.flatnonzero(near > 1e-6)
    if not len(seen):
        return
    code = np.rint(10 * facing[seen]).astype(int) @ [441, 21, 1] + 9261 * level[seen]
    _, run, counts = np.unique(code, return_inverse=True, return_counts=True)
    run = run.ravel()
    depth = np.bincount(run, polygons[seen].mean(axis=1) @ eye) / counts
    order = seen[np.argsort(run, kind="stable")]
    for place, members in zip(depth, np.split(order, np.cumsum(counts)[:-1]), strict=True):
        light = max(float(facing[members[0]] @ _LIGHT), 0.0)
        yield float(place), int(level[members[0]]), light, polygons[members]


def lit(color: str, _: int, light: float) -> str:
    """A colour in light from 0 to 1, on any level."""
    return mixed(color, INK, 0.16 * (1 - light))


@dataclass
class Label:
    """Text beside a picture: `lines` of text and colour, what it names `at` (2,) in pixels."""

    lines: list[tuple[str, str]]
    at: np.ndarray | None = None
    bold: bool = False


def draw_labels(drawing: Drawing, labels: Sequence[Label], frame: Frame) -> None:
    """Labels one below the other in a frame, each as near as can be to what it names."""
    x, top, width, height = frame
    ordered = sorted(labels, key=lambda label: _order(label, top))
    if sum(_height(label) for label in ordered) > height:  # crowded: a line each
        for label in ordered:
            text = ", ".join(text for text, _ in label.lines)
            label.lines = [(text, label.lines[-1][1])]
        most = int(height // (_LINE + _BETWEEN))
        if len(ordered) > most:
            rest = Label([(f"and {len(ordered) - most + 1} more", MUTED)])
            ordered = [*ordered[: most - 1], rest]
    place, free = [], top
    for label in ordered:
        wanted = free if label.at is None else float(label.at[1]) - _height(label) / 2
        place.append(max(free, wanted))
        free = place[-1] + _height(label)
    end = top + height
    for k in reversed(range(len(ordered))):
        place[k] = end = min(place[k], end - _height(ordered[k]))
    for label, y in zip(ordered, place, strict=True):
        if label.at is not None:
            color = label.lines[-1][1]
            line = np.array([[[x - 4, y + 8], label.at]])
            drawing.polygons(line, closed=False, stroke=color, stroke_width=0.6, opacity=0.7)
            if label.bold:
                dot = label.at + 2 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
                drawing.polygons(dot[None], fill=color)
        for k, (text, color) in enumerate(label.lines):
            size, weight = (11.0, "600") if label.bold and not k else (10.0, "")
            shown = int(width / (size * _CHARACTER))
            short = text if len(text) <= shown else f"{text[: shown - 1]}…"
            drawing.text(x, y + 11 + k * _LINE, short, size=size, color=color, weight=weight)


def _order(label: Label, top: float) -> tuple[float, ...]:
    """From above, and from the left where two are nearly at one height."""
    x, y = (0.0, top) if label.at is None else label.at
    return round(y / _LINE), x, y


def _height(label: Label) -> float:
    return _LINE * len(label.lines) + _BETWEEN
