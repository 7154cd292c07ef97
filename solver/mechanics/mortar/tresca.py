"""Friction with given bounds: the convex problem of Tresca, as a cone program in the jumps alone.

With z = (gap, slip by tangent), means over macro-elements, S the forces that unit jumps bring up
with everything closed and stuck, and λ₀ the forces at z = 0, equilibrium is the minimum of
½ zᵀSz + λ₀ᵀz + Σ bᵢ |z_t,i| over z_n ≥ 0, and λ = λ₀ + S z are the forces: pressures and tractions
times areas. Coulomb's friction is the fixed point b = μλ_n. Source: Panagiotopoulos, A nonlinear
programming approach to the unilateral contact and friction boundary value problem, Ingenieur-Archiv
44 (1975) 421–432.
"""

from typing import Any

import numpy as np

_ACCURACY = 1e-13
# The fixed point: passes, and the change of bounds by the largest force that ends them.
_MOST, _SETTLED = 100, 1e-9


def coulomb_by_cones(
    stiffness: np.ndarray, forces: np.ndarray, friction: np.ndarray, of: np.ndarray, k: int
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Forces λ (r,), jumps z (r,), and whether the bounds settled; they do not where none balance.

    `stiffness` S (r, r), `forces` λ₀ (r,): rows of m gaps, then of the slips of f macro-elements
    along the first of k tangents, and so on. `friction` μ (f,); `of` (f,): the gap each one has.

    Springs without coupling in n and t, pressed by 2 and pulled by 1.5, μ = 1/2: it slips by what
    the bound 1 leaves of the pull.

    >>> one = np.array([0])
    >>> start, friction = np.array([2.0, 1.5]), np.array([0.5])
    >>> found, jump, _ = coulomb_by_cones(np.eye(2), start, friction, one, 1)
    >>> found.round(6).tolist(), (-jump[1:]).round(6).tolist()
    ([2.0, 1.0], [0.5])
    """
    from cvxopt import matrix  # it loads slowly

    f, r = len(friction), len(forces)
    m = r - k * f
    unit, size = np.abs(np.diag(stiffness)).max(), np.abs(forces).max() or 1.0
    s, start = (stiffness + stiffness.T) / (2 * unit), forces / size
    whole = np.zeros((r + f, r + f))
    whole[:r, :r] = s
    cones = _cones(m, f, k)
    bounds = friction * max(start[:m].mean(), 0.0)
    z, found, settled = np.zeros(r), start, False
    for _ in range(_MOST):
        goal = np.concatenate([start, bounds])
        try:
            z = _minimum(matrix(whole), matrix(goal), *cones)[:r]
        except ValueError:  # from inside CVXOPT: the program has no minimum
            break
        found = start + s @ z
        fresh = friction * np.maximum(found[of], 0.0)
        settled = bool(np.abs(fresh - bounds).max(initial=0.0) <= _SETTLED)
        bounds = fresh
        if settled:
            break
    return found * size, z * size / unit, settled


def _minimum(*program: Any) -> np.ndarray:
    from cvxopt import solvers

    accuracy = dict.fromkeys(("abstol", "reltol", "feastol"), _ACCURACY)
    options = {"show_progress": False, "maxiters": 200, **accuracy}
    return np.array(solvers.coneqp(*program, options=options)["x"]).ravel()


def _cones(m: int, f: int, k: int) -> tuple[Any, Any, dict[str, Any]]:
    """z_n ≥ 0 and |z_t| ≤ s, of the unknowns z (m + k f,), then s (f,)."""
    from cvxopt import matrix, spmatrix

    gap, slip = np.arange(m), np.arange(f)
    rows, columns = [gap, m + (k + 1) * slip], [gap, m + k * f + slip]
    for c in range(k):
        rows.append(m + (k + 1) * slip + 1 + c)
        columns.append(m + c * f + slip)
    shape = m + (k + 1) * f, m + (k + 1) * f
    places = (np.concatenate(each).tolist() for each in (rows, columns))
    about = {"l": m, "q": [k + 1] * f, "s": []}
    return spmatrix(-1.0, *places, shape), matrix(0.0, (shape[0], 1)), about
