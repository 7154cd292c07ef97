"""The pictures of the solves, drawn anew only where a result or the drawing has changed."""

from pathlib import Path

from markupsafe import Markup

from solver.errors import InputError
from solver.files import replacing
from solver.report.rows import Row

MOST_CELLS = 100_000


def picture(row: Row, folder: Path) -> Markup:
    """The picture of one solve, kept in `folder`; a line that says why there is none."""
    if row.result_file is None:
        return Markup("<p class=none>No result, no picture.</p>")
    kept = folder / f"{row.group}-{row.folder.name}.svg"
    if not _is_current(kept, row.result_file):
        try:
            drawing = _draw(row)
        except (InputError, OSError, LookupError, ValueError, ArithmeticError) as error:
            reason = f"{type(error).__name__}: {error}"
            return Markup("<p class=none>No picture: {}</p>").format(reason)
        with replacing(kept) as temporary:
            temporary.write_text(drawing, encoding="utf-8")
    return Markup(kept.read_text(encoding="utf-8"))


def _is_current(kept: Path, result: Path) -> bool:
    sources = Path(__file__).parent.glob("*.py")
    newest = max(path.stat().st_mtime for path in (result, *sources))
    return kept.is_file() and kept.stat().st_mtime > newest


def _draw(row: Row) -> Markup:
    from solver.results import read_result

    solution = read_result(row.result_file).solution  # type: ignore[arg-type]
    cells = sum(len(block.data) for block in solution.mesh.cells)
    if cells > MOST_CELLS:
        raise ValueError(f"{cells} cells are too many to draw")
    title = f"{row.name}: meshes and contact pressure"
    if solution.mesh.points.shape[1] == 2:
        from solver.report.plane import draw_plane

        return draw_plane(solution, title)
    from solver.report.space import draw_space

    return draw_space(solution, title)
