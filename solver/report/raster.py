"""Drawings as PNG, for those who cannot use SVG: where matplotlib is installed.

Reads what `svg.Drawing` writes and no other SVG: paths of whole numbers, text, links.
"""

import re
import xml.etree.ElementTree as ET
from importlib.util import find_spec
from io import BytesIO
from itertools import pairwise
from typing import Any

import numpy as np

_TOKEN = re.compile(r"[MmlaZ]|-?\d+")
_ANCHORS = {"start": "left", "middle": "center", "end": "right"}
_UNIT = 10  # the drawing's units to a pixel
_POINTS = 0.72  # points to a pixel, at 100 dots per inch
_ARC = np.linspace(0, np.pi, 13)[1:]


def available() -> bool:
    """Whether PNG can be made here."""
    return find_spec("matplotlib") is not None


def to_png(svg: str, scale: float = 2.0) -> bytes:
    """The PNG of a drawing, `scale` dots a pixel."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    root = ET.fromstring(svg)
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    figure = Figure(figsize=(width / 100, height / 100), dpi=100 * scale)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, width * _UNIT), ylim=(height * _UNIT, 0))
    axes.set_axis_off()
    for element in root.iter():
        name = element.tag.rpartition("}")[2]
        if name == "path":
            axes.add_patch(_patch(element.attrib))
        elif name == "text":
            _write(axes, element)
    stream = BytesIO()
    FigureCanvasAgg(figure).print_png(stream)
    return stream.getvalue()


def _patch(style: dict[str, str]) -> Any:
    from matplotlib.patches import PathPatch

    dashes = [float(d) / _UNIT for d in style.get("stroke-dasharray", "").split()]
    thickness = float(style.get("stroke-width", 0 if "stroke" not in style else _UNIT)) / _UNIT
    # Dashes are counted in widths of the line.
    pattern = (0, [d / max(thickness, 1e-9) for d in dashes * (1 + len(dashes) % 2)])
    fill = style["fill"]
    return PathPatch(
        _path(style["d"]),
        facecolor=(fill, float(style.get("fill-opacity", 1))) if fill != "none" else "none",
        edgecolor=style.get("stroke", "none"),
        linewidth=thickness * _POINTS,
        linestyle=pattern if dashes else "solid",
        joinstyle="round",
    )


def _path(data: str) -> Any:
    """The path of an SVG path's data, arcs being half circles."""
    from matplotlib.path import Path

    vertices: list[np.ndarray] = []
    codes: list[Any] = []

    def add(points: np.ndarray, code: Any) -> None:
        vertices.extend(points)
        codes.extend([code, *[Path.LINETO] * (len(points) - 1)])

    at = start = np.zeros(2)
    for command, numbers in _commands(data):
        if command == "Z":
            add(start[None], Path.CLOSEPOLY)
        elif command == "a":
            for *_, x, y in np.reshape(numbers, (-1, 7)):
                across = np.array([x, y]) / 2
                aside = np.array([across[1], -across[0]])
                turn = _ARC[:, None]
                add(at + across - across * np.cos(turn) - aside * np.sin(turn), Path.LINETO)
                at = at + 2 * across
        else:
            points = np.reshape(numbers, (-1, 2))
            points = points if command == "M" else at + np.cumsum(points, axis=0)
            add(points, Path.LINETO if command == "l" else Path.MOVETO)
            start = points[0] if command != "l" else start
            at = points[-1]
    return Path(np.array(vertices), codes)


def _commands(data: str) -> list[tuple[str, list[float]]]:
    tokens = _TOKEN.findall(data)
    places = [i for i, token in enumerate(tokens) if token.isalpha()]
    spans = pairwise([*places, len(tokens)])
    return [(tokens[a], [float(t) for t in tokens[a + 1 : b]]) for a, b in spans]


def _write(axes: Any, element: ET.Element) -> None:
    style = element.attrib
    turn = re.search(r"rotate\((\S+)", style.get("transform", ""))
    axes.text(
        float(style["x"]),
        float(style["y"]),
        (element.text or "").replace("$", r"\$"),
        fontsize=float(style["font-size"]) / _UNIT * _POINTS,
        color=style["fill"],
        ha=_ANCHORS[style["text-anchor"]],
        va="baseline",
        rotation=-float(turn[1]) if turn else 0,
        rotation_mode="anchor",
        fontweight="bold" if "font-weight" in style else "normal",
    )
