"""Results on meshes of their own, and at some nodes alone."""

import meshio
import numpy as np
import pytest

from solver.codes.foreign import Field, ForeignResult
from solver.codes.verdicts import check_foreign
from solver.lac.motions import body_numbers
from tests.codes import results
from tests.codes.blocks import case_of


def test_norms_are_integrated_on_another_mesh():
    """Half-width, peak and force of the exact ellipse on TRIA3, for the case on QUAD4."""
    mesh, case = results.mesh_and_case("hertz/cylinder-tria3")
    other, of_other = results.mesh_and_case("hertz/cylinder-quad4")
    slave = results.slave_nodes(mesh, case)
    pressure = np.zeros(len(mesh.points))
    pressure[slave] = case.reference.exact.contact_pressure(mesh.points[slave])
    cells = [(b.type, b.data) for b in mesh.cells if b.dim == 2]
    for turn in (slice(None), slice(None, None, -1)):  # cells of either orientation
        given = ForeignResult(
            code="mine",
            mesh=meshio.Mesh(mesh.points, [(kind, data[:, turn]) for kind, data in cells]),
            pressure=Field(places=mesh.points, values=pressure, nodes=np.arange(len(pressure))),
        )
        verdict = check_foreign(of_other, given, other)
        assert verdict.estimates.errors["half_width"] < 0.01
        assert verdict.estimates.errors["peak"] < 0.01
        balance = next(c for c in verdict.checks if c.name == "balance")
        assert balance.error < 0.01


def test_the_error_of_a_displacement_is_integrated_on_another_mesh():
    """The exact displacement on QUAD8 and QUAD9, a tenth too large, for the case on QUAD4."""
    mesh, _ = results.mesh_and_case("polynomial/quad9")
    other, case = results.mesh_and_case("polynomial/quad4")
    cells = [(block.type, block.data) for block in mesh.cells if block.dim == 2]
    body = body_numbers(len(mesh.points), dict(cells))
    exact = case.reference.exact.displacement(
        mesh.points, case.reference.exact.node_parts(mesh.points, body)
    )
    numbers = np.arange(len(mesh.points))
    given = Field(places=mesh.points, values=1.1 * exact, nodes=numbers)
    plain = meshio.Mesh(mesh.points, cells)
    found = check_foreign(
        case, ForeignResult(code="mine", mesh=plain, displacement=given), other
    ).estimates.errors
    assert found["displacement_l2"] == pytest.approx(0.1, rel=1e-3)


def test_long_faces_have_the_values_at_their_corners():
    """Faces of 50 × 5: the corners are farther away than the root of the area."""
    body = {"cells": "HEXA8", "divisions": [1, 10, 1]}
    more = {"mesh": {"recipe": "blocks", "size": 50, "bottom": body, "top": body}}
    case, mesh = case_of("HEXA8", "HEXA8", **more)
    at = mesh.points[results.slave_nodes(mesh, case)]

    pressure = Field(places=at, values=np.full(len(at), 25.0))
    verdict = check_foreign(case, ForeignResult(code="mine", pressure=pressure), mesh)
    assert verdict.verdict == "passed", verdict.reason


def test_values_at_the_vertices_of_quadratic_cells():
    """Stress is compared where it is; norms of the displacement need it at all nodes."""
    mesh, case = results.mesh_and_case("manufactured/quad8")
    exact, points = case.reference.exact, mesh.points[:, :2]
    blocks = zip(mesh.cells, mesh.cell_sets["top"], strict=True)
    vertices = np.unique(np.concatenate([b.data[rows][:, :4] for b, rows in blocks if len(rows)]))
    slave = results.slave_nodes(mesh, case)

    def at(nodes, values, factor=1.0):
        values[len(values) // 2] *= factor
        return Field(places=points[nodes], values=values)

    def found(moved, factor=1.0):
        stress = at(vertices, exact.stress(points[vertices], np.zeros(len(vertices), int)), factor)
        moved = at(moved, exact.displacement(points[moved], np.zeros(len(moved), int)))
        pressure = at(slave, exact.contact_pressure(points[slave]))
        given = ForeignResult(code="mine", displacement=moved, stress=stress, pressure=pressure)
        return check_foreign(case, given, mesh)

    assert found(np.arange(len(points))).verdict == "passed"
    wrong = found(np.arange(len(points)), 1.1)
    assert [check.name for check in wrong.checks if not check.passed] == ["stress_max"]
    less = found(vertices)
    assert less.verdict == "partial"
    assert "too few values for its checks: displacement at 289 of 289 nodes" in less.reason
    assert less.foreign.compared.keys() == {"stress", "pressure"}
