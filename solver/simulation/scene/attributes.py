"""Materials, supports, loads and initial strains of a case on the groups of the cut mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...case.acting import Load
from ...case.expressions import Exact
from ...case.material import Material
from ...case.solutions.base import ExactSolution
from ...lac.cells.catalogue import BY_NAME
from ...lac.cells.faces import FaceBlock
from ...lac.cells.shape import has_straight_edges
from ...mechanics.fem.block import Block
from ...mechanics.fem.elasticity import lame_parameters
from ...mechanics.fem.loads import body_forces, face_forces, stress_forces
from ...mechanics.fem.supports import (
    Fixed,
    FreeMotion,
    LinkError,
    SupportClashError,
    free_motion,
)
from ...system.errors import InputError
from .cut_groups import CutGroups
from .groups import ALL
from .holdings import holdings_of
from .holdings.frame import Frame
from .holdings.holding import Holding

if TYPE_CHECKING:
    from ...mechanics.mortar.quadric import Quadric


class Attributes(CutGroups):
    """What the case gives the groups: materials, supports and loads."""

    def by_part(self, nodes: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Cells or faces (n, n_nodes) by the part of the exact solution in which they lie."""
        part = self.exact_part[nodes[:, 0]]
        for number in np.unique(part).tolist():
            yield number, nodes[part == number]

    def elasticity(self, plain: bool = True) -> list[Block]:
        """Cells with their materials.

        Cells of rigid bodies, which need no material, get a unit one; they are left out where the
        body moves. `plain`: cells with straight edges have plain quadrature.
        """
        young = self.by_material(lambda m: m.young, 1.0)
        poisson = self.by_material(lambda m: m.poisson, 0.0)
        moving = [holding.moving for holding in self.holdings if holding.moving is not None]
        blocks = [
            Block(
                BY_NAME[name],
                cells,
                *lame_parameters(young[name], poisson[name]),
                plain and bool(has_straight_edges(BY_NAME[name], self.points[cells]).all()),
                self.axisymmetric,
                np.arange(len(cells)),
            )
            for name, cells in self.cut.cells.items()
        ]
        for nodes in moving:
            blocks = [block.of(~nodes[block.cells].all(axis=1)) for block in blocks]
        return [block for block in blocks if len(block.cells)]

    def by_material(
        self, value: Callable[[Material], float], otherwise: float
    ) -> dict[str, np.ndarray]:
        """A value of the material of each cell (n,) by type; a group's own goes before `all`.

        `otherwise`: of cells of rigid bodies.
        """
        start = value(self.case.materials[ALL]) if ALL in self.case.materials else otherwise
        values = {name: np.full(len(c), float(start)) for name, c in self.cut.cells.items()}
        for group, material in self._materials():
            for name, mask in self.cell_mask(group).items():
                values[name][mask] = otherwise if material is None else value(material)
        return values

    def _materials(self) -> Iterator[tuple[str, Material | None]]:
        """The groups with a material of their own, then the rigid bodies with cells, with none."""
        yield from ((group, m) for group, m in self.case.materials.items() if group != ALL)
        yield from ((name, None) for name, body in self.case.rigid.items() if not body.surface)

    def materials_behind(self, faces: Sequence[FaceBlock]) -> list[np.ndarray]:
        """A number (n,) of the material of the cell behind each face as meshed, by block.

        Equal materials have the same number, cells of rigid bodies −1.
        """
        materials = self.case.materials
        number = {material: i for i, material in enumerate(materials.values())}
        start = number[materials[ALL]] if ALL in materials else -1
        found = [np.full(len(block.owner), start) for block in faces]
        for group, material in self._materials():
            mask = self.whole_cell_mask(group)
            for values, block in zip(found, faces, strict=True):
                behind = mask[block.owner_type.name][block.owner]
                values[behind] = -1 if material is None else number[material]
        return found

    @property
    def at_rest(self) -> Attributes:
        """Those of the mesh as given."""
        return self

    @cached_property
    def kept(self) -> dict[str, Any]:
        """What parts make on this mesh once, by name: for bodies that move far."""
        return {}

    @property
    def motion(self) -> np.ndarray:
        """The displacement (n, dim) of the mesh from where it was given."""
        return np.zeros_like(self.points)

    def surface(self, name: str) -> Quadric | None:
        """The surface of a body, where it is a rigid one that the case gives."""
        if name not in self.case.rigid:
            return None
        from .holdings.rigid_surfaces import quadric_of

        return quadric_of(self.case, name, self.origin)

    @cached_property
    def holdings(self) -> list[Holding]:
        """What holds and joins the bodies."""
        return holdings_of(self)

    @property
    def joint(self) -> str:
        """What joins nodes, by the name of its reaction: the last link, as they share one."""
        return next((one.holder for one in self.holdings[::-1] if one.holder), "")

    def frames(self) -> dict[str, Frame]:
        """The rigid bodies by name."""
        return {name: f for holding in self.holdings for name, f in holding.frames.items()}

    def fixed(self, name: str | None = None) -> dict[str, Fixed]:
        """What holdings fix, by the key of the case file; without values of other names."""
        found: dict[str, Fixed] = {}
        for holding in self.holdings:
            found |= holding.fixed(found, name)
        return found

    def supports(self, name: str | None = None) -> FreeMotion:
        """The motion that holdings leave free, with the displacements imposed by all or a `name`.

        Raises InputError where two of them do not go together.
        """
        fixed = self.fixed(name)
        try:
            free = free_motion(len(self.points), self.points.shape[1], list(fixed.values()))
        except SupportClashError as clash:
            remark = "" if name is None else ", of another name in steps"
            if "plane" in fixed and name is None and len(fixed["plane"].nodes):
                remark = " (on the axis x is fixed)"
            key = list(fixed)[clash.number]
            raise InputError(self.case.path, key, clash.value, f"{clash}{remark}") from None
        for holding in self.holdings:
            try:
                free = holding.link(free)
            except LinkError as error:
                key = holding.keys[error.number]
                raise InputError(self.case.path, key, None, str(error)) from None
        return free

    def forces(self, name: str | None = None) -> np.ndarray:
        """Nodal forces (n, dim) of all loads, or those of a `name`, at load factor 1.

        Those of parts, such as initial strain, are not among them.
        """
        total = sum((holding.force(name) for holding in self.holdings), np.zeros_like(self.points))
        for i, load in enumerate(self.case.loads):
            if name in (None, load.name):
                total += self._force(load, f"loads[{i}].group")
        return total

    @cached_property
    def forces_of_loads(self) -> list[np.ndarray]:
        """Nodal forces (n, dim) of each load at load factor 1, kept: for bodies that move far."""
        return [self._force(load, f"loads[{i}].group") for i, load in enumerate(self.case.loads)]

    def histories(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Forces (n, dim) and displacements (n_dofs,) of each name in `steps`; of no name too."""
        if not self.case.histories:
            return {}
        if states := self.case.states:
            return {name: self._state(solution) for name, solution in states.items()}
        return {name: self._history(name) for name in ("", *self.case.histories)}

    def with_solution(self, solution: ExactSolution) -> Attributes:
        """The same with the fields of another exact solution."""
        case = self.case.with_exact(solution)
        return Attributes(case, self.mesh, self.cut, self.zones, self.origin).as_in(self)

    def _state(self, solution: ExactSolution) -> tuple[np.ndarray, np.ndarray]:
        then = self.with_solution(solution)
        return then.forces(), then.supports().offset

    def _history(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        return self.forces(name), self.supports(name).offset

    def _force(self, load: Load, key: str) -> np.ndarray:
        total = np.zeros_like(self.points)
        if isinstance(load.value, dict):
            return total  # see `initial`
        if load.kind == "force":
            return self._share(load, key)[:, None] * self.field(load.value)(self.points[:1])
        for name, nodes in self._loaded(load, key):
            if isinstance(load.value, Exact):
                for part, mine in self.by_part(nodes):
                    total += self._exact_force(load.kind, name, mine, part)
            elif load.kind == "body_force":
                field = self.field(load.value)
                total += body_forces(self.points, nodes, name, field, self.axisymmetric)
            else:
                pressure, field = load.kind == "pressure", self.field(load.value)
                total += face_forces(self.points, nodes, name, field, pressure, self.axisymmetric)
        return total

    def _share(self, load: Load, key: str) -> np.ndarray:
        """The share (n,) of a whole force that acts on each node; the sum is one."""
        share = np.zeros(len(self.points))
        if load.group in self.mesh.point_sets:
            nodes = np.asarray(self.mesh.point_sets[load.group], dtype=int)
            share[nodes] = 1 / len(nodes)
            return share
        along = self.field((1.0, *[0.0] * (self.points.shape[1] - 1)))
        for name, nodes in self.faces_with_area(load.group, key):
            force = face_forces(self.points, nodes, name, along, False, self.axisymmetric)
            share += force[:, 0]
        return share / share.sum()

    def _loaded(self, load: Load, key: str) -> list[tuple[str, np.ndarray]]:
        """The cells or faces that a load acts on: (type, nodes)."""
        if load.kind != "body_force":
            return self.faces_with_area(load.group, key)
        if load.group == ALL:
            return list(self.cut.cells.items())
        mask = self.cell_mask(load.group)
        return [(name, cells[mask[name]]) for name, cells in self.cut.cells.items()]

    def _exact_force(self, kind: str, name: str, nodes: np.ndarray, part: int) -> np.ndarray:
        """Forces (n, dim) of the exact solution's body force or stress on cells or faces."""
        exact, origin, at = self.exact, self.origin, (self.points, nodes, name)
        if kind == "body_force":
            return body_forces(*at, lambda x: exact.body_force(x + origin, part), self.axisymmetric)
        pressure = kind == "pressure"
        return stress_forces(
            *at, lambda x: exact.stress(x + origin, part), pressure, self.axisymmetric
        )
