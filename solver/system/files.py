"""Files that are written whole or not at all, and sealed by a hash."""

import hashlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path

# The last bytes of a sealed file; HDF5 leaves alone what follows its own end.
_SEAL = b"\nsha256 %s\n"
_SEAL_SIZE = len(_SEAL % (b"0" * 64))
_CHUNK = 1 << 20

# Folders may be shared among machines; a process number is valid on one.
_HOST = platform.node()


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary path in the same folder; it takes the place of `path` when the block ends well.

    The folder is made where it is missing. When the block raises, the temporary file goes and
    `path` stays as it was; an OSError, as of a full disk, names `path`.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    _remove_abandoned(path)
    # The suffix is kept: writers choose the format by it.
    temporary = path.with_name(f".{path.stem}.{_HOST}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        _to_disk(temporary)
        temporary.replace(path)
    except OSError as error:
        if error.errno and error.filename in (None, str(temporary)):
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file in UTF-8: whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def last_line(path: Path | None, most: int = 4096) -> str:
    """The last line that is not blank among the `most` last bytes of a file; empty if none is."""
    try:
        with Path(path or os.devnull).open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - most))
            lines = file.read().decode(errors="replace").split("\n")
    except OSError:
        return ""
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


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


def _remove_abandoned(path: Path) -> None:
    """Remove temporary files of the same name left by killed processes of this machine."""
    for left in path.parent.glob(f".{escape(path.stem)}.{escape(_HOST)}.*{escape(path.suffix)}"):
        process = left.name.removesuffix(path.suffix).rpartition(".")[2]
        if process.isdigit() and not _lives(int(process)):
            left.unlink(missing_ok=True)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # of another user
        return True
    return True


def is_file(path: Path) -> bool:
    """Whether there is a file of that name, which may be too long for any."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
