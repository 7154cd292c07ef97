"""The gallery: PyVista draws each result file off-screen, and a page shows the pictures."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..system.errors import MachineError
from ..system.files import replacing, write_text
from ..system.process import cores_for, run_apart
from ..verification.units import with_unit
from .html import TEMPLATES, render
from .rows import Row, families, read_rows

PAGE, FOLDER = "gallery.html", "gallery"
WIDTH, HEIGHT = 1500, 560
_TRIAL = "import pyvista; pyvista.Plotter(off_screen=True).screenshot(None)"
# The first start of a graphics driver may take its time.
_SECONDS = 120.0
_LINES = {"color": "#333333", "line_width": 1.0, "lighting": False}
# Outlines of bodies are the edges at which their surface bends by more than this (degrees).
_FEATURE = 40.0


@dataclass(frozen=True)
class Picture:
    """The picture of one solve: its path relative to the page, or the reason why it has none."""

    row: Row
    path: str
    reason: str = ""


def write_gallery(verdicts: Sequence[Path], folder: Path) -> str:
    """Draw the results of the verdict files into `folder`/gallery, and write the page; the outcome.

    A picture that is newer than its result is kept. Raises MachineError where VTK cannot draw.
    """
    # Without OpenGL, VTK may kill its process.
    trial = run_apart([sys.executable, "-c", _TRIAL], cores_for(1), _SECONDS)
    if trial.status != 0:
        problem = f"cannot draw here (EGL, GLX or OSMesa is needed): {trial.reason}"
        raise MachineError("gallery", "PyVista", None, problem)
    pictures = [_picture(row, folder) for row in read_rows(verdicts)]
    groups = {
        name: [picture for picture in pictures if picture.row.group == name]
        for name in families([picture.row for picture in pictures])
    }
    page = render(TEMPLATES / "gallery.html.jinja", title="Gallery", families=groups, folder=folder)
    write_text(folder / PAGE, page)
    drawn = sum(bool(picture.path) for picture in pictures)
    return f"{drawn} pictures, {len(pictures) - drawn} without. Gallery: {folder / PAGE}"


def _picture(row: Row, folder: Path) -> Picture:
    if row.result_file is None:
        return Picture(row, "", f"no picture: {row.why or 'no result'}")
    path = f"{FOLDER}/{row.group}-{row.folder.name}.png"
    target = folder / path
    newest = max(file.stat().st_mtime for file in (row.result_file, Path(__file__)))
    if not target.is_file() or target.stat().st_mtime <= newest:
        try:
            draw(row.result_file, target)
        except Exception as error:  # noqa: BLE001 -- whatever VTK says of a damaged result
            reason = f"no picture ({type(error).__name__}: {error})"
            return Picture(row, "", " ".join(reason.split()))
    return Picture(row, path)


def draw(result: Path, png: Path) -> None:
    """Draw a result file: displacement, contact pressure, and the mesh after the cut.

    Raises what PyVista raises for a file that it does not read.
    """
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    # It warns of a missing screen, which it does not need.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    grid = pyvista.read(result)
    dim = 3 if np.ptp(grid.points[:, 2]) > 0 else 2
    on_faces = grid.cell_data["zone"] >= 0
    bodies, faces = grid.extract_cells(~on_faces), grid.extract_cells(on_faces)
    units = dict(text.split(": ") for text in grid.field_data.get("units", ()))
    factor = magnification(grid.point_data["displacement"], grid.length)
    deformed = bodies.warp_by_vector("displacement", factor=factor)
    plotter = pyvista.Plotter(
        off_screen=True, shape=(1, 3), window_size=[WIDTH, HEIGHT], border=False
    )
    title = with_unit("displacement", units.get("displacement")) + f", drawn × {factor:g}"
    _panel(plotter, 0, title, deformed, dim, scalars="displacement", cmap="YlOrBr")
    plotter.add_mesh(_edges(bodies, _FEATURE), **_LINES)
    look: dict[str, Any]
    plotter.subplot(0, 1)
    plotter.add_mesh(_edges(bodies, _FEATURE), **_LINES)
    title = with_unit("contact pressure", units.get("pressure")) + " on the slave faces"
    if faces.n_cells:
        look = {"cmap": "Blues", "clim": (0.0, max(float(faces["pressure"].max()), 1e-300))}
        _panel(plotter, 1, title, faces, dim, scalars="pressure", line_width=9, **look)
    bodies["slave"] = np.isin(bodies["body"], faces["body"]).astype(int)
    look = {"cmap": ["#f3d2b8", "#c9d9ee"], "clim": (0, 1), "show_scalar_bar": False}
    _panel(plotter, 2, "mesh after the cut", bodies, dim, scalars="slave", **look)
    for column in range(3):
        plotter.subplot(0, column)
        plotter.enable_parallel_projection()
        plotter.view_xy() if dim == 2 else plotter.view_vector((0.48, -0.78, 0.41))
        plotter.camera.zoom(0.8)
    with replacing(png) as temporary:
        plotter.screenshot(temporary)
    plotter.close()


def _panel(plotter: Any, column: int, title: str, cells: Any, dim: int, **look: Any) -> None:
    """Draw cells with their edges, and a title, into one column."""
    plotter.subplot(0, column)
    bar = {"title": " " * (column + 1), "color": "#333333", "fmt": "%.4g"}
    light = {"lighting": dim == 3, "ambient": 0.5, "diffuse": 0.5}
    plotter.add_mesh(_surface(cells), scalar_bar_args=bar, **light, **look)
    if dim == 3 or column != 1:
        plotter.add_mesh(_edges(cells.separate_cells(), 1.0), **_LINES)
    plotter.add_text(title, position=(0.04, 0.93), viewport=True, font_size=10, color="#333333")


def _surface(cells: Any) -> Any:
    """The surface of cells; the faces of quadratic cells are bent."""
    return cells.extract_surface(nonlinear_subdivision=2, algorithm="dataset_surface")


def _edges(cells: Any, angle: float) -> Any:
    """The edges at which the surface of cells ends or bends by more than an angle (degrees)."""
    return _surface(cells).extract_feature_edges(angle, manifold_edges=False)


def magnification(displacement: np.ndarray, size: float) -> float:
    """The factor by which a displacement (n, dim) is enlarged on a model of that size.

    The largest becomes at most a sixteenth of the size; the factor is 1, 2 or 5 times a power of
    ten.
    """
    largest = float(np.linalg.norm(displacement, axis=1).max(initial=0.0))
    wanted = size / (16 * largest) if largest else 1.0
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(max(m * decade for m in (1, 2, 5) if m * decade <= wanted * (1 + 1e-9)))
