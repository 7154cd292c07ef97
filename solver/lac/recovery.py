"""Recovery of a pressure of second or third order: the loads that its reconstruction adds.

A reconstruction p* = p + Σ c ψ of the constants p (see `reconstruction`) gives the bodies what the
constants withhold from them: the loads Fᵀ c with Fᵢₖ = ∫ ψᵢₖ (N_master − N_slave) n dS. All ψ that
are applied have mean zero on their macro-element: the constants stay the means.

What constants withhold is known as soon as the means p are. It is given to the bodies as a load,
which changes p, and so on: p ↦ p + ω (pₖ − p), ω = 0.87, until p stays as it is. The map is affine
and contracts by 0.1–0.4 a sweep, whatever the mesh, the materials and Poisson's ratio
(docs/recovery.md). From the second sweep on the combination of the last four is taken that leaves
least of pₖ − p.

Source: Stetter, Numer. Math. 29 (1978) 425–443, for the deferred correction that applies them;
D. G. Anderson, J. ACM 12 (1965) 547–560, for the combination.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import numpy as np
from scipy import sparse

from .cells.faces import circumference
from .facets import tangents_of
from .friction import Tangent, along_faces, levers, tangents
from .partners import Surface
from .reconstruction import Form, Local, Moments, Reconstruction, reconstruct
from .segments import Segments
from .status import Trial

# The eigenvalues of a sweep lie between −0.55 and 0: this makes them 0.34 at most.
_RELAXATION = 0.87
# So many sweeps at most, unless it is said how many, and the change of a mean, as a share of the
# largest, that ends them.
MOST_SWEEPS, SETTLED = 40, 1e-11
# A last change of more than this share of the largest mean is no end.
_UNSETTLED = 1e-6
# Sweeps diverge where one changes so many times what the first did, and more than this share of the
# pressure, which is rounding: where a body is all but free to turn, a reconstruction from rounded
# pressures turns it.
_GROWTH, _ROUNDING = 10, 1e-9
# What changes by no more than this share of the largest of all is rounded.
_ROUND_OFF = 1e-14
# So many sweeps are combined with one: older ones may be those of another status of friction. Those
# that change nearly the same count as one.
_MEMORY = 3
_ALIKE = 1e-8
# How often a status that the recovered pressure changes is found anew.
_ROUNDS = 3
S = TypeVar("S")
T = TypeVar("T")


@dataclass(frozen=True)
class RecoveryRequest:
    """The form of a recovery on m macro-elements.

    `near` (m, m): which share a vertex; `material` (m,): a number of that of the slave's cells. The
    master's faces have theirs as the number of their `Facets`. `compliance`: makes what contact
    gives way by, if asked for, of the segments, the moments, neighbours (m, m) and covered areas
    (m,).
    """

    form: Form
    near: sparse.csr_matrix
    material: np.ndarray
    compliance: Callable[..., Any] | None = None


def moments(found: Sequence[Segments], surface: Surface) -> Moments:
    """Moments of macro-elements (m,) from the segments that cover them.

    One that is not covered keeps its centre and has no spread.

    A slave edge from 0 to 2: the mean of (x − 1)² is 1/3, whatever the master edges over it.

    >>> found = meet_in_segments([slave], [], [master], 1.0, degree=1)
    >>> at = Surface(area=np.array([2.0]), covered=np.array([2.0]), centre=np.array([[1.0, 0.0]]),
    ...              normal=np.array([[0.0, 1.0]]), lost=np.zeros(1))
    >>> moments(found, at).spread[0, 0, 0].round(12)
    np.float64(0.333333333333)
    """
    m, dim = surface.centre.shape
    measure, first, second = np.zeros(m), np.zeros((m, dim)), np.zeros((m, dim, dim))
    for segments in found:
        owner, w = segments.macro, segments.weight
        away = segments.points - surface.centre[owner][:, None]
        np.add.at(measure, owner, segments.area)
        np.add.at(first, owner, np.einsum("sq,sqd->sd", w, away))
        np.add.at(second, owner, np.einsum("sq,sqd,sqe->sde", w, away, away))
    covered = np.where(measure > 0, measure, 1.0)
    shift = first / covered[:, None]
    spread = second / covered[:, None, None] - shift[:, :, None] * shift[:, None]
    size = np.where(measure > 0, measure, surface.area)
    if found and found[0].slave.faces.axisymmetric:
        size = size / circumference(surface.centre + shift)
    size = size ** (1 / (dim - 1))
    axes = tangents_of(surface.normal) / size[:, None, None]
    own = np.einsum("nsd,nde,nte->nst", axes, spread, axes)
    local = Local(centre=surface.centre + shift, axes=axes, spread=own)
    return Moments(share=measure / surface.area, spread=spread, normal=surface.normal, local=local)


@dataclass(frozen=True, kw_only=True)
class Recovery:
    """The recovery of the pressure on m macro-elements by functions ψ, k on each.

    `near` (m, m): which of them may be neighbours; `loads` (m · k, n_dofs): ∫ ψ (N_master −
    N_slave) n dS, none for a constant ψ; `slip_loads`: the same with each tangent in place of n,
    `levers` their couples (see `friction.levers`); `products` (m, k, k): ∫ ψ ψᵀ dS; `compliance`:
    what contact gives way by, if asked for.
    """

    form: Form
    moments: Moments
    near: sparse.csr_matrix
    loads: sparse.csr_matrix
    products: np.ndarray
    compliance: Any = None
    slip_loads: tuple[sparse.csr_matrix, ...] = ()
    levers: np.ndarray | None = None

    def reconstruction(self, closed: np.ndarray) -> Reconstruction:
        """The reconstruction among closed macro-elements (m,); the last two stay known."""
        return self._among(closed.tobytes())

    @cached_property
    def _among(self) -> Callable[[bytes], Reconstruction]:
        # Sweeps ask for the same ones again: among what is closed, and among what sticks.
        moments, near, form = self.moments, self.near, self.form
        return lru_cache(2)(
            lambda closed: reconstruct(moments, near, np.frombuffer(closed, dtype=bool), form)
        )

    def error(self, coefficients: np.ndarray, fit: Reconstruction) -> np.ndarray:
        """η (m,), the L2 norm of p* − p on each, for `coefficients` (m · k,).

        NaN where a `fit` has too few neighbours.
        """
        c = coefficients.reshape(len(self.products), -1)
        scale = np.abs(c).max(initial=0.0) or 1.0  # squares of the largest numbers overflow
        square = np.einsum("mk,mkl,ml->m", c / scale, self.products, c / scale)
        return np.where(fit.alone, np.nan, scale * np.sqrt(np.maximum(square, 0.0)))


def recovery(
    asked: RecoveryRequest,
    found: Sequence[Segments],
    surface: Surface,
    n_nodes: int,
    slip: bool = False,
) -> Recovery:
    """The recovery of the pressure of macro-elements, from the segments that cover them.

    `slip`: tractions along the tangents are recovered too.

    A slave edge from 0 to 2 under two master edges, with ψ = (1 − x) / 2: ∫ ψ N is ±1/6 at the two
    slave nodes, 1/6, 0, −1/6 at the three master nodes, and ∫ ψ² is 1/6.

    >>> found = meet_in_segments([slave], [], [master], 1.0, degree=1)
    >>> at = Surface(area=np.array([2.0]), covered=np.array([2.0]), centre=np.array([[1.0, 0.0]]),
    ...              normal=np.array([[0.0, 1.0]]), lost=np.zeros(1))
    >>> near = sparse.eye_array(1, dtype=bool).tocsr()
    >>> alone = RecoveryRequest(FORMS["linear"], near, np.zeros(1))
    >>> one = recovery(alone, found, at, len(points))
    >>> one.loads.toarray().reshape(5, 2)[:, 1].round(4).tolist(), one.products.round(4).tolist()
    ([-0.1667, 0.1667, 0.1667, 0.0, -0.1667], [[[0.1667]]])
    """
    form = asked.form
    at, (m, dim) = moments(found, surface), surface.centre.shape
    k = form.count(dim)
    products = np.zeros((m, k, k))
    given = []
    for segments in found:
        psi = at.local.shapes(segments.macro, segments.points, form)
        weighted = segments.weight[..., None] * psi
        np.add.at(products, segments.macro, np.einsum("sqk,sql->skl", weighted, psi))
        if form.applied:
            given.append((segments, psi[..., : k - (not form.keeps_means)]))
    near = _same_materials(asked, found)
    along = tangents(surface.normal) if slip else []
    compliance, shape = asked.compliance, (m, k, dim * n_nodes)
    return Recovery(
        form=form,
        moments=at,
        near=near,
        loads=_loads(given, shape),
        products=products,
        slip_loads=tuple(_loads(given, shape, t) for t in along),
        levers=levers(given, surface.normal, k) if slip else None,
        compliance=compliance and compliance(found, at, near, surface.covered),
    )


def _loads(
    given: Sequence[tuple[Segments, np.ndarray]],
    shape: tuple[int, int, int],
    tangent: Tangent | None = None,
) -> sparse.csr_matrix:
    """∫ ψ (N_master − N_slave) n dS (m · k, n_dofs), or with a `tangent` in place of n.

    `given` are segments with the ψ (s, q, ≤ k) at their points, `shape` is m, k, n_dofs.
    """
    rows, columns, values = [], [], []
    m, k, n_dofs = shape
    for segments, psi in given:
        weighted = segments.weight[..., None] * psi
        along = segments.normal if tangent is None else along_faces(segments, tangent)
        row = segments.macro[:, None] * k + np.arange(psi.shape[-1])
        dim = along.shape[-1]
        for sign, side in zip((-1.0, 1.0), segments.sides, strict=True):
            part = np.einsum("sqk,sqa,sqd->skad", sign * weighted, side.values, along)
            column = dim * side.nodes[:, :, None] + np.arange(dim)
            rows.append(np.broadcast_to(row[:, :, None, None], part.shape).ravel())
            columns.append(np.broadcast_to(column[:, None], part.shape).ravel())
            values.append(part.ravel())
    entries = [np.concatenate(part or [np.empty(0, int)]) for part in (values, rows, columns)]
    return sparse.coo_matrix((entries[0], (entries[1], entries[2])), shape=(m * k, n_dofs)).tocsr()


def _same_materials(asked: RecoveryRequest, found: Sequence[Segments]) -> sparse.csr_matrix:
    """Pairs of macro-elements (m, m) that share a vertex, the second between no other materials.

    Where the material of the master changes under a macro-element, it has neighbours on both sides,
    and is itself no neighbour to these.
    """
    m = len(asked.material)
    least, most = np.full(m, np.inf), np.full(m, -np.inf)
    for segments in found:
        master = segments.master.faces.number[segments.master.face]
        np.minimum.at(least, segments.macro, master)
        np.maximum.at(most, segments.macro, master)
    pairs = asked.near.tocoo()
    i, j = pairs.row, pairs.col
    kept = (asked.material[i] == asked.material[j]) & (least[i] <= least[j]) & (most[j] <= most[i])
    return sparse.csr_matrix((pairs.data[kept], (i[kept], j[kept])), shape=(m, m))


def with_status(
    start: S,
    correct: Callable[[S], T | None],
    wrong: Callable[[T], bool],
    again: Callable[[T], S],
) -> T | None:
    """Correct until the status of what is found is right, at most three times.

    `correct` a start; where the status is `wrong` under the correction, `again` makes a new start.
    None where a correction fails, or the third one still has a wrong status.

    >>> with_status(1, lambda n: 10 * n, lambda found: found < 20, lambda found: found // 10 + 1)
    20
    """
    for _ in range(_ROUNDS):
        found = correct(start)
        if found is None or not wrong(found):
            return found
        start = again(found)
    return None


def settled_means(
    pressure: np.ndarray,
    force: np.ndarray,
    loads: Callable[[np.ndarray], np.ndarray],
    change: Callable[[np.ndarray], np.ndarray],
    most: int = MOST_SWEEPS,
    enough: float = SETTLED,
    unit: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """The means (k,) whose reconstruction is applied in the last sweep, of `most` of them.

    Also the largest change of a mean by the first sweep: a last one that changes more has diverged;
    infinite where there is no other.

    `pressure` (k,) is the one under the loads `force` (n_dofs,) of a reconstruction; `loads` gives
    those of the reconstruction of any means, `change` by how much (k,) loads change the pressure.
    A sweep after the first that changes them by no more than the share `enough` of the largest, or
    of a `unit` (k,) for each, is the last one, and one that changes them far more than the first.

    Here loads that are the means, and lower them by a third of their own, leave 3/4 of them:

    >>> found, first = settled_means(np.ones(1), np.zeros(1), lambda p: p, lambda f: -f / 3)
    >>> found.round(12).tolist(), round(first, 12)
    ([0.75], 0.333333333333)
    """
    last, first = pressure, np.inf
    size = float(np.abs(pressure).max(initial=0.0)) or 1.0
    unit = np.full(len(pressure), size) if unit is None else np.maximum(unit, _ROUND_OFF * size)
    settled = np.maximum(enough * unit, _ROUND_OFF * size)
    tried: list[np.ndarray] = []
    changes: list[np.ndarray] = []
    for sweep in range(most - 1):
        following = loads(pressure)
        last = last + change(following - force)
        left = last - pressure
        largest = float(np.abs(left).max(initial=0.0))
        first = first if sweep else largest
        diverges = largest > max(_GROWTH * first, _ROUNDING * size)
        if sweep and (diverges or (np.abs(left) <= settled).all()):
            break
        step = _RELAXATION * left
        if sweep:
            moved = pressure[:, None] - np.transpose(tried[-_MEMORY:])
            fell = left[:, None] - np.transpose(changes[-_MEMORY:])
            share = np.linalg.lstsq(fell / unit[:, None], left / unit, rcond=_ALIKE)[0]
            step -= (moved + _RELAXATION * fell) @ share
        tried.append(pressure)
        changes.append(left)
        pressure, force = pressure + step, following
    return pressure, first


def unsettled(first: float, change: np.ndarray, found: Trial, most: int = MOST_SWEEPS) -> bool:
    """Whether a `change` (k,) of pressures by the last of `most` sweeps leaves no recovered state.

    They diverge, or they do not settle, which is not asked of fewer than usual. `first`: the
    largest change by the first sweep; `found`: what the last one led to.

    >>> none = np.zeros(1)
    >>> found = Trial(pressure=np.ones(1), gap=none, pressure_limit=none, gap_limit=none)
    >>> [unsettled(1e-3, np.full(1, 1e-4), found, most) for most in (3, MOST_SWEEPS)]
    [False, True]
    """
    size = float(np.abs(change).max(initial=0.0))
    grows = size > max(_GROWTH * first, negligible(found, _ROUNDING))
    return grows or (most >= MOST_SWEEPS and size > negligible(found, _UNSETTLED))


def negligible(found: Trial, share: float) -> float:
    """A change of pressure that is no more than a `share` of the largest, or than rounding.

    >>> none = np.zeros(1)
    >>> found = Trial(pressure=np.array([-2.0]), gap=none, pressure_limit=none, gap_limit=none)
    >>> negligible(found, 1e-9)
    2e-09
    """
    known = found.pressure_limit[np.isfinite(found.pressure_limit)].max(initial=0.0)
    return float(max(share * np.abs(found.pressure).max(initial=0.0), known))
