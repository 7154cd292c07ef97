"""A case's exact solution on the mesh of a solve: parts, and values at nodes and macro-elements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from ...case.solutions.base import ExactSolution
from ...lac.cells.catalogue import cell_type
from ...lac.cells.faces import FACE_POINTS, nodal_normals
from ...lac.cells.shape import gauss_rule, shape_functions
from ...mechanics.fem.faces import means_on_faces
from ...mechanics.fem.stress import normal_stress
from .solution import Solution, ZoneResult


def computed_pressure(points: np.ndarray, zone: ZoneResult) -> np.ndarray:
    """The computed pressure (k,) at the `surface_points` of a zone on the mesh's `points`."""
    return np.concatenate(
        [
            pressure_on(points, zone, name, nodes, owner, gauss_rule(name, FACE_POINTS)[0]).ravel()
            for name, nodes, owner in zone.faces
        ]
    )


def pressure_on(
    points: np.ndarray,
    zone: ZoneResult,
    name: str,
    nodes: np.ndarray,
    owner: np.ndarray,
    reference: np.ndarray,
) -> np.ndarray:
    """The pressure (s, q) on faces (s, n_nodes) of macro-elements (s,), at reference points (q, t).

    Each face may have points of its own: (s, q, t).
    The recovered one, or that of each macro-element, or, between multipliers at nodes, linear (or
    what the shape functions make of it where all nodes of a face have one).
    """
    if zone.recovered is not None:
        places = shape_functions(name).values(reference) @ points[nodes]
        return zone.recovered.values(zone.multiplier, owner, places)
    if zone.nodal is None:
        return np.repeat(zone.multiplier[owner][:, None], reference.shape[-2], axis=1)
    kind = cell_type(name)
    at_all = np.isin(nodes, zone.nodal.nodes).all()
    own = nodes if at_all else nodes[:, : kind.n_vertices]
    pressure = zone.nodal.multiplier[np.searchsorted(zone.nodal.nodes, own)]
    values = shape_functions(name if at_all else kind.skeleton).values(reference)
    return (values @ pressure[:, :, None])[..., 0]


class ExactValues:
    """The values of `solution` under a key of the reference, on one solve's mesh."""

    def __init__(self, solution: Solution, exact: ExactSolution):
        self.solution, self.exact = solution, exact
        self._contact: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    def _means(self, zone: ZoneResult, values: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """The means (c, m) over macro-elements of what a function of places has."""
        points, around = self.solution.mesh.points, self.solution.case.axisymmetric
        return means_on_faces(points, zone.faces, values, around)

    @cached_property
    def part(self) -> np.ndarray:
        """The part (n,) of each node."""
        return self.exact.node_parts(self.solution.mesh.points, self.solution.fields.body)

    def displacement(self, nodes: np.ndarray) -> np.ndarray:
        """Displacement (k, dim) at nodes."""
        return self.exact.displacement(self.solution.mesh.points[nodes], self.part[nodes])

    def stress(self, nodes: np.ndarray) -> np.ndarray:
        """Stress (k, 6) at nodes."""
        return self.exact.stress(self.solution.mesh.points[nodes], self.part[nodes])

    def stress_along_contact(self, nodes: np.ndarray) -> np.ndarray:
        """d·σ·d (k,) at nodes, d being the mean slave normal of the first zone."""
        if not self.solution.zones:
            direction = np.eye(self.solution.mesh.points.shape[1])[-1]
        else:
            zone = self.solution.zones[0]
            direction = zone.area @ zone.normal
        return normal_stress(self.stress(nodes), direction / np.linalg.norm(direction))

    def surface_stress(
        self, nodes: np.ndarray, faces: Sequence[tuple[str, np.ndarray]]
    ) -> np.ndarray:
        """n·σ·n (k,) at nodes of a surface, n being its normals on the mesh."""
        normals = nodal_normals(self.solution.mesh.points, list(faces))[nodes]
        return normal_stress(self.stress(nodes), normals)

    def pressure(self, zone: ZoneResult) -> np.ndarray:
        """The mean contact pressure (m,) of each macro-element."""
        return self._of_contact(zone)[0]

    def _of_contact(self, zone: ZoneResult) -> tuple[np.ndarray, np.ndarray]:
        """Mean pressure (m,) and share in contact (m,); several checks ask for them."""
        if zone.name not in self._contact:

            def values(place: np.ndarray) -> np.ndarray:
                pressure = self.exact.contact_pressure(place)
                return np.stack([pressure, pressure > 0])

            mean, share = self._means(zone, values)
            self._contact[zone.name] = mean, share
        return self._contact[zone.name]

    def gap(self, zone: ZoneResult) -> np.ndarray:
        """The mean gap (m,) of each macro-element."""
        [mean] = self._means(zone, lambda place: self.exact.gap(place)[None])
        return mean

    def of_friction(self, zone: ZoneResult, quantity: str) -> np.ndarray:
        """The mean friction traction on the slave, or slip of the master, (m, dim).

        The solution has them for its first part: for the other one both change their sign.
        """
        mean = self._means(zone, lambda place: getattr(self.exact, quantity)(place).T).T
        return self._side(zone) * mean

    def friction_traction(self, zone: ZoneResult, places: np.ndarray) -> np.ndarray:
        """The friction traction (k, dim) on the slave at places (k, dim)."""
        return self._side(zone) * self.exact.friction_traction(places)

    def _side(self, zone: ZoneResult) -> float:
        """1 where the slave is the first part, else −1."""
        return 1.0 if self.part[zone.surfaces.slave_nodes[0]] == 0 else -1.0

    def ends_within(self, zone: ZoneResult) -> np.ndarray:
        """Which macro-elements (m,) the contact area covers in part only."""
        share = self._of_contact(zone)[1]
        return (share > 0) & (share < 1 - 1e-9)
