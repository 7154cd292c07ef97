"""Abaqus input as CalculiX understands it: volumes of curved cells, and the numbers of faces.

Skipped where its solver `ccx` is not installed (Debian: calculix-ccx).
"""

import re
import shutil
import subprocess
from pathlib import Path

import meshio
import numpy as np
import pytest
import sympy
from sympy.abc import x, y, z

from solver.lac.cells.catalogue import BY_MESHIO, BY_NAME
from solver.lac.cells.shape import gauss_rule, shape_functions
from solver.mesh import read_mesh
from tests.mesh.curved import Curved

pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")

TYPES = {
    "TETRA4": "C3D4", "TETRA10": "C3D10", "PENTA6": "C3D6", "PENTA15": "C3D15",
    "HEXA8": "C3D8", "HEXA20": "C3D20",
}  # fmt: skip


class Bulging(Curved):
    """Curved along x alone: the Jacobian is linear, so that the rules of CalculiX are exact."""

    @property
    def expressions(self) -> list[sympy.Expr]:
        along = sympy.expand(super().expressions[0])
        return [along - along.coeff(x * y * z) * x * y * z, x / 9 + y, z - y / 7]


def run(name: str, folder: Path) -> tuple[Path, str]:
    """The deck of one cell, and what CalculiX prints of it: volume, and forces of each face."""
    curved = Bulging.of(name)
    nodes = curved.places(curved.cell.nodes)
    lines = ["*NODE, NSET=all"]
    lines += [f"{i}, " + ", ".join(map(repr, p)) for i, p in enumerate(nodes.tolist(), 1)]
    lines += [f"*ELEMENT, TYPE={TYPES[name]}, ELSET=body", "1,"]
    numbers = list(map(str, range(1, len(nodes) + 1)))
    lines += [", ".join(numbers[i : i + 10]) + "," * (i + 10 < len(nodes)) for i in (0, 10)]
    faces = range(1, len(curved.cell.faces) + 1)
    for face in faces:
        lines += [f"*SURFACE, NAME=face{face}, TYPE=ELEMENT", f"1, S{face}"]
    lines += ["*MATERIAL, NAME=m", "*ELASTIC", "1., 0.3", "*SOLID SECTION, ELSET=body, MATERIAL=m"]
    lines += ["*BOUNDARY", "all, 1, 3", "*STEP", "*STATIC", "*EL PRINT, ELSET=body", "EVOL"]
    for face in faces:
        lines += [f"*SECTION PRINT, SURFACE=face{face}, NAME=print{face}", "SOF, SOM, SOAREA"]
    lines += ["*END STEP"]
    deck = folder / "cell.inp"
    deck.write_text("\n".join(line for line in lines if line) + "\n")
    subprocess.run(["ccx", "cell"], cwd=folder, check=True, capture_output=True, timeout=60)
    return deck, (folder / "cell.dat").read_text()


def told_of_faces(printed: str) -> np.ndarray:
    """Centre, mean normal and area of each face, (faces, 7)."""
    rows = []
    for part in printed.split("statistics for surface set")[1:]:
        lines = [line.split() for line in part.splitlines()]
        numbers = [line for line in lines if line and re.match(r"-?\d", line[0])]
        _, centre_and_normal, _, sizes, *_ = numbers
        rows.append([*centre_and_normal, sizes[0]])
    return np.array(rows, dtype=float)


def own_face(mesh: meshio.Mesh, group: str) -> np.ndarray:
    """The same of the face that a group holds as we read it, (7,)."""
    members = zip(mesh.cells, mesh.cell_sets[group], strict=True)
    [(block, number)] = [(b, i[0]) for b, i in members if i is not None and len(i)]
    kind = BY_MESHIO[block.type]
    at, weights = gauss_rule(kind.name, 4)
    values, gradients = shape_functions(kind.name).both(at)
    points = mesh.points[block.data[number]]
    tangents = np.einsum("pnd,ne->pde", gradients, points)
    normal = np.cross(tangents[:, 0], tangents[:, 1])
    share = weights * np.linalg.norm(normal, axis=1)
    area = share.sum()
    return np.array([*(share @ (values @ points) / area), *(weights @ normal / area), area])


@pytest.mark.parametrize("name", TYPES)
def test_volumes_and_faces(name, tmp_path):
    deck, printed = run(name, tmp_path)
    volume = re.search(r"volume \(element.*\s+1\s+(\S+)", printed)
    assert float(volume[1]) == pytest.approx(Bulging.of(name).volume, rel=1e-6)
    mesh = read_mesh(deck)
    theirs = told_of_faces(printed)
    assert len(theirs) == len(BY_NAME[name].faces)
    for number, face in enumerate(theirs, 1):
        # CalculiX takes one point on the faces of prisms; any other face lies elsewhere by tenths.
        np.testing.assert_allclose(own_face(mesh, f"face{number}"), face, atol=1e-2)
