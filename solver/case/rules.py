"""Whether vectors, directions and expressions of a case fit the dimension of its mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from solver.case.expressions import Expression
from solver.system.errors import InputError

if TYPE_CHECKING:
    from solver.case.reader import Case, Scalar


def check_dimension(case: Case, dim: int) -> None:
    """Raise `InputError` for a vector, direction or expression that does not fit the dimension."""
    allowed = f"must have {dim} components, as the mesh has"
    for key, vector in _vectors(case):
        if len(vector) != dim:
            shown = [v.text if isinstance(v, Expression) else v for v in vector]
            raise InputError(case.path, key, shown, allowed)
    if dim == 3:
        return
    for i, support in enumerate(case.supports):
        if "z" in support.fix:
            allowed = "z in a plane case; allowed are x, y and normal"
            raise InputError(case.path, f"supports[{i}].fix", "z", allowed)
    for expression in _expressions(case):
        if "z" in expression.names:
            allowed = "z in a plane case; allowed are x, y and r"
            raise InputError(case.path, expression.key, expression.text, allowed)


def _vectors(case: Case) -> Iterable[tuple[str, Sequence[Scalar]]]:
    """Every vector of the case, with its key."""
    for i, load in enumerate(case.loads):
        if isinstance(load.value, tuple):
            yield f"loads[{i}].{load.kind}", load.value
    for i, item in enumerate(case.observe):
        yield f"observe[{i}].nearest", item.nearest
    for key, value in case.reference.items():
        if isinstance(value, tuple):
            yield f"reference.{key}", value


def _expressions(case: Case) -> Iterable[Expression]:
    """Every expression of the case."""
    values: list[Any] = [support.fix for support in case.supports]
    values += [load.value for load in case.loads]
    values += case.reference.values()
    values += [zone.clearance for zone in case.zones]
    while values:
        value = values.pop()
        if isinstance(value, Expression):
            yield value
        elif isinstance(value, dict):
            values += value.values()
        elif isinstance(value, tuple):
            values += value
