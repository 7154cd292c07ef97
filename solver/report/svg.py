"""Drawings as SVG text: integer tenths of a pixel, many polygons in one path, all text escaped.

For pictures of meshes alone: a thousand faces cost some milliseconds and kilobytes.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from markupsafe import Markup, escape

from .charts import INK, PAPER

Style = str | float | tuple[float, ...]


class Drawing:
    """An SVG under construction. Lengths and positions are pixels, y downward."""

    def __init__(self, width: float, height: float, title: str):
        self.width, self.height, self.title = width, height, title
        self._parts: list[str] = []

    def polygons(self, points: np.ndarray, closed: bool = True, **style: Style) -> None:
        """Add polygons or lines of equally many points, (n, points, 2), as one path."""
        if not len(points):
            return
        pattern = "M%d %dl" + " ".join(["%d %d"] * (points.shape[1] - 1)) + ("Z" if closed else "")
        whole = np.rint(points * 10).astype(int)
        whole[:, 1:] -= whole[:, :-1].copy()  # steps have fewer digits than places
        data = pattern * len(points) % tuple(whole.ravel().tolist())
        self._parts.append(f'<path d="{data}"{_attributes(style)}/>')

    def rectangle(self, x: float, y: float, width: float, height: float, **style: Style) -> None:
        """Add an upright rectangle, (x, y) its upper left corner."""
        corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
        self.polygons(np.array([corners]), True, **style)

    @contextmanager
    def clipped(self, x: float, y: float, width: float, height: float) -> Iterator[None]:
        """Clip all that is added meanwhile to this rectangle."""
        box = f'x="{x * 10:g}" y="{y * 10:g}" width="{width * 10:g}" height="{height * 10:g}"'
        seen = " ".join(f"{10 * length:g}" for length in (x, y, width, height))
        self._parts.append(f'<svg {box} viewBox="{seen}">')
        yield
        self._parts.append("</svg>")

    def text(
        self,
        x: float,
        y: float,
        content: object,
        anchor: str = "start",
        size: float = 11,
        color: str = INK,
        weight: str = "",
    ) -> None:
        """Add one line of text with its baseline at y; `anchor` start, middle or end."""
        bold = f' font-weight="{weight}"' if weight else ""
        self._parts.append(
            f'<text x="{x * 10:.0f}" y="{y * 10:.0f}" font-size="{size * 10:g}" fill="{color}"'
            f' text-anchor="{anchor}"{bold}>{escape(content)}</text>'
        )

    def svg(self) -> Markup:
        """The drawing as one SVG element that stands alone and fits into a page."""
        w, h = self.width, self.height
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w * 10:g} {h * 10:g}" '
            f'width="{w:g}" height="{h:g}" role="img" font-family="system-ui, sans-serif" '
            f'stroke-linejoin="round" style="background:{PAPER}">'
            f"<title>{escape(self.title)}</title>"
        )
        return Markup(head + "".join(self._parts) + "</svg>")


def _attributes(style: dict[str, Style]) -> str:
    """Attributes from keyword arguments; strokes in pixels, no fill unless asked for."""
    style = {"fill": "none"} | style
    for key in ("stroke_width", "stroke_dasharray"):
        if key in style:
            style[key] = " ".join(f"{10 * length:g}" for length in np.atleast_1d(style[key]))
    return "".join(f' {key.replace("_", "-")}="{escape(value)}"' for key, value in style.items())


def mixed(color: str, other: str, share: float) -> str:
    """The colour between two, `share` of the way to the other."""
    a, b = (np.array([int(c[i : i + 2], 16) for i in (1, 3, 5)]) for c in (color, other))
    return "#" + "".join(f"{round(v):02x}" for v in (1 - share) * a + share * b)
