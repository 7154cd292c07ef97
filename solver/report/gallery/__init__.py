"""The gallery: each solve drawn by PyVista, or without OpenGL by the report's own drawing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..rows import Row

PAGE, FOLDER = "gallery.html", "gallery"

Draw = Callable[[Path, Path], None]


@dataclass(frozen=True)
class Picture:
    """The picture of one solve: its path as seen from the page, or why there is none."""

    row: Row
    path: str
    reason: str = ""


def write_gallery(
    verdicts: Sequence[Path],
    folder: Path,
    plain: bool = False,
    log: Callable[[str], Any] = print,
) -> None:
    """Draw the results of the verdict files into `folder`/gallery, and write the page of them.

    By PyVista, unless `plain` or it cannot draw here; the page says which, and why. A picture that
    is newer than its result and the drawing stays.
    """
    from ...system.files import write_text
    from ..html import TEMPLATES, render
    from ..rows import families, read_rows
    from .probe import set_up

    reason = "asked for" if plain else set_up()
    log(f"Drawing {'without OpenGL: ' + reason if reason else 'by PyVista'}.")
    draw, ending = _drawing(plain=bool(reason))
    pictures = [_picture(row, folder, draw, ending) for row in read_rows(verdicts)]
    by_family = families([picture.row for picture in pictures])
    page = render(
        TEMPLATES / "gallery.html.jinja",
        title="Gallery",
        families={
            name: [p for p in pictures if p.row.group == name and (p.path or p.reason)]
            for name in by_family
        },
        reason=reason,
        versions=_versions(),
        folder=folder,
    )
    write_text(folder / PAGE, page)
    drawn = sum(bool(picture.path) for picture in pictures)
    log(f"{drawn} pictures, {len(pictures) - drawn} without. Gallery: {folder / PAGE}")


def _drawing(plain: bool) -> tuple[Draw, str]:
    """What draws a result into a file, and the ending of these files."""
    if plain:
        return _draw_plain, "-plain.svg"
    from .drawing import draw

    return draw, ".png"


def _draw_plain(result: Path, target: Path) -> None:
    """The report's own drawing with the bodies deformed, as SVG."""
    from ...system.files import write_text
    from ...verification.results import read_result
    from ..layout import magnification
    from ..plane import draw_plane
    from ..space import draw_space

    solution = read_result(result).solution
    factor = magnification(solution.displacement, solution.length)
    draw = draw_plane if solution.mesh.points.shape[1] == 2 else draw_space
    title = f"{solution.job}: bodies deformed (displacement × {factor:g}), contact pressure"
    write_text(target, draw(solution, title, factor))


def _picture(row: Row, folder: Path, draw: Draw, ending: str) -> Picture:
    from ..pictures import is_current

    if row.result_file is None:
        return Picture(row, "", f"no picture: {row.why or 'no result'}")
    target = folder / FOLDER / f"{row.group}-{row.folder.name}{ending}"
    if not is_current(target, row.result_file, Path(__file__).parent):
        try:
            draw(row.result_file, target)
        except Exception as error:  # noqa: BLE001 -- whatever VTK or a damaged result comes up with
            return Picture(
                row, "", " ".join(f"no picture ({type(error).__name__}: {error})".split())
            )
    return Picture(row, f"{FOLDER}/{target.name}")


def _versions() -> str:
    from importlib.metadata import PackageNotFoundError, version

    found = []
    for package in ("pyvista", "vtk"):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)
