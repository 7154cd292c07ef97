"""Marks of a plot that differ in shape as well as in colour, for print and for the colour-blind."""

from collections.abc import Mapping

import numpy as np

from .svg import BLUE, GREEN, ORANGE, PAPER, PURPLE, Drawing

_CORNERS = {
    "square": [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)],
    "triangle": [(-1.24, 0.94), (1.24, 0.94), (0.0, -1.3)],
    "wedge": [(-1.24, -0.94), (1.24, -0.94), (0.0, 1.3)],
    "diamond": [(-1.35, 0.0), (0.0, -1.35), (1.35, 0.0), (0.0, 1.35)],
    "pentagon": [(0.0, -1.25), (1.19, -0.39), (0.73, 1.01), (-0.73, 1.01), (-1.19, -0.39)],
}
# Colour and mark by the shape of cells, so that either tells them apart.
LOOKS = {
    "TRIA": (BLUE, "circle"),
    "TETRA": (BLUE, "circle"),
    "QUAD": (ORANGE, "square"),
    "HEXA": (ORANGE, "square"),
    "PENTA": (GREEN, "triangle"),
    "PYRA": (PURPLE, "diamond"),
}
MARKS = ("circle", *_CORNERS, "cross")


def look_of(cells: str, looks: Mapping[str, tuple[str, str]] = LOOKS) -> tuple[str, str]:
    """Colour and mark of a cell type: the first of `looks` whose key its name begins with."""
    return next(look for shape, look in looks.items() if cells.startswith(shape))


def draw_marks(
    drawing: Drawing, mark: str, at: np.ndarray, color: str, filled: bool = True, size: float = 3.5
) -> None:
    """Draw marks of `MARKS` at (n, 2); `size` is half their width in pixels."""
    fill = color if filled else PAPER
    if mark == "cross":
        drawing.crosses(at, size, stroke=color, stroke_width=1.8)
    elif mark == "circle":
        drawing.circles(at, size, fill=fill, stroke=color, stroke_width=1.4)
    else:
        corners = at[:, None] + size * np.array(_CORNERS[mark])
        drawing.polygons(corners, fill=fill, stroke=color, stroke_width=1.4)
