"""A toy code: penalty contact of straight edges in 2D, over scikit-fem."""

import json
from pathlib import Path

import numpy as np
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

deck = json.loads(Path("deck.json").read_text())
points, n = np.array(deck["points"]), len(deck["points"])
kinds = {
    "TRIA3": (skfem.MeshTri, skfem.ElementTriP1()),
    "QUAD4": (skfem.MeshQuad, skfem.ElementQuad1()),
}

# Stiffness: the unknowns are u_x, u_y of node 0, then of node 1, …
K = np.zeros((2 * n, 2 * n))
for name, cells in deck["cells"].items():
    mesh, element = kinds[name]
    for number in set(deck["material"][name]):
        mine = np.array(cells)[np.array(deck["material"][name]) == number]
        basis = skfem.Basis(mesh(points.T, mine.T), skfem.ElementVector(element))
        law = deck["materials"][number]
        form = linear_elasticity(*lame_parameters(law["young"], law["poisson"]))
        part = form.assemble(basis).toarray()  # of the nodes up to the last one in these cells
        K[: len(part), : len(part)] += part
f, u, free = np.zeros(2 * n), np.zeros(2 * n), np.ones(2 * n, dtype=bool)
for node, axis, value in deck["forces"]:
    f[2 * node + axis] += value
for node, axis, value in deck["held"]:
    u[2 * node + axis], free[2 * node + axis] = value, False

# Contact: the rows of B give how far points of slave edges are from the master along the normal.
penalty = 3000 * deck["materials"][0]["young"] / np.ptp(points, axis=0).max()
B, gap, weight, place = [], [], [], []
at, share = np.polynomial.legendre.leggauss(20)
for pair in deck["contact"]:
    masters = [(i, j, points[i], points[j] - points[i]) for i, j in pair["master"]["SEG2"]]
    for a, b in pair["slave"]["SEG2"]:
        along = points[b] - points[a]
        normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        for s, w in np.c_[(1 + at) / 2, share / 2]:
            x = points[a] + s * along
            for i, j, start, edge in masters:
                t, distance = np.linalg.solve(np.stack([edge, -normal], axis=1), x - start)
                if 0 <= t <= 1:
                    row = np.zeros((n, 2))
                    for node, value in ((a, s - 1), (b, -s), (i, 1 - t), (j, t)):
                        row[node] += value * normal
                    B.append(row.ravel())
                    gap.append(distance)
                    weight.append(w * np.linalg.norm(along))
                    place.append(x)
                    break
B, gap, weight = np.array(B), np.array(gap), penalty * np.array(weight)

# Only points that overlap carry load; which ones is found by iteration.
closed = np.ones(len(gap), dtype=bool)
for _ in range(50):
    A = K + B[closed].T @ (weight[closed, None] * B[closed])
    b = f - B[closed].T @ (weight[closed] * gap[closed]) - A[:, ~free] @ u[~free]
    u[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    open_now = B @ u + gap
    if ((open_now < 0) == closed).all():
        break
    closed = open_now < 0
pressure = np.maximum(-penalty * open_now, 0)

np.savetxt("displacement.csv", np.c_[points, u.reshape(n, 2)], header="x y ux uy", comments="")
np.savetxt("pressure.csv", np.c_[place, pressure], header="x y pressure", comments="")
