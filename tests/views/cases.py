"""Random small cases of contact in which many options meet, without an exact answer."""

from pathlib import Path
from random import Random
from typing import Any

import yaml

Case = dict[str, Any]
CELLS = {
    2: ("TRIA3", "TRIA6", "QUAD4", "QUAD8", "QUAD9"),
    3: ("TETRA4", "TETRA10", "HEXA8", "HEXA20", "PENTA6", "PENTA15", "PYRA5", "PYRA13"),
}
RECIPES = {
    2: ("blocks", "blocks", "wavy", "parabola", "punch", "rings"),
    3: ("blocks", "blocks", "wavy", "parabola", "punch", "shells"),
}
SHAPES = {2: ("tilt", "kink", "arc", "wave"), 3: ("tilt", "kink", "arc", "wave", "twist")}
POISSON = (0.0, 0.1, 0.3, 0.3, -0.3, 0.499, 0.4999)
STEPS = ([1.0], [1.0], [0.3, 0.7, 1.0], [1.0, 0.5, 0.0], [1.0, 0.2, 1.3])
FRICTION = (0.0, 0.0, 0.0, 0.05, 0.1, 0.3, 0.5, 1.0, 2.0, 10.0)
RECOVERY = ("none", "none", "linear", "quadratic", "smooth", "automatic")
OTHERS = ("uncut", "quadrature", "node_to_segment", "nodal", "nodal_dual")

# Facets of curved contact change their pressure by more than a tenth, or are as deep as it closes.
_FACETED = ("frames", "smooth", "apart", "rest", "left", "cooled")
FOUND: dict[str, Case] = yaml.safe_load((Path(__file__).parent / "found.yaml").read_text())


def word_of(case: Case) -> str:
    """How a case that differed once ends; empty for a random one, which may end in any way."""
    if case["name"] not in FOUND:
        return ""
    return "unreliable" if case["name"] in _FACETED else "solved"


def drawn(seed: int) -> Case:
    """The case of a seed, as a mapping with the keys of a case file."""
    r = Random(seed)
    dim = r.choice((2, 2, 3))
    mesh = _mesh(r, dim)
    around, height = mesh["recipe"] in ("rings", "shells"), mesh.get("size", [1.0])[-1]
    case: Case = {"name": f"drawn-{seed}", "mesh": mesh, "materials": _materials(r)}
    if dim == 2:
        case["plane"] = r.choice(("strain", "strain", "stress", "axisymmetric"))
    young = min(material["young"] for material in case["materials"].values())
    pressure = young * 10 ** r.uniform(-4, -2)
    case["supports"] = _supports(r, dim, around, young)
    case["contact"] = [_zone(r)]
    if r.random() < 0.25 and mesh["recipe"] in ("blocks", "wavy", "parabola"):
        _on_floor(r, dim, height, case)
    if r.random() < 0.7:
        case["loads"] = [{"group": "press", "pressure": pressure}]
    else:
        pushed = {"group": "press", "fix": {"normal": -r.uniform(1e-4, 1e-2)}}
        case["supports"].append(pushed)
    case["loads"] = case.get("loads", []) + list(_more_loads(r, dim, around, pressure))
    if not around and r.random() < 0.15:
        _rigid(r, dim, case)
    elif not around and r.random() < 0.1:
        case["supports"].append({"group": "press", "together": ["xyz"[dim - 1]]})
    case["steps"] = r.choice(STEPS)
    if case["loads"] and r.random() < 0.2:
        _by_names(r, case)
    if r.random() < 0.15:
        case["motion"] = "large"
    if r.random() < 0.3:
        case["transform"] = {"perturb": {"amplitude": 0.1, "seed": r.randrange(100)}}
    return case


def by_body(materials: Case) -> Case:
    """The materials of a case, each body with its own."""
    whole = materials.get("all")
    return {"bottom": whole, "top": whole} if whole else materials


def move_places(case: Case, by: list[float]) -> None:
    """Move the planes of groups and rigid bodies, and the reference points of these."""
    for place in [*case.get("bodies", {}).values(), *case.get("groups", {}).values()]:
        for each, key in ((place.get("plane", {}), "point"), (place, "reference")):
            if key in each:
                each[key] = [x + d for x, d in zip(each[key], by, strict=True)]


def _mesh(r: Random, dim: int) -> Case:
    recipe = r.choice(RECIPES[dim])
    mesh = {"recipe": recipe, "bottom": _body(r, dim), "top": _body(r, dim)}
    if recipe == "blocks":
        return mesh | {"size": [r.uniform(0.5, 2.0) for _ in range(dim)]}
    if recipe == "wavy":
        return mesh | {"shape": r.choice(SHAPES[dim]), "height": r.uniform(-0.2, 0.2)}
    if recipe == "parabola":
        return mesh | {"height": r.choice((0.0, r.uniform(-0.02, 0.03)))}
    if recipe == "punch":
        sizes = ([r.uniform(0.7, 3.0) for _ in range(dim)] for _ in range(2))
        mesh |= dict(zip(("bottom_size", "top_size"), sizes, strict=True))
        return mesh | {"gap": r.choice((0.0, 0.01, -0.002))}
    return mesh | {"radii": [1.0, 1.5, 2.2]}


def _body(r: Random, dim: int) -> Case:
    cells = r.choice(CELLS[dim])
    body = {"cells": cells, "divisions": [r.randint(1, 7 - 2 * dim) for _ in range(dim)]}
    if cells.startswith(("PENTA", "PYRA")):
        linear = cells in ("PENTA6", "PYRA5")
        body["contact"] = r.choice(("TRIA3", "QUAD4") if linear else ("TRIA6", "QUAD8"))
    return body


def _materials(r: Random) -> Case:
    groups = r.choice((("all",), ("bottom", "top"), ("bottom", "top")))
    return {g: {"young": 10 ** r.uniform(1.5, 5.0), "poisson": r.choice(POISSON)} for g in groups}


def _supports(r: Random, dim: int, around: bool, young: float) -> list[Case]:
    groups = ["symx", "symy"][: dim - 1] + (["farx", "fary"][: dim - 1] if around else [])
    found: list[Case] = [{"group": group, "fix": ["normal"]} for group in groups]
    if around and r.random() < 0.7:
        return found
    if r.random() < 0.7:
        return [*found, {"group": "base", "fix": ["normal"]}]
    return [*found, {"group": "base", "spring": {"normal": young * r.uniform(0.1, 10.0)}}]


def _zone(r: Random) -> Case:
    sides = ["bottom_contact", "top_contact"]
    r.shuffle(sides)
    zone: Case = dict(zip(("slave", "master"), sides, strict=True)) | {"name": "between"}
    zone |= {"friction": r.choice(FRICTION), "hexahedra": r.choice(("pyramids", "hexahedra"))}
    zone["recovery"] = r.choice(RECOVERY)
    if not zone["friction"]:
        zone["normal"] = r.choice(("element", "element", "element", "nodal", "master"))
        if zone["recovery"] == "none" and r.random() < 0.5:
            zone |= r.choice(({"stabilised": True}, {"treatment": r.choice(OTHERS)}))
    if r.random() < 0.3:
        zone |= r.choice(({"interference": r.uniform(0.0, 5e-3)}, {"clearance": 0.0}))
    return zone


def _on_floor(r: Random, dim: int, height: float, case: Case) -> None:
    """Let the lower body stand on a rigid plane in place of its support."""
    down = [0.0] * (dim - 1)
    plane = {"point": [*down, -height], "normal": [*down, 1.0]}
    case["bodies"] = {"floor": {"plane": plane}}
    case["supports"] = [s for s in case["supports"] if s["group"] != "base"]
    zone = {"name": "below", "slave": "base", "master": "floor"}
    zone |= {"friction": r.choice((0.0, 0.1, 0.5)), "recovery": r.choice(("none", "linear"))}
    case["contact"].append(zone)


def _rigid(r: Random, dim: int, case: Case) -> None:
    """Make a body rigid: the lower one held, or the upper one pushed or moved."""
    down, side = "xyz"[dim - 1], r.choice(("bottom", "top"))
    other = "top" if side == "bottom" else "bottom"
    planes = [[float(i == k) for i in range(dim)] for k in range(dim - 1)]
    case["groups"] = {
        f"side{k}": {"of": "faces", "within": other, "plane": {"point": [0.0] * dim, "normal": n}}
        for k, n in enumerate(planes)
    }
    held: list[Case] = [{"group": group, "fix": ["normal"]} for group in case["groups"]]
    load = 0.01 * min(material["young"] for material in case["materials"].values())
    if side == "bottom":
        case["bodies"] = {"bottom": {"rigid": True}}
        case["loads"] = [{"group": "press", "pressure": load * r.random()}]
    else:
        moved = r.choice(({"force": {down: -load * r.random()}}, {"move": {down: -1e-3}}))
        case["bodies"] = {"top": {"rigid": True} | moved}
        case["loads"], held = [], [*held, {"group": "base", "fix": ["normal"]}]
    case["supports"], case["contact"] = held, case["contact"][:1]
    case["contact"][0] |= {"slave": f"{other}_contact", "master": f"{side}_contact"}


def _by_names(r: Random, case: Case) -> None:
    """Loads that follow each other, and leave each other."""
    names = [f"load{number}" for number in range(len(case["loads"]))]
    case["loads"] = [x | {"name": name} for x, name in zip(case["loads"], names, strict=True)]
    path = [{name: float(r.choice((0.0, 0.5, 1.0))) for name in names} for _ in range(2)]
    case["steps"] = [dict.fromkeys(names, 1.0), *path]


def _more_loads(r: Random, dim: int, around: bool, pressure: float) -> list[Case]:
    found: list[Case] = []
    if r.random() < 0.25 and not around:
        found.append({"group": "farx", "pressure": pressure * r.uniform(-0.5, 1.0)})
    if r.random() < 0.2:
        force = [pressure * r.uniform(-0.3, 0.3) for _ in range(dim)]
        found.append({"group": r.choice(("bottom", "top")), "body_force": force})
    if r.random() < 0.15:
        warm = {"expansion": 1e-5, "temperature": r.choice((100.0, -100.0))}
        found.append({"group": r.choice(("bottom", "top"))} | warm)
    return found
