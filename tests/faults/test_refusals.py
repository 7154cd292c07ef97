"""Refusals that no other test meets."""

import re

import h5py
import numpy as np
import pytest
from scipy import sparse

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.errors import SolveError
from solver.lac.facets import project_along
from solver.mechanics.fem.block import Block
from solver.mechanics.fem.elasticity import element_matrices
from solver.mechanics.fem.loads import body_forces
from solver.mechanics.linear.factor import factorise
from solver.mesh import read_mesh
from solver.system.errors import InputError
from solver.verification.checks import accepted_values, regression_file
from tests.handmade import plane
from tests.mesh.one_cell import write_by_gmsh
from tests.scenes import block_case, block_mesh

FOLDED = np.array([(0, 0), (1, 0), (0.2, 0.2), (0, 1)], dtype=float)
QUAD = np.array([[0, 1, 2, 3]])


def test_cells_that_fold_at_their_quadrature_points():
    block = Block(BY_NAME["QUAD4"], QUAD, np.ones(1), np.ones(1))
    with pytest.raises(SolveError, match=r"^1 QUAD4 cells are inverted or degenerate"):
        element_matrices(FOLDED[[0, 3, 2, 1]], block)
    with pytest.raises(SolveError, match="QUAD4 cells under a body force are inverted or degene"):
        body_forces(FOLDED[[0, 3, 2, 1]], QUAD, "QUAD4", lambda x: np.ones_like(x))


def test_a_line_along_a_face_never_meets_it():
    bent = np.array([[(0, 0), (1, 0), (0.5, 0.3)]], dtype=float)
    along = np.array([[(1.0, 0.0)]])
    with pytest.raises(SolveError, match="1 points could not be projected onto SEG3 faces"):
        project_along(BY_NAME["SEG3"], bent, np.array([[(0.0, 5.0)]]), along)


def test_a_row_of_nothing():
    with pytest.raises(SolveError, match=r"the matrix is singular: row 1 is zero|diagonal entry 1"):
        factorise(sparse.diags([1.0, 0.0, 2.0]).tocsr())


def test_a_matrix_that_is_not_definite():
    with pytest.raises(SolveError, match="the matrix is not positive definite: a pivot fails in "):
        factorise(sparse.csr_matrix([[1.0, 2.0], [2.0, 1.0]]))


def med(tmp_path, change):
    path = tmp_path / "m.med"
    write_by_gmsh("TRIA3", path)
    with h5py.File(path, "a") as file:
        change(next(iter(file["ENS_MAA"].values())))
    return path


def cylindrical(mesh):
    mesh.attrs["REP"] = 1


def without_nodes(mesh):
    for step in mesh.values():
        del step["NOE"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (cylindrical, "coordinates: must be Cartesian"),
        (without_nodes, "no nodes in the layout of MED 2.2 or later; for older files: medimport"),
    ],
)
def test_med_files_of_other_kinds(tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        read_mesh(med(tmp_path, change))


def test_a_text_that_is_no_med_file(tmp_path):
    (tmp_path / "m.med").write_text("text")
    with pytest.raises(InputError, match=re.escape("no MED file (MED files are HDF5 files)")):
        read_mesh(tmp_path / "m.med")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "Input data was truncated"),
        ('{"multiplier interface": 25}', "Expected `object`, got `int`"),
        ('{"multiplier interface": {"minimum": 1, "maximum": "x"}}', "Expected `float`, got `str`"),
        ('{"multiplier interface": {"minimum": NaN, "maximum": 1}}', "invalid character"),
    ],
)
def test_accepted_values_that_are_none(tmp_path, text, reason):
    solution = plane(tmp_path)
    path = regression_file(solution)
    path.parent.mkdir()
    path.write_text(text)
    with pytest.raises(InputError, match="must map checks to {minimum: number, .*" + reason):
        accepted_values(solution)


def test_a_solve_whose_fields_are_not_sound(monkeypatch):
    from solver.simulation.results import results
    from solver.simulation.simulate import simulate

    mesh = block_mesh("QUAD4", "QUAD4")
    monkeypatch.setattr(results, "normal_stress", lambda *_: np.full(3, np.nan))
    with pytest.raises(SolveError, match="the solve came to no sound end: "):
        simulate(block_case(2), mesh)
