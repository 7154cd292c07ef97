"""How large a case will be, told before there is a mesh."""

from pathlib import Path

import meshio
import pytest
import yaml

from solver.case.reader import load_case
from solver.mesh.size import Size, of_body, of_mesh
from solver.verification.run import mesh_of

CASES = Path(__file__).resolve().parents[2] / "cases"


def test_grids_are_counted_and_refined():
    """By hand: those vertices, edges, faces and cells of a grid that have nodes."""
    assert of_body("HEXA8", [2, 3, 4]).points == 3 * 4 * 5
    assert of_body("HEXA8", [2, 3, 4], refine=2).unknowns == 3 * 5 * 7 * 9
    assert of_body("QUAD8", [10]).points == 11 * 11 + 2 * 10 * 11
    assert of_body("QUAD9", [2, 3]).points == 5 * 7
    assert of_body("HEXA20", [1, 1, 1]).points == 20
    assert of_body("HEXA27", [2, 2, 1]).points == 5 * 5 * 3
    assert of_body("PYRA13", [1, 1, 1]).points == 8 + 12 + 1 + 8
    assert of_body("HEXA20", [4]).degree == 2
    section = {"cells": "QUAD4", "divisions": [3, 5]}
    mesh = {"recipe": "wavy", "bottom": section, "top": section, "refine": 2}
    assert of_mesh(mesh, Path(), refine=3).unknowns == 2 * 2 * (6 * 3 + 1) * (6 * 5 + 1)


@pytest.mark.parametrize("name", ["ssnp170/c", "ssnp170/k", "hertz/cylinder-tria6", "lame/spheres"])
def test_a_recipe_is_told_within_half_and_twice(name):
    """Small meshes have more nodes than cells times what is told, for those on their boundary."""
    [file] = sorted(CASES.glob(f"{name}*.yaml"))[:1]
    mesh = mesh_of(load_case(file))
    told = of_mesh(yaml.safe_load(file.read_text())["mesh"], file.parent)
    assert told.dim == mesh.points.shape[1]
    assert 0.5 < told.points / len(mesh.points) < 2


@pytest.mark.parametrize("suffix", [".med", ".vtu", ".inp"])
def test_a_mesh_file_is_told_by_its_length(suffix, tmp_path):
    mesh = mesh_of(load_case(CASES / "ssnp170" / "m.yaml"))
    meshio.write(tmp_path / f"part{suffix}", meshio.Mesh(mesh.points, mesh.cells))
    told = of_mesh({"file": f"part{suffix}"}, tmp_path)
    assert 0.5 < told.points / len(mesh.points) < 4


BROKEN = [
    None,
    "blocks",
    {"file": "none.med"},
    {"bottom": {"cells": "QUAD4"}},
    {"bottom": {"cells": 4, "divisions": [2, 2]}},
    {"bottom": {"cells": "QUAD4", "divisions": []}},
    {"bottom": {"cells": "QUAD4", "divisions": "many"}},
    {"bottom": {"cells": "HEXA8", "divisions": -2}},
    {"bottom": {"cells": ["HEXA8"], "divisions": [2, 2, 2]}},
    {"bottom": {"cells": "HEXA8", "divisions": [2, 2]}},
    {"bottom": {"cells": "HEXA8", "divisions": [10**200]}},
]


@pytest.mark.parametrize("mesh", BROKEN)
def test_what_is_broken_has_no_size(mesh, tmp_path):
    assert of_mesh(mesh, tmp_path).unknowns == 0


def test_a_cluster_is_asked_for_more_than_is_usual():
    need = Size(34_848, 3).memory
    assert need.least < need.usual < need.most
    assert need.usual == pytest.approx(0.50e9, rel=0.05)  # HEXA8 as measured
