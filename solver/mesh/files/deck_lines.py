"""The lines of an Abaqus input file: which keywords and options are read, ignored or refused.

A deck is understood whole, or refused with keyword and line. A keyword is in one of two tables:
`READ`, with the options that are known, or `IGNORED`, because it changes neither nodes nor cells
nor what holds bodies together beside supports, loads and contact, which the case file states. Any
other one is refused by name. Blanks in keywords do not count. A keyword line that ends with a comma
goes on in the next line.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from ...system.errors import InputError

# Options that a keyword cannot be without.
_NEEDED: dict[str, tuple[str, ...]] = {
    "ELEMENT": ("TYPE",), "NSET": ("NSET",), "ELSET": ("ELSET",), "SURFACE": ("NAME",),
    "INCLUDE": ("INPUT",),
}  # fmt: skip
# The keywords that are read, with all options that are known.
READ: dict[str, tuple[str, ...]] = {
    "NODE": ("NSET", "SYSTEM"),
    "ELEMENT": ("TYPE", "ELSET"),
    "NSET": ("NSET", "GENERATE", "UNSORTED", "INSTANCE", "INTERNAL"),
    "ELSET": ("ELSET", "GENERATE", "UNSORTED", "INSTANCE", "INTERNAL"),
    "SURFACE": ("NAME", "TYPE", "INTERNAL"),
    "INCLUDE": ("INPUT",),
    "PART": ("NAME",),
    "INSTANCE": ("NAME", "PART"),
    "ENDPART": (),
    "ENDINSTANCE": (),
    "ASSEMBLY": ("NAME",),
    "ENDASSEMBLY": (),
}
# Sections are looked at for the cells that they belong to.
IGNORED = frozenset((
    "HEADING", "PREPRINT", "RESTART", "NODEPRINT", "NODEFILE", "ELPRINT", "ELFILE", "NODEOUTPUT",
    "ELEMENTOUTPUT", "OUTPUT", "MATERIAL", "ELASTIC", "PLASTIC", "DENSITY", "EXPANSION",
    "CONDUCTIVITY", "SPECIFICHEAT", "DAMPING", "HYPERELASTIC", "HYPERFOAM", "VISCOELASTIC",
    "CREEP", "RATEDEPENDENT", "CYCLICHARDENING", "USERMATERIAL", "DEPVAR", "DAMAGEINITIATION",
    "DAMAGEEVOLUTION", "POTENTIAL", "UNIAXIALTESTDATA", "BIAXIALTESTDATA", "PLANARTESTDATA",
    "ORIENTATION", "TRANSFORM", "DISTRIBUTION", "DISTRIBUTIONTABLE", "SOLIDSECTION",
    "SHELLSECTION", "SHELLGENERALSECTION", "MEMBRANESECTION", "SURFACESECTION", "BEAMSECTION",
    "BEAMGENERALSECTION", "SECTIONCONTROLS", "HOURGLASSSTIFFNESS", "TRANSVERSESHEARSTIFFNESS",
    "NODALTHICKNESS", "AMPLITUDE", "TIMEPOINTS", "PHYSICALCONSTANTS", "BOUNDARY",
    "INITIALCONDITIONS", "SURFACEINTERACTION", "SURFACEBEHAVIOR", "FRICTION", "CONTACT",
    "CONTACTPAIR", "CONTACTINCLUSIONS", "CONTACTEXCLUSIONS", "CONTACTPROPERTYASSIGNMENT",
    "SURFACEPROPERTYASSIGNMENT", "CONTACTINITIALIZATIONASSIGNMENT", "CONTACTDAMPING",
    "CONTACTCONTROLS", "GAPCONDUCTANCE", "GAPHEATGENERATION", "CLOAD", "DLOAD", "DSLOAD",
    "TEMPERATURE", "STEP", "ENDSTEP", "STATIC",
))  # fmt: skip
# What of an ignored keyword would move nodes all the same.
_MOVING = {("CONTACTPAIR", "ADJUST"), ("CONTACTPAIR", "TIED")}
# In a step, loads and outputs have many keywords; these change the model.
_CHANGING = ("MODELCHANGE", "IMPERFECTION")
# Input files within one another.
_DEEPEST = 5
_INTEGER = re.compile(r"[+-]?\d{1,18}")
_EXPONENT = str.maketrans("dD", "ee")
_FULL_CIRCLE = 360.0


@dataclass(frozen=True)
class _Placed:
    """A part of a deck: the file it is in, and the line it starts on."""

    file: Path
    row: int

    @property
    def where(self) -> str:
        """The file and line, for messages."""
        return f"{self.file}, line {self.row}"


@dataclass(frozen=True)
class DataLine(_Placed):
    """A data line: its fields without blanks and quotes."""

    fields: list[str]

    def refusal(self, key: str, value: object, allowed: str) -> InputError:
        """A refusal of this line."""
        return InputError(self.where, key, value, allowed)


@dataclass(frozen=True)
class Keyword(_Placed):
    """A keyword without its blanks, its options, and its data lines."""

    name: str
    options: dict[str, str]
    lines: list[DataLine] = field(default_factory=list)

    @cached_property
    def keyword(self) -> str:
        """The name in capitals, without blanks."""
        return "".join(self.name.upper().split())

    def refusal(self, allowed: str) -> InputError:
        """A refusal of this keyword."""
        return InputError(self.where, f"*{' '.join(self.name.upper().split())}", None, allowed)


def keyword_blocks(path: Path) -> Iterator[Keyword]:
    """Each keyword with its options and data lines, includes followed; InputError for the rest."""
    in_step = False
    for block in _blocks(path, path.parent, (path,)):
        in_step = (in_step or block.keyword == "STEP") and block.keyword != "ENDSTEP"
        if block.keyword not in READ:
            _check_ignored(block, in_step)
            yield block
            continue
        known, missing = READ[block.keyword], _NEEDED.get(block.keyword, ())
        for option in block.options:
            if option not in known:
                raise block.refusal(f"option {option} is not followed: write out the mesh")
        for option in missing:
            if not block.options.get(option):
                raise block.refusal(f"option {option} is missing")
        yield block


def _check_ignored(block: Keyword, in_step: bool) -> None:
    known = in_step and block.keyword not in _CHANGING
    if not known and block.keyword not in IGNORED:
        raise block.refusal("not followed: the deck must be a mesh, written out")
    for option in block.options:
        if (block.keyword, option) in _MOVING:
            raise block.refusal(f"option {option} would change the mesh or tie it: remove it")


def _blocks(path: Path, job: Path, inside: tuple[Path, ...]) -> Iterator[Keyword]:
    """The blocks of a file and of those it includes; `job`: the folder that names start from."""
    block: Keyword | None = None
    for row, line in _whole_lines(path):
        if not line.startswith("*"):
            if block is None:
                raise InputError(f"{path}, line {row}", "data", line, "stands under no keyword")
            block.lines.append(DataLine(path, row, _fields(line)))
            continue
        if block:
            yield block
        block = _keyword(path, row, line)
        if block.keyword == "INCLUDE":
            yield from _blocks(*_included(block, job, inside))
            block = None
    if block:
        yield block


def _whole_lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines of a file without comments, each keyword line with those that it goes on in."""
    head, start = "", 0
    text = path.read_bytes().decode("utf-8-sig", errors="replace")
    for row, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        start = start if head else row
        head += line
        if head.startswith("*") and head.endswith(","):
            continue
        yield start, head
        head = ""
    if head:
        raise InputError(f"{path}, line {start}", "keyword", head, "does not end")


def _keyword(path: Path, row: int, head: str) -> Keyword:
    name, *rest = _fields(head[1:])
    pairs = [part.partition("=") for part in rest if part]
    options = {"".join(k.upper().split()): v.strip().strip('"') for k, _, v in pairs}
    return Keyword(path, row, name, options)


def _fields(line: str) -> list[str]:
    """What commas separate, blanks and quotes around it removed; a comma at the end ends no field.

    >>> _fields('"up row", S1, ')
    ['up row', 'S1']
    """
    if '"' in line:
        parts = re.findall(r'((?:[^,"]|"[^"]*")*)(?:,|$)', line)[:-1] or [line]
        if line.endswith(","):
            parts.append("")
    else:
        parts = line.split(",")
    fields = [part.strip() for part in parts]
    fields = [f[1:-1] if len(f) > 1 and f[0] == f[-1] == '"' else f for f in fields]
    return fields[:-1] if len(fields) > 1 and not fields[-1] else fields


def _included(
    block: Keyword, job: Path, inside: tuple[Path, ...]
) -> tuple[Path, Path, tuple[Path, ...]]:
    """The file of an *INCLUDE: its name starts from the folder of the job, or of its own file."""
    file = _named(block.options.get("INPUT", ""), job, block.file)
    if not file.is_file():
        raise block.refusal(f"{file}: no such file")
    if len(inside) > _DEEPEST or file.resolve() in {other.resolve() for other in inside}:
        raise block.refusal(f"{file} includes itself, or is more than {_DEEPEST} files deep")
    return file, job, (*inside, file)


def _named(name: str, job: Path, including: Path) -> Path:
    file = job / name
    beside = including.parent / name
    return beside if beside.is_file() and not file.is_file() else file


def files_of(path: Path) -> list[Path]:
    """The file and all that it includes, in their order; those that are missing as well."""
    found, waiting = [], [path]
    while waiting:
        found.append(waiting.pop(0))
        if not found[-1].is_file():
            continue
        text = found[-1].read_bytes().decode("utf-8-sig", errors="replace")
        named = [_named(name, path.parent, found[-1]) for name in _INCLUDED.findall(text)]
        waiting += [file for file in named if file not in found and file not in waiting]
    return found


_INCLUDED = re.compile(
    r'^[ \t]*\*include[ \t]*,\s*input[ \t]*=[ \t]*"?(.*?)"?[ \t]*$', re.IGNORECASE | re.MULTILINE
)


def integer(line: DataLine, i: int) -> int:
    """The whole number in a field of a line; InputError for anything else.

    >>> integer(DataLine(Path("deck.inp"), 3, ["7"]), 0)
    7
    """
    text = line.fields[i] if i < len(line.fields) else ""
    if not _INTEGER.fullmatch(text):
        raise line.refusal(f"field {i + 1}", text, "must be a whole number")
    return int(text)


def place_of(line: DataLine, system: str, block: Keyword) -> list[float]:
    """The place x, y, z of a node, whose number is the first field; a blank coordinate is zero.

    `system`: R, or C: radius, angle in degrees, z. Exponents may be written with D.

    >>> place_of(DataLine(Path("deck.inp"), 3, ["7", "", "-5.0D-1"]), "R", None)
    [0.0, -0.5, 0.0]
    """
    found = []
    for i, text in enumerate(line.fields[1:4], start=2):
        try:
            value = float(text.translate(_EXPONENT)) if text else 0.0
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise line.refusal(f"field {i}", text, "must be a number")
        found.append(value)
    x, y, z = [*found, 0.0, 0.0, 0.0][:3]
    if system == "C":
        angle = math.radians(y % _FULL_CIRCLE)
        return [x * math.cos(angle), x * math.sin(angle), z]
    if system != "R":
        raise block.refusal(f"SYSTEM {system}: allowed: R, C")
    return [x, y, z]
