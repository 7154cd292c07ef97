"""What a solve can know of its own accuracy: how many digits rounding has left in the pressure.

Each term is a size at which something is rounded, times the unit of rounding, turned into a
pressure by what it acts on; it is relative to the largest pressure:

    forces       terms of opposite sign cancel where internal forces are summed (stretched cells,
                 nearly incompressible material), and what the solve leaves unbalanced
    gap          a gap is known to the rounding of the displacements and coordinates it is the
                 difference of; the stiffness behind it makes a pressure of that
    coordinates  stored to the rounding of their distance from the origin, they tilt the faces
    stress       as forces, for the stress in the bodies
    slender      the errors of forces seen on the small faces of slender cells, as a stress there

The largest one counts.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from solver.mechanics.mortar.status import Trial
from solver.simulation.iterate import ContactIterate

EPSILON = float(np.finfo(float).eps)
EPSILON_EXTENDED = float(np.finfo(np.longdouble).eps)
LEAST_DIGITS = 4
"""A result with fewer digits is unreliable."""

_REASONS = {
    "forces": "the terms that add up to its forces are far larger than they",
    "gap": "the gap is lost in the rounding of displacements and coordinates",
    "coordinates": "the coordinates are rounded too far from the origin for cells so small",
    "stress": "the strains are lost in the rounding of the displacements",
    "slender": "on the small faces of slender cells the rounding of forces is a large stress",
}


@dataclass(frozen=True)
class Accuracy:
    """Estimated relative errors of the pressure by cause; of the stress where there is none."""

    causes: dict[str, float]

    @property
    def estimate(self) -> float:
        """The largest of them."""
        return max(self.causes.values(), default=0.0)

    @property
    def of_sums(self) -> float:
        """The part that summing in higher precision removes."""
        return max(self.causes.get("forces", 0.0), self.causes.get("stress", 0.0))

    @property
    def reason(self) -> str:
        """Why the result is unreliable; empty where it is not."""
        if self.estimate <= 10.0**-LEAST_DIGITS:
            return ""
        cause = max(self.causes, key=lambda name: self.causes[name])
        return (
            f"rounding alone may change the result by {self.estimate:.0e} of itself: "
            f"{_REASONS[cause]}"
        )


# Pressures and gaps below this share of their scales are round-off and change no status; gaps below
# the second share of the displacements they are the difference of, or below so many roundings of
# the coordinates, are so too; and pressures below so many times their estimated error.
_NOISE, _NOISE_OF_MOTION, _ROUNDINGS, _ERRORS = 1e-10, 1e-13, 8, 10


def estimate(
    iterate: ContactIterate,
    pressure: np.ndarray,
    diagonal: np.ndarray,
    residual: float,
    force_scale: float,
) -> Accuracy:
    """How many digits rounding leaves in the pressure (k,) of an iterate.

    `diagonal` (n_dofs,) of the stiffness; `residual` relative to the size of the forces at work.
    """
    scene, constraints, closed = iterate.scene, iterate.constraints, iterate.closed
    forces, unit = _rounding_of_forces(iterate), _unit(iterate)
    scale = float(np.abs(pressure).max(initial=0.0))
    if scale == 0:
        return Accuracy({"forces": float(forces.max()) / force_scale})
    noise = np.repeat(forces, scene.points.shape[1]) + residual * force_scale
    moving = _moving(iterate)[closed]
    smallest = float(constraints.area.min()) ** (1 / (scene.points.shape[1] - 1))
    mean_stress = scene.mean.cancellation(iterate.mean_stress)[1]
    causes = {
        "forces": pressure_of_forces(moving, noise),
        "gap": pressure_of_gaps(moving, _rounding_of_gaps(iterate)[closed], diagonal),
        "coordinates": scale * scene.rounding / smallest,
        "stress": max(unit * iterate.sizes.highest, EPSILON * mean_stress),
        "slender": unit * iterate.sizes.slender,
    }
    return Accuracy({name: error / scale for name, error in causes.items()})


def judged(iterate: ContactIterate, pressure: np.ndarray, diagonal: np.ndarray) -> Trial:
    """Pressure (k,) and gap of an iterate with what is round-off of each, zone by zone.

    The scale of pressures is the largest stress or pressure at the zone's own surfaces, the scale
    of a gap the size of the displacements that open it.
    """
    scene, constraints, dim = iterate.scene, iterate.constraints, iterate.scene.points.shape[1]
    left = iterate.residual() + constraints.on_free.T @ pressure
    unbalanced = np.abs(scene.free.basis @ left)
    forces, known = np.repeat(_rounding_of_forces(iterate), dim), _rounding_of_gaps(iterate)
    moving, limit = _moving(iterate), np.zeros(len(pressure))
    for zone in scene.zones:
        mine, rows = zone.numbers, moving[zone.numbers]
        places = constraints.gaps[mine].indices
        stress = iterate.sizes.stress[places // dim].max(initial=0.0)
        scale = max(float(np.abs(pressure[mine]).max(initial=0.0)), float(stress))
        noise = forces + unbalanced[places].max(initial=0.0)
        error = pressure_of_forces(rows, noise) + pressure_of_gaps(rows, known[mine], diagonal)
        limit[mine] = _NOISE * scale + _ERRORS * error
    motion = abs(constraints.gaps) @ np.abs(iterate.displacement.total)
    covered = np.where(constraints.eligible, constraints.covered, np.inf)
    return Trial(
        pressure=pressure,
        gap=iterate.gap,
        pressure_limit=limit,
        gap_limit=(_NOISE * iterate.opening_size + _NOISE_OF_MOTION * motion) / covered
        + _ROUNDINGS * scene.rounding * (constraints.initial != 0),
    )


def _unit(iterate: ContactIterate) -> float:
    return EPSILON_EXTENDED if iterate.extended else EPSILON


def _moving(iterate: ContactIterate) -> sparse.csr_matrix:
    """The coefficients of gaps (k, n_dofs) on degrees of freedom that supports leave free."""
    free = np.diff(iterate.scene.free.basis.indptr) > 0
    moving = (iterate.constraints.gaps @ sparse.diags(free.astype(float))).tocsr()
    moving.eliminate_zeros()
    return moving


def _rounding_of_forces(iterate: ContactIterate) -> np.ndarray:
    """Errors (n,) of the internal forces at nodes."""
    mean_terms, _ = iterate.scene.mean.cancellation(iterate.mean_stress)
    return _unit(iterate) * iterate.sizes.forces + EPSILON * mean_terms


def _rounding_of_gaps(iterate: ContactIterate) -> np.ndarray:
    """Errors (k,) of ∫ gap."""
    scene, constraints = iterate.scene, iterate.constraints
    known = scene.rounding * constraints.covered * (constraints.initial != 0)
    return known + EPSILON * iterate.opening_size


def pressure_of_forces(gaps: sparse.csr_matrix, noise: np.ndarray) -> float:
    """The largest pressure that nodal forces of the sizes `noise` (n_dofs,) stand for.

    Read, as the multiplier itself, at the largest coefficient of each row of `gaps` (m, n_dofs).
    """
    _, column, size = _largest(gaps)
    return float((noise[column] / size).max(initial=0.0))


def pressure_of_gaps(gaps: sparse.csr_matrix, noise: np.ndarray, stiffness: np.ndarray) -> float:
    """The largest pressure that errors `noise` (m,) of ∫ gap bring up, by `stiffness` (n_dofs,)."""
    row, column, size = _largest(gaps)
    return float((noise[row] * stiffness[column] / size**2).max(initial=0.0))


def _largest(gaps: sparse.csr_matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row, column and size of the largest entry of each row that is not empty."""
    size = np.abs(gaps.data)
    rows = np.repeat(np.arange(gaps.shape[0]), np.diff(gaps.indptr))
    order = np.lexsort((size, rows))
    best = order[np.flatnonzero(np.diff(rows[order], append=gaps.shape[0] + 1))]
    return rows[best], gaps.indices[best], size[best]
