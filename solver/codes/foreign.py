"""What another code found, as arrays: what readers and runners of codes hand to the checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import meshio
import numpy as np


@dataclass(frozen=True, kw_only=True)
class Field:
    """Values at places, in the coordinates of the undeformed model and the units of the case.

    `places` (k, 2 or 3), `values` (k,) or (k, c). `nodes` (k,) are numbers of nodes of the result's
    own mesh, where the places are nodes; `cells` (k,) are those of its cells, block after block,
    where values are means over cells; `area` (k,) belongs to each place of a surface, where it is
    known. NaN: not known there.
    """

    places: np.ndarray
    values: np.ndarray
    nodes: np.ndarray | None = None
    cells: np.ndarray | None = None
    area: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class ForeignResult:
    """A result of another code; None is what it does not give.

    `code` is its name in `<case>@<code>`: letters, digits, `-`, `_`, `.`. `mesh` is that of the
    result: points (n, 2 or 3) and cells, the case's own or another one; a case in 2D may be a layer
    of cells in 3D. `displacement` (k, dim), `stress` (k, 6) in the order xx, yy, zz, xy, yz, xz and
    positive in tension, `pressure` (k,) ≥ 0 in compression and `gap` (k,) ≥ 0 when open, both at
    nodes, faces or other points of the interface. `forces` are those of contact on the slave (dim,)
    by zone. `step`: the load factor that the result belongs to. `digits`: the significant digits of
    values, where a file has fewer than a number in memory. `settings` are those of the code,
    to be shown. Times in seconds.
    """

    code: str
    version: str = ""
    mesh: meshio.Mesh | None = None
    displacement: Field | None = None
    stress: Field | None = None
    pressure: Field | None = None
    gap: Field | None = None
    forces: Mapping[str, np.ndarray] = field(default_factory=dict)
    step: float | None = None
    digits: int | None = None
    settings: Mapping[str, str] = field(default_factory=dict)
    seconds: float | None = None
    cpu_seconds: float | None = None
    peak_memory_mb: float | None = None
