"""Contact between two boundaries of scikit-fem's meshes: gap matrix, and the solve with its status.

Each facet of the slave boundary carries one multiplier, its contact pressure p ≥ 0. The average gap
there is ḡ ≥ 0, and p ḡ = 0. The cells behind these facets are cut so that each facet has a node
inside. Source: Abbas, Drouet, Hild, The Local Average Contact (LAC) method, CMAME 339 (2018)
488–513.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import skfem
from scipy import sparse
from scipy.sparse import csr_matrix

from .arguments import (
    Bodies,
    check_boundary,
    checked_search,
    checked_stiffness,
    checked_unknowns,
    checked_vector,
)
from .cells.faces import surface_points
from .cells.neighbours import vertex_neighbours
from .errors import SolveError
from .facets import Facets, facets, with_master_normals, with_nodal_normals
from .meshes import Names, cut_mesh, read_faces, unknowns_at_nodes
from .operator import MIN_COVERAGE, gap_operator
from .reconstruction import Reconstruction, form_of
from .recovery import Recovery, RecoveryRequest, unsettled, with_status
from .roughness import Smooth, smoothed
from .saddle_point import SaddlePoint, numbered
from .status import Trial, find_status

Boundary = tuple[skfem.Mesh, Names]
Recovered = Literal["automatic", "linear", "quadratic", "smooth"]
Gap = float | Callable[[np.ndarray], np.ndarray]


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
    _system: SaddlePoint = field(repr=False, compare=False)


@dataclass(frozen=True)
class RecoveredState:
    """A polynomial pressure on each facet, and the state under it.

    Attributes:
    ----------
    state
        The `ContactState` in equilibrium with this pressure. Its `pressure` are the means.
    error
        By slave facet (k,), the L2 norm of the difference between the pressure and its mean: an
        estimate of the error of one constant on the facet. NaN where too few neighbours are closed.
    """

    state: ContactState
    error: np.ndarray
    _recovery: Recovery = field(repr=False, compare=False)
    _coefficients: np.ndarray = field(repr=False, compare=False)

    def at(self, facet: np.ndarray, x: np.ndarray) -> np.ndarray:
        """The pressure (n,) at places x (dim, n) on facets (n,), counted as in the boundary."""
        facet, form = np.asarray(facet), self._recovery.form
        psi = self._recovery.moments.local.shapes(facet, np.asarray(x).T[:, None], form)[:, 0]
        own = self._coefficients.reshape(len(self.error), -1)[facet]
        return np.asarray(self.state.pressure[facet] + (psi * own).sum(axis=1))


class _UnderRecovery(NamedTuple):
    """A system under a recovered pressure, whose `fit` to the means of facets it is."""

    system: SaddlePoint
    trial: Trial
    closed: np.ndarray
    fit: Reconstruction


class LocalAverageContact:
    """Frictionless contact between a slave and a master boundary, which may lie on one mesh.

    Parameters
    ----------
    slave, master
        Pairs of a `skfem.Mesh` and the name of one of its boundaries, or several names: two
        contacts of one slave mesh are one of both boundaries, since each would cut the mesh. The
        classes are MeshTri1, MeshTri2, MeshQuad1, MeshQuad2, MeshTet1, MeshTet2, MeshHex1 and
        MeshHex2, in any pair of one dimension. A MeshHex1 is cut into hexahedra.
    normal
        The direction of the gap: `element`, the slave facet's own; `nodal`, averaged at nodes;
        `master`, that of the nearest point of the master, for smooth obstacles.
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
        and the integral of the initial gap over that. A facet of which less than 1 % is opposite
        the master carries no pressure.

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
        normal: Literal["element", "nodal", "master"] = "element",
        gap: Gap | None = None,
        search: float | None = None,
    ):
        check_boundary(slave, "slave")
        check_boundary(master, "master")
        search = checked_search(search)
        if normal not in ("element", "nodal", "master"):
            raise ValueError(f"normal = {normal!r}: must be element, nodal or master")
        if slave[0].dim() != master[0].dim():
            raise ValueError("slave, master: the meshes must be of one dimension")
        if slave[0] is master[0] and slave[1] == master[1]:
            raise ValueError(f"master = {master[1]!r}: must be another boundary than the slave")
        whole = read_faces(*slave, "slave")
        self.mesh, faces = cut_mesh(*slave, whole)
        self._whole = master[0] is slave[0]
        self._master = self.mesh if self._whole else master[0]
        other = read_faces(self._master, master[1], "master")
        first = 0 if self._whole else self.mesh.p.shape[1]
        points = self.mesh.p.T if self._whole else np.hstack([self.mesh.p, master[0].p]).T
        count = int(faces.macro.max()) + 1
        slaves = [facets(points, faces.type, faces.nodes, faces.macro)]
        masters = [facets(points, other.type, other.nodes + first, np.zeros_like(other.number))]
        if normal == "nodal":
            slaves = with_nodal_normals(slaves, points)
        elif normal == "master":
            slaves = with_master_normals(slaves, masters, points)
        self._surfaces = slaves, masters, count, len(points), search
        self._vertices, self._order = whole.nodes[:, : whole.type.n_vertices], whole.type.order
        self._unknown = np.zeros(0, dtype=int)
        operator = gap_operator(*self._surfaces)
        self._matrix = operator.matrix
        self._near = vertex_neighbours([(whole.number, self._vertices)], count)
        at, faces_of = operator.surface, [(whole.number, whole.nodes)]
        about = Smooth(points, faces_of, slaves[0].nodes.ravel(), at.normal, at.area, self._near)
        self._smooth = smoothed(operator.matrix, about) if normal == "element" else self._matrix
        self._points, self._cells = points, {"slave": self.mesh.dofs.element_dofs.T}
        if not self._whole:
            self._cells["master"] = first + master[0].dofs.element_dofs.T
        self.area, self.covered = operator.area, operator.covered
        self._opposed = self.covered > MIN_COVERAGE * self.area
        if not self._opposed.any():
            raise ValueError(f"slave = {slave[1]!r}: no facet of {master[1]!r} is opposite to it")
        self.initial = operator.initial if gap is None else self._given(slaves, points, gap)

    def _given(self, slaves: list[Facets], points: np.ndarray, gap: Gap) -> np.ndarray:
        """The integral (k,) of a given initial gap over the covered part of each facet."""
        faces = [(block.type.name, block.nodes, block.number) for block in slaves]
        at = surface_points(points, faces)
        value = gap(at.place.T) if callable(gap) else np.full(len(at.weight), gap)
        value = checked_vector(value, len(at.weight), "gap")
        return np.asarray(at.means(value) * self.covered)

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
            unknown, size = slave.T.ravel(), slave_basis.N
        else:
            master = unknowns_at_nodes(master_basis, self._master, "master")
            if master.min() < slave_basis.N:
                master = master + slave_basis.N
            unknown = np.hstack([slave, master]).T.ravel()
            size = max(slave_basis.N, int(unknown.max()) + 1)
        self._unknown, points = unknown, self._points
        on_slave = np.arange(len(points)) < self.mesh.p.shape[1]
        self._bodies = Bodies(points, self._cells, unknown, on_slave, size)
        return numbered(self._matrix, unknown, size)

    def solve(
        self,
        K: Any,
        f: np.ndarray,
        B: csr_matrix,
        x: np.ndarray | None = None,
        D: np.ndarray | None = None,
        springs: Any = None,
    ) -> ContactState:
        """Solve K u = f + Bᵀ p with u = x at the unknowns D, and find the contact status.

        The arguments are those of `skfem.condense`, and B is that of `matrix`. K is the stiffness
        of the bodies alone: it resists none of their rigid motions. `springs` is what the ground
        adds to it.

        Raises:
        ------
        ValueError
            For arguments of the wrong shape or kind, and a K that does not fit B.
        RuntimeError
            Where a body may move freely, and where no status fulfils the conditions.
        """
        shape = len(self.area), len(self._unknown)
        if not sparse.issparse(B) or not shape[1] or B.shape[0] != shape[0]:
            raise ValueError("B: must be the matrix that `matrix` returned")
        size = B.shape[1]
        stiffness = checked_stiffness(K, size)
        self._bodies.check(stiffness)
        ground = None if springs is None else checked_stiffness(springs, size, "springs")
        imposed = np.zeros(size) if x is None else checked_vector(x, size, "x")
        held = checked_unknowns(D, size)
        force = checked_vector(f, size, "f")
        system = SaddlePoint(self, stiffness, force, B, imposed, held, ground)
        opposed = self._opposed
        found = find_status(system.trial, opposed, opposed, self.covered, system.stiffness)
        trial = system.trial(found.closed)
        return _state(system, trial, found.closed, found.iterations)

    def recover(self, state: ContactState, form: Recovered = "automatic") -> RecoveredState:
        """A pressure of second order (`quadratic`: of third) from one constant for each facet.

        The reconstruction is given to the bodies as a load, so that it is in equilibrium. `smooth`
        does not keep the means; it serves where these scatter, as on linear tetrahedra. `automatic`
        is the form that is best for the slave's cells by measurement (docs/recovery.md).

        Raises:
        ------
        ValueError
            For an unknown form.
        RuntimeError
            Where status or pressure do not settle under the recovered pressure: a body that is all
            but free to turn is turned further by each sweep.
        """
        if not isinstance(state, ContactState):
            raise ValueError(f"state = {type(state).__name__}: must be a ContactState")
        if form not in get_args(Recovered):
            raise ValueError(f"form = {form!r}: must be {', '.join(get_args(Recovered))}")
        shape = form_of(form, self._order, self._vertices.shape[1])
        asked = RecoveryRequest(shape, self._near, np.zeros(len(self.area), dtype=int))
        recovery = gap_operator(*self._surfaces, asked=asked).recovery
        assert recovery is not None
        system, closed, size = state._system, state.closed, len(state._system.force)
        added = numbered(recovery.loads, self._unknown, size).T

        def correct(closed: np.ndarray) -> _UnderRecovery | None:
            fit = recovery.reconstruction(closed)
            means, first = system.settled(closed, added @ fit.matrix)
            under = system.under(added @ (fit.matrix @ means))
            trial = under.trial(closed)
            if unsettled(first, trial.pressure - means, trial):
                return None
            return _UnderRecovery(under, trial, closed, fit)

        def wrong(found: _UnderRecovery) -> bool:
            return bool((self._opposed & (found.trial.violation(found.closed) > 1)).any())

        def again(found: _UnderRecovery) -> np.ndarray:
            system, opposed = found.system, self._opposed
            start, covered = found.closed, self.covered
            return find_status(system.trial, start, opposed, covered, system.stiffness).closed

        settled = with_status(closed, correct, wrong, again)
        if settled is None:
            raise SolveError("status or pressure do not settle under the recovered pressure")
        found = _state(settled.system, settled.trial, settled.closed, state.iterations)
        coefficients = settled.fit.matrix @ found.pressure
        error = recovery.error(coefficients, settled.fit)
        return RecoveredState(found, error, recovery, coefficients)


def _state(system: SaddlePoint, found: Trial, closed: np.ndarray, iterations: int) -> ContactState:
    """The state that the system's last trial `found`, with these facets closed."""
    return ContactState(
        system.displacement, found.pressure, found.gap, closed, iterations, _system=system
    )
