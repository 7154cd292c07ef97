"""A result as surfaces that a browser turns: triangles, edges of cells, displacement, maps.

Parts are the bodies, and the slave faces of each zone. A map is a field at the points of some
parts: a value, or its error where the case has a reference for it.
"""

import base64
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..mechanics.fem.faces import outer_faces
from ..mesh.catalogue import cell_type
from ..simulation.solution import Solution, ZoneResult
from ..verification import samples
from ..verification.units import with_unit
from .charts import BLUE, PAPER
from .layout import edge_color, mean_normal, tint, ways_apart
from .obstacles import obstacle
from .profile import expected, reference
from .space import AZIMUTH, DEVIATION, ELEVATION, PRESSURE
from .svg import mixed

_DEVIATION = "Δp / max p"
# Values of the other sign below this share of the largest are round-off.
_NO_SIGN = 1e-9
# Errors without a sign, from none to the largest.
ERROR = ("#fff7ec", "#fdd49e", "#fc8d59", "#d7301f", "#7f0000")
# A file of more points is too large for a page.
MOST_POINTS = 200_000
_Faces = list[tuple[str, np.ndarray]]
# Maps of errors at nodes: key of the reference, title, sampler of the check.
_ERRORS = {
    "displacement": ("|Δu| / max |u|", samples.displacement),
    "stress": ("|Δσ| / max |σ|", samples.stress_components),
    "normal_stress": ("|Δσₙ| / max |σₙ|", samples.nodal_stress),
}


@dataclass
class DrawnSurface:
    """One surface: its `points` (n, 3), `displacement` (n, 3), `triangles` (t, 3), `edges` (e, 2).

    `fields` by the title of the map, (n,); `apart` (3,): where it goes when bodies are moved apart.
    """

    name: str
    role: str
    body: bool
    color: str
    fill: str
    apart: np.ndarray
    points: np.ndarray
    displacement: np.ndarray
    triangles: np.ndarray
    edges: np.ndarray
    fields: dict[str, np.ndarray] = field(default_factory=dict)


def surfaces(solution: Solution, file: str) -> str:
    """A script that hands the surfaces of a result to `viewer.js`, under the name of its file.

    Raises ValueError where there are too many points.
    """
    parts, dim = list(_parts(solution)), solution.mesh.points.shape[1]
    whole = np.concatenate([part.points for part in parts])
    if len(whole) > MOST_POINTS:
        raise ValueError("too many faces to turn")
    titles = list(dict.fromkeys(title for part in parts[::-1] for title in part.fields))
    normal = mean_normal(solution)
    content = {
        "dim": dim,
        "length": solution.length,
        "eye": [float(AZIMUTH), float(np.copysign(ELEVATION, normal[-1]))],
        "factor": magnification(solution.displacement, solution.length),
        "whole": [whole.min(axis=0).tolist(), whole.max(axis=0).tolist()],
        "contact": _contact(solution),
        "maps": [_map(title, parts) for title in titles],
        "parts": [_plain(part) for part in parts],
    }
    text = json.dumps([file, content], ensure_ascii=False, separators=(",", ":"))
    return f"surfaces(...{text});\n".replace("<", "\\u003c")


def _contact(solution: Solution) -> list[list[float]] | None:
    """The box around what is pressed."""
    pressed = [
        solution.mesh.points[nodes[zone.multiplier[owner] > 0]].reshape(
            -1, solution.mesh.points.shape[1]
        )
        for zone in solution.zones
        for _, nodes, owner in zone.faces
    ]
    found = np.concatenate([np.empty((0, solution.mesh.points.shape[1])), *pressed])
    return None if not len(found) else [_three(f).tolist() for f in (found.min(0), found.max(0))]


def _map(title: str, parts: list[DrawnSurface]) -> dict[str, Any]:
    """The colours of a map: the same on both sides of zero where values have two signs."""
    values = np.concatenate([part.fields[title] for part in parts if title in part.fields])
    low, high = float(values.min()), float(values.max())
    most = max(abs(low), abs(high)) or 1.0
    both = min(-low, high) > _NO_SIGN * most or title == _DEVIATION
    colors = DEVIATION if both else ERROR if "Δ" in title else PRESSURE
    limits = [-most, most] if both else [0.0, most] if high > 0 else [-most, 0.0]
    if limits[0]:  # compression alone: dark is the largest
        colors = colors if both else colors[::-1]
    return {"title": title, "limits": limits, "colors": colors}


def _plain(part: DrawnSurface) -> dict[str, Any]:
    arrays = {
        "points": part.points.astype("<f4"),
        "displacement": part.displacement.astype("<f4"),
        "triangles": part.triangles.astype("<i4"),
        "edges": part.edges.astype("<i4"),
    }
    packed = {name: _base64(array) for name, array in arrays.items()}
    fields = {title: _base64(values.astype("<f4")) for title, values in part.fields.items()}
    named = {key: getattr(part, key) for key in ("name", "role", "body", "color", "fill")}
    return named | packed | {"fields": fields, "apart": part.apart.tolist()}


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _parts(solution: Solution) -> Iterator[DrawnSurface]:
    fields, outside, ways = _nodal_fields(solution), _outside(solution), ways_apart(solution)
    for number, body in enumerate(solution.bodies):
        look: dict[str, Any] = {
            "name": body.name,
            "role": body.role,
            "body": True,
            "apart": _three(ways[number]),
        }
        look |= {"color": edge_color(body), "fill": tint(body)}
        if shape := obstacle(solution, body.name):
            motion = _motion(solution, number)
            yield DrawnSurface(
                **look,
                points=_three(shape.points),
                displacement=_three(motion(shape.points)),
                **_split([("QUAD4" if shape.faces.shape[1] == 4 else "SEG2", shape.faces)]),
            )
            continue
        own = [(kind, nodes[solution.body[nodes[:, 0]] == number]) for kind, nodes in outside]
        used = np.unique(np.concatenate([nodes.ravel() for _, nodes in own]))
        yield DrawnSurface(
            **look,
            points=_three(solution.mesh.points[used]),
            displacement=_three(solution.displacement[used]),
            **_split([(kind, np.searchsorted(used, nodes)) for kind, nodes in own]),
            fields={title: values[used] for title, values in fields.items()},
        )
    for zone in solution.zones:
        yield _zone_part(solution, zone, ways[solution.body[zone.slave_nodes[0]]])


def _motion(solution: Solution, number: int) -> Callable[[np.ndarray], np.ndarray]:
    """The displacement (n, dim) at places (n, dim) of a rigid body, linear as at its nodes."""
    own = solution.body == number
    points, moved = solution.mesh.points[own], solution.displacement[own]
    linear = np.linalg.lstsq(np.c_[points, np.ones(len(points))], moved, rcond=None)[0]
    return lambda places: np.c_[places, np.ones(len(places))] @ linear


def _zone_part(solution: Solution, zone: ZoneResult, way: np.ndarray) -> DrawnSurface:
    """The slave faces of a zone; each has points of its own, since values jump between them."""
    units = solution.case.units
    titles = {
        with_unit("contact pressure p", units.get("stress")): zone.multiplier,
        with_unit("gap", units.get("length")): zone.gap,
    }
    means = expected(solution, zone)
    if means is not None:
        titles[_DEVIATION] = (zone.multiplier - means) / (np.abs(means).max() or 1.0)
    found, first = [], 0
    for kind, nodes, owner in zone.faces:
        local = first + np.arange(nodes.size).reshape(nodes.shape)
        found.append((nodes.ravel(), np.repeat(owner, nodes.shape[1]), kind, local))
        first += nodes.size
    nodes, owner = (np.concatenate([part[i] for part in found]) for i in (0, 1))
    return DrawnSurface(
        name=f"{zone.name}: slave faces",
        body=False,
        role="slave",
        color=BLUE,
        fill=mixed(BLUE, PAPER, 0.8),
        apart=_three(way),
        points=_three(solution.mesh.points[nodes]),
        displacement=_three(solution.displacement[nodes]),
        **_split([(kind, local) for *_, kind, local in found]),
        fields={title: values[owner] for title, values in titles.items()},
    )


def _nodal_fields(solution: Solution) -> dict[str, np.ndarray]:
    """Fields at all nodes (n,), and errors where the case has a reference; none on rigid bodies."""
    size = np.linalg.norm(solution.displacement, axis=1)
    units = solution.case.units
    found = {
        with_unit("displacement |u|", units.get("length")): size,
        with_unit("normal stress σₙ", units.get("stress")): solution.nodal_normal_stress,
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


def _outside(solution: Solution) -> _Faces:
    if solution.mesh.points.shape[1] == 2:
        return [(cell_type(b.type).name, b.data) for b in solution.mesh.cells if len(b.data)]
    return list(outer_faces(solution.mesh))


def _split(faces: _Faces) -> dict[str, Any]:
    """Faces as triangles (t, 3), mid-nodes in; and the edges (e, 2) around them, each once."""
    triangles, edges = [np.empty((0, 3), int)], [np.empty((0, 2), int)]
    for kind, nodes in faces:
        face = cell_type(kind)
        ring = list(face.boundary)
        edges += [nodes[:, [a, b]] for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
        if face.dim == 1:
            continue
        if face.order == 2:  # a triangle at each corner, and what is left between the mid-nodes
            triangles += [
                nodes[:, [ring[i - 1], ring[i], ring[i + 1]]] for i in range(0, len(ring), 2)
            ]
            ring = ring[1::2]
        triangles += [nodes[:, [ring[0], ring[i], ring[i + 1]]] for i in range(1, len(ring) - 1)]
    around = np.unique(np.sort(np.concatenate(edges), axis=1), axis=0)
    return {"triangles": np.concatenate(triangles), "edges": around}


def _three(vectors: np.ndarray) -> np.ndarray:
    """Vectors (…, dim) with a third component, zero in the plane."""
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, 3 - vectors.shape[-1])])


def magnification(displacement: np.ndarray, size: float) -> float:
    """The factor by which a displacement (n, dim) is enlarged on a model of that size.

    The largest becomes at most a sixteenth of the size; the factor is 1, 2 or 5 times a power of
    ten.
    """
    largest = float(np.linalg.norm(displacement, axis=1).max(initial=0.0))
    wanted = size / (16 * largest) if largest else 1.0
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(max(m * decade for m in (1, 2, 5) if m * decade <= wanted * (1 + 1e-9)))
