"""Cases on meshes that are refined step by step, as a study that is made of the command line."""

from collections.abc import Sequence
from pathlib import Path

from ..case.reader import load_case
from ..mesh.size import check_memory, of_mesh
from ..system.errors import InputError
from ..verification.run import refined
from .description import Series, Study, StudyGroup, Vary
from .page import MeasuredGroup
from .run import run_group

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
        if "path" not in case.mesh:
            size = of_mesh(case.mesh, path.parent, levels[-1])
            check_memory(int(size.points), size.dim, path)
        # What the case's own mesh is refined by comes first.
        change = {"mesh": {"refine": f"=level*{case.mesh.get('refine', 1)}"}}
        series = Series(path.stem, path, change, directions="swapped" if swapped else "first")
        vary: Vary = {"level": tuple(map(float, levels))}
        groups.append(
            StudyGroup(f"case-{number}", (series,), title=case.title or path.stem, vary=vary)
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
