"""What is verified: the features of case files against the cases that use them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from operator import itemgetter
from pathlib import Path

from ..case.features import features, used
from ..case.yaml import read_mapping
from ..lac.cells.catalogue import BY_NAME
from ..mesh.keys import RECIPES
from ..system.errors import InputError
from .html import TEMPLATES, render
from .rows import Row, ours

DIMENSIONS = ("plane", "axisymmetric", "3D")
_UNVERIFIED = "unverified.yaml"


@dataclass
class Use:
    """The solves that use a feature in one dimension, and the strictest check that they passed."""

    solves: list[Row] = field(default_factory=list)
    strictest: tuple[float, str, Row] | None = None

    def add(self, row: Row) -> None:
        """Add a solve."""
        self.solves.append(row)
        for check in row.verdict.checks if row.verdict.passed else ():
            # The status has no tolerance: it is compared with 0 or 1.
            if check.verifies and check.tolerance > 0:
                found = check.tolerance, check.name, row
                self.strictest = min(self.strictest or found, found, key=itemgetter(0))


@dataclass
class Feature:
    """A feature with its use by dimension, and the reason where nothing uses it."""

    feature: str
    by_dimension: dict[str, Use]
    reason: str = ""

    @property
    def hole(self) -> bool:
        """Whether no solve uses it."""
        return not any(use.solves for use in self.by_dimension.values())


def matrix(rows: Sequence[Row], folders: Sequence[Path]) -> list[Feature]:
    """All features, and the cell types on both sides; `folders`: of families, with their cases.

    Raises InputError where the file of reasons cannot be read.
    """
    names = [f"cells: {name} as {s}" for name in BY_NAME for s in ("slave", "master")]
    names = [name for name in names if BY_NAME[name.split()[1]].dim > 1]
    lines = {
        name: Feature(name, {dimension: Use() for dimension in DIMENSIONS})
        for name in [*features(RECIPES), *names]
    }
    uses = _used(folders)
    for row in ours(rows):
        said = uses.get((row.group, row.verdict.case), set())
        sides = {"both": ("slave", "master")}
        cells = {
            f"cells: {cell} as {side}"
            for body in row.sides
            for cell in body.cells
            for side in sides.get(body.role, (body.role,))
        }
        dimension = {2: "plane", 3: "3D"}.get(row.dim, "")
        if "plane: axisymmetric" in said:
            dimension = "axisymmetric"
        for name in (said | cells) & lines.keys() if dimension else ():
            lines[name].by_dimension[dimension].add(row)
    for pattern, reason in reasons(folders).items():
        for line in lines.values():
            if line.hole and fits(line.feature, pattern):
                line.reason = reason
    return list(lines.values())


def fits(feature: str, pattern: str) -> bool:
    """Whether a feature fits a pattern; `[]` is literal."""
    return fnmatchcase(feature, pattern.replace("[", "[[]"))


def _used(folders: Sequence[Path]) -> dict[tuple[str, str], set[str]]:
    """The features of each case by family and name; invalid files have none."""
    found = {}
    for folder in folders:
        for path in folder.glob("*.yaml"):
            try:
                content = read_mapping(path)
                found[folder.name, str(content.get("name"))] = used(content, path)
            except InputError:
                continue
    return found


def reasons(folders: Sequence[Path]) -> Mapping[str, str]:
    """Why features are used by no case, by pattern, from the file beside the families' folders."""
    for file in {folder.parent / _UNVERIFIED for folder in folders}:
        if file.is_file():
            return read_mapping(file).get("features", {})
    return {}


def matrix_page(rows: Sequence[Row], folders: Sequence[Path]) -> str:
    """The page of the matrix."""
    lines = matrix(rows, folders)
    return render(
        TEMPLATES / "matrix.html.jinja",
        title="What is verified",
        sortable=True,
        dimensions=DIMENSIONS,
        lines=lines,
        holes=[line for line in lines if line.hole and not line.reason],
    )
