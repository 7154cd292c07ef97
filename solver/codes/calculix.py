"""CalculiX: the input deck of a case, and what its result file holds.

Contact is CalculiX's surface-to-surface penalty (`*CONTACT PAIR, TYPE=SURFACE TO SURFACE`; Dhondt,
The Finite Element Method for Three-Dimensional Thermomechanical Applications, Wiley 2004, and the
manual of version 2.20), without friction, its pressure linear in the overlap. A plane case is one
layer of cells.
"""

import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..mechanics.fem.faces import FaceBlock
from ..mesh.catalogue import BY_NAME, CellType
from ..mesh.files.abaqus import FACES
from ..system.errors import InputError, SolveError
from ..system.process import cores_for, run_apart
from .deck import Deck, UnsupportedError
from .files.read import read_result_files
from .foreign import ForeignResult

PROGRAM = "ccx"
# Cells whose nodes have the same order here and there.
ELEMENTS = {
    "TETRA4": "C3D4", "TETRA10": "C3D10", "PENTA6": "C3D6", "PENTA15": "C3D15",
    "HEXA8": "C3D8", "HEXA20": "C3D20",
}  # fmt: skip
# Pressure by overlap, over Young's modulus: the manual advises 5 to 50 for lengths in millimetres.
STIFFNESS = 50.0
_NAME = "deck"


class CalculiX:
    """Write, run and read; see `solver.codes.run`."""

    name = "calculix"
    layer = True
    install = "Debian has it as calculix-ccx"
    gave_up = r"\*ERROR: (?:increment size smaller than minimum|too many \w+)[^\n]*"

    def __init__(self, stiffness: float = STIFFNESS):
        self.stiffness = stiffness

    @property
    def settings(self) -> Mapping[str, str]:
        """Its main settings, to be shown."""
        return {
            "contact": "SURFACE TO SURFACE, frictionless",
            "pressure-overclosure": f"LINEAR, {self.stiffness:g} E",
            "elements": "C3D4, C3D10, C3D6, C3D15, C3D8, C3D20; plane cases as one layer",
        }

    def version(self) -> str:
        """The program's version; empty if it is not installed."""
        if shutil.which(PROGRAM) is None:
            return ""
        # It leaves files wherever it runs.
        with TemporaryDirectory() as folder:
            output = run_apart([PROGRAM, "-v"], cores_for(1), 10.0, folder=Path(folder)).output
        found = re.search(r"Version (\S+)", output)
        return found[1] if found else "unknown"

    def write(self, deck: Deck, folder: Path) -> None:
        """Write the input into `folder`; UnsupportedError for what CalculiX lacks."""
        lines = list(deck_lines(deck, self.stiffness))
        (folder / f"{_NAME}.inp").write_text("\n".join(lines) + "\n", encoding="ascii")

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002 -- the same for all codes
        """The command to run in `folder`."""
        return [PROGRAM, "-i", _NAME]

    def read(self, deck: Deck, folder: Path) -> ForeignResult:
        """The fields at the end; SolveError without a result."""
        file = folder / f"{_NAME}.frd"
        try:
            found = read_result_files([file], code=self.name)
        except InputError as error:
            raise SolveError(f"its result file: {error}") from None
        for quantity in ("displacement", "stress", "pressure"):
            if getattr(found, quantity) is None:
                raise SolveError(f"{file.name}: it holds no {quantity}")
        return replace(found, step=deck.case.factors[-1])


def deck_lines(deck: Deck, stiffness: float = STIFFNESS) -> Iterator[str]:
    """The lines of the input; UnsupportedError for cells and gaps that CalculiX lacks."""
    _refuse(deck)
    yield "*NODE, NSET=NALL"
    for number, place in enumerate(deck.points.tolist(), start=1):
        yield f"{number}, " + ", ".join(f"{x:.13e}" for x in place)
    yield from _elements(deck)
    for pair in deck.pairs:
        for group, faces in ((pair.zone.slave, pair.slave), (pair.zone.master, pair.master)):
            yield f"*SURFACE, NAME={group}, TYPE=ELEMENT"
            yield from (f"{element}, S{face}" for element, face in _faces(deck, faces))
    yield from _contact(deck, stiffness)
    yield from ("*STEP, INC=1000", "*STATIC", "1., 1.")
    yield "*BOUNDARY"
    for node, axis, value in deck.fixed():
        yield f"{node + 1}, {axis + 1}, {axis + 1}, {value:.13e}"
    if deck.pressures:
        yield "*DLOAD"
        for faces, value in deck.pressures:
            yield from (f"{element}, P{face}, {value!r}" for element, face in _faces(deck, faces))
    if deck.forces.any():
        yield "*CLOAD"
        for node, axis, value in deck.loaded():
            yield f"{node + 1}, {axis + 1}, {value:.13e}"
    yield from ("*NODE FILE", "U", "*EL FILE", "S", "*CONTACT FILE", "CDIS, CSTR", "*END STEP")


def _refuse(deck: Deck) -> None:
    for name in deck.cells:
        if name not in ELEMENTS:
            plane = " (of one layer over the plane cells)" if deck.plane else ""
            raise UnsupportedError(f"{name}: CalculiX has no such element{plane}")
    for pair in deck.pairs:
        if pair.zone.clearance is None and pair.zone.interference:
            raise UnsupportedError("interference beside the gap as meshed: not in CalculiX")


def _elements(deck: Deck) -> Iterator[str]:
    """Elements by type and material: number and nodes; a line holds 16 entries at most."""
    for name, cells in deck.cells.items():
        for material in np.unique(deck.material[name]).tolist():
            mine = np.flatnonzero(deck.material[name] == material)
            yield f"*ELEMENT, TYPE={ELEMENTS[name]}, ELSET=PART{material}"
            rows = np.column_stack([deck.starts[name] + mine, cells[mine] + 1])
            for row in rows.tolist():
                entries = list(map(str, row))
                for i in range(0, len(entries), 15):
                    more = "," if i + 15 < len(entries) else ""
                    yield ", ".join(entries[i : i + 15]) + more
    for material in np.unique(np.concatenate(list(deck.material.values()))).tolist():
        of = deck.materials[material]
        yield from (f"*MATERIAL, NAME=SOLID{material}", "*ELASTIC", f"{of.young!r}, {of.poisson!r}")
        yield f"*SOLID SECTION, ELSET=PART{material}, MATERIAL=SOLID{material}"


def _faces(deck: Deck, blocks: Sequence[FaceBlock]) -> Iterator[tuple[int, int]]:
    """Element and face number of faces."""
    for block in blocks:
        kind = block.owner_type
        numbers = np.array([face_number(kind, i) for i in range(len(kind.faces))])
        first = deck.starts[kind.name]
        yield from zip((first + block.owner).tolist(), numbers[block.local].tolist(), strict=True)


def face_number(cell: CellType, local: int) -> int:
    """CalculiX's number of a cell's face, from 1.

    >>> from solver.mesh.catalogue import BY_NAME
    >>> [face_number(BY_NAME["TETRA4"], i) for i in range(4)]
    [1, 2, 3, 4]
    """
    face = cell.faces[local]
    corners = set(face.nodes[: BY_NAME[face.type].n_vertices])
    labels = [{int(c) - 1 for c in text} for text in FACES[cell.name.rstrip("0123456789")]]
    return next(i for i, label in enumerate(labels, start=1) if label <= corners)


def _contact(deck: Deck, stiffness: float) -> Iterator[str]:
    if deck.pairs:
        yield "*SURFACE INTERACTION, NAME=SMOOTH"
        yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
        yield f"{stiffness * deck.softest!r}"
    for zone in (pair.zone for pair in deck.pairs):
        yield "*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=SURFACE TO SURFACE"
        yield f"{zone.slave}, {zone.master}"
        if isinstance(zone.clearance, float):
            value = zone.clearance - zone.interference
            yield f"*CLEARANCE, SLAVE={zone.slave}, MASTER={zone.master}, VALUE={value!r}"
