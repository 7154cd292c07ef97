"""How large a solve will be, told from its case before there is a mesh: unknowns and seconds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Nodes a piece (of `divisions`), in large meshes of pieces of equal size. Prisms are two a piece,
# pyramids six about a point; TRIA and TETRA without a grid are fewer.
_NODES = {
    "TRIA3": 1.1,
    "TRIA6": 4.5,
    "QUAD4": 1.0,
    "QUAD8": 3.0,
    "QUAD9": 4.0,
    "TETRA4": 1.1,
    "TETRA10": 8.0,
    "HEXA8": 1.0,
    "HEXA20": 4.0,
    "HEXA27": 8.0,
    "PENTA6": 1.0,
    "PENTA15": 5.0,
    "PYRA5": 2.0,
    "PYRA13": 13.0,
}
_PLANE = ("TRIA", "QUAD")
# Bytes a point of a mesh file, cells included: VTU files are packed.
_BYTES = {".vtu": 20}
_BYTES_ELSE = 80
# Seconds a solve: factor and power of the unknowns, by dimension; measured on one core.
_COST = {2: (2e-5, 1.0), 3: (4e-6, 1.3)}


@dataclass(frozen=True)
class Size:
    """About how many points a mesh will have, and its dimension."""

    points: float
    dim: int

    @property
    def unknowns(self) -> float:
        """Components of displacement, those that are imposed included."""
        return self.points * self.dim

    @property
    def seconds(self) -> float:
        """About how long one linear solve and what surrounds it take."""
        factor, power = _COST[self.dim]
        return factor * self.unknowns**power


def of_body(cells: str, divisions: Sequence[int], refine: int = 1) -> Size:
    """The size of a body of `cells` with so many pieces an edge, each multiplied by `refine`."""
    dim = 2 if cells.startswith(_PLANE) else 3
    # A single number stands for all directions.
    along = list(divisions) if len(divisions) == dim else [divisions[0]] * dim
    return Size(_NODES.get(cells, 2.0) * math.prod(refine * n for n in along), dim)


def of_mesh(mesh: object, folder: Path, refine: int = 1) -> Size:
    """The size of a case's mesh, from the content of its key `mesh`; nothing where that is broken.

    A mesh file, its path relative to `folder`, is told by its length, and taken to be in space.
    """
    if not isinstance(mesh, Mapping):
        return Size(0.0, 3)
    if "file" in mesh:
        file = folder / str(mesh["file"])
        length = file.stat().st_size if file.is_file() else 0
        return Size(length / _BYTES.get(file.suffix.lower(), _BYTES_ELSE), 3)
    refine *= mesh["refine"] if isinstance(mesh.get("refine"), int) else 1
    bodies = [of_body(*body, refine) for body in map(_body, mesh.values()) if body]
    return Size(sum(b.points for b in bodies), min((b.dim for b in bodies), default=3))


def _body(section: Any) -> tuple[str, list[int]] | None:
    """Cells and divisions of a recipe's section, where it has them."""
    if not isinstance(section, Mapping) or not isinstance(section.get("cells"), str):
        return None
    divisions = section.get("divisions")
    divisions = divisions if isinstance(divisions, list) else [divisions]
    whole = divisions and all(isinstance(n, int) and n > 0 for n in divisions)
    return (section["cells"], divisions) if whole else None
