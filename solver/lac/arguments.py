"""What is given to `LocalAverageContact`, checked: ValueError in one line for what does not fit."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import skfem
from scipy import sparse

from .motions import body_numbers, rigid_motions

# Shares of the largest entry by which a stiffness may be unsymmetric, or resist a rigid motion.
_SYMMETRIC, _RIGID = 1e-9, 1e-9


def check_boundary(given: object, role: str) -> None:
    """ValueError unless it is a pair of a mesh and the name of a boundary, or several names.

    >>> check_boundary((skfem.MeshTri(), "left"), "slave")
    """
    pair = given if isinstance(given, tuple | list) and len(given) == 2 else (None, None)
    names = [pair[1]] if isinstance(pair[1], str) else pair[1]
    named = isinstance(names, Sequence) and names and all(isinstance(n, str) for n in names)
    if not isinstance(pair[0], skfem.Mesh) or not named:
        allowed = "must be a pair: a mesh, and the name of a boundary or a list of names"
        raise ValueError(f"{role}: {allowed}")


def checked_search(search: object) -> float | None:
    """The distance, a length of zero or more, or None.

    >>> checked_search(0.5)
    0.5
    """
    if search is None:
        return None
    number = isinstance(search, int | float | np.number) and not isinstance(search, bool)
    if not number or not float(search) >= 0:  # type: ignore[arg-type]
        raise ValueError(f"search = {search!r}: must be a length, zero or more")
    return float(search)  # type: ignore[arg-type]


def checked_vector(value: object, size: int, name: str) -> np.ndarray:
    """An array (size,) of finite real numbers.

    >>> checked_vector([1, 2], 2, "f").tolist()
    [1.0, 2.0]
    """
    found = np.asarray(value)
    if found.shape != (size,) or found.dtype.kind not in "iuf":
        shape = " × ".join(map(str, found.shape)) or "one"
        raise ValueError(f"{name}: {shape} of {found.dtype}; must be {size} real numbers")
    if not np.isfinite(found).all():
        raise ValueError(f"{name}: number {int(np.isfinite(found).argmin())} is not finite")
    return found.astype(float)


def checked_unknowns(held: Any, size: int) -> np.ndarray:
    """The numbers of held unknowns, each once: of an array, or of scikit-fem's `get_dofs`.

    >>> checked_unknowns([3, 1, 3], 4).tolist()
    [1, 3]
    """
    if held is None:
        return np.zeros(0, dtype=int)
    found = np.asarray(held.flatten() if hasattr(held, "flatten") else held).ravel()
    if not len(found):
        return np.zeros(0, dtype=int)
    if found.dtype.kind not in "iu":
        raise ValueError(f"D: of {found.dtype}; must be numbers of unknowns, as get_dofs gives")
    if found.min() < 0 or found.max() >= size:
        raise ValueError(f"D: {found.min()} to {found.max()}; there are unknowns 0 to {size - 1}")
    return np.unique(found)


def checked_stiffness(given: Any, size: int, name: str = "K") -> sparse.csr_matrix:
    """A symmetric matrix (size, size) of finite real numbers with no negative diagonal.

    >>> checked_stiffness(np.eye(2), 2).toarray().tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    if not sparse.issparse(given) and not isinstance(given, np.ndarray):
        raise ValueError(f"{name} = {type(given).__name__}: must be a matrix")
    if given.shape != (size, size):
        shape = " × ".join(map(str, given.shape))
        raise ValueError(f"{name}: {shape}; B has {size} unknowns")
    matrix = sparse.csr_matrix(given)
    if matrix.dtype.kind not in "iuf" or not np.isfinite(matrix.data).all():
        raise ValueError(f"{name}: must have finite real numbers")
    most = abs(matrix).max()
    if abs(matrix - matrix.T).max() > _SYMMETRIC * most:
        raise ValueError(f"{name}: must be symmetric")
    if matrix.diagonal().min() < 0:
        raise ValueError(f"{name}: has a negative diagonal; a stiffness is positive")
    return matrix.astype(float)


class Bodies:
    """The bodies of the meshes, their names and rigid motions (N, r) in the numbering of a system.

    `cells` by node, `unknown` (n · dim,) of each component of each node, `slave` (n,): whether
    nodes belong to the slave's mesh.
    """

    def __init__(
        self,
        points: np.ndarray,
        cells: dict[str, np.ndarray],
        unknown: np.ndarray,
        slave: np.ndarray,
        size: int,
    ):
        body = body_numbers(len(points), cells)
        self.count = int(body.max()) + 1
        by_node = rigid_motions(points, body).tocoo()
        shape = size, by_node.shape[1]
        self.motions = sparse.csr_matrix((by_node.data, (unknown[by_node.row], by_node.col)), shape)
        first = np.unique(body, return_index=True)[1]
        sides = ["slave" if slave[n] else "master" for n in first]
        self.names = [f"the {side}'s body" for side in sides]
        if len(set(sides)) < len(sides):
            places = [", ".join(f"{x:.6g}" for x in points[n]) for n in first]
            self.names = [f"the body at ({place})" for place in places]

    def check(self, stiffness: sparse.csr_matrix) -> None:
        """ValueError where a stiffness (N, N) resists a rigid motion.

        Its parts are then in another order than B's unknowns, or belong to other meshes.
        """
        resisted = abs(stiffness @ self.motions).max(axis=0).toarray().ravel()
        wrong = resisted > _RIGID * abs(stiffness).max()
        if wrong.any():
            body = self.names[int(wrong.argmax()) // (len(wrong) // self.count)]
            raise ValueError(
                f"K: resists rigid motions of {body}: its parts must be in the order of B's "
                "unknowns, the slave's first; give springs to the ground apart, as `springs`"
            )
