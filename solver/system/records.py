"""Typed records: data classes read from the plain values of a JSON file, every type checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from solver.system.errors import InputError

T = TypeVar("T")
_WORDS = {str: "text", bool: "true or false", int: "a whole number", float: "a number"}


def read_record(kind: type[T], value: object, where: Path) -> T:
    """The record of type `kind` (a data class, or a list of them) in what `json.loads` returns.

    Keys that the class does not have are ignored; a missing one takes its default. Where a number
    is expected, null is NaN. Raises `InputError` naming the file `where`, the key, its value and
    what is allowed.
    """
    return _read(kind, value, where, "")


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _read(kind: Any, value: Any, where: Path, key: str) -> Any:
    if is_dataclass(kind):
        return _record(kind, _mapping(value, where, key), where, key)
    origin, inner = get_origin(kind), get_args(kind)
    if origin is UnionType:
        if value is None and NoneType in inner:
            return None
        return _read_any([each for each in inner if each is not NoneType], value, where, key)
    if origin is list:
        if not isinstance(value, list):
            raise InputError(where, key or "file", value, "must be a list")
        return [_read(inner[0], item, where, f"{key}[{i}]") for i, item in enumerate(value)]
    if origin is dict:
        found = _mapping(value, where, key).items()
        return {name: _read(inner[1], item, where, f"{key}.{name}") for name, item in found}
    if kind is float and value is None:
        return float("nan")
    if type(value) is kind or (kind is float and type(value) is int):
        return value
    raise InputError(where, key, value, f"must be {_WORDS[kind]}")


def _read_any(kinds: Sequence[Any], value: Any, where: Path, key: str) -> Any:
    """The value as the first of the types that it fits."""
    for kind in kinds[:-1]:
        try:
            return _read(kind, value, where, key)
        except InputError:
            continue
    return _read(kinds[-1], value, where, key)


def _mapping(value: Any, where: Path, key: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(where, key or "file", value, "must be a mapping")
    return value


def _record(kind: Any, given: dict[str, Any], where: Path, key: str) -> Any:
    found, hints, prefix = {}, _hints(kind), f"{key}." if key else ""
    for item in fields(kind):
        if item.name in given:
            place = f"{prefix}{item.name}"
            found[item.name] = _read(hints[item.name], given[item.name], where, place)
        elif item.default is MISSING and item.default_factory is MISSING:
            raise InputError(where, f"{prefix}{item.name}", None, "this key is needed")
    return kind(**found)
