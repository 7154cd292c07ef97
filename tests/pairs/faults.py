"""Faults at crossings of options: each option alone stays exact under them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from solver.mechanics.linear import systems
from solver.mechanics.linear.compliant import Compliance
from solver.mechanics.mortar.coulomb import CoulombContact
from solver.simulation.equilibrium import problem
from solver.simulation.judgement import validity
from solver.simulation.results import results
from solver.simulation.results.friction import zone_friction
from solver.simulation.scene import contact_frames, operators
from solver.simulation.scene.parts import strain
from solver.simulation.scene.parts.springs import Springs
from solver.simulation.scene.parts.strain import StrainFields
from solver.simulation.scene.scene import Scene
from solver.verification import numbers, samples
from tests.pairs.options import plain_in


@dataclass(frozen=True)
class Fault:
    """`what` is wrong where `options` meet; `patch` makes `name` of `owner` faulty.

    `cells` of both sides, where it takes others than the plain ones; `ends`: what comes of it.
    """

    name: str
    what: str
    options: Mapping[str, str]
    owner: Any
    attribute: str
    patch: Callable[[Any], Any]
    space: str = "strain"
    cells: str = ""
    ends: str = "wrong"

    @property
    def plain(self) -> dict[str, str]:
        """The plain row that the options are set in."""
        row = plain_in(self.space)
        return row | dict.fromkeys(
            ("slave cells", "master cells"), self.cells or row["slave cells"]
        )

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
        return true(zone, operator, groups, *more) + groups.case.solved_as.swapped * twice

    return gaps


def _springs_at_full_load(true: Any) -> Any:
    def acting(self: Scene, step: Any) -> Any:
        force, offset = true(self, step)
        loose = any(isinstance(part, Springs) for part in self.parts)
        loose = loose and not isinstance(step, dict)
        return (self.loads.force if loose else force), offset

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


def _normalised_one_by_one(_: Any) -> Any:
    def frames(rows: np.ndarray) -> np.ndarray:
        turned = np.swapaxes(rows, 1, 2)
        return turned / np.linalg.norm(turned, axis=1, keepdims=True)

    return frames


def _slips_of_all(true: Any) -> Any:
    def result(scene: Any, zone: Any, state: Any, *more: Any) -> Any:
        found = true(scene, zone, state, *more)
        friction = state.friction and zone_friction(zone, state)
        return replace(found, friction=friction)

    return result


def _pressures_among_forces(true: Any) -> Any:
    def compliance(scene: Scene, *more: Any) -> Compliance:
        found, area = true(scene, *more), scene.zones[0].operator.area.mean()
        return Compliance(found.scatter / area**2, found.weight * area**4)

    return compliance


FAULTS = (
    Fault(
        "frames-of-nodes",
        "frames of nodes whose directions are normalised one by one",
        {"interface": "curved", "friction": "held"},
        contact_frames,
        "_orthonormal",
        _normalised_one_by_one,
        "solid",
        "TETRA10",
        "refused",
    ),
    Fault(
        "slips-of-all-zones",
        "slips are looked for in a zone without friction",
        {"friction": "held", "second zone": "plain"},
        results,
        "_zone_result",
        _slips_of_all,
    ),
    Fault(
        "overlap-of-a-clearance",
        "only the last zone's clearance lets its meshes overlap",
        {"gap": "clearance, overlap", "second zone": "plain"},
        validity,
        "_apart",
        lambda true: lambda scene: true(replace(scene, zones=scene.zones[-1:])),
    ),
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
    Fault(
        "pressures-among-forces",
        "what scatters is rounded in a unit that depends on the area, beside forces",
        {"stabilised": "yes", "form": "other units"},
        problem,
        "compliance_of",
        _pressures_among_forces,
        "solid",
    ),
    Fault(
        "steps-across-a-gap",
        "pressure is assumed to grow with the load factor even where the surfaces start apart",
        {"gap": "interference", "steps": "factors"},
        samples,
        "_apart",
        lambda true: lambda solution: False,
    ),
    Fault(
        "positions-under-other-loads",
        "the pressure at every position is compared with the last one, whatever the loads",
        {"motion": "large", "steps": "factors"},
        numbers,
        "_as_in_the_last",
        lambda true: lambda *given: True,
    ),
    Fault(
        "layers-are-bodies",
        "the cells behind the faces of a rigid surface count where bodies lie in one another",
        {"master": "faces", "interface": "curved", "also": "strain"},
        validity,
        "meshed",
        lambda true: lambda scene: scene.mesh.cells,
        "solid",
        "PENTA15",
    ),
)
