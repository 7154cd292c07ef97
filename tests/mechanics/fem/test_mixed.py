"""The mixed form: exact to round-off as ν → ½, without locking, and only where it is wanted."""

from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.lac.cells.catalogue import BY_NAME
from solver.mechanics.fem.block import Block
from solver.mechanics.fem.elasticity import internal_force
from solver.mechanics.fem.mixed import split
from solver.mechanics.fem.stress import nodal_stress
from solver.mesh import generate
from solver.simulation.options import LEAN, Options, Safeguards
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.norms import errors as norms
from tests.scenes import block_case, block_mesh, moved, straightened

VOLUMES = [name for name, kind in BY_NAME.items() if kind.dim > 1]
PAIRS = [
    ("TRIA3", "QUAD4", (4, 3)),
    ("TRIA6", "QUAD9", (4, 3)),
    ("QUAD4", "TRIA6", (4, 3)),
    ("QUAD8", "TRIA3", (4, 3)),
    ("TETRA10", "HEXA8", (2, 3)),
    ("HEXA8", "TETRA10", (3, 2)),
    ("HEXA20", "HEXA27", (2, 3)),
    ("PENTA15", "PYRA13", (1, 1)),
    ("PYRA5", "PENTA6", (1, 1)),
]


def patch(bottom, top, counts, material, move=0.0, options=LEAN, **as_solved):
    """Relative errors of pressure and stress of the patch test in a material `{…}`."""
    mesh = block_mesh(bottom, top, counts)
    if move:
        mesh = straightened(moved(mesh, move))
    dim = mesh.points.shape[1]
    source = block_case(dim).about.source.replace("{all: {young: 2000.0, poisson: 0.3}}", material)
    case = parse_case(source, Path("patch.yaml")).as_solved(**as_solved)
    solution = simulate(case, mesh, options)
    pressure = np.abs(solution.zones[0].multiplier / 25 - 1).max()
    return pressure, np.abs(solution.fields.normal_stress / 25 + 1).max()


def everywhere(poisson, form="automatic"):
    return f"{{all: {{young: 2000.0, poisson: {poisson!r}, form: {form}}}}}"


@pytest.mark.parametrize(("bottom", "top", "counts"), PAIRS)
@pytest.mark.parametrize("poisson", [0.499999, 0.499999999, 0.5 - 1e-12])
def test_the_patch_test_is_exact_to_round_off(bottom, top, counts, poisson):
    assert max(patch(bottom, top, counts, everywhere(poisson))) < 5e-13


@pytest.mark.parametrize(("bottom", "top", "counts"), [PAIRS[1], PAIRS[3], PAIRS[4], PAIRS[6]])
def test_on_moved_nodes_too(bottom, top, counts):
    assert max(patch(bottom, top, counts, everywhere(0.49999999), move=0.03)) < 2e-12


@pytest.mark.parametrize("hexahedra", ["pyramids", "hexahedra"])
@pytest.mark.parametrize("cells", ["HEXA8", "HEXA20"])
def test_either_way_to_cut_hexahedra(cells, hexahedra):
    found = patch(cells, cells, (2, 3), everywhere(0.49999999), hexahedra=hexahedra)
    assert max(found) < 5e-13


@pytest.mark.parametrize(("bottom", "top", "counts"), [PAIRS[1], PAIRS[4], PAIRS[6]])
def test_the_displacement_form_loses_the_digits(bottom, top, counts):
    """ε / (1 − 2ν) is what it keeps in double precision, whether chosen or the cure turned off."""
    double = Options(safeguards=Safeguards(extended=False))
    lost = patch(bottom, top, counts, everywhere(0.499999999, "displacement"), options=double)
    assert min(lost) > 1e-9
    double = Options(safeguards=Safeguards(extended=False, mixed=False))
    assert patch(bottom, top, counts, everywhere(0.499999999), options=double) == lost


@pytest.mark.parametrize(("bottom", "top", "counts"), [PAIRS[1], PAIRS[4]])
@pytest.mark.parametrize("ratio", [1e-6, 1e6])
def test_rubber_on_steel(bottom, top, counts, ratio):
    """One body in mixed form, the other in displacement form."""
    material = (
        f"{{bottom: {{young: {2000.0 * ratio!r}, poisson: 0.4999999}}, "
        "top: {young: 2000.0, poisson: 0.3}}"
    )
    assert max(patch(bottom, top, counts, material)) < 1e-12
    assert max(patch(bottom, top, counts, material, swapped=True)) < 1e-12


# What it is made of


def one_cell(name):
    kind = BY_NAME[name]
    points = kind.nodes + 0.08 * np.random.default_rng(0).uniform(-1, 1, kind.nodes.shape)
    cells = np.arange(kind.n_nodes)[None]
    return points, Block(kind, cells, np.array([1.5]), np.array([0.7]), straight=False)


@pytest.mark.parametrize("name", VOLUMES)
def test_a_linear_field_has_the_stress_of_the_displacement_form(name):
    points, block = one_cell(name)
    slope = np.random.default_rng(1).normal(size=points.shape[1:] * 2)
    field = points @ slope.T
    blocks, mean = split(points, [block], [np.array([True])], [np.array([0])])
    start = np.zeros(mean.size)
    stress = mean.change(np.zeros(points.size), mean.defect(field[None], start))
    assert mean.defect(field[None], stress) == pytest.approx(start, abs=1e-14)
    by_cell = mean.by_cell(stress, {name: block.cells})[name]
    assert by_cell == pytest.approx(1.5 * np.trace(slope), rel=1e-12)
    force = internal_force(points, blocks, field) + mean.force(stress)
    whole = internal_force(points, [block], field)
    assert force == pytest.approx(whole, abs=1e-12 * np.abs(whole).max())
    recovered = nodal_stress(points, blocks, field) + mean.nodal_stress(stress, blocks)
    assert recovered == pytest.approx(nodal_stress(points, [block], field), abs=1e-12)


@pytest.mark.parametrize(
    ("name", "size"), [("TRIA3", 1), ("HEXA20", 1), ("TRIA6", 3), ("QUAD8", 4), ("HEXA27", 4)]
)
def test_how_many_unknowns_a_cell_has(name, size):
    points, block = one_cell(name)
    assert split(points, [block], [np.array([True])], [np.array([0])])[1].size == size


def test_the_pieces_of_a_cut_cell_share_their_constant():
    mesh = block_mesh("HEXA8", "HEXA8", (2, 1))
    case = parse_case(block_case(3).about.source.replace("0.3", "0.4999999"), Path("patch.yaml"))
    scene = build_scene(case, mesh)
    [part] = scene.parts
    assert part.mean.size == 2**3 + 1
    assert part.mean.n_cells == 2**3 + 1 + 2**2 * 4


# Where it is used


def test_ordinary_material_stays_as_it_is():
    mesh = block_mesh("TRIA6", "QUAD8", (3, 2))
    plain, chosen, mixed = (
        simulate(parse_case(block_case(2).about.source.replace("0.3", p), Path("patch.yaml")), mesh)
        for p in ("0.3", "0.3, form: displacement", "0.3, form: mixed")
    )
    assert not plain.fields.by_cell
    assert np.array_equal(plain.stress, chosen.stress)
    assert np.array_equal(plain.displacement, chosen.displacement)
    assert set(mixed.fields.by_cell) == {"TRIA6", "QUAD8"}
    assert np.abs(mixed.stress - plain.stress).max() < 1e-12 * 25
    told = [line.what for line in mixed.plan if line.what.startswith("mixed form")]
    assert told == [f"mixed form in {sum(map(len, mixed.fields.by_cell.values()))} cells"]


@pytest.mark.parametrize(("poisson", "mixed"), [(0.499, False), (0.4991, True)])
def test_it_is_taken_above_the_bound(poisson, mixed):
    case = parse_case(block_case(2).about.source.replace("0.3", str(poisson)), Path("patch.yaml"))
    scene = build_scene(case, block_mesh("QUAD4", "QUAD4"))
    assert bool(scene.parts) is mixed


@pytest.mark.parametrize(
    ("given", "key"),
    [("-0.3, form: mixed", "materials.all.poisson"), ("0.3, form: u", "materials.all.form")],
)
def test_what_is_refused(given, key):
    with pytest.raises(InputError, match=key):
        parse_case(block_case(2).about.source.replace("0.3", given), Path("patch.yaml"))


# Locking


def nested(cells, poisson, form, n):
    """Nested cylinders or spheres under internal pressure, `n` cells through the inner wall."""
    dim = BY_NAME[cells].dim
    name, recipe = [("nested_cylinders", "rings"), ("nested_spheres", "shells")][dim - 2]
    sides = ["symx", "farx"] if dim == 2 else ["symx", "symy", "farx", "fary"]
    text = (
        f"name: nested\nmesh: {{recipe: {recipe}}}\n"
        + "plane: strain\n" * (dim == 2)
        + f"materials: {everywhere(poisson, form)}\nsupports:\n"
        + "".join(f"  - {{group: {side}, fix: [normal]}}\n" for side in sides)
        + "loads: [{group: base, pressure: 25.0}]\n"
        + "contact: [{slave: bottom_contact, master: top_contact}]\n"
        + f"reference: {{kind: analytical, solution: {{name: {name}, radii: [20, 30, 40]}}}}\n"
        + "tolerance: {displacement_l2: 0.9}\n"
    )
    sections = {
        side: {"cells": cells, "divisions": [2 * k] * (dim - 1) + [k]}
        for side, k in (("bottom", n), ("top", max(n - 1, 1)))
    }
    mesh = generate({"recipe": recipe, "radii": [20, 30, 40], **sections}, "test")
    return norms(simulate(parse_case(text, Path("nested.yaml")), mesh))


SEEN = ("displacement_l2", "displacement_h1", "stress_l2", "pressure_l2")


@pytest.mark.parametrize(
    ("cells", "n"),
    [("QUAD4", 8), ("TRIA6", 4), ("QUAD8", 4), ("QUAD9", 4), ("TETRA10", 2), ("HEXA20", 2)],
)
def test_nearly_incompressible_tubes_do_not_lock(cells, n):
    """Errors as those of an ordinary material; the displacement form is far off."""
    ordinary = nested(cells, 0.3, "displacement", n)
    mixed = nested(cells, 0.4999999, "automatic", n)
    assert all(mixed[key] < 1.6 * ordinary[key] for key in SEEN)
    locked = nested(cells, 0.4999999, "displacement", n)
    assert locked["displacement_l2"] > 10 * mixed["displacement_l2"]
    assert locked["stress_l2"] > 1


@pytest.mark.parametrize("cells", ["TRIA6", "QUAD8"])
def test_nearly_incompressible_tubes_keep_their_order(cells):
    coarse, fine = (nested(cells, 0.4999999, "automatic", n) for n in (4, 8))
    order = {key: np.log2(coarse[key] / fine[key]) for key in SEEN}
    assert order["displacement_l2"] > 2.5
    assert order["displacement_h1"] > 1.8
    assert order["stress_l2"] > 1.8
    assert order["pressure_l2"] > 1.5


def held(cells, form, n):
    """A displacement without divergence, imposed on all sides, and a mean stress that varies.

    u = (sin 2x cos 2y, −cos 2x sin 2y), s = sin(3x + y), μ = 1: −div σ = 8 u − grad s. Returns
    the largest error at nodes.
    """
    u = ["sin(2*x) * cos(2*y)", "-cos(2*x) * sin(2*y)"]
    force = [f"8 * {u[0]} - 3 * cos(3*x + y)", f"8 * ({u[1]}) - cos(3*x + y)"]
    sides = ["base", "press", "symx", "farx", "bottom_contact", "top_contact"]
    fixed = "".join(f"  - {{group: {s}, fix: {{x: {u[0]}, y: {u[1]}}}}}\n" for s in sides)
    nu = 0.4999995
    text = (
        "name: held\nmesh: {recipe: blocks}\nplane: strain\n"
        f"materials: {{all: {{young: {2 * (1 + nu)!r}, poisson: {nu!r}, form: {form}}}}}\n"
        f"supports:\n{fixed}loads:\n  - {{group: all, body_force: [{force[0]}, {force[1]}]}}\n"
    )
    solution = simulate(parse_case(text, Path("held.yaml")), block_mesh(cells, cells, (n, n)))
    x, y = solution.mesh.points.T
    exact = np.stack([np.sin(2 * x) * np.cos(2 * y), -np.cos(2 * x) * np.sin(2 * y)], axis=1)
    return np.abs(solution.displacement - exact).max()


@pytest.mark.parametrize("cells", ["TRIA6", "QUAD8", "QUAD9"])
def test_order_three_where_the_mean_stress_varies(cells):
    coarse, fine = held(cells, "automatic", 6), held(cells, "automatic", 12)
    assert np.log2(coarse / fine) > 2.6
    assert held(cells, "displacement", 12) > 5 * fine
