"""The case file read: its text becomes a `Case`, or is refused with one line.

`case.rules` checks what concerns several keys, `simulation.scene.groups` what needs the mesh.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from ..system.errors import InputError, key_path
from .acting import BodyKeys
from .expressions import Expression
from .file import CaseFile
from .material import Material
from .model import (
    EXACT,
    LOAD_KINDS,
    MARGIN,
    STATE,
    Case,
    Cyclic,
    Load,
    Probe,
    Rigid,
    Selection,
    Step,
    Support,
    Zone,
)
from .rules import check_rules
from .typed import read_as
from .yaml import parse_mapping, read_text

if TYPE_CHECKING:
    from .solutions.base import ExactSolution

# The quantity of an exact solution that `solution` means under a key; in supports, displacement.
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
}
# Other keys of the reference, which no solution gives.
_OTHERS = (
    *("force", "contact_area", "reaction", "moment", "strain_energy", "coverage"),
    *("displacement_at", "stress_at", "pressure_at"),
)


def load_case(path: str | Path) -> Case:
    """The case in a file; `InputError` names the file, the key, the value and what is allowed."""
    path = Path(path)
    return parse_case(read_text(path), path)


def parse_case(text: str, path: Path) -> Case:
    """The case in a text; `path` serves its family, its relative paths and the messages."""
    content = parse_mapping(text, path)
    case = _Reader(path, content, read_as(CaseFile, content, path)).case(text)
    check_rules(case)
    return case


def check_mesh_file(case: Case) -> None:
    """Raise `InputError` where the case names a mesh file that is not there."""
    path = case.mesh.get("path")
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
        self.zones = tuple(map(self.zone, range(len(file.contact))))
        self.solution = self.exact_solution()

    def case(self, source: str) -> Case:
        file, reference = self.file, self.file.reference
        tolerance, expected = self.tolerances()
        mesh = dict(file.mesh)
        if "file" in mesh:
            mesh["path"] = self.path.parent / mesh.pop("file")
        return Case(
            name=file.name,
            family=self.path.resolve().parent.name or "cases",
            path=self.path,
            title=file.title,
            source=source,
            mesh=mesh,
            materials=self.materials,
            supports=tuple(map(self.support, range(len(file.supports)))),
            loads=tuple(map(self.load, range(len(file.loads)))),
            zones=self.zones,
            rigid={
                g: _rigid(body) for g, body in file.bodies.items() if body.rigid or body.surface
            },
            transform=self.content.get("transform"),
            plane=file.plane,
            directions=file.directions,
            steps=self.steps(),
            probes=tuple(map(self.probe, file.probes)),
            observe=file.observe,
            reference={
                key: self.value_or_exact("reference", key)
                for key in self.content.get("reference", ())
                if key in (*_QUANTITY, *_OTHERS)
            },
            reference_kind=reference.kind if reference else None,
            reference_uncertainty=reference.uncertainty if reference else None,
            reference_code=structs.asdict(reference.code) if reference and reference.code else None,
            reference_remark=reference.remark if reference else "",
            solution=self.solution,
            tolerance=tolerance,
            expected=expected,
            counts=self.content.get("counts", {}),
            units=self.content.get("units", {}),
            selections=tuple(self.selections.values()),
        )

    def steps(self) -> tuple[Step, ...]:
        """The load steps; those of an exact solution with a state for each."""
        states = self.solution.states if self.solution else ()
        if not states:
            return self.file.steps
        if "steps" in self.content:
            allowed = "must be left out: the exact solution has a state for each step"
            raise InputError(self.path, "steps", None, allowed)
        names = [f"{STATE}{i + 1}" for i in range(len(states))]
        return tuple({name: float(name == now) for name in names} for now in names)

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
        within = () if item.within is None else item.within
        shape = next(s for s in ("plane", "sphere", "box", "where") if getattr(item, s))
        given = getattr(item, shape)
        values = (self.value(*keys, shape),) if shape == "where" else tuple(structs.astuple(given))
        self.selections[name] = Selection(
            name,
            key_path(keys),
            item.of,
            (within,) if isinstance(within, str) else within,
            shape,
            values,
        )

    def group(self, keys: tuple[str | int, ...], given: Any, at: Any = None) -> str:
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

    def support(self, index: int) -> Support:
        item, keys = self.file.supports[index], ("supports", index)
        group = self.group((*keys, "group"), item.group, item.at)
        if item.cyclic is not None:
            of = self.group((*keys, "cyclic", "of"), item.cyclic.of)
            return Support(group, {}, cyclic=Cyclic(**structs.asdict(item.cyclic) | {"of": of}))
        if item.together is not None:
            return Support(group, {}, together=item.together, name=item.name or "")
        if item.spring is not None:
            return Support(group, {}, self.value(*keys, "spring"), name=item.name or "")
        if isinstance(item.fix, tuple):
            return Support(group, dict.fromkeys(item.fix, 0.0), name=item.name or "")
        fix: dict[str, Any] = {a: self.value_or_exact(*keys, "fix", a) for a in item.fix or ()}
        return Support(group, fix, name=item.name or "")

    def zone(self, index: int) -> Zone:
        keys = structs.asdict(self.file.contact[index])
        if keys["clearance"] is not None:
            keys["clearance"] = self.value("contact", index, "clearance")
        for side in ("slave", "master"):
            keys[side] = self.group(("contact", index, side), keys[side])
        return Zone(**keys)

    def load(self, index: int) -> Load:
        item, keys = self.file.loads[index], ("loads", index)
        kind = next(kind for kind in LOAD_KINDS if getattr(item, kind) is not None)
        group = self.group((*keys, "group"), item.group, item.at)
        if kind == "temperature":
            value: Any = {key: self.value(*keys, key) for key in ("temperature", "expansion")}
        else:
            value = (self.value if kind == "strain" else self.value_or_exact)(*keys, kind)
        return Load(group, kind, value, item.name or "")

    def probe(self, name: str) -> Probe:
        item = self.file.probes[name]
        given = {key: getattr(item, key) for key in ("group", "within")}
        groups = {k: self.group(("probes", name, k), v) if v else "" for k, v in given.items()}
        return Probe(name, item.at or (), **groups, zone=item.zone or "")

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
            interference=_only(zone.interference for zone in self.zones),
            friction=_only(zone.friction for zone in self.zones),
        )
        return build(given, known)

    def value_or_exact(self, *keys: str | int) -> Any:
        """The value of a key, or EXACT for `solution`; refused where the solution has none."""
        if self.given(*keys) != EXACT.value:
            return self.value(*keys)
        quantity = _QUANTITY.get(str(keys[-1]), "displacement")
        if self.solution is not None and quantity in self.solution.quantities:
            return EXACT
        name = self.solution.name if self.solution else None
        allowed = f"{name} has no {quantity}" if name else "reference.solution names none"
        raise InputError(self.path, key_path(keys), EXACT.value, allowed)

    def given(self, *keys: str | int) -> Any:
        """The content of a key."""
        value: Any = self.content
        for key in keys:
            value = value[key]
        return value

    def value(self, *keys: str | int) -> Any:
        """The number, expression, tuple or mapping of them that a key holds."""
        value = self.given(*keys)
        if isinstance(value, list):
            return tuple(self.value(*keys, i) for i in range(len(value)))
        if isinstance(value, dict):
            return {key: self.value(*keys, key) for key in value}
        if isinstance(value, str):
            around = self.file.plane == "axisymmetric"
            return Expression(value, str(self.path), key_path(keys), axisymmetric=around)
        return float(value)


def _rigid(body: BodyKeys) -> Rigid:
    return Rigid(
        surface=body.surface,
        values=structs.asdict(getattr(body, body.surface)) if body.surface else {},
        reference=body.reference,
        move={str(key): value for key, value in (body.move or {}).items()},
        force={str(key): value for key, value in (body.force or {}).items()},
        name=body.name or "",
    )


def _only(values: Iterable[Any]) -> float | None:
    """The only number among the values; None if there is no number, or any other value."""
    different = {value for value in values if value is not None}
    value = different.pop() if len(different) == 1 else None
    return float(value) if isinstance(value, int | float) else None


def _shown(x: float) -> str:
    """A number in few digits, or in all where few are another number."""
    short = f"{x:g}"
    return short if float(short) == x else repr(x)
