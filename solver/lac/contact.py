"""Contact between two boundaries of scikit-fem's meshes: gap matrix, and the solve with its status.

Each facet of the slave boundary carries one multiplier, its contact pressure p ≥ 0. The average gap
there is ḡ ≥ 0, and p ḡ = 0. The cells behind these facets are cut so that each facet has a node
inside. Source: Abbas, Drouet, Hild, The Local Average Contact (LAC) method, CMAME 339 (2018)
488–513.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import skfem
from scipy.sparse import bmat, csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from .cells.faces import surface_points
from .errors import SolveError
from .facets import Facets, facets, with_nodal_normals
from .meshes import cut_mesh, read_faces, unknowns_at_nodes
from .operator import gap_operator
from .status import Trial, find_status

Boundary = tuple[skfem.Mesh, str]
Gap = float | Callable[[np.ndarray], np.ndarray]
# Facets that cover less of their area have no partner, and carry no pressure.
_COVERED = 1e-9
# Pressures and gaps of this share of the largest pressure, and of the mesh, are round-off.
_ROUND_OFF = 1e-10
_SINGULAR = "the system is singular: a body may move freely"
_SINGULAR_FROM = 1e14


@dataclass(frozen=True)
class ContactState:
    """A solved contact problem.

    Attributes:
    ----------
    u
        Displacement (N,), in the numbering of the system.
    pressure
        Contact pressure (k,) by slave facet, ≥ 0, in the unit of stress.
    gap
        Average gap (k,), ≥ 0, a length; zero where closed, and where nothing is opposite.
    closed
        Whether the facets (k,) are in contact.
    iterations
        Linear solves of the search for the contact status.
    """

    u: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    closed: np.ndarray
    iterations: int


class LocalAverageContact:
    """Frictionless contact between a slave and a master boundary, which may lie on one mesh.

    Parameters
    ----------
    slave, master
        Pairs of a `skfem.Mesh` and the name of one of its boundaries. The classes are MeshTri1,
        MeshTri2, MeshQuad1, MeshQuad2, MeshTet1, MeshTet2, MeshHex1 and MeshHex2, in any pair of
        one dimension. A MeshHex1 is cut into hexahedra.
    normal
        The direction of the gap: `element`, the slave facet's own, or `nodal`, averaged at nodes.
    gap
        The initial gap, a length: a number, or a function of places (dim, n) that returns (n,). By
        default the one between the meshes as they are.
    search
        The largest distance, a length, at which the boundaries look for each other.

    Attributes:
    ----------
    mesh
        The slave's mesh after the cut, with its boundaries and subdomains: the slave's basis
        belongs here. Where both boundaries are on one mesh, the master's too.
    area, covered, initial
        By slave facet (k,), in the order of its boundary: its area, the area opposite the master,
        and the integral of the initial gap over that.

    Raises:
    ------
    ValueError
        For a class without LAC, a boundary that is unknown, empty or inside the mesh, cells that
        are flat or folded, and boundaries that do not face each other.

    Examples:
    --------
    Two squares, the upper one with three facets over two:

    >>> below = skfem.MeshQuad.init_tensor(np.linspace(0, 1, 3), np.linspace(-1, 0, 3))
    >>> above = skfem.MeshQuad.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 4))
    >>> below = below.with_boundaries({"top": lambda x: x[1] == 0})
    >>> above = above.with_boundaries({"bottom": lambda x: x[1] == 0})
    >>> contact = LocalAverageContact(slave=(above, "bottom"), master=(below, "top"))
    >>> contact.covered.round(12).tolist(), contact.mesh.nelements - above.nelements
    ([0.333333333333, 0.333333333333, 0.333333333333], 9)
    """

    def __init__(
        self,
        slave: Boundary,
        master: Boundary,
        normal: Literal["element", "nodal"] = "element",
        gap: Gap | None = None,
        search: float | None = None,
    ):
        if normal not in ("element", "nodal"):
            raise ValueError(f"normal = {normal!r}: must be element or nodal")
        if slave[0].dim() != master[0].dim():
            raise ValueError("slave, master: the meshes must be of one dimension")
        if slave[0] is master[0] and slave[1] == master[1]:
            raise ValueError(f"master = {master[1]!r}: must be another boundary than the slave")
        self.mesh, faces = cut_mesh(*slave)
        self._whole = master[0] is slave[0]
        self._master = self.mesh if self._whole else master[0]
        other = read_faces(self._master, master[1], "master")
        first = 0 if self._whole else self.mesh.p.shape[1]
        points = self.mesh.p.T if self._whole else np.hstack([self.mesh.p, master[0].p]).T
        count = int(faces.macro.max()) + 1
        slaves = [facets(points, faces.type, faces.nodes, faces.macro)]
        if normal == "nodal":
            slaves = with_nodal_normals(slaves, points)
        masters = [facets(points, other.type, other.nodes + first, other.number)]
        operator = gap_operator(slaves, masters, count, len(points), search)
        self._matrix = operator.matrix
        self.area, self.covered = operator.area, operator.covered
        if not (self.covered > _COVERED * self.area).any():
            raise ValueError(f"slave = {slave[1]!r}: no facet of {master[1]!r} is opposite to it")
        self.initial = operator.initial if gap is None else self._given(slaves, points, gap)

    def _given(self, slaves: list[Facets], points: np.ndarray, gap: Gap) -> np.ndarray:
        """The integral (k,) of a given initial gap over the covered part of each facet."""
        faces = [(block.type.name, block.nodes, block.number) for block in slaves]
        at = surface_points(points, faces)
        value = gap(at.place.T) if callable(gap) else np.full(len(at.weight), float(gap))
        return np.asarray(at.means(np.asarray(value, dtype=float)) * self.covered)

    def matrix(self, slave_basis: Any, master_basis: Any) -> csr_matrix:
        """B, the derivative of the gap's integral on each facet.

        Parameters
        ----------
        slave_basis, master_basis
            Bases of `ElementVector(mesh.elem())` on `mesh` and on the master's mesh. Where both
            boundaries are on one mesh, one basis twice.

        Returns:
        -------
        csr_matrix
            (k, N), an area. Pressures p exert the forces `B.T @ p`. The master's unknowns follow
            the slave's, as in `skfem.bmat` and with `Dofs(offset=)`.

        Raises:
        ------
        ValueError
            For a basis of another element, whose gaps would be others, and on another mesh.
        """
        slave = unknowns_at_nodes(slave_basis, self.mesh, "slave")
        if self._whole:
            unknown = slave.T.ravel()
            size = slave_basis.N
        else:
            master = unknowns_at_nodes(master_basis, self._master, "master")
            if master.min() < slave_basis.N:
                master = master + slave_basis.N
            unknown = np.hstack([slave, master]).T.ravel()
            size = max(slave_basis.N, int(unknown.max()) + 1)
        entries = self._matrix.tocoo()
        shape = len(self.area), size
        return csr_matrix((entries.data, (entries.row, unknown[entries.col])), shape=shape)

    def solve(
        self,
        K: Any,
        f: np.ndarray,
        B: csr_matrix,
        x: np.ndarray | None = None,
        D: np.ndarray | None = None,
    ) -> ContactState:
        """Solve K u = f + Bᵀ p with u = x at the unknowns D, and find the contact status.

        The arguments are those of `skfem.condense`, and B is that of `matrix`.

        Raises:
        ------
        RuntimeError
            Where a body may move freely, and where no status fulfils the conditions.
        """
        system = _System(self, K.tocsr(), np.asarray(f, dtype=float), B, x, D)
        touching = self.covered > _COVERED * self.area
        found = find_status(system.trial, touching, touching, self.area, system.stiffness)
        system.trial(found.closed)
        return ContactState(
            system.displacement, system.pressure, system.gap, found.closed, found.iterations
        )


class _System:
    """The equations with some facets closed: a saddle point, factored anew for each status."""

    def __init__(
        self,
        contact: LocalAverageContact,
        stiffness: csr_matrix,
        force: np.ndarray,
        gaps: csr_matrix,
        imposed: np.ndarray | None,
        held: np.ndarray | None,
    ):
        self.contact, self.size = contact, float(np.ptp(contact.mesh.p))
        self.imposed = np.zeros(len(force)) if imposed is None else np.array(imposed, dtype=float)
        given = np.zeros(0, dtype=int) if held is None else np.asarray(held).ravel()
        self.free = np.setdiff1d(np.arange(len(force)), given)
        rest = np.zeros(len(force))
        rest[given] = self.imposed[given]
        self.imposed = rest
        self.matrix = stiffness[self.free][:, self.free]
        self.gaps = gaps[:, self.free]
        self.load = (force - stiffness @ rest)[self.free]
        self.before = contact.initial + gaps @ rest
        # Makes the constraints as large as the stiffness, for the digits of the factor.
        self.scale = abs(self.matrix.diagonal()).mean() / abs(self.gaps).max()

    def _factor(self, closed: np.ndarray) -> tuple[Any, csc_matrix]:
        rows = self.scale * self.gaps[closed]
        system = bmat([[self.matrix, rows.T], [rows, None]], "csc")
        try:
            factor = splu(system)
        except RuntimeError:
            raise SolveError(_SINGULAR) from None
        # A factor of a singular matrix makes almost any right-hand side as large as this.
        grown = factor.solve(np.random.default_rng(0).standard_normal(system.shape[0]))
        if not np.abs(grown).max() * abs(system).max() < _SINGULAR_FROM:
            raise SolveError(_SINGULAR)
        return factor, system

    def trial(self, closed: np.ndarray) -> Trial:
        """Pressure and gap (k,) with these facets closed."""
        factor, system = self._factor(closed)
        right = np.concatenate([self.load, -self.scale * self.before[closed]])
        found = factor.solve(right)
        found += factor.solve(right - system @ found)  # the digits that pivoting lost
        free, covered = len(self.free), self.contact.covered
        self.pressure = np.zeros(len(closed))
        self.pressure[closed] = -self.scale * found[free:]
        seen = np.where(covered > _COVERED * self.contact.area, covered, np.inf)
        self.gap = np.where(closed, 0.0, (self.before + self.gaps @ found[:free]) / seen)
        self.displacement = self.imposed.copy()
        self.displacement[self.free] = found[:free]
        least = _ROUND_OFF * np.ones(len(closed))
        return Trial(
            pressure=self.pressure,
            gap=self.gap,
            pressure_limit=least * (np.abs(self.pressure).max(initial=0.0) or 1.0),
            gap_limit=least * self.size,
        )

    def stiffness(self) -> np.ndarray:
        """The forces (e, e) on eligible facets that their average gaps bring up, one at a time."""
        covered, area = self.contact.covered, self.contact.area
        eligible = covered > _COVERED * area
        factor, _ = self._factor(eligible)
        count = int(eligible.sum())
        right = np.zeros((len(self.free) + count, count))
        right[len(self.free) :] = self.scale * np.diag(covered[eligible])
        pressure = -self.scale * factor.solve(right)[len(self.free) :]
        return np.asarray(area[eligible][:, None] * pressure)
