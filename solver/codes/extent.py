"""At how many of the places of its case a foreign result has values: what a verdict speaks of."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..lac.cells.catalogue import BY_MESHIO
from .compared import Compared
from .contact import SurfaceValues
from .placing import NEAR

# A macro-element has a value where one is no farther than so many times the distance of values.
_BESIDE = 1.5
# Values at this share of all places are values everywhere: files leave out a node at times.
_ALL = 0.995


class Extent(NamedTuple):
    """At what number of how many places a field is compared, and what these are."""

    number: int
    total: int
    what: str

    @property
    def whole(self) -> bool:
        """Whether nothing is left out that matters."""
        return self.number >= _ALL * self.total

    def __str__(self) -> str:
        return f"{self.number} of {self.total} {self.what}"


def extents(compared: Compared) -> dict[str, Extent]:
    """By field that is given, where it is."""
    found: dict[str, Extent] = {}
    for name in ("displacement", "stress"):
        if name in compared.placed:
            found[name] = _in_bodies(compared, name)
    for name, given in (("pressure", compared.pressures_by_zone), ("gap", compared.gaps_by_zone)):
        if name in compared.placed:
            found[name] = _on_surfaces(compared, given)
    return found


def _in_bodies(compared: Compared, name: str) -> Extent:
    """Vertices of deformable cells, of the result's own mesh where it is another one."""
    model, placed = compared.model, compared.placed[name]
    points, used = model.points, ~model.rigid[model.body]
    if compared.own is not None:
        points = compared.own.mesh.points
        used = np.ones(len(points), dtype=bool)
    cells = compared.own.mesh.cells if compared.own is not None else model.mesh.cells
    vertex = np.zeros(len(points), dtype=bool)
    for block in cells:
        if block.dim == model.dim:
            vertex[block.data[:, : BY_MESHIO[block.type].n_vertices]] = True
    wanted = points[vertex & used]
    distance, _ = cKDTree(placed.places).query(wanted)
    near = NEAR * model.length
    if (placed.node < 0).all() and compared.own is None:
        near = _BESIDE * _spacing(placed.places)  # of cells, say
    bodies = placed.body[placed.body >= 0]
    if len(bodies) and compared.own is None:
        # Bodies that touch have nodes at one place: a body without a value inside it has none.
        inside = np.isin(model.body[vertex & used], bodies)
        distance = np.where(inside, distance, np.inf)
    return Extent(int((distance <= near).sum()), len(wanted), "nodes")


def _spacing(places: np.ndarray) -> float:
    """The usual distance of places (k, dim) from the nearest other one; 0 of a single one."""
    if len(places) < 2:
        return 0.0
    apart, _ = cKDTree(places).query(places, k=2)
    return float(np.median(apart[:, 1]))


def _on_surfaces(compared: Compared, given: list[SurfaceValues]) -> Extent:
    count = total = 0
    for zone in compared.model.solution.zones:
        covered = zone.coverage > 0
        total += int(covered.sum())
        for surface in given:
            if surface.zone.name != zone.name:
                continue
            places = surface.placed.places
            size = compared.model.face_size(zone)
            near, _ = cKDTree(places).query(zone.centre)
            beside = _BESIDE * np.maximum(size, _spacing(places))
            count += int((covered & (near <= beside)).sum())
    return Extent(count, total, "contact faces")
