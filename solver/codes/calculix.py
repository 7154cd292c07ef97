"""CalculiX: the input deck of a case, and what its result file holds.

Contact is CalculiX's surface-to-surface penalty (`*CONTACT PAIR, TYPE=SURFACE TO SURFACE`; Dhondt,
The Finite Element Method for Three-Dimensional Thermomechanical Applications, Wiley 2004, and the
manual of version 2.20), its pressure linear in the overlap, and its friction in the slip, up to μp.
A plane case is one layer of cells.
"""

import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

import meshio
import numpy as np

from ..lac.cells.catalogue import BY_NAME
from ..lac.cells.faces import FaceBlock
from ..lac.errors import SolveError
from ..mesh.files.abaqus import data_lines, face_number
from ..system.errors import InputError
from ..system.process import cores_for, run_in_subprocess
from .deck import Deck, UnsupportedError, face_size
from .files.read import read_result_files
from .foreign import Field, ForeignResult
from .shifted import with_layers

PROGRAM = "ccx"
# Abaqus's cells but the pyramids, plane ones as rings.
_CELLS = [k for k in BY_NAME.values() if k.abaqus and k.shape != "PYRA"]
ELEMENTS = {k.name: k.abaqus for k in _CELLS if k.dim == 3}
RINGS = {k.name: f"CAX{k.n_nodes}" for k in _CELLS if k.dim == 2}
# Pressure by overlap, over Young's modulus by the size of a slave face: results do not depend on
# the unit of length. On curved surfaces the overlap of facets is pressure, and a softer contact is
# the better one: the manual's advice of 5 to 50 E for millimetres.
STIFFNESS, ON_CURVES = 2.5e4, 2e2
# Of bodies that move far. With a stiffer one nodes under the end of the master bear up to five
# times the pressure, and from 500 on the steps do not converge.
MOVING = 1.0
# Faces that end on the axis carry no contact: a bore of this radius, over the model's extent.
_BORE = 1e-6
_CORRECTION = 1e-5
# By default a correction of 1 % of the largest displacement ends the iterations.
_CONTROLS = ("*CONTROLS, PARAMETERS=FIELD", f"0.005, {_CORRECTION:g}")
# Of a step on which bodies move far, the largest part that is solved at once, and the most parts.
_PART, _MOST = 0.25, 1000
_NAME = "deck"
_Series: TypeAlias = tuple[float, ...]


class CalculiX:
    """Write, run and read; see `solver.codes.run`."""

    name = "calculix"
    layer = True
    follows = True
    install = "Debian has it as calculix-ccx"
    gave_up = r"\*ERROR: (?:increment size smaller than minimum|too many \w+)[^\n]*"

    def __init__(self, stiffness: float = STIFFNESS):
        self.stiffness = stiffness

    @property
    def settings(self) -> Mapping[str, str]:
        """Its main settings, to be shown."""
        return {
            "contact": "SURFACE TO SURFACE",
            "pressure-overclosure": f"LINEAR, {self.stiffness:g} E / face size, "
            f"{min(self.stiffness, ON_CURVES):g} on curved surfaces, "
            f"{min(self.stiffness, MOVING):g} of bodies that move far (NLGEOM)",
            "curved faces": "gaps as meshed: the overlap of facets is pressure",
            "elements": f"{', '.join([*ELEMENTS.values(), *RINGS.values()])}; "
            "plane cases as one layer",
        }

    def version(self) -> str:
        """The program's version; empty if it is not installed."""
        if shutil.which(PROGRAM) is None:
            return ""
        # It leaves files wherever it runs.
        with TemporaryDirectory() as folder:
            output = run_in_subprocess(
                [PROGRAM, "-v"], cores_for(1), 10.0, folder=Path(folder)
            ).output
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
        found = replace(self._on_bodies(found, deck), step=deck.case.factors[-1])
        printed = folder / f"{_NAME}.dat"
        if printed.is_file():
            forces = printed_forces(deck, printed.read_text(errors="replace"))
            found = replace(found, forces=forces)
        # It writes zeros for gaps of points that are not in contact.
        if found.gap is not None and found.pressure is not None:
            gap = np.where(found.pressure.values > 0, found.gap.values, np.nan)
            known = bool(np.isfinite(gap).any())
            found = replace(found, gap=replace(found.gap, values=gap) if known else None)
        return found

    @staticmethod
    def _on_bodies(found: ForeignResult, deck: Deck) -> ForeignResult:
        """The fields at the nodes of the deck: the node below a layer gets its pressure."""
        count, below = len(deck.points), with_layers(deck)[1]
        if not len(below):
            return found

        def on_bodies(field: Field | None, layer: bool = False) -> Field | None:
            if field is None or field.nodes is None:
                return None
            values = np.zeros((count + len(below), *field.values.shape[1:]))
            kept = field.nodes < len(values)
            values[field.nodes[kept]] = field.values[kept]
            if layer:
                np.add.at(values, below, values[count:])
            return Field(places=deck.points, values=values[:count], nodes=np.arange(count))

        cells = [(BY_NAME[name].meshio, nodes) for name, nodes in deck.cells.items()]
        return replace(
            found,
            mesh=meshio.Mesh(deck.points, cells),
            displacement=on_bodies(found.displacement),
            stress=on_bodies(found.stress),
            pressure=on_bodies(found.pressure, layer=True),
            gap=on_bodies(found.gap, layer=True),
        )


def deck_lines(deck: Deck, stiffness: float = STIFFNESS) -> Iterator[str]:
    """The lines of the input; UnsupportedError for cells and gaps that CalculiX lacks."""
    _refuse(deck)
    deck, below = with_layers(deck)
    yield "*NODE, NSET=NALL"
    for number, place in enumerate(_places(deck).tolist(), start=1):
        yield f"{number}, " + ", ".join(f"{x:.13e}" for x in place)
    yield from _elements(deck)
    for pair in deck.pairs:
        for group, faces in ((pair.zone.slave, pair.slave), (pair.zone.master, pair.master)):
            yield f"*SURFACE, NAME={group}, TYPE=ELEMENT"
            yield from (f"{element}, S{face}" for element, face in _faces(deck, faces))
    yield from _equal(deck, below)
    yield from _oblique(deck)
    yield from _contact(deck, stiffness)
    if deck.path:
        yield from _amplitude_lines(deck)
    if deck.start.any():
        yield from _closing(deck)
    yield from _path(deck) if deck.path else _step(deck)
    rings = ", OUTPUT=2D" if deck.case.axisymmetric else ""
    at = ", TIME POINTS=POSITIONS" if deck.path else ""
    yield from (
        f"*NODE FILE{rings}{at}",
        "U",
        f"*EL FILE{at}",
        "S",
        f"*CONTACT FILE{at}",
        "CDIS, CSTR",
    )
    # Forces on sections of rings are of a small angle of them.
    for zone in (pair.zone for pair in deck.pairs if not deck.case.axisymmetric):
        yield from (f"*CONTACT PRINT, SLAVE={zone.slave}, MASTER={zone.master}", "CF")
    yield "*END STEP"


def _step(deck: Deck) -> Iterator[str]:
    """The step of a case up to what it prints."""
    yield from ("*STEP, INC=1000", "*STATIC", "1., 1.", *_CONTROLS, "*BOUNDARY, OP=NEW")
    yield from _boundary(deck, 1.0)
    if deck.pressures:
        yield "*DLOAD"
        for faces, value in deck.pressures:
            yield from (f"{element}, P{face}, {value!r}" for element, face in _faces(deck, faces))
    if deck.forces.any():
        yield "*CLOAD"
        for node, axis, value in deck.loaded():
            yield f"{node + 1}, {axis + 1}, {value:.13e}"


def _path(deck: Deck) -> Iterator[str]:
    """One step of bodies that move far, a unit of its time for each step of the case.

    Another step would begin without the contact of the one before.
    """
    last = len(deck.path)
    yield from (f"*STEP, NLGEOM, INC={_MOST * last}", "*STATIC", f"{_PART:g}, {last}., , {_PART:g}")
    yield from (*_CONTROLS, "*BOUNDARY, OP=NEW")
    held, forces, names = _by_series(deck, "held"), _by_series(deck, "forces"), _amplitudes(deck)
    still = held.pop(last * (0.0,), [])
    yield from (f"{node}, {axis}, {axis}, 0." for node, axis in still)
    for series, where in held.items():
        yield f"*BOUNDARY, AMPLITUDE={names[series]}"
        yield from (f"{node}, {axis}, {axis}, 1." for node, axis in where)
    forces.pop(last * (0.0,), None)
    for series, where in forces.items():
        yield f"*CLOAD, AMPLITUDE={names[series]}"
        yield from (f"{node}, {axis}, 1." for node, axis in where)
    for (faces, _), series in zip(deck.pressures, _pressures(deck), strict=True):
        if not any(series):
            continue
        yield f"*DLOAD, AMPLITUDE={names[series]}"
        yield from (f"{element}, P{face}, 1." for element, face in _faces(deck, faces))


def _by_series(deck: Deck, name: str) -> dict[_Series, list[tuple[int, int]]]:
    """Node and axis, from 1, by the values of a field in the steps; not where it has none."""
    found: dict[_Series, list[tuple[int, int]]] = {}
    values = np.stack([getattr(step, name) for step in deck.path], axis=-1)
    for node, axis in np.argwhere(~np.isnan(values).any(axis=-1)).tolist():
        series = tuple(values[node, axis].tolist())
        found.setdefault(series, []).append((node + 1, axis + 1))
    return found


def _pressures(deck: Deck) -> list[_Series]:
    return list(zip(*(step.pressures for step in deck.path), strict=True))


def _amplitudes(deck: Deck) -> dict[_Series, str]:
    """The names of all series of values, one for each step, that displacements and loads have."""
    found = [*_by_series(deck, "held"), *_by_series(deck, "forces"), *_pressures(deck)]
    acting = dict.fromkeys(filter(any, found))
    return {series: f"GIVEN{number}" for number, series in enumerate(acting)}


def _amplitude_lines(deck: Deck) -> Iterator[str]:
    yield from ("*TIME POINTS, NAME=POSITIONS", *(f"{n}.," for n in range(1, len(deck.path) + 1)))
    for series, name in _amplitudes(deck).items():
        yield f"*AMPLITUDE, NAME={name}"
        yield from (f"{time}., {value:.13e}" for time, value in enumerate((0.0, *series)))


def printed_forces(deck: Deck, text: str) -> dict[str, np.ndarray]:
    """The contact forces on slaves (dim,) by zone, the last ones that CalculiX printed.

    Those of a plane case are per thickness of its layer of cells.
    """
    found = {}
    thickness = float(np.ptp(deck.points[:, 2])) if deck.plane else 1.0
    for zone in (pair.zone for pair in deck.pairs):
        names = rf"slave set {re.escape(zone.slave)}, master set {re.escape(zone.master)} "
        numbers = r"\s+([-+.\dE]+)" * 3
        pattern = rf"{names}.*?total surface force.*?{numbers}"
        if values := re.findall(pattern, text, re.IGNORECASE | re.DOTALL):
            found[zone.name] = np.array(values[-1], dtype=float) / thickness
    return found


def _places(deck: Deck) -> np.ndarray:
    """The nodes (n, dim), those on the axis of rings beside it."""
    points = deck.points.copy()
    if deck.case.axisymmetric:
        points[:, 0] = np.maximum(points[:, 0], _BORE * np.ptp(points, axis=0).max())
    return points


def _closing(deck: Deck) -> Iterator[str]:
    """A step that moves bodies which contact alone holds until they touch; the next frees them."""
    yield from ("*STEP, INC=1000", "*STATIC", "1., 1.", "*BOUNDARY")
    for node, axis in zip(*map(np.ndarray.tolist, np.nonzero(deck.start)), strict=True):
        yield f"{node + 1}, {axis + 1}, {axis + 1}, {deck.start[node, axis]:.13e}"
    yield from (*_boundary(deck, 0.0), "*END STEP")


def _boundary(deck: Deck, factor: float) -> Iterator[str]:
    """Imposed displacements, also of the auxiliary nodes of oblique supports."""
    for node, axis, value in deck.fixed():
        yield f"{node + 1}, {axis + 1}, {axis + 1}, {factor * value:.13e}"
    for node, of in enumerate(deck.oblique, start=len(deck.points) + 1):
        yield f"{node}, 1, 1, {factor * of.value:.13e}"


def _equal(deck: Deck, below: np.ndarray) -> Iterator[str]:
    """The nodes of the layers move as those below."""
    first = len(deck.points) - len(below) + 1
    for node, other in enumerate((below + 1).tolist(), start=first):
        for axis in range(1, 1 + deck.points.shape[1]):
            yield from ("*EQUATION", "2", f"{node}, {axis}, 1., {other}, {axis}, -1.")


def _oblique(deck: Deck) -> Iterator[str]:
    """Supports across the axes: equations, each with an auxiliary node whose value is given."""
    first = len(deck.points) + 1
    for node, of in enumerate(deck.oblique, start=first):
        place = ", ".join(f"{x:.13e}" for x in deck.points[of.node].tolist())
        yield from ("*NODE", f"{node}, {place}", "*EQUATION", f"{len(of.terms) + 1}")
        terms = [(of.node + 1, axis + 1, factor) for axis, factor in of.terms]
        for number, axis, factor in [*terms, (node, 1, -1.0)]:
            yield f"{number}, {axis}, {factor:.13e}"


def _elements_of(deck: Deck) -> dict[str, str]:
    return RINGS if deck.case.axisymmetric else ELEMENTS


def _refuse(deck: Deck) -> None:
    for name in deck.cells:
        if name not in _elements_of(deck):
            plane = " (of one layer over the plane cells)" if deck.plane else ""
            raise UnsupportedError(f"{name}: CalculiX has no such element{plane}")


def _elements(deck: Deck) -> Iterator[str]:
    """Elements by type and material: number and nodes."""
    for name, cells in deck.cells.items():
        for material in np.unique(deck.material[name]).tolist():
            mine = np.flatnonzero(deck.material[name] == material)
            yield f"*ELEMENT, TYPE={_elements_of(deck)[name]}, ELSET=PART{material}"
            rows = np.column_stack([deck.starts[name] + mine, cells[mine] + 1])
            for row in rows.tolist():
                yield from data_lines(row)
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


def _contact(deck: Deck, stiffness: float) -> Iterator[str]:
    stiffness = stiffness if deck.flat else min(stiffness, ON_CURVES)
    stiffness = min(stiffness, MOVING) if deck.path else stiffness
    slope = stiffness * deck.softest / face_size(deck) if deck.pairs else 0.0
    names: dict[float, str] = {}
    for friction in {pair.zone.friction: None for pair in deck.pairs}:
        names[friction] = f"FRICTION{len(names)}" if friction else "SMOOTH"
        yield f"*SURFACE INTERACTION, NAME={names[friction]}"
        yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
        yield f"{slope!r}"
        if friction:  # the slope of the traction over the slip while it sticks
            yield "*FRICTION"
            yield f"{friction!r}, {slope!r}"
    for zone in (pair.zone for pair in deck.pairs):
        yield f"*CONTACT PAIR, INTERACTION={names[zone.friction]}, TYPE=SURFACE TO SURFACE"
        yield f"{zone.slave}, {zone.master}"
        if isinstance(zone.clearance, float):
            value = zone.clearance - zone.interference
            yield f"*CLEARANCE, SLAVE={zone.slave}, MASTER={zone.master}, VALUE={value!r}"
