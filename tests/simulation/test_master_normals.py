"""Contact along the normals of a plane or smooth master."""

import numpy as np
import pytest

from solver import solve_case
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.facets import facets, with_master_normals
from solver.system.errors import InputError


def cylinder(normal: str, **keys) -> dict:
    """Half a cylinder of linear cells, pressed onto a rigid plane by 3 % of its radius."""
    return {
        "name": "obstacle",
        "mesh": {
            "recipe": "hertz", "radius": 10, "size": 9, "core": 4, "share": 0.6,
            "bottom": {"cells": "QUAD4", "divisions": [2, 2]},
            "top": {"cells": "QUAD4", "divisions": [32, 16]},
        },
        "plane": "strain",
        "materials": {"top": {"young": 1000.0, "poisson": 0.3}},
        "bodies": {"bottom": {"rigid": True}},
        "supports": [
            {"group": "symx", "fix": ["x"]},
            {"group": "press", "fix": {"y": -0.3}},
        ],
        "contact": [
            {"slave": "top_contact", "master": "bottom_contact", "normal": normal, **keys}
        ],
    }  # fmt: skip


def overlap(solution) -> float:
    """How far the deformed slave nodes of closed faces are below the plane, at most."""
    [zone] = solution.zones
    nodes = np.concatenate([n[zone.closed[macro]].ravel() for _, n, macro in zone.faces])
    place = solution.mesh.points + solution.displacement
    return float(-place[nodes, 1].min())


def test_a_plane_bears_no_force_along_itself_and_is_not_pierced():
    plain, found = (solve_case(cylinder(normal)).solution for normal in ("nodal", "master"))
    along, across = plain.zones[0].resultants.force
    assert abs(along) > 0.02 * across
    along, across = found.zones[0].resultants.force
    assert abs(along) < 1e-14 * across
    assert overlap(found) < overlap(plain) / 5


def test_a_plane_without_a_mesh():
    """The same contact as on faces of a rigid block, stabilised or not."""
    case = cylinder("master", stabilised=True)
    meshed = solve_case(case)
    case["bodies"]["floor"] = {"plane": {"point": [0, 0], "normal": [0, 1]}}
    case["contact"][0]["master"] = "floor"
    found = solve_case(case)
    assert found.pressure == pytest.approx(meshed.pressure, rel=1e-9, abs=1e-9)


def test_normals_of_a_faceted_circle():
    """Facets of angle φ, a distance g of a tenth away: normals are known to g φ / 2 + φ² / 8."""
    angle = np.linspace(0, 1, 9)
    rim = np.column_stack([np.sin(angle), np.cos(angle)])
    inside = 0.9 * np.column_stack([np.sin(angle), np.cos(angle)])[1:-1:2]
    points = np.concatenate([rim, inside])
    n = np.arange(8)
    master = facets(points, BY_NAME["SEG2"], np.stack([n, n + 1], 1), n)
    m = 9 + np.arange(3)
    slave = facets(points, BY_NAME["SEG2"], np.stack([m + 1, m], 1), m)
    [found] = with_master_normals([slave], [master], points)
    radial = points[slave.nodes] / 0.9
    side = np.sign(np.einsum("fad,fad->fa", found.directions, radial))[..., None]
    assert np.abs(side * found.directions - radial).max() < 0.1 / 8 / 2 + 1 / 8**2 / 8
    assert (np.einsum("fad,fd->fa", found.directions, slave.normal) > 0.9).all()


def test_refused_on_a_master_with_an_edge():
    """The side of a block is part of the master: it turns by 90°."""
    case = cylinder("master")
    case["contact"][0]["master"] = ["bottom_contact", "symx_of_bottom"]
    case["groups"] = {
        "symx_of_bottom": {"within": "bottom", "plane": {"point": [0, 0], "normal": [1, 0]}}
    }
    with pytest.raises(InputError, match=r"is not smooth: its faces turn by more than 60° at"):
        solve_case(case)


@pytest.mark.parametrize(
    "change", [{"renumber": 11}, {"scale": 0.1}, {"scale": 0.0037}, {"translate": [0.0, -13.77]}]
)
def test_numbers_place_and_scale_of_the_mesh_change_nothing(change):
    """A slave node in the middle is equally near to two master faces, two are at its ends."""

    def pressures(transform):
        case = {
            "name": "tie",
            "mesh": {
                "recipe": "wavy", "shape": "arc", "height": 0.195,
                "bottom": {"cells": "TRIA3", "divisions": [5, 4]},
                "top": {"cells": "TRIA3", "divisions": [4, 2]},
            },
            "transform": transform,
            "plane": "stress",
            "materials": {
                "bottom": {"young": 70000.0, "poisson": 0.3},
                "top": {"young": 2000.0, "poisson": 0.25},
            },
            "supports": [
                {"group": "symx", "fix": ["normal"]},
                {"group": "press", "fix": {"normal": -0.0018 * transform.get("scale", 1.0)}},
                {"group": "base", "fix": ["normal"]},
            ],
            "contact": [{"slave": "bottom_contact", "master": "top_contact", "normal": "master"}],
        }  # fmt: skip
        return np.sort(solve_case(case).pressure)

    assert pressures(change) == pytest.approx(pressures({"scale": 1.0}), rel=1e-9)
