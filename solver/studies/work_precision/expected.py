"""How long the points that are still to be measured will take, before any is begun.

For the study and whatever else is measured point by point, each with a record of its own that has
its name under `point` and the seconds it took under `whole`.
"""

import json
import statistics
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol

from solver.mesh.size import Size, of_body
from solver.studies.work_precision.description import Point, Study


class Announced(Protocol):
    """What is measured: its title, threads, and the seconds that a point may take at most."""

    @property
    def title(self) -> str: ...  # noqa: D102

    @property
    def threads(self) -> int: ...  # noqa: D102

    @property
    def limit(self) -> float: ...  # noqa: D102


_START = 1.5  # seconds: libraries loaded, mesh made, record written


def size(point: Point) -> Size:
    """About how large the mesh of a point is."""
    pairs = zip((point.slave, point.master), point.problem.divisions, strict=True)
    bodies = [of_body(cells, divisions, point.level) for cells, divisions in pairs]
    return Size(sum(body.points for body in bodies), bodies[0].dim)


def modelled(point: Point, repetitions: int) -> float:
    """Seconds that a point takes on a machine like that on which the model was measured."""
    return _START + (1 + repetitions) * size(point).seconds


def expected(
    model: Mapping[str, float], pending: Iterable[str], earlier: Mapping[str, float], limit: float
) -> float:
    """Seconds that the points of these names will take, each at most `limit`.

    `earlier` has the seconds that points took before; what it does not know is taken from the
    model, which is scaled by how it fits what is known.
    """
    ratios = [earlier[name] / seconds for name, seconds in model.items() if name in earlier]
    scale = statistics.median(ratios) if ratios else 1.0
    return sum(min(earlier.get(name) or scale * model[name], limit) for name in pending)


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


def model(study: Study) -> dict[str, float]:
    """Seconds that each point of a study takes, by name."""
    return {point.name: modelled(point, study.repetitions) for point in study.points}


def announcement(
    about: Announced, model: Mapping[str, float], folder: Path, pending: Collection[str]
) -> str:
    """What is about to be measured and how long it will take; records lie in `folder`."""
    if not pending:
        return f"{about.title}: all {len(model)} points are measured."
    earlier = measured_before(folder / f"{name}.json" for name in model)
    seconds = expected(model, pending, earlier, about.limit)
    basis = "from earlier measurements" if earlier else "from a model, not from this machine"
    shown = f"{seconds / 60:.0f} min" if seconds > 90 else f"{seconds:.0f} s"
    return (
        f"{about.title}: {len(pending)} of {len(model)} points to measure, one at a time, "
        f"on {about.threads} of this machine's cores: about {shown} ({basis})."
    )
