"""Steps in which friction holds bodies and loads are gone, or nearly: no more of them is left."""

import numpy as np
import pytest

from solver import solve_case
from solver.lac.errors import SolveError
from tests.views.judge import rounded


def blocks(size, bottom, top, **rest):
    """A block on another one; `bottom` and `top` are their cells and divisions."""
    parts = (dict(zip(("cells", "divisions"), part, strict=True)) for part in (bottom, top))
    bodies = dict(zip(("bottom", "top"), parts, strict=True))
    return {"name": "blocks", "mesh": {"recipe": "blocks", "size": size, **bodies}, **rest}


def zone(friction, recovery="none"):
    """The zone between the blocks, slave below."""
    surfaces = {"slave": "bottom_contact", "master": "top_contact"}
    return {"name": "between", **surfaces, "friction": friction, "recovery": recovery}


def exchanged(zone):
    """The zone with the upper block as slave."""
    return zone | {"slave": zone["master"], "master": zone["slave"]}


# Friction alone holds the upper block along x.
BLOCK = blocks(
    1.0,
    ("QUAD4", [3, 3]),
    ("QUAD8", [2, 2]),
    plane="strain",
    materials={"all": {"young": 2000.0, "poisson": 0.3}},
    supports=[{"group": "base", "fix": ["x", "y"]}],
    loads=[
        {"group": "press", "pressure": 0.025},
        {"group": "press", "traction": [0.009, -0.008]},
    ],
    contact=[zone(0.4)],
)
# Around an axis: all of it sticks, and faces are pressed by different pressures.
PARTS = blocks(
    [0.9, 1.0],
    ("QUAD9", [3, 2]),
    ("QUAD8", [3, 2]),
    plane="axisymmetric",
    materials={
        "bottom": {"young": 60.0, "poisson": 0.0},
        "top": {"young": 62.0, "poisson": 0.4999},
    },
    supports=[
        {"group": "symx", "fix": ["normal"]},
        {"group": "base", "fix": ["normal"]},
        {"group": "press", "fix": {"normal": -0.0089}},
    ],
    loads=[],
    contact=[exchanged(zone(0.3, "smooth"))],
)


def of_top(solved):
    """The displacement (n, 2) of the upper block."""
    return solved.displacement[solved.solution.fields.body == 1]


def test_a_block_that_is_let_go_moves_to_where_it_slips_least():
    """Its faces slip back by different ways, by none on the average, and nothing is strained."""
    solved = solve_case(BLOCK | {"steps": [1.0, 2.0, 0.0]})
    assert solved.verdict == "solved"
    (found,) = solved.solution.zones
    assert not found.multiplier.any()
    assert not found.friction.friction_traction.any()
    moved, slip = of_top(solved), found.friction.slip[:, 0]
    assert moved[:, 0].mean() > 1e-6
    assert np.ptp(moved, axis=0) == pytest.approx([0, 0], abs=1e-17)
    assert moved[:, 1] == pytest.approx(0, abs=1e-17)
    assert slip.max() > 1e-6
    assert slip @ found.area == pytest.approx(0, abs=1e-17)


def test_nor_do_surfaces_that_do_not_fit_by_rounding_hold_it():
    case = BLOCK | {"steps": [1.0, 2.0, 0.0]}
    exact, solved = solve_case(case), solve_case(case, rounded(case))
    assert solved.verdict == "solved"
    assert not solved.solution.zones[0].multiplier.any()
    assert of_top(solved)[:, 0] == pytest.approx(of_top(exact)[:, 0].mean(), rel=1e-6)
    assert of_top(solved)[:, 1] == pytest.approx(0, abs=1e-12)


def test_a_block_that_is_let_go_stays_there_until_it_is_pressed_again():
    path = [1.0, 2.0, 0.0, 0.0, 0.0]
    first, last = (solve_case(BLOCK | {"steps": path[:n]}) for n in (3, 5))
    assert of_top(last) == pytest.approx(of_top(first), abs=1e-16)
    assert last.solution.zones[0].friction.slip == pytest.approx(0, abs=1e-16)


@pytest.mark.parametrize("factor", [1e-3, 1e-5, 1e-8])
@pytest.mark.parametrize("again", [1, 3])
def test_a_light_step_after_a_heavy_one_has_its_share_of_it(factor, again):
    """Nothing slips, so that pressures and tractions are in proportion to what is imposed."""
    whole, light = (solve_case(PARTS | {"steps": [1.0, *[factor] * n]}) for n in (0, again))
    for one, other in zip(whole.solution.zones, light.solution.zones, strict=True):
        assert not one.friction.slip.any()
        pressure, traction = one.multiplier, one.friction.friction_traction
        assert np.ptp(pressure) > 0.01 * pressure.max()
        assert other.multiplier == pytest.approx(factor * pressure, rel=1e-8)
        assert other.friction.friction_traction == pytest.approx(factor * traction, rel=1e-7)


def test_a_step_without_loads_leaves_nothing_after_a_heavy_one():
    solved = solve_case(PARTS | {"steps": [1.0, 0.0]})
    assert solved.verdict == "solved"
    assert np.abs(solved.displacement).max() < 1e-16
    assert not solved.solution.zones[0].multiplier.any()


@pytest.mark.parametrize("factor", [0.1, 1e-2, 1e-4])
@pytest.mark.parametrize("form", ["linear", "smooth"])
def test_a_light_step_that_opens_most_faces_is_as_if_there_had_been_no_heavy_one(form, factor):
    """Two of six faces bear the light load and stick, as do all under the heavy one."""
    case = blocks(
        [0.9, 1.0],
        ("QUAD9", [5, 3]),
        ("QUAD8", [6, 3]),
        plane="strain",
        materials={
            "bottom": {"young": 60.0, "poisson": 0.45},
            "top": {"young": 62.0, "poisson": 0.2},
        },
        supports=[{"group": "base", "fix": ["x", "y"]}],
        loads=[
            {"group": "press", "pressure": 1.0, "name": "heavy"},
            {"group": "press", "traction": [0, f"-{factor}*(1 - 1.4*x/0.9)"], "name": "light"},
        ],
        contact=[exchanged(zone(0.5, form))],
    )
    path = [{"heavy": 1, "light": 0}, {"heavy": 0, "light": 1}]
    alone, after = (solve_case(case | {"steps": path[n:]}).solution.zones[0] for n in (1, 0))
    assert not alone.friction.slip.any()
    assert np.count_nonzero(alone.multiplier) == 2
    assert after.multiplier == pytest.approx(alone.multiplier, rel=1e-6)
    assert np.abs(after.friction.slip).max() < 1e-9 * factor


def test_a_block_that_is_pressed_away_does_not_rest():
    """It is pressed down on a round surface, from which friction cannot keep it from rolling."""
    height = 1.3778093409655192
    dome = {"point": [0.0, 0.0, -height], "normal": [0.0, 0.0, 1.0], "radius": 30.0}
    case = blocks(
        [1.564347649063861, 1.682969211770967, height],
        ("TETRA4", [1, 1, 1]),
        ("TETRA10", [1, 1, 1]),
        materials={"all": {"young": 638.5, "poisson": 0.3}},
        supports=[
            {"group": "symx", "fix": ["normal"]},
            {"group": "press", "fix": {"normal": -0.00944823405392332}},
        ],
        bodies={"floor": {"parabola": dome}},
        contact=[
            zone(0.1),
            {"name": "below", "slave": "base", "master": "floor", "friction": 0.1},
        ],
    )
    with pytest.raises(SolveError, match="overcome friction"):
        solve_case(case)
