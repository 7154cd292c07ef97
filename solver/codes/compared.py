"""A foreign result beside its case: what is given, sampled for the checks of our own solves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..case.checks import CHECKS, ERRORS, Check
from ..case.expressions import evaluate
from ..mechanics.fem.stress import COMPONENTS, normal_stress
from ..simulation.results.exact import ExactValues
from ..simulation.results.records import Quality
from ..simulation.results.solution import Solution, ZoneResult
from ..system.errors import InputError
from ..verification import samples
from ..verification.norms import errors, largest_error
from ..verification.samples import Reference, Sample
from ..verification.verdict import CheckResult
from .contact import SurfaceValues, own_solution, pressure_force, surfaces
from .faults import fault, summed_up
from .model import Model
from .path import at_last_position
from .placing import Placed, Placer, flattened, without_rigid_surfaces

if TYPE_CHECKING:
    import meshio

    from ..case.model import Case
    from .foreign import ForeignResult

# Forces agree within this share: between nodes a pressure is interpolated.
FORCES = 0.05
_STEP = 1e-6
# Normals with smaller components have none along that axis.
_NO_PART = 1e-9


CHECKED_BY = {
    "displacement": ("displacement", "displacement_l2", "displacement_h1"),
    "stress": (
        *("nodal_stress", "stress_components", "surface_stress_slave", "surface_stress_master"),
        *("stress_max", "stress_l2"),
    ),
    "pressure": (
        *("multiplier", "pressure_l2", "pressure_max", "pressure_means", "pressure_total"),
        *("pressure_oscillation", "pressure_inner", "half_width", "peak"),
    ),
    "gap": ("element_gap",),
}
"""The checks that compare each field."""


@dataclass(frozen=True)
class Compared:
    """A result placed on the model of its case; `placed` holds its fields by name."""

    model: Model
    foreign: ForeignResult
    placed: dict[str, Placed]
    pressures_by_zone: list[SurfaceValues]
    gaps_by_zone: list[SurfaceValues]
    own: Solution | None = None

    @classmethod
    def of(cls, case: Case, foreign: ForeignResult, mesh: meshio.Mesh) -> Compared:
        """The comparison; raises InputError where result and case do not belong together."""
        where = f"{case.name}@{foreign.code}"
        if foreign.step is not None and abs(foreign.step - case.factors[-1]) > _STEP:
            allowed = f"the result must belong to load factor {case.factors[-1]:g}"
            raise InputError(where, "step", foreign.step, allowed)
        foreign = flattened(foreign, mesh.points.shape[1], where, case.thin)
        model = Model.of(case, mesh)
        foreign = without_rigid_surfaces(foreign, model)
        placer = Placer(model, foreign, where)
        names = ("displacement", "stress", "pressure", "gap")
        fields = {n: f for n in names if (f := getattr(foreign, n)) is not None}
        if not fields and not foreign.forces:
            raise InputError(where, "fields", None, "the result gives nothing to check")
        placed = {name: placer.place(field, name) for name, field in fields.items()}
        if case.moving:
            return cls.of(*at_last_position(placer, placed))
        pressures, gaps = (
            surfaces(model, placed[name], placer.sides(placed[name]), where, name)
            if name in placed
            else []
            for name in ("pressure", "gap")
        )
        own, elsewhere = None, any((p.node < 0).any() for p in placed.values() if p.own is not None)
        if foreign.mesh is not None and elsewhere:
            own = own_solution(model, foreign.mesh, placer.body, placed, pressures)
        return cls(model, foreign, placed, pressures, gaps, own)

    @cached_property
    def solution(self) -> Solution:
        """A solution of the case with all values that are known everywhere on its mesh."""
        frame, count = self.model.solution, len(self.model.points)
        needed = ~self.model.rigid[self.model.body]
        known: dict[str, Any] = {}
        for name in ("displacement", "stress"):
            values = self.placed[name].nodal(count) if name in self.placed else None
            if values is not None and np.isfinite(values[needed]).all():
                known[name] = np.where(np.isfinite(values), values, 0.0)
        if (stress := known.get("stress")) is not None:
            normal = normal_stress(stress, self.model.direction)
            known["fields"] = replace(frame.fields, normal_stress=normal)
        by_zone = {surface.zone.name: surface.zone for surface in self.pressures_by_zone}
        zones = [by_zone.get(zone.name, zone) for zone in frame.zones]
        quality = Quality(balance=self._balance())
        solution = replace(frame, zones=zones, quality=quality, **known)
        solution.quality.errors = self._norms(solution)
        return solution

    def _norms(self, solution: Solution) -> dict[str, float]:
        """Errors against the exact solution, those that the result gives enough for."""
        found: dict[str, float] = {}
        for each in filter(None, (solution, self.own)):
            known = [bool(np.isfinite(zone.multiplier).all()) for zone in each.zones]
            whole = all(known) and len(known) == len(self.model.case.zones)
            of_each = errors(each if whole else replace(each, zones=[]))
            found |= {name: value for name, value in of_each.items() if np.isfinite(value)}
        found |= self._largest_of_stress() if "stress_max" not in found else {}
        means = any(surface.kind == "face" for surface in self.pressures_by_zone)
        more = any(zone.recovery != "none" for zone in self.model.case.zones)
        more |= any(zone.operator.nodes is not None for zone in self.model.scene.zones)
        if means and more:
            # The case asks for more than means, which the result does not give.
            found = {n: v for n, v in found.items() if n not in ("pressure_l2", "pressure_max")}
        return found

    def _largest_of_stress(self) -> dict[str, float]:
        """The error of the stress at its places, where it is not at all nodes: at vertices, say.

        Places where bodies touch are left out: the stress of two materials differs there.
        """
        exact = self.model.case.reference.exact
        if exact is None or "stress" not in exact.quantities or "stress" not in self.placed:
            return {}
        placed = self._deformable("stress")
        placed = placed.at(placed.body >= 0)
        if placed.cells is not None or not len(placed.places):
            return {}
        wanted = exact.stress(placed.places, self._part(placed))
        return {"stress_max": largest_error(placed.values, wanted)}

    def _balance(self) -> dict[str, float]:
        """How far contact forces are from what balances the loads, relative, by zone."""
        found = {}
        for scene, frame in zip(self.model.scene.zones, self.model.solution.zones, strict=True):
            wanted, scale = self.model.contact_force(scene)
            force = self._force(frame)
            if force is None or not scale > 0:
                continue
            if scene.zone.friction and frame.name not in self.foreign.forces:
                force, wanted = _along_normal(frame, force, wanted)
            known = np.isfinite(wanted)
            if known.any():
                off = np.abs(force[known] - wanted[known]).max()
                self._forces.append((force[known], wanted[known]))
                found[f"zone {frame.name}: force"] = float(off / scale)
        return found

    def _force(self, zone: ZoneResult) -> np.ndarray | None:
        if zone.name in self.foreign.forces:
            return np.asarray(self.foreign.forces[zone.name], dtype=float)[: self.model.dim]
        surface = next((s for s in self.pressures_by_zone if s.zone.name == zone.name), None)
        mine = [own for own in (self.own.zones if self.own else ()) if own.name == zone.name]
        if mine and self.own is not None:
            around = self.model.case.axisymmetric
            return pressure_force(self.own.mesh.points, mine[0], around)
        return None if surface is None else surface.force(self.model)

    # What the checks sample

    @cached_property
    def _samples(self) -> dict[str, tuple[Sample, tuple[str, ...]]]:
        """The samples that the checks took, with the names of their components."""
        return {}

    @cached_property
    def _forces(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Contact forces by zone, and those that balance the loads."""
        return []

    @cached_property
    def samplers(self) -> dict[str, samples.Sampler]:
        """Sampler of each check; checks without data are omitted."""
        found: dict[str, samples.Sampler] = {}
        if "displacement" in self.placed:
            found["displacement"] = self._components("displacement", "xyz"[: self.model.dim])
        if "stress" in self.placed:
            found |= {
                "nodal_stress": self._nodal_stress,
                "stress_components": self._components("stress", COMPONENTS),
                "surface_stress_slave": self._surface_stress("slave"),
                "surface_stress_master": self._surface_stress("master"),
            }
        for name, quantity, given in (
            ("multiplier", "pressure", self.pressures_by_zone),
            ("element_gap", "gap", self.gaps_by_zone),
        ):
            if given:
                found[name] = self._of_surfaces(quantity, given)
        if self.solution.quality.balance:
            found["balance"] = samples.balance
        wanted = self.solution.quality.errors.keys() & ERRORS.keys()
        found |= {name: samples.norm(name) for name in sorted(wanted)}
        return {name: self._kept(name, sampler) for name, sampler in found.items()}

    def _kept(self, name: str, sampler: samples.Sampler) -> samples.Sampler:
        def sample(solution: Solution, zone: Any, reference: Reference) -> Sample | None:
            taken = sampler(solution, zone, reference)
            if taken is not None and len(taken.values):
                places = self.placed.get(name.removesuffix("_components"))
                count = len(taken.values) // len(places.places) if places else 1
                names = tuple("xyz"[:count])
                if name == "stress_components":
                    given = reference if isinstance(reference, dict) else COMPONENTS
                    names = tuple(given)
                self._samples[name] = taken, names if count > 1 else ()
            return taken

        return sample

    def _deformable(self, name: str) -> Placed:
        placed = self.placed[name]
        rigid = np.append(self.model.rigid, False)  # the body -1 is unknown
        return placed.at(~rigid[placed.body])

    def _part(self, placed: Placed) -> Any:
        """The part of the exact solution at places; None, by place, where a body is not known."""
        known = placed.body >= 0
        exact = self.model.case.reference.exact
        if exact is None or known.all():
            return self.model.part[placed.body]
        by_place = np.array(exact.part_of(placed.places, None))
        return np.where(known, self.model.part[placed.body], by_place)

    def _components(self, field: str, names: Sequence[str]) -> samples.Sampler:
        """Samples a field that the exact solution has under the same name, all components."""

        def sample(_: Solution, __: None, reference: Reference) -> Sample:
            placed = self._deformable(field)
            return samples.by_component(
                placed.values,
                placed.places,
                names,
                reference,
                lambda: getattr(reference.exact, field)(placed.places, self._part(placed)),
                _place(placed),
            )

        return sample

    def _along(self, placed: Placed, directions: np.ndarray, reference: Reference) -> Sample:
        """Stress along directions (dim,) or (k, dim) beside the reference's."""
        if isinstance(reference, ExactValues):
            field = reference.exact.stress(placed.places, self._part(placed))
            expected = normal_stress(field, directions)
        else:
            expected = evaluate(reference, placed.places)
        return Sample(normal_stress(placed.values, directions), expected, _place(placed))

    def _nodal_stress(self, _: Solution, __: None, reference: Reference) -> Sample:
        return self._along(self._deformable("stress"), self.model.direction, reference)

    def _surface_stress(self, side: str) -> samples.Sampler:
        def sample(_: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
            placed = self._deformable("stress")
            placed = placed.at(np.isin(placed.node, getattr(zone.surfaces, f"{side}_nodes")))
            if not len(placed.places):
                return None
            normals = self.model.normals(zone, side)[placed.node]
            return self._along(placed, normals, reference)

        return sample

    @staticmethod
    def _of_surfaces(quantity: str, given: Sequence[SurfaceValues]) -> samples.Sampler:
        def sample(_: Solution, zone: ZoneResult, reference: Reference) -> Sample | None:
            mine = next((s for s in given if s.zone.name == zone.name), None)
            return None if mine is None else mine.sample(reference, quantity)

        return sample

    # What the verdict says

    @staticmethod
    def tolerance(check: Check, own: float) -> float:
        """The tolerance of a check for another code.

        A case may ask more than the defaults, where that is what our method reaches; other codes
        are held to the defaults.
        """
        if check.name == "balance":
            return FORCES
        return max(own, check.tolerance_in({}))

    def faults(self, failed: Sequence[CheckResult]) -> str:
        """What may be wrong, by the checks that failed; empty where nothing simple is."""
        found = {}
        for check in failed:
            sample, names = self._samples.get(check.name, (None, ()))
            if check.name == "balance":
                forces, wanted = (np.concatenate(each) for each in zip(*self._forces, strict=True))
                sample = Sample(forces, wanted, "zone {}".format)
            if sample is not None and (cause := fault(sample, names)):
                found[check.name] = cause
        return summed_up(found)

    def not_given(self, ran: Sequence[str]) -> list[str]:
        """The checks that the case asks for, and the result has no values for."""
        case = self.model.case
        asked = [
            check.name
            for check in CHECKS
            if check.concerns(case)
            and (
                (check.key in case.reference.values if check.key else check.name == "balance")
                or (check.norm == "error" and check.name in case.reference.tolerance)
            )
        ]
        observed = not case.observe
        return [n for n in asked if n not in ran and not (observed and n.startswith("observ"))]

    def unchecked(self, ran: Sequence[str]) -> list[str]:
        """The fields that are given, and that no check of the case compares."""
        compare = {name: {*checks} for name, checks in CHECKED_BY.items()}
        compare["pressure"].add("balance")
        return [name for name in self.placed if not compare[name] & {*ran}]

    def extremes(self, name: str) -> list[float | None] | None:
        """Minimum and maximum of a quantity, over all places; None where it is not given."""
        if name == "normal_stress":
            if "stress" not in self.placed:
                return None
            values = normal_stress(self._deformable("stress").values, self.model.direction)
        else:
            given = self.pressures_by_zone if name == "pressure" else self.gaps_by_zone
            if not given:
                return None
            values = np.concatenate([surface.placed.values for surface in given])
        return [float(values.min()), float(values.max())]

    def pressures(self) -> np.ndarray | None:
        """Place and pressure (k, dim + 1) on all slave surfaces; None where it is not given."""
        if not self.pressures_by_zone:
            return None
        return np.concatenate(
            [np.column_stack([s.placed.places, s.placed.values]) for s in self.pressures_by_zone]
        )


def _along_normal(
    zone: ZoneResult, force: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The parts (1,) of forces (dim,) that pressures tell where there is friction.

    NaN where the surface is bent, or the wanted force along its normal is not known.
    """
    if not zone.flat:
        return np.full(1, np.nan), np.full(1, np.nan)
    normal = zone.normal[0]
    mine = np.abs(normal) > _NO_PART
    return np.array([normal[mine] @ force[mine]]), np.array([normal[mine] @ wanted[mine]])


def _place(placed: Placed) -> Callable[[int], str]:
    def name_of(i: int) -> str:
        if placed.node[i] >= 0:
            return f"node {placed.node[i]}"
        return f"({', '.join(f'{x:.6g}' for x in placed.places[i])})"

    return name_of
