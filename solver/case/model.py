"""A case: the objects of its file, with what follows from several keys."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec import structs

from .acting import Load, Probe, Step, Support
from .expressions import EXACT
from .file import Observation, Zone
from .material import Material
from .rigid import Rigid

if TYPE_CHECKING:
    from .solutions.base import ExactSolution


SWAPPED = "-swapped"
STATE = "state "
"""How the names of the states of an exact solution begin; no name in a file has a space."""
# A discretisation error may exceed the expected one by this factor.
MARGIN = 1.5


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


class SolvedAs(NamedTuple):
    """How a case is solved where that is not as its file says: see `Case.as_solved`."""

    swapped: bool = False
    hexahedra: str | None = None
    recovery: str | None = None

    def job(self, name: str) -> str:
        """The name of this solve of the case of a name.

        >>> SolvedAs(swapped=True, recovery="linear").job("patch")
        'patch-swapped-linear'
        """
        return "-".join(filter(None, [name, "swapped" * self.swapped, *self[1:]]))


AS_WRITTEN = SolvedAs()
"""As the file of a case says."""


@dataclass(frozen=True)
class About:
    """What a case says that no solve of it uses.

    `source` is the file's text. `units` names those of length and stress, for labels. `directions`:
    whether it is solved once (first), or with slave and master exchanged too (both).
    """

    path: Path
    source: str
    title: str = ""
    units: dict[str, str] = field(default_factory=dict)
    directions: str = "first"


@dataclass(frozen=True)
class CaseMesh:
    """Where the mesh of a case comes from, and what becomes of it.

    `source` is the file's mapping, its key `file` replaced by `path`, relative to the case file.
    `counts`: the expected cells and contact faces of bodies.
    """

    source: dict[str, Any]
    transform: dict[str, Any] | None = None
    selections: tuple[Selection, ...] = ()
    counts: dict[str, dict[str, int]] = field(default_factory=dict)


@dataclass(frozen=True)
class CaseReference:
    """What the result of a case is compared with, and how closely.

    `values` by key of the file; `exact`: the solution that it names. `uncertainty` is relative,
    `code` has the keys name and version. `tolerance` holds the overrides by check name, under `all`
    where one number was given; that of a check with an `expected` error follows from it.
    """

    values: dict[str, Any] = field(default_factory=dict)
    exact: "ExactSolution | None" = None
    kind: str | None = None
    uncertainty: float | None = None
    code: dict[str, str] | None = None
    remark: str = ""
    tolerance: dict[str, float] = field(default_factory=dict)
    expected: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A case: one file, ready to be solved once its mesh is there.

    `materials` in plane stress are those of `Material.in_plane_stress`.
    """

    name: str
    about: About
    mesh: CaseMesh
    materials: dict[str, Material]
    supports: tuple[Support, ...]
    loads: tuple[Load, ...] = ()
    zones: tuple[Zone, ...] = ()
    rigid: dict[str, Rigid] = field(default_factory=dict)
    plane: str | None = None
    steps: tuple[Step, ...] = (1.0,)
    motion: str = "small"
    observe: tuple[Observation, ...] = ()
    probes: dict[str, Probe] = field(default_factory=dict)
    reference: CaseReference = field(default_factory=CaseReference)
    solved_as: SolvedAs = AS_WRITTEN

    @property
    def path(self) -> Path:
        """The file."""
        return self.about.path

    @property
    def family(self) -> str:
        """The name of the file's folder."""
        return self.path.resolve().parent.name or "cases"

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
    def moving(self) -> bool:
        """Whether bodies may move far along the path of the steps."""
        return self.motion == "large"

    @property
    def frictional(self) -> bool:
        """Whether a contact zone has friction."""
        return any(zone.friction for zone in self.zones)

    @property
    def surfaces(self) -> dict[str, str]:
        """The kind of each rigid surface that has no mesh of its own, by body name."""
        return {name: body.surface for name, body in self.rigid.items() if body.surface}

    @property
    def job(self) -> str:
        """The name of this solve, as of its folder and its file of accepted values."""
        return self.solved_as.job(self.name)

    def zone_named(self, name: str) -> Zone:
        """The contact zone of a name."""
        return next(zone for zone in self.zones if zone.name == name)

    @property
    def states(self) -> "dict[str, ExactSolution]":
        """The states of an exact solution that has one for each step, by the name of the step."""
        exact = self.reference.exact
        states = exact.states if exact else ()
        return dict(zip(self.histories, states, strict=True)) if states else {}

    def exact_in(self, step: Step) -> "ExactSolution | None":
        """The exact solution in a step: where bodies move far it goes along with the rigid one.

        The one of `reference` is that of the last step.
        """
        exact = self.reference.exact
        if exact is None or not self.moving:
            return exact
        return exact.moved(self._way(step) - self._way(self.steps[-1]))

    def at_its_end(self) -> "Case":
        """With the exact solution of the last step in the place of that on the mesh as given."""
        exact = self.reference.exact
        if exact is None or not self.moving:
            return self
        return self.with_exact(exact.moved(self._way(self.steps[-1])))

    @property
    def exact_contact(self) -> "ExactSolution | None":
        """The exact solution where its contact is that of every zone: of one, or so it is said."""
        every = self.reference.values.get("contact_pressure") is EXACT
        return self.reference.exact if every or len(self.zones) == 1 else None

    def compared_with(self, key: str) -> Any:
        """What a quantity is compared with, checked or not: a value, the exact solution, None."""
        given, exact = self.reference.values.get(key), self.exact_contact
        if given is EXACT:
            return self.reference.exact
        if given is not None:
            return given
        return exact if exact and key in exact.quantities else None

    def with_exact(self, exact: "ExactSolution | None") -> "Case":
        """The case with another exact solution."""
        return replace(self, reference=replace(self.reference, exact=exact))

    def _way(self, step: Step) -> float:
        """How far along x the rigid body is in a step that the exact solution goes along with."""
        (body,) = self.rigid.values()
        return body.move.get("x", 0.0) * body.factor(step)

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
        reference = self.reference
        if recovery is not None and any(recovery != zone.recovery for zone in self.zones):
            reference = replace(reference, values={}, tolerance={}, expected={})
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
        solved_as = SolvedAs(swapped, hexahedra, recovery)
        return replace(self, zones=zones, reference=reference, solved_as=solved_as)

    def until(self, count: int) -> "Case":
        """The case with its first `count` steps alone, for which it gives no reference."""
        if count == len(self.steps):
            return self
        reference = replace(self.reference, values={}, expected={}, exact=None)
        return replace(self, steps=self.steps[:count], reference=reference)

    def zone_key(self, number: int, side: str) -> str:
        """The key of the file under which the group stands that is solved as slave or master."""
        if self.solved_as.swapped:
            side = {"slave": "master", "master": "slave"}[side]
        return f"contact[{number}].{side}"
