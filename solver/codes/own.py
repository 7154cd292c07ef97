"""A user's own code: a folder with `code.yaml`, its commands, or `code.py`, one class.

The folder's name is the code's name. `code.yaml`:

    command: ["{python}", "{code}/toy.py"]   # run in a folder that holds the input
    version: "1.0"
    input: plain                             # deck.json; or the input of calculix, kratos …
    results: [displacement.csv, pressure.csv]
    map: map.yaml                            # of names and units, see `check-result --map`
    settings: {penalty: 100 E}               # shown beside the results
    gave_up: "no convergence"                # a regular expression, of what it prints then
"""

import importlib.util
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, field

from ..case.typed import Section, Text, Version, read_as
from ..case.yaml import read_mapping
from ..lac.errors import SolveError
from ..system.errors import InputError
from .deck import Deck
from .files.map import CODE, Names, ResultMap
from .files.read import read_result_files
from .foreign import ForeignResult

_FILE, _CLASS = "code.yaml", "code.py"
_NEEDED = ("layer", "install", "gave_up", "settings", "version", "write", "command", "read")


class OwnCodeFile(Section, frozen=True):
    """The keys of `code.yaml`.

    command: program and arguments; {code} is the folder of this file, {python} our Python
    version: of the code, shown beside its results
    input: what is written for it
    results: its files of results, as check-result reads them; by default as `input` writes them
    map: a map of their names and units
    settings: shown beside the results
    layer: a plane case is one layer of cells in 3D
    gave_up: what its output matches where it does not converge, a regular expression
    """

    command: Annotated[tuple[Text, ...], Meta(min_length=1)]
    version: Version
    input: Literal["plain", "calculix", "code_aster", "kratos"] = "plain"
    results: Names | None = None
    map: Path | None = None
    settings: dict[str, str] = field(default_factory=dict)
    layer: bool = False
    gave_up: str = ""


class OwnCode:
    """A code whose commands a user wrote down; `base` writes its input."""

    install = "the folder of a user's own code"

    def __init__(self, folder: Path, file: OwnCodeFile, base: Any):
        self.name, self.folder, self.file, self.base = folder.resolve().name, folder, file, base
        self.layer = file.layer or base.layer
        self.gave_up = file.gave_up or base.gave_up
        self.settings: Mapping[str, str] = {**base.settings, **file.settings}

    def version(self) -> str:
        """As the file says."""
        return self.file.version

    def write(self, deck: Deck, folder: Path) -> None:
        """Write the input."""
        self.base.write(deck, folder)

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002
        """As the file says."""
        places = {"{code}": str(self.folder.resolve()), "{python}": sys.executable}
        found = list(self.file.command)
        for word, place in places.items():
            found = [part.replace(word, place) for part in found]
        return found

    def read(self, deck: Deck, folder: Path) -> ForeignResult:
        """Its files of results, or the files of the code whose input it takes."""
        if self.file.results is None:
            return replace(self.base.read(deck, folder), code=self.name)
        mapping = ResultMap()
        if self.file.map:
            mapping = read_as(ResultMap, read_mapping(self.file.map), self.file.map)
        files = [folder / name for name in self.file.results]
        try:
            return read_result_files(files, mapping, self.file.map or "", self.name)
        except InputError as error:
            raise SolveError(f"its results: {error}") from None


def own_code(folder: Path, find: Any) -> Any:
    """The code in a folder. `find` gives the code whose input it takes, by name.

    Raises InputError for a folder that holds none, and for a file or class that does not fit.
    """
    if not re.fullmatch(CODE, name := folder.resolve().name):
        raise InputError(folder, "name", name, "must be letters, digits, -, _ and .")
    if (path := folder / _CLASS).is_file():
        return _of_class(path)
    if not (path := folder / _FILE).is_file():
        raise InputError(folder, "code", None, f"a folder with {_FILE} or {_CLASS} is needed")
    file = read_as(OwnCodeFile, read_mapping(path), path)
    try:
        re.compile(file.gave_up)
    except re.error as error:
        raise InputError(
            path, "gave_up", file.gave_up, f"must be a regular expression: {error}"
        ) from None
    return OwnCode(folder, file, find(file.input))


def _of_class(path: Path) -> Any:
    """The class `Code` of a file, which needs what `registry.Code` lists."""
    spec = importlib.util.spec_from_file_location(f"own_code_{path.parent.name}", path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        code = module.Code()
    except Exception as error:  # noqa: BLE001 -- it is the user's
        raise InputError(path, "Code", None, f"{type(error).__name__}: {error}") from None
    code.name = path.resolve().parent.name
    if missing := [name for name in _NEEDED if not hasattr(code, name)]:
        raise InputError(path, "Code", None, f"it has no {', '.join(missing)}")
    return code
