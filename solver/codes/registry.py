"""The codes by name: modules of this folder, and plug-ins, this folder's and users' own."""

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Protocol

from ..system.errors import InputError, hint
from .deck import Deck
from .foreign import ForeignResult
from .plugin import FILE, plugin

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
    cells in space. `settings` are shown beside its results. `install`: how it is installed.
    `gave_up`: a regular expression that its output matches if the solve does not converge.
    """

    name: str
    layer: bool
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
        found: Code = plugin(_PLUGINS.get(name, Path(name)), find)
        return found
    if name not in _CODES:
        raise InputError("--code", "name", name, f"unknown; {hint(name, names())}")
    module, kind = _CODES[name]
    code: Code = getattr(import_module(module, __package__), kind)()
    return code
