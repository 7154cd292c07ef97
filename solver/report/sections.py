"""One family of the report: its rows by kind of reference, its figures, its cost."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from ..case.checks import ERRORS
from . import formats
from .charts import Chart
from .errors import draw_errors, drawn, floor
from .families import CodeError, Family, Figure, page_name, read_family
from .formats import KINDS
from .pictures import name_of, picture, profile
from .positions import side_by_side
from .rows import Row, counted, families, ours
from .tables import outcome

# Profiles on a page where the family does not say which.
_MOST_PROFILES = 4


@dataclass(frozen=True)
class Profile:
    """The pressure of one solve along its interface."""

    row: Row
    drawing: Chart | Markup
    caption: str


@dataclass(frozen=True)
class FamilySection:
    """One family with its rows, failures first; `pictures` is where drawings are kept."""

    family: Family
    rows: Sequence[Row]
    pictures: Path
    ladders: bool

    @property
    def name(self) -> str:
        """The family's name."""
        return self.family.name

    @property
    def page(self) -> str:
        """The file name of the family's page."""
        return page_name(self.name)

    @property
    def outcome(self) -> str:
        """How many solves passed."""
        return outcome(self.rows)

    @cached_property
    def bad(self) -> list[Row]:
        """The solves of our own that did not pass."""
        return [row for row in ours(self.rows) if not row.sound]

    @property
    def counts(self) -> dict[str, int]:
        """How many rows there are of each verdict."""
        return counted(ours(self.rows))

    def is_one(self, name: str) -> bool:
        """Whether a quantity is one everywhere in all solves: its column would say nothing."""
        known = [getattr(row.verdict.values, name) for row in self.rows]
        values = [x for pair in known for x in pair or () if x is not None]
        return bool(values) and all(abs(x - 1) < formats.ROUND_OFF for x in values)

    def unit(self, kind: str) -> str:
        """The unit of a kind of quantity, if all solves have the same."""
        found = {
            row.verdict.problem.units.get(kind, "")
            for row in ours(self.rows)
            if row.verdict.cost.dofs
        }
        return found.pop() if len(found) == 1 else ""

    def own_unit(self, row: Row, kind: str) -> str:
        """The unit that a row's numbers have beside them, where the head of the table has none."""
        return "" if self.unit(kind) else row.verdict.problem.units.get(kind, "")

    def code_error(self, row: Row) -> CodeError | None:
        """What the first version of the reference code has in a solve: the largest that applies."""
        codes = self.family.reference_code
        cells: dict[str, set[str]] = {"slave": set(), "master": set()}
        for body in row.sides:
            for role in cells if body.role == "both" else {body.role} & cells.keys():
                cells[role] |= set(body.cells)
        mine = [
            code
            for code in codes
            if code.version == codes[0].version and code.applies(cells["slave"], cells["master"])
        ]
        return max(mine, key=lambda code: code.error, default=None)

    @property
    def cpu(self) -> float:
        """Processor time of all solves, seconds, without the start of Python."""
        return sum(row.verdict.cost.cpu_seconds or 0.0 for row in self.rows)

    @property
    def worst(self) -> tuple[float, str] | None:
        """The largest error of all solves, with its check."""
        return max((row.accuracy for row in ours(self.rows) if row.accuracy), default=None)

    @cached_property
    def by_origin(self) -> dict[str, list[Row]]:
        """Rows by where their reference comes from, in words."""
        found: dict[str, list[Row]] = {}
        for row in self.rows:
            other = "; results of other codes" if row.verdict.foreign.code else ""
            found.setdefault(f"{row.origin(KINDS)}{other}", []).append(row)
        return found

    @cached_property
    def origins(self) -> dict[tuple[str, str, str, float | None], list[Row]]:
        """Rows by kind, origin in words, exact solution and uncertainty of their reference."""
        found: dict[tuple[str, str, str, float | None], list[Row]] = {}
        for row in ours(self.rows):
            key = (
                row.verdict.reference.kind or "",
                row.origin(KINDS),
                row.verdict.reference.solution or "",
                row.verdict.reference.uncertainty,
            )
            found.setdefault(key, []).append(row)
        return found

    @cached_property
    def norms(self) -> list[str]:
        """The errors against exact solutions that any row has."""
        return [name for name in ERRORS if any(name in row.norms for row in self.rows)]

    @cached_property
    def profiles(self) -> list[Profile]:
        """The pressure along the interface of the solves that the family names, or of some."""
        found = []
        for row, figure in self._figures:
            picture(row, self.pictures)  # both of one reading of the result
            drawing = profile(row, self.pictures, figure.expression)
            found.append(Profile(row, drawing, figure.caption))
        return found

    @cached_property
    def paths(self) -> list[tuple[Chart | str, str]]:
        """Charts over the steps of the solves that the family names together, with captions."""
        by_name, found = {row.name: row for row in self.rows}, []
        for i, figure in enumerate(self.family.paths, start=1):
            rows = [by_name[job] for job in figure.jobs if job in by_name]
            if chart := side_by_side(rows, f"path-{i}"):
                found.append((chart, figure.caption))
        return found

    @property
    def model(self) -> Row | None:
        """The solve whose picture shows the problem: the first of the profiles, or any."""
        with_result = [row for row in self.rows if row.result_file]
        return next((row for row, _ in self._figures), next(iter(with_result), None))

    @property
    def thumbnail(self) -> str:
        """The file of that picture, from the folder of the pages; empty without a result."""
        return f"{self.pictures.name}/{quote(name_of(self.model))}.svg" if self.model else ""

    @cached_property
    def _figures(self) -> list[tuple[Row, Figure]]:
        by_name = {row.name: row for row in self.rows if row.result_file}
        if self.family.figures:
            return [(by_name[f.job], f) for f in self.family.figures if f.job in by_name]
        first: dict[tuple[str, int], Row] = {}
        for row in by_name.values():
            first.setdefault((row.origin(KINDS), row.dim), row)
        return [(row, Figure(row.name)) for row in list(first.values())[:_MOST_PROFILES]]

    @cached_property
    def figure(self) -> Chart | None:
        """Error against run time; None where no solve has both."""
        return draw_errors(self.rows, self.family.reference_code) if drawn(self.rows) else None

    @property
    def floor(self) -> tuple[float, float] | None:
        """The round-off floor of that figure, where it shows it."""
        return floor(drawn(self.rows))

    @property
    def not_drawn(self) -> list[Row]:
        """The rows that the figure cannot show."""
        points = drawn(self.rows)
        return [row for row in self.rows if row not in points]


def grouped(sections: Sequence[FamilySection]) -> dict[str, list[FamilySection]]:
    """Sections by the group of their family, groups with failures first."""
    found: dict[str, list[FamilySection]] = {}
    for section in sorted(sections, key=lambda section: not section.bad):
        found.setdefault(section.family.group, []).append(section)
    return found


def sections(rows: Sequence[Row], files: Mapping[str, Path], pictures: Path) -> list[FamilySection]:
    """The sections of all rows, in the order that families ask for, else in the order of the rows.

    `files` holds the `family.yaml` of a family by its name.
    """
    found = []
    for name, members in families(rows).items():
        file = files.get(name)
        family = read_family(file) if file else Family(name, name=name)
        ladders = bool(file and file.with_name("orders.yaml").is_file())
        found.append(FamilySection(family, members, pictures, ladders))
    return sorted(found, key=lambda section: section.family.place)
