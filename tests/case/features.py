"""What a case file can say, and what one says: keys, and the values that are chosen from a list.

A feature is a line such as `loads[].traction` or `contact[].treatment: nodal`. A key whose value
is free is one feature; it is used where it is not left at its default.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from msgspec import NODEFAULT

from solver.case.file import CaseFile
from solver.case.solutions.catalogue import SOLUTIONS
from solver.case.typed import Section, fields, is_section, parts_of, read_as

# Labels and texts for readers, which change no result.
_TEXTS = ("name", "title", "description", "units", "remark")


def features(recipes: Iterable[str]) -> list[str]:
    """All features, in the order of the case file; `recipes`: the names of the mesh recipes."""
    found = list(dict.fromkeys(_of_section(CaseFile, "")))
    place = found.index("mesh")
    meshes = ["mesh.file", "mesh.file: refine", *(f"mesh.recipe: {name}" for name in recipes)]
    found[place : place + 1] = meshes
    place = found.index("reference.solution")
    found[place : place + 1] = [f"reference.solution: {name}" for name in SOLUTIONS]
    return found


def used(content: dict[str, Any], path: Path) -> set[str]:
    """The features of the content of a case file; raises InputError where it is not valid."""
    file = read_as(CaseFile, content, path)
    found = set(_used(file, ""))
    mesh, solution = file.mesh, file.reference and file.reference.solution
    found.add(f"mesh.recipe: {mesh['recipe']}" if "recipe" in mesh else "mesh.file")
    found |= {"mesh.file: refine"} if {"file", "refine"} <= mesh.keys() else set()
    if solution:
        name = solution if isinstance(solution, str) else solution["name"]
        found.add(f"reference.solution: {name}")
    return found


def _of_section(kind: Any, path: str) -> Iterator[str]:
    for name, field in fields(kind).items():
        if name not in _TEXTS:
            yield from _of_key(field.type, f"{path}.{name}".lstrip("."))


def _of_key(kind: Any, path: str) -> Iterator[str]:
    yield from (f"{path}: {value}" for value in _choices(kind))
    if any(get_origin(part) is not Literal and part is not NoneType for part in parts_of(kind)):
        yield path
    yield from _inside(kind, path)


def _inside(kind: Any, path: str) -> Iterator[str]:
    for part in parts_of(kind):
        if is_section(part):
            yield from _of_section(part, path)
        elif (ending := _ENDINGS.get(get_origin(part))) is not None:
            yield from _inside(get_args(part)[-1 if ending == ".*" else 0], path + ending)


def _used(value: Section, path: str) -> Iterator[str]:
    """The features of a section as read, and of the sections in it."""
    for name, field in fields(type(value)).items():
        given, here = getattr(value, field.name), f"{path}.{name}".lstrip(".")
        if name in _TEXTS:
            continue
        if given in _choices(field.type):
            yield f"{here}: {given}"
        elif given != _default(field):
            yield here
        yield from _used_inside(given, here)


def _used_inside(value: Any, path: str) -> Iterator[str]:
    if is_section(type(value)):
        yield from _used(value, path)
    elif isinstance(value, dict):
        for item in value.values():
            yield from _used_inside(item, f"{path}.*")
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _used_inside(item, f"{path}[]")


def _choices(kind: Any) -> list[Any]:
    return [v for part in parts_of(kind) if get_origin(part) is Literal for v in get_args(part)]


def _default(field: Any) -> Any:
    if field.default_factory is not NODEFAULT:
        return field.default_factory()
    return field.default


_ENDINGS = {tuple: "[]", list: "[]", dict: ".*"}
