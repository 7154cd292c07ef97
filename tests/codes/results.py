"""Results as another code would write them: the exact state of a patch test, by hand."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import meshio
import numpy as np

from solver.case.reader import load_case
from solver.verification.run import mesh_of

ROOT = Path(__file__).parents[2]


@cache
def mesh_and_case(name):
    case = load_case(ROOT / "cases" / f"{name}.yaml")
    return mesh_of(case), case


@dataclass(frozen=True)
class Answer:
    """Volume cells and values at nodes: 25 on the interface, uniaxial strain by Hooke's law."""

    points: np.ndarray
    cells: list
    displacement: np.ndarray
    stress: np.ndarray
    pressure: np.ndarray

    @property
    def mesh(self):
        data = {
            "displacement": np.pad(
                self.displacement, ((0, 0), (0, 3 - self.displacement.shape[1]))
            ),
            "stress": self.stress,
            "contact_pressure": self.pressure,
        }
        points = np.pad(self.points, ((0, 0), (0, 3 - self.points.shape[1])))
        return meshio.Mesh(points, self.cells, point_data=data)

    def changed(self, **fields):
        return replace(self, **fields)


def patch(name="ssnp170/a"):
    """Blocks of height 50 above and below 0, E = 2000, ν = 0.3, p = 25."""
    mesh, case = mesh_and_case(name)
    x, dim = mesh.points, mesh.points.shape[1]
    axial, lateral = (-0.011375, 0.004875) if dim == 2 else (-0.0125, 0.00375)
    moved = lateral * x
    moved[:, -1] = axial * (x[:, -1] - x[:, -1].min())
    stress = np.zeros((len(x), 6))
    stress[:, dim - 1] = -25.0
    if dim == 2:
        stress[:, 2] = -7.5
    cells = [(block.type, block.data) for block in mesh.cells if block.dim == dim]
    slave = slave_nodes(mesh, case)
    pressure = np.zeros(len(x))
    pressure[slave] = 25.0
    return Answer(x.copy(), cells, moved, stress, pressure)


def slave_nodes(mesh, case):
    group = mesh.cell_sets[case.zones[0].slave]
    found = [
        b.data[np.asarray(of, dtype=int)].ravel() for b, of in zip(mesh.cells, group, strict=True)
    ]
    return np.unique(np.concatenate(found))


def write_vtu(answer, path):
    meshio.vtu.write(path, answer.mesh)
    return path


def write_frd(path, points, hexahedra, moved, stress, contact):
    """As CalculiX writes it: labels in ten columns, values in twelve; `contact` by node label."""

    def rows(values):
        return [f" -1{n:10d}" + "".join(f"{v:12.5E}" for v in row) for n, row in values]

    def block(name, components, values):
        head = (
            f"  100CL  101 1.00000000E+00{len(values):12d}                     0    1           1"
        )
        listed = [f" -5  {c:8s}    1    2    {i}    0" for i, c in enumerate(components, start=1)]
        return [head, f" -4  {name:8s}{len(components):5d}    1", *listed, *rows(values), " -3"]

    numbered = list(enumerate(points, start=1))
    lines = ["    1C", "    1UVERSION           Version 2.20"]
    lines += [f"    2C{len(points):30d}{' ' * 37}1", *rows(numbered), " -3"]
    lines.append(f"    3C{len(hexahedra):30d}{' ' * 37}1")
    for number, nodes in enumerate(hexahedra, start=1):
        lines.append(f" -1{number:10d}    1    0    1")
        lines.append(" -2" + "".join(f"{n + 1:10d}" for n in nodes))
    lines.append(" -3")
    lines += block("DISP", ["D1", "D2", "D3"], list(enumerate(moved, start=1)))
    names = ["SXX", "SYY", "SZZ", "SXY", "SYZ", "SZX"]
    lines += block("STRESS", names, list(enumerate(stress, start=1)))
    names = ["COPEN", "CSLIP1", "CSLIP2", "CPRESS", "CSHEAR1", "CSHEAR2"]
    lines += block("CONTACT", names, contact)
    path.write_text("\n".join([*lines, " 9999", ""]), encoding="ascii")
    return path
