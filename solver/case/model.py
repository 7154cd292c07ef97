"""A case as typed objects: supports, loads, contact zones, references."""

from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from .expressions import Expression
from .file import ObservationKeys, ZoneKeys
from .material import Material

if TYPE_CHECKING:
    from .solutions.base import ExactSolution


class Exact(Enum):
    """`solution` in place of a value: the value of the case's exact solution."""

    VALUE = "solution"


EXACT = Exact.VALUE
Scalar = float | Expression
Vector = tuple[Scalar, ...]
# A load factor, or the factors of named loads and supports.
Step = float | dict[str, float]
LOAD_KINDS = ("pressure", "traction", "body_force", "force", "strain", "temperature")
SWAPPED = "-swapped"
STATE = "state "
"""How the names of the states of an exact solution begin; no name in a file has a space."""
# A discretisation error may exceed the expected one by this factor.
MARGIN = 1.5


def job_name(
    name: str, swapped: bool, hexahedra: str | None = None, recovery: str | None = None
) -> str:
    """The name of one solve of a case: direction and variant, where they are not the case's own."""
    return "-".join(filter(None, [name, "swapped" * swapped, hexahedra, recovery]))


@dataclass(frozen=True)
class Selection:
    """A group that the case makes on the mesh, under `key` of the file.

    `of`: cells, faces, nodes; or groups, and it is all of them together. `shape`: plane, sphere,
    box, where or at, with its `values`; only what belongs to the cells of the `groups`, if any.
    """

    name: str
    key: str
    of: str
    groups: tuple[str, ...] = ()
    shape: str = ""
    values: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Cyclic:
    """The side `of` a sector that another side is the copy of, turned (degrees) or shifted."""

    of: str
    angle: float | None = None
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    shift: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Support:
    """Imposed displacements of a group, or the stiffness of its springs: direction to value.

    `together`: the directions in which all of its nodes have one displacement; `cyclic`: the side
    whose displacement the group has, turned or shifted with it.
    """

    group: str
    fix: dict[str, Scalar | Exact]
    spring: dict[str, Scalar] = field(default_factory=dict)
    together: tuple[str, ...] = ()
    cyclic: Cyclic | None = None
    name: str = ""


@dataclass(frozen=True)
class Load:
    """A load on a group: `kind` is one of LOAD_KINDS; a pressure is a scalar, positive inwards.

    An initial strain has values by component, a temperature its own value and the expansion.
    """

    group: str
    kind: str
    value: Scalar | Vector | Exact | dict[str, Scalar]
    name: str = ""

    @property
    def of_cells(self) -> bool:
        """Whether it acts on volume cells."""
        return self.kind == "body_force" or self.strains

    @property
    def strains(self) -> bool:
        """Whether it is an initial strain, which a temperature is too."""
        return self.kind in ("strain", "temperature")

    def factor(self, step: Step) -> float:
        """Its factor in a step."""
        return step.get(self.name, 1.0) if isinstance(step, dict) else step


class Zone(ZoneKeys, frozen=True):
    """A contact zone as the file has it, each side one group, the clearance evaluated."""

    slave: str
    master: str
    clearance: float | Expression | None = None  # type: ignore[assignment]


@dataclass(frozen=True)
class Rigid:
    """A rigid body: its motion about a reference point, and its surface if it has no cells.

    `surface`: plane, sphere, cylinder or parabola, with its `values` by key; empty: as meshed.
    `move`: the imposed displacement by component, x … rz; `force`: force or moment by component,
    in which the body is free to move. It is held in all others.
    """

    surface: str = ""
    values: dict[str, Any] = field(default_factory=dict)
    reference: tuple[float, ...] | None = None
    move: dict[str, float] = field(default_factory=dict)
    force: dict[str, float] = field(default_factory=dict)
    name: str = ""

    @property
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Its points and directions by key."""
        given = {"reference": self.reference}
        given |= {f"{self.surface}.{key}": value for key, value in self.values.items()}
        return [(key, value) for key, value in given.items() if isinstance(value, tuple)]

    @property
    def moves(self) -> bool:
        """Whether it has a motion, imposed or free."""
        return bool(self.move or self.force)


@dataclass(frozen=True)
class Probe:
    """A place whose displacement and stress are results; of a `zone`, its contact pressure.

    A point `at` a place (dim,), of several bodies there the one with the cells `within`; or the
    nodes of a `group`.
    """

    name: str
    at: tuple[float, ...] = ()
    group: str = ""
    within: str = ""
    zone: str = ""


@dataclass(frozen=True)
class Case:
    """A case: one file, ready to be solved once its mesh is there.

    `materials` in plane stress are those of `Material.in_plane_stress`. `mesh` is the file's
    mapping, the key `file` replaced by `path`, relative to the case file. `tolerance` holds the
    overrides by check name, under `all` where one number was given; that of a check with
    an `expected` error follows from it. `units` names those of length and stress, for labels alone.
    `source` is the file's text. `family` is the name of the file's folder. `reference_uncertainty`
    is relative, `reference_code` has the keys name and version.
    `swapped`, `hexahedra` and `recovery`: how the case is solved, see `as_solved`.
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
    rigid: dict[str, Rigid] = field(default_factory=dict)
    transform: dict[str, Any] | None = None
    plane: str | None = None
    directions: str = "first"
    steps: tuple[Step, ...] = (1.0,)
    observe: tuple[ObservationKeys, ...] = ()
    probes: tuple[Probe, ...] = ()
    reference: dict[str, Scalar | Vector | dict[str, Scalar] | Exact] = field(default_factory=dict)
    reference_kind: str | None = None
    reference_uncertainty: float | None = None
    reference_code: dict[str, str] | None = None
    reference_remark: str = ""
    solution: "ExactSolution | None" = None
    tolerance: dict[str, float] = field(default_factory=dict)
    expected: dict[str, float] = field(default_factory=dict)
    counts: dict[str, dict[str, int]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    selections: tuple[Selection, ...] = ()
    swapped: bool = False
    hexahedra: str | None = None
    recovery: str | None = None

    @property
    def thin(self) -> bool:
        """Whether the bodies are in plane stress: none across the plane."""
        return self.plane == "stress"

    @property
    def axisymmetric(self) -> bool:
        """Whether the mesh is a meridian plane, x the radius and y the height."""
        return self.plane == "axisymmetric"

    @property
    def factors(self) -> tuple[float, ...]:
        """The load factor of each step; its number where loads have factors of their own."""
        numbered = enumerate(self.steps, start=1)
        return tuple(float(n) if isinstance(step, dict) else step for n, step in numbered)

    @property
    def frictional(self) -> bool:
        """Whether a contact zone has friction."""
        return any(zone.friction for zone in self.zones)

    def zone_named(self, name: str) -> Zone:
        """The contact zone of a name."""
        return next(zone for zone in self.zones if zone.name == name)

    @property
    def states(self) -> "dict[str, ExactSolution]":
        """The states of an exact solution that has one for each step, by the name of the step."""
        states = self.solution.states if self.solution else ()
        return dict(zip(self.histories, states, strict=True)) if states else {}

    @property
    def acting(self) -> dict[str, str]:
        """The groups of supports and of the sides they copy, and of loads on surfaces, by key."""
        held = {f"supports[{i}].group": s.group for i, s in enumerate(self.supports)}
        supports, loads = enumerate(self.supports), enumerate(self.loads)
        held |= {f"supports[{i}].cyclic.of": s.cyclic.of for i, s in supports if s.cyclic}
        return held | {f"loads[{i}].group": x.group for i, x in loads if not x.of_cells}

    @property
    def histories(self) -> tuple[str, ...]:
        """The names of loads and supports that have factors of their own, or of states."""
        return tuple(self.steps[0]) if isinstance(self.steps[0], dict) else ()

    def as_solved(
        self, swapped: bool = False, hexahedra: str | None = None, recovery: str | None = None
    ) -> "Case":
        """The case with slave and master exchanged, another cut of hexahedra, another recovery.

        A recovery concerns the zones that have one constant pressure per macro-element. What the
        case compares with a tolerance belongs to its own recovery: with another one, errors are
        measured and not judged.
        """
        other = recovery is not None and any(recovery != zone.recovery for zone in self.zones)
        found = replace(self, reference={}, tolerance={}, expected={}) if other else self
        zones = tuple(
            structs.replace(
                zone,
                slave=zone.master if swapped else zone.slave,
                master=zone.slave if swapped else zone.master,
                hexahedra=hexahedra or zone.hexahedra,
                recovery=recovery or zone.recovery,
            )
            for zone in self.zones
        )
        return replace(found, zones=zones, swapped=swapped, hexahedra=hexahedra, recovery=recovery)

    def zone_key(self, number: int, side: str) -> str:
        """The key of the file under which the group stands that is solved as slave or master."""
        if self.swapped:
            side = {"slave": "master", "master": "slave"}[side]
        return f"contact[{number}].{side}"
