"""A contact zone in a result file: see `solver.verification.results`."""

from dataclasses import fields
from typing import Any, TypeVar

import h5py
import numpy as np

from ..mechanics.mortar.edge import Edges
from ..simulation.results.forces import Resultants
from ..simulation.results.solution import NodalContact, RecoveredPressure, ZoneFriction, ZoneResult

T = TypeVar("T")
# Data sets that are not named as their field.
_NAMES = {"closed": "status"}
_PARTS = {
    "nodal": NodalContact,
    "recovered": RecoveredPressure,
    "resultants": Resultants,
    "friction": ZoneFriction,
}


def write_zone(group: h5py.Group, zone: ZoneResult, number: int) -> None:
    """Write a zone, the `number` of which gives its place among all."""
    group.attrs["number"] = number
    _write(group, zone)
    faces = group.create_group("master_faces")
    # Faces of one type may be in several blocks, one for each type of cell behind them.
    for kind in dict.fromkeys(kind for kind, _ in zone.master_faces):
        faces[kind] = np.concatenate([nodes for name, nodes in zone.master_faces if name == kind])
    for name in _PARTS:
        if part := getattr(zone, name):
            _write(group.create_group(name), part)
    if zone.recovered:
        group["recovered"].attrs["form"] = zone.recovered.form
    if zone.resultants and zone.resultants.edges:
        _write(group.create_group("edges"), zone.resultants.edges)


def read_zone(
    group: h5py.Group, name: str, faces: list[tuple[str, np.ndarray, np.ndarray]]
) -> ZoneResult:
    """Read a zone with its slave sub-`faces` back."""
    parts: dict[str, Any] = {
        part: _read(kind, group[part], **group[part].attrs)
        for part, kind in _PARTS.items()
        if part in group
    }
    if "edges" in group:
        parts["resultants"].edges = _read(Edges, group["edges"])
    masters = [(kind, data[()]) for kind, data in group["master_faces"].items()]
    return _read(ZoneResult, group, name=name, faces=faces, master_faces=masters, **parts)


def _write(group: h5py.Group, item: Any) -> None:
    """Write the fields that are arrays as data sets."""
    for field in fields(item):
        value = getattr(item, field.name)
        if isinstance(value, np.ndarray):
            group[_NAMES.get(field.name, field.name)] = value


def _read(kind: type[T], group: h5py.Group, **given: Any) -> T:
    """An object with the data sets of a group as fields, beside those `given`."""
    names = {f.name: _NAMES.get(f.name, f.name) for f in fields(kind)}  # type: ignore[arg-type]
    data = (group.get(name) for name in names.values())
    arrays = {
        field: found[()]
        for field, found in zip(names, data, strict=True)
        if isinstance(found, h5py.Dataset)
    }
    return kind(**arrays, **given)
