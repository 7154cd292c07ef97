"""Bodies on which no force acts: nothing is a share of nothing, in any unit of length."""

import pytest

from solver import solve_case

HEIGHT = 50.0


def blocks(scale, supports, **more):
    """Two blocks of QUAD4 and TRIA3, of edge 50 times `scale`, the upper one on the lower one."""
    return {
        "name": "unforced",
        "mesh": {
            "recipe": "blocks", "size": HEIGHT,
            "bottom": {"cells": "QUAD4", "divisions": [4, 3]},
            "top": {"cells": "TRIA3", "divisions": [3, 3]},
        },
        "transform": {"scale": scale},
        "plane": "strain",
        "materials": {"all": {"young": 2000.0, "poisson": 0.3}},
        "supports": [{"group": group, "fix": fix} for group, fix in supports.items()],
        "contact": [{"slave": "bottom_contact", "master": "top_contact"}],
        **more,
    }  # fmt: skip


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
@pytest.mark.parametrize(
    ("base", "press"),
    [((0.3, -1.0), (0.1, 2.0)), ((0.3, -1.0), (0.1, -1.0)), ((0.0, 0.0), (0.0, 0.0))],
    ids=["apart", "together", "at rest"],
)
def test_bodies_that_only_move(scale, base, press):
    moved = {
        name: {"x": scale * x, "y": scale * y}
        for name, (x, y) in {"base": base, "press": press}.items()
    }
    found = solve_case(blocks(scale, moved))
    assert found.verdict == "solved", found.reason
    assert found.pressure.max() <= 1e-12 * 2000.0
    assert found.outcome.attainable < 1e-10
    assert max(found.solution.balance.values()) < 1e-12


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_bodies_that_expand_freely(scale):
    supports = {"base": ["y"], "symx": ["x"]}
    heat = [{"group": g, "expansion": 1.3e-5, "temperature": 70} for g in ("top", "bottom")]
    case = blocks(scale, supports, loads=heat)
    case["supports"].append({"group": "press", "spring": {"y": 1e-9 / scale}})
    found = solve_case(case)
    assert found.verdict == "solved", found.reason
    assert found.outcome.attainable < 1e-4
