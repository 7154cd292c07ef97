"""The inf-sup constant: it levels off with the cut and falls without it."""

from dataclasses import replace

import pytest

from solver.simulation.scene.scene import build_scene
from solver.studies.description import read_study
from solver.studies.figures.inf_sup import levels_off
from solver.studies.measures import inf_sup, inf_sup_constant
from solver.studies.points import points_of
from tests.scenes import block_mesh, changed_case
from tests.studies.measured import INFSUP


def constants(cells, counts, coarser=4, treatment="lac", hexahedra="pyramids", clamped=True):
    """β_h for slave surfaces of so many divisions, the master coarser, E = 1."""
    found = []
    for n in counts:
        mesh = block_mesh(cells, cells, (n, max(1, n // coarser)))
        dim = mesh.points.shape[1]
        zone = f", treatment: {treatment}, hexahedra: {hexahedra}"
        changes = [("young: 2000.0", "young: 1.0")]
        if clamped:
            axes = list("xyz"[:dim])
            held = f"  - {{group: base, fix: {axes}}}\n  - {{group: press, fix: {axes}}}\n"
            changes.append((f"  - {{group: base, fix: [{axes[-1]}]}}\n", held))
        case = changed_case(dim, *changes, zone=zone)
        found.append(inf_sup_constant(build_scene(case, mesh)))
    return found


@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize("coarser", [1, 4])
@pytest.mark.parametrize("cells", ["TRIA3", "QUAD4", "TRIA6", "QUAD8", "QUAD9"])
def test_plane_cells_level_off_with_the_cut(cells, coarser, clamped):
    found = constants(cells, (16, 32), coarser, clamped=clamped)
    assert found[-1] > 0.4
    assert found[-1] > 0.97 * found[-2]


@pytest.mark.parametrize("cells", ["TRIA3", "QUAD4"])
def test_plane_cells_lose_control_without_the_cut(cells):
    found = constants(cells, (8, 16, 32), treatment="uncut")
    assert found[1] < 0.6 * found[0]
    assert found[2] < 0.6 * found[1]


def test_known_values():
    """A trial of the method on the same meshes: 0.594 0.579 0.575 cut, 0.205 0.102 0.051 uncut."""
    assert constants("QUAD4", (8, 16, 32)) == pytest.approx([0.594, 0.579, 0.575], abs=2e-3)
    uncut = constants("QUAD4", (8, 16, 32), treatment="uncut")
    assert uncut == pytest.approx([0.205, 0.102, 0.051], abs=2e-3)


@pytest.mark.parametrize(
    ("cells", "hexahedra", "bound"),
    [
        ("HEXA8", "pyramids", 0.25),
        ("HEXA8", "hexahedra", 0.38),
        ("HEXA20", "pyramids", 0.4),
        ("HEXA20", "hexahedra", 0.4),
        ("HEXA27", "pyramids", 0.45),
    ],
)
def test_solid_cells_stay_above_a_bound_with_the_cut(cells, hexahedra, bound):
    found = constants(cells, (4, 6, 8), 2, hexahedra=hexahedra)
    assert min(found) > bound
    assert found[-1] > 0.9 * found[-2]


def test_solid_cells_lose_control_without_the_cut():
    found = constants("HEXA8", (4, 8), 2, treatment="uncut")
    assert found[1] < 0.4 * found[0]


@pytest.mark.parametrize("coarser", [1, 4])
@pytest.mark.parametrize("treatment", ["nodal", "nodal_dual", "quadrature"])
def test_the_other_stable_treatments_level_off_too(treatment, coarser):
    found = constants("QUAD4", (8, 16, 32), coarser, treatment=treatment)
    assert found[-1] > 0.3
    assert found[-1] > 0.97 * found[-2]


@pytest.mark.parametrize(
    ("cells", "contact", "levels"),
    [
        ("TETRA4", "", [4, 6]),
        ("TETRA10", "", [4, 6]),
        ("PENTA6", "TRIA3", [2, 4]),
        ("PENTA6", "QUAD4", [4, 6]),
        ("PENTA15", "TRIA6", [2, 4]),
        ("PENTA15", "QUAD8", [4, 6]),
        ("PYRA5", "TRIA3", [2, 4]),
        ("PYRA5", "QUAD4", [4, 6]),
        ("PYRA13", "TRIA6", [2, 4]),
    ],
)
def test_simplices_prisms_and_pyramids_level_off_with_the_cut_alone(cells, contact, levels):
    study = read_study(INFSUP)
    name = f"{cells} on {contact}" if contact else cells
    points = points_of(study, study.group("space-clamped-2"))

    def records(cut):
        point = next(p for p in points if (p.series.name, p.labels["cut"]) == (name, cut))
        numbers = [{"level": float(level)} for level in levels]
        return [{"numbers": n} | inf_sup(replace(point, numbers=n)) for n in numbers]

    cut, uncut = records("lac"), records("uncut")
    assert levels_off(cut)
    assert cut[-1]["constant"] > 0.18
    assert not levels_off(uncut)
    assert uncut[-1]["constant"] < 0.65 * cut[-1]["constant"]
