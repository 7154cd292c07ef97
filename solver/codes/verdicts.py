"""The verdicts of other codes, and where they are: `results/<family>/<case>@<code>/`.

`verdict.json` as for our own solver; `result.vtkhdf` with the fields that the code gives;
`pressure.csv` with the contact pressure by place; `log` with the output of the code, written by
`run`.

A verdict speaks of the places of its case at which a foreign result has values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..lac.cells.catalogue import BY_MESHIO
from ..simulation.results.records import Cost
from ..system.files import seal, write_text
from ..verification.checks import run_checks
from ..verification.judge import judge, without_result
from ..verification.run import mesh_of
from ..verification.stored import write_verdict
from ..verification.verdict import FAILED, PARTIAL, PASSED, SOLVED, Files, Foreign, Verdict
from .compared import CHECKED_BY, Compared
from .contact import SurfaceValues
from .placing import NEAR

if TYPE_CHECKING:
    import meshio

    from ..case.model import Case
    from .foreign import ForeignResult


# A macro-element has a value where one is no farther than so many times the distance of values.
_BESIDE = 1.5
# Values at this share of all places are values everywhere: files leave out a node at times.
_ALL = 0.995


class Extent(NamedTuple):
    """At what number of how many places a field is compared, and what these are."""

    number: int
    total: int
    what: str

    @property
    def whole(self) -> bool:
        """Whether nothing is left out that matters."""
        return self.number >= _ALL * self.total

    def __str__(self) -> str:
        return f"{self.number} of {self.total} {self.what}"


def extents(compared: Compared) -> dict[str, Extent]:
    """By field that is given, where it is."""
    found: dict[str, Extent] = {}
    for name in ("displacement", "stress"):
        if name in compared.placed:
            found[name] = _in_bodies(compared, name)
    for name, given in (("pressure", compared.pressures_by_zone), ("gap", compared.gaps_by_zone)):
        if name in compared.placed:
            found[name] = _on_surfaces(compared, given)
    return found


def _in_bodies(compared: Compared, name: str) -> Extent:
    """Vertices of deformable cells, of the result's own mesh where it is another one."""
    model, placed = compared.model, compared.placed[name]
    points, used = model.points, ~model.rigid[model.body]
    if compared.own is not None:
        points = compared.own.mesh.points
        used = np.ones(len(points), dtype=bool)
    cells = compared.own.mesh.cells if compared.own is not None else model.mesh.cells
    vertex = np.zeros(len(points), dtype=bool)
    for block in cells:
        if block.dim == model.dim:
            vertex[block.data[:, : BY_MESHIO[block.type].n_vertices]] = True
    wanted = points[vertex & used]
    distance, _ = cKDTree(placed.places).query(wanted)
    near = NEAR * model.length
    if (placed.node < 0).all() and compared.own is None:
        near = _BESIDE * _spacing(placed.places)  # of cells, say
    bodies = placed.body[placed.body >= 0]
    if len(bodies) and compared.own is None:
        # Bodies that touch have nodes at one place: a body without a value inside it has none.
        inside = np.isin(model.body[vertex & used], bodies)
        distance = np.where(inside, distance, np.inf)
    return Extent(int((distance <= near).sum()), len(wanted), "nodes")


def _spacing(places: np.ndarray) -> float:
    """The usual distance of places (k, dim) from the nearest other one; 0 of a single one."""
    if len(places) < 2:
        return 0.0
    apart, _ = cKDTree(places).query(places, k=2)
    return float(np.median(apart[:, 1]))


def _on_surfaces(compared: Compared, given: list[SurfaceValues]) -> Extent:
    count = total = 0
    for zone in compared.model.solution.zones:
        covered = zone.coverage > 0
        total += int(covered.sum())
        for surface in given:
            if surface.zone.name != zone.name:
                continue
            places, model = surface.placed.places, compared.model
            near, _ = cKDTree(places).query(zone.centre)
            beside = _BESIDE * np.maximum(model.face_size(zone), _spacing(places))
            # The corners of a long face are farther away.
            beside = np.maximum(beside, model.reach(zone) + NEAR * model.length)
            count += int((covered & (near <= beside)).sum())
    return Extent(count, total, "contact faces")


NEEDED = ("displacement", "stress", "pressure")
"""The fields that a result needs to pass, as far as the case has a reference for them."""
VERDICT, RESULT, PRESSURE, LOG = "verdict.json", "result.vtkhdf", "pressure.csv", "log"


def check_foreign(
    case: Case,
    foreign: ForeignResult,
    mesh: meshio.Mesh | None = None,
    only: Sequence[str] | None = None,
) -> Verdict:
    """The verdict of another code's result: our checks of each quantity that it gives.

    `case` as it was solved (`Case.as_solved`); `mesh` is its mesh, made where it is not given. What
    the result does not give is listed in the verdict's `not_given`; where a field that the case has
    a reference for is missing, or has values at a part of the places, the verdict is `partial`.
    `only`: the fields to compare, a part on purpose. Raises InputError where the
    result does not belong to the case: another unit of length, mirrored, turned, shifted.
    """
    return _judged(Compared.of(case, foreign, mesh or mesh_of(case)), only)


def folder_of(results: Path, case: Case, code: str) -> Path:
    """The folder of a code's verdict in a folder of results."""
    return results / case.family / f"{case.job}@{code}"


def store(
    case: Case,
    foreign: ForeignResult,
    folder: Path,
    mesh: meshio.Mesh | None = None,
    only: Sequence[str] | None = None,
) -> Verdict:
    """Check a result and write verdict, fields and pressures into `folder`; the verdict.

    Raises InputError as `check_foreign` does; then nothing is written.
    """
    compared = Compared.of(case, foreign, mesh or mesh_of(case))
    verdict = _judged(compared, only)
    folder.mkdir(parents=True, exist_ok=True)
    if foreign.mesh is not None:
        _write_fields(folder / RESULT, foreign)
        file = Files(result=RESULT, result_sha256=seal(folder / RESULT))
        verdict = replace(verdict, files=file)
    if (rows := compared.pressures()) is not None:
        _write_pressures(folder / PRESSURE, rows)
    write_verdict(folder / VERDICT, verdict)
    return verdict


def without_foreign(
    case: Case,
    code: str,
    word: str,
    reason: str,
    *,
    version: str = "",
    settings: Mapping[str, str] | None = None,
    seconds: float | None = None,
) -> Verdict:
    """The verdict of a code that gave no result, for the reason given, for `write_verdict`.

    `word`: refused (it cannot express the case, or is not installed), failed (no convergence) or
    crashed (a crash, a hang).
    """
    verdict = without_result(word, reason, case, case.solved_as)
    named = _named(verdict, code, version, settings or {})
    return replace(named, cost=Cost.in_all(seconds))


def _named(verdict: Verdict, code: str, version: str, settings: Mapping[str, str]) -> Verdict:
    """The verdict in the name of a code."""
    return replace(
        verdict,
        problem=replace(verdict.problem, job=f"{verdict.problem.job}@{code}"),
        foreign=Foreign(code=code, code_version=version, settings=dict(settings)),
    )


def _judged(compared: Compared, only: Sequence[str] | None) -> Verdict:
    foreign, solution = compared.foreign, compared.solution
    samplers = compared.samplers
    if only is not None:
        asked = {"balance", *(check for name in only for check in CHECKED_BY[name])}
        samplers = {name: sampler for name, sampler in samplers.items() if name in asked}
    checks = run_checks(solution, samplers=samplers, allow=compared.tolerance)
    ran = [check.name for check in checks]
    verdict = judge(solution, checks)
    where, missing = extents(compared), compared.not_given(ran)
    wanted = [name for name in NEEDED if {*CHECKED_BY[name]} & {*missing, *ran}]
    unchecked = compared.unchecked(ran)
    too_few = [name for name in unchecked if {*CHECKED_BY[name]} & {*missing}]
    if verdict.verdict == PASSED or (verdict.verdict == SOLVED and wanted):
        asked_for = wanted if only is None else [name for name in wanted if name in only]
        less = [
            name
            for name in asked_for
            if name not in where or not where[name].whole or not {*CHECKED_BY[name]} & {*ran}
        ]
        if less or not asked_for:
            why = _incomplete(where, less, too_few)
            verdict = replace(verdict, verdict=PARTIAL, judged="", reason=why)
    cause = compared.faults([check for check in checks if not check.passed])
    if cause and verdict.verdict == FAILED:
        verdict = replace(verdict, reason=f"{cause} ({verdict.reason})")
    named = _named(verdict, foreign.code, foreign.version, foreign.settings)
    return replace(
        named,
        plan=[
            [name, "given; the case has no check of it"]
            for name in unchecked
            if name not in too_few
        ],
        values=replace(
            verdict.values,
            pressure=compared.extremes("pressure"),
            gap=compared.extremes("gap"),
            stress=compared.extremes("normal_stress"),
            status=None,
            coverage=None,
        ),
        estimates=replace(verdict.estimates, pressure_error_estimate=None),
        cost=Cost.in_all(
            foreign.seconds,
            macro_elements=solution.cost.macro_elements,
            cpu_seconds=foreign.cpu_seconds,
            peak_memory_mb=foreign.peak_memory_mb,
        ),
        foreign=replace(
            named.foreign,
            printed_digits=foreign.digits,
            not_given=missing,
            only=[name for name in wanted if name in only] if only and {*wanted} - {*only} else [],
            compared={n: str(extent) for n, extent in where.items() if n not in too_few},
        ),
    )


def _incomplete(where: Mapping[str, Extent], less: Sequence[str], too_few: Sequence[str]) -> str:
    """What was compared and what was not, in words."""
    given = {name: f"{name} at {extent}" for name, extent in where.items()}
    texts = {
        "compared": [text for name, text in given.items() if name not in too_few] or ["nothing"],
        "not given": [name for name in less if name not in given],
        "too few values for its checks": [given[name] for name in less if name in too_few],
    }
    return "; ".join(f"{what}: {', '.join(names)}" for what, names in texts.items() if names)


def _write_fields(path: Path, foreign: ForeignResult) -> None:
    """The fields of a result at the nodes of its own mesh, for ParaView."""
    import meshio

    from ..mesh.files.vtkhdf import new_file, write_grid
    from ..system.files import replacing

    mesh = foreign.mesh
    assert mesh is not None
    fields = {}
    for name in ("displacement", "stress", "pressure", "gap"):
        field = getattr(foreign, name)
        if field is not None and field.nodes is not None:
            values = np.full((len(mesh.points), *field.values.shape[1:]), np.nan)
            values[field.nodes] = field.values
            if name == "displacement":
                values = np.pad(values, ((0, 0), (0, 3 - values.shape[1])))
            fields[name] = values
    plain = meshio.Mesh(mesh.points, [(block.type, block.data) for block in mesh.cells])
    with replacing(path) as temporary, new_file(temporary) as file:
        write_grid(file.create_group("VTKHDF"), plain, fields, {})


def _write_pressures(path: Path, rows: np.ndarray) -> None:
    """Place and pressure (k, dim + 1), a line each."""
    head = ",".join([*"xyz"[: rows.shape[1] - 1], "pressure"])
    lines = [",".join(f"{value:.9g}" for value in row) for row in rows.tolist()]
    write_text(path, "\n".join([head, *lines]) + "\n")


def read_pressures(path: Path) -> np.ndarray:
    """The rows (k, dim + 1) that `store` wrote."""
    return np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
