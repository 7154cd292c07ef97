"""gmsh, opened and closed: a quiet, repeatable session, and its current model as a mesh."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import gmsh
import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME

_NAMES = {kind.gmsh: name for name, kind in BY_NAME.items()}
POINT = 15

# The same mesh every time: one thread, no configuration of the user's, random numbers fixed.
# Mid-nodes go to the middle of straight edges.
_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "General.AbortOnError": 2,
    "Mesh.RandomSeed": 1,
    "Mesh.SecondOrderLinear": 1,
    "Mesh.LcIntegrationPrecision": 1e-12,
}


@contextmanager
def session(**options: float) -> Iterator[None]:
    """Open gmsh with an empty model; close it in any event.

    Options are gmsh's own, with `__` for the dot in their names (`Mesh__Algorithm=5`).
    """
    with _without_home():
        gmsh.initialize(readConfigFiles=False, run=False, interruptible=False)
    try:
        for name, value in (_OPTIONS | options).items():
            gmsh.option.setNumber(name.replace("__", "."), value)
        gmsh.model.add("mesh")
        yield
    finally:
        gmsh.finalize()


@contextmanager
def _without_home() -> Iterator[None]:
    """Keep FLTK, which gmsh is linked with, from writing its preferences into the home folder."""
    home = os.environ.get("HOME")
    os.environ["HOME"] = os.devnull
    try:
        yield
    finally:
        del os.environ["HOME"]
        if home is not None:
            os.environ["HOME"] = home


@cache
def node_order(cell_type: str) -> tuple[int, ...]:
    """Local nodes of gmsh's cell in the catalogue's order; needs an open session.

    Found from where gmsh's own reference cell has its nodes, vertices being in the same order.
    """
    ours = BY_NAME[cell_type]
    _, dim, _, n_nodes, flat, n_vertices = gmsh.model.mesh.getElementProperties(ours.gmsh)
    theirs = np.reshape(flat, (n_nodes, dim))
    corners = np.c_[ours.nodes[:n_vertices], np.ones(n_vertices)]
    to_theirs = np.linalg.lstsq(corners, theirs[:n_vertices], rcond=None)[0]
    mapped = np.c_[ours.nodes, np.ones(n_nodes)] @ to_theirs
    distance = np.linalg.norm(mapped[:, None] - theirs[None], axis=2)
    return tuple(int(i) for i in distance.argmin(axis=1))


def foreign_types() -> list[str]:
    """Gmsh's names of the cell types in the current model that are not in the catalogue."""
    numbers = gmsh.model.mesh.getElementTypes()
    foreign = [n for n in numbers if n != POINT and n not in _NAMES]
    return [gmsh.model.mesh.getElementProperties(number)[0] for number in foreign]


def current_model(unnamed: bool = True) -> meshio.Mesh:
    """The mesh of gmsh's current model: one block per entity and type, groups by name.

    A physical group without a name goes by its number. `unnamed` False leaves out the cells that
    are in no group. Points (n, 3); cell data `number` holds gmsh's own numbers of the cells.
    """
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    sorted_tags = tags[order]
    cells, numbers, members = [], [], []
    for dim, entity in gmsh.model.getEntities():
        names = _groups_of(dim, entity)
        if not (names or unnamed):
            continue
        for number, ids, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            cells.append(_block(number, np.searchsorted(sorted_tags, nodes), len(ids)))
            numbers.append(ids.astype(np.int64))
            members.append(names)
    every = sorted({name for names in members for name in names})
    sets = {
        name: [np.arange(len(n) if name in m else 0) for n, m in zip(numbers, members, strict=True)]
        for name in every
    }
    points = coordinates.reshape(-1, 3)[order]
    return meshio.Mesh(points, cells, cell_data={"number": numbers}, cell_sets=sets)


def _groups_of(dim: int, entity: int) -> list[str]:
    groups = gmsh.model.getPhysicalGroupsForEntity(dim, entity)
    return [gmsh.model.getPhysicalName(dim, g).strip() or str(g) for g in groups]


def _block(number: int, nodes: np.ndarray, n_cells: int) -> tuple[str, np.ndarray]:
    table = nodes.reshape(n_cells, -1)
    if number == POINT:
        return "vertex", table
    name = _NAMES[number]
    return BY_NAME[name].meshio, table[:, node_order(name)]
