"""The rules of a case file that concern several keys; they need no mesh.

Each rule yields what is wrong: a key, its value, and what is allowed.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ..system.errors import InputError, hint
from .acting import Load, Scalar, Support
from .checks import BY_NAME, ERRORS
from .expressions import EXACT, Expression
from .file import Zone
from .model import MARGIN, SWAPPED, Case
from .rigid import Rigid

Fault = tuple[str, object, str]
# Keys of the reference that need contact.
_OF_CONTACT = {"contact_pressure", "gap", "force", "contact_area", "coverage", "pressure_at"}
# Those that need friction.
_OF_FRICTION = {"friction_traction", "slip", "stick_area", "dissipation"}
# What an exact solution has of bodies, not of contact.
_OF_FIELDS = {"displacement", "gradient", "stress"}
# Treatments with fewer multipliers than nodes of the slave where two sides move as one.
_CYCLIC = "lac", "quadrature"
# Keys of the reference for values at probes.
PROBED = ("displacement_at", "stress_at", "pressure_at")
# The vectors of a selection.
_PARTS = {"plane": ("point", "normal"), "sphere": ("centre",), "box": ("low", "high")}


def check_rules(case: Case) -> None:
    """Raise `InputError` for what neither the types of the keys nor the mesh decide."""
    _refuse_first(case, _faults(case))
    if case.plane:
        check_dimension(case, 2)


def check_dimension(case: Case, dim: int) -> None:
    """Raise `InputError` for a vector, direction or expression that does not fit the dimension."""
    _refuse_first(case, _of_dimension(case, dim))


def _refuse_first(case: Case, faults: Iterator[Fault]) -> None:
    if fault := next(faults, None):
        raise InputError(case.path, *fault)


def _faults(case: Case) -> Iterator[Fault]:
    if case.name.endswith(SWAPPED):
        yield "name", case.name, f"must not end in {SWAPPED}: so is the other direction called"
    yield from _in_zones(case)
    yield from _in_steps(case)
    yield from _listed_twice(case)
    if case.probes:
        yield from _in_probes(case)
    yield from _in_errors(case)
    yield from _in_reference(case)
    if case.rigid:
        yield from _in_rigid(case)
    if case.moving:
        yield from _of_moving(case)
    for group, material in case.materials.items():
        if case.thin and material.form == "mixed":
            allowed = "plane stress has no incompressible limit; allowed: automatic, displacement"
            yield f"materials.{group}.form", material.form, allowed


def _in_steps(case: Case) -> Iterator[Fault]:
    """Steps are all factors, or all factors of the same names; only these have the names."""
    acting: dict[str, Support | Load | Rigid] = {
        **{f"supports[{i}].name": s for i, s in enumerate(case.supports) if s.name},
        **{f"loads[{i}].name": load for i, load in enumerate(case.loads) if load.name},
        **{f"bodies.{group}.name": body for group, body in case.rigid.items() if body.name},
    }
    names = {one.name for one in acting.values()}
    for i, step in enumerate(case.steps):
        given = set(step) if isinstance(step, dict) else set()
        if isinstance(step, dict) != isinstance(case.steps[0], dict):
            allowed = "steps are factors, or mappings of names to factors, not both"
            yield f"steps[{i}]", step, allowed
        if given - names and not case.states:
            name = min(given - names)
            allowed = f"no load, support or rigid body has this name; {hint(name, names)}"
            yield f"steps[{i}].{name}", None, allowed
        if names - given:
            yield f"steps[{i}]", step, f"gives no factor of {min(names - given)}"
    for key, one in acting.items():
        if isinstance(one, Support) and not any(one.fix.values()):
            yield key, one.name, "only a support with imposed values has a factor"


def _in_zones(case: Case) -> Iterator[Fault]:
    """Zones have names and surfaces of their own, and settings that go together."""
    names: set[str] = set()
    for i, zone in enumerate(case.zones):
        if zone.slave == zone.master:
            allowed = "the slave is its own master: they must be two groups"
            yield f"contact[{i}].master", zone.master, allowed
        if zone.name in names:
            allowed = "the name is given to two zones; each needs its own"
            yield f"contact[{i}].name", zone.name, allowed
        yield from _in_zone(f"contact[{i}]", zone)
        cyclic = any(support.cyclic for support in case.supports)
        if cyclic and zone.treatment not in _CYCLIC:
            allowed = f"must be {' or '.join(_CYCLIC)} where supports are cyclic"
            yield f"contact[{i}].treatment", zone.treatment, allowed
        names.add(zone.name)
    for i, item in enumerate(case.observe):
        if item.zone not in names:
            yield f"observe[{i}].zone", item.zone, f"no such zone; {hint(item.zone, names)}"


def _in_zone(key: str, zone: Zone) -> Iterator[Fault]:
    """Settings that go together."""
    treatment = zone.treatment
    if zone.points and treatment != "quadrature":
        yield f"{key}.points", zone.points, "only the treatment quadrature has points"
    if zone.sweeps and zone.recovery == "none":
        yield f"{key}.sweeps", zone.sweeps, "only a recovery has sweeps"
    if zone.normal != "element" and treatment in ("quadrature", "node_to_segment"):
        allowed = f"the treatment {treatment} has normals of its own; allowed: element"
        yield f"{key}.normal", zone.normal, allowed
    if zone.stabilised and treatment not in ("lac", "quadrature"):
        allowed = f"the treatment {treatment} has no pressure that could be stabilised"
        yield f"{key}.stabilised", "true", f"{allowed}; allowed there: lac, quadrature"
    if zone.friction:  # of constants by macro-element, along the normals of their own faces
        needed = {"treatment": "lac", "normal": "element", "stabilised": False}
        for name, value in needed.items():
            if (given := getattr(zone, name)) != value:
                shown = str(value).lower()
                yield f"{key}.{name}", given, f"must be {shown} in a zone with friction"


def _in_probes(case: Case) -> Iterator[Fault]:
    """A probe's zone is one of the case; a reference names a probe that has such a value."""
    zones = {zone.name for zone in case.zones}
    for name, probe in case.probes.items():
        if probe.zone and probe.zone not in zones:
            allowed = f"no such zone; {hint(probe.zone, zones)}"
            yield f"probes.{name}.zone", probe.zone, allowed
    for key in PROBED:
        names = {n for n, p in case.probes.items() if bool(p.zone) == (key == "pressure_at")}
        given = case.reference.values.get(key)
        for name in given if isinstance(given, dict) else ():
            if name not in names:
                kind = "with a zone" if key == "pressure_at" else "without a zone"
                allowed = f"no probe {kind} has this name; {hint(name, names)}"
                yield f"reference.{key}.{name}", None, allowed


def _in_errors(case: Case) -> Iterator[Fault]:
    """An error against an exact solution can have a tolerance only where there is such a one."""
    reference = case.reference
    for error in reference.tolerance.keys() & ERRORS.keys():
        key, value = f"tolerance.{error}", reference.tolerance[error]
        if reference.exact is None:
            yield key, value, "needs an exact solution: reference.solution names none"
        elif BY_NAME[error].needs not in reference.exact.quantities:
            yield key, value, f"{reference.exact.name} has no {BY_NAME[error].needs}"
        elif BY_NAME[error].needs not in _OF_FIELDS and case.exact_contact is None:
            allowed = "needs `contact_pressure: solution`: the case has several zones"
            yield key, value, allowed


def _in_works(case: Case) -> Iterator[Fault]:
    """The work of friction is known in each step."""
    reference = case.reference
    given = reference.values.get("dissipation")
    exact = given is EXACT and reference.exact is not None
    works = reference.exact.dissipation if exact and reference.exact else given
    if isinstance(works, tuple) and len(works) != len(case.steps):
        allowed = f"must have a number for each of the {len(case.steps)} steps"
        more = f"; the solution has {len(works)}" if exact else ""
        yield "reference.dissipation", "solution" if exact else list(works), allowed + more


def _in_reference(case: Case) -> Iterator[Fault]:
    """Every value of the reference feeds a check; no tolerance admits any result at all."""
    reference = case.reference
    for check, tolerance in reference.tolerance.items():
        if tolerance >= 1:
            allowed = "must be below 1, the error of a result that is zero"
            if check in reference.expected:
                key, error = f"expected.{check}", reference.expected[check]
                yield key, error, f"{MARGIN} times it {allowed}"
            yield f"tolerance.{check}", tolerance, allowed
    for key in reference.values.keys() & _OF_CONTACT if not case.zones else ():
        allowed = "cannot be compared: the case has no contact"
        yield f"reference.{key}", None, allowed
    for key in reference.values.keys() & _OF_FRICTION if not case.frictional else ():
        allowed = "cannot be compared: no contact zone has friction"
        yield f"reference.{key}", None, allowed
    yield from _in_works(case)
    if "coverage" in reference.values and "contact_pressure" not in reference.values:
        allowed = "needs contact_pressure: it says where that acts"
        yield "reference.coverage", None, allowed
    if reference.kind and not reference.values and reference.exact is None:
        allowed = "gives no value to compare with, such as contact_pressure"
        yield "reference.kind", reference.kind, allowed
    compared = reference.values or reference.tolerance.keys() & ERRORS.keys()
    if reference.exact and not compared:
        known = [name for name in ERRORS if BY_NAME[name].needs in reference.exact.quantities]
        allowed = "nothing is compared with it; give a value (`contact_pressure: solution`) or a "
        allowed += f"tolerance for one of {', '.join(known)}"
        yield "reference.solution", reference.exact.name, allowed


def _listed_twice(case: Case) -> Iterator[Fault]:
    """A direction of a group is fixed once, a kind of load on a group is given once."""
    supports = [(f"supports[{i}].group", s) for i, s in enumerate(case.supports)]
    given = [(key, s.group, axis) for key, s in supports for axis in s.fix]
    given += [(key, s.group, f"spring {axis}") for key, s in supports for axis in s.spring]
    given += [(f"loads[{i}].group", load.group, load.kind) for i, load in enumerate(case.loads)]
    seen: set[tuple[str, str]] = set()
    for key, group, what in given:
        if (group, what) in seen:
            yield key, group, f"the group is listed twice with {what}"
        seen.add((group, what))


def _in_rigid(case: Case) -> Iterator[Fault]:
    """A rigid surface without a mesh is the master of a zone, and nothing else."""
    sides = {side for zone in case.zones for side in (zone.master, zone.slave)}
    for name, body in case.rigid.items():
        if body.surface and name not in sides:
            allowed = "has no mesh and is the master of no contact zone"
            yield f"bodies.{name}", body.surface, allowed
        for i, zone in enumerate(case.zones) if body.surface else ():
            allowed = f"is a rigid {body.surface}; a rigid side is always the master"
            if name == zone.slave:
                yield f"contact[{i}].slave", name, allowed
            if name == zone.master and case.about.directions == "both":
                yield f"contact[{i}].master", name, f"{allowed}, so directions must be `first`"


def _of_moving(case: Case) -> Iterator[Fault]:
    """What does not go with bodies that move far."""
    for key, value, instead in _not_moving(case):
        yield key, value, f"does not go with `motion: large`; allowed: {instead}"


def _not_moving(case: Case) -> Iterator[Fault]:
    """The same with what is allowed in its place."""
    joins = ("together", "cyclic")
    for i, key in (
        (i, key) for i, s in enumerate(case.supports) for key in joins if getattr(s, key)
    ):
        yield f"supports[{i}].{key}", None, "fix, spring"
    for i, load in ((i, load) for i, load in enumerate(case.loads) if load.strains):
        yield f"loads[{i}].{load.kind}", None, "loads of other kinds"
    for i, zone in enumerate(case.zones):
        if zone.clearance is not None:
            yield (
                f"contact[{i}].clearance",
                zone.clearance,
                "interference, beside the gap as meshed",
            )
    for name, probe in case.probes.items():
        if probe.at:
            yield f"probes.{name}.at", list(probe.at), "group"
    if case.reference.exact and not _goes_along(case):
        allowed = "a reference of values, or of half-planes with one named rigid body along x"
        yield "reference.solution", case.reference.exact.name, allowed
    if "displacement" in case.reference.values:
        yield "reference.displacement", None, "displacement_at, the whole one of a group"


def _goes_along(case: Case) -> bool:
    """Whether the exact solution of a case goes along with its rigid body, which steps move.

    A circle may also turn about its centre.
    """
    exact = case.reference.exact
    if exact is None or exact.moved(0.0) is None or len(case.rigid) != 1:
        return False
    (body,) = case.rigid.values()
    motion = set(body.move)
    if body.sphere and body.reference in (None, body.sphere.centre):
        motion.discard("rz")
    return motion == {"x"} and bool(body.name)


def _of_dimension(case: Case, dim: int) -> Iterator[Fault]:
    allowed = f"must have {dim} components: the case is {'plane' if dim == 2 else 'in 3D'}"
    for key, vector in _vectors(case):
        if len(vector) != dim:
            shown = [v.text if isinstance(v, Expression) else v for v in vector]
            yield key, shown, allowed
    yield from _in_motion(case, dim)
    if any(load.strains for load in case.loads):
        yield from _in_strains(case, dim)
    if dim == 3:
        return
    for i, support in enumerate(case.supports):
        for key in ("fix", "spring", "together"):
            if "z" in getattr(support, key):
                allowed = "z in a plane case; allowed are x, y and normal"
                yield f"supports[{i}].{key}", "z", allowed
    for expression in _expressions(case):
        if "z" in expression.names:
            yield expression.key, expression.text, "z in a plane case; allowed are x, y and r"


def _in_motion(case: Case, dim: int) -> Iterator[Fault]:
    """The components in which rigid bodies move, and the shapes that they have."""
    known = ["x", "y", "z", "rx", "ry", "rz"] if dim == 3 else ["x", "y", "rz"]
    known = ["y"] if case.axisymmetric else known
    for name, body in case.rigid.items():
        for key in ("move", "force"):
            for component in getattr(body, key).keys() - set(known):
                yield f"bodies.{name}.{key}", component, f"allowed here: {', '.join(known)}"
        if body.surface == "cylinder" and dim == 2:
            allowed = "is 3D: a circle is a `sphere` here, the side of a shaft a `plane`"
            yield f"bodies.{name}", body.surface, allowed
    moments = case.reference.values.get("moment", {})
    for name, value in moments.items() if isinstance(moments, dict) else ():
        key = f"reference.moment.{name}"
        if name not in case.rigid:
            yield key, None, f"is no rigid body; {hint(name, case.rigid)}"
        if isinstance(value, tuple) != (dim == 3):
            number = "a list of three numbers" if dim == 3 else "a number"
            yield key, value, f"must be {number} here"


def _in_strains(case: Case, dim: int) -> Iterator[Fault]:
    """Initial strains have the components of the mesh; exact solutions know none."""
    for i, load in enumerate(case.loads):
        if not load.strains:
            continue
        key = f"loads[{i}].{load.kind}"
        if case.reference.exact:
            name = case.reference.exact.name
            yield key, None, f"{name} has no initial strain; allowed: a reference without it"
        across = {"yz", "xz"} & load.value.keys() if isinstance(load.value, dict) else set()
        if across and dim == 2:
            allowed = "across the plane of a plane case; allowed are xx, yy, zz and xy"
            yield key, max(across), allowed


def _vectors(case: Case) -> Iterable[tuple[str, Sequence[Scalar]]]:
    """Every vector of the case, with its key."""
    yield from _placed(case)
    for i, load in enumerate(case.loads):
        if isinstance(load.value, tuple):
            yield f"loads[{i}].{load.kind}", load.value
    for key, value in case.reference.values.items():
        if isinstance(value, tuple) and key != "dissipation":
            yield f"reference.{key}", value
        if key in ("reaction", "displacement_at") and isinstance(value, dict):
            for name, vector in value.items():
                assert isinstance(vector, tuple)
                yield f"reference.{key}.{name}", vector


def _placed(case: Case) -> Iterable[tuple[str, Sequence[Scalar]]]:
    """Every vector of the case that says where something is."""
    for i, item in enumerate(case.observe):
        yield f"observe[{i}].nearest", item.nearest
    for i, support in enumerate(case.supports):
        if support.cyclic and support.cyclic.shift:
            yield f"supports[{i}].cyclic.shift", support.cyclic.shift
    for name, probe in case.probes.items():
        if probe.at:
            yield f"probes.{name}.at", probe.at
    for made in case.mesh.selections:
        if made.shape == "at":
            yield made.key, made.values
        for key, value in zip(_PARTS.get(made.shape, ()), made.values, strict=False):
            yield f"{made.key}.{made.shape}.{key}", value
    for name, body in case.rigid.items():
        yield from ((f"bodies.{name}.{key}", vector) for key, vector in body.vectors)


def _expressions(case: Case) -> Iterable[Expression]:
    """Every expression of the case."""
    values: list[Any] = [support.components for support in case.supports]
    values += [load.value for load in case.loads]
    values += case.reference.values.values()
    values += [zone.clearance for zone in case.zones]
    values += [made.values for made in case.mesh.selections]
    while values:
        value = values.pop()
        if isinstance(value, Expression):
            yield value
        elif isinstance(value, dict):
            values += value.values()
        elif isinstance(value, tuple):
            values += value
