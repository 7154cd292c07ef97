"""Ladders of the numerical inf-sup test: β_h on finer and finer meshes, for the record.

    levels: {plane: [4, 8, 16, 32], space: [2, 4, 6, 8]}  # slave divisions of the interface's edge
    quick: {plane: [8, 16], space: [4, 8]}                # of the quick version, which takes
                                                          # the last `coarser`, clamped
    coarser: {plane: [1, 4], space: [1, 2]}               # slave over master divisions
    cells:
      - {cells: QUAD4}
      - {cells: HEXA8, hexahedra: hexahedra}              # how they are cut, where that is chosen
      - {cells: PENTA6, contact: QUAD4}                   # the faces on the interface, likewise
      - {cells: QUAD9, cut: false}                        # of those that need no cut
      - {cells: HEXA20, levels: [2, 4, 6, 8]}             # its own, except in the quick version

Two unit blocks of the same cells lie on each other, the lower one slave. `clamped`, the sides
opposite to the interface are held all over; `floating`, the upper block is free to move up and
down. Each ladder is run with the cut and, where there is one, without.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from ...case.typed import Section, read_as
from ...case.yaml import read_mapping
from ...mesh.catalogue import BY_NAME
from ..fits import fit_power
from ..keys import Cell

LEVEL = 0.4
"""β_h falls with the size of the faces to this power at most."""
ZERO = 1e-6
"""β_h below is zero up to round-off."""

Level = Annotated[int, Meta(ge=1, description="a whole number, 1 or more")]
Levels = Annotated[tuple[Level, ...], Meta(min_length=1)]


@dataclass
class InfSupLadder:
    """One family of meshes; the lists hold a value a level, coarsest first.

    `coarser`: slave divisions over master divisions. `cut`: with the cut, or as meshed where the
    cells need none; `contact` and `hexahedra` are empty where there is no choice.
    """

    cells: str
    cut: bool
    clamped: bool
    coarser: int
    contact: str = ""
    hexahedra: str = ""
    needs_cut: bool = True
    levels: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    macro_elements: list[int] = field(default_factory=list)
    unknowns: list[int] = field(default_factory=list)
    reason: str = ""

    @property
    def name(self) -> str:
        """In words."""
        held = "clamped" if self.clamped else "floating"
        return f"{self.kind}, {held}, master {self.coarser} times as coarse"

    @property
    def kind(self) -> str:
        """Its cells, their faces in contact and their cut, in words."""
        face = f" on {self.contact}" if self.contact else ""
        cut = f", {self.hexahedra}" if self.hexahedra and self.cut else ""
        return f"{self.cells}{face}{cut if self.cut else ', uncut'}"

    @property
    def way(self) -> str:
        """The kind of cut in a word."""
        if not self.cut:
            return "uncut"
        return self.hexahedra or ("yes" if self.needs_cut else "not needed")

    @property
    def verdict(self) -> str:
        """The outcome of the levels in words."""
        if self.reason:
            return self.reason
        if self.constants[-1] < ZERO:
            return "zero"
        return "levels off" if self.levels_off else "falls"

    @property
    def dim(self) -> int:
        """Of the mesh."""
        return BY_NAME[self.cells].dim

    @property
    def order(self) -> float:
        """The power of the face size with which β_h falls over the last two levels.

        Not a number where it is zero: some multiplier acts on no displacement at all.
        """
        levels, constants = self.levels[: len(self.constants)][-2:], self.constants[-2:]
        fit = fit_power(levels, constants) if min(constants, default=0.0) >= ZERO else None
        return -fit.value if fit else math.nan

    @property
    def levels_off(self) -> bool:
        """Whether β_h stays above zero, by these levels."""
        return not self.reason and bool(self.order <= LEVEL)


class _Levels(Section, frozen=True):
    plane: Levels
    space: Levels


class _Ladder(Section, frozen=True):
    cells: Cell
    contact: Literal["", "TRIA3", "TRIA6", "QUAD4", "QUAD8"] = ""
    hexahedra: Literal["", "pyramids", "hexahedra"] = ""
    cut: bool = True
    levels: Levels = ()


class InfSupFile(Section, frozen=True):
    """The keys of `infsup.yaml`."""

    levels: _Levels
    quick: _Levels
    coarser: _Levels
    cells: Annotated[tuple[_Ladder, ...], Meta(min_length=1)]


def read_ladders(path: Path, quick: bool = False) -> list[InfSupLadder]:
    """The ladders that a file asks for, before they run; InputError says what is refused."""
    return list(_ladders(read_as(InfSupFile, read_mapping(path), path), quick))


def _ladders(content: InfSupFile, quick: bool) -> Iterator[InfSupLadder]:
    uncut: set[tuple[str, str]] = set()
    for item in content.cells:
        space = "plane" if BY_NAME[item.cells].dim == 2 else "space"
        levels = getattr(content.quick if quick else content.levels, space)
        levels = levels if quick else item.levels or levels
        ways = [True]
        kind = (item.cells, item.contact)
        if item.cut and kind not in uncut:
            uncut.add(kind)
            ways.append(False)
        masters = getattr(content.coarser, space)
        for coarser in masters[-1:] if quick else masters:
            for clamped in (True,) if quick else (True, False):
                for cut in ways:
                    yield InfSupLadder(
                        cells=item.cells,
                        cut=cut,
                        clamped=clamped,
                        coarser=coarser,
                        contact=item.contact,
                        hexahedra=item.hexahedra,
                        needs_cut=item.cut,
                        levels=list(levels),
                    )
