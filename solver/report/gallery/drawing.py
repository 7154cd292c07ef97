"""Pictures of results by PyVista, without a screen: deformed shape, pressure, cut mesh."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from matplotlib.colors import LinearSegmentedColormap
from vtkmodules.vtkCommonCore import vtkLogger

from ...system.files import replacing
from ...verification.units import with_unit
from ..space import PRESSURE
from ..svg import BLUE, INK, MUTED, ORANGE, PAPER, mixed
from .shapes import Shape

WIDTH, HEIGHT = 1560, 600
# From little to much, light to dark, as far from the blues of pressure as can be.
_DISPLACEMENT = ("#fdf6ee", "#fbd9b5", "#f5a662", "#d9691e", "#8c3304")
# Seen on every pressure.
GOLD = "#e8a200"
# VTK halves the faces of quadratic cells so often each way: outlines have as many corners.
_SUBDIVISION = 2
# Edges meet where a surface bends by more than this angle (degrees).
_FEATURE = 40.0
# Lines are drawn this share of the size of the model in front of the faces whose edges they are.
_IN_FRONT = 2e-3
_BAR = {
    "height": 0.075, "width": 0.8, "position_x": 0.1, "position_y": 0.02, "color": INK,
    "label_font_size": 16, "n_labels": 5, "fmt": "%.4g",
}  # fmt: skip


def draw(result: Path, png: Path) -> None:
    """Draw a result file, as PyVista reads it, into a PNG file.

    Raises what PyVista raises for a file that it does not read.
    """
    # It warns of a screen that is not there, and does without.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    grid = pyvista.read(result)
    shape = Shape.of(grid)
    plotter = pyvista.Plotter(
        off_screen=True, shape=(1, 3), window_size=[WIDTH, HEIGHT], border=False
    )
    plotter.set_background(PAPER)
    for column, panel in enumerate((_deformed, _pressure, _cut_mesh)):
        plotter.subplot(0, column)
        title, seen = panel(plotter, shape, grid)
        plotter.add_text(title, position=(0.04, 0.93), viewport=True, font_size=10, color=INK)
        _look(plotter, shape, seen)
    with replacing(png) as temporary:
        plotter.screenshot(temporary)
    plotter.close()


def _deformed(plotter: Any, shape: Shape, grid: Any) -> tuple[str, np.ndarray]:
    """The deformed bodies coloured by displacement, with the edges of the undeformed ones."""
    volumes = grid.extract_cells(np.flatnonzero(shape.is_volume))
    warped = volumes.warp_by_vector("displacement", factor=shape.magnification)
    plotter.add_mesh(
        _surface(warped),
        scalars="displacement",
        cmap=_colors(_DISPLACEMENT),
        lighting=shape.dim == 3,
        ambient=0.5,
        diffuse=0.55,
        scalar_bar_args={"title": " ", **_BAR},
    )
    _lines(plotter, shape, shape.outlines(shape.deformed), mixed(INK, PAPER, 0.45), 1.0)
    _features(plotter, volumes, MUTED)
    drawn = with_unit("displacement", shape.units.get("displacement"))
    return f"{drawn}, drawn × {shape.magnification:g}", np.r_[shape.deformed, shape.points]


def _pressure(plotter: Any, shape: Shape, grid: Any) -> tuple[str, np.ndarray]:
    """The contact pressure on the slave faces; in the plane as bars that stand on them."""
    if not shape.faces:
        return "no contact", shape.points
    shown, all_of_it = shape.pressed()
    if shape.dim == 3:
        faces = _surface(grid.extract_cells(np.flatnonzero(~shape.is_volume)[shown]))
        seen = shape.points[np.unique(shape.nodes_of_faces(shown))]
        polygons = shape.face_outlines(shown)
    else:
        bars = shape.bars()[shown]
        faces, seen, polygons = _faces(bars), bars.reshape(-1, 3), [bars]
        faces.cell_data["pressure"] = shape.pressure[shown]
    if all_of_it:
        slaves = np.flatnonzero(shape.is_volume)[shape.of_slaves]
        _features(plotter, grid.extract_cells(slaves), mixed(BLUE, PAPER, 0.5))
        seen = np.r_[seen, shape.points[np.isin(shape.body, shape.slaves)]]
    plotter.add_mesh(
        faces,
        scalars="pressure",
        cmap=_colors(PRESSURE),
        clim=(0.0, float(max(shape.pressure.max(), 1e-300))),
        lighting=False,
        scalar_bar_args={"title": "  ", **_BAR},
    )
    _lines(plotter, shape, polygons, mixed(MUTED, PAPER, 0.3), 1.0)
    _macro_elements(plotter, shape, shown, np.zeros(3), GOLD if shape.dim == 3 else INK)
    where = "on the slave faces" if all_of_it else "where it presses"
    return f"{with_unit('contact pressure', shape.units.get('pressure'))} {where}", seen


def _cut_mesh(plotter: Any, shape: Shape, grid: Any) -> tuple[str, np.ndarray]:
    """The cells, the bodies apart: slaves blue, the others orange."""
    moved = grid.copy()
    moved.points = shape.apart
    volumes = np.flatnonzero(shape.is_volume)
    for cells, color in ((volumes[shape.of_slaves], BLUE), (volumes[~shape.of_slaves], ORANGE)):
        if len(cells):
            surface = _surface(moved.extract_cells(cells))
            plotter.add_mesh(surface, color=mixed(color, PAPER, 0.75), ambient=0.45, diffuse=0.6)
    for slave, color in ((True, BLUE), (False, ORANGE)):
        edges = shape.outlines(shape.apart, slave)
        _lines(plotter, shape, edges, mixed(color, INK, 0.2), 1.0)
    if shape.faces:
        _macro_elements(plotter, shape, np.ones(len(shape.pressure), bool), shape.moved)
    return "cut mesh, bodies apart, the slave blue", shape.apart


def _surface(cells: Any) -> Any:
    return cells.extract_surface(
        nonlinear_subdivision=_SUBDIVISION, algorithm="dataset_surface", pass_cellid=False
    )


def _features(plotter: Any, cells: Any, color: str) -> None:
    """The edges at which the surface of the cells ends or bends."""
    edges = (
        _surface(cells)
        .clean()
        .extract_feature_edges(
            feature_angle=_FEATURE, manifold_edges=False, non_manifold_edges=False
        )
    )
    if edges.n_cells:
        plotter.add_mesh(edges, color=color, line_width=1.2, lighting=False)


def _macro_elements(
    plotter: Any, shape: Shape, shown: np.ndarray, away: np.ndarray, color: str = INK
) -> None:
    """The edges of the macro-elements, in the plane their ends, moved by `away` (3,)."""
    places = shape.macro_outlines(shown) + away
    if shape.dim == 3:
        width = 2.4 if len(places) < 400 else 1.4
        _lines(plotter, shape, [places], color, width, False, 2 * _IN_FRONT)
    else:
        plotter.add_points(places, color=INK, point_size=6.0)


def _faces(polygons: np.ndarray) -> Any:
    """Polygons (n, corners, 3) as PyVista's faces."""
    n, corners, _ = polygons.shape
    numbers = np.arange(n * corners).reshape(n, corners)
    return pyvista.PolyData(
        polygons.reshape(-1, 3), faces=np.c_[np.full(n, corners), numbers].ravel()
    )


def _lines(
    plotter: Any,
    shape: Shape,
    polygons: Iterable[np.ndarray],
    color: str,
    width: float,
    closed: bool = True,
    front: float = _IN_FRONT,
) -> None:
    """The edges of polygons, each (n, corners, 3), `front` times the size before them."""
    for part in polygons:
        if len(part):
            n, corners, _ = part.shape
            numbers = np.arange(n * corners).reshape(n, corners)
            ring = np.c_[numbers, numbers[:, 0]] if closed else numbers
            lines = np.c_[np.full(n, ring.shape[1]), ring].ravel()
            places = part.reshape(-1, 3) + front * shape.size * shape.eye
            drawn = pyvista.PolyData(places, lines=lines)
            plotter.add_mesh(drawn, color=color, line_width=width, lighting=False)


def _look(plotter: Any, shape: Shape, seen: np.ndarray) -> None:
    """From the eye on what is `seen` (n, 3), with room for the title above and the scale below."""
    eye, up = shape.eye, shape.up
    screen = np.stack([np.cross(up, eye), up])
    places = seen @ screen.T
    low, high = places.min(axis=0), places.max(axis=0)
    half = np.maximum(high - low, 1e-9 * shape.size) / 2
    scale = max(half[1] / 0.74, half[0] / (0.88 * WIDTH / 3 / HEIGHT))
    middle = (low + high) / 2 - [0, 0.03 * scale]
    focus = middle @ screen + (seen @ eye).mean() * eye
    plotter.camera_position = [focus + 10 * shape.size * eye, focus, up]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = scale
    plotter.reset_camera_clipping_range()


def _colors(colors: tuple[str, ...]) -> Any:
    return LinearSegmentedColormap.from_list("colors", colors)
