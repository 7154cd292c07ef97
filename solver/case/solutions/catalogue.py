"""The documented exact solutions of the project, by name, and how a case file asks for one.

    reference:
      kind: analytical
      solution: {name: nested_cylinders, radii: [20, 30, 40], inner: bottom, outer: top}

A material is given as {young, poisson}, as the name of a group of the case, or as `rigid`. Left
out, it is that of the group of the parameter's own name, or of `all`. Pressure and interference are
the case's own where it has one only.
"""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from math import inf
from typing import Any

from ...system.errors import InputError, hint
from ..material import Material
from . import (  # noqa: F401 -- the classes in them enter SOLUTIONS
    frictional,
    hertz,
    nested,
    polynomial,
    pressed,
    receding,
    sheared_sphere,
    sliding_rigid,
    waves,
)
from .base import SOLUTIONS, ExactSolution, ParameterError
from .meridian import Meridian

_ALL, _RIGID = "all", "rigid"


@dataclass(frozen=True)
class Known:
    """Values known from the case: its file, materials by group, dimension, and single values.

    `pressure`, `interference` and `friction` are None where the case has none, or more than one.
    `plane_stress`: so is the solution. `axisymmetric`: a solution of three dimensions is seen in
    one meridian plane.
    """

    where: object
    materials: Mapping[str, Material]
    dimension: int
    pressure: float | None = None
    interference: float | None = None
    friction: float | None = None
    axisymmetric: bool = False
    plane_stress: bool = False

    @property
    def extruded(self) -> int:
        """The dimension for a plane state, which is not one of bodies around an axis."""
        return 2 if self.axisymmetric else self.dimension


def build(
    given: str | Mapping[str, Any] | None, known: Known, key: str = "reference.solution"
) -> ExactSolution:
    """The solution that a case file names under a `key`, alone or with parameters.

    Raises InputError for an unknown name or parameter, and for a value not allowed.
    """
    values = dict(given) if isinstance(given, Mapping) else {"name": given}
    name = values.pop("name", None)
    if not isinstance(name, str) or name not in SOLUTIONS:
        place = f"{key}.name" if isinstance(given, Mapping) else key
        allowed = "this key is needed" if name is None else "no such solution"
        raise InputError(known.where, place, name, f"{allowed}; {hint(str(name), SOLUTIONS)}")
    cls = SOLUTIONS[name]
    parameters = {f.name: f for f in fields(cls) if f.init}  # type: ignore[arg-type]
    settable = [n for n in parameters if n != "dim"]
    for unknown in values:
        if unknown not in settable:
            allowed = f"{name} has no such parameter; {hint(unknown, settable)}"
            raise InputError(known.where, f"{key}.{unknown}", values[unknown], allowed)
    reader = _ParameterReader(known, key)
    taken = {n: reader.value(f, values.get(n)) for n, f in parameters.items()}
    try:
        solution = cls(**{n: value for n, value in taken.items() if value is not None})
    except ParameterError as error:
        parameter = error.parameter
        shown = values.get(parameter, error.value)
        if isinstance(shown, Material):  # the case's own
            shown = parameter if parameter in known.materials else _ALL
        raise InputError(known.where, f"{key}.{parameter}", shown, error.allowed) from None
    if solution.dim != known.dimension:
        allowed = f"is for {solution.dim} dimensions; the case has {known.dimension}"
        raise InputError(known.where, key, name, allowed)
    return Meridian(solution) if known.axisymmetric else solution


# Powers of smaller or larger numbers leave the range of double precision.
_SMALLEST = 1e-30


class _ParameterReader:
    """Turns what a case file gives for a parameter, or what the case knows, into a value."""

    def __init__(self, known: Known, key: str):
        self.known, self.key = known, key

    def value(self, parameter: Any, given: Any) -> Any:
        """The value; None where the parameter's default holds."""
        source, name = parameter.metadata["source"], parameter.name
        if source == "material":
            return self.material(name, given)
        if source == "solution":
            return build(given, self.known, f"{self.key}.{name}")
        if given is None and source:
            given = getattr(self.known, source)
        if given is None:
            if parameter.default is MISSING:
                allowed = f"this parameter is needed: {parameter.metadata['doc']}"
                raise InputError(self.known.where, f"{self.key}.{name}", None, allowed)
            return None
        if name == "dim":
            return given
        if "tuple" in str(parameter.type):
            return self.numbers(name, given)
        return self.number(name, given)

    def number(self, name: str, given: Any) -> float:
        fits = isinstance(given, int | float) and not isinstance(given, bool)
        if not fits or not (given == 0 or _SMALLEST <= abs(given) <= 1 / _SMALLEST):
            allowed = f"must be a number: 0, or from {_SMALLEST:g} to {1 / _SMALLEST:g} in size"
            raise InputError(self.known.where, f"{self.key}.{name}", given, allowed)
        return float(given)

    def numbers(self, name: str, given: Any) -> tuple[float, ...]:
        if not isinstance(given, list | tuple):
            allowed = "must be a list of numbers"
            raise InputError(self.known.where, f"{self.key}.{name}", given, allowed)
        return tuple(self.number(f"{name}[{i}]", item) for i, item in enumerate(given))

    def material(self, name: str, given: Any) -> Material:
        groups = self.known.materials
        if given == _RIGID:
            return Material(inf, 0.0)
        if isinstance(given, Mapping) and given.keys() == {"young", "poisson"}:
            young, poisson = (self.number(f"{name}.{k}", given[k]) for k in ("young", "poisson"))
            material = Material(young, poisson)
            if material.young > 0 and -1 < material.poisson < 0.5:
                return material.in_plane_stress() if self.known.plane_stress else material
        elif given is None and (name in groups or _ALL in groups):
            return groups.get(name) or groups[_ALL]
        elif isinstance(given, str) and given in groups:
            return groups[given]
        allowed = f"must be a group with a material, {{young, poisson}} or {_RIGID}"
        listed = ", ".join(sorted(groups))
        raise InputError(self.known.where, f"{self.key}.{name}", given, f"{allowed}; {listed}")
