"""A row of options as a case, on its mesh; see `state`."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from solver.case.model import Case
from solver.case.reader import parse_case
from solver.mesh.transforms import transform

from .options import BARE, RIGID, Row
from .places import Places
from .reference import references
from .state import AXES, GAP, MU, STRAIN, Body, Placed

# The factor of the last step, where there are several.
_LAST = 0.4
_STEPS: dict[str, dict[str, Any]] = {
    "factors": {"steps": [_LAST / 2, _LAST]},
    "unloaded": {"steps": [_LAST, 0.0]},
    "substeps": {"steps": [_LAST], "substeps": 3},
    "path": {"steps": [{"go": _LAST}, {"go": _LAST / 2}, {"go": _LAST}]},
    "slip back": {"steps": [{"press": 1, "shear": -1}, {"press": 1, "shear": 1}]},
}
_FORMS: dict[str, dict[str, Any]] = {
    "renumbered": {"transform": {"renumber": 3}},
    "perturbed": {"transform": {"perturb": 0.1}},
    "other units": {"units": {"length": "km", "stress": "GPa"}},
}
_MULTIPLIED = {
    *("fix", "move", "pressure", "traction", "force", "body_force", "strain", "temperature"),
}


@dataclass
class Problem:
    """A case on its mesh, as it is solved, and what must come out; `factor`: see `States`."""

    case: Case
    mesh: meshio.Mesh
    bodies: list[Body]
    placed: Placed
    text: dict[str, Any]
    open: bool
    factor: float


def problem_of(row: Row) -> Problem:
    """The problem of a complete row; InputError where the program refuses its case file."""
    return _Builder(row).problem()


def _multiply(text: dict[str, Any], factor: float) -> None:
    """Everything that a step multiplies, so that the last one has the state."""
    acting = [*text["supports"], *text.get("loads", []), *text.get("bodies", {}).values()]
    for one in acting:
        for key in _MULTIPLIED & one.keys():
            one[key] = _times(one[key], factor)


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, dict):
        return {key: _times(one, factor) for key, one in value.items()}
    if isinstance(value, list):
        return [_times(one, factor) for one in value]
    return f"{factor!r}*({value})" if isinstance(value, str) else factor * value


class _Builder(Places):
    def problem(self) -> Problem:
        """All of it."""
        text = self._text()
        case = parse_case(json.dumps(text), Path("pairs.yaml"))
        case, mesh = case.as_solved(swapped=self.row["form"] == "exchanged"), self.mesh()
        if case.mesh.transform:
            mesh = transform(mesh, case.mesh.transform, "pairs")
        return Problem(case, mesh, self.bodies, self.placed, text, self.open, self.factor)

    def _zone(self) -> dict[str, Any]:
        row = self.row
        zone: dict[str, Any] = {"name": "one", "slave": "lower-top", "master": "upper-under"}
        if row["master"] in BARE:
            zone["master"] = "wall"
        if row["friction"] != "none":
            zone["friction"] = MU
        for key in ("treatment", "normal", "hexahedra", "recovery"):
            zone[key] = row[key]
        if row["recovery"] == "5 sweeps":
            zone |= {"recovery": "linear", "sweeps": 5}
        if row["stabilised"] == "yes":
            zone["stabilised"] = True
        scaled = GAP * self.placed.scale
        if row["gap"] == "interference":
            zone["interference"] = scaled
        if row["gap"].startswith("clearance"):
            zone["clearance"] = scaled if row["gap"] != "clearance 0" else 0
        return zone

    def _second_zone(self) -> dict[str, Any]:
        kind, row = self.row["second zone"], self.row
        zone: dict[str, Any] = {"name": "two", "slave": "cap-under", "master": "upper-top"}
        if kind == "same":
            given = self._zone()
            kept = ("treatment", "normal", "hexahedra", "recovery", "sweeps", "stabilised")
            zone |= {key: given[key] for key in kept if key in given}
            if "friction" in given:
                zone["friction"] = 2 * MU
        elif kind == "friction":
            zone["friction"] = 2 * MU
        elif kind == "recovery":
            zone["recovery"] = "linear"
        elif kind == "stabilised":
            zone["stabilised"] = True
        elif kind == "nodal":
            zone["treatment"] = "nodal"
        if row["form"] == "exchanged":
            zone["slave"], zone["master"] = zone["master"], zone["slave"]
        return zone

    def _text(self) -> dict[str, Any]:
        row = self.row
        self.named = {"name": "go"} if row["steps"] == "path" else {}
        self._act()
        text: dict[str, Any] = {
            "name": "pairs",
            "mesh": self.recipe(),
            "groups": self.groups(),
            "materials": {b.name: self._material(b) for b in self.bodies},
            "supports": self.supports,
            "loads": self.loads,
            "contact": [self._zone()] + [self._second_zone()] * self.second,
        }
        if self.dim == 2:
            text["plane"] = row["space"]
        if row["master"] in RIGID:
            text["bodies"] = self._rigid()
        if row["motion"] == "large":
            text["motion"] = "large"
        text |= _FORMS.get(row["form"], {})
        if row["steps"] != "one":
            _multiply(text, 1 / _LAST)
        text |= references(self)
        return text | _STEPS.get(row["friction"], _STEPS.get(row["steps"], {}))

    def _material(self, body: Body) -> dict[str, Any]:
        material: dict[str, Any] = {"young": body.young, "poisson": body.poisson}
        if self.row["materials"] == "mixed form" and not body.rigid:
            material["form"] = "mixed"
        return material

    def _act(self) -> None:
        """Supports and loads."""
        self.supports: list[dict[str, Any]] = []
        self.loads: list[dict[str, Any]] = []
        self._impose("lower-base", self.bodies[0], range(self.dim))
        for body in self.bodies:
            if not body.rigid:
                self._sides(body)
        last = self.bodies[-1]
        if not last.rigid and last.name != "lower":
            self._far_end(last)
        if self.open:
            self._press(self.bodies[0], "lower-top", 1.0)
            for body in self.bodies[1:2]:
                self._press(body, "upper-under", -1.0)
        self._also()

    def _press(self, body: Body, group: str, side: float) -> None:
        """What contact would do to a flat face of a body."""
        if not body.rigid:
            traction = side * body.stress[: self.dim, : self.dim] @ self._up()
            self._load(group, "traction", self.placed.vector(traction))

    def _impose(self, group: str, body: Body, axes: Iterable[int]) -> None:
        """Displacements of the state; in a path of shear, those along it have its factor."""
        values = {
            AXES[a]: self.placed.affine(self.placed.turn[a], body.gradient, body.shift)
            for a in axes
        }
        if self.row["friction"] != "slip back":
            self._support(group, values, self.named)
            return
        for axis, value in values.items():
            self._support(group, {axis: value}, {"name": "shear" if axis == "x" else "press"})

    def _support(self, group: str, values: dict[str, str], named: dict[str, str]) -> None:
        """One that is fixed at zero has no factor."""
        if all(value in ("0.0", "-0.0") for value in values.values()):
            self.supports.append({"group": group, "fix": dict.fromkeys(values, 0.0)})
        else:
            self.supports.append({"group": group, "fix": values, **named})

    def _load(self, group: str, kind: str, value: Any, **more: Any) -> None:
        self.loads.append({"group": group, kind: value, **(self.named | more)})

    def _sides(self, body: Body) -> None:
        """Tractions on the sides; of the upper bodies one may be held along its normal instead."""
        held = body.name != "lower" and self.row["supports"] == "normal"
        held |= body.name == "upper" and self.second and self.row["supports"] != "cyclic"
        for axis in range(self.dim - 1):
            outward = np.eye(self.dim)[axis]
            zero, one = f"{body.name}-{AXES[axis]}0", f"{body.name}-{AXES[axis]}1"
            if axis == 0 and self.row["supports"] == "cyclic":
                shift = [self.placed.scale * v for v in self.placed.vector(outward)]
                self.supports.append({"group": one, "cyclic": {"of": zero, "shift": shift}})
            elif self.row["friction"] == "slip back":
                self._pulled_back(body, zero, -outward)
                self._pulled_back(body, one, outward)
            else:
                self._pulled(body, zero, -outward, held)
                self._pulled(body, one, outward, False)

    def _pulled(self, body: Body, group: str, outward: np.ndarray, held: bool) -> None:
        """A side under its traction, or `held` along its normal and under the rest."""
        traction = body.stress[: self.dim, : self.dim] @ outward
        if held:
            value = self.placed.affine(outward, body.gradient, body.shift)
            self._support(group, {"normal": value}, self.named)
            traction = traction - outward * (outward @ traction)
        if traction.any():
            self._load(group, "traction", self.placed.vector(traction))

    def _pulled_back(self, body: Body, group: str, outward: np.ndarray) -> None:
        """What presses a side, and the force of the shear along it, each with its factor."""
        traction = body.stress[: self.dim, : self.dim] @ outward
        pressed = outward * (outward @ traction)
        self._load(group, "traction", self.placed.vector(pressed), name="press")
        if (shear := traction - pressed).any():
            force = [self.area * v for v in self.placed.vector(shear)]
            self._load(group, "force", force, name="shear")

    def _far_end(self, body: Body) -> None:
        """The end of the last body: displacements, or a load and what holds it along."""
        row, group, up = self.row, f"{body.name}-top", self._up()
        traction = body.stress[: self.dim, : self.dim] @ up
        if row["supports"] == "imposed" or (
            row["supports"] == "cyclic" and row["form"] == "rotated"
        ):
            self._impose(group, body, range(self.dim))
            return
        if row["supports"] == "springs":
            self._springs(body, group, traction)
            return
        if row["supports"] in ("together", "cyclic"):
            self._impose(group, body, range(self.dim - 1))
        if row["supports"] == "together":
            self.supports.append({"group": group, "together": [AXES[self.dim - 1]]})
        along = traction - up * (up @ traction)
        if row["load"] == "force":
            force = [self.area * v for v in self.placed.vector(traction)]
            self._load(group, "force", force)
        elif row["load"] == "pressure" and np.abs(along).max() <= 1e-12 * np.abs(traction).max():
            self._load(group, "pressure", -float(up @ traction))
        else:
            self._load(group, "traction", self.placed.vector(traction))

    @property
    def area(self) -> float:
        """Of the end of a body."""
        if self.axisymmetric:
            return np.pi * ((self.start + 1) ** 2 - self.start**2) * self.placed.scale**2
        return self.placed.scale ** (self.dim - 1)

    def _springs(self, body: Body, group: str, traction: np.ndarray) -> None:
        """Springs, and a load that has their pull in it."""
        stiffness = 50.0 * self.unit / self.placed.scale
        axes = range(self.dim)
        self.supports.append({"group": group, "spring": {AXES[a]: stiffness for a in axes}})
        turned, values = self.placed.turn, []
        for a in axes:
            pull = self.placed.affine(turned[a] * stiffness, body.gradient, body.shift)
            values.append(f"{float(turned[a] @ traction)!r} + {pull}")
        self._load(group, "traction", values)

    def _also(self) -> None:
        """Initial strain, and body forces that cancel."""
        for body in self.bodies:
            if body.rigid or not np.any(np.abs(body.strain) > 1e-15):
                continue
            if self.row["also"] == "temperature":
                self._load(body.name, "temperature", 100.0, expansion=STRAIN / 100)
                continue
            assert np.ptp(np.diag(body.strain)) < 1e-15  # the same in all directions
            values = dict(zip(("xx", "yy", "zz"), np.diag(body.strain).tolist(), strict=False))
            self._load(body.name, "strain", values)
        if self.row["also"] == "body force":
            named = {"name": "press"} if self.row["friction"] == "slip back" else {}
            value = [3.0 * self.unit / self.placed.scale] * self.dim
            self._load("lower", "body_force", value, **named)
            self._load("lower-again", "body_force", [-v for v in value], **named)

    def _rigid(self) -> dict[str, Any]:
        row, body = self.row, dict[str, Any]()
        surface = {
            "point": self.placed.point(self.apart),
            "normal": self.placed.vector(-self.normal),
        }
        if row["master"] == "plane":
            body["plane"] = surface
        elif row["master"] == "parabola":  # of the slope 0.4 (1 - 2 x), its apex at x = 0.5
            surface["point"] = self.placed.point(np.array([0.5, 0.1]))
            radius = self.placed.scale / 0.8
            body["parabola"] = surface | {"radius": radius, "hollow": True}
        else:
            body["rigid"] = True
        move = self.placed.scale * self.placed.turn @ self.moved
        axes = [self.dim - 1] if self.axisymmetric else range(self.dim)
        motion = {AXES[a]: float(move[a]) for a in axes if move[a]}
        if row["master"] == "rigid, by force":
            a = self.dim - 1
            motion.pop(AXES[a], None)
            body["force"] = {AXES[a]: self._push()[a]}
        if motion:
            body["move"] = motion
        if motion or "force" in body:
            body |= self.named
        return {"wall" if row["master"] in BARE else "upper": body}

    def _push(self) -> list[float]:
        """The force on the rigid body in zone one, less that of zone two."""
        lower = self.bodies[0]
        area_of = self.normal / self.normal[-1]
        force = lower.stress[: self.dim, : self.dim] @ area_of
        if self.second:
            force = force - self.bodies[-1].stress[: self.dim, : self.dim] @ self._up()
        return [self.area * v for v in self.placed.vector(force)]
