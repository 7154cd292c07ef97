"""How long the points that are still to be measured will take, before any is begun."""

import json
import statistics
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from solver.mesh.catalogue import BY_NAME
from solver.study.description import Point, Study

# Nodes a cell, in large meshes of divisions of equal size (those of TRIA and TETRA are smaller).
_NODES = {
    "TRIA3": 1.1,
    "TRIA6": 4.5,
    "QUAD4": 1.0,
    "QUAD8": 3.0,
    "QUAD9": 4.0,
    "TETRA4": 1.1,
    "TETRA10": 8.0,
    "HEXA8": 1.0,
    "HEXA20": 4.0,
    "HEXA27": 8.0,
}
_START = 1.5  # seconds: libraries loaded, mesh made, record written
# Seconds a solve: factor and power of the unknowns, by dimension.
_COST = {2: (2e-5, 1.0), 3: (4e-6, 1.3)}


def unknowns(point: Point) -> float:
    """About how many unknowns a point has."""
    total = 0.0
    for cell, divisions in zip((point.slave, point.master), point.problem.divisions, strict=True):
        cells = 1
        for division in divisions:
            cells *= division * point.level
        total += cells * _NODES.get(cell, 2.0) * BY_NAME[cell].dim
    return total


def modelled(point: Point, repetitions: int) -> float:
    """Seconds that a point takes on a machine like that on which the model was measured."""
    factor, power = _COST[BY_NAME[point.slave].dim]
    return _START + (1 + repetitions) * factor * unknowns(point) ** power


def expected(study: Study, points: Sequence[Point], earlier: Mapping[str, float]) -> float:
    """Seconds that `points` will take.

    `earlier` has the seconds that points took before, by name; what it does not know is modelled,
    and the model scaled by how it fits what it does know.
    """
    ratios = [
        earlier[point.name] / modelled(point, study.repetitions)
        for point in study.points
        if point.name in earlier
    ]
    scale = statistics.median(ratios) if ratios else 1.0
    return sum(
        min(earlier.get(p.name) or scale * modelled(p, study.repetitions), study.limit)
        for p in points
    )


def measured_before(files: Iterable[Path]) -> dict[str, float]:
    """The seconds that points took, by name, from the records there are."""
    found = {}
    for file in files:
        try:
            record: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            found[str(record["point"])] = float(record["whole"])
        except (OSError, ValueError, KeyError, TypeError):
            continue  # a record that cannot be read is no measurement
    return found


def announcement(study: Study, folder: Path, pending: Sequence[Point]) -> str:
    """What is about to be measured and how long it will take; records lie in `folder`."""
    if not pending:
        return f"{study.title}: all {len(study.points)} points are measured."
    earlier = measured_before(folder / f"{point.name}.json" for point in study.points)
    seconds = expected(study, pending, earlier)
    basis = "from earlier measurements" if earlier else "from a model, not from this machine"
    shown = f"{seconds / 60:.0f} min" if seconds > 90 else f"{seconds:.0f} s"
    return (
        f"{study.title}: {len(pending)} of {len(study.points)} points to measure, one at a time, "
        f"on {study.threads} of this machine's cores: about {shown} ({basis})."
    )
