"""Our own results, read as those of another code: they pass, and with a fault they do not."""

from dataclasses import replace

import h5py
import meshio
import numpy as np
import pytest

from solver import solve_case
from solver.case.reader import load_case
from solver.codes.files.read import read_result_files
from solver.codes.foreign import Field, ForeignResult
from solver.codes.model import Model
from solver.codes.verdicts import check_foreign
from solver.lac.cells.catalogue import cell_type
from solver.system.errors import InputError
from solver.system.files import seal
from solver.verification.run import mesh_of
from tests.codes.results import ROOT

# Values of cells: of faces that are cut, quadratic, rings, under the end of a master or far from
# it, with a shear that pressures do not tell, with multipliers at nodes, on two zones; of bodies
# that moved far, at the last of their positions; beside rigid surfaces that the mesh does not have,
# or has as faces alone.
NAMES = (
    *("ssnp170/e", "shared/cross-quad4-tria3", "axisymmetric/ring-tria6-quad9"),
    *("axisymmetric/before-contact", "uncovered/quad8-quad4", "uncovered/tria6-quad9"),
    *("friction-patch/b-stick", "bending/quad8-tria6-nodal", "bending/tetra10-hexa27"),
    *("motion/slide-c-friction", "motion/rings"),
    *("rigid/between-planes", "rigid/curved-face", "rigid/lines-of-the-mesh"),
)


CASES = [load_case(ROOT / "cases" / f"{name}.yaml") for name in NAMES]
SOLVES = [(case, False) for case in CASES]
SOLVES += [(case, True) for case in CASES if case.about.directions == "both"]


@pytest.mark.parametrize(
    ("case", "swapped"), SOLVES, ids=[case.as_solved(swapped).job for case, swapped in SOLVES]
)
def test_the_right_answer_passes_and_a_wrong_pressure_does_not(case, swapped, tmp_path):
    file, mesh = tmp_path / "result.vtkhdf", mesh_of(case)
    solve_case(case.path, swapped=swapped).save(file)
    case = case.as_solved(swapped)
    verdict = check_foreign(case, read_result_files([file]), mesh)
    assert verdict.verdict == "passed", verdict.reason
    assert {"displacement", "stress", "pressure", "gap"} == verdict.foreign.compared.keys()
    with h5py.File(file, "a") as content:
        fields = content["VTKHDF/CellData"]
        values, covered = fields["pressure"][()], fields["coverage"][()] > 0.99
        covered[: -content["VTKHDF/NumberOfCells"][0]] = False
        place = np.argmax(np.where(covered, values, -1.0))
        values[place] += 0.2 * max(values[place], 1.0)
        fields["pressure"][:] = values
    seal(file)
    verdict = check_foreign(case, read_result_files([file]), mesh)
    assert verdict.verdict == "failed"
    assert "multiplier" in verdict.reason or "pressure" in verdict.reason


def pressures(name):
    """A case, its model, and the exact pressure at the middles of its slave faces, by zone."""
    case = load_case(ROOT / "cases" / f"{name}.yaml")
    model = Model.of(case, mesh_of(case))
    return case, model, [model.reference_pressure(zone) for zone in model.scene.zones]


@pytest.mark.parametrize("table", [False, True])
@pytest.mark.parametrize(
    "name", ["cross-hexa8-tetra10", "corner-quad4-tria6", "junction-quad8-tria3"]
)
def test_where_zones_meet_a_value_at_a_node_is_of_neither(name, table):
    case, model, exact = pressures(f"shared/{name}")
    values = np.full(len(model.points), np.nan)
    for zone, pressure in zip(model.solution.zones, exact, strict=True):
        values[zone.surfaces.slave_nodes] = pressure[0]
    nodes = np.flatnonzero(np.isfinite(values))
    given = Field(places=model.points[nodes], values=values[nodes], nodes=None if table else nodes)
    result = ForeignResult(code="mine", mesh=None if table else model.mesh, pressure=given)
    verdict = check_foreign(case, result, model.mesh, only=["pressure"])
    assert verdict.verdict == "passed", verdict.reason


@pytest.mark.parametrize("name", ["axisymmetric/ring-tria6-quad9", "lame/spheres-hexa20"])
def test_the_middle_of_a_face_is_that_of_its_corners_too(name):
    case, model, [exact] = pressures(name)
    [zone] = model.solution.zones
    places = np.empty_like(zone.centre)
    for kind, nodes, macro in zone.faces:
        places[macro] = model.points[nodes[:, : cell_type(kind).n_vertices]].mean(axis=1)
    result = ForeignResult(code="mine", pressure=Field(places=places, values=exact))
    verdict = check_foreign(case, result, model.mesh, only=["pressure"])
    assert verdict.verdict == "passed", verdict.reason


def test_rigid_surfaces_that_move_far_are_refused_by_name():
    case = load_case(ROOT / "cases/motion/ironing.yaml")
    mesh = mesh_of(case)
    still = Field(places=mesh.points, values=np.zeros_like(mesh.points))
    with pytest.raises(InputError, match="motion = 'large': a rigid body without cells"):
        check_foreign(case, ForeignResult(code="mine", displacement=still), mesh)


def test_pressures_need_contact():
    case = load_case(ROOT / "cases/ssnp170/a.yaml")
    case, mesh = replace(case, zones=()), mesh_of(case)
    given = Field(places=mesh.points, values=np.zeros(len(mesh.points)))
    with pytest.raises(InputError, match="pressure: the case has no contact zone"):
        check_foreign(case, ForeignResult(code="mine", pressure=given), mesh)


def test_pressures_on_the_sides_of_a_layer():
    """A plane case as a layer of hexahedra, whose upright sides are the faces of contact."""
    case = load_case(ROOT / "cases/ssnp170/c.yaml")
    mesh = mesh_of(case)
    flat = np.pad(mesh.points, ((0, 0), (0, 1)))
    squares, lines = (
        next(block.data for block in mesh.cells if block.type == kind) for kind in ("quad", "line")
    )
    chosen = mesh.cell_sets[case.zones[0].slave][[b.type for b in mesh.cells].index("line")]
    sides, above = lines[np.asarray(chosen, dtype=int)], len(flat)
    cells = [
        ("hexahedron", np.hstack([squares, squares + above])),
        ("quad", np.hstack([sides, sides[:, ::-1] + above])),
    ]
    layer = meshio.Mesh(np.concatenate([flat, flat + np.array([0.0, 0.0, 1.0])]), cells)
    values = np.repeat([np.nan, 25.0], [len(squares), len(sides)])
    places = np.concatenate([layer.points[data].mean(axis=1) for _, data in cells])
    given = Field(places=places, values=values, cells=np.arange(len(values)))
    result = ForeignResult(code="mine", mesh=layer, pressure=given)
    verdict = check_foreign(case, result, mesh, only=["pressure"])
    assert verdict.verdict == "passed", verdict.reason
