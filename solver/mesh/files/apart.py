"""Readers of foreign files in a separate process: a crash of the reader does not end the solve.

Some damaged files crash gmsh and HDF5, which are C++ and C libraries, or never end.
"""

import os
import pickle
import signal
from collections.abc import Callable
from pathlib import Path

import meshio

from ...system.errors import InputError
from ...system.process import fork

# Processor time that a reader may take: fixed, and for each megabyte.
_SECONDS, _SECONDS_PER_MB = 8.0, 5.0

Reader = Callable[[Path], meshio.Mesh]


def read_here(reader: Reader, path: Path) -> meshio.Mesh:
    """The result of `reader(path)`; any exception becomes an InputError."""
    mesh, refusal = _attempt(reader, path)
    if mesh is None:
        raise InputError(*refusal)
    return mesh


def read_apart(reader: Reader, path: Path) -> meshio.Mesh:
    """The result of `reader(path)`; any failure becomes an InputError."""
    inward, outward = os.pipe()
    child = fork()
    if child == 0:
        os.close(inward)
        _answer(reader, path, outward)
    os.close(outward)
    with os.fdopen(inward, "rb") as stream:
        answer = stream.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status:
        long = "takes too long to read" if status == -signal.SIGPROF else "the reader died of it"
        raise InputError(path, "mesh", None, f"cannot be read ({long}: damaged?)")
    mesh, refusal = pickle.loads(answer)
    if mesh is None:
        raise InputError(*refusal)
    return mesh


def _answer(reader: Reader, path: Path, outward: int) -> None:
    """Write the mesh or the refusal; end the process without the exit handlers of its parent."""
    allowed_time = _SECONDS + _SECONDS_PER_MB * path.stat().st_size / 1e6
    signal.setitimer(signal.ITIMER_PROF, allowed_time)  # its signal ends the process
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    status = 1
    try:
        found = _attempt(reader, path)
        with os.fdopen(outward, "wb") as stream:
            pickle.dump(found, stream)
        status = 0
    finally:
        os._exit(status)


def _attempt(reader: Reader, path: Path) -> tuple[meshio.Mesh | None, tuple[str, str, object, str]]:
    try:
        return reader(path), ("", "", None, "")
    except InputError as error:
        return None, (error.where, error.key, error.value, error.problem)
    except Exception as error:  # noqa: BLE001 -- whatever the reader trips over is in the file
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        return None, (str(path), "mesh", None, f"cannot be read ({reason})")
