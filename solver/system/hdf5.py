"""HDF5 files written from memory, and tables in them.

They are made in memory because on a full disk HDF5 itself fails at any later place. A table is a
group with one data set for each column.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

# Memory is asked for in pieces of this size (bytes).
_PIECE = 1 << 20


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
