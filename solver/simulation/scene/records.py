"""What a scene holds: how its points are counted, what is held, loaded, named, or left out."""

from dataclasses import dataclass

import numpy as np

from ...mechanics.fem.supports import Fixed
from .holdings.frame import Frame


@dataclass(frozen=True, kw_only=True)
class GivenMesh:
    """The mesh before the cut.

    `cells`: the volume cells by type; `groups`: which of them (n,) each named group holds;
    `unnamed`: how many groups of the mesh, and of its faces and edges, the case does not name.
    """

    cells: dict[str, np.ndarray]
    groups: dict[str, dict[str, np.ndarray]]
    unnamed: tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class Unloaded:
    """What nothing moves (see `solver.simulation.scene.bodies`).

    `unloaded_bodies` (b,) and `unloaded_multipliers` (k,) are left out of the solve, and the cells
    of `fixed_bodies` (b,): `blocks` and `free` of the scene are without them.
    """

    unloaded_bodies: np.ndarray
    fixed_bodies: np.ndarray
    unloaded_multipliers: np.ndarray


@dataclass(frozen=True)
class Coordinates:
    """How points are counted: from `origin` (dim,), the mean of the mesh's nodes.

    Far from the origin of the case's coordinates, differences would lose digits. `length` is the
    largest extent of the mesh, `rounding` how well its coordinates are known (a length).
    """

    origin: np.ndarray
    length: float
    rounding: float


@dataclass(frozen=True)
class Held:
    """The displacements that are `fixed`, and the `frames` of rigid bodies by name.

    `joint`: the name of the reaction of nodes that are joined, which have one; else empty.
    """

    fixed: list[Fixed]
    frames: dict[str, Frame]
    joint: str


@dataclass(frozen=True)
class AtWork:
    """How much acts at load factor 1, the scale of a step in which nothing acts.

    The largest nodal `force`, the sum `total` of their sizes, and the largest imposed `motion`.
    """

    force: float
    total: float
    motion: float

    @classmethod
    def of(cls, force: np.ndarray, offset: np.ndarray) -> "AtWork":
        """Of nodal forces (n, dim) and imposed displacements (n_dofs,)."""
        size, moved = np.abs(force), np.abs(offset).max(initial=0.0)
        return cls(float(size.max()), float(size.sum()), float(moved))


@dataclass(frozen=True)
class Loads:
    """`force` (n, dim) for load factor 1; by name in steps of names, forces and offsets.

    `at_work`: how much acts in all steps, where `force` may be that of one.
    """

    force: np.ndarray
    histories: dict[str, tuple[np.ndarray, np.ndarray]]
    at_work: AtWork


@dataclass(frozen=True)
class Named:
    """Nodes by probe, and those `acted` on by the key of the support, or load on a surface."""

    probed: dict[str, np.ndarray]
    acted: dict[str, np.ndarray]
