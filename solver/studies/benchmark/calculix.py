"""The same problem for CalculiX: the input deck of a case on its mesh, and what came of it.

Contact is CalculiX's surface-to-surface penalty (`*CONTACT PAIR, TYPE=SURFACE TO SURFACE`; Dhondt,
The Finite Element Method for Three-Dimensional Thermomechanical Applications, Wiley 2004, and the
manual of version 2.20), without friction, its pressure linear in the overlap.
"""

import re
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import floor, log10
from pathlib import Path
from tempfile import TemporaryDirectory

import meshio
import numpy as np

from ...case.model import Case, Zone
from ...mechanics.fem.faces import boundary_faces, volume_cells
from ...mesh.catalogue import BY_MESHIO, BY_NAME, CellType
from ...mesh.files.abaqus import FACES
from ...system.errors import SolveError
from ...system.process import Ended, cores_for, run_apart

PROGRAM = "ccx"
# Cells whose nodes have the same order here and there.
ELEMENTS = {"TETRA4": "C3D4", "TETRA10": "C3D10", "HEXA8": "C3D8", "HEXA20": "C3D20"}
# Pressure by overlap, over Young's modulus: the manual advises 5 to 50 for lengths in millimetres.
_STIFFNESS = 50.0
_AXES = {"x": 1, "y": 2, "z": 3}
_NAME = "deck"


@dataclass(frozen=True)
class Contact:
    """What CalculiX found: its process, and the pressures (n,) at the contact's points."""

    process: Ended
    pressure: np.ndarray


def version() -> str:
    """The program's version; empty where it is not installed."""
    if shutil.which(PROGRAM) is None:
        return ""
    # It leaves files wherever it runs.
    with TemporaryDirectory() as folder:
        output = run_apart([PROGRAM, "-v"], cores_for(1), 10.0, folder=Path(folder)).output
    found = re.search(r"Version (\S+)", output)
    return found[1] if found else "unknown"


def solve(
    case: Case, mesh: meshio.Mesh, folder: Path, cores: Sequence[int], limit: float
) -> Contact:
    """Write the deck into `folder`, run CalculiX there, read the pressure.

    Raises SolveError where it comes to no end or gives none.
    """
    deck = folder / f"{_NAME}.inp"
    with deck.open("w", encoding="ascii") as file:
        file.writelines(f"{line}\n" for line in deck_lines(case, mesh))
    process = run_apart([PROGRAM, "-i", _NAME], cores, limit, folder=folder)
    if process.status != 0:
        raise SolveError(f"CalculiX: {process.reason}")
    return Contact(process, read_pressure(deck.with_suffix(".dat")))


def deck_lines(case: Case, mesh: meshio.Mesh) -> Iterator[str]:
    """The lines of the deck of a 3D case with pressures, supports along axes, one contact.

    Raises KeyError for cells that CalculiX has not, or orders otherwise.
    """
    starts = _starts(mesh)
    yield "*NODE, NSET=NALL"
    for number, place in enumerate(mesh.points, start=1):
        yield f"{number}, " + ", ".join(f"{x:.13e}" for x in place)
    for name, cells in volume_cells(mesh).items():
        yield f"*ELEMENT, TYPE={ELEMENTS[name]}, ELSET=EALL"
        yield from _elements(starts[name], cells)
    [zone] = case.zones
    for group in (zone.slave, zone.master):
        yield f"*SURFACE, NAME={group}, TYPE=ELEMENT"
        yield from (f"{element}, S{face}" for element, face in _faces(mesh, group, starts))
    yield from _material(case)
    yield from _contact(case, zone)
    yield from ("*STEP", "*STATIC", "1., 1.")
    yield from _supports(case, mesh)
    yield "*DLOAD"
    for load in case.loads:
        for element, face in _faces(mesh, load.group, starts):
            yield f"{element}, P{face}, {load.value!r}"
    yield f"*CONTACT PRINT, SLAVE={zone.slave}, MASTER={zone.master}"
    yield from ("CSTR", "*END STEP")


def _starts(mesh: meshio.Mesh) -> dict[str, int]:
    """The number of the first element of each type."""
    starts, number = {}, 1
    for name, cells in volume_cells(mesh).items():
        starts[name] = number
        number += len(cells)
    return starts


def _elements(start: int, cells: np.ndarray) -> Iterator[str]:
    """Element number and nodes; a line holds 16 entries at most."""
    for number, nodes in enumerate((cells + 1).tolist(), start=start):
        entries = list(map(str, [number, *nodes]))
        for i in range(0, len(entries), 15):
            more = "," if i + 15 < len(entries) else ""
            yield ", ".join(entries[i : i + 15]) + more


def _faces(mesh: meshio.Mesh, group: str, starts: dict[str, int]) -> Iterator[tuple[int, int]]:
    """Element and face number of every face of a group."""
    for block in boundary_faces(mesh, group):
        numbers = np.array(
            [_label(block.owner_type, i) for i in range(len(block.owner_type.faces))]
        )
        first = starts[block.owner_type.name]
        yield from zip((first + block.owner).tolist(), numbers[block.local].tolist(), strict=True)


def _label(cell: CellType, local: int) -> int:
    """CalculiX's number of a cell's face, from 1."""
    face = cell.faces[local]
    corners = set(face.nodes[: BY_NAME[face.type].n_vertices])
    labels = [{int(c) - 1 for c in text} for text in FACES[cell.name.rstrip("0123456789")]]
    return next(i for i, label in enumerate(labels, start=1) if label <= corners)


def _material(case: Case) -> Iterator[str]:
    material = case.materials["all"]
    yield from ("*MATERIAL, NAME=SOLID", "*ELASTIC", f"{material.young!r}, {material.poisson!r}")
    yield "*SOLID SECTION, ELSET=EALL, MATERIAL=SOLID"


def _contact(case: Case, zone: Zone) -> Iterator[str]:
    yield "*SURFACE INTERACTION, NAME=SMOOTH"
    yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
    yield f"{_STIFFNESS * case.materials['all'].young!r}"
    yield "*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=SURFACE TO SURFACE"
    yield f"{zone.slave}, {zone.master}"


def _supports(case: Case, mesh: meshio.Mesh) -> Iterator[str]:
    yield "*BOUNDARY"
    for support in case.supports:
        for node in _nodes(mesh, support.group):
            for axis in support.fix:
                yield f"{node}, {_AXES[axis]}"


def _nodes(mesh: meshio.Mesh, group: str) -> list[int]:
    """The numbers, from 1, of the nodes of a group of faces."""
    found = [
        block.data[np.asarray(members, dtype=int)].ravel()
        for block, members in zip(mesh.cells, mesh.cell_sets[group], strict=True)
        if BY_MESHIO[block.type].dim == mesh.points.shape[1] - 1 and len(members)
    ]
    return (np.unique(np.concatenate(found)) + 1).tolist()


def resolution(pressure: float) -> float:
    """The relative error of a pressure that its output, of seven digits, leaves in the dark."""
    return 5e-7 * 10 ** floor(log10(pressure)) / pressure


def read_pressure(path: Path) -> np.ndarray:
    """The contact pressures (n,) at the end of the last step; SolveError where there are none."""
    text = path.read_text(encoding="ascii", errors="replace") if path.is_file() else ""
    _, _, table = text.rpartition("contact stress")
    rows = [line.split() for line in table.splitlines()[1:]]
    values = [float(row[-3]) for row in rows if len(row) > 3]
    if not values:
        raise SolveError("CalculiX: no contact pressure in its output")
    return np.array(values)
