"""What a case file says of its exact state: the reference, the places that are seen, the tolerance.

So what the checks make of a row, step by step, meets its options too.
"""

from typing import Any

import numpy as np

from .options import SHAPED
from .places import Places
from .state import GAP, MU, SLIDE, Body

TOLERANCE, STIFF = 1e-9, 1e-8
# Of bent faces a little is not covered.
_COVERAGE = 1e-6
_COMPONENTS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "yz": (1, 2), "xz": (0, 2)}


def references(places: Places) -> dict[str, Any]:
    """The keys of the case file."""
    stiff = places.row["materials"] == "stiff master"
    given = _of_zones(places) | _of_bodies(places, stiff)
    tolerance = STIFF if stiff else TOLERANCE
    of_check = dict.fromkeys(("all", "element_gap", "balance"), tolerance)
    seen = [{"zone": "one", "nearest": _place(places, 0.0)}]
    seen += [{"zone": "two", "nearest": _place(places, 1.0)}] * places.second
    text: dict[str, Any] = {
        "reference": {"kind": "analytical"} | {k: v for k, v in given.items() if v != {}},
        "observe": seen,
        "tolerance": of_check | dict.fromkeys(("coverage", "covered_pressure"), _COVERAGE),
    }
    text["probes"] = {name: {"at": _within(places, name)} for name in given["displacement_at"]}
    text["probes"]["base"] = {"group": "lower-base"}
    slaves = {"one": "upper-under", "two": "upper-top"} if places.row["form"] == "exchanged" else {}
    for name in given["pressure_at"]:
        group = slaves.get(name) or {"one": "lower-top", "two": "cap-under"}[name]
        text["probes"][name] = {"group": group, "zone": name}
    return text


def _place(places: Places, height: float) -> list[float]:
    """A place near the middle of an interface."""
    return places.placed.point(np.array([places.start + 0.4, *[0.0] * (places.dim - 2), height]))


def _within(places: Places, name: str) -> list[float]:
    return places.placed.point(_middle(places, name))


def _middle(places: Places, name: str) -> np.ndarray:
    body = next(body for body in places.bodies if body.name == name)
    return np.array([places.start + 0.5, *[0.5] * (places.dim - 2), body.low + 0.6])


def _of_zones(places: Places) -> dict[str, Any]:
    """What holds in all zones, and forces where there is one flat zone."""
    row, dim, factor = places.row, places.dim, places.factor
    shaped = row["interface"] in SHAPED
    lower, last = (body.stress[:dim, :dim] for body in (places.bodies[0], places.bodies[-1]))
    normal = np.eye(dim)[-1] if shaped else places.normal
    pressed = [0.0 if places.open else -float(normal @ lower @ normal)]
    pressed += [-float(last[-1, -1])] * places.second
    given: dict[str, Any] = {"pressure_at": dict(zip(("one", "two"), pressed, strict=False))}
    given["pressure_at"] = {name: factor * p for name, p in given["pressure_at"].items()}
    if np.ptp(pressed) <= 1e-12 * max(pressed):
        given["contact_pressure"] = factor * pressed[0]
    if not (places.second and places.open):
        given["gap"] = GAP * places.placed.scale * places.open
    if places.second or shaped or not factor:
        return given
    traction = (0.0 if places.open else 1.0) * lower @ normal
    if row["friction"] != "none":
        along = traction - normal * (normal @ traction)
        given["friction_traction"] = places.placed.vector(along)
    if not places.axisymmetric and not places.open:
        area = places.placed.scale ** (dim - 1) / normal[-1]
        given |= {"force": places.placed.vector(area * traction), "contact_area": area}
        if row["friction"] in ("held", "stick", "slip"):
            slips = row["friction"] == "slip"
            given["stick_area"] = 0.0 if slips else area
            if row["steps"] == "one":
                slip = SLIDE * places.placed.scale * slips
                given["slip"] = places.placed.vector(slip * places.along)
                given["dissipation"] = [MU * slip * area * pressed[0]]
    return given


def _of_bodies(places: Places, stiff: bool) -> dict[str, Any]:
    """The stress where all have one, values at a point of each body, what holds them, energy."""
    given, row = dict[str, Any](), places.row
    bodies = [body for body in places.bodies if not body.rigid]
    stress = [body.stress for body in bodies]
    same = all(np.allclose(s, stress[0], atol=1e-12 * np.abs(stress[0]).max()) for s in stress)
    if same and not stiff:
        given["stress"] = _turned(places, stress[0])
    still = [body for body in bodies if body is bodies[0] or not places.apart.any()]
    still = still if row["motion"] == "small" and row["form"] != "perturbed" else []
    given["displacement_at"] = {body.name: _moved(places, body) for body in still}
    given["stress_at"] = {body.name: _turned(places, body.stress) for body in still}
    given["stress_at"]["base"] = _turned(places, bodies[0].stress)
    if places.axisymmetric or row["interface"] != "flat" or row["form"] == "exchanged":
        return given
    size, factor = places.placed.scale, places.factor
    pull = -bodies[0].stress[: places.dim, -1] * size ** (places.dim - 1)
    given["reaction"] = {"lower-base": [factor * v for v in places.placed.vector(pull)]}
    if row["also"] in ("nothing", "body force"):
        work = sum(np.sum(b.stress[: places.dim, : places.dim] * b.gradient) for b in bodies)
        given["strain_energy"] = factor * float(work) / 2 * size**places.dim
    return given


def _turned(places: Places, stress: np.ndarray) -> dict[str, float]:
    dim, size = places.dim, len(stress)
    turn, whole = np.eye(3), np.zeros((3, 3))
    turn[:dim, :dim], whole[:size, :size] = places.placed.turn, stress
    whole = places.factor * turn @ whole @ turn.T
    return {name: float(whole[k]) for name, k in _COMPONENTS.items() if max(k) < size}


def _moved(places: Places, body: Body) -> list[float]:
    local = body.gradient @ _middle(places, body.name) + body.shift
    return [places.factor * places.placed.scale * v for v in places.placed.vector(local)]
