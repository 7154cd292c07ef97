"""Edges, area, force and moment of contact: Hertz's cylinder and the patch test, and in files."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from solver.case.reader import parse_case
from solver.mesh import generate
from solver.simulation.simulate import simulate
from solver.verification.results import read_result, write_result
from tests.scenes import PRESSURE, block_case, block_mesh

HERTZ = Path(__file__).parents[2] / "cases/hertz"


def hertz(cells: str, factor: float, recovery: str = "none"):
    """The cylinder of the batch under another load, and its exact half-width."""
    content = yaml.safe_load((HERTZ / f"cylinder-{cells}.yaml").read_text())
    content["loads"][0]["pressure"] *= factor
    content["reference"]["solution"]["force"] *= factor
    content["contact"][0]["recovery"] = recovery
    case = parse_case(yaml.safe_dump(content), HERTZ / "load.yaml")
    return simulate(case, generate(content["mesh"], "load.yaml")), case.solution


@pytest.mark.parametrize(
    ("cells", "recovery", "within"),
    [("quad8", "none", 0.06), ("quad8", "quadratic", 0.08), ("quad4", "none", 0.25)],
)
def test_the_edge_of_hertz(cells, recovery, within):
    """Wherever in its macro-element the edge lies, in closed and in open ones."""
    for factor in (0.643, 0.786, 0.929, 1.0, 1.143):
        solution, exact = hertz(cells, factor, recovery)
        [zone] = solution.zones
        found = zone.resultants
        assert found.edges.better.tolist() == [True]
        size = zone.area[found.edges.macro[0]]
        assert found.edges.position[0, 0] == pytest.approx(exact.half_width, abs=within * size)
        assert found.edges.lower[0, 0] < exact.half_width < found.edges.upper[0, 0]
        assert found.area[0] == pytest.approx(exact.half_width, abs=within * size)
        assert found.force == pytest.approx([0.0, -exact.force / 2], abs=1e-9 * exact.force)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("treatment", ["lac", "nodal"])
def test_the_patch(dim, treatment):
    """A uniform pressure on a unit face at the height 0: p, and p/2 about each axis along it."""
    case = block_case(dim, zone=f", treatment: {treatment}")
    cells = ("TRIA6", "QUAD8") if dim == 2 else ("TETRA10", "HEXA8")
    [zone] = simulate(case, block_mesh(*cells)).zones
    found = zone.resultants
    assert found.area == pytest.approx(1.0)
    assert found.force == pytest.approx([0.0] * (dim - 1) + [-PRESSURE], abs=1e-9)
    moment = [0, 0, -PRESSURE / 2] if dim == 2 else [-PRESSURE / 2, PRESSURE / 2, 0]
    assert found.moment == pytest.approx(moment, abs=1e-9)
    assert (found.edges is None) == (dim == 3)


def test_in_3d_the_area_has_the_bounds_of_whole_macro_elements():
    content = yaml.safe_load((HERTZ / "sphere-hexa8.yaml").read_text())
    case = parse_case(yaml.safe_dump(content), HERTZ / "sphere.yaml")
    [zone] = simulate(case, generate(content["mesh"], "sphere.yaml")).zones
    area, low, high = zone.resultants.area
    assert area == pytest.approx(zone.area[zone.closed].sum())
    assert low < np.pi / 4 * case.solution.half_width**2 < high


def test_they_are_read_back(tmp_path):
    solution, _ = hertz("quad4", 1.0, "smooth")
    write_result(tmp_path / "r.vtkhdf", solution, [], {})
    [zone], [back] = solution.zones, read_result(tmp_path / "r.vtkhdf").solution.zones
    for name in ("area", "force", "moment"):
        assert (getattr(back.resultants, name) == getattr(zone.resultants, name)).all()
    for name in ("position", "lower", "upper", "macro", "better", "lengths"):
        one, other = (getattr(z.resultants.edges, name) for z in (zone, back))
        assert (one == other).all()
    assert "edge at" in str(back.resultants)
