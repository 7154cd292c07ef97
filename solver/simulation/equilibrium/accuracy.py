"""The accuracy of a solve by its own estimate: digits lost to rounding.

Each term of `Accuracy` is a size at which something is rounded, times the unit of rounding, turned
into a pressure by what it acts on; it is relative to the largest pressure. Where that pressure is
itself rounding, as where no force acts, it is relative to the stress that strains, motions and the
loads of all steps could cause:

    forces       terms of opposite sign cancel where internal forces are summed (stretched cells,
                 nearly incompressible material), and what the solve leaves unbalanced
    gap          a gap is known to the rounding of the displacements and coordinates it is the
                 difference of; the stiffness behind it makes a pressure of that
    coordinates  stored to the rounding of their distance from the origin, they change strains and
                 tilt faces; bodies that slide along tilted faces, or move along supports on tilted
                 faces, are pushed apart
    stress       as forces, for the stress in the bodies
    slender      the errors of forces seen on the small faces of slender cells, as a stress there
    arms         a body that is all but free to move is held by pressures on short arms, which
                 balance the rounding of its loads
    sums         a stress is a sum over the nodes of a cell, of gradients that are such sums

The largest one counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...lac.cells.faces import FLAT, FaceBlock, area_vectors
from ...lac.cells.shape import shape_functions
from ...lac.status import Trial
from ...mechanics.fem.block import Block
from ...mechanics.fem.stress import steepest, steepness
from ..scene.scene import Scene
from .iterate import ContactIterate
from .rest import AT_REST, LITTLE, forces_of_others, rests, stress_at_rest

EPSILON = float(np.finfo(float).eps)
EPSILON_EXTENDED = float(np.finfo(np.longdouble).eps)
LEAST_DIGITS = 4
"""A result with fewer digits is unreliable."""

# Pressures and gaps below this share of their scales are round-off and change no status; gaps below
# the second share of the displacements they are the difference of, or below so many roundings of
# the coordinates, are so too; and pressures below so many times their estimated error.
_NOISE, _NOISE_OF_MOTION, _ROUNDINGS, ERRORS = 1e-10, 1e-13, 8, 10
# A motion that gaps resist by no more than this share of what they resist most is not held by them.
_UNHELD = 1e-8
# Rows of the motions of bodies, of which copies are made, at once.
_AT_ONCE = 1 << 20

_REASONS = {
    "forces": "the terms that add up to its forces are far larger than they",
    "gap": "the gap is lost in the rounding of displacements and coordinates",
    "coordinates": "the coordinates are rounded too far from the origin for cells so small",
    "stress": "the strains are lost in the rounding of the displacements",
    "slender": "on the small faces of slender cells the rounding of forces is a large stress",
    "arms": "a body is all but free to move, and pressures on short arms hold it",
    "sums": "its cells have too many nodes",
}


@dataclass(frozen=True)
class Accuracy:
    """Estimated relative errors of the pressure by cause; of the stress if there is no pressure."""

    causes: dict[str, float]

    @property
    def estimate(self) -> float:
        """The largest of them."""
        return max(self.causes.values(), default=0.0)

    def with_gap(self, error: float) -> Accuracy:
        """The same where a gap is known no better than to this relative `error` of pressures."""
        return Accuracy(self.causes | {"gap": max(self.causes.get("gap", 0.0), error)})

    @property
    def of_sums(self) -> float:
        """The part that summing in higher precision removes."""
        return max(self.causes.get("forces", 0.0), self.causes.get("stress", 0.0))

    @property
    def reason(self) -> str:
        """Why the result is unreliable; empty where it is not."""
        return self.words if self.estimate > 10.0**-LEAST_DIGITS else ""

    @property
    def words(self) -> str:
        """What rounding alone may change, and why."""
        cause = max(self.causes, key=lambda name: self.causes[name])
        share = f"{self.estimate:.0e} of itself" if self.estimate < 1 else "more than itself"
        return f"rounding alone may change the result by {share}: {_REASONS[cause]}"


def pressure_of_forces(gaps: sparse.csr_matrix, noise: np.ndarray) -> float:
    """The largest pressure that nodal forces of the sizes `noise` (n_dofs,) correspond to.

    Read, as the multiplier itself, at the largest coefficient of each row of `gaps` (m, n_dofs).
    """
    _, column, size = _largest(gaps)
    return float((noise[column] / size).max(initial=0.0))


def pressure_of_gaps(gaps: sparse.csr_matrix, noise: np.ndarray, stiffness: np.ndarray) -> float:
    """The largest pressure that errors `noise` (m,) of ∫ gap bring up, by `stiffness` (n_dofs,)."""
    row, column, size = _largest(gaps)
    return float((noise[row] * stiffness[column] / size**2).max(initial=0.0))


def pressures_of_resultants(
    gaps: sparse.csr_matrix, motions: sparse.csr_matrix, resultants: np.ndarray
) -> np.ndarray:
    """The largest pressures (c,) that balance `resultants` (r, c) of any sign along `motions`.

    No support resists these (n_dofs, r), but `gaps` (m, n_dofs).

    A force, and a moment that two gaps hold at arms of 0.001:

    >>> gaps = sparse.csr_matrix(np.eye(2, 3))
    >>> motions = sparse.csr_matrix([[1.0, 0.001], [1.0, -0.001], [1.0, 1.0]])
    >>> pressures_of_resultants(gaps, motions, np.eye(2)).round(9).tolist()
    [0.5, 500.0]
    """
    balanced = np.linalg.pinv((gaps @ motions).toarray().T, _UNHELD)
    return np.asarray(np.sqrt((balanced**2 @ resultants**2).max(axis=0, initial=0.0)))


@dataclass(frozen=True)
class Roughness:
    """The effect of rounded coordinates on a scene's mesh.

    `strain`: the largest error of a strain, over the strain. `tilt` (n,): by what angle the contact
    faces around each node may be turned. `turned` (n,): the same for the directions of supports,
    zero where they are those of the axes. `steep`: `steepness` of the blocks, if any is not.
    """

    strain: float
    tilt: np.ndarray
    turned: np.ndarray
    steep: list[np.ndarray]

    def stress(self, blocks: Sequence[Block], displacement: np.ndarray) -> float:
        """The largest stress as a displacement (n, dim) runs along supports that are tilted."""
        if not self.turned.any():
            return 0.0
        move = self.turned * np.linalg.norm(displacement, axis=1)
        found = [
            (block.lame + 2 * block.shear) * (steep * move[block.cells]).sum(axis=1)
            for block, steep in zip(blocks, self.steep, strict=True)
        ]
        return float(np.concatenate(found).max())

    def gap(self, gaps: sparse.csr_matrix, displacement: np.ndarray) -> np.ndarray:
        """The largest gap (m,) as a displacement (n, dim) slides along faces that are tilted."""
        node, start = gaps.indices // displacement.shape[1], gaps.indptr[:-1]
        first = np.repeat(displacement[node[start]], np.diff(gaps.indptr), axis=0)
        slide = np.maximum.reduceat(np.linalg.norm(displacement[node] - first, axis=1), start)
        return np.asarray(slide * np.maximum.reduceat(self.tilt[node], start))


def roughness(scene: Scene) -> Roughness:
    """The roughness of a scene's mesh by rounded coordinates."""
    points, dim = scene.points, scene.points.shape[1]
    tilt, turned, steep = *np.zeros((2, len(points))), []
    for zone in scene.zones:
        for faces in (*zone.slave_faces, *zone.master_faces):
            np.maximum.at(
                tilt, faces.nodes, _tilts(points, faces, scene.coordinates.rounding)[:, None]
            )
    if scene.free.selection is None:
        steep, around = steepness(points, scene.blocks), np.zeros(len(points))
        for block, slope in zip(scene.blocks, steep, strict=True):
            np.maximum.at(around, block.cells, slope.sum(axis=1)[:, None])
        entries = scene.free.basis.tocoo()
        node = entries.row[np.bincount(entries.col)[entries.col] > 1] // dim
        turned[node] = scene.coordinates.rounding * around[node]
        largest = float(around.max())
    else:
        largest = steepest(points, scene.blocks)
    return Roughness(
        scene.coordinates.rounding * largest, tilt, turned, steep if turned.any() else []
    )


def _tilts(points: np.ndarray, faces: FaceBlock, noise: float) -> np.ndarray:
    """By what angle (n,) faces may be turned whose nodes are known to `noise`.

    The nodes of faces that count as flat are known to the bend that is left out. Faces that lie
    across an axis are rounded as one and stay so.
    """
    kind, corner = faces.type, points[faces.nodes]
    slopes = shape_functions(kind.name).gradients(kind.nodes[: kind.n_vertices].mean(axis=0)[None])
    tangents = np.einsum("fad,at->fdt", corner - corner[:, :1], slopes[0], optimize=True)
    steep = np.linalg.norm(np.matmul(slopes[0], np.linalg.pinv(tangents)), axis=(1, 2))
    normal = area_vectors(points, faces.nodes, slopes)[:, 0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    offset = corner - corner[:, : kind.n_vertices].mean(axis=1, keepdims=True)
    bend = np.abs(np.einsum("fad,fd->fa", offset, normal)).max(axis=1)
    radius = np.linalg.norm(offset, axis=2).max(axis=1)
    across = (np.ptp(corner, axis=1) == 0).any(axis=1)
    return np.where(across, 0.0, steep * (noise + np.where(bend <= FLAT * radius, bend, 0.0)))


def terms_of(blocks: Sequence[Block]) -> int:
    """The most terms of a stress at a node: nodes of a cell, twice, and quadrature points."""
    dim = blocks[0].type.dim
    return max(2 * dim * block.type.n_nodes + len(block.rule[1]) for block in blocks)


@dataclass(frozen=True)
class Rounding:
    """Errors by rounding: of the internal forces at nodes (n,), and of ∫ gap (k,)."""

    forces: np.ndarray
    gaps: np.ndarray


def rounding(iterate: ContactIterate) -> Rounding:
    """The errors by rounding in an iterate."""
    scene, constraints = iterate.scene, iterate.constraints
    terms = sum(term.rounded[0] for term in iterate.terms)
    known = scene.coordinates.rounding * constraints.covered * constraints.measured
    return Rounding(
        forces=_unit(iterate) * iterate.sizes.forces + EPSILON * terms,
        gaps=known + EPSILON * iterate.opening_size,
    )


def estimate(
    iterate: ContactIterate,
    rounded: Rounding,
    pressure: np.ndarray,
    diagonal: np.ndarray,
    rough: Roughness,
    loose: sparse.csr_matrix,
    residual: float,
    force_scale: float,
) -> Accuracy:
    """How many digits rounding leaves in the pressure (k,) of an iterate.

    `diagonal` (n_dofs,) of the stiffness, `rough` what rounded coordinates do to the mesh, `loose`
    (n_dofs, r) motions that contact alone resists, `residual` relative to the size of the forces at
    work.
    """
    scene, constraints, closed = iterate.scene, iterate.constraints, iterate.closed
    forces, unit = rounded.forces, _unit(iterate)
    scale = float(np.abs(pressure).max(initial=0.0))
    moved = iterate.displacement.total.reshape(scene.points.shape)
    if scale == 0:
        force_scale = max(force_scale, forces_of_others(iterate))
        return Accuracy({"forces": float(forces.max()) / force_scale})
    by_unknown = np.repeat(forces, scene.points.shape[1])
    noise = by_unknown + residual * force_scale
    moving, gaps = constraints.moving[closed], constraints.gaps[closed]
    pushed = rough.gap(gaps, moved) * constraints.covered[closed]
    tilted = scale * (rough.strain + float(rough.tilt.max()))
    tilted += pressure_of_gaps(moving, pushed, diagonal)
    summed = arms = 0.0
    if loose.shape[1]:
        pushes = abs(gaps).T @ np.abs(pressure[closed])
        acting = np.abs(iterate.force).ravel() + pushes
        known = _resultants(loose, by_unknown, EPSILON * acting)
        summed, arms = pressures_of_resultants(gaps, loose, known).tolist()
    # Taken off a stress in double precision, whatever the iterate's is.
    in_double = max((term.rounded[1] for term in iterate.terms), default=0.0)
    errors = {
        "forces": max(pressure_of_forces(moving, noise), summed),
        "gap": pressure_of_gaps(moving, rounded.gaps[closed], diagonal),
        "coordinates": tilted + rough.stress(scene.blocks, moved),
        "stress": max(unit * iterate.sizes.highest, EPSILON * in_double),
        "slender": unit * iterate.sizes.slender,
        "arms": arms,
        "sums": EPSILON * terms_of(scene.blocks) * scale,
    }
    if (worst := max(errors.values())) > 10.0**-LEAST_DIGITS * scale:
        _, _, size = _largest(moving)
        scale = max(scale, _scale_of_rest(iterate, scale, worst, scene.loads.at_work.force / size))
    return Accuracy({name: error / scale for name, error in errors.items()})


def _resultants(loose: sparse.csr_matrix, sums: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """The resultants (r, 2) along `loose` motions of the errors (n_dofs,) of sums and of loads.

    Errors of sums have any sign. Those of loads and of coordinates may all have the same.
    """
    squares, of_loads = np.zeros((2, loose.shape[1]))
    for first in range(0, len(sums), _AT_ONCE):
        rows = slice(first, first + _AT_ONCE)
        some = abs(loose[rows])
        squares += some.power(2).T @ sums[rows] ** 2
        of_loads += some.T @ loads[rows]
    return np.stack([np.sqrt(squares), of_loads], axis=1)


def _scale_of_rest(
    iterate: ContactIterate, pressure: float, error: float, of_loads: np.ndarray
) -> float:
    """What loads, strains or motions cause where the largest `pressure` is rounding; else 0.

    `of_loads` (c,): the pressures that the largest load would cause, by row. A pressure that is
    little beside all of them is rounding up to ten times its error.
    """
    loaded = float(of_loads.max(initial=0.0))
    # Without loads the forces are those of initial strains.
    at_rest = not loaded or forces_of_others(iterate) > 0
    stress = stress_at_rest(iterate.scene, iterate.displacement.total)
    nothing = AT_REST * max(loaded, stress if at_rest else 0.0)
    if pressure <= nothing or (at_rest and error >= pressure) or rests(iterate):
        return max(loaded, stress, iterate.sizes.highest)
    faint = pressure <= LITTLE * of_loads.min(initial=loaded)
    return loaded if pressure <= (ERRORS if faint else 1) * error else 0.0


def judged(
    iterate: ContactIterate, rounded: Rounding, pressure: np.ndarray, diagonal: np.ndarray
) -> Trial:
    """Pressure (k,) and gap of an iterate with what is round-off of each, zone by zone.

    The scale of pressures is the largest stress or pressure at the zone's own surfaces, the scale
    of a gap the size of the displacements that open it. Bodies that no support holds hand on what
    rounding leaves of their resultants: a zone that bears no more than that bears nothing.
    """
    scene, constraints, dim = iterate.scene, iterate.constraints, iterate.scene.points.shape[1]
    left = iterate.residual() + constraints.on_free.T @ pressure
    unbalanced = np.abs(scene.free.spread(left))
    forces, known = np.repeat(rounded.forces, dim), rounded.gaps
    moving, limit = constraints.moving, np.zeros(len(pressure))
    of_others = AT_REST * forces_of_others(iterate)
    loose = np.diff(iterate.displacement.motions.indptr) > 0
    handed_on = np.full_like(forces, np.linalg.norm(forces[loose]))
    for zone in scene.zones:
        mine = zone.numbers
        places = constraints.gaps[mine].indices
        stress = iterate.sizes.stress[places // dim].max(initial=0.0)
        scale = max(float(np.abs(pressure[mine]).max(initial=0.0)), float(stress))
        noise = forces + unbalanced[places].max(initial=0.0) + of_others / ERRORS
        for rows in zone.rows:
            # Of what may close: a sliver under the end of the master has no pressure to round.
            there = constraints.eligible[rows]
            acting = moving[rows][there]
            error = pressure_of_forces(acting, noise)
            error += pressure_of_gaps(acting, known[rows][there], diagonal)
            limit[rows] = _NOISE * scale + ERRORS * error
            if loose[places].any():
                least = ERRORS * pressure_of_forces(acting, handed_on)
                if np.abs(pressure[rows]).max(initial=0.0) <= least:
                    limit[rows] = np.maximum(limit[rows], least)
    motion = abs(constraints.gaps) @ np.abs(iterate.displacement.total)
    covered = np.where(constraints.eligible, constraints.covered, np.inf)
    return Trial(
        pressure=pressure,
        gap=iterate.gap,
        pressure_limit=limit,
        gap_limit=(_NOISE * iterate.opening_size + _NOISE_OF_MOTION * motion) / covered
        + _ROUNDINGS * scene.coordinates.rounding * constraints.measured,
    )


def _unit(iterate: ContactIterate) -> float:
    return EPSILON_EXTENDED if iterate.extended else EPSILON


def _largest(gaps: sparse.csr_matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row, column and size of the largest entry of each row that is not empty."""
    size = np.abs(gaps.data)
    rows = np.repeat(np.arange(gaps.shape[0]), np.diff(gaps.indptr))
    order = np.lexsort((size, rows))
    best = order[np.flatnonzero(np.diff(rows[order], append=gaps.shape[0] + 1))]
    return rows[best], gaps.indices[best], size[best]
