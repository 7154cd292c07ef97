"""A result as surfaces that a browser turns: triangles, edges of cells, displacement, maps.

A map is a field at the points of some parts of the picture: a value, or its error where the case
has a reference for it.
"""

import base64
import json
from typing import Any

import numpy as np

from ..lac.cells.catalogue import cell_type
from ..simulation.results.solution import Solution
from ..verification import samples
from ..verification.units import with_unit
from .layout import color_map, mean_normal
from .parts import DrawnPart, parts, three, zone_fields
from .profile import reference
from .view import AZIMUTH, ELEVATION

# A file of more points is too large for a page.
MOST_POINTS = 200_000
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
    whole = np.concatenate([part.points[part.used] for part in drawn])
    fields: dict[str, list[np.ndarray]] = {}
    for _, own in reversed(found):
        for title, values in own.items():
            fields.setdefault(title, []).append(values)
    content = {
        "dim": dim,
        "length": solution.length,
        "eye": [float(AZIMUTH), float(np.copysign(ELEVATION, mean_normal(solution)[-1]))],
        "factor": magnification(solution.displacement, solution.length),
        "whole": [whole.min(axis=0).tolist(), whole.max(axis=0).tolist()],
        "contact": _contact(solution),
        "maps": [
            {"title": title, "limits": limits, "colors": colors}
            for title, values in fields.items()
            for limits, colors in [color_map(title, np.concatenate(values))]
        ],
        "parts": [plain | {"fields": _packed(own)} for plain, own in found],
    }
    text = json.dumps([file, content], ensure_ascii=False, separators=(",", ":"))
    return f"surfaces(...{text});\n".replace("<", "\\u003c")


def _contact(solution: Solution) -> list[list[float]] | None:
    """The box around what is pressed."""
    points = three(solution.mesh.points)
    faces = [(zone, nodes, owner) for zone in solution.zones for _, nodes, owner in zone.faces]
    pressed = [points[f[zone.multiplier[owner] > 0]].reshape(-1, 3) for zone, f, owner in faces]
    found = np.concatenate([np.empty((0, 3)), *pressed])
    return [found.min(axis=0).tolist(), found.max(axis=0).tolist()] if len(found) else None


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
