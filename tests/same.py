"""Whether two solutions are the same in all that they hold."""

from dataclasses import fields, replace

import meshio
import numpy as np


def same(a, b):
    """Equal values, whatever holds them: NaN equals NaN, arrays element by element."""
    if isinstance(a, meshio.Mesh):
        blocks = [(m.points, [(c.type, c.data) for c in m.cells], m.cell_sets) for m in (a, b)]
        return same(*blocks)
    if hasattr(a, "__dataclass_fields__"):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind == "f")


def in_order(solution):
    """Tables of sub-faces and master faces have no order of their own; a type has one of these."""
    for zone in solution.zones:
        zone.faces.sort(key=lambda faces: faces[0])
        given = zone.surfaces.master_faces
        zone.surfaces.master_faces = [
            (kind, np.concatenate([nodes for name, nodes in given if name == kind]))
            for kind in sorted({kind for kind, _ in given})
        ]
    return solution


def read_back(solution, again):
    """Whether `again` is what a file keeps of a solution.

    The case comes from its source, and of the edges of contact those of the last step are kept.
    """
    for step in solution.steps:
        step.resultants = {k: replace(r, edges=None) for k, r in step.resultants.items()}
    solution.case = again.case
    return same(in_order(solution), in_order(again))
