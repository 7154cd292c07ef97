"""MKL PARDISO called through ctypes: symmetric matrices, in double or single precision.

Source: Intel oneMKL developer reference, `pardiso` and its table of parameters (`iparm`).
"""

import ctypes
import os
import site
import sys
import weakref
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix

POSITIVE_DEFINITE, INDEFINITE = 2, -2
NO_MEMORY, ZERO_PIVOT, SINGULAR_DIAGONAL = -2, -4, -7
_ANALYSE, _FACTORISE, _SOLVE, _RELEASE = 11, 22, 33, -1
_REASONS = {
    -1: "inconsistent input",
    NO_MEMORY: "not enough memory",
    -3: "reordering failed",
    ZERO_PIVOT: "zero or negative pivot",
    SINGULAR_DIAGONAL: "singular diagonal matrix",
    -8: "too many non-zeros for 32-bit integers",
}


class PardisoError(Exception):
    """PARDISO returned an error code; `.code` is that code."""

    def __init__(self, code: int):
        self.code = code
        super().__init__(_REASONS.get(code, f"error {code}"))


def available() -> bool:
    """Whether the library is there and loads."""
    return _library() is not None


class Pardiso:
    """The factor of one symmetric matrix, in PARDISO's own memory while this object lives.

    `upper` (n, n) is the upper triangle: csr, int32 indices, sorted, every diagonal entry stored;
    the factor has its precision (float64 or float32). Raises PardisoError.
    """

    def __init__(self, upper: csr_matrix, matrix_type: int = POSITIVE_DEFINITE):
        indefinite = matrix_type == INDEFINITE
        parameters = np.zeros(64, dtype=np.int32)
        for number, value in {
            1: 1,  # the values below count
            2: 2,  # nested dissection
            8: 3 if indefinite else 0,  # steps of refinement
            10: 13,  # pivots of an indefinite matrix below 1e-13 are replaced; refinement makes up
            11: int(indefinite),  # scaling and
            13: int(indefinite),  # matching, for the zeros on the diagonal
            21: 1,  # 1x1 and 2x2 pivots
            28: int(upper.dtype == np.float32),
            35: 1,  # indices count from zero
        }.items():
            parameters[number - 1] = value
        self._upper = upper
        self._state = np.zeros(64, dtype=np.int64), matrix_type, parameters
        weakref.finalize(self, _call, *self._state, _RELEASE, csr_matrix((1, 1)))
        _call(*self._state, _ANALYSE, upper)
        _call(*self._state, _FACTORISE, upper)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solve for the columns of `right` (n, k), in the precision of the factor."""
        right = np.asfortranarray(right, dtype=self._upper.dtype)
        solution = np.empty_like(right)
        _call(*self._state, _SOLVE, self._upper, right, solution)
        return solution


_NOTHING = np.zeros((1, 1))


def _call(
    handle: np.ndarray,
    matrix_type: int,
    parameters: np.ndarray,
    phase: int,
    upper: csr_matrix,
    right: np.ndarray = _NOTHING,
    solution: np.ndarray = _NOTHING,
) -> None:
    def integer(value: int) -> object:
        return ctypes.byref(ctypes.c_int32(value))

    def array(values: np.ndarray) -> ctypes.c_void_p:
        return values.ctypes.data_as(ctypes.c_void_p)

    library, error = _library(), ctypes.c_int32(0)
    if library is None:
        raise ImportError("the library mkl_rt is not installed")
    library.pardiso(
        array(handle),
        integer(1),
        integer(1),
        integer(matrix_type),
        integer(phase),
        integer(upper.shape[0]),
        array(upper.data),
        array(upper.indptr),
        array(upper.indices),
        None,
        integer(right.shape[1]),
        array(parameters),
        integer(0),
        array(right),
        array(solution),
        ctypes.byref(error),
    )
    if error.value:
        raise PardisoError(error.value)


_loaded: dict[str, ctypes.CDLL | None] = {}


def _library() -> ctypes.CDLL | None:
    if "mkl" not in _loaded:
        _loaded["mkl"] = _load()
    return _loaded["mkl"]


def _load() -> ctypes.CDLL | None:
    # Intel's threads would spin for 200 ms after each task: longer than a small factor takes.
    os.environ.setdefault("KMP_BLOCKTIME", "1")
    roots = [sys.prefix, site.USER_BASE, os.environ.get("MKLROOT")]
    folders = [Path(root) / "lib" for root in roots if root]
    for path in [found for folder in folders for found in sorted(folder.glob("libmkl_rt.so*"))]:
        try:
            library = ctypes.CDLL(str(path))
            library.MKL_Set_Interface_Layer(0)  # 32-bit integers, whatever the environment says
            # Intel's threads, also where gmsh has brought GNU's: with these the last digits differ.
            library.MKL_Set_Threading_Layer(0)
        except (OSError, AttributeError):
            continue
        library.pardiso.restype = None
        return library
    return None
