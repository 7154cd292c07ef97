"""Materials, supports, loads and initial strains of a case on the groups of the cut mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...case.acting import Load
from ...case.expressions import Exact
from ...case.material import Material
from ...case.solutions.base import ExactSolution
from ...lac.cells.catalogue import BY_NAME
from ...lac.cells.faces import FaceBlock, nodal_normals
from ...lac.cells.shape import has_straight_edges
from ...mechanics.fem.block import Block
from ...mechanics.fem.elasticity import lame_parameters
from ...mechanics.fem.loads import body_forces, face_forces, stress_forces
from ...mechanics.fem.supports import (
    CopyError,
    Fixed,
    FreeMotion,
    SupportClashError,
    TieError,
    copied,
    free_motion,
    released,
    tied,
)
from ...system.errors import InputError
from . import rigid
from .cut_groups import CutGroups, copies_of, ties_of
from .groups import ALL
from .rigid import Frame


class Attributes(CutGroups):
    """What the case gives the groups: materials, supports and loads."""

    @cached_property
    def exact_part(self) -> np.ndarray:
        """The part (n,) of the case's exact solution that each node belongs to."""
        return self._exact.node_parts(self.points + self.origin, self.body)

    @property
    def _exact(self) -> ExactSolution:
        if self.case.solution is None:
            raise AssertionError("a value is taken from a solution that the case does not name")
        return self.case.solution

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
        moving = rigid.moving_nodes(self, self.frames)
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
        if moving.any():
            blocks = [block.of(~moving[block.cells].all(axis=1)) for block in blocks]
        return [block for block in blocks if len(block.cells)]

    def by_material(
        self, value: Callable[[Material], float], otherwise: float
    ) -> dict[str, np.ndarray]:
        """A value of the material of each cell (n,) by type; a group's own goes before `all`.

        `otherwise`: of cells without a material, which belong to rigid bodies.
        """
        materials = self.case.materials
        start = value(materials[ALL]) if ALL in materials else otherwise
        values = {name: np.full(len(c), float(start)) for name, c in self.cut.cells.items()}
        for group in (g for g in materials if g != ALL):
            for name, mask in self.cell_mask(group).items():
                values[name][mask] = value(materials[group])
        return values

    def materials_behind(self, faces: Sequence[FaceBlock]) -> list[np.ndarray]:
        """A number (n,) of the material of the cell behind each face as meshed, by block.

        Equal materials have the same number, cells of rigid bodies −1.
        """
        materials = self.case.materials
        number = {material: i for i, material in enumerate(materials.values())}
        start = number[materials[ALL]] if ALL in materials else -1
        found = [np.full(len(block.owner), start) for block in faces]
        for group in (g for g in materials if g != ALL):
            mask = self.whole_cell_mask(group)
            for values, block in zip(found, faces, strict=True):
                values[mask[block.owner_type.name][block.owner]] = number[materials[group]]
        return found

    @cached_property
    def frames(self) -> dict[str, Frame]:
        """The rigid bodies by name."""
        return rigid.frames_of(self)

    @cached_property
    def fixed(self) -> dict[str, Fixed]:
        """What the axis, supports and rigid bodies hold, by the key of the case file."""
        fixed = dict(self._fixed())
        rigid.refuse_moved(self.case, self.frames, fixed)
        dim = self.points.shape[1]
        on_axis = np.flatnonzero(self.points[:, 0] == 0) if self.axisymmetric else np.empty(0, int)
        # The circles of points on the axis have no radius, and keep it.
        held = Fixed(on_axis, np.tile(np.eye(dim)[0], (len(on_axis), 1)), np.zeros(len(on_axis)))
        return {"plane": held, **fixed, **rigid.held(self.case, self.frames)}

    def supports(self) -> FreeMotion:
        """The motion that supports and rigid bodies leave free."""
        ties, copies = ties_of(self), copies_of(self)
        try:
            free = free_motion(len(self.points), self.points.shape[1], list(self.fixed.values()))
            free = tied(copied(free, list(copies.values())), list(ties.values()))
            return released(free, rigid.free_motions(self, self.frames))
        except CopyError as error:
            key = list(copies)[error.number]
            raise InputError(self.case.path, key, None, str(error)) from None
        except TieError as error:
            raise InputError(self.case.path, list(ties)[error.number], None, str(error)) from None
        except SupportClashError as clash:
            key = list(self.fixed)[clash.number]
            remark = " (on the axis x is fixed)" if len(self.fixed["plane"].nodes) else ""
            raise InputError(self.case.path, key, clash.value, f"{clash}{remark}") from None

    def _fixed(self) -> Iterator[tuple[str, Fixed]]:
        """The displacements fixed by supports, by key of the case file."""
        for i, support in enumerate(self.case.supports):
            nodes = self.nodes(support.group, f"supports[{i}].group")
            for direction, value in support.fix.items():
                key = f"supports[{i}].fix.{direction}"
                if direction == "normal":
                    directions = self._normals(support.group, nodes, key)
                else:
                    axis = np.eye(self.points.shape[1])["xyz".index(direction)]
                    directions = np.tile(axis, (len(nodes), 1))
                if isinstance(value, Exact):
                    place = self.points[nodes] + self.origin
                    whole = self._exact.displacement(place, self.exact_part[nodes])
                    values = np.einsum("nd,nd->n", whole, directions)
                else:
                    values = self.field(value)(self.points[nodes])
                yield key, Fixed(nodes, directions, values)

    def _normals(self, group: str, nodes: np.ndarray, key: str) -> np.ndarray:
        """Unit normals (n, dim) of a group's faces at its nodes, the mean over the faces there."""
        return nodal_normals(self.points, self.faces(group, key))[nodes]

    def forces(self) -> np.ndarray:
        """Nodal forces (n, dim) of all loads but initial strains, at load factor 1."""
        total = rigid.forces(self, self.frames)
        for i, load in enumerate(self.case.loads):
            total += self._force(load, f"loads[{i}].group")
        return total

    def histories(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Forces (n, dim) and displacements (n_dofs,) of each name in `steps`; of no name too."""
        if not self.case.histories:
            return {}
        if states := self.case.states:
            return {name: self._state(solution) for name, solution in states.items()}
        return {name: self._history(name) for name in ("", *self.case.histories)}

    def _state(self, solution: ExactSolution) -> tuple[np.ndarray, np.ndarray]:
        case = replace(self.case, solution=solution)
        then = Attributes(case, self.mesh, self.cut, self.zones, self.origin)
        return then.forces(), then.supports().offset

    def _history(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        mine = [f"supports[{i}]." for i, s in enumerate(self.case.supports) if s.name == name]
        mine += [f"bodies.{group}." for group, b in self.case.rigid.items() if b.name == name]
        fixed = {
            key: replace(f, values=f.values * key.startswith(tuple(mine)))
            for key, f in self.fixed.items()
        }
        force = rigid.forces(self, self.frames, name)
        for i, load in enumerate(self.case.loads):
            if load.name == name:
                force += self._force(load, f"loads[{i}].group")
        try:
            free = free_motion(len(self.points), self.points.shape[1], list(fixed.values()))
            free = copied(free, list(copies_of(self).values()))
        except SupportClashError as clash:
            allowed = f"{clash}, of another name in steps"
            key = list(fixed)[clash.number]
            raise InputError(self.case.path, key, clash.value, allowed) from None
        return force, free.offset

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
        for name, nodes in self.faces(load.group, key):
            force = face_forces(self.points, nodes, name, along, False, self.axisymmetric)
            share += force[:, 0]
        return share / share.sum()

    def _loaded(self, load: Load, key: str) -> list[tuple[str, np.ndarray]]:
        """The cells or faces that a load acts on: (type, nodes)."""
        if load.kind != "body_force":
            return self.faces(load.group, key)
        if load.group == ALL:
            return list(self.cut.cells.items())
        mask = self.cell_mask(load.group)
        return [(name, cells[mask[name]]) for name, cells in self.cut.cells.items()]

    def _exact_force(self, kind: str, name: str, nodes: np.ndarray, part: int) -> np.ndarray:
        """Forces (n, dim) of the exact solution's body force or stress on cells or faces."""
        exact, origin, at = self._exact, self.origin, (self.points, nodes, name)
        if kind == "body_force":
            return body_forces(*at, lambda x: exact.body_force(x + origin, part), self.axisymmetric)
        pressure = kind == "pressure"
        return stress_forces(
            *at, lambda x: exact.stress(x + origin, part), pressure, self.axisymmetric
        )
