"""scikit-fem's meshes as the arrays of the mortar kernel, and back after the cut."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import skfem

from .cells.catalogue import BY_NAME, CellType
from .cells.faces import FaceBlock, right_side_out
from .cut import SubFaces, cut, needs_cut

Names = str | Sequence[str]
KINDS = {
    "MeshTri1": "TRIA3",
    "MeshTri2": "TRIA6",
    "MeshQuad1": "QUAD4",
    "MeshQuad2": "QUAD9",
    "MeshTet1": "TETRA4",
    "MeshTet2": "TETRA10",
    "MeshHex1": "HEXA8",
    "MeshHex2": "HEXA27",
}
"""The classes of meshes that contact is written for, and the names of their cells."""


def read_cells(mesh: skfem.Mesh) -> tuple[CellType, np.ndarray, np.ndarray]:
    """Cell type, its nodes' places among those of scikit-fem's element, and cells (n, n_nodes).

    Cells are turned right side out: MeshTri1 sorts its vertices, so that half of them are mirrored.
    Raises ValueError for a class without LAC, and for flat or folded cells.
    """
    name = type(mesh).__name__
    if name not in KINDS:
        raise ValueError(f"mesh = {name}: no LAC on this class; allowed: {', '.join(KINDS)}")
    kind = BY_NAME[KINDS[name]]
    places = np.asarray(mesh.elem.doflocs)
    order = np.abs(kind.nodes[:, None] - places).sum(axis=2).argmin(axis=1)
    cells, bad = right_side_out(mesh.p.T, mesh.dofs.element_dofs[order].T, kind)
    if bad.any():
        raise ValueError(f"mesh: {bad.sum()} of {len(bad)} cells are flat or folded")
    return kind, order, cells


def boundary_of(mesh: skfem.Mesh, names: Names, role: str) -> np.ndarray:
    """The facets (k,) of named boundaries; ValueError for unknown, empty and inner ones."""
    known = mesh.boundaries or {}
    parts = []
    for name in [names] if isinstance(names, str) else names:
        if name not in known:
            there = ", ".join(sorted(known)) or "none"
            raise ValueError(f"{role} = {name!r}: no such boundary of the mesh; there are: {there}")
        if not len(known[name]):
            raise ValueError(f"{role} = {name!r}: the boundary has no facet")
        parts.append(np.asarray(known[name]))
    facets = np.concatenate(parts)
    if len(np.unique(facets)) < len(facets):
        raise ValueError(f"{role} = {names!r}: the boundaries share facets")
    inner = mesh.f2t[1, facets] >= 0
    if inner.any():
        text = f"{inner.sum()} of {len(facets)} facets have a cell on both sides"
        raise ValueError(f"{role} = {names!r}: {text}; they must be on the outside")
    return facets


def read_faces(mesh: skfem.Mesh, names: Names, role: str) -> FaceBlock:
    """The facets of boundaries in their own order, turned outward, with the cells behind them."""
    facets = boundary_of(mesh, names, role)
    kind, _, cells = read_cells(mesh)
    local = np.array([face.nodes for face in kind.faces])
    cell, corners = mesh.f2t[0, facets], np.sort(mesh.facets[:, facets].T)
    sides = np.sort(cells[cell][:, local[:, : corners.shape[1]]])
    side = (sides == corners[:, None]).all(axis=2).argmax(axis=1)
    nodes = np.take_along_axis(cells[cell], local[side], axis=1)
    face = BY_NAME[kind.faces[0].type]
    return FaceBlock(face, nodes, np.arange(len(facets)), kind, cell, side)


def cut_mesh(mesh: skfem.Mesh, names: Names, faces: FaceBlock) -> tuple[skfem.Mesh, SubFaces]:
    """The mesh after the cut, boundaries and subdomains carried over, and its slave sub-faces.

    `faces` are those of `read_faces` at these boundaries.

    Each is of the facet, by its place in the boundaries, that its `macro` names. Facets that have a
    node inside, those of MeshQuad2 and MeshHex2, need no cut: the mesh is returned as it is.
    """
    if not needs_cut(faces.type.name):
        return mesh, SubFaces(faces.type, faces.nodes, faces.number)
    kind, order, cells = read_cells(mesh)
    pieces = cut(mesh.p.T, {kind.name: cells}, [faces], into_hexahedra=[True])
    (part,), cells = pieces.sub_faces, pieces.cells[kind.name]
    number = np.arange(len(pieces.points))
    new = type(mesh)(pieces.points.T, cells.T[np.argsort(order)])
    if kind.order == 2:  # scikit-fem numbers the vertices first
        number[cells] = new.dofs.element_dofs[order].T
    corners = len(new.facets)
    piece = _facets_at(new, number[part.nodes[:, :corners]])
    whole = _facets_at(new, number[mesh.facets.T])
    slave = np.full(mesh.nfacets, -1)
    slave[boundary_of(mesh, names, "slave")] = faces.number
    named = {
        key: np.concatenate([whole[old][whole[old] >= 0], piece[np.isin(part.macro, slave[old])]])
        for key, old in (mesh.boundaries or {}).items()
    }
    parent = pieces.members(kind.name, {kind.name: np.arange(mesh.nelements)})
    inside = {
        key: np.flatnonzero(np.isin(parent, old)) for key, old in (mesh.subdomains or {}).items()
    }
    new = new.with_boundaries(named).with_subdomains(inside)
    return new, SubFaces(part.type, number[part.nodes], part.macro)


def _facets_at(mesh: skfem.Mesh, corners: np.ndarray) -> np.ndarray:
    """For each set of corners (n, k), the number of the facet that has them; −1 where none has."""
    rows = np.concatenate([np.sort(mesh.facets.T), np.sort(corners)])
    label = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    place = np.full(label.max() + 1, -1)
    place[label[: mesh.nfacets]] = np.arange(mesh.nfacets)
    return place[label[mesh.nfacets :]]


def unknowns_at_nodes(basis: Any, mesh: skfem.Mesh, role: str) -> np.ndarray:
    """The unknowns (dim, n_nodes) of a basis at the nodes of a mesh.

    ValueError for a basis that is not isoparametric, where the kernel's gaps would not be those of
    the basis, and for one on another mesh.
    """
    name = mesh.elem.__name__
    element = getattr(basis, "elem", basis)
    if not isinstance(element, skfem.ElementVector) or type(element.elem) is not mesh.elem:
        given = type(element).__name__
        text = f"{role}: basis of {given}; {type(mesh).__name__} needs ElementVector({name}())"
        raise ValueError(text)
    same = basis.mesh.t.shape == mesh.t.shape and basis.mesh.p.shape == mesh.p.shape
    if not same or (basis.mesh.t != mesh.t).any() or (basis.mesh.p != mesh.p).any():
        after = (
            "the mesh after the cut, LocalAverageContact.mesh" if role == "slave" else "its mesh"
        )
        raise ValueError(f"{role}: the basis must be on {after}")
    dofs = np.empty((mesh.dim(), mesh.dofs.element_dofs.max() + 1), dtype=int)
    for component, row in enumerate(dofs):
        row[mesh.dofs.element_dofs] = basis.element_dofs[component :: len(dofs)]
    return dofs
