"""Bodies that move far: what acts on a deck in each step, and a result at the last position.

Codes follow bodies by the geometry of their own displacements. A result is compared where these
bring the bodies: the rigid motion of each body is taken off its displacements and moves its mesh.
The rest is a solve of linear theory there, of the last step alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import meshio
import numpy as np

from ..case.acting import Load, in_step
from ..case.model import Case
from ..simulation.scene.moved import Frames
from ..simulation.scene.scene import replace_points
from ..simulation.scene.selections import with_groups
from ..system.errors import InputError

if TYPE_CHECKING:
    from ..simulation.scene.attributes import Attributes
    from .foreign import Field, ForeignResult
    from .model import Model
    from .placing import Placed, Placer


@dataclass(frozen=True)
class DeckStep:
    """A step: `held` (n, dim), NaN where free, `forces` (n, dim), values of `pressures`."""

    held: np.ndarray
    forces: np.ndarray
    pressures: list[float]


def steps_of(given: Attributes, free: np.ndarray, pressures: list[Load]) -> Iterator[DeckStep]:
    """What acts in each step; `free` (n, dim): not held."""
    case, forces = given.case, cache(given.forces)
    names = ("", *case.histories)
    offsets = cache(lambda name: given.supports(name).offset)
    for step in case.steps:
        offset = in_step(step, names, offsets)
        held = np.where(free, np.nan, offset.reshape(free.shape))
        values = [load.factor(step) * float(load.value) for load in pressures]
        yield DeckStep(held, in_step(step, names, forces), values)


def at_last_position(
    placer: Placer, placed: Mapping[str, Placed]
) -> tuple[Case, ForeignResult, meshio.Mesh]:
    """The case, a result and the mesh where the last step brought the bodies.

    `placed` are the fields of the result that `placer` has, by name on the mesh as given.
    Raises InputError for a result without displacements, or with a place between bodies, and for a
    rigid body without cells.
    """
    model, foreign, where = placer.model, placer.foreign, placer.where
    moved = placed.get("displacement")
    if moved is None:
        raise InputError(where, "displacement", None, "is needed where bodies move far")
    for name, values in placed.items():
        if (values.body < 0).any():
            raise InputError(where, name, None, "each value needs its body where bodies move far")
    frames, weight = Frames.still(int(model.body.max()) + 1, model.dim), _of_contact(model)
    for number in np.unique(moved.body).tolist():
        mine = moved.body == number
        places, share = moved.places[mine], weight[moved.node[mine]]
        now = places + moved.values[mine, : model.dim]
        frames = frames.following(number, places, now, share, model.case.axisymmetric)
    fields: dict[str, Any] = {
        name: _moved(getattr(foreign, name), of, frames) for name, of in placed.items()
    }
    motion = fields["displacement"].places - moved.places
    left = moved.values[:, : model.dim] - motion
    fields["displacement"] = replace(fields["displacement"], values=left)
    given, own = with_groups(model.case, model.mesh), None
    if len(given.points) != len(model.points):
        problem = "a rigid body without cells: results are not compared where it moves far"
        raise InputError(model.case.path, "motion", "large", problem)
    there = replace_points(given, frames.placed(given.points, model.body))
    if foreign.mesh is not None and placer.points is not None:
        own = meshio.Mesh(frames.placed(placer.points, placer.body), foreign.mesh.cells)
    mesh = replace(model.case.mesh, selections=())
    then = replace(model.case, motion="small", steps=model.case.steps[-1:], mesh=mesh)
    return then, replace(foreign, mesh=own, step=None, **fields), there


def _of_contact(model: Model) -> np.ndarray:
    """By how many faces of contact each node (n + 1,) has: what frames follow in a solve of ours.

    Shear turns a body as a whole, but not its flat surface. The last one is for places at no node.
    """
    weight = np.zeros(len(model.points) + 1)
    for zone in model.solution.zones:
        for _, nodes in (*zone.faces_of("slave"), *zone.faces_of("master")):
            np.add.at(weight, nodes, 1.0)
    return weight


def _moved(field: Field, placed: Placed, frames: Frames) -> Field:
    """The values of a field at their places in the bodies that moved."""
    places = frames.placed(placed.places, placed.body)
    numbers = {"nodes": placed.own, "cells": placed.cells}
    return replace(field, places=places, values=placed.values, area=placed.area, **numbers)
