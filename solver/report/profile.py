"""Contact pressure along an interface against its reference, and how far it deviates.

In 2D each macro-element's constant p is drawn over its extent, and a recovered p* as a line within
each face; in 3D both are marks. The deviation is (p − reference) over the largest reference.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..case.expressions import Expression, evaluate
from ..case.solutions.base import ExactSolution
from ..lac.cells.faces import surface_points
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from ..verification.coverage import expected_coverage
from ..verification.samples import reference_where_covered
from ..verification.units import with_unit
from .charts import (
    BLUE,
    CROSS,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    RED,
    Axis,
    Chart,
    Look,
    Spec,
    interaction,
    series,
    tooltip,
)
from .layout import extents, tangent
from .unrolled import laid_flat

CONSTANT, MEANS, NODES = "p by macro-element", "means of p by face", "p at nodes"
RECOVERED, REFERENCE = "p*, recovered", "reference"
SLAVE, MASTER = "−σₙ, slave", "−σₙ, master"
BOUND, STUCK, SLIDING = "±μp", "friction where it sticks", "friction where it slips"
SHEAR = "reference of friction"
_LOOKS = {
    CONSTANT: Look(BLUE),
    MEANS: Look(BLUE),
    NODES: Look(BLUE, "diamond"),
    RECOVERED: Look(GREEN, "triangle-up", (5, 3)),
    REFERENCE: Look(INK, CROSS),
    SLAVE: Look(BLUE),
    MASTER: Look(ORANGE, "square"),
    BOUND: Look(INK),
    STUCK: Look(PURPLE),
    SLIDING: Look(RED),
    SHEAR: Look(INK, "triangle-down"),
}
# Where less than this share of the interface is pressed, only that and what is next to it is drawn.
PRESSED = 0.6
# Cosine of the turn of the normals, over what is pressed, from which on places are arc lengths.
_STRAIGHT = np.cos(np.radians(10))
# Room beside what is drawn, as a share of it: marks at the ends are whole.
_MARGIN = 0.015
# Points in each face at which p* and the reference are evaluated.
_WITHIN = np.linspace(0.0, 1.0, 5)
# Most points of a reference's line.
_MOST = 200
# Digits of a number in a chart.
_DIGITS = 7

Place = Callable[[np.ndarray], np.ndarray]


def draw_profile(
    solution: Solution, zone: ZoneResult, name: str, title: str, along: Expression | None = None
) -> Chart:
    """The pressure of a zone over its place, with the reference; below, the deviation.

    The place is the distance along the interface, or what `along` says. Multipliers at nodes are
    drawn there, over their means.
    """
    units = solution.case.about.units
    means = expected(solution, zone)
    where, place = position(solution, zone, along)
    flat = solution.mesh.points.shape[1] == 2 and along is None
    records = _of_elements(zone, place(solution.mesh.points), place, means)
    records += _of_nodes(solution, zone, place, flat)
    if flat:
        records += _within_faces(solution, zone, place)
    elif means is not None:
        records += _records(REFERENCE, s=place(zone.centre), p=means)
    low, high = _range(zone, records, means)
    records += _of_friction(solution, zone, place)
    records = [r for r in records if r.get("end", r["s"]) >= low and r["s"] <= high]
    margin = _MARGIN * (high - low)
    x = Axis("s", where, domain=(low - margin, high + margin))
    what = "contact pressure" if zone.friction is None else "contact pressure, friction"
    pressure = Axis("p", with_unit(what, units.get("stress")), zero=True)
    looks = _looks(records, flat)
    views = [_view(records, x, pressure, looks, flat, 170, first=True)]
    if means is not None:
        most = max((abs(r["deviation"]) for r in records if "deviation" in r), default=0.0)
        most = 1.25 * max(most, 1e-17)
        relative = Axis("deviation", "Δp / max p", domain=(-most, most))
        of_means = [r for r in records if "deviation" in r]
        views.append(_view(of_means, x, relative, looks, flat, 70))
    shared = {"scale": {"x": "shared"}}
    spec = {"data": {"values": records}, "vconcat": views, "resolve": shared}
    return Chart(name, title, spec, 520)


def _looks(records: Sequence[Any], flat: bool) -> dict[str, Look]:
    """The looks of the series found; in the legend, what is drawn as a line is one."""
    found = {record["series"] for record in records}
    looks = {name: look for name, look in _LOOKS.items() if name in found}
    lines = (CONSTANT, MEANS, RECOVERED, REFERENCE, BOUND, STUCK, SLIDING) if flat else ()
    return looks | {n: replace(looks[n], shape="stroke") for n in lines if n in found}


def _view(
    records: Sequence[Any],
    x: Axis,
    y: Axis,
    looks: Mapping[str, Look],
    flat: bool,
    height: int,
    first: bool = False,
) -> Spec:
    """One view: steps and lines where the interface is a line, else marks."""
    found = list(dict.fromkeys(record["series"] for record in records))
    lines = [name for name in (REFERENCE, NODES, RECOVERED) if name in found and flat]
    steps = [name for name in (CONSTANT, MEANS, BOUND, STUCK, SLIDING) if name in found and flat]
    channels = series(looks)
    shape, _ = channels.pop("shape"), channels.pop("strokeDash")
    shared = {"x": x.channel(), "y": y.channel()} | channels
    shared["y"]["axis"]["tickCount"] = max(4, height // 35)
    titles = {"series": "series", "number": "macro-element", x.field: x.title, y.field: y.title}
    tips = {"tooltip": tooltip(records, titles)}
    layers: list[Spec] = []
    if steps:
        rule = {"type": "rule", "strokeWidth": 2.5, "clip": True}
        channels = {"x2": {"field": "end"}} | tips
        layers.append({"mark": rule, "encoding": channels} | _only(steps))
    order = {"detail": {"field": "face", "type": "nominal"}}
    for name in lines:
        line = {"type": "line", "strokeWidth": 1.6, "strokeDash": looks[name].dashes, "clip": True}
        layers.append({"mark": line, "encoding": order} | _only([name]))
    marks = [name for name in found if name not in steps]
    size = {"type": "point", "strokeWidth": 1.3, "size": 22, "clip": True}
    shown = [name for name in marks if name not in (RECOVERED, REFERENCE) or not flat]
    point = {"mark": size, "encoding": {"shape": shape} | tips} | _only(shown)
    if first:
        layers.append(point | {"params": interaction()})
    elif shown:
        layers.append(point)
    return {"width": 400, "height": height, "encoding": shared, "layer": layers}


def _only(names: Sequence[str]) -> Spec:
    return {"transform": [{"filter": {"field": "series", "oneOf": list(names)}}]}


def _records(name: str, **columns: np.ndarray) -> list[dict[str, Any]]:
    """A record for each entry of the columns (n,), all of one series."""
    plain = [
        c.tolist() if c.dtype.kind in "iu" else [float(f"{v:.{_DIGITS}g}") for v in c.tolist()]
        for c in columns.values()
    ]
    return [
        {"series": name, **dict(zip(columns, r, strict=True))} for r in zip(*plain, strict=True)
    ]


def _of_elements(
    zone: ZoneResult, position: np.ndarray, place: Place, means: np.ndarray | None
) -> list[dict[str, Any]]:
    """The pressure of every macro-element: over its extent in 2D, else at its centre."""
    numbers = np.arange(len(zone.centre))
    columns = {"number": numbers, "p": zone.multiplier}
    if means is not None:
        columns["deviation"] = (zone.multiplier - means) / (np.abs(means).max() or 1.0)
    if zone.centre.shape[1] == 2:
        start, end = extents(zone, position)
        columns |= {"s": start, "end": end}
    else:
        columns["s"] = place(zone.centre)
    return _records(MEANS if zone.nodal else CONSTANT, **columns)


def _of_friction(solution: Solution, zone: ZoneResult, place: Place) -> list[dict[str, Any]]:
    """The traction on the slave and ±μp; in 2D along the interface, else the size of both."""
    if zone.friction is None:
        return []
    mu = solution.case.zone_named(zone.name).friction
    columns = {"number": np.arange(len(zone.centre)), "s": place(zone.centre)}
    along = np.column_stack([zone.normal[:, 1], -zone.normal[:, 0]])
    flat = zone.centre.shape[1] == 2
    if flat:
        start, end = extents(zone, place(solution.mesh.points))
        columns |= {"s": start, "end": end}
        step = 1e-6 * np.sqrt(zone.area)[:, None] * along
        along *= np.sign(place(zone.centre + step) - place(zone.centre - step))[:, None]

    def signed(vectors: np.ndarray) -> np.ndarray:
        return (vectors * along).sum(1) if flat else np.linalg.norm(vectors, axis=1)

    found = []
    for sign in (1.0, -1.0)[: 1 + flat]:
        found += _records(BOUND, **columns, p=sign * mu * zone.multiplier)
    traction = signed(zone.friction.friction_traction)
    for name, status in ((STUCK, 1), (SLIDING, 2)):
        mine = zone.friction.status == status
        found += _records(name, **{k: c[mine] for k, c in columns.items()}, p=traction[mine])
    exact = solution.case.exact_contact
    if exact and "friction_traction" in exact.quantities:
        values = ExactValues(solution, exact).of_friction(zone, "friction_traction")
        found += _records(SHEAR, s=place(zone.centre), p=signed(values))
    return found


def _of_nodes(
    solution: Solution, zone: ZoneResult, place: Place, flat: bool
) -> list[dict[str, Any]]:
    """Values at nodes: multipliers, p* in 3D, and in 2D the stress on both surfaces."""
    given = []
    if zone.nodal:
        given.append((NODES, zone.nodal.nodes, zone.nodal.multiplier))
    if zone.recovered and not flat:
        given.append((RECOVERED, zone.recovered.nodes, zone.recovered.at_nodes))
    if flat:
        given.append((SLAVE, zone.surfaces.slave_nodes, -zone.surfaces.stress_slave))
        given.append((MASTER, zone.surfaces.master_nodes, -zone.surfaces.stress_master))
    points, found = solution.mesh.points, []
    for name, nodes, values in given:
        found += _records(name, s=place(points[nodes]), p=values)
    return found


def _within_faces(solution: Solution, zone: ZoneResult, place: Place) -> list[dict[str, Any]]:
    """Along the faces of an interface in the plane: p* by face, and the reference."""
    points, found, first = solution.mesh.points, [], 0
    for _, nodes, owner in zone.faces:
        ends = points[nodes[:, :2]]
        where = ends[:, :1] + _WITHIN[:, None] * (ends[:, 1:] - ends[:, :1])
        at = np.sort(place(where.reshape(-1, 2)).reshape(where.shape[:2]), axis=1)
        if zone.recovered:
            values = zone.recovered.values(zone.multiplier, owner, where)
            order = np.argsort(place(where.reshape(-1, 2)).reshape(where.shape[:2]), axis=1)
            values = np.take_along_axis(values, order, axis=1)
            closed = zone.closed[owner]
            face = np.repeat(first + np.arange(len(nodes))[closed], len(_WITHIN))
            found += _records(RECOVERED, s=at[closed].ravel(), p=values[closed].ravel(), face=face)
        first += len(nodes)
    against = reference(solution, "contact_pressure")
    if against is not None:
        on_faces = surface_points(points, zone.faces)
        where, covered = on_faces.place, expected_coverage(solution, zone, against) > 0
        if isinstance(against, ExactValues):
            values = against.exact.contact_pressure(where)
        else:
            values = np.where(covered[on_faces.macro], evaluate(against, where), 0.0)
        at = place(where)
        order = np.argsort(at, kind="stable")[:: -(-len(at) // _MOST) or 1]
        found += _records(REFERENCE, s=at[order], p=values[order])
    return found


def expected(solution: Solution, zone: ZoneResult) -> np.ndarray | None:
    """The reference's pressure (m,) on macro-elements, zero on uncovered ones; None without one."""
    against = reference(solution, "contact_pressure")
    return None if against is None else reference_where_covered(solution, zone, against)


def reference(solution: Solution, key: str) -> Any:
    """What the checks compare a quantity with, an exact solution as its values on this mesh."""
    found = solution.case.compared_with(key)
    return ExactValues(solution, found) if isinstance(found, ExactSolution) else found


def position(solution: Solution, zone: ZoneResult, along: Expression | None) -> tuple[str, Place]:
    """The abscissa: its name with its unit, and its value (n,) at points (n, dim)."""
    length = solution.case.about.units.get("length")
    if along is not None:
        return mathematics(along.text), along
    if zone.centre.shape[1] == 3:
        flat = laid_flat(zone)
        name = flat.profile_name
        return name if flat.profile_is_angle else with_unit(name, length), flat.profile
    normals = zone.normal[zone.multiplier > 0]
    if len(normals) and (normals @ normals.T).min() < _STRAIGHT:
        arc = Arc.of(solution.mesh.points, zone)
        x, y = (f"{value:.4g}" for value in arc.ends[0, 0] + 0.0)
        return with_unit(f"arc length s from ({x}, {y})", length), arc
    direction = tangent(zone)
    name = next(("xy"[i] for i in (0, 1) if direction[i] > 1 - 1e-9), "s along the interface")
    return with_unit(name, length), lambda points: points @ direction


@dataclass(frozen=True)
class Arc:
    """The arc length along slave faces in the plane: `ends` (f, 2, 2), its `start` (f,) on each."""

    ends: np.ndarray
    start: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray, zone: ZoneResult) -> "Arc":
        """Faces one after another, from an end of the interface or, on a ring, its largest x."""
        pairs = np.concatenate([nodes[:, :2] for _, nodes, _ in zone.faces])
        after = {int(a): i for i, (a, _) in enumerate(pairs)}
        start_points = [
            *sorted(after.keys() - set(pairs[:, 1].tolist())),
            *sorted(after, key=lambda node: tuple(-points[node])),
        ]
        chain: list[int] = []
        seen: set[int] = set()
        for first in start_points:
            node = first
            while (face := after.get(node)) is not None and face not in seen:
                seen.add(face)
                chain.append(face)
                node = int(pairs[face, 1])
        ends = points[pairs[chain]]
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        return cls(ends, np.concatenate([[0.0], np.cumsum(lengths)[:-1]]))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """The arc length (n,) of the places on the faces that are next to points (n, 2)."""
        first, edge = self.ends[:, 0], self.ends[:, 1] - self.ends[:, 0]
        away = points[:, None] - first
        share = np.clip((away * edge).sum(-1) / (edge**2).sum(-1), 0.0, 1.0)
        distance = np.linalg.norm(away - share[..., None] * edge, axis=-1)
        nearest = distance.argmin(axis=1)
        length = np.linalg.norm(edge, axis=1)[nearest]
        return self.start[nearest] + share[np.arange(len(points)), nearest] * length


def mathematics(text: str) -> str:
    """An expression of a case file as people write it: `sqrt(x**2)` is √(x²)."""
    text = re.sub(r"\*\*(\d)(?!\d)", lambda m: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(m[1])], text)
    for code, sign in (("sqrt", "√"), ("pi", "π"), ("**", "^"), ("*", "·"), ("-", "−")):
        text = text.replace(code, sign)
    return text


def _range(
    zone: ZoneResult, records: Sequence[dict[str, Any]], means: np.ndarray | None
) -> tuple[float, float]:
    """The part of the interface that is drawn: all, or where little is pressed, that and some."""
    elements = [record for record in records if "number" in record]
    first = np.array([record["s"] for record in elements])
    last = np.array([record.get("end", record["s"]) for record in elements])
    pressed = (zone.multiplier > 0) | (means is not None and np.asarray(means) > 0)
    low, high = float(first.min()), float(last.max())
    if pressed.any():
        start, end = float(first[pressed].min()), float(last[pressed].max())
        if end - start < PRESSED * (high - low):
            more = 0.25 * (end - start)
            low, high = max(low, start - more), min(high, end + more)
    return (low, high) if high > low else (low - 0.5, high + 0.5)
