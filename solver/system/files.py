"""Files that are written whole or not at all, and sealed by a hash."""

import hashlib
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError, printable

# The last bytes of a sealed file; HDF5 leaves alone what follows its own end.
_SEAL = b"\nsha256 %s\n"
_SEAL_SIZE = len(_SEAL % (b"0" * 64))
_CHUNK = 1 << 20


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary path in the same folder; it takes the place of `path` when the block ends well.

    The folder is made where it is missing. When the block raises, the temporary file goes and
    `path` stays as it was; an InputError, or an OSError as of a full disk, names `path`.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # Writers choose the format by the suffix, in lower case. What a kill leaves is written over.
    temporary = path.with_name(f".{path.stem}.part{path.suffix.lower()}")
    try:
        yield temporary
        _to_disk(temporary)
        temporary.replace(path)
    except OSError as error:
        if error.errno and error.filename in (None, str(temporary)):
            error.filename = str(path)
        raise
    except InputError as error:
        if error.where != printable(temporary):
            raise
        raise type(error)(path, error.key, error.value, error.problem) from None
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file in UTF-8: whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def last_line(path: Path | None) -> str:
    """The last line of a file that is not blank; empty if none is."""
    if path is None or not path.is_file():
        return ""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


def hash_of(files: Iterable[str | Path]) -> str:
    """The hash of the contents of files, in their order."""
    found = hashlib.sha256()
    for file in map(Path, files):
        found.update(_digest(file, file.stat().st_size))
    return found.hexdigest()


def seal(path: Path) -> str:
    """Append the hash of a file's content, for `seal_of`; returns the hash."""
    digest = _digest(path, path.stat().st_size)
    with path.open("ab") as file:
        file.write(_SEAL % digest)
    return digest.decode()


def seal_of(path: str | Path) -> str:
    """The hash of a file that is unchanged since `seal`; empty for any other file.

    HDF5 reads some damaged files without an error, and crashes on others.
    """
    path = Path(path)
    if not path.is_file():  # a pipe or a device has no end
        return ""
    try:
        content = path.stat().st_size - _SEAL_SIZE
        with path.open("rb") as file:
            file.seek(max(content, 0))
            mark = file.read()
        digest = _digest(path, content)
        return digest.decode() if content >= 0 and mark == _SEAL % digest else ""
    except (OSError, ValueError):
        return ""


def _digest(path: Path, size: int) -> bytes:
    """The hash of the first `size` bytes of a file, in hexadecimal digits."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0 and (part := file.read(min(size, _CHUNK))):
            digest.update(part)
            size -= len(part)
    return digest.hexdigest().encode()


def _to_disk(path: Path) -> None:
    """Wait until the content is on the disk: a file renamed before may be empty after a crash."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
