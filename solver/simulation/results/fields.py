"""The fields of a solution on its grid: the cells of the cut mesh, then the slave sub-faces."""

from itertools import groupby
from operator import itemgetter

import meshio
import numpy as np

from ...lac.cells.catalogue import cell_type
from .solution import Solution


def grid_of(solution: Solution) -> meshio.Mesh:
    """The volume cells, then the sub-faces of all zones, one block for each cell type."""
    mesh = solution.mesh
    volumes = _volumes(solution)
    faces = [
        (cell_type(kind).meshio, np.concatenate([part[1] for part in same]))
        for kind, same in groupby(_face_parts(solution), key=itemgetter(0))
    ]
    cells = [(mesh.cells[i].type, mesh.cells[i].data) for i in volumes]
    none = [np.empty(0, dtype=int)] * len(faces)
    sets = {name: [of[i] for i in volumes] + none for name, of in mesh.cell_sets.items()}
    return meshio.Mesh(mesh.points, cells + faces, cell_sets=sets)


def grid_fields(solution: Solution) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The fields at points (n, …) and of cells (n_cells, …); those of contact on faces alone."""
    mesh = solution.mesh
    cell_data = _on_faces(solution)
    n_volumes = sum(len(mesh.cells[i].data) for i in _volumes(solution))
    for name, values in cell_data.items():
        nothing = np.nan if values.dtype.kind == "f" else -1
        none_there = np.full((n_volumes, *values.shape[1:]), nothing)
        cell_data[name] = np.concatenate([none_there, values])
    point_data = {
        "displacement": _in_space(solution.displacement),
        "stress": solution.stress,
        "normal_stress": solution.fields.normal_stress,
        "body": solution.fields.body,
    }
    for name in ("reaction", "motion"):
        if (vectors := getattr(solution.fields, name)) is not None:
            point_data[name] = _in_space(vectors)
    if any(zone.recovered for zone in solution.zones):
        point_data["recovered_pressure"] = _recovered_at_nodes(solution)
    return point_data, cell_data


def _volumes(solution: Solution) -> list[int]:
    dim = solution.mesh.points.shape[1]
    return [i for i, block in enumerate(solution.mesh.cells) if block.dim == dim]


def _recovered_at_nodes(solution: Solution) -> np.ndarray:
    """The recovered pressure (n,) at slave nodes, NaN at all others."""
    values = np.full(len(solution.mesh.points), np.nan)
    for zone in solution.zones:
        if zone.recovered:
            values[zone.recovered.nodes] = zone.recovered.at_nodes
    return values


def _face_parts(solution: Solution) -> list[tuple[str, np.ndarray, np.ndarray, int]]:
    """The sub-faces of all zones by cell type: type, nodes, macro-elements, number of the zone."""
    parts = [
        (kind, connectivity, owner, number)
        for number, zone in enumerate(solution.zones)
        for kind, connectivity, owner in zone.faces
    ]
    return sorted(parts, key=itemgetter(0))  # stable: zones of a type stay in their order


def _on_faces(solution: Solution) -> dict[str, np.ndarray]:
    """The fields of the sub-faces of all zones."""
    parts, none = _face_parts(solution), np.empty(0, dtype=int)
    data = {
        "macro_element": np.concatenate([none, *(owner for _, _, owner, _ in parts)]),
        "zone": np.concatenate([none, *(np.full(len(o), number) for _, _, o, number in parts)]),
    }
    fields = [zone.on_faces() for zone in solution.zones]
    known = {name: values for of_zone in fields for name, values in of_zone.items()}
    for name, some in known.items():
        for zone, of_zone in zip(solution.zones, fields, strict=True):
            # What another zone has, and this one lacks, is zero here.
            of_zone.setdefault(name, np.zeros((len(zone.area), *some.shape[1:])))
        found = np.concatenate([fields[n][name][owner] for _, _, owner, n in parts]).astype(float)
        data[name] = _in_space(found) if found.ndim > 1 else found
    return data


def _in_space(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, dim) as (n, 3)."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
