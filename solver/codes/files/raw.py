"""Contents of a result file: locations, and fields under their original names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_MESHIO


class RawField(NamedTuple):
    """Values (k, c) with the names of their components (empty: not known), and their places.

    `places` (k, 2 or 3); `nodes` or `cells` (k,) are numbers in the mesh of the file, None for
    other places.
    """

    values: np.ndarray
    components: tuple[str, ...]
    places: np.ndarray
    nodes: np.ndarray | None = None
    cells: np.ndarray | None = None


@dataclass(frozen=True)
class Raw:
    """The content of one file: its mesh if it has one, fields by name, the code if it says so.

    `digits`: the significant ones of its values, None for all.
    """

    mesh: meshio.Mesh | None
    fields: Mapping[str, RawField] = field(default_factory=dict)
    code: str = ""
    version: str = ""
    digits: int | None = None


def plain_mesh(points: np.ndarray, cells: list[tuple[str, np.ndarray]]) -> meshio.Mesh:
    """The cells of types in the catalogue on points (n, 2 or 3)."""
    points = np.asarray(points, dtype=float)
    return meshio.Mesh(points, [(name, data) for name, data in cells if name in BY_MESHIO])


def at_nodes(points: np.ndarray, values: np.ndarray, components: tuple[str, ...] = ()) -> RawField:
    """A field that is given at all nodes."""
    values = np.asarray(values, dtype=float).reshape(len(points), -1)
    return RawField(values, components, points, np.arange(len(points)))


def at_cells(
    mesh: meshio.Mesh, values: list[np.ndarray], components: tuple[str, ...] = ()
) -> RawField:
    """A field that is given by cell, block by block, at the centres of the cells."""
    flat = [np.asarray(part, dtype=float).reshape(len(part), -1) for part in values]
    centres = [mesh.points[block.data].mean(axis=1) for block in mesh.cells]
    numbers = np.arange(sum(len(part) for part in flat))
    return RawField(np.concatenate(flat), components, np.concatenate(centres), cells=numbers)
