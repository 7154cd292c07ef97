"""A sphere on a plane body as a narrow sector of HEXA8, one cell wide: its faces are stretched."""

import meshio
import numpy as np


def sector(angle, rings, moduli, slave, **zone):
    """A case and its mesh: `angle` in degrees, `rings` and `moduli` of the lower and upper body.

    The contact faces are up to 0.24 long, and as wide as the sector at their radius.
    """
    depth = graded(0.0, 1.5, 20.0, 8, 10)
    low = revolved(graded(0.15, 3.0, 20.0, rings[0], 10), -depth, lambda x: 0.0, angle, 0)
    top = graded(0.15, 3.0, 20.0, rings[1], 12)
    high = revolved(top, depth, lambda x: x**2 / 100, angle, len(low[0]))
    sides = {k: [low[2][k], high[2][k]] for k in ("start", "end", "axis")}
    sides |= {"base": [low[2]["far"]], "press": [high[2]["far"]]}
    sides |= {"lower": [low[2]["near"]], "upper": [high[2]["near"]]}
    cells = [("hexahedron", low[1]), ("hexahedron", high[1])]
    cells += [("quad", np.concatenate(faces)) for faces in sides.values()]
    sets = {
        name: [
            np.arange(len(data)) if i == k else np.empty(0, int)
            for i, (_, data) in enumerate(cells)
        ]
        for k, name in enumerate(["bottom", "top", *sides])
    }
    mesh = meshio.Mesh(np.concatenate([low[0], high[0]]), cells, cell_sets=sets)
    held = [{"group": g, "fix": ["normal"]} for g in ("start", "end", "axis")]
    held += [{"group": "base", "fix": ["z"]}, {"group": "press", "fix": {"z": -0.06}}]
    young = dict(zip(("bottom", "top"), moduli, strict=True))
    master = {"lower": "upper", "upper": "lower"}[slave]
    case = {
        "name": "sector",
        "materials": {name: {"young": value, "poisson": 0.3} for name, value in young.items()},
        "supports": held,
        "contact": [{"slave": slave, "master": master, **zone}],
    }
    return case, mesh


def graded(start, core, stop, n, m):
    """n equal steps from start to core, then m of constant ratio up to stop."""
    beyond = core * (stop / core) ** (np.arange(1, m + 1) / m)
    return np.concatenate([np.linspace(start, core, n + 1), beyond])


def revolved(r, z, top, angle, first):
    """Points, cells and sides of a section r × z turned about z; it begins at z = top(r)."""
    turn = np.radians([-angle / 2, angle / 2])
    t, x, h = np.meshgrid(turn, r, z, indexing="ij")
    lifted = h + top(x) * (1 - np.abs(h) / np.abs(z).max())
    points = np.stack([x * np.cos(t), x * np.sin(t), lifted], axis=-1).reshape(-1, 3)
    a = first + np.arange(len(points)).reshape(t.shape)

    def quads(b):
        return np.stack([b[:-1, :-1], b[1:, :-1], b[1:, 1:], b[:-1, 1:]], -1).reshape(-1, 4)

    below, above = (
        [quads(a[:, :, k]) for k in part] for part in (range(len(z) - 1), range(1, len(z)))
    )
    cells = np.concatenate([np.concatenate(below), np.concatenate(above)], axis=1)
    sides = {"start": quads(a[0]), "end": quads(a[1]), "axis": quads(a[:, 0])}
    return points, cells, sides | {"near": quads(a[:, :, 0]), "far": quads(a[:, :, -1])}
