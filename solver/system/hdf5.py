"""HDF5 files: written from memory, read without links to other files, and tables in them.

They are made in memory because on a full disk HDF5 itself fails at any later place. A table is a
group with one data set for each column.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5g, h5i, h5l, h5o

from .errors import InputError

# Memory is asked for in pieces of this size (bytes).
_PIECE = 1 << 20
# Ours and MED's have up to 7 levels of groups.
_DEEPEST = 32


@contextmanager
def new_file(path: Path) -> Iterator[h5py.File]:
    """An HDF5 file in memory, written to `path` in one go when the block ends well.

    Raises OSError where the disk is full.
    """
    with h5py.File(path, "w", driver="core", backing_store=False, block_size=_PIECE) as file:
        yield file
        file.flush()
        image = file.id.get_file_image()
    path.write_bytes(image)


@contextmanager
def read_file(path: str | Path, real: bool = False) -> Iterator[h5py.File]:
    """An HDF5 file to be read; InputError for one that takes data from another file.

    Such files have external links, external storage or virtual data sets. Groups may be nested 32
    deep. `real`: raises TypeError for complex numbers, of which numpy makes real ones with a
    warning only.
    """
    with h5py.File(path, "r") as file:
        _look_through(file, path, real)
        yield file


def _look_through(file: h5py.File, path: str | Path, real: bool) -> None:
    """Look at each group and data set of a file, level by level."""
    level, seen = [file.id], set()
    for _ in range(_DEEPEST):
        below = []
        for group, name in [(each, name) for each in level for name in each]:
            kind = group.links.get_info(name).type
            item = h5o.open(group, name) if kind == h5l.TYPE_HARD else None
            # The target of a soft link is visited anyway.
            if _takes_from_elsewhere(item) if item else kind != h5l.TYPE_SOFT:
                allowed = "in another file: the file must hold all of its data itself"
                raise InputError(path, name.decode(errors="replace"), None, allowed)
            if real and isinstance(item, h5d.DatasetID) and item.dtype.kind == "c":
                raise TypeError(f"{h5i.get_name(item).decode()} holds complex numbers")
            if isinstance(item, h5g.GroupID) and (place := h5o.get_info(item).addr) not in seen:
                seen.add(place)
                below.append(item)
        level = below
    if level:
        raise InputError(path, "groups", None, f"nested deeper than {_DEEPEST} levels")


def _takes_from_elsewhere(item: h5py.h5g.GroupID | h5py.h5d.DatasetID) -> bool:
    if not isinstance(item, h5d.DatasetID):
        return False
    made = item.get_create_plist()
    return made.get_layout() == h5d.VIRTUAL or made.get_external_count() > 0


def write_table(group: h5py.Group, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write the rows' columns; nothing at all where there are no rows."""
    for key in rows[0] if rows else ():
        group[key] = column([row[key] for row in rows])


def column(values: list[Any]) -> np.ndarray:
    """An array of numbers, None as NaN, or of texts, None as an empty one."""
    if not values or any(isinstance(value, str) for value in values):
        return np.array([value or "" for value in values], dtype=h5py.string_dtype())
    return np.array([np.nan if value is None else value for value in values])


def read_table(group: h5py.Group) -> list[dict[str, Any]]:
    """Rows of a table that `write_table` wrote, as plain Python values."""
    columns = {
        name: (data.asstr()[()] if h5py.check_string_dtype(data.dtype) else data[()]).tolist()
        for name, data in group.items()
        if isinstance(data, h5py.Dataset)
    }
    rows = zip(*columns.values(), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]
