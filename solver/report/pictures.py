"""The pictures of the solves, drawn anew only where a result or the drawing has changed."""

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

from markupsafe import Markup

from ..case.expressions import Expression
from ..simulation.solution import Solution
from ..system.errors import InputError
from ..system.files import write_text
from ..verification.results import read_result
from .plane import draw_plane
from .profile import draw_profile
from .rows import Row
from .space import draw_space

MOST_CELLS = 100_000


def picture(row: Row, folder: Path) -> Markup:
    """The picture of one solve, kept in `folder`; a line that says why there is none."""
    return _kept(row, folder, "", lambda row: draw(_solution(row), row.name))


def profile(row: Row, folder: Path, along: Expression | None = None) -> Markup:
    """The pressure of one solve's first zone along the interface, kept in `folder` too."""

    def draw_row(row: Row) -> Markup:
        return draw_pressure(_solution(row), row.name, along)

    over = f"-{sha256(along.text.encode()).hexdigest()[:8]}" if along else ""
    return _kept(row, folder, f"-profile{over}", draw_row)


def draw(solution: Solution, name: str) -> Markup:
    """Meshes and contact pressure; raises ValueError where there are too many cells to draw."""
    cells = sum(len(block.data) for block in solution.mesh.cells)
    if cells > MOST_CELLS:
        raise ValueError(f"{cells} cells are too many to draw")
    drawn = draw_plane if solution.mesh.points.shape[1] == 2 else draw_space
    return drawn(solution, f"{name}: meshes and contact pressure")


def draw_pressure(
    solution: Solution, name: str, along: Expression | None = None, zone: str | None = None
) -> Markup:
    """The pressure of a zone, the first or the one named, along the interface.

    Raises ValueError where there is no such zone.
    """
    shown = next((z for z in solution.zones if zone in (None, z.name)), None)
    if shown is None:
        raise ValueError(f"there is no contact zone {zone}" if zone else "no contact, no pressure")
    return draw_profile(solution, shown, f"{name}: contact pressure along the interface", along)


def _kept(row: Row, folder: Path, ending: str, draw: Callable[[Row], Markup]) -> Markup:
    if row.result_file is None:
        return Markup("<p class=none>No result, no picture.</p>")
    kept = folder / f"{row.group}-{row.folder.name}{ending}.svg"
    if not is_current(kept, row.result_file):
        try:
            drawing = draw(row)
        except (InputError, OSError, LookupError, ValueError, ArithmeticError) as error:
            reason = f"{type(error).__name__}: {error}"
            return Markup("<p class=none>No picture: {}</p>").format(reason)
        write_text(kept, drawing)
    return Markup(kept.read_text(encoding="utf-8"))


def is_current(kept: Path, result: Path, *drawing: Path) -> bool:
    """Whether a picture is newer than its result, this folder's sources and those of `drawing`."""
    sources = [s for folder in (Path(__file__).parent, *drawing) for s in folder.glob("*.py")]
    newest = max(path.stat().st_mtime for path in (result, *sources))
    return kept.is_file() and kept.stat().st_mtime > newest


def _solution(row: Row) -> Solution:
    return read_result(row.result_file).solution  # type: ignore[arg-type]
