"""What refined meshes tell of cases: order, limit and uncertainty, and the errors to expect."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..case.model import MARGIN
from ..case.reader import load_case
from ..mesh.size import check_memory, of_mesh
from ..simulation.simulate import simulate
from ..system.errors import InputError
from ..verification.run import checked, mesh_of, refined
from .description import Series, Study, StudyGroup, Vary
from .page import MeasuredGroup
from .run import run_group
from .theory import ROUND_OFF, fit_power

_TEXT = """Each quantity is computed on refined meshes. Its observed order gives the limit by
Richardson's extrapolation, and a band around the value of the finest mesh (ASME V&V 20)."""


def convergence(
    cases: Sequence[Path], levels: Sequence[int], swapped: bool = False
) -> tuple[Study, list[MeasuredGroup]]:
    """The cases measured on each level, and the study that they make.

    `levels` (n,), rising, multiply the divisions of a case's recipe; those of a mesh file halve its
    cells and are powers of two. InputError where they are fewer than three or not rising, or where
    a case cannot be refined or is refused.
    """
    groups = []
    for number, path in enumerate(cases):
        if len(levels) < 3 or levels[0] < 1 or list(levels) != sorted(set(levels)):
            raise InputError(path, "--levels", list(levels), "must be three or more, each finer")
        case = load_case(path)
        for level in levels:
            refined(case, level)
        if "path" not in case.mesh.source:
            size = of_mesh(case.mesh.source, path.parent, levels[-1])
            check_memory(int(size.points), size.dim, path)
        # What the case's own mesh is refined by comes first.
        change = {"mesh": {"refine": f"=level*{case.mesh.source.get('refine', 1)}"}}
        series = Series(path.stem, path, change, directions="swapped" if swapped else "first")
        vary: Vary = {"level": tuple(map(float, levels))}
        groups.append(
            StudyGroup(f"case-{number}", (series,), title=case.about.title or path.stem, vary=vary)
        )
    study = Study(
        "converge",
        "Results of refined meshes",
        tuple(groups),
        figure="limits",
        measure="quantities",
        text=_TEXT,
    )
    measured = []
    for group in groups:
        record = run_group(study, group)
        for point in record["points"]:
            if point["outcome"] == "refused":
                raise InputError(point["case"], "converge", None, point["reason"])
        measured.append(MeasuredGroup(study, group, record["points"], record["machine"]))
    return study, measured


# The discretisation errors that a refinement ladder predicts for a case's own mesh.

LEVELS = (1, 2, 4)


def expected_errors(path: Path, levels: Sequence[int] = LEVELS) -> dict[str, float]:
    """The expected error by check, of those that compare the case with a reference.

    `levels` multiply the divisions of the case's recipe; checks with an error of zero or round-off
    on any of them have none. Raises InputError where the case cannot be refined.
    """
    case = load_case(path)
    found: dict[str, float] = {}
    for swapped in (False, True)[: 1 + (case.about.directions == "both")]:
        for name, errors in _ladder(path, swapped, levels).items():
            if len(errors) == len(levels) and min(errors) > ROUND_OFF:
                found[name] = max(found.get(name, 0.0), at_first(levels, errors))
    return found


def at_first(levels: Sequence[int], errors: Sequence[float]) -> float:
    """The power law through errors (n,) of levels (n,), at the first level.

    Where it is too low there by more than the margin, errors on finer meshes cancel: then the first
    of them.

    >>> round(at_first([1, 2, 4], [4.0, 1.0, 0.25]), 12)
    4.0
    >>> at_first([1, 2, 4], [4.0, 0.01, 0.25])
    4.0
    """
    sizes = 1.0 / np.array(levels)
    fit = fit_power(sizes, errors)
    if fit is None:
        return float(errors[0])
    middle = np.log(errors).mean() - fit.value * np.log(sizes).mean()
    law = float(np.exp(middle + fit.value * np.log(sizes[0])))
    return law if errors[0] <= MARGIN * law else float(errors[0])


def _ladder(path: Path, swapped: bool, levels: Sequence[int]) -> dict[str, list[float]]:
    """The errors of each check, level by level."""
    errors: dict[str, list[float]] = {}
    for level in levels:
        case = refined(load_case(path).as_solved(swapped), level)
        checks = checked(simulate(case, mesh_of(case)), accepted=False)
        worst: dict[str, float] = {}
        for check in checks:
            if check.verifies:
                worst[check.name] = max(worst.get(check.name, 0.0), check.error)
        for name, error in worst.items():
            errors.setdefault(name, []).append(error)
    return errors
