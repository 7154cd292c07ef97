"""The pictures of the solves, drawn anew only where a result or the drawing has changed."""

import json
from collections.abc import Callable
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from ..case.expressions import Expression
from ..simulation.results.solution import Solution
from ..system.errors import InputError
from ..system.files import write_text
from ..verification.results import read_result
from .case_picture import SIZES, draw_case
from .charts import Chart
from .html import TEMPLATES, render
from .profile import draw_profile
from .rows import Row
from .surfaces import surfaces

VIEWER = "viewer.js"


def draw_all(row: Row, folder: Path, solution: Solution | None = None) -> None:
    """Draw what pages show of a solve, unless `folder` has it; `solution` is that of its result."""
    picture(row, folder, solution)
    if row.dim == 2:
        profile(row, folder, solution=solution)


def picture(row: Row, folder: Path, solution: Solution | None = None) -> Markup:
    """The picture of one solve, a file in `folder`, and a button that turns its surfaces.

    A line with the reason where there is no picture, or nothing to turn.
    """
    if row.result_file is None:
        return Markup("<p class=none>No result, no picture.</p>")
    name, (width, height) = f"{folder.name}/{name_of(row)}", SIZES.get(row.dim, SIZES[3])
    shown = _kept(row, folder, "picture", ".svg", lambda of: draw(of, row.name), solution)
    if not isinstance(shown, Markup):
        size = f"width={width} height={height}"
        tag = f'<img class=mesh loading=lazy {size} src="{{}}.svg" alt="{{}}: meshes and contact">'
        shown = Markup(tag).format(quote(name), row.name)
    file = f"{quote(name)}.js"
    turned = _kept(row, folder, "view to turn", ".js", lambda of: surfaces(of, file), solution)
    if not isinstance(turned, Markup):
        button = "<button type=button data-surfaces='{}' hidden>Turn, zoom, maps of errors</button>"
        turned = Markup(button).format(file)
    return shown + turned


def write_viewer(folder: Path) -> None:
    """Write the script that turns results into `folder`."""
    write_text(folder / VIEWER, _viewer())


def page(solution: Solution, name: str) -> str:
    """A page of one result that stands alone: its picture, and its surfaces to be turned."""
    return render(
        TEMPLATES / "result.html.jinja",
        title=name,
        name=name,
        picture=draw(solution, name),
        surfaces=Markup(surfaces(solution, name)),
        viewer=Markup(_viewer()),
    )


def _viewer() -> str:
    return (TEMPLATES / VIEWER).read_text(encoding="utf-8")


def profile(
    row: Row, folder: Path, along: Expression | None = None, solution: Solution | None = None
) -> Chart | Markup:
    """The pressure of one solve's first zone along the interface, kept in `folder` too."""

    def drawn(solution: Solution) -> str:
        return json.dumps(vars(draw_pressure(solution, row.name, along)))

    over = f"-{sha256(along.text.encode()).hexdigest()[:8]}" if along else ""
    kept = _kept(row, folder, "chart", f"-profile{over}.json", drawn, solution)
    return kept if isinstance(kept, Markup) else Chart(**json.loads(kept))


def draw(solution: Solution, name: str) -> Markup:
    """Meshes and contact pressure; raises ValueError where there are too many faces to draw."""
    return draw_case(solution, f"{name}: meshes and contact pressure")


def draw_pressure(
    solution: Solution, name: str, along: Expression | None = None, zone: str | None = None
) -> Chart:
    """The pressure of a zone, the first or the one named, along the interface.

    Raises ValueError for an unknown zone.
    """
    shown = next((z for z in solution.zones if zone in (None, z.name)), None)
    if shown is None:
        raise ValueError(f"there is no contact zone {zone}" if zone else "no contact, no pressure")
    title = f"{name}: contact pressure along the interface"
    return draw_profile(solution, shown, f"pressure-{name}", title, along)


def _kept(
    row: Row,
    folder: Path,
    what: str,
    ending: str,
    draw: Callable[[Solution], str],
    solution: Solution | None,
) -> str:
    """A drawing as kept in `folder`, or drawn and kept there; else a line with the reason."""
    if row.result_file is None:
        return Markup("<p class=none>No result, no {}.</p>").format(what)
    kept = folder / f"{name_of(row)}{ending}"
    if not _is_current(kept, row.result_file):
        try:
            drawing = draw(solution or _solution(row))
        except (InputError, OSError, LookupError, ValueError, ArithmeticError) as error:
            reason = f"{type(error).__name__}: {error}"
            return Markup("<p class=none>No {}: {}</p>").format(what, reason)
        write_text(kept, str(drawing))
    return kept.read_text(encoding="utf-8")


def name_of(row: Row) -> str:
    """The name of the files of a solve's pictures, without their endings."""
    return f"{row.group}-{row.folder.name}"


def _is_current(kept: Path, result: Path) -> bool:
    """Whether a picture is newer than its result and the sources of this folder."""
    newest = max(result.stat().st_mtime, _changed())
    return kept.is_file() and kept.stat().st_mtime > newest


@cache
def _changed() -> float:
    """When the sources of this folder last changed."""
    return max(path.stat().st_mtime for path in Path(__file__).parent.glob("*.py"))


def _solution(row: Row) -> Solution:
    assert row.result_file is not None
    return _read(row.result_file, row.result_file.stat().st_mtime)


@lru_cache(maxsize=1)
def _read(file: Path, _time: float) -> Solution:
    """A result: picture and profile of one solve are drawn one after the other."""
    return read_result(file).solution
