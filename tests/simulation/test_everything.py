"""What is left out where a scene does not need it changes no result: --everything agrees."""

import os
import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import load_case, parse_case
from solver.commands.cli import main
from solver.simulation.options import Options, Shortcuts
from solver.simulation.results.solution import Line
from solver.simulation.simulate import simulate
from solver.verification.results import read_result
from solver.verification.run import mesh_of
from tests.scenes import block_case, block_mesh, moved

ROOT = Path(__file__).resolve().parents[2]
CASES = ROOT / "cases/ssnp170"
PLANE = "abcdefghij"
# Slaves: TETRA4, TETRA10, HEXA8, HEXA20, PENTA6 on triangles, PYRA5 on squares.
SOLID = [("k", False), ("l", False), ("m", False), ("n", False), ("z1", True), ("z6", True)]
EVERYTHING = Options.everything()
AGREED = 1e-13  # pressure over the load, displacement over its largest


def differences(one, other, pressure=25.0):
    """Of pressure and displacement."""
    size = np.abs(one.displacement).max()
    moved = np.abs(one.displacement - other.displacement).max() / size
    zones = zip(one.zones, other.zones, strict=True)
    return max(np.abs(a.multiplier - b.multiplier).max() for a, b in zones) / pressure, moved


def assert_agreed(case, mesh, swapped=False, options=EVERYTHING, within=AGREED, pressure=25.0):
    case = case.as_solved(swapped)
    short, full = simulate(case, mesh), simulate(case, mesh, options)
    assert max(differences(short, full, pressure)) < within
    return short, full


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("name", PLANE)
def test_plane_solves_of_the_reference_problem(name, swapped):
    case = load_case(CASES / f"{name}.yaml")
    assert case.plane
    _, full = assert_agreed(case, mesh_of(case), swapped)
    assert full.plan[0].what == "everything is done"
    assert not any(line.skip for line in full.plan)


def test_these_are_all_its_plane_solves():
    plane = {case.name for path in CASES.glob("*.yaml") if path.stem != "family"
             for case in [load_case(path)] if case.plane}  # fmt: skip
    assert plane == {f"ssnp170-{name}" for name in PLANE}


@pytest.mark.parametrize(("name", "swapped"), SOLID)
def test_solid_solves_of_the_reference_problem(name, swapped):
    case = load_case(CASES / f"{name}.yaml")
    assert not case.plane
    assert_agreed(case, mesh_of(case), swapped)


@pytest.mark.parametrize("skip", [field.name for field in fields(Shortcuts)])
@pytest.mark.parametrize("cells", ["QUAD9", "HEXA27"])
def test_each_alone(skip, cells):
    """Coincident meshes of cells that own inner nodes: most lines of the plan at once."""
    mesh = block_mesh(cells, cells, (2, 2))
    case = block_case(mesh.points.shape[1])
    short, full = assert_agreed(case, mesh, options=Options(Shortcuts(**{skip: False})))
    told, left = ({line.skip for line in solution.plan} for solution in (short, full))
    assert skip not in left
    assert left <= told


@pytest.mark.parametrize(("dim", "cells"), [(2, "QUAD9"), (3, "HEXA27")])
def test_what_the_plan_says_of_coincident_meshes(dim, cells):
    solution = simulate(block_case(dim), block_mesh(cells, cells, (2, 2)))
    said = {line.skip: line.what for line in solution.plan}
    assert {skip for skip in said if skip} == {"quadrature", "status"}


def test_everything_on_bent_faces_that_cannot_be_plain():
    """Where nothing is plain there is less to leave out, and nothing is said to be."""
    case = load_case(CASES.parent / "hydrostatic/wavy-quad8.yaml")
    mesh = mesh_of(case)
    said = {line.skip for line in simulate(case, mesh).plan}
    assert said == {"", "status"}


@pytest.mark.parametrize("seed", range(24))
def test_random_problems_whose_state_is_not_uniform(seed):
    """Cells, divisions, materials, loads, clearance and direction at random."""
    random = np.random.default_rng(seed)
    dim = int(random.choice([2, 2, 3]))
    kinds = {2: "TRIA3 TRIA6 QUAD4 QUAD8 QUAD9", 3: "TETRA4 TETRA10 HEXA8 HEXA20 HEXA27 PENTA15"}
    counts = random.integers(1, 3, 2) if dim == 3 else random.integers(2, 6, 2)
    mesh = block_mesh(*random.choice(kinds[dim].split(), 2).tolist(), counts.tolist())
    if random.random() < 0.4:
        mesh = moved(mesh, 0.02, seed)
    young, slope, clearance = 10 ** random.uniform(1, 4), random.uniform(0.2, 2), random.choice(2)
    case = block_case(dim, zone=f", clearance: '{1e-3 * clearance}*x'")
    text = case.about.source.replace("pressure: 25.0", f"pressure: '1 + {slope:.3f}*x'")
    text = text.replace(
        "all: {young: 2000.0", f"bottom: {{young: {young:.2f}, poisson: 0.2}}, top: {{young: 2000.0"
    )
    swapped = bool(random.choice(2))
    case = parse_case(text, Path("random.yaml"))
    largest = simulate(case.as_solved(swapped), mesh).zones[0].multiplier.max()
    assert_agreed(case, mesh, swapped, within=1e-12, pressure=largest)


def test_a_plane_solve_imports_nothing_of_three_dimensions_or_friction(tmp_path):
    code = (
        "import sys; from pathlib import Path; from solver.verification.run import Job, solve\n"
        f"solve(Job(Path({str(CASES / 'b.yaml')!r})), Path('r.vtkhdf'), None)\n"
        "print(*sorted(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True,
        env=os.environ | {"PYTHONPATH": str(CASES.parents[1])},
    )  # fmt: skip
    loaded = set(done.stdout.split("\n")[-2].split())
    assert "solver.lac.cells.shape" in loaded
    of_space = {
        "solver.lac.cells.extra_elements",
        "solver.simulation.equilibrium.friction",
        "solver.report.case_picture",
    }
    assert not loaded & of_space
    assert not any(name.startswith("solver.report") for name in loaded)


def test_the_command_line_does_everything(tmp_path, capsys):
    case = str(CASES / "c.yaml")
    results = []
    for options in ([], ["--everything"]):
        result = tmp_path / "r.vtkhdf"
        assert main(["solve", case, "-o", str(result), *options]) == 0
        results.append(read_result(result).solution)
    short, full = results
    assert "no second active-set solve" in [line.what for line in short.plan]
    assert full.plan[0] == Line("everything is done", "as asked for by --everything, needed or not")
    assert max(differences(short, full)) < AGREED


# What a feature is called in the names of functions and of files of its own.
FEATURES = re.compile(
    r"rigid(?!_motion|Motion)|spring|mixed|initial_strain|StrainTerm|StrainFields|frict|slip(?!_$)|stick"
    r"|motion\.py|moved\.py|moving|earlier|coulomb|cyclic|together|tied|copied|released|probe|stabilis|couple|tangential|quadric",
    re.IGNORECASE,
)
# Questions whether a case has a feature; and how far surfaces slide, which every solve judges.
GENERAL = {
    "acting.py Load.strains",
    "material.py Material.mixed",
    "model.py Case.moving",
    "model.py Case.frictional",
    "model.py Case.frictional.<locals>.<genexpr>",
    "validity.py _slip",
}


def test_a_plain_case_enters_no_function_of_a_feature_that_it_lacks(tmp_path):
    entered = set()

    def watch(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(f"{ROOT}/solver/") and code.co_flags & 2:
            entered.add(f"{Path(code.co_filename).name} {code.co_qualname}")

    sys.setprofile(watch)
    try:
        main(["solve", str(CASES / "e.yaml"), "-o", str(tmp_path / "result.vtkhdf"), "--quiet"])
    finally:
        sys.setprofile(None)
    assert "friction.py Search.settled" not in entered
    assert "problem.py ContactProblem.solve" in entered
    assert {name for name in entered if FEATURES.search(name)} - GENERAL == set()
