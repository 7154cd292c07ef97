"""The ways in which a command ends early: its input is refused, or the solve fails."""

from collections.abc import Iterable
from difflib import get_close_matches

# Names that a message lists: all of up to so many, else the nearest ones.
_ALL, _NEAREST = 24, 12


class InputError(Exception):
    """The input is refused: one line that names the file, the key, the value and the problem.

    The command line prints the line and exits with status 2.
    """

    def __init__(self, where: object, key: str, value: object, problem: str):
        """Compose the line. A `value` of None is not shown: the key is missing.

        `detail` is the line without the file.
        """
        self.where, self.key, self.value, self.problem = printable(where), key, value, problem
        shown = "" if value is None else f" = {_shorten(value)}"
        self.detail = f"{key}{shown}: {problem}"
        super().__init__(f"{self.where}: {self.detail}")


class MachineError(InputError):
    """The input is valid, but memory or disk is short. Another run may succeed."""


def of_machine(error: Exception) -> str:
    """One line for an error of the machine (memory, a file that cannot be used); else empty."""
    said = " ".join(str(error).split())
    unmapped = isinstance(error, ImportError) and "failed to map segment" in said
    if isinstance(error, MemoryError) or unmapped:
        return f"out of memory: {said or 'none left'}"
    if isinstance(error, OSError) and error.errno:
        return f"{error.filename or 'output'}: {error.strerror}"
    return ""


def printable(name: object) -> str:
    """A name as one line of UTF-8: other characters are escaped."""
    text = str(name)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def hint(name: str, known: Iterable[str]) -> str:
    """`did you mean …?` if one of the known names is near, and the names, the nearest of many."""
    known = sorted(known)
    if not known:
        return "there is none"
    listed = known
    if len(known) > _ALL:
        listed = get_close_matches(str(name), known, n=_NEAREST, cutoff=0.0)
    more = f" and {len(known) - len(listed)} more" if len(known) > len(listed) else ""
    allowed = f"allowed: {', '.join(listed)}{more}"
    near = get_close_matches(str(name), known, n=1)
    return f"did you mean {near[0]}? ({allowed})" if near else allowed


def key_path(keys: Iterable[str | int]) -> str:
    """`contact[0].slave` for the keys `("contact", 0, "slave")`."""
    path = ""
    for key in keys:
        name = str(key) if str(key).isprintable() else repr(key)
        step = f"[{key}]" if isinstance(key, int) else name
        path += step if isinstance(key, int) or not path else f".{step}"
    return path


def _shorten(value: object, length: int = 80) -> str:
    text = " ".join(repr(list(value) if isinstance(value, tuple) else value).split())
    return text if len(text) <= length else text[: length - 1] + "…"
