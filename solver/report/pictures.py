"""The pictures of the solves: surfaces that a browser turns, drawn anew only where needed.

A picture has triangles, edges of cells, displacement and maps. A map is a field at the points of
some parts of the picture: a value, or its error where the case has a reference for it. It is drawn
anew where a result or the drawing has changed.
"""

import base64
import json
from collections.abc import Callable, Iterator
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from ..case.expressions import Expression
from ..lac.cells.catalogue import cell_type
from ..simulation.results.solution import Solution
from ..system.errors import InputError
from ..system.files import write_text
from ..verification import samples
from ..verification.results import read_result
from ..verification.units import with_unit
from .case_picture import SIZES, draw_case
from .charts import Chart
from .formats import TEMPLATES, render
from .layout import color_map, mean_normal
from .parts import DrawnPart, carried, parts, three, zone_fields
from .profile import draw_profile, reference
from .rows import Row
from .view import AZIMUTH, ELEVATION

# A file of more points is too large for a page.
MOST_POINTS = 200_000
# A normal that leans by so much (a sine) is looked at from its side, so far beside it (radians).
_ASKEW, _BESIDE = 0.5, float(np.radians(30))
# Maps of errors at nodes: key of the reference, title, sampler of the check.
_ERRORS = {
    "displacement": ("|Δu| / max |u|", samples.displacement),
    "stress": ("|Δσ| / max |σ|", samples.stress_components),
    "normal_stress": ("|Δσₙ| / max |σₙ|", samples.nodal_stress),
}
Fields = dict[str, np.ndarray]


def surfaces(solution: Solution, file: str) -> str:
    """A script that hands the surfaces of a result to `viewer.js`, under the name of its file.

    Raises ValueError where there are too many points.
    """
    drawn, dim = list(parts(solution)), solution.mesh.points.shape[1]
    number = sum(len(part.used) for part in drawn)
    if number > MOST_POINTS:
        raise ValueError(f"{number} points on surfaces; {MOST_POINTS} at most are allowed")
    nodal = _nodal_fields(solution)
    found = [
        _content(part, zone_fields(solution, part.zone) if part.zone else nodal) for part in drawn
    ]
    if solution.earlier:
        for part, (plain, _) in zip(drawn, found, strict=True):
            plain["earlier"] = [_packed(one) for one in _earlier(solution, part)]
    whole = np.concatenate([part.points[part.used] for part in drawn])
    fields: dict[str, list[np.ndarray]] = {}
    for _, own in reversed(found):
        for title, values in own.items():
            fields.setdefault(title, []).append(values)
    content = {
        "dim": dim,
        "length": solution.scalars.length,
        "eye": _eye(mean_normal(solution)),
        "factor": magnification(solution.displacement, solution.scalars.length),
        "whole": [whole.min(axis=0).tolist(), whole.max(axis=0).tolist()],
        "contact": _contact(solution),
        "steps": [step.factor for step in solution.steps] if solution.earlier else [],
        "maps": [
            {"title": title, "limits": limits, "colors": colors}
            for title, values in fields.items()
            for limits, colors in [color_map(title, np.concatenate(values))]
        ],
        "parts": [plain | {"fields": _packed(own)} for plain, own in found],
    }
    text = json.dumps([file, content], ensure_ascii=False, separators=(",", ":"))
    return f"surfaces(...{text});\n".replace("<", "\\u003c")


def _eye(normal: np.ndarray) -> list[float]:
    """Where a view is from (angles): the side to which a normal (dim,) of pressed faces points."""
    level, height = normal[:2], float(normal[-1])
    azimuth = float(AZIMUTH)
    if len(normal) == 3 and np.linalg.norm(level) > _ASKEW:
        azimuth = float(np.arctan2(level[1], level[0])) + _BESIDE
    return [azimuth, float(np.copysign(ELEVATION, height))]


def _contact(solution: Solution) -> list[list[float]] | None:
    """The box around what is pressed."""
    points = three(solution.mesh.points)
    faces = [(zone, nodes, owner) for zone in solution.zones for _, nodes, owner in zone.faces]
    pressed = [points[f[zone.multiplier[owner] > 0]].reshape(-1, 3) for zone, f, owner in faces]
    found = np.concatenate([np.empty((0, 3)), *pressed])
    return [found.min(axis=0).tolist(), found.max(axis=0).tolist()] if len(found) else None


def _earlier(solution: Solution, part: DrawnPart) -> Iterator[Fields]:
    """Points and displacement of a part at the positions before the last one, and its pressure."""
    dim = solution.mesh.points.shape[1]
    number = next((i for i, zone in enumerate(solution.zones) if zone is part.zone), 0)
    for position in solution.earlier:
        points = three(position.points)
        moved = three(position.at_points["displacement"][:, :dim])
        there = part.used
        if part.zone is not None:
            there = np.concatenate([nodes.ravel() for _, nodes, _ in part.faces])
        elif not part.meshed:  # a surface that the case gives goes as the nodes of its body
            own = solution.fields.body == part.body
            nodes, places = solution.mesh.points[own], part.points[:, :dim]
            moved = three(carried(places, nodes, moved[own, :dim]))
            points = three(carried(places, nodes, position.points[own]))
        found = {"points": points[there], "displacement": moved[there]}
        if part.zone is not None:
            pressure = position.of_zone("pressure", number, len(part.zone.area))
            each = [np.repeat(owner, nodes.shape[1]) for _, nodes, owner in part.faces]
            found["pressure"] = pressure[np.concatenate(each)]
        yield found


def _content(part: DrawnPart, fields: Fields) -> tuple[dict[str, Any], Fields]:
    """A part, its arrays as base64, and its fields at its points.

    Values jump between macro-elements: the faces of a zone have points of their own.
    """
    chosen = part.used
    local = [(kind, np.searchsorted(chosen, nodes)) for kind, nodes, _ in part.faces]
    if part.zone:
        chosen = np.concatenate([nodes.ravel() for _, nodes, _ in part.faces])
        each = [np.repeat(owner, nodes.shape[1]) for _, nodes, owner in part.faces]
        fields = {title: values[np.concatenate(each)] for title, values in fields.items()}
        starts = np.cumsum([0, *(nodes.size for _, nodes in local)])
        local = [
            (kind, first + np.arange(nodes.size).reshape(nodes.shape))
            for (kind, nodes), first in zip(local, starts, strict=False)
        ]
    elif part.out is None:
        fields = {title: values[chosen] for title, values in fields.items()}
    else:
        fields = {}
    arrays = {"points": part.points[chosen], "displacement": part.displacement[chosen]}
    arrays |= split(local, part.out is not None)
    look = {key: getattr(part, key) for key in ("name", "role", "color", "fill")}
    look |= {"body": part.zone is None, "apart": part.way.tolist()}
    return look | _packed(arrays), fields


def _packed(arrays: Fields) -> dict[str, str]:
    """Arrays as base64 of 4 bytes each."""
    kinds = {name: "<i4" if a.dtype.kind == "i" else "<f4" for name, a in arrays.items()}
    return {
        name: base64.b64encode(array.astype(kinds[name]).tobytes()).decode()
        for name, array in arrays.items()
    }


def _nodal_fields(solution: Solution) -> Fields:
    """Fields at all nodes (n,), and errors where the case has a reference; none on rigid bodies."""
    size = np.linalg.norm(solution.displacement, axis=1)
    units = solution.case.about.units
    found = {
        with_unit("displacement |u|", units.get("length")): size,
        with_unit("normal stress σₙ", units.get("stress")): solution.fields.normal_stress,
    }
    nodes = np.flatnonzero(solution.deformable)
    for key, (title, sampler) in _ERRORS.items():
        against = reference(solution, key)
        if against is None:
            continue
        sample = sampler(solution, None, against)
        off = np.linalg.norm((sample.values - sample.reference).reshape(-1, len(nodes)), axis=0)
        at_nodes = np.zeros(len(size))
        at_nodes[nodes] = off / (np.abs(sample.reference).max() or 1.0)
        found[title] = at_nodes
    return found


def split(faces: list[tuple[str, np.ndarray]], outline: bool = False) -> Fields:
    """Faces by type as `triangles` (t, 3), mid-nodes in, and the `edges` (e, 2) around them.

    Each edge is there once; of an outline, only those of one face.
    """
    triangles, edges = [np.empty((0, 3), int)], [np.empty((0, 2), int)]
    for kind, nodes in faces:
        face = cell_type(kind)
        ring = list(face.boundary)
        edges += [nodes[:, [a, b]] for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
        if face.dim == 1:
            outline = False
            continue
        if face.order == 2:  # a triangle at each corner, and what is left between the mid-nodes
            triangles += [
                nodes[:, [ring[i - 1], ring[i], ring[i + 1]]] for i in range(0, len(ring), 2)
            ]
            ring = ring[1::2]
        triangles += [nodes[:, [ring[0], ring[i], ring[i + 1]]] for i in range(1, len(ring) - 1)]
    pairs = np.sort(np.concatenate(edges), axis=1)
    around, count = np.unique(pairs, axis=0, return_counts=True)
    around = around[count == 1] if outline else around
    return {"triangles": np.concatenate(triangles), "edges": around}


def magnification(displacement: np.ndarray, size: float) -> float:
    """The power of ten by which a displacement (n, dim) becomes at most a tenth of a size."""
    largest = float(np.linalg.norm(displacement, axis=1).max(initial=0.0))
    wanted = size / (10 * largest) if largest else 1.0
    return float(10.0 ** np.floor(np.log10(wanted) + 1e-9))


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
