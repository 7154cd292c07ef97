"""What files that describe measurements have in common: names looked up, files named in them."""

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Protocol, TypeVar

from solver.system.errors import InputError, hint


class Named(Protocol):
    """What is known by its name."""

    @property
    def name(self) -> str: ...  # noqa: D102


AnyNamed = TypeVar("AnyNamed", bound=Named)


def point_of(path: Path, points: Sequence[AnyNamed], name: str) -> AnyNamed:
    """The point of that name; InputError where the file `path` describes none."""
    for point in points:
        if point.name == name:
            return point
    raise InputError(
        path, "point", name, f"no such point; {hint(name, (point.name for point in points))}"
    )


def refuse_twins(path: Path, key: str, items: Iterable[Named]) -> None:
    """Raise InputError for the first name of a list, under `key`, that is given twice."""
    seen: set[str] = set()
    for i, item in enumerate(items):
        if item.name in seen:
            allowed = "the name is given twice; each needs its own"
            raise InputError(path, f"{key}[{i}].name", item.name, allowed)
        seen.add(item.name)


def refuse_unknown(
    path: Path, key: str, name: str, kind: str, known: Collection[str], value: object = None
) -> None:
    """Raise InputError where a `name` is none of the `known` ones of its `kind`.

    `value`: what stands under `key`, where that is not the name itself.
    """
    if name not in known:
        allowed = f"there is no such {kind}; {hint(name, known)}"
        raise InputError(path, key, name if value is None else value, allowed)


def file_beside(path: Path, key: str, name: str) -> Path:
    """The file that `path` names under `key`, relative to itself; InputError if it is missing."""
    file = path.parent / name
    require_file(path, key, file, name)
    return file


def require_file(path: Path, key: str, file: Path, name: str) -> None:
    """Raise InputError where a file that `path` names under `key` is missing."""
    try:
        found = file.is_file()
    except OSError:  # the name is too long
        found = False
    if not found:
        raise InputError(path, key, name, "no such file")
