"""The result file: one HDF5 file that is also a VTKHDF grid, written whole or not at all.

`/VTKHDF` is the cut mesh with the slave sub-faces appended as cells, where bodies move far at all
positions, which ParaView plays; the file has everything else
that the checks need, so that it can be judged without solving:

    /case          source text, name, family, path, swapped, hexahedra, recovery
    /solve         lengths, sizes, cost and the linear solver of the solve
    /accuracy      what rounding alone may change, relative, by cause
    /errors        norms of the error against the case's exact solution, if it names one
    /mean_stress   by cell type, that of cells in mixed form at their nodes
    /contact/ZONE  arrays by macro-element, stress on both surfaces, master faces; in `nodal` those
                   of nodes where the treatment has its multipliers there; in `recovered` the
                   coefficients of a recovered pressure and its values at nodes; in `friction` its
                   traction on the slave, slip and status; in `resultants` area, force and moment of
                   contact, in `edges` where it ends in 2D
    /reactions /resultants /rigid
                   what holds each group; area, force and moment of contact in each zone; motion of
                   rigid bodies and contact on them; by step (counted from 0)
    /probes        by name: places with displacement and stress, or pressure
    /acted         by key of the case file: the nodes of each support and of each load on a surface
    /bodies /balance /steps /observation /plan /timings /checks
                   tables, a data set a column
    /provenance    versions, revision, hashes, machine

Where the case names its units, fields have them as their attribute `unit`, and the grid lists them.
Its last line is the hash of all before it: a file that was damaged is refused before HDF5 sees it.
The attribute `layout` tells names, types and shapes, for a file that another program changed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np

from ..case.model import Case
from ..case.reader import parse_case
from ..lac.cells.catalogue import cell_type
from ..mesh.files.vtkhdf import (
    Earlier,
    check_name,
    new_file,
    read_earlier,
    read_grid,
    read_table,
    write_grid,
    write_table,
)
from ..simulation.judgement.consistency import inconsistency
from ..simulation.results.fields import grid_fields, grid_of
from ..simulation.results.records import Cost, Fields, Places, Quality, Scalars, Validity
from ..simulation.results.solution import BodyInfo, Line, Position, Solution
from ..system.errors import InputError
from ..system.files import replacing, seal, seal_of
from .steps import read_probes, read_steps, read_zone, write_probes, write_steps, write_zone
from .units import label_fields
from .verdict import CheckResult

GRID = "VTKHDF"
_VECTORS = "reaction", "motion"


@dataclass
class Result:
    """The content of a result file: the solution, its provenance, and the file's hash."""

    solution: Solution
    provenance: dict[str, Any]
    sha256: str


def write_result(
    path: str | Path,
    solution: Solution,
    checks: Iterable[CheckResult],
    provenance: Mapping[str, Any],
) -> str:
    """Write a solution, its checks and its provenance to a `.vtkhdf` file; the file's hash."""
    check_name(Path(path))
    with replacing(path) as temporary:
        with new_file(temporary) as file:
            _write(file, solution, checks, provenance)
            file.attrs["layout"] = _layout(file)
        return seal(temporary)


def _write(
    file: h5py.File,
    solution: Solution,
    checks: Iterable[CheckResult],
    provenance: Mapping[str, Any],
) -> None:
    _write_grid(file.create_group(GRID), solution)
    _write_case(file.create_group("case"), solution)
    given = vars(solution.scalars) | vars(solution.cost) | {"ended": solution.ended}
    scalars = {k: v for k, v in given.items() if v is not None and not isinstance(v, dict)}
    file.create_group("solve").attrs.update(scalars)
    probes = file.create_group("probes", track_order=True)
    if solution.places.probes:
        write_probes(probes, solution.places.probes)
    acted = file.create_group("acted", track_order=True)
    for key, nodes in solution.places.acted.items():
        acted[key] = nodes.astype(np.int32)
    file.create_group("accuracy").attrs.update(solution.quality.accuracy)
    file.create_group("validity").attrs.update(asdict(solution.quality.validity))
    file.create_group("errors").attrs.update(solution.quality.errors)
    in_cells = file.create_group("mean_stress")
    for kind, values in solution.fields.by_cell.items():
        in_cells[kind] = values
    contact = file.create_group("contact")
    for number, zone in enumerate(solution.zones):
        write_zone(contact.create_group(zone.name), zone, number)
    _write_bodies(file.create_group("bodies"), solution.bodies)
    write_steps(file, solution.steps)
    write_table(
        file.create_group("balance"), _pairs("name", "value", solution.quality.balance.items())
    )
    write_table(file.create_group("timings"), _timings(solution))
    write_table(file.create_group("plan"), [line._asdict() for line in solution.plan])
    write_table(file.create_group("checks"), [_flat(check) for check in checks])
    file.create_group("provenance").attrs.update(provenance)
    label_fields(file[GRID], contact, solution.case.about.units)


def read_result(path: str | Path) -> Result:
    """Read a result file back; `InputError` for another kind of file, or a changed one."""
    if not Path(path).exists():
        raise _no_result(path, "there is no such file")
    if not (sha256 := seal_of(path)):
        raise _no_result(path, "damaged, of another version, or another kind of file")
    try:
        with h5py.File(path) as file:
            if file.attrs.get("layout") != _layout(file):
                raise _no_result(path, "its fields have other names, types or shapes")
            result = Result(_read_solution(file), _plain(file["provenance"].attrs), sha256)
        fault = inconsistency(result.solution)
    except InputError:
        raise
    except Exception as error:
        # Any error of the reader is caused by the file, which another version may have written.
        fault = " ".join(f"{type(error).__name__}: {error}".split())
        raise _no_result(path, fault) from error
    if fault:
        raise _no_result(path, fault)
    return result


def _layout(file: h5py.File) -> str:
    """A hash of names, types and shapes of all data sets and of their attributes."""
    lines: list[str] = []

    def add(name: bytes) -> None:
        item, place = h5py.h5o.open(file.id, name), name.decode()
        if isinstance(item, h5py.h5d.DatasetID):
            lines.append(f"{place} {item.dtype} {item.shape}")
        for number in range(h5py.h5a.get_num_attrs(item)):
            at = h5py.h5a.open(item, index=number)
            lines.append(f"{place} {at.name!r} {at.dtype} {at.shape}")

    h5py.h5o.visit(file.id, add)  # `visititems` takes half as long again
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()


def _no_result(path: str | Path, fault: str) -> InputError:
    allowed = f"must be a result written by `solve` ({fault}): solve again"
    return InputError(path, "file", None, allowed)


def _read_solution(file: h5py.File) -> Solution:
    grid, point_data, cell_data = read_grid(file[GRID])
    names = sorted(file["contact"], key=lambda name: file["contact"][name].attrs["number"])
    volumes = [i for i, block in enumerate(grid.cells) if block.dim == grid.points.shape[1]]
    scalars, dim = _plain(file["solve"].attrs), grid.points.shape[1]
    vectors = {name: point_data[name][:, :dim] for name in _VECTORS if name in point_data}
    return Solution(
        case=_read_case(file["case"]),
        mesh=meshio.Mesh(
            grid.points,
            [grid.cells[i] for i in volumes],
            cell_sets={k: [sets[i] for i in volumes] for k, sets in grid.cell_sets.items()},
        ),
        displacement=point_data["displacement"][:, :dim],
        stress=point_data["stress"],
        bodies=_read_bodies(file["bodies"]),
        zones=[
            read_zone(file["contact"][name], name, _sub_faces(grid, cell_data, number))
            for number, name in enumerate(names)
        ],
        steps=read_steps(file),
        plan=[Line(**row) for row in read_table(file["plan"])],
        scalars=Scalars(**_known(Scalars, scalars)),
        fields=Fields(
            body=point_data["body"],
            normal_stress=point_data["normal_stress"],
            by_cell={kind: data[()] for kind, data in file["mean_stress"].items()},
            **vectors,
        ),
        cost=Cost(
            **_known(Cost, scalars),
            seconds=dict(_read_pairs(file["timings"], "stage", "seconds")),
            stage_cpu_seconds=dict(_read_pairs(file["timings"], "stage", "cpu_seconds")),
        ),
        quality=Quality(
            balance=dict(_read_pairs(file["balance"], "name", "value")),
            accuracy=_plain(file["accuracy"].attrs),
            errors=_plain(file["errors"].attrs),
            validity=Validity(**_plain(file["validity"].attrs)),
        ),
        places=Places(
            probes=read_probes(file), acted={key: data[()] for key, data in file["acted"].items()}
        ),
        earlier=[Position(*one) for one in read_earlier(file[GRID])],
        ended=scalars["ended"],
    )


def _known(kind: type, scalars: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the scalars that a record of a `kind` has."""
    return {one.name: scalars[one.name] for one in fields(kind) if one.name in scalars}


# The grid


def _write_grid(group: h5py.Group, solution: Solution) -> None:
    """The volume cells, then the sub-faces of all zones, one block for each cell type."""
    grid, (points, cells) = grid_of(solution), grid_fields(solution)
    steps = [step.factor for step in solution.steps] if solution.earlier else []
    write_grid(group, grid, points, cells, Earlier(steps, solution.earlier))


def _sub_faces(
    grid: meshio.Mesh, cell_data: Mapping[str, np.ndarray], zone: int
) -> list[tuple[str, np.ndarray, np.ndarray]]:
    faces, start = [], 0
    for block in grid.cells:
        rows = slice(start, start := start + len(block.data))
        mine = cell_data["zone"][rows] == zone
        if mine.any():
            owner = cell_data["macro_element"][rows][mine]
            faces.append((cell_type(block.type).name, block.data[mine], owner))
    return faces


# Case, zones, bodies, steps


def _write_case(group: h5py.Group, solution: Solution) -> None:
    case = solution.case
    group["source"] = case.about.source
    group.attrs.update(
        name=case.name,
        family=case.family,
        path=str(case.path.resolve()),
        swapped=solution.swapped,
        hexahedra=case.solved_as.hexahedra or "",
        recovery=case.solved_as.recovery or "",
        steps=len(case.steps),
    )


def _read_case(group: h5py.Group) -> Case:
    case = parse_case(group["source"].asstr()[()], Path(group.attrs["path"]))
    kept = group.attrs
    solved_as = bool(kept["swapped"]), kept["hexahedra"] or None, kept["recovery"] or None
    return case.as_solved(*solved_as).until(int(kept["steps"]))


def _write_bodies(group: h5py.Group, bodies: Sequence[BodyInfo]) -> None:
    write_table(group, [{"name": b.name, "role": b.role, "faces": b.faces} for b in bodies])
    cells = [
        {"body": number, "type": kind, "count": count}
        for number, body in enumerate(bodies)
        for kind, count in body.cells.items()
    ]
    write_table(group.create_group("cells"), cells)


def _read_bodies(group: h5py.Group) -> list[BodyInfo]:
    cells = read_table(group["cells"])
    return [
        BodyInfo(
            name=row["name"],
            role=row["role"],
            faces=row["faces"],
            cells={cell["type"]: cell["count"] for cell in cells if cell["body"] == number},
        )
        for number, row in enumerate(read_table(group))
    ]


# Tables: a group with one data set for each column


def _flat(check: CheckResult) -> dict[str, Any]:
    row = asdict(check)
    accepted = row.pop("regression") or {}
    return row | {f"accepted_{key}": accepted.get(key) for key in ("minimum", "maximum")}


def _timings(solution: Solution) -> list[dict[str, Any]]:
    cpu = solution.cost.stage_cpu_seconds
    return [
        {"stage": stage, "seconds": seconds, "cpu_seconds": cpu.get(stage)}
        for stage, seconds in solution.cost.seconds.items()
    ]


def _pairs(key: str, value: str, pairs: Iterable[tuple[str, Any]]) -> list[dict[str, Any]]:
    return [{key: k, value: v} for k, v in pairs]


def _read_pairs(group: h5py.Group, key: str, value: str) -> list[tuple[str, Any]]:
    return [(row[key], row[value]) for row in read_table(group)]


def _plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes as plain Python values."""
    return {k: v.item() if isinstance(v, np.generic) else v for k, v in attributes.items()}
