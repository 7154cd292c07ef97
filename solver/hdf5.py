"""HDF5 files made in memory: where a disk is full, HDF5 itself fails at any later place."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

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
