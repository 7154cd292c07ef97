"""A contact zone in a result file: see `solver.verification.results`."""

from collections.abc import Iterable
from typing import Any

import h5py
import numpy as np

from ..mechanics.mortar.edge import Edges
from ..simulation.solution import (
    NodalContact,
    RecoveredPressure,
    Resultants,
    ZoneResult,
)

_BY_MACRO_ELEMENT = {  # data set: attribute of ZoneResult
    "centre": "centre",
    "normal": "normal",
    "area": "area",
    "multiplier": "multiplier",
    "gap": "gap",
    "status": "closed",
    "coverage": "coverage",
}
_BY_NODE = ("stress_slave", "stress_master", "slave_nodes", "master_nodes")
_AT_MULTIPLIER_NODES = {
    "nodes": "nodes",
    "multiplier": "multiplier",
    "gap": "gap",
    "status": "closed",
}
_RECOVERED = ("coefficients", "degree", "centre", "axes", "spread", "nodes", "at_nodes")
_RESULTANTS = ("area", "force", "moment")
_EDGES = ("position", "lower", "upper", "macro", "better", "lengths")


def write_zone(group: h5py.Group, zone: ZoneResult, number: int) -> None:
    """Write a zone, the `number` of which gives its place among all."""
    group.attrs["number"] = number
    for name, attribute in _BY_MACRO_ELEMENT.items():
        group[name] = getattr(zone, attribute)
    for name in _BY_NODE:
        group[name] = getattr(zone, name)
    faces = group.create_group("master_faces")
    # Faces of one type may be in several blocks, one for each type of cell behind them.
    for kind in dict.fromkeys(kind for kind, _ in zone.master_faces):
        faces[kind] = np.concatenate([nodes for name, nodes in zone.master_faces if name == kind])
    if zone.pressure_error is not None:
        group["pressure_error"] = zone.pressure_error
    if zone.pressure_of_forces is not None:
        group["pressure_of_forces"] = zone.pressure_of_forces
    _write_fields(group, zone)


def _write_fields(group: h5py.Group, zone: ZoneResult) -> None:
    if zone.recovered:
        recovered = group.create_group("recovered")
        recovered.attrs["form"] = zone.recovered.form
        _write(recovered, zone.recovered, _RECOVERED)
    if zone.resultants:
        _write(group.create_group("resultants"), zone.resultants, _RESULTANTS)
        if edges := zone.resultants.edges:
            _write(group.create_group("edges"), edges, _EDGES)
    if zone.nodal:
        nodal = group.create_group("nodal")
        for name, attribute in _AT_MULTIPLIER_NODES.items():
            nodal[name] = getattr(zone.nodal, attribute)


def read_zone(
    group: h5py.Group, name: str, faces: list[tuple[str, np.ndarray, np.ndarray]]
) -> ZoneResult:
    """Read a zone with its slave sub-`faces` back."""
    return ZoneResult(
        name=name,
        faces=faces,
        master_faces=[(kind, data[()]) for kind, data in group["master_faces"].items()],
        **{attribute: group[key][()] for key, attribute in _BY_MACRO_ELEMENT.items()},
        **{key: group[key][()] for key in _BY_NODE},
        nodal=_read_nodal(group["nodal"]) if "nodal" in group else None,
        pressure_of_forces=_optional(group, "pressure_of_forces"),
        pressure_error=_optional(group, "pressure_error"),
        recovered=_read_recovered(group["recovered"]) if "recovered" in group else None,
        resultants=_read_resultants(group) if "resultants" in group else None,
    )


def _write(group: h5py.Group, item: Any, names: Iterable[str]) -> None:
    for name in names:
        group[name] = getattr(item, name)


def _read_resultants(group: h5py.Group) -> Resultants:
    edges = {name: group["edges"][name][()] for name in _EDGES} if "edges" in group else None
    fields = {name: group["resultants"][name][()] for name in _RESULTANTS}
    return Resultants(**fields, edges=Edges(**edges) if edges else None)


def _optional(group: h5py.Group, name: str) -> np.ndarray | None:
    return group[name][()] if name in group else None


def _read_recovered(group: h5py.Group) -> RecoveredPressure:
    fields = {name: group[name][()] for name in _RECOVERED}
    return RecoveredPressure(form=group.attrs["form"], **fields)


def _read_nodal(group: h5py.Group) -> NodalContact:
    return NodalContact(**{a: group[name][()] for name, a in _AT_MULTIPLIER_NODES.items()})
