"""Mesh files, by their extension; foreign ones are read in a separate process.

| extension | read by | groups |
|---|---|---|
| .med, .mmed | `med` | of cells and of nodes |
| .msh, versions 2 and 4 | gmsh | physical groups; points become groups of nodes |
| .inp | `abaqus` | *ELSET, *SURFACE, *NSET |
| .vtu | meshio | each integer array of 0 and 1 on cells or points is a group of its name |
| .vtkhdf | `vtkhdf` | as this program writes them |

Some damaged files crash gmsh and HDF5, which are C++ and C libraries, or never end. In a process of
its own a reader that crashes does not end the solve.
"""

import os
import pickle
import signal
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import meshio

from ...system.errors import InputError
from ...system.files import replacing
from ...system.process import fork
from ..tidy import tidy

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


WRITTEN = (".vtkhdf", ".med", ".msh", ".vtu", ".inp")
# Modules with a function `read(path)` that returns the mesh as stored in the file.
_READERS = {
    ".med": ".med",
    ".mmed": ".med",
    ".msh": ".msh",
    ".inp": ".abaqus",
    ".vtu": ".vtu",
    ".vtkhdf": ".vtkhdf",
}


def read(path: Path) -> meshio.Mesh:
    """The mesh of a file, tidied. Raises InputError for any file that cannot be read."""
    suffix = path.suffix.lower()
    if suffix not in _READERS:
        raise InputError(path, "extension", path.suffix, f"allowed: {', '.join(_READERS)}")
    if not path.is_file():
        raise InputError(path, "mesh", None, "no such file")
    reader = import_module(_READERS[suffix], __package__)
    # Our own files are hashed: what they hold is what was written.
    read_by = read_here if suffix == ".vtkhdf" else read_apart
    mesh = read_by(lambda file: tidy(reader.read(file), file), path)
    if not mesh.cell_sets:
        allowed = "the mesh must have named groups of cells or faces (docs/formats.md)"
        raise InputError(path, "groups", None, allowed)
    return mesh


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write the mesh with its groups, whole or not at all; the extension says how.

    Raises InputError for an extension that is not one of `WRITTEN`.
    """
    suffix = path.suffix.lower()
    if suffix not in WRITTEN:
        raise InputError(path, "extension", path.suffix, f"allowed: {', '.join(WRITTEN)}")
    with replacing(path) as temporary:
        import_module(_READERS[suffix], __package__).write(mesh, temporary)
