"""The case file read: its text becomes a `Case`, or is refused with one line.

`solver.case.rules` checks what concerns several keys, `solver.simulation.groups` what needs the
mesh.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from solver.case.expressions import Expression
from solver.case.material import Material
from solver.case.model import EXACT, LOAD_KINDS, Case, Load, Observation, Support, Zone
from solver.case.rules import check_rules
from solver.case.schemas import CASE_SCHEMA, validate
from solver.case.yaml import parse_mapping, read_text
from solver.system.errors import InputError, key_path
from solver.system.files import is_file

if TYPE_CHECKING:
    from solver.case.solutions import ExactSolution

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


def load_case(path: str | Path) -> Case:
    """The case in a file; `InputError` names the file, the key, the value and what is allowed."""
    path = Path(path)
    return parse_case(read_text(path), path)


def parse_case(text: str, path: Path) -> Case:
    """The case in a text; `path` serves its family, its relative paths and the messages."""
    content = parse_mapping(text, path)
    validate(content, CASE_SCHEMA, path)
    case = _Reader(path, content).case(text)
    check_rules(case)
    return case


def check_mesh_file(case: Case) -> None:
    """Raise `InputError` where the case names a mesh file that is not there."""
    path = case.mesh.get("path")
    if path and not is_file(path):
        raise InputError(case.path, "mesh.file", str(path), "no such file")


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
