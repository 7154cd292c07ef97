"""Ways to damage a file: its bytes, its text, or the structure inside an HDF5 file."""

import random
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from solver.system.files import seal

Change = Callable[[bytes, random.Random], bytes]

_NUMBERS = [b"-1", b"0", b"nan", b"1e999", b"9" * 40, b"99999999", b"1e-320", b"''", b"[]", b"x"]
_TOKENS = [b"&a ", b"*a", b"!!python/object:os.system ", b"{", b"]", b": ", b"\x00", b"\xff\xfe"]
_KINDS = [
    b"\x89HDF\r\n\x1a\n",
    b"%PDF-1.4\n",
    b"<?xml version='1.0'?>",
    b"$MeshFormat\n",
    b"PK\3\4",
]


def damaged(source: Path, target: Path, rng: random.Random) -> str:
    """Write a damaged copy of a file; the name of the way it was damaged."""
    if source.suffix in (".vtkhdf", ".med") and rng.random() < 0.5:
        target.write_bytes(source.read_bytes())
        try:
            return _in_hdf5(target, rng)
        finally:
            if source.suffix == ".vtkhdf":  # as if another program had written it so
                seal(target)
    name = rng.choice([*_BYTES])
    target.write_bytes(_BYTES[name](source.read_bytes(), rng))
    return name


def _truncated(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def _flipped(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _overwritten(data: bytes, rng: random.Random) -> bytes:
    start, size = rng.randrange(len(data)), rng.choice((1, 8, 512))
    fill = rng.choice((bytes(size), b"\xff" * size, rng.randbytes(size)))
    return data[:start] + fill + data[start + size :]


def _moved(data: bytes, rng: random.Random) -> bytes:
    a, b = sorted(rng.randrange(len(data)) for _ in range(2))
    return rng.choice((data[:a] + data[b:], data[:b] + data[a:]))


def _number(data: bytes, rng: random.Random) -> bytes:
    """Another number in place of one of the text's."""
    digits = [i for i, byte in enumerate(data) if chr(byte).isdigit()] or [0]
    start = end = rng.choice(digits)
    while end < len(data) and chr(data[end]) in "0123456789.e":
        end += 1
    return data[:start] + rng.choice(_NUMBERS) + data[end:]


def _token(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + rng.choice(_TOKENS) + data[place:]


def _line(data: bytes, rng: random.Random) -> bytes:
    """One line left out, or told twice."""
    lines = data.splitlines(keepends=True)
    i = rng.randrange(len(lines))
    return b"".join(lines[:i] + rng.choice(([], [lines[i]] * 2)) + lines[i + 1 :])


def _empty(_: bytes, __: random.Random) -> bytes:
    return b""


def _other_kind(data: bytes, rng: random.Random) -> bytes:
    return rng.choice(_KINDS) + rng.choice((b"", data[8:], rng.randbytes(600)))


_BYTES: dict[str, Change] = {
    "truncated": _truncated,
    "bits flipped": _flipped,
    "bytes overwritten": _overwritten,
    "part lost or told twice": _moved,
    "other number": _number,
    "foreign token": _token,
    "line lost or told twice": _line,
    "empty": _empty,
    "of another kind": _other_kind,
}


def _in_hdf5(path: Path, rng: random.Random) -> str:
    with h5py.File(path, "r+") as file:
        names: list[str] = []
        file.visit(names.append)
        item = file[name := rng.choice(sorted(names))]
        if item.attrs and rng.random() < 0.3:
            return _attribute(item, rng)
        if isinstance(item, h5py.Group) or rng.random() < 0.25:
            del file[name]
            return "HDF5 object lost"
        array = item[()]
        attributes = dict(item.attrs)
        del file[name]
        file[name] = _other_array(np.asarray(array), rng)
        file[name].attrs.update(attributes)
        return "HDF5 values changed"


def _attribute(item: h5py.HLObject, rng: random.Random) -> str:
    key = rng.choice(sorted(item.attrs))
    if rng.random() < 0.5:
        del item.attrs[key]
    else:
        item.attrs[key] = rng.choice((np.nan, -1, 2**62, "text", np.zeros(3)))
    return "HDF5 attribute changed"


def _other_array(array: np.ndarray, rng: random.Random) -> np.ndarray:
    changes: list[Callable[[np.ndarray], np.ndarray]] = [
        lambda a: a.ravel()[: a.size // 2],
        lambda a: a[..., None],
        lambda a: np.zeros((0, *a.shape[1:])),
        lambda a: np.full(a.shape, b"text"),
        lambda _: np.float64(1.0),
    ]
    if array.dtype.kind in "fiu":
        changes += [
            lambda a: np.where(np.arange(a.size).reshape(a.shape) == 0, np.nan, a),
            lambda a: np.full(a.shape, 2**40, dtype=a.dtype if a.dtype.itemsize == 8 else float),
            lambda a: -a.astype(float) - 7,
            lambda a: a.astype(complex),
        ]
    return rng.choice(changes)(array)
