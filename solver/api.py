"""The solver as a library: one call from a case to its solution, for scripts and notebooks.

    from solver import solve_case

    solved = solve_case("cases/ssnp170/e.yaml")
    print(solved.verdict, solved.pressure.max())

A case is checked by the same types whether it comes from a file or as a mapping, and
is refused by the same messages.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

import meshio
import numpy as np

from .case.expressions import Expression
from .case.model import Case
from .case.reader import load_case, parse_case
from .mesh import read_mesh
from .mesh.size import check_memory
from .mesh.tidy import tidy
from .simulation.options import Options
from .simulation.results.solution import Solution, ZoneResult
from .simulation.simulate import simulate
from .system.errors import InputError, key_path
from .system.progress import report_outcomes
from .verification.judge import judge
from .verification.provenance import gather
from .verification.results import write_result
from .verification.run import checked, mesh_of
from .verification.verdict import CheckResult, Verdict

CaseLike: TypeAlias = Case | Mapping[str, Any] | str | os.PathLike[str]
MeshLike: TypeAlias = meshio.Mesh | str | os.PathLike[str]

# What messages name where there is no file.
_NO_FILE, _NO_MESH_FILE = "case", "mesh"
_CHOICES = {
    "hexahedra": ("pyramids", "hexahedra"),
    "recovery": ("none", "linear", "quadratic", "smooth", "automatic"),
}


def solve_case(
    case: CaseLike,
    mesh: MeshLike | None = None,
    *,
    swapped: bool = False,
    hexahedra: str | None = None,
    recovery: str | None = None,
    everything: bool = False,
    memory_check: bool = True,
    log: Callable[[str], Any] = lambda _: None,
) -> Solved:
    """Solve a case and check the solution; nothing is written.

    `case` is the path of a case file, a mapping with the same keys (paths in it are relative to the
    working directory; numbers may be NumPy's), or a `Case`. `mesh`, a mesh file or a
    `meshio.Mesh` with named cell sets, is taken as it is in place of the case's own, and a
    mapping then needs no key `mesh`. `swapped` exchanges slave and master, `hexahedra` (pyramids
    or hexahedra) overrides how slave hexahedra are cut, `recovery` (none, linear, quadratic, smooth
    or automatic) how the pressure is recovered from constants. `everything`: what the scene does
    not need is done all the same (see `solver.simulation.options`). With `memory_check` a solve
    that cannot fit into memory is not begun. `log` is given lines on how it goes: `log=print`.

    A case file on its own mesh is compared with its accepted values too.

    Raises:
        InputError: case or mesh are refused, in one line: file, key, value, what is allowed.
        SolveError: there is no solution to be found: no convergence, a singular system.
    """
    for key, value in (("hexahedra", hexahedra), ("recovery", recovery)):
        if value not in (None, *_CHOICES[key]):
            raise InputError("solve_case", key, value, f"allowed: {', '.join(_CHOICES[key])}")
    given = _case(case, mesh).as_solved(swapped, hexahedra, recovery)
    made = mesh_of(given) if mesh is None else _mesh(mesh)
    accepted = mesh is None and given.path.is_file()
    options = Options.everything() if everything else Options()
    with report_outcomes(log):
        if memory_check:
            check_memory(len(made.points), made.points.shape[1], given.path)
        solution = simulate(given, made, options)
        checks = checked(solution, accepted)
    file = given.mesh.source.get("path") if mesh is None else mesh
    provenance = gather(given.path, None if isinstance(file, meshio.Mesh | None) else Path(file))
    return Solved(solution, checks, provenance)


@dataclass(frozen=True, repr=False)
class Solved:
    """A solve that came to its end, with its checks.

    Arrays are in the units of the case. n counts the nodes of the mesh after the cut, m the
    macro-elements of all contact zones, one zone after the other in the order of the case;
    `zones` has them apart, with areas, normals and faces. `solution` has everything.
    """

    solution: Solution
    checks: list[CheckResult]
    provenance: dict[str, str | int]

    @cached_property
    def outcome(self) -> Verdict:
        """The verdict as a typed record."""
        return judge(self.solution, self.checks, None, self.provenance)

    @property
    def record(self) -> dict[str, Any]:
        """All that the report would show, plain values as `check --json` prints them."""
        return self.outcome.plain()

    @property
    def verdict(self) -> str:
        """One of passed, solved (without a reference), failed, unreliable, as in the report."""
        return self.outcome.verdict

    @property
    def passed(self) -> bool:
        """Whether all checks hold, one of them against a reference, with digits enough."""
        return self.outcome.passed

    @property
    def reason(self) -> str:
        """Why it did not pass, in one line; empty where it did."""
        return self.outcome.reason

    @property
    def points(self) -> np.ndarray:
        """Nodes (n, dim), undeformed."""
        return self.solution.mesh.points

    @property
    def displacement(self) -> np.ndarray:
        """Displacement (n, dim) at the nodes."""
        return self.solution.displacement

    @property
    def stress(self) -> np.ndarray:
        """Stress (n, 6) at the nodes, xx, yy, zz, xy, yz, xz, positive in tension."""
        return self.solution.stress

    @property
    def zones(self) -> dict[str, ZoneResult]:
        """The contact zones by name."""
        return {zone.name: zone for zone in self.solution.zones}

    @property
    def centre(self) -> np.ndarray:
        """Centres (m, dim) of the macro-elements."""
        none = np.empty((0, self.points.shape[1]))
        return np.concatenate([none, *(zone.centre for zone in self.solution.zones)])

    @property
    def pressure(self) -> np.ndarray:
        """Contact pressure (m,) on the macro-elements, ≥ 0 in compression."""
        return np.concatenate([np.empty(0), *(zone.multiplier for zone in self.solution.zones)])

    @property
    def gap(self) -> np.ndarray:
        """Average gap (m,) of the macro-elements, ≥ 0 where open."""
        return np.concatenate([np.empty(0), *(zone.gap for zone in self.solution.zones)])

    @property
    def contact_force(self) -> np.ndarray:
        """The force (dim,) on the slaves of all zones, in the last step."""
        resultants = self.solution.steps[-1].resultants.values()
        return sum((each.force for each in resultants), np.zeros(self.points.shape[1]))

    @property
    def contact_area(self) -> float:
        """The area in contact, of all zones, in the last step."""
        return float(sum(each.area[0] for each in self.solution.steps[-1].resultants.values()))

    @property
    def table(self) -> dict[str, np.ndarray]:
        """The macro-elements as columns (m,), for `pandas.DataFrame(solved.table)`."""
        zones = self.solution.zones
        columns = {"zone": [np.full(len(zone.multiplier), zone.name) for zone in zones]}
        for i, axis in enumerate("xyz"[: self.points.shape[1]]):
            columns[axis] = [zone.centre[:, i] for zone in zones]
        names = {"pressure": "multiplier"} | {n: n for n in ("gap", "closed", "area", "coverage")}
        for name, of in names.items():
            columns[name] = [getattr(zone, of) for zone in zones]
        return {n: np.concatenate(parts) if parts else np.empty(0) for n, parts in columns.items()}

    def to_pyvista(self) -> Any:
        """The result as PyVista reads its file; raises ImportError where PyVista is missing."""
        import pyvista

        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "result.vtkhdf"
            self.save(file)
            return pyvista.read(file)

    def plot(self, scalars: str = "pressure", **options: Any) -> Any:
        """Show a field in PyVista's window; `options` go to its `plot`.

        Fields of slave faces, such as the pressure, are shown without the bodies, which hide them;
        the colours of the pressure begin at zero.
        """
        grid = self.to_pyvista()
        defaults: dict[str, Any] = {"line_width": 6}
        if scalars in grid.cell_data:
            grid = grid.threshold(0, scalars="zone")
        if scalars == "pressure":
            defaults["clim"] = (0.0, float(self.pressure.max(initial=0.0)) or 1.0)
        return grid.plot(scalars=scalars, **defaults | options)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result file, as `solve -o` does: whole or not at all, named `.vtkhdf`."""
        write_result(Path(path), self.solution, self.checks, self.provenance)

    def picture(self) -> str:
        """The report's picture, as SVG: both meshes and the contact pressure."""
        from .report.pictures import draw

        return str(draw(self.solution, self.solution.job))

    def profile(self, along: str | None = None, zone: str | None = None) -> str:
        """The report's figure of the pressure along the interface, as SVG.

        Over the distance along the interface, or over an expression in x, y, z, r such as "r"; of
        the first zone, or the one named.
        """
        from .report.pictures import draw_pressure

        over = Expression(along, where="profile", key="along") if along else None
        return draw_pressure(self.solution, self.solution.job, over, zone).svg()

    def __str__(self) -> str:
        return self.outcome.summary

    def __repr__(self) -> str:
        return f"<Solved {self.outcome.summary}>"

    def _repr_html_(self) -> str:
        """For notebooks: the picture, and the verdict in one line."""
        from markupsafe import escape

        return f"<figure>{self.picture()}<figcaption>{escape(self)}</figcaption></figure>"


def _case(given: CaseLike, mesh: MeshLike | None) -> Case:
    if isinstance(given, Case):
        return given
    if isinstance(given, Mapping):
        content = _plain(given, ())
        if mesh is not None:
            file = os.fspath(mesh) if isinstance(mesh, str | os.PathLike) else _NO_MESH_FILE
            content.setdefault("mesh", {"file": file})
        # JSON is YAML: from here on it is as if it had been read from a file.
        return parse_case(json.dumps(content, ensure_ascii=False, indent=1), Path(_NO_FILE))
    if isinstance(given, str | os.PathLike):
        return load_case(Path(given))
    raise InputError("solve_case", "case", given, "must be a path, a mapping or a Case")


def _mesh(given: MeshLike) -> meshio.Mesh:
    if isinstance(given, meshio.Mesh):
        return tidy(given, _NO_MESH_FILE)
    if isinstance(given, str | os.PathLike):
        return read_mesh(given)
    raise InputError("solve_case", "mesh", given, "must be a path or a meshio.Mesh")


def _plain(value: Any, keys: tuple[str | int, ...]) -> Any:
    """A value as a file could hold it; refused where none could."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise InputError(_NO_FILE, key_path([*keys, str(key)]), None, "keys must be text")
        return {key: _plain(item, (*keys, key)) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, (*keys, i)) for i, item in enumerate(value)]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    allowed = "must be a number, text, true or false, a list or a mapping"
    raise InputError(_NO_FILE, key_path(keys), value, allowed)
