"""Plain tables: a line of names, then lines of numbers, between spaces, commas or semicolons."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...system.errors import InputError
from .raw import Raw, RawField

_AXES = ("x", "y", "z")


def read(path: Path, columns: Sequence[str] = ()) -> Raw:
    """The columns of a table as fields at its places x, y, z.

    `columns` are the names where the file has no line of them. Raises InputError, with the number
    of the line, for what is no such table.
    """
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    texts = [
        (number, content)
        for number, line in enumerate(text.splitlines(), start=1)
        if (content := line.partition("#")[0].strip(" \t,;"))
    ]
    if not texts:
        raise InputError(path, "table", None, "the file is empty")
    # Names between commas or semicolons may hold spaces.
    between = next((mark for mark in ",;" if mark in texts[0][1]), None)
    split = re.compile(rf"\s*{between}\s*" if between else r"\s+").split
    lines = [(number, split(content)) for number, content in texts]
    names = tuple(columns) or tuple(_known(name.strip("\"'")) for name in lines.pop(0)[1])
    if not set(_AXES[:2]) <= {name.lower() for name in names}:
        allowed = "the first line must name the columns, as in `x y z pressure`"
        raise InputError(path, "columns", " ".join(names), allowed)
    rows = np.array([_row(path, number, entries, names) for number, entries in lines], dtype=float)
    if not len(rows):
        raise InputError(path, "table", None, "there are no lines of numbers")
    lower = [name.lower() for name in names]
    axes = [lower.index(axis) for axis in _AXES if axis in lower]
    places = rows[:, axes]
    fields = {
        name: RawField(rows[:, chosen], (), places)
        for name, chosen in _fields(names).items()
        if not set(chosen) & set(axes)
    }
    return Raw(None, fields)


def _known(name: str) -> str:
    """A place by its axis, as ParaView's spreadsheet calls it: `Points:0` is x."""
    match = re.fullmatch(r"[Pp]oints[:_]([012])", name)
    return _AXES[int(match[1])] if match else name


def _fields(names: Sequence[str]) -> dict[str, list[int]]:
    """The columns of each field: `stress:0`, `stress:1` … are components of one."""
    found: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        field, mark, component = name.rpartition(":")
        if mark and component.isdigit():
            found.setdefault(field, []).append(i)
        elif not mark:
            found[name] = [i]
    return found


def _row(path: Path, number: int, entries: list[str], names: Sequence[str]) -> list[float]:
    if len(entries) != len(names):
        allowed = f"{len(entries)} entries for {len(names)} columns"
        raise InputError(path, f"line {number}", None, allowed)
    try:
        return [float(entry) for entry in entries]
    except ValueError:
        raise InputError(path, f"line {number}", " ".join(entries), "must be numbers") from None
