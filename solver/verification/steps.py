"""Load steps and probes in a result file: see `solver.verification.results`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import h5py
import numpy as np

from ..simulation.results.forces import ProbeResult, Reaction, Resultants, RigidMotion
from ..simulation.results.solution import StepResult
from ..system.hdf5 import column, read_table, write_table

_OF_STEP = (
    *("factor", "iterations", "status_changes", "residual", "complementarity"),
    *("dissipation", "contraction"),
)
_RESULTANTS = ("area", "force", "moment", "pressure", "friction", "stick")
_OBSERVED = ("pressure", "gap", "status", "coverage")


def write_steps(file: h5py.File, steps: Sequence[StepResult]) -> None:
    """The cost of every step, its forces, and what was observed (steps, observed places)."""
    rows = [{name: getattr(step, name) for name in _OF_STEP} for step in steps]
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
    """The rows of a table of forces by step; files of earlier versions name no step."""
    found: dict[int, list[dict[str, Any]]] = {}
    for row in read_table(file[table]) if table in file else []:
        step = int(row.pop("step", 0))
        arrays = {k: np.array(v) if isinstance(v, list) else v for k, v in row.items()}
        found.setdefault(step, []).append(arrays)
    return found


def write_probes(group: h5py.Group, probes: Mapping[str, ProbeResult]) -> None:
    """A group for each probe, its arrays as data sets."""
    for name, probe in probes.items():
        for quantity, values in vars(probe).items():
            group[f"{name}/{quantity}"] = values


def read_probes(file: h5py.File) -> dict[str, ProbeResult]:
    """The probes back; none in files of earlier versions."""
    return {
        name: ProbeResult(**{key: data[()] for key, data in group.items()})
        for name, group in file.get("probes", {}).items()
    }
