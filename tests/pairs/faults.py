"""Faults at crossings of options: each option alone stays exact under them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from solver.mechanics.linear import systems
from solver.mechanics.mortar.coulomb import CoulombContact
from solver.simulation.scene import operators
from solver.simulation.scene.parts import strain
from solver.simulation.scene.parts.springs import Springs
from solver.simulation.scene.parts.strain import StrainFields
from solver.simulation.scene.scene import Scene


@dataclass(frozen=True)
class Fault:
    """`what` is wrong where `options` meet; `patch` makes `name` of `owner` faulty."""

    name: str
    what: str
    options: Mapping[str, str]
    owner: Any
    attribute: str
    patch: Callable[[Any], Any]
    space: str = "strain"

    def plant(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Plant it."""
        true = getattr(self.owner, self.attribute)
        monkeypatch.setattr(self.owner, self.attribute, self.patch(true))


def _sorted_rows(true: Any) -> Any:
    def init(self: Any, *given: Any) -> None:
        *others, rows = given
        true(self, *others, np.sort(rows, axis=None).reshape(rows.shape))

    return init


def _turned_when_exchanged(true: Any) -> Any:
    def gaps(zone: Any, operator: Any, groups: Any, *more: Any) -> np.ndarray:
        twice = 2 * zone.interference * operator.covered
        return true(zone, operator, groups, *more) + groups.case.swapped * twice

    return gaps


def _springs_at_full_load(true: Any) -> Any:
    def acting(self: Scene, step: Any) -> Any:
        force, offset = true(self, step)
        loose = any(isinstance(part, Springs) for part in self.parts)
        loose = loose and not isinstance(step, dict)
        return (self.force if loose else force), offset

    return acting


def _strain_without_name(true: Any) -> Any:
    def factors(self: StrainFields, step: Any) -> np.ndarray:
        return true(self, 1.0 if isinstance(step, dict) else step)

    return factors


def _no_hoop_strain(true: Any) -> Any:
    def strain(case: Any, *more: Any) -> np.ndarray:
        found = true(case, *more)
        found[:, 2] *= not case.axisymmetric
        return found

    return strain


def _interference_lost_with_rigid(true: Any) -> Any:
    def gaps(zone: Any, operator: Any, groups: Any, *more: Any) -> np.ndarray:
        lost = zone.interference * operator.covered * bool(groups.case.rigid)
        return true(zone, operator, groups, *more) + lost

    return gaps


FAULTS = (
    Fault(
        "rigid-diagonal",
        "unknowns of rigid bodies have no stiffness to divide by",
        {"treatment": "nodal", "master": "rigid, by force"},
        systems,
        "_compliance",
        lambda _: np.errstate(divide="ignore")(lambda matrix: 1 / matrix.diagonal()),
    ),
    Fault(
        "rows-of-two-zones",
        "tangents of two zones with friction exchanged in space",
        {"friction": "slip", "second zone": "friction"},
        CoulombContact,
        "__init__",
        _sorted_rows,
        "solid",
    ),
    Fault(
        "interference-exchanged",
        "an interference is a gap where slave and master are exchanged",
        {"gap": "interference", "form": "exchanged"},
        operators,
        "_initial_gaps",
        _turned_when_exchanged,
    ),
    Fault(
        "springs-at-full-load",
        "load factors do not reach loads beside springs",
        {"supports": "springs", "steps": "factors"},
        Scene,
        "acting",
        _springs_at_full_load,
    ),
    Fault(
        "strain-without-name",
        "initial strain has no factor in a step of names",
        {"also": "strain", "steps": "path"},
        StrainFields,
        "factors",
        _strain_without_name,
    ),
    Fault(
        "hoop-strain",
        "initial strain has no part around the axis",
        {"space": "axisymmetric", "also": "strain"},
        strain,
        "strain_at",
        _no_hoop_strain,
    ),
    Fault(
        "interference-lost",
        "a rigid body beside an interference loses it",
        {"gap": "interference", "master": "rigid"},
        operators,
        "_initial_gaps",
        _interference_lost_with_rigid,
    ),
)
