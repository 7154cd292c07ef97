"""The options of a case and their values, and what excludes what.

Values are given by an option's name. The first value of each is the plain one. `EXCLUDED` has the
pairs (and some triples) that have no exact uniform state or no meaning; `REFUSED` those that the
program refuses, with the keys that its message must name.
"""

from collections.abc import Mapping
from typing import NamedTuple

Row = Mapping[str, str]

PLANE = ("TRIA3", "TRIA6", "QUAD4", "QUAD8", "QUAD9")
SOLID = (
    *("HEXA8", "HEXA20", "HEXA27", "TETRA4", "TETRA10"),
    *("PENTA6", "PENTA15", "PYRA5", "PYRA13"),
)
LINEAR = ("TRIA3", "QUAD4", "HEXA8", "TETRA4", "PENTA6", "PYRA5")
QUADRATIC = tuple(cells for cells in (*PLANE, *SOLID) if cells not in LINEAR)
HEXA = ("HEXA8", "HEXA20", "HEXA27")
OPTIONS: dict[str, tuple[str, ...]] = {
    "space": ("strain", "stress", "axisymmetric", "solid"),
    "slave cells": (*PLANE, *SOLID),
    "master cells": (*PLANE, *SOLID),
    "slave faces": ("one type", "two types", "two groups"),
    "interface": ("flat", "tilted", "kinked", "edge", "curved"),
    "treatment": ("lac", "uncut", "quadrature", "node_to_segment", "nodal", "nodal_dual"),
    "normal": ("element", "nodal", "master"),
    "hexahedra": ("pyramids", "hexahedra"),
    "friction": ("none", "held", "stick", "slip", "slip back"),
    "recovery": ("none", "linear", "quadratic", "smooth", "automatic", "5 sweeps"),
    "stabilised": ("no", "yes"),
    "gap": (
        *("none", "meshed", "open", "interference"),
        *("clearance", "clearance 0", "clearance, overlap"),
    ),
    "master": ("meshed", "rigid", "rigid, by force", "faces", "plane", "parabola"),
    "master size": ("coarser", "as fine", "finer"),
    "supports": ("imposed", "normal", "springs", "together", "cyclic"),
    "load": ("pressure", "traction", "force"),
    "also": ("nothing", "body force", "strain", "temperature"),
    "steps": ("one", "factors", "path", "unloaded", "substeps"),
    "motion": ("small", "large"),
    "materials": ("equal", "stiff master", "nearly incompressible", "mixed form"),
    "second zone": ("none", "same", "plain", "friction", "recovery", "stabilised", "nodal"),
    "form": (
        *("as it is", "exchanged", "renumbered", "perturbed"),
        *("rotated", "mirrored", "far", "other units"),
    ),
    "work": ("lean", "everything", "multigrid"),
}
PLAIN = {name: values[0] for name, values in OPTIONS.items()}
FRICTION = ("held", "stick", "slip", "slip back")
SHEARED = ("stick", "slip", "slip back")
KINKS = {"kinked": 0.1, "edge": 1.0}  # the slopes of their sides
SHAPED = (*KINKS, "curved")
# Rigid masters without cells, and all of them.
BARE = ("faces", "plane", "parabola")
RIGID = ("rigid", "rigid, by force", *BARE)
# Cells of two types on one surface: the second half of it has cells of the other one.
HALVES = {"QUAD4": "TRIA3", "QUAD9": "TRIA6", "HEXA8": "PENTA6", "HEXA20": "PENTA15"}


class Rule(NamedTuple):
    """Values of options that do not go together, and why; `keys` that a refusal names."""

    when: Mapping[str, tuple[str, ...]]
    why: str
    keys: tuple[str, ...] = ()

    def applies(self, row: Row) -> bool:
        """Whether a row, which may be a part of one, has all of these values."""
        return all(row.get(name) in values for name, values in self.when.items())


def _of_slave(
    cells: tuple[str, ...],
    when: Mapping[str, tuple[str, ...]],
    why: str,
    keys: tuple[str, ...] = (),
) -> tuple[Rule, Rule]:
    """A rule of the cells that are the slave's: the other ones where both are exchanged."""
    exchanged = {**when, "master cells": cells, "form": ("exchanged",)}
    return Rule({**when, "slave cells": cells}, why, keys), Rule(exchanged, why, keys)


def _not(name: str, *values: str) -> tuple[str, ...]:
    return tuple(value for value in OPTIONS[name] if value not in values)


NODAL = ("nodal", "nodal_dual")
POINTS = ("quadrature", "node_to_segment")
REFUSED = (
    Rule(
        {"friction": FRICTION, "treatment": _not("treatment", "lac")},
        "friction acts on one pressure for each macro-element",
        ("treatment", "friction"),
    ),
    Rule(
        {"friction": FRICTION, "normal": _not("normal", "element")},
        "friction acts along the faces' own normals",
        ("normal", "friction"),
    ),
    Rule(
        {"friction": FRICTION, "stabilised": ("yes",)},
        "contact with friction does not give way",
        ("stabilised", "friction"),
    ),
    Rule(
        {"treatment": POINTS, "normal": _not("normal", "element")},
        "normals of its own",
        ("normal", "treatment"),
    ),
    Rule(
        {"treatment": ("uncut", "node_to_segment", *NODAL), "stabilised": ("yes",)},
        "no pressure that could be stabilised",
        ("stabilised", "treatment"),
    ),
    Rule(
        {"supports": ("cyclic",), "treatment": _not("treatment", "lac", "quadrature")},
        "more multipliers than nodes that move",
        ("treatment", "cyclic"),
    ),
    Rule(
        {"materials": ("mixed form",), "space": ("stress",)},
        "plane stress has no incompressible limit",
        ("form", "plane stress"),
    ),
    *(
        Rule({"motion": ("large",), name: values}, why, ("motion", *values[:1]))
        for name, values, why in (
            ("supports", ("together",), "one displacement of nodes that turn"),
            ("supports", ("cyclic",), "a side that moves as another does"),
            ("also", ("strain",), "its components would have to turn"),
            ("also", ("temperature",), "its components would have to turn"),
            (
                "gap",
                ("clearance", "clearance 0", "clearance, overlap"),
                "motion finds the gap itself",
            ),
        )
    ),
    *_of_slave(
        QUADRATIC,
        {"treatment": ("nodal_dual",)},
        "built of linear functions",
        ("treatment", "slave"),
    ),
    *_of_slave(
        ("HEXA20", "PENTA15", "PYRA13", "TETRA10"),
        {"treatment": ("node_to_segment",)},
        "nodal forces of a uniform pressure vanish or pull",
        ("treatment", "slave"),
    ),
    *_of_slave(
        ("HEXA20",),
        {
            "hexahedra": ("hexahedra",),
            "interface": ("curved",),
            "treatment": ("lac", "quadrature"),
        },
        "cells cut askew leave bent faces",
        ("hexahedra", "HEXA20"),
    ),
    Rule(
        {"master": RIGID, "form": ("exchanged",)},
        "a rigid side is the master",
        ("master", "directions"),
    ),
)
EXCLUDED = (
    Rule(
        {"gap": ("open",), "supports": _not("supports", "imposed", "springs")},
        "nothing holds the body once it is open",
    ),
    Rule({"gap": ("open",), "master": ("rigid, by force",)}, "nothing bears the force"),
    Rule(
        {"steps": ("unloaded",), "gap": _not("gap", "none", "clearance 0")}, "a gap has no factor"
    ),
    Rule({"steps": ("unloaded",), "friction": ("slip",)}, "what slipped does not come back"),
    Rule({"gap": ("open",), "friction": ("slip", "slip back")}, "nothing slips"),
    Rule(
        {
            "also": ("strain", "temperature"),
            "supports": ("springs",),
            "materials": ("stiff master",),
        },
        "a stiff body on soft springs: exact pressure, displacement rounded to 2e-8",
    ),
    Rule(
        {"motion": ("large",), "interface": SHAPED, "materials": ("stiff master",)},
        "fits by a strain",
    ),
    Rule(
        {
            "treatment": ("nodal",),
            "slave cells": ("HEXA8", "PYRA5"),
            "form": ("exchanged",),
            "materials": ("stiff master",),
        },
        "nodes of a stiff slave outnumber those of a soft master: nearly singular",
    ),
    *(
        Rule(
            {"materials": ("stiff master",), "friction": ("slip back",), name: (value,)},
            "friction of a stiff body, by displacements rounded to 5e-8 of it",
        )
        for name, value in (("second zone", "friction"), ("form", "exchanged"))
    ),
    Rule({"space": _not("space", "solid"), "slave cells": SOLID}, "cells of another dimension"),
    Rule({"space": _not("space", "solid"), "master cells": SOLID}, "cells of another dimension"),
    Rule({"space": ("solid",), "slave cells": PLANE}, "cells of another dimension"),
    Rule({"space": ("solid",), "master cells": PLANE}, "cells of another dimension"),
    Rule({"slave cells": PLANE, "master cells": SOLID}, "cells of another dimension"),
    Rule({"slave cells": SOLID, "master cells": PLANE}, "cells of another dimension"),
    *_of_slave(
        ("TETRA4", "PENTA6", "PYRA5"),
        {"treatment": ("uncut",)},
        "faces outnumber nodes: why LAC cuts",
    ),
    Rule({"friction": SHEARED, "interface": SHAPED}, "a hydrostatic state has no shear"),
    Rule({"friction": SHEARED, "space": ("axisymmetric",)}, "no uniform shear about an axis"),
    Rule({"interface": ("tilted",), "space": ("axisymmetric",)}, "no uniform shear about an axis"),
    Rule(
        {"friction": ("slip", "slip back"), "supports": _not("supports", "imposed")},
        "slides by supports",
    ),
    Rule(
        {"friction": ("slip back",), "interface": _not("interface", "flat")}, "slides along an axis"
    ),
    Rule({"friction": ("slip back",), "form": ("rotated",)}, "slides along an axis"),
    Rule({"friction": ("slip back",), "steps": _not("steps", "one")}, "a path of its own"),
    Rule(
        {"friction": ("slip back",), "gap": _not("gap", "none", "clearance 0")},
        "a gap has no factor",
    ),
    Rule({"friction": ("slip back",), "master": RIGID}, "a body has one factor"),
    Rule({"friction": ("slip back",), "also": ("strain", "temperature")}, "loads have one factor"),
    Rule(
        {"friction": ("slip", "slip back"), "second zone": _not("second zone", "none", "friction")},
        "which zone slips is open",
    ),
    Rule({"friction": ("slip",), "steps": ("path",)}, "slip turns back where loads do"),
    Rule(
        {
            "friction": FRICTION,
            "gap": _not("gap", "none", "clearance 0"),
            "steps": _not("steps", "one"),
        },
        "a gap has no factor",
    ),
    Rule(
        {
            "second zone": ("friction",),
            "gap": _not("gap", "none", "clearance 0"),
            "steps": _not("steps", "one"),
        },
        "a gap has no factor",
    ),
    Rule(
        {
            "friction": SHEARED,
            "master": ("meshed",),
            "second zone": ("plain", "recovery", "stabilised", "nodal"),
        },
        "the shear passes a zone without friction",
    ),
    Rule({"master": BARE, "second zone": _not("second zone", "none")}, "no second surface"),
    Rule({"master": ("plane", "parabola"), "gap": ("clearance, overlap",)}, "has no mesh"),
    Rule({"master": ("plane",), "interface": SHAPED}, "a plane is no such surface"),
    Rule({"master": BARE, "supports": ("springs", "together")}, "no elastic body is loaded"),
    Rule({"master": BARE, "load": ("traction", "force")}, "no elastic body is loaded"),
    *(
        Rule({"master": ("parabola",), name: values}, "a state on one curve")
        for name, values in (
            ("interface", _not("interface", "curved")),
            ("space", ("axisymmetric", "solid")),
            ("slave cells", LINEAR),
            ("master cells", LINEAR),
            ("treatment", ("node_to_segment", "nodal_dual")),
            ("normal", ("nodal", "master")),
            ("friction", SHEARED),
            ("gap", _not("gap", "none", "clearance 0")),
            ("supports", ("cyclic",)),
            ("also", _not("also", "strain")),
            ("motion", ("large",)),
        )
    ),
    Rule(
        {"interface": ("tilted",), "second zone": _not("second zone", "none")},
        "interfaces are not parallel",
    ),
    Rule(
        {"interface": SHAPED, "gap": _not("gap", "none", "clearance 0")},
        "closes without a uniform state",
    ),
    Rule(
        {"interface": ("tilted",), "gap": ("meshed", "open", "clearance, overlap")},
        "the ends of the surfaces part",
    ),
    Rule(
        {"interface": _not("interface", "flat"), "supports": ("together", "cyclic")},
        "displacements differ",
    ),
    Rule({"supports": ("together",), "form": ("rotated",)}, "components along axes"),
    Rule({"space": ("axisymmetric",), "supports": ("cyclic",)}, "no sides"),
    Rule({"space": ("axisymmetric",), "form": ("rotated", "mirrored")}, "the axis stays"),
    Rule(
        {"master": RIGID, "supports": ("springs", "together"), "second zone": ("none",)},
        "no elastic body is loaded",
    ),
    Rule(
        {"master": RIGID, "load": ("traction", "force"), "second zone": ("none",)},
        "no elastic body is loaded",
    ),
    Rule({"load": ("traction", "force"), "supports": ("imposed",)}, "displacements are imposed"),
    Rule(
        {"load": ("traction", "force"), "friction": ("slip", "slip back")},
        "displacements are imposed",
    ),
    Rule(
        {"interface": SHAPED, "normal": ("nodal", "master")}, "the faces' own normals alone keep it"
    ),
    Rule(
        {"interface": SHAPED, "treatment": ("node_to_segment",)}, "points keep flat surfaces alone"
    ),
    Rule({"treatment": POINTS, "second zone": ("same",)}, "meshes of two sides differ"),
    Rule({"treatment": POINTS, "form": ("perturbed",)}, "meshes of two sides differ"),
    Rule({"supports": ("cyclic",), "form": ("perturbed",)}, "meshes of two sides differ"),
    Rule(
        {"supports": ("cyclic",), "second zone": _not("second zone", "none")},
        "nothing holds the body between",
    ),
    Rule({"interface": SHAPED, "also": ("temperature",)}, "fits by a strain"),
    Rule(
        {"interface": SHAPED, "slave cells": LINEAR, "master cells": QUADRATIC}, "surfaces differ"
    ),
    Rule(
        {"interface": SHAPED, "slave cells": QUADRATIC, "master cells": LINEAR}, "surfaces differ"
    ),
    *(
        Rule({"space": ("solid",), "interface": shapes, side: cells}, "edges differ")
        for side in ("slave cells", "master cells")
        for shapes, cells in (
            (tuple(KINKS), _not(side, *HEXA)),
            (("curved",), tuple(c for c in LINEAR if c != "HEXA8")),
        )
    ),
    *(
        Rule(
            {"space": ("solid",), name: values, side: _not(side, *HEXA)},
            "meshes of two sides differ",
        )
        for side in ("slave cells", "master cells")
        for name, values in (("supports", ("cyclic",)), ("treatment", POINTS))
    ),
    Rule(
        {"treatment": POINTS, "slave cells": LINEAR, "master cells": QUADRATIC},
        "meshes of two sides differ",
    ),
    Rule(
        {"treatment": POINTS, "slave cells": QUADRATIC, "master cells": LINEAR},
        "meshes of two sides differ",
    ),
    Rule(
        {"interface": SHAPED, "master": RIGID, "also": _not("also", "strain")}, "a state of its own"
    ),
    Rule(
        {"slave faces": ("two types",), "slave cells": _not("slave cells", *HALVES)},
        "halves of cells of this type are no cells",
    ),
    Rule({"slave faces": ("two groups",), "form": ("perturbed",)}, "selected by place"),
    Rule(
        {"slave faces": ("two groups",), "slave cells": ("TETRA4", "TETRA10")},
        "their faces cross the place where the groups part",
    ),
    Rule({"slave faces": ("two types",), "treatment": POINTS}, "meshes of two sides differ"),
    Rule({"slave faces": ("two types",), "supports": ("cyclic",)}, "meshes of two sides differ"),
)


def possible(row: Row) -> bool:
    """Whether the values of a row, or of a part of one, go together."""
    return not any(rule.applies(row) for rule in (*REFUSED, *EXCLUDED))


def plain_in(space: str) -> dict[str, str]:
    """The plain row in the plane or in space."""
    cells = "HEXA8" if space == "solid" else "QUAD4"
    return {**PLAIN, "space": space, "slave cells": cells, "master cells": cells}
