"""Other codes as plug-ins, and their runs on a case, with a limit of time and of memory.

A code is a folder, by whose name it is called, with a file of commands. The codes of this program
(`kratos`, `ngsolve`, `getfem`) and those of users have the same form. `code.yaml`:

    command: ["{python}", "{code}/toy.py"]   # run in a folder that holds the input
    version: "1.0"                           # or a command that prints it
    input: plain                             # deck.json; or the input of calculix …
    cells: [TRIA3, QUAD4]                    # left out: all
    results: [displacement.csv, pressure.csv]
    map: map.yaml                            # of names and units, see `check-result --map`
    settings: {penalty: 100 E}               # shown beside the results
    gave_up: "no convergence"                # a regular expression, of what it prints then
"""

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal, Protocol

import meshio
import numpy as np
from msgspec import Meta, field

from ..case.model import Case
from ..case.typed import Section, Text, Version, read_as
from ..case.yaml import read_mapping
from ..lac.cells.catalogue import cell_type
from ..lac.errors import SolveError
from ..system.errors import InputError, hint, of_machine
from ..system.files import replacing
from ..system.process import printed_by, run_in_subprocess
from ..system.progress import now
from ..verification.stored import write_verdict
from ..verification.verdict import CRASHED, FAILED, REFUSED, Verdict
from .compared import CHECKED_BY
from .deck import Deck, UnsupportedError, deck_of
from .files.map import CODE, Names
from .files.read import read_result_files
from .foreign import ForeignResult
from .verdicts import LOG, VERDICT, store, without_foreign

FILE = "code.yaml"
_PROJECT = Path(__file__).resolve().parents[2]
# How far from the middle of its edge, over the size of the mesh, a node is still in the middle.
_STRAIGHT = 1e-9


class PluginFile(Section, frozen=True):
    """The keys of `code.yaml`.

    command: program and arguments; {code} is the folder of this file, {python} our Python,
      {project} the folder of this program
    version: of the code, shown beside its results; or a command that prints it
    install: how it is installed
    input: what is written for it
    cells: the cell types that it takes, all if left out
    lacks: what it is not given, and the words of the refusal: oblique (supports across the axes),
      gap (another than as meshed), zones (more or less than one), curved (sides of cells), orders
      (linear and quadratic cells together)
    results: its files of results, as check-result reads them; by default as `input` writes them
    map: a map of their names and units
    settings: shown beside the results
    layer: a plane case is one layer of cells in 3D
    gave_up: what its output matches where it does not converge, a regular expression
    """

    command: Annotated[tuple[Text, ...], Meta(min_length=1)]
    version: Version | Annotated[tuple[Text, ...], Meta(min_length=1)]
    install: Text = "the folder of a user's own code"
    input: Literal["plain", "calculix", "code_aster"] = "plain"
    cells: tuple[Text, ...] = ()
    lacks: dict[Literal["oblique", "gap", "zones", "curved", "orders"], Text] = field(
        default_factory=dict
    )
    results: Names | None = None
    map: Path | None = None
    settings: dict[str, str] = field(default_factory=dict)
    layer: bool = False
    gave_up: str = ""


def _has_curved_sides(deck: Deck) -> bool:
    straight = deck.points.copy()
    for name, cells in deck.cells.items():
        cell_type(name).put_between(straight, cells)
    return bool(np.abs(straight - deck.points).max() > _STRAIGHT * np.ptp(deck.points))


_HAS: dict[str, Callable[[Deck], bool]] = {
    "oblique": lambda deck: bool(deck.oblique),
    "gap": lambda deck: any(p.gap is not None or p.zone.interference for p in deck.pairs),
    "zones": lambda deck: len(deck.pairs) != 1,
    "curved": _has_curved_sides,
    "orders": lambda deck: len({cell_type(name).order for name in deck.cells}) == 2,
}


class PluginCode:
    """A code whose commands are written down; `base` writes its input."""

    def __init__(self, folder: Path, file: PluginFile, base: "Code"):
        self.name, self.folder, self.file, self.base = folder.resolve().name, folder, file, base
        self.layer, self.install = file.layer or base.layer, file.install
        self.follows = base.follows
        self.gave_up = file.gave_up or base.gave_up
        self.settings: Mapping[str, str] = {**base.settings, **file.settings}

    def version(self) -> str:
        """As the file says, or as its command prints it; empty if the code is not installed."""
        given = self.file.version
        if not isinstance(given, tuple):
            return str(given)
        program, *arguments = self._placed(given)
        return printed_by(Path(program), *arguments)

    def write(self, deck: Deck, folder: Path) -> None:
        """Write the input; UnsupportedError for what the file says that the code lacks."""
        for name in deck.cells if self.file.cells else ():
            if name not in self.file.cells:
                raise UnsupportedError(f"{name}: not written for {self.name}")
        for feature, words in self.file.lacks.items():
            if _HAS[feature](deck):
                raise UnsupportedError(words)
        self.base.write(deck, folder)

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002
        """As the file says."""
        return self._placed(self.file.command)

    def _placed(self, words: Sequence[str]) -> list[str]:
        places = {"{code}": str(self.folder.resolve()), "{python}": sys.executable}
        places["{project}"] = str(_PROJECT)
        found = list(words)
        for word, place in places.items():
            found = [part.replace(word, place) for part in found]
        return found

    def read(self, deck: Deck, folder: Path) -> ForeignResult:
        """Its files of results, or the files of the code whose input it takes."""
        if self.file.results is None:
            return replace(self.base.read(deck, folder), code=self.name)
        files = [folder / name for name in self.file.results]
        try:
            return read_result_files(files, self.file.map, self.name)
        except InputError as error:
            raise SolveError(f"its results: {error}") from None


def plugin(folder: Path) -> PluginCode:
    """The code in a folder.

    Raises InputError for a folder that holds none, and for a file that does not fit.
    """
    if not (path := folder / FILE).is_file():
        raise InputError(folder, "code", None, f"a folder with {FILE} is needed")
    if not re.fullmatch(CODE, name := folder.resolve().name):
        raise InputError(folder, "name", name, "must be letters, digits, -, _ and .")
    file = read_as(PluginFile, read_mapping(path), path)
    try:
        re.compile(file.gave_up)
    except re.error as error:
        raise InputError(
            path, "gave_up", file.gave_up, f"must be a regular expression: {error}"
        ) from None
    return PluginCode(folder, file, find(file.input))


# The folders of plug-ins.
_PLUGINS = {file.parent.name: file.parent for file in Path(__file__).parent.glob(f"*/{FILE}")}
# Module and class, imported on demand.
_CODES = {
    "calculix": (".calculix", "CalculiX"),
    "code_aster": (".code_aster", "CodeAster"),
    "plain": (".plain", "Plain"),
}


class Code(Protocol):
    """One code: writes its input, gives the command to run, reads its results.

    `name` is its name in `<case>@<name>`. `layer`: a plane case is given to it as one layer of
    cells in space. `follows`: it follows bodies that move far. `settings` are shown beside its
    results. `install`: how it is installed.
    `gave_up`: a regular expression that its output matches if the solve does not converge.
    """

    name: str
    layer: bool
    follows: bool
    install: str
    gave_up: str

    @property
    def settings(self) -> Mapping[str, str]:
        """Its main settings, to be shown."""

    def version(self) -> str:
        """The version; empty if it is not installed."""

    def write(self, deck: Deck, folder: Path) -> None:
        """Write the input into `folder`; UnsupportedError for what the code lacks."""

    def command(self, folder: Path) -> Sequence[str]:
        """The command to run in `folder`."""

    def read(self, deck: Deck, folder: Path) -> ForeignResult:
        """The fields at the end; SolveError without a result."""


def names() -> list[str]:
    """The names of the codes of this folder."""
    return sorted([*_CODES, *_PLUGINS])


def find(name: str) -> Code:
    """The code of a name, or in a folder of the user; InputError for an unknown name."""
    if name in _PLUGINS or "/" in name or Path(name).is_dir():
        return plugin(_PLUGINS.get(name, Path(name)))
    if name not in _CODES:
        raise InputError("--code", "name", name, f"unknown; {hint(name, names())}")
    module, kind = _CODES[name]
    code: Code = getattr(import_module(module, __package__), kind)()
    return code


class CrashError(Exception):
    """The process of a code died, or did not end in time."""


@dataclass(frozen=True)
class Limits:
    """Limits of a process: seconds, memory (bytes), cores; None: one thread on any core."""

    seconds: float = 120.0
    memory: float = 4e9
    cores: Sequence[int] | None = None


def run_code(code: Code, deck: Deck, folder: Path, limits: Limits) -> ForeignResult:
    """Write the input into `folder`, run the code there, read its result.

    Its output is in `folder/log`. Raises UnsupportedError for what the code cannot express,
    CrashError if its process dies or is stopped, SolveError if it does not converge or its result
    cannot be read.
    """
    code.write(deck, folder)
    command = code.command(folder)
    ended = run_in_subprocess(command, limits.cores, limits.seconds, limits.memory, folder)
    said = ended.output + ended.problem
    (folder / LOG).write_text(said, encoding="utf-8")
    if ended.status is None:
        raise CrashError(ended.reason)
    if found := code.gave_up and re.search(code.gave_up, said):
        raise SolveError(f"no convergence: {' '.join(found[0].split())}")
    if ended.status:
        raise CrashError(ended.reason)
    return replace(
        code.read(deck, folder),
        settings=code.settings,
        seconds=ended.wall,
        cpu_seconds=ended.cpu,
        peak_memory_mb=ended.peak_memory_mb,
    )


def run_case(
    code: Code, case: Case, mesh: meshio.Mesh, folder: Path, limits: Limits | None = None
) -> Verdict:
    """Run a code on a case as solved, check its result, write all of it into `folder`.

    A code that is not installed or cannot express the case, a crash, a hang, no convergence: each
    ends with a verdict that gives the reason. The output of the code is in `folder/log`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    version, started = code.version(), now()
    with TemporaryDirectory(prefix=f"{code.name}-") as scratch:
        try:
            if not version:
                raise UnsupportedError(f"not installed: {code.install}")
            deck = deck_of(case, mesh, code.layer, code.follows)
            found = run_code(code, deck, Path(scratch), limits or Limits())
            found = replace(_thin(found) if case.thin else found, version=version)
            # What a code does not write is no fault of the result.
            only = [name for name in CHECKED_BY if getattr(found, name) is not None]
            return store(case, found, folder, mesh, only or None)
        except Exception as error:  # noqa: BLE001 -- a result of the user's may be anything
            known = [word for kind, word in _WORDS.items() if isinstance(error, kind)]
            verdict = without_foreign(
                case,
                code.name,
                known[0] if known else CRASHED,
                str(error) if known else of_machine(error) or f"{type(error).__name__}: {error}",
                version=version,
                settings=code.settings,
                seconds=now() - started,
            )
            write_verdict(folder / VERDICT, verdict)
            return verdict
        finally:
            if (said := Path(scratch, LOG)).is_file():
                with replacing(folder / LOG) as kept:
                    kept.write_bytes(said.read_bytes())


def _thin(found: ForeignResult) -> ForeignResult:
    """The result in plane stress: the stress zz of the equivalent plane strain is not there."""
    if found.stress is None:
        return found
    values = found.stress.values.copy()
    values[:, 2] = 0.0
    return replace(found, stress=replace(found.stress, values=values))


# InputError: case, mesh and result do not belong together.
_WORDS = {
    UnsupportedError: REFUSED,
    InputError: REFUSED,
    CrashError: CRASHED,
    SolveError: FAILED,
}
