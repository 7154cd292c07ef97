"""The case file as typed objects: what to solve, and what it is checked against.

`load_case` reads a file, holds it against the schema, and then against what a schema cannot say.
What can only be known with the mesh at hand is checked in `solver.simulation.groups`.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from solver.case.descriptions import require_file
from solver.case.expressions import Expression
from solver.case.rules import check_dimension
from solver.case.schemas import CASE_SCHEMA, hint, key_path, validate
from solver.case.yaml import parse_mapping, read_text
from solver.system.errors import InputError

if TYPE_CHECKING:
    from solver.case.solutions import ExactSolution


class Exact(Enum):
    """`solution` in place of a value: what the case's exact solution has there."""

    VALUE = "solution"


EXACT = Exact.VALUE
Scalar = float | Expression
Vector = tuple[Scalar, ...]
LOAD_KINDS = ("pressure", "traction", "body_force")
SWAPPED = "-swapped"
# What an exact solution must have to stand in for the value under a key, displacement for supports.
_QUANTITY = {
    "contact_pressure": "contact_pressure",
    "normal_stress": "stress",
    "gap": "gap",
    "displacement": "displacement",
    "stress": "stress",
    "pressure": "stress",
    "traction": "stress",
    "body_force": "body_force",
}


@dataclass(frozen=True)
class Material:
    """Isotropic linear elasticity: Young's modulus (stress) and Poisson's ratio.

    `form` of its cells is displacement, mixed (see `solver.mechanics.fem.mixed`), or automatic.
    """

    young: float
    poisson: float
    form: str = field(default="automatic", compare=False)


@dataclass(frozen=True)
class Support:
    """Imposed displacements of a group: direction (x, y, z, normal) to value."""

    group: str
    fix: dict[str, Scalar | Exact]


@dataclass(frozen=True)
class Load:
    """A load on a group: `kind` is one of LOAD_KINDS; a pressure is a scalar, positive inwards."""

    group: str
    kind: str
    value: Scalar | Vector | Exact


@dataclass(frozen=True)
class Zone:
    """One contact zone: its slave and master face groups, and how the interface is treated.

    `points` each way on a slave face, for the treatment `quadrature`. `clearance` is the initial
    gap; None: what lies between the faces as meshed.
    """

    slave: str
    master: str
    name: str = "contact"
    hexahedra: str = "pyramids"
    treatment: str = "lac"
    normal: str = "element"
    interference: float = 0.0
    points: int | None = None
    clearance: Scalar | None = None


@dataclass(frozen=True)
class Observation:
    """The macro-element of a zone nearest to a point, to be reported at every step."""

    zone: str
    nearest: tuple[float, ...]


@dataclass(frozen=True)
class Case:
    """A case: one file, ready to be solved once its mesh is there.

    `mesh` is the file's mapping, the key `file` replaced by `path`, relative to the case file.
    `tolerance` holds the overrides by check name, under `all` where one number was given. `units`
    names those of length and stress, for labels alone. `source` is the file's text. `family` is the
    name of the file's folder. `reference_uncertainty` is relative, `reference_code` has the keys
    name and version.
    """

    name: str
    family: str
    path: Path
    title: str
    source: str
    mesh: dict[str, Any]
    materials: dict[str, Material]
    supports: tuple[Support, ...]
    loads: tuple[Load, ...] = ()
    zones: tuple[Zone, ...] = ()
    rigid: frozenset[str] = frozenset()
    transform: dict[str, Any] | None = None
    plane: str | None = None
    directions: str = "first"
    steps: tuple[float, ...] = (1.0,)
    observe: tuple[Observation, ...] = ()
    reference: dict[str, Scalar | Vector | dict[str, Scalar] | Exact] = field(default_factory=dict)
    reference_kind: str | None = None
    reference_uncertainty: float | None = None
    reference_code: dict[str, str] | None = None
    reference_remark: str = ""
    solution: "ExactSolution | None" = None
    tolerance: dict[str, float] = field(default_factory=dict)
    counts: dict[str, dict[str, int]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)


def load_case(path: str | Path) -> Case:
    """The case in a file; `InputError` names the file, the key, the value and what is allowed."""
    path = Path(path)
    return parse_case(read_text(path), path)


def parse_case(text: str, path: Path) -> Case:
    """The case in a text; `path` serves its family, its relative paths and the messages."""
    content = parse_mapping(text, path)
    validate(content, CASE_SCHEMA, path)
    case = _Reader(path, content).case(text)
    _check(case)
    return case


def check_mesh_file(case: Case) -> None:
    """Raise `InputError` where the case names a mesh file that is not there."""
    path = case.mesh.get("path")
    if path:
        require_file(case.path, "mesh.file", path, str(path))


class _Reader:
    """Turns a mapping that the schema has passed into typed objects."""

    def __init__(self, path: Path, content: dict[str, Any]):
        self.path = path
        self.content = content
        self.materials = {
            group: Material(float(m["young"]), float(m["poisson"]), m.get("form", "automatic"))
            for group, m in content["materials"].items()
        }
        self.zones = tuple(map(self.zone, range(len(content.get("contact", [])))))
        self.solution = self.exact_solution()

    def case(self, source: str) -> Case:
        content = self.content
        reference = content.get("reference", {})
        # Left out where the file does not give them, for the defaults of `Case` to hold.
        given: dict[str, Any] = {
            key: content[key]
            for key in ("transform", "plane", "directions", "counts", "units")
            if key in content
        }
        if "steps" in content:
            given["steps"] = tuple(map(float, content["steps"]))
        return Case(
            name=content["name"],
            family=self.path.resolve().parent.name or "cases",
            path=self.path,
            title=content.get("title", ""),
            source=source,
            mesh=self.mesh(),
            materials=self.materials,
            supports=tuple(map(self.support, range(len(content["supports"])))),
            loads=tuple(map(self.load, range(len(content.get("loads", []))))),
            zones=self.zones,
            rigid=frozenset(
                group for group, body in content.get("bodies", {}).items() if body.get("rigid")
            ),
            observe=tuple(
                Observation(item["zone"], tuple(map(float, item["nearest"])))
                for item in content.get("observe", [])
            ),
            reference_kind=reference.get("kind"),
            reference_uncertainty=reference.get("uncertainty"),
            reference_code=reference.get("code"),
            reference_remark=reference.get("remark", ""),
            solution=self.solution,
            reference={
                key: self.value_or_exact("reference", key) for key in reference if key in _QUANTITY
            },
            tolerance=self.tolerance(),
            **given,
        )

    def mesh(self) -> dict[str, Any]:
        mesh = dict(self.content["mesh"])
        if "file" in mesh:
            mesh["path"] = self.path.parent / mesh.pop("file")
        return mesh

    def support(self, index: int) -> Support:
        item = self.content["supports"][index]
        if isinstance(item["fix"], list):
            return Support(item["group"], dict.fromkeys(item["fix"], 0.0))
        keys = ("supports", index, "fix")
        fix = {axis: self.value_or_exact(*keys, axis) for axis in item["fix"]}
        return Support(item["group"], fix)

    def zone(self, index: int) -> Zone:
        item = dict(self.content["contact"][index])
        if "interference" in item:
            item["interference"] = float(item["interference"])
        if "clearance" in item:
            item["clearance"] = self.value("contact", index, "clearance")
        return Zone(**item)

    def load(self, index: int) -> Load:
        item = self.content["loads"][index]
        kind = next(kind for kind in LOAD_KINDS if kind in item)
        return Load(item["group"], kind, self.value_or_exact("loads", index, kind))

    def tolerance(self) -> dict[str, float]:
        given = self.content.get("tolerance", {})
        given = given if isinstance(given, dict) else {"all": given}
        return {check: float(value) for check, value in given.items()}

    def exact_solution(self) -> "ExactSolution | None":
        """The solution that the reference names, told what the case says already."""
        given = self.content.get("reference", {}).get("solution")
        if given is None:
            return None
        from solver.case.solutions import Known, build

        known = Known(
            where=self.path,
            materials=self.materials,
            dimension=2 if "plane" in self.content else 3,
            pressure=_only(load.get("pressure") for load in self.content.get("loads", [])),
            interference=_only(zone.interference for zone in self.zones),
        )
        return build(given, known)

    def value_or_exact(self, *keys: str | int) -> Any:
        """EXACT where `solution` stands under the keys; refused where that does not tell it."""
        if self.given(*keys) != EXACT.value:
            return self.value(*keys)
        quantity = _QUANTITY.get(str(keys[-1]), "displacement")
        if self.solution is not None and quantity in self.solution.quantities:
            return EXACT
        name = self.solution.name if self.solution else None
        allowed = f"{name} has no {quantity}" if name else "reference.solution names none"
        raise InputError(self.path, key_path(keys), EXACT.value, allowed)

    def given(self, *keys: str | int) -> Any:
        """What stands under the keys in the file."""
        value: Any = self.content
        for key in keys:
            value = value[key]
        return value

    def value(self, *keys: str | int) -> Any:
        """The number, expression, tuple or mapping of them that stands under the keys."""
        value = self.given(*keys)
        if isinstance(value, list):
            return tuple(self.value(*keys, i) for i in range(len(value)))
        if isinstance(value, dict):
            return {key: self.value(*keys, key) for key in value}
        if isinstance(value, str):
            return Expression(value, where=str(self.path), key=key_path(keys))
        return float(value)


def _only(values: Iterable[Any]) -> float | None:
    """The one number among the values; None where there is none, or another value beside it."""
    different = {value for value in values if value is not None}
    value = different.pop() if len(different) == 1 else None
    return float(value) if isinstance(value, int | float) else None


def _check(case: Case) -> None:
    """What the schema cannot say and the mesh need not say."""
    if case.name.endswith(SWAPPED):
        allowed = f"must not end in {SWAPPED}: that is the name of the other direction"
        raise InputError(case.path, "name", case.name, allowed)
    _check_names(case)
    for before, after in zip(case.steps, case.steps[1:], strict=False):
        if after <= before:
            allowed = "load factors must increase"
            raise InputError(case.path, "steps", list(case.steps), allowed)
    _check_listed_twice(case)
    _check_errors(case)
    _check_reference(case)
    if case.plane:
        check_dimension(case, 2)


def _check_names(case: Case) -> None:
    names: set[str] = set()
    for i, zone in enumerate(case.zones):
        if zone.slave == zone.master:
            allowed = "the slave is its own master: they must be two groups"
            raise InputError(case.path, f"contact[{i}].master", zone.master, allowed)
        if zone.name in names:
            allowed = "the name is given to two zones; each needs its own"
            raise InputError(case.path, f"contact[{i}].name", zone.name, allowed)
        if zone.points and zone.treatment != "quadrature":
            allowed = "only the treatment quadrature has points"
            raise InputError(case.path, f"contact[{i}].points", zone.points, allowed)
        if zone.normal == "nodal" and zone.treatment in ("quadrature", "node_to_segment"):
            allowed = f"the treatment {zone.treatment} has normals of its own; allowed: element"
            raise InputError(case.path, f"contact[{i}].normal", zone.normal, allowed)
        names.add(zone.name)
    for i, item in enumerate(case.observe):
        if item.zone not in names:
            allowed = f"no such zone; {hint(item.zone, names)}"
            raise InputError(case.path, f"observe[{i}].zone", item.zone, allowed)


def _check_errors(case: Case) -> None:
    """An error against an exact solution can have a tolerance only where there is such a one."""
    if not case.tolerance:
        return
    from solver.case.solutions import ERRORS

    for error in case.tolerance.keys() & ERRORS.keys():
        if case.solution is None:
            allowed = "needs an exact solution: reference.solution names none"
        elif ERRORS[error] not in case.solution.quantities:
            allowed = f"{case.solution.name} has no {ERRORS[error]}"
        else:
            continue
        raise InputError(case.path, f"tolerance.{error}", case.tolerance[error], allowed)


def _check_reference(case: Case) -> None:
    """Every value of the reference feeds a check; no tolerance admits any result at all."""
    from solver.case.solutions import ERRORS

    for check, tolerance in case.tolerance.items():
        if tolerance > 1:
            allowed = "must be at most 1: then the error is as large as the reference"
            raise InputError(case.path, f"tolerance.{check}", tolerance, allowed)
    for key in case.reference.keys() & {"contact_pressure", "gap"} if not case.zones else ():
        allowed = "cannot be compared: the case has no contact"
        raise InputError(case.path, f"reference.{key}", str(case.reference[key]), allowed)
    if case.reference_kind and not case.reference and case.solution is None:
        allowed = "gives no value to compare with, such as contact_pressure"
        raise InputError(case.path, "reference.kind", case.reference_kind, allowed)
    if case.solution and not case.reference and not case.tolerance.keys() & ERRORS.keys():
        known = [name for name, what in ERRORS.items() if what in case.solution.quantities]
        allowed = "nothing is compared with it; give a value (`contact_pressure: solution`) or a "
        allowed += f"tolerance for one of {', '.join(known)}"
        raise InputError(case.path, "reference.solution", case.solution.name, allowed)


def _check_listed_twice(case: Case) -> None:
    """A direction of a group is fixed once, a kind of load on a group is given once."""
    fixed = [
        (f"supports[{i}]", s.group, axis) for i, s in enumerate(case.supports) for axis in s.fix
    ]
    loaded = [(f"loads[{i}]", load.group, load.kind) for i, load in enumerate(case.loads)]
    for given in (fixed, loaded):
        seen: set[tuple[str, str]] = set()
        for key, group, what in given:
            if (group, what) in seen:
                allowed = f"the group is listed twice with {what}"
                raise InputError(case.path, f"{key}.group", group, allowed)
            seen.add((group, what))
