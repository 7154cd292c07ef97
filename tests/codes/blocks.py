"""Two blocks of few cells, for tests of codes: cases and their meshes."""

import json
from pathlib import Path

from solver.case.reader import parse_case
from solver.verification.run import mesh_of

CELLS_3D = ("TETRA4", "TETRA10", "HEXA8", "HEXA20")
CELLS_2D = ("TRIA3", "TRIA6", "QUAD4", "QUAD8")

# Turned by 30°: all supports are across the axes.
TURNED = {
    "transform": {"rotate": 30},
    "supports": [{"group": group, "fix": ["normal"]} for group in ("symx", "base")],
}


def case_of(bottom, top, **more):
    """The patch test of two blocks, 25 MPa on top, on a coarse mesh."""
    plane = bottom.startswith(("TRIA", "QUAD"))
    axes = "xy" if plane else "xyz"
    supports = [{"group": f"sym{axis}", "fix": [axis]} for axis in axes[:-1]]
    content = {
        "name": "few",
        "mesh": {
            "recipe": "blocks",
            "size": 50,
            "bottom": {"cells": bottom, "divisions": [3] * len(axes)},
            "top": {"cells": top, "divisions": [2] * len(axes)},
        },
        "materials": {"all": {"young": 2000.0, "poisson": 0.3}},
        "supports": [*supports, {"group": "base", "fix": [axes[-1]]}],
        "loads": [{"group": "press", "pressure": 25.0}],
        "contact": [{"name": "i", "slave": "bottom_contact", "master": "top_contact"}],
        "reference": {"kind": "analytical", "contact_pressure": 25.0},
    }
    content |= {"plane": "strain"} if plane else {}
    case = parse_case(json.dumps(content | more), Path("few.yaml"))
    return case, mesh_of(case)
