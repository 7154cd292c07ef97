"""A study as data: cases, the values that are varied in them, what is measured, how it is shown.

    name: stability                # of its page and of its records
    title: Numerical stability
    text: what the page says first
    measure: digits                # a function of `measures`; a group may have its own
    figure: digits                 # a module of `figures`; likewise
    set: {mesh: {refine: "=level"}}       # in every case; groups have the key too
    threads: 1                     # of each timed point
    limit: 120                     # seconds that a timed point may take, start-up included
    repetitions: 3                 # of a timed point, after a warm-up
    axes:                          # values that have names: what each sets in a case
      treatment:
        lac: {title: LAC, set: {contact: {treatment: lac}}}
        uncut: {title: not cut, set: {contact: {treatment: uncut}}, groups: [patch-2d]}
    groups:
      - name: stiffness
        title: Ratio of stiffness
        vary: {x: [1.0e-8, 1, 1.0e+8]}       # numbers: texts that begin with `=` compute with them
        quick: {x: [1.0e-8, 1.0e+8]}         # the part of it that takes minutes; none: left out
        large: {x: [1.0e+12]}                # a part beyond `vary`
        beyond: [1.0e+8]                     # values past the end, where a clear refusal will do
        series:
          - {name: 2D, case: stability/plane.yaml, set: {materials: {bottom: {young: "=2000*x"}}}}

A group is the product of its series and of the values that it varies; a series may have its own in
place of the group's. A point is one of these, in each direction of its case. `set` is merged into
the case's mapping; what is set in a list is set in each of its items. The values of an axis are
numbers, lists of up to three numbers (then the variables are x, y and z), or names under `axes`; a
mapping `{label: value}` says how each is shown.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from msgspec import Meta, field, structs

from ..case.checks import ERRORS
from ..case.typed import (
    FieldError,
    Number,
    Positive,
    Section,
    Text,
    read_as,
    refuse_duplicates,
    refuse_unknown,
)
from ..case.yaml import read_mapping
from ..system.errors import InputError, hint

LEVELS = FULL, QUICK, LARGE = "full", "quick", "large"
MEASURES = ("solve", "timed", "process", "digits", "inf_sup", "profile", "quantities")
FIGURES = (
    "orders",
    "work_precision",
    "digits",
    "growth",
    "inf_sup",
    "profiles",
    "ratios",
    "limits",
)

Name = Annotated[
    str,
    Meta(
        pattern=r"^[a-z0-9][a-z0-9-]{0,63}$(?!\n)",
        description="a name of small letters, digits and `-`, at most 64",
    ),
]
Count = Annotated[int, Meta(ge=0, le=1024, description="a whole number from 0 to 1024")]
Seconds = Annotated[float, Meta(gt=0, le=1e9, description="a positive number of seconds")]
Value = float | str | Annotated[tuple[float, ...], Meta(min_length=1, max_length=3)]
Values = Annotated[
    tuple[Value, ...] | dict[str, float | tuple[float, ...]],
    Meta(description="a list of numbers, of lists of up to three or of names, or {label: value}"),
]
Vary = dict[str, Values]
if TYPE_CHECKING:  # errors and degrees are looked up by text
    ErrorName: TypeAlias = str
    Degree: TypeAlias = str
else:
    ErrorName = Literal[tuple(ERRORS)]
    Degree = Literal["linear", "quadratic"]
Slopes = dict[ErrorName, Number]
_Orders = Annotated[
    tuple[float | None, float | None],
    Meta(description="[guaranteed, best], null where not known"),
]


class Run(Section, frozen=True):
    """How a point is solved, where it is not as every case.

    `cures`: safeguards against lost digits; `everything`: nothing is left out; `bilateral`: contact
    that holds tension; `program`: another code in place of the solver.
    """

    solver: Literal["auto", "multigrid", "cholmod"] = "auto"
    cures: bool = True
    everything: bool = False
    bilateral: bool = False
    program: Literal["", "calculix"] = ""


class Choice(Section, frozen=True):
    """A named value of an axis; `groups`, `series`: the only ones that it is for, if any.

    `series` holds the beginnings of their names.
    """

    title: Text
    change: dict[str, Any] = field(name="set", default_factory=dict)
    run: Run = Run()
    groups: tuple[Name, ...] = ()
    series: tuple[Text, ...] = ()

    def is_for(self, group: "StudyGroup", series: "Series") -> bool:
        """Whether it is measured there."""
        begins = any(series.name.startswith(name) for name in self.series)
        return group.name in (self.groups or [group.name]) and (begins or not self.series)


class Series(Section, frozen=True):
    """The points of one case file, drawn as one line for each named value.

    `directions`: as the case says where it is empty. `threads`: in place of the study's. Of orders:
    `least` slopes and `finest` errors that must be reached, `observed` slopes of another code.
    """

    name: Text
    case: Path
    change: dict[str, Any] = field(name="set", default_factory=dict)
    vary: Vary = field(default_factory=dict)
    directions: Literal["", "first", "swapped", "both"] = ""
    run: Run = Run()
    threads: Count = 0
    least: Slopes = field(default_factory=dict)
    finest: dict[ErrorName, Positive] = field(default_factory=dict)
    observed: Slopes = field(default_factory=dict)


class StudyGroup(Section, frozen=True):
    """Series that vary the same values, shown together; see the module's text."""

    name: Name
    series: Annotated[tuple[Series, ...], Meta(min_length=1)]
    title: str = ""
    text: str = ""
    change: dict[str, Any] = field(name="set", default_factory=dict)
    vary: Vary = field(default_factory=dict)
    quick: Vary | None = None
    large: Vary | None = None
    beyond: tuple[Value, ...] = ()
    state: Literal["compression", "hydrostatic"] = "compression"
    measure: Literal["", *MEASURES] = ""  # type: ignore[valid-type]
    figure: Literal["", *FIGURES] = ""  # type: ignore[valid-type]
    repetitions: Count | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_duplicates("series", self.series)


class Goal(Section, frozen=True):
    """A number that a series should reach at the value `at`, in growth with size.

    `what`: `cpu`, `wall` (seconds), `memory` (GB), `pressure` (error), `iterations`, or `growth of`
    a stage. `over`: as a ratio to another series. `others`: what other codes needed.
    """

    title: Text
    series: Text
    what: Text
    most: Positive
    unit: str = ""
    at: str = ""
    over: str = ""
    others: dict[str, float] = field(default_factory=dict)


class ReferenceCode(Section, frozen=True):
    """The code whose slopes are shown beside ours."""

    name: str = "reference code"
    version: str = ""
    remark: str = ""


class Study(Section, frozen=True, dict=True):
    """The keys of a study's file.

    Of orders: `least` slopes by degree, `theory` where the family's own differs, `shortfalls` why
    slopes stay below it, `smooth`: goals of recovery apply. Of growth: `fit`, the unknowns between
    which exponents are fitted, and `goals`.
    """

    name: Name
    title: Text
    groups: Annotated[tuple[StudyGroup, ...], Meta(min_length=1)]
    figure: Literal[FIGURES]  # type: ignore[valid-type]
    measure: Literal[MEASURES] = "solve"  # type: ignore[valid-type]
    text: str = ""
    change: dict[str, Any] = field(name="set", default_factory=dict)
    threads: Count = 1
    limit: Seconds = 600.0
    repetitions: Count = 1
    axes: dict[Name, dict[str, Choice]] = field(default_factory=dict)
    least: dict[Degree, Slopes] = field(default_factory=dict)
    theory: dict[Degree, dict[ErrorName, _Orders]] = field(default_factory=dict)
    reference_code: ReferenceCode = ReferenceCode()
    shortfalls: str = ""
    smooth: bool = False
    fit: tuple[float, float] = (0.0, 0.0)
    goals: tuple[Goal, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_duplicates("groups", self.groups)
        for i, group in enumerate(self.groups):
            for vary in (group.vary, *(series.vary for series in group.series)):
                self._check_names(("groups", i, "vary"), vary)

    def _check_names(self, keys: tuple[str | int, ...], vary: Vary) -> None:
        for axis, values in vary.items():
            if isinstance(values, tuple) and len(set(values)) < len(values):
                raise FieldError((*keys, axis), "must be values that differ")
            for value in values if isinstance(values, tuple) else ():
                if isinstance(value, str):
                    refuse_unknown(
                        (*keys, axis), value, "value of this axis", self.axes.get(axis, {})
                    )

    def group(self, name: str, where: str | Path = "study", key: str = "group") -> StudyGroup:
        """The group of that name; InputError for an unknown one, which `key` of a file has."""
        known = {group.name: group for group in self.groups}
        if name not in known:
            raise InputError(where, key, name, f"no such group; {hint(name, known)}")
        return known[name]


def read_study(path: Path, level: str = FULL) -> Study:
    """The study in a file, or its quick or large part; InputError says what is refused."""
    study = read_as(Study, read_mapping(path), path)
    for axis, choices in study.axes.items():
        for name, choice in choices.items():
            for wanted in choice.groups:
                study.group(wanted, path, f"axes.{axis}.{name}.groups")
    if level == FULL:
        return study
    groups = [group for group in study.groups if getattr(group, level) is not None]
    if not groups:
        raise InputError(path, "groups", None, f"no group has a part `{level}`")
    for group in groups:
        known = [series.name for series in group.series]
        for wanted in getattr(group, level).get("series", ()):
            if wanted not in known:
                key = f"groups.{group.name}.{level}.series"
                raise InputError(path, key, wanted, f"no such series; {hint(str(wanted), known)}")
    return structs.replace(
        study, groups=tuple(_part(group, getattr(group, level)) for group in groups)
    )


def _part(group: StudyGroup, part: Vary) -> StudyGroup:
    """A group that varies some of the values; `series` among them keeps only the series named."""
    names = part.get("series") or tuple(series.name for series in group.series)
    vary = {axis: values for axis, values in part.items() if axis != "series"}
    series = tuple(
        structs.replace(one, vary={a: v for a, v in one.vary.items() if a not in vary})
        for one in group.series
        if one.name in names
    )
    return structs.replace(group, vary=group.vary | vary, series=series)
