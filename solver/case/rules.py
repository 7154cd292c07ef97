"""The rules of a case file that go beyond single keys; none of them needs the mesh itself."""

from collections.abc import Iterable, Sequence
from typing import Any

from ..system.errors import InputError, hint
from .expressions import Expression
from .model import SWAPPED, Case, Load, Scalar, Support

# The errors of `solver.verification.norms`, and what a solution must have for each to be known.
ERRORS: dict[str, str] = {
    "displacement_l2": "displacement",
    "displacement_h1": "gradient",
    "stress_l2": "stress",
    "stress_max": "stress",
    "pressure_l2": "contact_pressure",
    "pressure_max": "contact_pressure",
    "pressure_means": "contact_pressure",
    "pressure_oscillation": "contact_pressure",
    "half_width": "half_width",
    "peak": "peak",
}
# Keys of the reference that need contact.
_OF_CONTACT = {"contact_pressure", "gap", "force", "contact_area"}
# The vectors of a selection.
_PARTS = {"plane": ("point", "normal"), "sphere": ("centre",), "box": ("low", "high")}


def check_rules(case: Case) -> None:
    """Raise `InputError` for what neither the types of the keys nor the mesh decide."""
    if case.name.endswith(SWAPPED):
        allowed = f"must not end in {SWAPPED}: that is the name of the other direction"
        raise InputError(case.path, "name", case.name, allowed)
    _check_names(case)
    _check_steps(case)
    _check_listed_twice(case)
    _check_errors(case)
    _check_reference(case)
    if case.plane:
        check_dimension(case, 2)
    for group, material in case.materials.items():
        if case.thin and material.form == "mixed":
            allowed = "plane stress has no incompressible limit; allowed: automatic, displacement"
            raise InputError(case.path, f"materials.{group}.form", material.form, allowed)


def _check_steps(case: Case) -> None:
    """Steps are all factors, or all factors of the same names; only these have the names."""
    acting: dict[str, Support | Load] = {
        **{f"supports[{i}].name": s for i, s in enumerate(case.supports) if s.name},
        **{f"loads[{i}].name": load for i, load in enumerate(case.loads) if load.name},
    }
    names = {one.name for one in acting.values()}
    for i, step in enumerate(case.steps):
        given = set(step) if isinstance(step, dict) else set()
        if isinstance(step, dict) != isinstance(case.steps[0], dict):
            allowed = "steps are factors, or mappings of names to factors, not both"
            raise InputError(case.path, f"steps[{i}]", step, allowed)
        if given - names:
            name = min(given - names)
            allowed = f"no load or support has this name; {hint(name, names)}"
            raise InputError(case.path, f"steps[{i}].{name}", None, allowed)
        if names - given:
            allowed = f"gives no factor of {min(names - given)}"
            raise InputError(case.path, f"steps[{i}]", step, allowed)
    for key, one in acting.items():
        if isinstance(one, Support) and not any(one.fix.values()):
            allowed = "only a support with imposed values has a factor"
            raise InputError(case.path, key, one.name, allowed)


def _check_names(case: Case) -> None:
    names: set[str] = set()
    for i, zone in enumerate(case.zones):
        if zone.slave == zone.master:
            allowed = "the slave is its own master: they must be two groups"
            raise InputError(case.path, f"contact[{i}].master", zone.master, allowed)
        if zone.name in names:
            allowed = "the name is given to two zones; each needs its own"
            raise InputError(case.path, f"contact[{i}].name", zone.name, allowed)
        if zone.points and zone.treatment != "quadrature":
            allowed = "only the treatment quadrature has points"
            raise InputError(case.path, f"contact[{i}].points", zone.points, allowed)
        if zone.normal != "element" and zone.treatment in ("quadrature", "node_to_segment"):
            allowed = f"the treatment {zone.treatment} has normals of its own; allowed: element"
            raise InputError(case.path, f"contact[{i}].normal", zone.normal, allowed)
        if zone.stabilised and zone.treatment not in ("lac", "quadrature"):
            allowed = f"the treatment {zone.treatment} has no pressure that could be stabilised; "
            allowed += "allowed there: lac, quadrature"
            raise InputError(case.path, f"contact[{i}].stabilised", "true", allowed)
        names.add(zone.name)
    for i, item in enumerate(case.observe):
        if item.zone not in names:
            allowed = f"no such zone; {hint(item.zone, names)}"
            raise InputError(case.path, f"observe[{i}].zone", item.zone, allowed)


def _check_errors(case: Case) -> None:
    """An error against an exact solution can have a tolerance only where there is such a one."""
    if not case.tolerance:
        return
    for error in case.tolerance.keys() & ERRORS.keys():
        if case.solution is None:
            allowed = "needs an exact solution: reference.solution names none"
        elif ERRORS[error] not in case.solution.quantities:
            allowed = f"{case.solution.name} has no {ERRORS[error]}"
        else:
            continue
        raise InputError(case.path, f"tolerance.{error}", case.tolerance[error], allowed)


def _check_reference(case: Case) -> None:
    """Every value of the reference feeds a check; no tolerance admits any result at all."""
    for check, tolerance in case.tolerance.items():
        if tolerance > 1:
            allowed = "must be at most 1: then the error is as large as the reference"
            raise InputError(case.path, f"tolerance.{check}", tolerance, allowed)
    for key in case.reference.keys() & _OF_CONTACT if not case.zones else ():
        allowed = "cannot be compared: the case has no contact"
        raise InputError(case.path, f"reference.{key}", str(case.reference[key]), allowed)
    if case.reference_kind and not case.reference and case.solution is None:
        allowed = "gives no value to compare with, such as contact_pressure"
        raise InputError(case.path, "reference.kind", case.reference_kind, allowed)
    if case.solution and not case.reference and not case.tolerance.keys() & ERRORS.keys():
        known = [name for name, what in ERRORS.items() if what in case.solution.quantities]
        allowed = "nothing is compared with it; give a value (`contact_pressure: solution`) or a "
        allowed += f"tolerance for one of {', '.join(known)}"
        raise InputError(case.path, "reference.solution", case.solution.name, allowed)


def _check_listed_twice(case: Case) -> None:
    """A direction of a group is fixed once, a kind of load on a group is given once."""
    fixed = [
        (f"supports[{i}]", s.group, axis) for i, s in enumerate(case.supports) for axis in s.fix
    ]
    sprung = [
        (f"supports[{i}]", s.group, f"spring {axis}")
        for i, s in enumerate(case.supports)
        for axis in s.spring
    ]
    loaded = [(f"loads[{i}]", load.group, load.kind) for i, load in enumerate(case.loads)]
    for given in (fixed, sprung, loaded):
        seen: set[tuple[str, str]] = set()
        for key, group, what in given:
            if (group, what) in seen:
                allowed = f"the group is listed twice with {what}"
                raise InputError(case.path, f"{key}.group", group, allowed)
            seen.add((group, what))


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
        for key in ("fix", "spring", "together"):
            if "z" in getattr(support, key):
                allowed = "z in a plane case; allowed are x, y and normal"
                raise InputError(case.path, f"supports[{i}].{key}", "z", allowed)
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
    for made in case.selections:
        if made.shape == "at":
            yield made.key, made.values
        for key, value in zip(_PARTS.get(made.shape, ()), made.values, strict=False):
            yield f"{made.key}.{made.shape}.{key}", value
    for key, value in case.reference.items():
        if isinstance(value, tuple):
            yield f"reference.{key}", value
        if key == "reaction" and isinstance(value, dict):
            yield from ((f"reference.reaction.{group}", v) for group, v in value.items())


def _expressions(case: Case) -> Iterable[Expression]:
    """Every expression of the case."""
    values: list[Any] = [{**support.fix, **support.spring} for support in case.supports]
    values += [load.value for load in case.loads]
    values += case.reference.values()
    values += [zone.clearance for zone in case.zones]
    values += [made.values for made in case.selections]
    while values:
        value = values.pop()
        if isinstance(value, Expression):
            yield value
        elif isinstance(value, dict):
            values += value.values()
        elif isinstance(value, tuple):
            values += value
