"""Runs NGSolve on `deck.json` of this folder, and writes what it finds as `result.json`.

NGSolve's own environment starts this file: it imports nothing of this program.
"""

import json
import sys
from pathlib import Path

import netgen.meshing as netgen
import numpy as np
from ngsolve import (
    CF,
    ET,
    H1,
    VOL,
    BilinearForm,
    BitArray,
    ContactBoundary,
    Grad,
    GridFunction,
    Id,
    IfPos,
    InnerProduct,
    IntegrationRule,
    Mesh,
    Sym,
    Trace,
    VectorH1,
    ds,
    dx,
    specialcf,
    x,
    y,
    z,
)

# The reference cell of each type, its vertices in the order of the deck, and the edges that have a
# node in the middle.
TRIANGLE, TETRAHEDRON = [[1, 0], [0, 1], [0, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]]
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
KINDS = {
    "TRIA3": (ET.TRIG, TRIANGLE, []),
    "TRIA6": (ET.TRIG, TRIANGLE, [(0, 1), (1, 2), (2, 0)]),
    "QUAD4": (ET.QUAD, SQUARE, []),
    "TETRA4": (ET.TET, TETRAHEDRON, []),
    "TETRA10": (ET.TET, TETRAHEDRON, [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]),
    "PENTA6": (ET.PRISM, [[*p, h] for h in (0, 1) for p in TRIANGLE], []),
    "HEXA8": (ET.HEX, [[*p, h] for h in (0, 1) for p in SQUARE], []),
}
CORNERS = {"SEG3": 2, "TRIA6": 3, "TETRA10": 4}
# The order of integration over faces is high: integrands have kinks inside them.
ITERATIONS, ORDER = 50, 20
# Pressure by overlap, over Young's modulus of the softest body by the size of a slave face. On
# curved surfaces Newton's method does not end from 20 on.
STIFFNESS, ON_CURVES = 2.5e4, 3.0


def corners(blocks):
    """The corner nodes of cells or faces, one row each."""
    return [row[: CORNERS.get(name)] for name, rows in blocks.items() for row in rows]


def build(deck):
    """The mesh: its points are the corners, its regions the materials and sides of contact."""
    points = np.array(deck["points"])
    dim = points.shape[1]
    mesh = netgen.Mesh(dim)
    number = {
        node: mesh.Add(netgen.MeshPoint(netgen.Pnt(*np.pad(points[node], (0, 3))[:3])))
        for node in vertices(deck).tolist()
    }
    cell = netgen.Element2D if dim == 2 else netgen.Element3D
    if dim == 2:
        for i in range(1, 1 + len(deck["materials"])):
            mesh.Add(netgen.FaceDescriptor(surfnr=i, domin=i, bc=i))
    materials = [material for name in deck["cells"] for material in deck["material"][name]]
    for nodes, material in zip(corners(deck["cells"]), materials):  # noqa: B905
        mesh.Add(cell(material + 1, [number[n] for n in nodes]))
    for i in range(len(deck["materials"])):
        mesh.SetMaterial(i + 1, f"m{i}")
    sides = [pair[side] for pair in deck["contact"] for side in ("slave", "master")]
    for i, side in enumerate(sides, start=1):
        if dim == 3:
            mesh.Add(netgen.FaceDescriptor(surfnr=i, domin=1, bc=i))
        for nodes in corners(side):
            at = [number[n] for n in nodes]
            mesh.Add(netgen.Element1D(at, index=i) if dim == 2 else netgen.Element2D(i, at))
        mesh.SetBCName(i - 1, f"s{i - 1}")
    return Mesh(mesh)


def vertices(deck):
    """The nodes that are corners."""
    return np.unique(np.concatenate(corners(deck["cells"])))


class Nodes:
    """Values at nodes from coefficients: functions of corners are linear, edges have a bubble."""

    bubble = -1 / 8  # in the middle of its edge

    def __init__(self, deck, mesh):
        count, corner = len(deck["points"]), vertices(deck)
        self.ends, self.edge = np.zeros((2, count), dtype=int), np.full(count, -1)
        self.ends[:, corner] = np.arange(len(corner))
        self.order = 1
        numbers = {frozenset(v.nr for v in edge.vertices): edge.nr for edge in mesh.edges}
        for name, rows in deck["cells"].items():
            _, corners, pairs = KINDS[name]
            self.order = 2 if pairs else self.order
            for nodes in rows:
                for middle, pair in zip(nodes[len(corners) :], pairs):  # noqa: B905
                    ends = self.ends[0, [nodes[i] for i in pair]]
                    self.ends[:, middle] = ends
                    self.edge[middle] = mesh.nv + numbers[frozenset(ends.tolist())]

    def values(self, coefficients):
        """At the nodes, of coefficients (k,)."""
        own = np.where(self.edge < 0, 0.0, self.bubble * coefficients[self.edge])
        return coefficients[self.ends].mean(axis=0) + own

    def add_force(self, load, node, value):
        """Add a force on a node to the loads (k,) on the coefficients."""
        for end in self.ends[:, node]:
            load[end] += value / 2
        if self.edge[node] >= 0:
            load[self.edge[node]] += self.bubble * value

    def hold(self, coefficients, free, held):
        """Set the coefficients (k,) for values at nodes, and take them from the free ones."""
        for node, value in sorted(held, key=lambda pair: self.edge[pair[0]]):
            at = self.edge[node]
            if at < 0:
                coefficients[at := self.ends[0, node]] = value
            else:
                assert not free[self.ends[:, node]].any(), "held in the middle of an edge alone"
                mean = coefficients[self.ends[:, node]].mean()
                coefficients[at] = (value - mean) / self.bubble
            free[at] = False


def stiffness(deck):
    """The penalty; the last material is that of rigid bodies."""
    softest = min(law["young"] for law in deck["materials"][:-1])
    return (STIFFNESS if deck["flat"] else ON_CURVES) * softest / deck["face_size"]


class Contact:
    """A zone: pairs of points of its slave and master before any motion, and a penalty."""

    def __init__(self, deck, mesh, nodes, number):
        self.mesh, self.dim, self.nodes = mesh, mesh.dim, nodes
        self.slave = mesh.Boundaries(f"s{2 * number}")
        self.master = mesh.Boundaries(f"s{2 * number + 1}")
        self.stiffness, self.kept = stiffness(deck), []
        zone = deck["contact"][number]
        faces = zone["slave"].values()
        self.used = np.unique(np.concatenate([np.ravel(rows) for rows in faces]))
        self.interference, self.gap = zone["interference"], None
        if zone["gap"] is not None:
            self.gap = GridFunction(H1(mesh, order=nodes.order))
            values = self.gap.vec.FV().NumPy()
            nodes.hold(values, np.zeros(len(values), dtype=bool), zone["gap"])

    def overlap(self, of):
        """How deep the slave is in the master, in linear theory."""
        normal = specialcf.normal(self.dim)
        nearer = (of - of.Other()) * normal
        if self.gap is not None:
            return nearer - self.gap
        place = CF((x, y, z)[: self.dim])
        return (place - place.Other()) * normal + self.interference + nearer

    def add(self, form, energy=None, integrator=None):
        """Add an energy, or an integrator, to a form; the form needs the pairs to live on."""
        pairs = ContactBoundary(self.slave, self.master)
        if energy is not None:
            pairs.AddEnergy(energy)
        else:
            pairs.AddIntegrator(integrator)
        pairs.Update(GridFunction(VectorH1(self.mesh)), form, intorder=ORDER)
        self.kept.append(pairs)

    def pressure(self, found):
        """Node and pressure (k, 2): the penalty pressure, projected on the slave's functions."""
        space = H1(self.mesh, order=self.nodes.order)
        p, q = space.TnT()
        mass = BilinearForm(p * q * ds(self.slave)).Assemble().mat
        overlap = self.overlap(found)
        form, values = BilinearForm(space), GridFunction(space)
        self.add(form, integrator=self.stiffness * IfPos(overlap, overlap, 0) * q)
        right = values.vec.CreateVector()
        form.Apply(values.vec, right)
        values.vec.data = mass.Inverse(space.GetDofs(self.slave), inverse="sparsecholesky") * right
        return np.c_[self.used, self.nodes.values(values.vec.FV().NumPy())[self.used]]


def solve(deck, mesh, nodes, zones):
    """The displacement."""
    space = VectorH1(mesh, order=nodes.order)
    u, v = space.TnT()
    found = GridFunction(space)
    load, free = found.vec.CreateVector(), np.ones((mesh.dim, space.ndof // mesh.dim), dtype=bool)
    load[:] = 0.0
    loads, start = (v.FV().NumPy().reshape(free.shape) for v in (load, found.vec))
    for node, axis, value in deck["forces"]:
        nodes.add_force(loads[axis], node, value)
    for axis in range(mesh.dim):
        held = [(node, value) for node, a, value in deck["held"] if a == axis]
        nodes.hold(start[axis], free[axis], held)
    unknown = BitArray(free.ravel().tolist())
    # The first step ties all pairs: a body may be held by contact alone.
    forms = []
    for tied in (True, False):
        form = BilinearForm(InnerProduct(stress_of(deck, mesh, u), Grad(v)) * dx)
        for zone in zones:
            overlap = zone.overlap(u)
            energy = 0.5 * zone.stiffness * overlap * overlap
            zone.add(form, energy if tied else IfPos(overlap, energy, 0))
        forms.append(form)
    step, residual = found.vec.CreateVector(), found.vec.CreateVector()
    for iteration in range(ITERATIONS):
        form = forms[min(iteration, 1)]
        form.Apply(found.vec, residual)
        residual.data -= load
        form.AssembleLinearization(found.vec)
        step.data = form.mat.Inverse(unknown, inverse="sparsecholesky") * residual
        found.vec.data -= step
        if iteration and step.Norm() <= 1e-10 * found.vec.Norm():
            return found
    sys.exit(f"NGSolve: no convergence in {ITERATIONS} iterations")


def stress_of(deck, mesh, u):
    """Stress of a displacement; in 2D in plane strain."""
    young, poisson = (
        mesh.MaterialCF({f"m{i}": law[key] for i, law in enumerate(deck["materials"])})
        for key in ("young", "poisson")
    )
    mu, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    strain = Sym(Grad(u))
    return 2 * mu * strain + lame * Trace(strain) * Id(mesh.dim)


def nodal(deck, mesh, stress):
    """Stress (xx, yy, xy in 2D, else xx, yy, zz, xy, yz, xz) at the nodes, averaged over cells."""
    rules = {}
    for kind, corners, pairs in (KINDS[name] for name in deck["cells"]):
        points = [*corners, *(np.mean([corners[i] for i in pair], axis=0) for pair in pairs)]
        rules[kind] = IntegrationRule([tuple(map(float, at)) for at in points], [0.0] * len(points))
    nodes = np.concatenate([np.ravel(rows) for rows in deck["cells"].values()])
    axes = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
    places = mesh.MapToAllElements(rules, VOL)
    found = CF(tuple(stress[i, j] for i, j in axes if max(i, j) < mesh.dim))(places)
    assert np.allclose(CF((x, y, z)[: mesh.dim])(places), np.array(deck["points"])[nodes])
    return np.stack([np.bincount(nodes, v) for v in found.T], axis=1) / np.bincount(nodes)[:, None]


def main():
    """Solve, and write displacement and stress at all nodes, pressure at slave nodes."""
    deck = json.loads(Path("deck.json").read_text(encoding="ascii"))
    mesh = build(deck)
    nodes = Nodes(deck, mesh)
    zones = [Contact(deck, mesh, nodes, i) for i in range(len(deck["contact"]))]
    found = solve(deck, mesh, nodes, zones)
    components = found.vec.FV().NumPy().reshape(mesh.dim, -1)
    moved = np.stack([nodes.values(c) for c in components], axis=1)
    number = np.arange(len(moved))
    result = {
        "displacement": np.c_[number, moved].tolist(),
        "stress": np.c_[number, nodal(deck, mesh, stress_of(deck, mesh, found))].tolist(),
        "pressure": [row for zone in zones for row in zone.pressure(found).tolist()],
    }
    Path("result.json").write_text(json.dumps(result), encoding="ascii")


if __name__ == "__main__":
    main()
