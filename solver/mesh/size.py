"""The size of a solve, estimated before meshing: unknowns, seconds, memory.

Memory was measured as the peak of solves of all cell types, 547 of them with a factor
and 20,000 to 640,000 unknowns: 100 MB for the program, then for each unknown (nodes times
dimensions) 1.9 to 7.4 kB in 2D and 4.4 to 16 kB in 3D, less for more elongated bodies. With
multigrid the program takes 200 MB, and an unknown 1.9 kB (HEXA8, 2,100,000 unknowns), 2.1 kB
(TETRA4, 520,000) to 4 kB (HEXA20, 1,100,000) with a stiffness in double precision, 1.4 kB (HEXA8,
1,040,000) and 1.25 kB (HEXA8, 3,060,000) with one in single precision. Less than the smallest
figure decides a refusal, so that no solve that fits is refused; the usual one decides a warning; a
cluster is asked for the largest, in case a factor is needed.
Time was measured from 10,000 to 1,000,000 unknowns on two cores, meshing included.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

from ..lac.cells.catalogue import BY_NAME, CellType
from ..system.errors import MachineError
from ..system.process import available
from ..system.progress import OUTCOME

_LOG = logging.getLogger(__name__)

# Nodes of an unstructured mesh for each product of its divisions, and of those of a side, by
# dimension and degree of the cells: counted to within a tenth.
_SIMPLICES = {(2, 1): (1.155, 2.4), (2, 2): (4.62, 5.0), (3, 1): (0.674, 4.8), (3, 2): (5.0, 26.0)}
# Pieces of a block, the product of its divisions, from which gmsh fills it with tetrahedra by HXT:
# that takes a tenth of the time and makes fewer nodes, by this factor.
_HXT_FROM, _HXT_NODES = 1_500_000, 0.89
# More divisions of an edge than any machine can hold.
_MANY = 10**9
# Bytes for each node of a mesh file, cells included: VTU files are packed.
_BYTES = {".vtu": 20}
_BYTES_ELSE = 80
# Seconds: factor and power of the unknowns, by dimension and degree of the cells.
_SECONDS = {
    (2, 1): (2.2e-5, 1.0),
    (2, 2): (2.2e-5, 1.0),
    (3, 1): (6.1e-6, 1.1),
    (3, 2): (9.0e-6, 1.1),
}
# Bytes of the program, with what every hierarchy of multigrid takes, and for each unknown.
_LEAST = {2: (100e6, 1.8e3), 3: (100e6, 1.1e3)}
_USUAL = {2: (100e6, 3.0e3), 3: (300e6, 1.8e3)}
_MOST = {2: (100e6, 7.4e3), 3: (100e6, 16.0e3)}


@dataclass(frozen=True)
class Need:
    """Memory (bytes) of a solve: at least, usually, and at most."""

    least: float
    usual: float
    most: float


@dataclass(frozen=True)
class Size:
    """Nodes of a mesh, exact or estimated, its dimension, and the highest degree of its cells."""

    points: float
    dim: int
    degree: int = 2

    @property
    def unknowns(self) -> float:
        """Components of displacement, imposed ones included."""
        return self.points * self.dim

    @property
    def seconds(self) -> float:
        """About how long meshing and one solve take."""
        factor, power = _SECONDS[self.dim, self.degree]
        return factor * self.unknowns**power

    @property
    def memory(self) -> Need:
        """The memory of a solve."""
        kinds = (kind[self.dim] for kind in (_LEAST, _USUAL, _MOST))
        return Need(*(program + by_unknown * self.unknowns for program, by_unknown in kinds))


def of_body(cells: str, divisions: Sequence[int], refine: int = 1) -> Size:
    """The size of a block of `cells`, its divisions each multiplied by `refine`.

    A single division is for all directions. Exact for grids of quadrangles and hexahedra.
    """
    kind = BY_NAME[cells]
    along = [refine * n for n in divisions] * (1 if len(divisions) == kind.dim else kind.dim)
    if kind.shape in ("TRIA", "TETRA"):
        inside, outside = _SIMPLICES[kind.dim, kind.order]
        nodes = inside * prod(along) + outside * prod(along[:-1])
        nodes *= _HXT_NODES if fills_by_hxt(cells, along) else 1.0
    else:
        # An edge of the grid has n places along its own axis and n + 1 along each other.
        grid = _in_grid(kind)
        nodes = sum(
            grid[sum(within)] * prod(n + 1 - w for n, w in zip(along, within, strict=True))
            for within in product((0, 1), repeat=kind.dim)
        )
    return Size(nodes, kind.dim, kind.order)


def _in_grid(kind: CellType) -> Sequence[float]:
    """Nodes of a piece of a grid: at its corner, within each of its edges, faces and volume.

    A piece is one cell, two prisms, or six pyramids about a point.
    """
    edge, middle = kind.order - 1, int(kind.centred)
    if kind.shape == "PENTA":
        return 1, edge, edge / 3, 0
    if kind.shape == "PYRA":
        return 1, edge, 0, 1 + 8 * edge
    return 1, edge, middle, middle


def fills_by_hxt(cells: str, divisions: Sequence[int]) -> bool:
    """Whether a block of `cells` is so large that gmsh fills it by HXT, not by Delaunay."""
    return cells.startswith("TETRA") and prod(divisions) >= _HXT_FROM


def of_bodies(bodies: Sequence[Size]) -> Size:
    """The size of a mesh of several bodies."""
    return Size(
        sum(body.points for body in bodies),
        min((body.dim for body in bodies), default=3),
        max((body.degree for body in bodies), default=2),
    )


def of_mesh(mesh: object, folder: Path, refine: int = 1) -> Size:
    """The size of a case's mesh, from its key `mesh`; zero where that is invalid.

    A mesh file, its path relative to `folder`, is judged by its length, and taken to be in 3D.
    """
    if not isinstance(mesh, Mapping):
        return Size(0.0, 3)
    refine *= mesh["refine"] if isinstance(mesh.get("refine"), int) else 1
    if "file" in mesh:
        file = folder / str(mesh["file"])
        length = file.stat().st_size if file.is_file() else 0
        return Size(refine**3 * length / _BYTES.get(file.suffix.lower(), _BYTES_ELSE), 3)
    bricks: object = mesh.get("bricks")
    parts = bricks if isinstance(bricks, Sequence) else ()
    blocks = [brick.get("block") for brick in parts if isinstance(brick, Mapping)]
    bodies = map(_body, [*mesh.values(), *blocks])
    return of_bodies([of_body(*body, refine) for body in bodies if body])


def _body(section: Any) -> tuple[str, list[int]] | None:
    """Cells and divisions of a recipe's section, where it has them."""
    if not isinstance(section, Mapping):
        return None
    cells, divisions = str(section.get("cells")), section.get("divisions")
    divisions = divisions if isinstance(divisions, list) else [divisions]
    whole = all(isinstance(n, int) and 0 < n < _MANY for n in divisions)
    kind = BY_NAME.get(cells)
    valid = kind and kind.dim > 1 and len(divisions) in (1, kind.dim)
    return (cells, divisions) if valid and whole else None


def check_memory(points: int, dim: int, where: object, free: float | None = None) -> None:
    """Raise MachineError where a solve on a mesh of `points` cannot fit; log where it may not.

    `where` is the file to name, `free` the memory there is (default: `available`).
    """
    need, free = Size(points, dim).memory, available() if free is None else free
    if need.least > free:
        raise MachineError(
            where,
            "memory",
            f"{points * dim} unknowns",
            f"needs at least {_gigabytes(need.least)}, {_gigabytes(free)} are free; what helps: a "
            "coarser mesh, fewer solves at a time (CORES=1), a larger machine; "
            "to try all the same: --no-memory-check",
        )
    if need.usual > free:
        sizes = _gigabytes(need.usual), _gigabytes(free)
        _LOG.log(OUTCOME, "memory may run out: about %s of %s free", *sizes)


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.2g} GB"
