"""The method in one script: two blocks with meshes that do not match, pressed together.

    .venv/bin/python docs/examples/method.py

goes from the mesh to the contact pressure in plane strain, and prints it for every macro-element.
It is 25 everywhere (MPa; lengths in mm), as the patch test asks.
"""

import meshio
import numpy as np

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cut import cut
from solver.lac.facets import facets
from solver.lac.operator import gap_operator
from solver.mechanics.fem.elasticity import Block, lame_parameters, stiffness
from solver.mechanics.fem.faces import boundary_faces, volume_cells
from solver.mechanics.fem.loads import Field, face_forces
from solver.mechanics.fem.supports import Fixed, free_motion
from solver.mechanics.linear.condensation import condense

SIZE, YOUNG, POISSON = 50.0, 2000.0, 0.3


def two_blocks(bottom: int, top: int) -> meshio.Mesh:
    """Squares below and above y = 0, of n × n QUAD4; groups of edges such as `bottom upper`."""
    points, quads, lines, groups = [], [], [], {}
    for name, n, y in (("bottom", bottom, -SIZE), ("top", top, 0.0)):
        node = sum(map(len, points)) + np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
        ticks = SIZE / n * np.arange(n + 1)
        points.append(np.stack(np.meshgrid(ticks, y + ticks), axis=-1).reshape(-1, 2))
        corners = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
        quads.append(np.stack(corners, axis=-1).reshape(-1, 4))
        for side, edge in {"lower": node[0], "upper": node[-1]}.items():
            groups[f"{name} {side}"] = [[], sum(map(len, lines)) + np.arange(n)]
            lines.append(np.stack([edge[:-1], edge[1:]], axis=1))
    cells = [("quad", np.concatenate(quads)), ("line", np.concatenate(lines))]
    return meshio.Mesh(np.concatenate(points), cells, cell_sets=groups)


def contact_pressure(mesh: meshio.Mesh, load: Field) -> np.ndarray:
    """The pressure (m,) of the macro-elements, with `load` pressed on top of the upper block."""
    # Cut the slave's cells, so that each macro-element (a slave face as meshed) owns a node.
    (slave,), (master,) = (boundary_faces(mesh, g) for g in ("top lower", "bottom upper"))
    cut_mesh = cut(mesh.points, volume_cells(mesh), [slave])
    points, n_macro = cut_mesh.points, len(slave.nodes)

    # Intersect slave sub-faces with master faces, and integrate the gap over the segments.
    slaves = [facets(points, f.type, f.nodes, f.macro) for f in cut_mesh.sub_faces]
    masters = [facets(points, master.type, master.nodes, master.number)]
    gap = gap_operator(slaves, masters, n_macro, len(points))

    # Support the base and the left sides: u = offset + basis · x with the free unknowns x.
    x, y = points.T
    base, left = np.flatnonzero(y == -SIZE), np.flatnonzero(x == 0.0)
    along = [(base, [0.0, 1.0]), (left, [1.0, 0.0])]
    fixed = [Fixed(n, np.tile(d, (len(n), 1)), np.zeros(len(n))) for n, d in along]
    free = free_motion(len(points), 2, fixed)

    # Assemble stiffness and loads.
    blocks = []
    for name, nodes in cut_mesh.cells.items():
        lame, shear = lame_parameters(np.full(len(nodes), YOUNG), np.full(len(nodes), POISSON))
        blocks.append(Block(BY_NAME[name], nodes, lame, shear))
    matrix = free.reduced(stiffness(points, blocks))
    (press,) = boundary_faces(mesh, "top upper")
    force = face_forces(points, press.nodes, press.type.name, load, pressure=True)
    force = free.basis.T @ force.ravel()

    # Solve K x = f + Gᵀ p with the closed macro-elements' gaps zero, until no status is wrong.
    constraints = gap.matrix @ free.basis
    slave_nodes = np.unique(np.concatenate([f.nodes.ravel() for f in cut_mesh.sub_faces]))
    own = np.isin(free.selection // 2, slave_nodes)
    closed = np.ones(n_macro, dtype=bool)
    while True:
        system = condense(matrix, constraints[closed], own)
        motion = system.correction(force, -gap.initial[closed])
        pressure = np.zeros(n_macro)
        pressure[closed] = system.multiplier(force - matrix @ motion)
        average_gap = (gap.initial + constraints @ motion) / gap.covered
        wrong = np.where(closed, pressure < 0.0, average_gap < 0.0)
        if not wrong.any():
            return pressure
        closed ^= wrong


if __name__ == "__main__":
    print(contact_pressure(two_blocks(5, 4), load=lambda place: np.full(len(place), 25.0)))
