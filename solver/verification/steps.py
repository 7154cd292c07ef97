"""Load steps, probes and contact zones in a result file: see `solver.verification.results`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar, get_args, get_type_hints

import h5py
import numpy as np

from ..mechanics.mortar.edge import Edges
from ..mesh.files.vtkhdf import column, read_table, write_table
from ..simulation.results.forces import ProbeResult, Reaction, Resultants, RigidMotion
from ..simulation.results.solution import StepResult, ZoneEstimates, ZoneResult, ZoneSurfaces

_OF_STEP = (
    *("factor", "iterations", "status_changes", "residual", "complementarity"),
    "dissipation",
)
_RESULTANTS = ("area", "force", "moment", "pressure", "friction", "stick")
_OBSERVED = ("pressure", "gap", "status", "coverage")


def write_steps(file: h5py.File, steps: Sequence[StepResult]) -> None:
    """The cost of every step, its forces, and what was observed (steps, observed places)."""
    names = (*_OF_STEP, "work") if any(step.work for step in steps) else _OF_STEP
    rows = [{name: getattr(step, name) for name in names} for step in steps]
    observed = [step.observations for step in steps]
    write_table(file.create_group("steps"), rows)
    for name in ("reactions", "rigid"):
        forces = [{"step": i, **vars(one)} for i, s in enumerate(steps) for one in getattr(s, name)]
        write_table(file.create_group(name), forces)
    write_table(file.create_group("resultants"), list(_resultants(steps)))
    group = file.create_group("observation")
    group["factor"] = [step.factor for step in steps]
    first = observed[0] if observed else []
    group["zone"] = column([o["zone"] for o in first])
    group["macro_element"] = np.array([o["macro_element"] for o in first], dtype=int)
    for name in _OBSERVED:
        values = [[float(o[name]) for o in row] for row in observed]
        group[name] = np.reshape(values, (len(steps), len(first)))


def _resultants(steps: Sequence[StepResult]) -> Iterator[dict[str, Any]]:
    """Rows with the same columns: NaN where a zone has no friction and another one has."""
    found = [(i, zone, one) for i, s in enumerate(steps) for zone, one in s.resultants.items()]
    for i, zone, one in found:
        row: dict[str, Any] = {"step": i, "zone": zone}
        for name in _RESULTANTS:
            values = [getattr(other, name) for _, _, other in found]
            known = next((value for value in values if value is not None), None)
            if known is not None:
                mine = getattr(one, name)
                row[name] = np.full(known.shape, np.nan) if mine is None else mine
        yield row


def read_steps(file: h5py.File) -> list[StepResult]:
    """The steps back."""
    group = file["observation"]
    zones, elements = group["zone"].asstr()[()], group["macro_element"][()].tolist()
    values = {name: group[name][()] for name in _OBSERVED}
    tables = ("reactions", "resultants", "rigid")
    reactions, resultants, rigid = (_read_forces(file, name) for name in tables)
    return [
        StepResult(
            **row,
            observations=[
                {"zone": zone, "macro_element": element}
                | {name: float(values[name][i, j]) for name in _OBSERVED}
                for j, (zone, element) in enumerate(zip(zones, elements, strict=True))
            ],
            reactions=[Reaction(**row) for row in reactions.get(i, ())],
            rigid=[RigidMotion(**row) for row in rigid.get(i, ())],
            resultants={
                row.pop("zone"): Resultants(**{k: v for k, v in row.items() if _known(v)})
                for row in resultants.get(i, ())
            },
        )
        for i, row in enumerate(read_table(file["steps"]))
    ]


def _known(values: Any) -> bool:
    return not np.isnan(values).all()


def _read_forces(file: h5py.File, table: str) -> dict[int, list[dict[str, Any]]]:
    """The rows of a table of forces by step."""
    found: dict[int, list[dict[str, Any]]] = {}
    for row in read_table(file[table]):
        step = int(row.pop("step"))
        arrays = {k: np.array(v) if isinstance(v, list) else v for k, v in row.items()}
        found.setdefault(step, []).append(arrays)
    return found


def write_probes(group: h5py.Group, probes: Mapping[str, ProbeResult]) -> None:
    """A group for each probe, its arrays as data sets."""
    for name, probe in probes.items():
        for quantity, values in vars(probe).items():
            group[f"{name}/{quantity}"] = values


def read_probes(file: h5py.File) -> dict[str, ProbeResult]:
    """The probes back."""
    return {
        name: ProbeResult(**{key: data[()] for key, data in group.items()})
        for name, group in file["probes"].items()
    }


T = TypeVar("T")
# Data sets that are not named as their field.
_NAMES = {"closed": "status"}
# Records that a zone has or lacks: a group each.
_PARTS: dict[str, Any] = {
    name: kind
    for name, hint in get_type_hints(ZoneResult).items()
    for kind in get_args(hint)
    if is_dataclass(kind)
}


def write_zone(group: h5py.Group, zone: ZoneResult, number: int) -> None:
    """Write a zone, the `number` of which gives its place among all."""
    group.attrs["number"] = number
    for record in (zone, zone.surfaces, zone.estimates):
        _write(group, record)
    faces, masters = group.create_group("master_faces"), zone.surfaces.master_faces
    # Faces of one type may be in several blocks, one for each type of cell behind them.
    for kind in dict.fromkeys(kind for kind, _ in masters):
        faces[kind] = np.concatenate([nodes for name, nodes in masters if name == kind])
    for name in _PARTS:
        if part := getattr(zone, name):
            _write(group.create_group(name), part)
            words = {key: value for key, value in vars(part).items() if isinstance(value, str)}
            group[name].attrs.update(words)
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
    parts |= {
        "surfaces": _read(ZoneSurfaces, group, master_faces=masters),
        "estimates": _read(ZoneEstimates, group),
    }
    return _read(ZoneResult, group, name=name, faces=faces, **parts)


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
