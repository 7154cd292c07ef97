"""The case file read: its text becomes a `Case`, or is refused with one line.

`case.rules` checks what concerns several keys, `simulation.scene.groups` what needs the mesh.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from msgspec import structs

from ..system.errors import InputError, key_path
from .acting import Load, Step, Support
from .expressions import EXACT, Expression
from .file import MOST_STEPS, CaseFile
from .material import Material
from .model import MARGIN, STATE, About, Case, CaseMesh, CaseReference, Selection
from .rules import check_rules
from .typed import Keys, read_as, read_marked
from .yaml import parse_mapping, read_text

if TYPE_CHECKING:
    from .solutions.base import ExactSolution

Acting = TypeVar("Acting", Support, Load)
# The quantity of an exact solution that `solution` means under a key.
_QUANTITY = {
    "contact_pressure": "contact_pressure",
    "normal_stress": "stress",
    "gap": "gap",
    "displacement": "displacement",
    "friction_traction": "friction_traction",
    "slip": "slip",
    "stick_area": "stick_area",
    "dissipation": "dissipation",
    "stress": "stress",
    "pressure": "stress",
    "traction": "stress",
    "body_force": "body_force",
} | dict.fromkeys(("x", "y", "z", "normal"), "displacement")
# The keys of the reference that are no values.
_ORIGIN = {"kind", "uncertainty", "code", "remark", "solution"}


def load_case(path: str | Path) -> Case:
    """The case in a file; `InputError` names the file, the key, the value and what is allowed."""
    path = Path(path)
    return parse_case(read_text(path), path)


def parse_case(text: str, path: Path) -> Case:
    """The case in a text; `path` serves its family, its relative paths and the messages."""
    content = parse_mapping(text, path)
    case = _Reader(path, content, read_as(CaseFile, content, path)).case(text)
    check_rules(case)
    return case.at_its_end()


def check_mesh_file(case: Case) -> None:
    """Raise `InputError` where the case names a mesh file that is not there."""
    path = case.mesh.source.get("path")
    if path and not path.is_file():
        raise InputError(case.path, "mesh.file", str(path), "no such file")


class _Reader:
    """Turns the keys of a file into a case: expressions are parsed, the solution is made."""

    def __init__(self, path: Path, content: dict[str, Any], file: CaseFile):
        self.path, self.content, self.file = path, content, file
        self.materials = {
            group: Material(**structs.asdict(keys)) for group, keys in file.materials.items()
        }
        self.selections: dict[str, Selection] = {}
        for name in file.groups:
            self.select(name)
        if file.plane == "stress":
            self.materials = {g: self.thin(g, m) for g, m in self.materials.items()}
        self.solution = self.exact_solution()

    def case(self, text: str) -> Case:
        file, content = self.file, self.content
        made = Case(
            name=file.name,
            about=About(
                path=self.path,
                source=text,
                title=file.title,
                units=content.get("units", {}),
                directions=file.directions,
            ),
            mesh=CaseMesh(
                source=self.mesh_source(),
                transform=content.get("transform"),
                counts=content.get("counts", {}),
            ),
            materials=self.deforming(),
            supports=self.acting("supports", file.supports),
            loads=self.acting("loads", file.loads),
            zones=tuple(
                read_marked(zone, ("contact", i), self.read) for i, zone in enumerate(file.contact)
            ),
            rigid={g: body for g, body in file.bodies.items() if body.rigid or body.surface},
            plane=file.plane,
            steps=self.steps(),
            motion=file.motion,
            probes={
                name: read_marked(probe, ("probes", name), self.read)
                for name, probe in file.probes.items()
            },
            observe=file.observe,
            reference=self.reference(),
        )
        # Last: keys of all parts select groups.
        mesh = replace(made.mesh, selections=tuple(self.selections.values()))
        return replace(made, mesh=mesh)

    def deforming(self) -> dict[str, Material]:
        """The materials, without those of rigid bodies where others are left."""
        rigid = {group for group, body in self.file.bodies.items() if body.rigid}
        return {g: m for g, m in self.materials.items() if g not in rigid} or self.materials

    def mesh_source(self) -> dict[str, Any]:
        """Where the mesh comes from: a file, by its path, or a recipe."""
        mesh = dict(self.file.mesh)
        if "file" in mesh:
            mesh["path"] = self.path.parent / mesh.pop("file")
        return mesh

    def reference(self) -> CaseReference:
        """What the result is compared with."""
        tolerance, expected = self.tolerances()
        judged = CaseReference(exact=self.solution, tolerance=tolerance, expected=expected)
        keys = self.file.reference
        if keys is None:
            return judged
        values = structs.asdict(read_marked(keys, ("reference",), self.read))
        return replace(
            judged,
            values={k: v for k, v in values.items() if k not in _ORIGIN and v is not None},
            kind=keys.kind,
            uncertainty=keys.uncertainty,
            code=structs.asdict(keys.code) if keys.code else None,
            remark=keys.remark,
        )

    def steps(self) -> tuple[Step, ...]:
        """The load steps; those of an exact solution with a state for each."""
        states = self.solution.states if self.solution else ()
        if not states:
            return self.in_parts(self.file.steps, self.file.substeps)
        for key in ("steps", "substeps"):
            if key in self.content:
                allowed = "must be left out: the exact solution has a state for each step"
                raise InputError(self.path, key, None, allowed)
        names = [f"{STATE}{i + 1}" for i in range(len(states))]
        return tuple({name: float(name == now) for name in names} for now in names)

    def in_parts(self, steps: tuple[Step, ...], count: int) -> tuple[Step, ...]:
        """The steps with those on the way to each one, in `count` equal parts."""
        if len(steps) * count > MOST_STEPS:
            allowed = f"makes {len(steps) * count} steps; {MOST_STEPS} at most are allowed"
            raise InputError(self.path, "substeps", count, allowed)
        found, last = list[Step](), 0.0 if isinstance(steps[0], float) else dict[str, float]()
        for step in steps:
            found += [_between(last, step, part / count) for part in range(1, count)]
            found.append(step)
            last = step
        return tuple(found)

    def tolerances(self) -> tuple[dict[str, float], dict[str, float]]:
        """The tolerances by check, and the expected errors from which some of them follow."""
        given = self.file.tolerance
        stated: dict[str, float] = {"all": given} if isinstance(given, float) else {}
        if isinstance(given, dict):
            stated = {str(check): value for check, value in given.items()}
        expected = {str(check): error for check, error in (self.file.expected or {}).items()}
        for check, error in expected.items():
            if check == "all" or check in stated:
                allowed = "must be the name of a check without a tolerance of its own"
                raise InputError(self.path, f"expected.{check}", error, allowed)
        return stated | {check: MARGIN * error for check, error in expected.items()}, expected

    def thin(self, group: str, material: Material) -> Material:
        """The material in plane stress; its equivalent in plane strain needs ν > -0.5."""
        if material.poisson <= -0.5:
            allowed = "must be greater than -0.5 in plane stress"
            raise InputError(self.path, f"materials.{group}.poisson", material.poisson, allowed)
        return material.in_plane_stress()

    def select(self, name: str) -> None:
        """Add a group that the file makes."""
        item, keys = self.file.groups[name], ("groups", name)
        if isinstance(item, tuple):
            self.selections[name] = Selection(name, key_path(keys), "groups", item)
            return
        within: Any = item.within or ()
        shape = next(s for s in ("plane", "sphere", "box", "where") if getattr(item, s))
        given = getattr(item, shape)
        where = shape == "where"
        values = (self.expression((*keys, shape), given),) if where else structs.astuple(given)
        self.selections[name] = Selection(
            name,
            key_path(keys),
            item.of,
            (within,) if isinstance(within, str) else within,
            shape,
            values,
        )

    def group(self, keys: Keys, given: Any, at: Any = None) -> str:
        """The name of a group, of a list of them, or of the node at a point."""
        if isinstance(given, str):
            return given
        if given is not None and len(given) == 1:
            return str(given[0])
        if given is not None:
            made = Selection("+".join(given), key_path(keys), "groups", given)
        else:
            name = f"({', '.join(_shown(x) for x in at)})"
            made = Selection(name, key_path((*keys[:-1], "at")), "nodes", (), "at", at)
        known = self.selections.setdefault(made.name, made)
        if replace(known, key=made.key) != made:
            allowed = f"the group of {known.key} has this name; give that one another name"
            raise InputError(self.path, made.key, made.name, allowed)
        return made.name

    def acting(self, key: str, items: tuple[Acting, ...]) -> tuple[Acting, ...]:
        """Supports or loads; a node at a point becomes a group."""
        found = [read_marked(item, (key, i), self.read) for i, item in enumerate(items)]
        for i, item in enumerate(found):
            if item.at is not None:
                group = self.group((key, i, "group"), None, item.at)
                found[i] = structs.replace(item, group=group, at=None)
        return tuple(found)

    def exact_solution(self) -> ExactSolution | None:
        """The solution that the reference names, made with what the case says already."""
        given = self.file.reference.solution if self.file.reference else None
        if given is None:
            return None
        from .solutions.catalogue import Known, build

        known = Known(
            where=self.path,
            materials=self.materials,
            dimension=2 if self.file.plane in ("strain", "stress") else 3,
            plane_stress=self.file.plane == "stress",
            axisymmetric=self.file.plane == "axisymmetric",
            pressure=_only(load.pressure for load in self.file.loads),
            interference=_only(zone.interference for zone in self.file.contact),
            friction=_only(zone.friction for zone in self.file.contact),
        )
        return build(given, known)

    def read(self, mark: str, value: Any, keys: Keys) -> Any:
        """What stands for a value by the mark of its type; see `acting`."""
        if mark == "group":
            return self.group(keys, value)
        if isinstance(value, dict):
            return {str(key): self.read(mark, item, (*keys, key)) for key, item in value.items()}
        if isinstance(value, tuple):
            return tuple(self.read(mark, item, (*keys, i)) for i, item in enumerate(value))
        if not isinstance(value, str):
            return value
        quantity = _QUANTITY.get(str(keys[-1])) if mark == "value" else None
        if quantity is None or value != EXACT.value:
            return self.expression(keys, value)
        if self.solution is not None and quantity in self.solution.quantities:
            return EXACT
        name = self.solution.name if self.solution else None
        allowed = f"{name} has no {quantity}" if name else "reference.solution names none"
        raise InputError(self.path, key_path(keys), value, allowed)

    def expression(self, keys: Keys, text: str) -> Expression:
        """The function of position that a text is."""
        around = self.file.plane == "axisymmetric"
        return Expression(text, str(self.path), key_path(keys), axisymmetric=around)


def _between(one: Step, other: Step, share: float) -> Step:
    """The factors on the way from a step to another one; a name that one lacks is zero there."""
    if isinstance(one, dict) and isinstance(other, dict):
        low = {name: one.get(name, 0.0) for name in other}
        return {name: low[name] + share * (high - low[name]) for name, high in other.items()}
    if isinstance(one, dict) or isinstance(other, dict):
        return other  # refused later: steps are of one kind
    return one + share * (other - one)


def _only(values: Iterable[Any]) -> float | None:
    """The only number among the values; None if there is no number, or any other value."""
    different = {value for value in values if value is not None}
    value = different.pop() if len(different) == 1 else None
    return float(value) if isinstance(value, int | float) else None


def _shown(x: float) -> str:
    """A number in few digits, or in all where few are another number."""
    short = f"{x:g}"
    return short if float(short) == x else repr(x)
