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
