"""Runs GetFEM on `deck.json` of this folder, and writes tables of what it finds.

The system's Python starts this file: it imports nothing of this program.
"""

import json
import sys
from pathlib import Path

import getfem
import numpy as np

# The geometric transformation of each cell type, and its nodes in the order of GetFEM: along x
# first, then y, then z of the reference cell.
KINDS = {
    "TRIA3": ("GT_PK(2,1)", [0, 1, 2]),
    "TRIA6": ("GT_PK(2,2)", [0, 3, 1, 5, 4, 2]),
    "QUAD4": ("GT_QK(2,1)", [0, 1, 3, 2]),
    "QUAD8": ("GT_Q2_INCOMPLETE(2)", [0, 4, 1, 7, 5, 3, 6, 2]),
    "TETRA4": ("GT_PK(3,1)", [0, 1, 2, 3]),
    "TETRA10": ("GT_PK(3,2)", [0, 4, 1, 6, 5, 2, 7, 8, 9, 3]),
    "HEXA8": ("GT_QK(3,1)", [0, 1, 3, 2, 4, 5, 7, 6]),
    "HEXA20": (
        "GT_Q2_INCOMPLETE(3)",
        [0, 8, 1, 11, 9, 3, 10, 2, 16, 17, 19, 18, 4, 12, 5, 15, 13, 7, 14, 6],
    ),
}
LINEAR = ("TRIA3", "QUAD4", "TETRA4", "HEXA8")
CONTACT = 1
# The rule of order 6 on 4 parts of each edge: what is integrated over a face has kinks inside it.
RULES = {
    "TRIA": "IM_TRIANGLE(6)",
    "QUAD": "IM_GAUSS_PARALLELEPIPED(2,6)",
    "TETR": "IM_TETRAHEDRON(6)",
    "HEXA": "IM_GAUSS_PARALLELEPIPED(3,6)",
}
PARTS = 4
# Steps of Newton's method are not cut below 0.8, as in the contact examples of GetFEM.
SEARCH = ("max_iter", 50, "lsearch", "simplest", "alpha min", 0.8)
REACH = 0.1  # how far a ray goes, over the extent of the model


class BodyMesh:
    """One body: its mesh, its displacement, and which of its unknowns belongs to which node."""

    def __init__(self, deck, points, side):
        self.dim, self.points = points.shape[1], points
        faces = [nodes for rows in deck["contact"][0][side].values() for nodes in rows]
        cells = [
            (name, nodes, material)
            for name, rows in deck["cells"].items()
            for nodes, material in zip(rows, deck["material"][name])  # noqa: B905
        ]
        mine = connected(cells, {n for face in faces for n in face}, len(points))
        cells = [cell for cell in cells if cell[1][0] in mine]
        [material] = {material for *_, material in cells}
        law = deck["materials"][material]
        self.rigid = material == len(deck["materials"]) - 1
        self.young, poisson = law["young"], law["poisson"]
        self.mu = self.young / (2 * (1 + poisson))
        self.lame = 2 * self.mu * poisson / (1 - 2 * poisson)
        self.poisson = poisson
        self.mesh = getfem.Mesh("empty", self.dim)
        self.fine = getfem.MeshIm(self.mesh)
        for name, nodes, _ in cells:
            kind, order = KINDS[name]
            corners = points[np.array(nodes)[order]].T
            number = self.mesh.add_convex(getfem.GeoTrans(kind), corners)
            rule = f"IM_STRUCTURED_COMPOSITE({RULES[name[:4]]},{PARTS})"
            self.fine.set_integ(getfem.Integ(rule), number)
        order = 1 if all(name in LINEAR for name, *_ in cells) else 2
        self.order = order
        self.fem = getfem.MeshFem(self.mesh, self.dim)
        self.fem.set_classical_fem(order)
        self.rule = getfem.MeshIm(self.mesh, 2 * order + 4)
        self.node = self.nodes_at(self.fem.basic_dof_nodes(), sorted(mine))
        self.size = float(np.linalg.norm(points[faces[0][1]] - points[faces[0][0]]))
        self.mark(faces)

    def nodes_at(self, places, among):
        """The nodes at places (dim, k)."""
        known = {self.key(self.points[node]): node for node in among}
        return np.array([known[self.key(place)] for place in places.T])

    def key(self, place):
        """A place as a key: coordinates of round-off are the same."""
        return tuple(np.round(place / np.ptp(self.points, axis=0).max(), 9) + 0.0)

    def mark(self, faces):
        """The faces of contact as a region."""
        vertices = {frozenset(self.key(self.points[n]) for n in face) for face in faces}
        found = []
        for convex, face in self.mesh.outer_faces().T[:, :2]:
            ids = self.mesh.pid_in_faces(np.array([[convex], [face]]))
            if frozenset(self.key(place) for place in self.mesh.pts(ids).T) in vertices:
                found.append((convex, face))
        assert len(found) == len(faces)
        self.mesh.set_region(CONTACT, np.array(found).T)


def connected(cells, start, count):
    """The nodes that cells connect to the nodes `start`."""
    mine = np.zeros(count, dtype=bool)
    mine[list(start)] = True
    while True:
        before = mine.sum()
        for _, nodes, _ in cells:
            if mine[nodes].any():
                mine[nodes] = True
        if mine.sum() == before:
            return set(np.flatnonzero(mine).tolist())


def solve(deck):
    """Displacement (n, dim), places and contact pressures, places and stress."""
    points = np.array(deck["points"])
    dim = points.shape[1]
    bodies = [BodyMesh(deck, points, side) for side in ("slave", "master")]
    model = getfem.Model("real")
    for i, body in enumerate(bodies):
        model.add_fem_variable(f"u{i}", body.fem)
        model.add_initialized_data(f"lame{i}", body.lame)
        model.add_initialized_data(f"mu{i}", body.mu)
        model.add_isotropic_linearized_elasticity_brick(body.rule, f"u{i}", f"lame{i}", f"mu{i}")
        axis = np.arange(len(body.node)) % dim
        known = {(int(n), int(a)): k for k, (n, a) in enumerate(zip(body.node, axis))}  # noqa: B905
        force = np.zeros(len(body.node))
        for node, a, value in deck["forces"]:
            if (node, a) in known:
                force[known[node, a]] = value
        model.add_explicit_rhs(f"u{i}", force)
        held = [(n, np.eye(dim)[a], value) for n, a, value in deck["held"]] + deck["oblique"]
        held = [support for support in held if (support[0], 0) in known]
        if held:
            rows = getfem.Spmat("empty", len(held), len(body.node))
            for row, (n, direction, _) in enumerate(held):
                for a, part in enumerate(direction):
                    rows.add(row, known[n, a], part)
            model.add_variable(f"reaction{i}", len(held))
            values = np.array([value for *_, value in held])
            model.add_constraint_with_multipliers(f"u{i}", f"reaction{i}", rows, values)
        model.set_variable(f"u{i}", np.array(deck["start"])[body.node, axis])
    slave = bodies[0]
    pressures = getfem.MeshFem(slave.mesh, 1)
    # Of degree one also on quadratic cells, whose quadratic multipliers are not stable.
    pressures.set_classical_fem(1)
    contact = pressures.basic_dof_on_region(CONTACT)
    model.add_fem_variable("pressure", getfem.MeshFem("partial", pressures, contact))
    model.add_initialized_data("r", min(body.young for body in bodies) / slave.size)
    add_contact(model, bodies, deck["contact"][0], pressures, contact)
    force = sum(abs(value) for *_, value in deck["forces"])
    moved = max((abs(value) for *_, value in deck["held"]), default=0.0)
    extent = np.ptp(points, axis=0).max()
    scale = force + slave.young * moved * extent ** (dim - 2)
    # Bodies that overlap have a load of their own: the force of a strain of 1e-6.
    scale = scale or 1e-6 * slave.young * extent ** (dim - 1)
    iterations, converged = model.solve("noisy", *SEARCH, "max_res", 1e-9 * scale)
    if not converged:
        sys.exit(f"GetFEM: no convergence in {iterations} iterations")
    displacement = np.full(points.shape, np.nan)
    stress = []
    for i, body in enumerate(bodies):
        displacement[body.node, np.arange(len(body.node)) % dim] = model.variable(f"u{i}")
        if not body.rigid:
            stress.append(stress_of(model, body, i))
    places = pressures.basic_dof_nodes(contact).T
    return displacement, np.c_[places, model.variable("pressure")], np.concatenate(stress)


def add_contact(model, bodies, zone, pressures, contact):
    """Contact along the normals of the slave's faces as meshed: rays find the master's faces.

    `contact` are the unknowns of `pressures` on these faces: a prescribed gap is given there.
    """
    extent = np.ptp(bodies[0].points, axis=0).max()
    model.add_raytracing_transformation("ray", REACH * extent)
    for i, (body, side) in enumerate(zip(bodies, ("slave", "master"))):  # noqa: B905
        model.add_initialized_fem_data(f"still{i}", body.fem, np.zeros(len(body.node)))
        add = getattr(model, f"add_{side}_contact_boundary_to_raytracing_transformation")
        add("ray", body.mesh, f"still{i}", CONTACT)
    if zone["gap"] is None:
        model.add_initialized_data("interference", zone["interference"])
        initial = "((Interpolate(X,ray)-X).Normal)-interference"
    else:
        given = dict(zone["gap"])
        gaps = np.zeros(pressures.nbdof())
        gaps[contact] = [
            given[n] for n in bodies[0].nodes_at(pressures.basic_dof_nodes(contact), given)
        ]
        model.add_initialized_fem_data("clearance", pressures, gaps)
        initial = "clearance"
    gap = f"({initial}+(Interpolate(u1,ray)-u0).Normal)"
    for paired, term in (
        (1, "pressure*((Test_u0-Interpolate(Test_u1,ray)).Normal)"),
        (1, f"-(pressure-pos_part(pressure-r*{gap}))/r*Test_pressure"),
        (0, "-pressure/r*Test_pressure"),
    ):
        filtered = f"Interpolate_filter(ray,{term},{paired})"
        model.add_nonlinear_term(bodies[0].fine, filtered, CONTACT)


def stress_of(model, body, i):
    """Places and stress (xx, yy, zz, xy, yz, xz) at the vertices, averaged over cells."""
    space = getfem.MeshFem(body.mesh, 1)
    space.set_classical_discontinuous_fem(1)
    tensor = f"(lame{i}*Trace(Grad_u{i})*Id({body.dim})+mu{i}*(Grad_u{i}+Grad_u{i}'))"
    pairs = [(1, 1), (2, 2), (3, 3), (1, 2), (2, 3), (1, 3)]
    keys = [body.key(place) for place in space.basic_dof_nodes().T]
    number = {key: k for k, key in enumerate(dict.fromkeys(keys))}
    which = np.array([number[key] for key in keys])
    place = np.zeros((len(number), body.dim))
    place[which] = space.basic_dof_nodes().T
    found = np.zeros((len(number), 6))
    for column, (a, b) in enumerate(pairs):
        if max(a, b) <= body.dim:
            values = model.local_projection(body.rule, f"{tensor}({a},{b})", space)
            found[:, column] = np.bincount(which, values) / np.bincount(which)
    if body.dim == 2:
        found[:, 2] = body.poisson * (found[:, 0] + found[:, 1])
    return np.c_[place, found]


def main():
    """Solve, and write the tables."""
    deck = json.loads(Path("deck.json").read_text(encoding="ascii"))
    axes = ["x", "y", "z"][: len(deck["points"][0])]
    displacement, pressure, stress = solve(deck)
    rows = np.c_[deck["points"], displacement]
    rows = rows[~np.isnan(rows).any(axis=1)]
    write("displacement.csv", [*axes, *(f"u{axis}" for axis in axes)], rows)
    write("pressure.csv", [*axes, "pressure"], pressure)
    write("stress.csv", [*axes, "sxx", "syy", "szz", "sxy", "syz", "sxz"], stress)


def write(name, head, rows):
    """A table with a line of names."""
    np.savetxt(name, rows, fmt="%.16e", header=" ".join(head), comments="")


if __name__ == "__main__":
    main()
