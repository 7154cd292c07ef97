"""Fields in VTU, VTKHDF, MED and Exodus files, the last step of each."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import count, takewhile
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np

from ...mesh.files import med
from ...mesh.files.vtkhdf import last_of, read_cells
from ...system.errors import InputError
from .raw import Raw, RawField, at_cells, at_nodes, plain_mesh


def read_vtu(path: Path) -> Raw:
    """Point and cell data of a VTU file, read by meshio, which drops the names of components."""
    found, names = of_mesh(meshio.vtu.read(path)), _component_names(path)
    fields = {
        name: field._replace(components=names[name])
        if len(names.get(name, ())) == field.values.shape[1]
        else field
        for name, field in found.fields.items()
    }
    return replace(found, fields=fields)


def _component_names(path: Path) -> dict[str, tuple[str, ...]]:
    """The names of the components of arrays in a VTU file: `ComponentName0="…"` and so on."""
    found = {}
    for tag in re.findall(rb"<DataArray\b[^>]*>", path.read_bytes()):
        text = {k.decode(): v.decode() for k, v in re.findall(rb'(\w+)="([^"]*)"', tag)}
        keys = takewhile(text.__contains__, (f"ComponentName{i}" for i in count()))
        if names := tuple(text[key] for key in keys):
            found[text.get("Name", "")] = names
    return found


def of_mesh(found: meshio.Mesh) -> Raw:
    """Point and cell data of a mesh."""
    mesh = plain_mesh(found.points, [(block.type, block.data) for block in found.cells])
    fields = {name: at_nodes(mesh.points, data) for name, data in found.point_data.items()}
    if len(mesh.cells) == len(found.cells):
        fields |= {
            name: at_cells(mesh, data)
            for name, data in found.cell_data.items()
            if name not in fields and all(part.dtype.kind in "iuf" for part in data)
        }
    return Raw(mesh, fields)


def read_vtkhdf(path: Path) -> Raw:
    """Point and cell data of an unstructured grid in one piece, written by us or by others.

    Of a series of steps those of the last one. A result of this program has bodies that move far
    where they are: they are brought back to where they were, and displaced by their `motion` too.
    """
    with h5py.File(path) as file:
        group = file.get("VTKHDF")
        if group is None or "Connectivity" not in group:
            raise InputError(path, "grid", None, "not an unstructured grid of VTKHDF")
        if len(group["NumberOfPoints"]) != 1:
            raise InputError(
                path, "grid", None, "must be one piece with the same cells at all steps"
            )
        cells, pieces = read_cells(group)
        points = last_of(group, "Points")
        data = {name: last_of(group, f"PointData/{name}") for name in group.get("PointData", {})}
        if "layout" in file.attrs and "motion" in data:
            motion = data.pop("motion")
            points, data["displacement"] = points - motion, data["displacement"] + motion
        mesh = plain_mesh(points, cells)
        fields = {name: at_nodes(mesh.points, values) for name, values in data.items()}
        for name, data in group.get("CellData", {}).items():
            if name not in fields and data.dtype.kind in "iuf":
                values = last_of(group, f"CellData/{name}")
                fields[name] = at_cells(mesh, [values[start:stop] for start, stop in pieces])
    return Raw(mesh, fields)


def read_med(path: Path) -> Raw:
    """The nodal fields of a MED file (version 3 or later), by the names of their components."""
    found = med.read(path)
    mesh = plain_mesh(found.points, [(block.type, block.data) for block in found.cells])
    fields: dict[str, RawField] = {}
    with h5py.File(path) as file:
        for name, folder in file.get("CHA", {}).items():
            steps = [step for step in folder.values() if "NOE" in step]
            if not steps:
                continue
            step = max(steps, key=lambda s: (float(s.attrs.get("PDT", 0)), int(s.attrs["NDT"])))
            profile = next(iter(step["NOE"].values()))
            count = int(folder.attrs["NCO"])
            values = profile["CO"][()].reshape(count, -1).T
            text = np.bytes_(folder.attrs["NOM"]).decode(errors="replace")
            components = tuple(text[i : i + 16].strip() for i in range(0, 16 * count, 16))
            if len(values) == len(mesh.points):
                fields[name.strip()] = at_nodes(mesh.points, values, components)
    aster = any(re.search(r"DEPL|SIEF|SIGM|CONT_NOEU", name) for name in fields)
    return Raw(mesh, fields, "code_aster" if aster else "")


# Exodus names cells by shape and number of nodes.
_EXODUS = {
    ("TRI", 3): "triangle", ("TRI", 6): "triangle6", ("QUA", 4): "quad", ("QUA", 8): "quad8",
    ("QUA", 9): "quad9", ("SHE", 4): "quad", ("TET", 4): "tetra", ("TET", 10): "tetra10",
    ("HEX", 8): "hexahedron", ("HEX", 20): "hexahedron20", ("WED", 6): "wedge",
    ("WED", 15): "wedge15", ("PYR", 5): "pyramid", ("PYR", 13): "pyramid13",
}  # fmt: skip
# Upright edges before the top edges, unlike VTK.
_UPRIGHT = {
    "hexahedron20": [*range(12), *range(16, 20), *range(12, 16)],
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
}


def read_exodus(path: Path) -> Raw:
    """The nodal variables of an Exodus II file, in either format of NetCDF, at its last time."""
    if h5py.is_hdf5(path):
        with h5py.File(path) as file:
            return _exodus(path, file, lambda item: item.attrs.get("elem_type", b""))
    from scipy.io import netcdf_file

    try:
        with netcdf_file(path, "r", mmap=False) as file:
            return _exodus(path, file.variables, lambda item: getattr(item, "elem_type", b""))
    except (TypeError, ValueError) as error:
        raise InputError(path, "file", None, f"not an Exodus file ({error})") from None


def _exodus(path: Path, file: Mapping[str, Any], type_of: Any) -> Raw:
    if "coord" in file:
        points = np.asarray(file["coord"][:], dtype=float).T
    elif "coordx" in file:
        axes = [f"coord{axis}" for axis in "xyz" if f"coord{axis}" in file]
        points = np.column_stack([np.asarray(file[axis][:], dtype=float) for axis in axes])
    else:
        raise InputError(path, "nodes", None, "the file has none: not an Exodus file")
    cells = []
    for name in sorted(n for n in file if re.fullmatch(r"connect\d+", n)):
        nodes, kind = np.asarray(file[name][:], dtype=int) - 1, type_of(file[name])
        shape = (kind.decode() if isinstance(kind, bytes) else str(kind)).upper()[:3]
        known = _EXODUS.get((shape, nodes.shape[1]), "")
        cells.append((known, nodes[:, _UPRIGHT.get(known, slice(None))]))
    mesh = plain_mesh(points, cells)
    fields = {}
    rows = file["name_nod_var"][:] if "name_nod_var" in file else ()
    for number, row in enumerate(rows, start=1):
        name = np.asarray(row, dtype="S1").tobytes().split(b"\0")[0].decode().strip()
        key = f"vals_nod_var{number}"
        values = file[key][-1] if key in file else file["vals_nod_var"][-1][number - 1]
        fields[name] = at_nodes(mesh.points, np.asarray(values, dtype=float))
    return Raw(mesh, fields)
