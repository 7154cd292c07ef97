"""Contact that gives way to pressures that scatter, by a compliance S of the constraints.

The average gap of a closed macro-element is zero in LAC. A slave that is finer than its master then
has to follow the master's facets, and the forces that bend it scatter. With S the gap is

    |T| ḡ + S p = 0,    S = (I − R)ᵀ D (I − R),

R p the linear least squares fit to neighbours (the form `none` of a recovery). S p is zero
for a linear pressure, so that the patch test stays exact, and small for smooth ones. D is the area
of the macro-element times a displacement per pressure,

    D = |T| ((1 + (H / h)⁴) H / Eₘ + 4 s³ h / Eₛ) / 10,

with the sizes H, h and Young's moduli E of master and slave. The fourth power: the scatter has the
wavelength H of the facets, of which I − R leaves a part of (h / H)². s: half of the aspect ratio of
stretched faces, whose inner node hardly moves; else 1. In H / h their h is larger by √s.
Source: the form of the stabilisation is that of P. Bochev, C. Dohrmann, M. Gunzburger, SIAM J.
Numer. Anal. 44 (2006) 82–101: pressures less their projection.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...lac.reconstruction import FORMS, Moments, reconstruct
from ...lac.segments import Segments

_SHARE = 0.1
# A master face counts as at most so many slave faces wide.
_COARSEST = 8.0
# Faces longer than wide by more than the first factor are stretched, by the second at most.
_STRETCHED, _LONGEST = 2.0, 4.0


@dataclass(frozen=True, kw_only=True)
class Stabilisation:
    """D (m,) of macro-elements, their moments, and which are neighbours, `near` (m, m)."""

    weight: np.ndarray
    moments: Moments
    near: sparse.csr_matrix

    def scatter(self, closed: np.ndarray) -> sparse.csr_matrix:
        """I − R (c, c) of the c closed macro-elements (m,)."""
        form = FORMS["none"]
        found = reconstruct(self.moments, self.near, closed, form)
        k = form.count(self.moments.local.centre.shape[1])
        return found.matrix[k - 1 :: k][closed][:, closed].tocsr()


def _stretch(spread: np.ndarray) -> np.ndarray:
    """The aspect ratio of macro-elements (m,) over that from which they are stretched; at least 1.

    `spread` (m, d, d): see `Moments`. The inner node of a stretched face hardly moves, since the
    long edges beside it hold it, and the pressure scatters along the face as it does without cut.
    """
    if spread.shape[1] == 2:
        return np.ones(len(spread))
    narrow, long = np.sqrt(np.maximum(np.linalg.eigvalsh(spread)[:, 1:], 0.0)).T
    return np.clip(long / np.where(narrow > 0, _STRETCHED * narrow, np.inf), 1.0, _LONGEST)


def stabilisation(
    found: Sequence[Segments],
    moments: Moments,
    near: sparse.csr_matrix,
    area: np.ndarray,
    soft_of: tuple[np.ndarray, np.ndarray],
) -> Stabilisation:
    """That of m macro-elements of covered `area` (m,), from the segments that cover them.

    `soft_of`: 1 / E of the slave's cells behind each macro-element (m,), and by the numbers of the
    master's faces.

    Master edges of length 1 over a slave edge of length 2, with 1 / E = 1/4 and 1/2: they count as
    no finer, D = (2 · 1 · 1/4 + 4 · 2 · 1/2) · 2 / 10:

    >>> found = meet_in_segments([slave], [], [master], 1.0, degree=1)
    >>> at = Surface(area=np.array([2.0]), covered=np.array([2.0]), centre=np.array([[1.0, 0.0]]),
    ...              normal=np.array([[0.0, 1.0]]), lost=np.zeros(1))
    >>> soft, alone = (np.array([0.5]), np.full(2, 0.25)), sparse.eye_array(1, dtype=bool).tocsr()
    >>> stabilisation(found, moments(found, at), alone, at.covered, soft).weight.round(12)
    array([0.9])
    """
    dim = moments.local.centre.shape[1]
    sizes, soft, covered = np.zeros((3, len(area)))
    for segments in found:
        faces, face = segments.master.faces, segments.master.face
        compliant = soft_of[1][faces.number[face]]
        size = faces.radius[face] * (2.0 if dim == 2 else np.sqrt(2.0)) / faces.type.order
        size = np.where(compliant > 0, size, 0.0)  # facets of rigid masters are their shape
        np.add.at(covered, segments.macro, segments.area)
        np.add.at(sizes, segments.macro, segments.area * size)
        np.add.at(soft, segments.macro, segments.area * size * compliant)
    covered = np.where(covered > 0, covered, 1.0)
    own = 1 / np.linalg.norm(moments.local.axes[:, 0], axis=1)
    stretch = _stretch(moments.spread)
    ratio = np.clip(sizes / covered / (own * np.sqrt(stretch)), 1.0, _COARSEST)
    slave = 4 * own * stretch**3 * soft_of[0]
    weight = _SHARE * area * ((1 + ratio**4) * soft / covered + slave)
    return Stabilisation(weight=weight, moments=moments, near=near)
