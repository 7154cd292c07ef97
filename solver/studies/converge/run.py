"""A case on meshes that are refined step by step: its quantities with order, value and band."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...case.reader import load_case
from ...mesh.size import check_memory
from ...simulation.simulate import simulate
from ...system.errors import InputError
from ...verification.run import mesh_of, refined
from ..fits import ROUND_OFF
from .quantities import Quantity, quantities
from .richardson import Extrapolation, extrapolate, observed_order

LEVELS = (1, 2, 4)
# An exact value that is integrated on the mesh counts where it changes less than so much of what
# the computed one does.
_SETTLED = 0.1


@dataclass(frozen=True, kw_only=True)
class Converged:
    """A quantity on all meshes, coarsest first, and what follows for its limit.

    `known` is the exact value; `contained`: whether the band has it. Both None where the exact
    value is unknown, the latter also where there is no band.
    """

    name: str
    values: list[float]
    found: Extrapolation
    known: float | None = None
    contained: bool | None = None


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """A case on all meshes: what its divisions are multiplied by, unknowns, and its quantities.

    `estimate`: the estimated relative error of constant pressures in L2, mesh by mesh, and its
    order; empty and None without an estimate. Its limit is zero, so that it has no band.
    """

    job: str
    case: str
    levels: list[int]
    unknowns: list[int]
    quantities: list[Converged]
    estimate: list[float] = field(default_factory=list)
    estimate_order: float | None = None


def converge(path: Path, levels: Sequence[int] = LEVELS, swapped: bool = False) -> Convergence:
    """Solve a case on each level and extrapolate.

    `levels` (n,), rising, multiply the divisions of the case's recipe; those of a mesh file halve
    its cells and are powers of two. InputError where they are fewer than three or not rising, or
    where the case cannot be refined.
    """
    if len(levels) < 3 or levels[0] < 1 or list(levels) != sorted(set(levels)):
        raise InputError(path, "--levels", list(levels), "must be three or more, each finer")
    unknowns, rows, estimates, job = [], [], [], ""
    for level in levels:
        case = refined(load_case(path).as_solved(swapped), level)
        mesh = mesh_of(case)
        check_memory(len(mesh.points), mesh.points.shape[1], case.path)
        solution = simulate(case, mesh)
        unknowns.append(solution.dofs)
        rows.append(quantities(solution))
        estimates.append(solution.pressure_error_estimate)
        job = solution.job
    sizes = [1 / level for level in levels]
    known = [one for one in estimates if one is not None]
    some = len(known) == len(levels) and min(known) > ROUND_OFF
    return Convergence(
        job=job,
        case=str(path),
        levels=list(levels),
        unknowns=unknowns,
        quantities=[_converged(sizes, row) for row in zip(*rows, strict=True)],
        estimate=known if some else [],
        estimate_order=observed_order(sizes[-3:], known[-3:]) if some else None,
    )


def _converged(sizes: Sequence[float], row: Sequence[Quantity]) -> Converged:
    """One quantity on all meshes."""
    values = [one.value for one in row]
    found = extrapolate(sizes, values, row[-1].theory, max(one.scale for one in row))
    known = settled(row)
    inside = None
    if known is not None and found.band is not None:
        inside = abs(values[-1] - known) <= found.band
    return Converged(name=row[-1].name, values=values, found=found, known=known, contained=inside)


def settled(row: Sequence[Quantity]) -> float | None:
    """The exact value on the finest mesh, where it depends little enough on the mesh."""
    *_, before, last = row
    if before.known is None or last.known is None:
        return None
    change = abs(last.value - before.value)
    allowed = max(_SETTLED * change, ROUND_OFF * max(last.scale, abs(last.value)))
    return last.known if abs(last.known - before.known) <= allowed else None


def contained(found: Sequence[Convergence], exact: bool = False) -> tuple[int, int, int]:
    """Bands with the exact value in them, bands, and quantities whose exact value is known.

    Of the quantities that do not depend on the mesh if `exact`, else of all others.
    """
    every = (one for each in found for one in each.quantities if one.known is not None)
    known = [one for one in every if (one.found.kind == "exact") is exact]
    bands = [one.contained for one in known if one.contained is not None]
    return sum(map(bool, bands)), len(bands), len(known)
