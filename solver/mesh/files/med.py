"""MED files, read with plain h5py (HDF5 files of a documented layout) and written by meshio.

Read here and not by gmsh, which leaves the groups of nodes out and pads the names of the others.

In version 2 a mesh has no steps: its nodes, cells and families are directly in it. The names of
groups are one text of 80 characters each, and faces of solids (edges of plane meshes) may have a
further column behind their nodes.
"""

from io import BytesIO
from pathlib import Path

import h5py
import meshio
import numpy as np

from ...lac.cells.catalogue import BY_MESHIO, BY_NAME
from ...system.errors import InputError
from .msh import combinations

_TYPES = {kind.med: name for name, kind in BY_NAME.items()}
_NAME = 80  # characters of a group's name
# MED's node order is the catalogue's with the orientation reversed, which `tidy` puts right; only
# the face centres of HEXA27 have an order of their own.
_HEXA27 = [*range(20), 24, 22, 21, 23, 20, 25, 26]


def read(path: Path) -> meshio.Mesh:
    """The mesh of a MED file (version 2.2 or later), as it is in the file.

    Raises InputError for what has no meaning here: several meshes in one file, another kind of
    coordinates than Cartesian, cell types that are not in the catalogue.
    """
    if not h5py.is_hdf5(path):
        raise InputError(path, "mesh", None, "no MED file (MED files are HDF5 files)")
    with h5py.File(path) as file:
        name, step = _mesh_of(file, path)
        nodes = step["NOE"]
        points = nodes["COO"][()].reshape(-1, int(nodes["COO"].attrs["NBR"])).T
        node_groups = _members(nodes, _families(file, name, "NOEUD"))
        of_family = _families(file, name, "ELEME")
        cells, numbers, members = [], [], []
        for kind, entry in step["MAI"].items() if "MAI" in step else ():
            cells.append((_meshio_type(kind, path), _connectivity(entry, kind)))
            numbers.append(_numbers(entry, len(cells[-1][1])))
            members.append(_members(entry, of_family))
    names = sorted({name for groups in members for name in groups})
    none = np.arange(0)
    return meshio.Mesh(
        points,
        cells,
        cell_data={"number": numbers},
        cell_sets={name: [groups.get(name, none) for groups in members] for name in names},
        point_sets=node_groups,
    )


def _mesh_of(file: h5py.File, path: Path) -> tuple[str, h5py.Group]:
    meshes = file.get("ENS_MAA", {})
    if len(meshes) != 1:
        names = f": {', '.join(meshes)}" if len(meshes) else ""
        raise InputError(path, "meshes", len(meshes), f"the file must hold one mesh{names}")
    name, mesh = next(iter(meshes.items()))
    steps = [mesh, *(entry for entry in mesh.values() if isinstance(entry, h5py.Group))]
    found = next((step for step in steps if "NOE" in step), None)
    if found is None:
        allowed = "no nodes in the layout of MED 2.2 or later; for older files: medimport OLD NEW"
        raise InputError(path, "mesh", name, allowed)
    if any(int(entry.attrs.get("REP", 0)) for entry in (mesh, found["NOE/COO"])):
        raise InputError(path, "coordinates", None, "must be Cartesian")
    return name, found


def _families(file: h5py.File, mesh: str, entity: str) -> dict[int, list[str]]:
    """The group names of each family number."""
    places = (f"FAS/{mesh}/{entity}", f"ENS_MAA/{mesh}/FAS/{entity}")
    return {
        int(family.attrs["NUM"]): _names(family["GRO/NOM"][()])
        for place in places
        for family in file.get(place, {}).values()
        if "GRO" in family
    }


def _names(stored: np.ndarray | np.bytes_) -> list[str]:
    """The names of groups in texts of fixed length."""
    whole = stored.tobytes()
    rows = (whole[i : i + _NAME] for i in range(0, len(whole), _NAME))
    names = (row.split(b"\0")[0].decode(errors="replace").strip() for row in rows)
    return [name for name in names if name]


def _members(entry: h5py.Group, families: dict[int, list[str]]) -> dict[str, np.ndarray]:
    """The members of each group among the nodes, or the cells of one type."""
    if "FAM" not in entry:
        return {}
    of_each = entry["FAM"][()]
    masks: dict[str, np.ndarray] = {}
    for number in np.unique(of_each):
        for name in families.get(int(number), ()):
            masks[name] = masks.get(name, False) | (of_each == number)
    return {name: np.flatnonzero(mask) for name, mask in masks.items()}


def _meshio_type(kind: str, path: Path) -> str:
    if kind == "PO1":
        return "vertex"
    if kind not in _TYPES:
        raise InputError(path, "cell type", kind, f"allowed: {', '.join(_TYPES.values())}")
    return BY_NAME[_TYPES[kind]].meshio


def _connectivity(entry: h5py.Group, kind: str) -> np.ndarray:
    count = int(entry["NOD"].attrs["NBR"])
    nodes = entry["NOD"][()].reshape(-1, count).T - 1
    if kind == "PO1":
        return nodes[:, :1]
    return nodes[:, _HEXA27 if kind == "H27" else range(BY_NAME[_TYPES[kind]].n_nodes)]


def _numbers(entry: h5py.Group, count: int) -> np.ndarray:
    return entry["NUM"][()] if "NUM" in entry else np.arange(1, count + 1)


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write the mesh; each combination of its groups is a family."""
    from meshio.med import _med

    _med.meshio_to_med_type.update(quad9="QU9", hexahedron27="H27")
    sizes = [len(block.data) for block in mesh.cells]
    starts = np.cumsum([0, *sizes])
    whole = {
        name: np.concatenate(
            [s + np.asarray(i, dtype=int) for s, i in zip(starts, ids, strict=False)]
        )
        for name, ids in mesh.cell_sets.items()
    }
    of_cell, cell_names = combinations(int(starts[-1]), whole)
    of_node, node_names = combinations(len(mesh.points), mesh.point_sets)
    # Families of cells have negative numbers, those of nodes positive ones, and 0 is of no group.
    cell_tag = np.array([-1 - i if names else 0 for i, names in enumerate(cell_names)])
    node_tag = np.array([1 + i if names else 0 for i, names in enumerate(node_names)])
    tags, cells, cell_tags = np.split(cell_tag[of_cell], starts[1:-1]), [], []
    for kind in dict.fromkeys(block.type for block in mesh.cells):
        mine = [i for i, block in enumerate(mesh.cells) if block.type == kind]
        cells.append((kind, _as_in_med(kind, np.concatenate([mesh.cells[i].data for i in mine]))))
        cell_tags.append(np.concatenate([tags[i] for i in mine]))
    written = meshio.Mesh(
        mesh.points,
        cells,
        cell_data={"cell_tags": cell_tags},
        point_data={"point_tags": node_tag[of_node]},
    )
    written.cell_tags = {int(cell_tag[i]): n for i, n in enumerate(cell_names) if n}
    written.point_tags = {int(node_tag[i]): n for i, n in enumerate(node_names) if n}
    # Made in memory: HDF5 cannot close a file on a full disk.
    content = BytesIO()
    meshio.med.write(content, written)
    path.write_bytes(content.getvalue())


def _as_in_med(kind: str, nodes: np.ndarray) -> np.ndarray:
    cell = BY_MESHIO[kind]
    nodes = nodes[:, cell.mirror] if cell.dim == 3 else nodes
    return nodes[:, np.argsort(_HEXA27)] if cell.name == "HEXA27" else nodes
