"""Surfaces of results to be turned: triangles, edges, maps of values and errors."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import load_case
from solver.lac.cells.catalogue import cell_type
from solver.report.layout import mean_normal, ways_apart
from solver.report.parts import rigid_surface
from solver.report.pictures import _eye, magnification, page, split, surfaces
from solver.simulation.options import LEAN
from solver.simulation.results.solution import BodyInfo
from solver.simulation.simulate import solved
from solver.system.progress import Clock
from solver.verification.run import mesh_of
from tests import handmade
from tests.browser import MISSING, browser

CASES = Path(__file__).resolve().parents[2] / "cases"


def read(solution):
    """The parts of a solution by name, arrays decoded."""
    text = surfaces(solution, "name.js")
    assert text.startswith('surfaces(...["name.js",')
    _, content = json.loads(text.removeprefix("surfaces(...").removesuffix(");\n"))
    for part in content["parts"]:
        for key, kind, width in (
            ("points", "<f4", 3),
            ("displacement", "<f4", 3),
            ("triangles", "<i4", 3),
            ("edges", "<i4", 2),
        ):
            part[key] = np.frombuffer(base64.b64decode(part[key]), kind).reshape(-1, width)
        for title, values in part["fields"].items():
            part["fields"][title] = np.frombuffer(base64.b64decode(values), "<f4")
    return content, {part["name"]: part for part in content["parts"]}


def test_cells_of_a_plane_result(tmp_path):
    content, parts = read(handmade.plane(tmp_path))
    assert {name: len(part["triangles"]) for name, part in parts.items()} == {
        "bottom": 12,
        "top": 6,
        "interface: slave faces": 0,
    }
    assert [len(part["edges"]) for part in parts.values()] == [7 + 12, 4 + 6, 6]
    bottom = parts["bottom"]
    area = (
        np.cross(
            *(
                bottom["points"][bottom["triangles"][:, k]]
                - bottom["points"][bottom["triangles"][:, 0]]
                for k in (1, 2)
            )
        )[:, 2].sum()
        / 2
    )
    assert area == pytest.approx(50 * 50)
    assert content["whole"] == [[0, -50, 0], [50, 50, 0]]
    assert content["contact"] == [[0, 0, 0], [50, 0, 0]]
    assert bottom["fields"]["displacement |u|"].max() == pytest.approx(np.hypot(0.24375, 0.56875))


def test_the_map_of_an_error_shows_the_node_that_is_off(tmp_path):
    solution = handmade.plane(tmp_path)
    largest = 0.011375 * 100  # of the reference, at the top
    assert read(solution)[1]["top"]["fields"]["|Δu| / max |u|"].max() < 1e-15
    solution.displacement[-1] += [0.3 * largest, -0.4 * largest]
    solution.stress[-1, 3] += 5.0  # xy, of 25
    parts = read(solution)[1]
    for title, expected in (("|Δu| / max |u|", 0.5), ("|Δσ| / max |σ|", 0.2)):
        values = parts["top"]["fields"][title]
        assert values[-1] == pytest.approx(expected)
        assert np.abs(values[:-1]).max() < 1e-15
        assert np.abs(parts["bottom"]["fields"][title]).max() < 1e-15


def test_pressure_and_deviation_jump_between_macro_elements(tmp_path):
    content, parts = read(handmade.solid(tmp_path))
    faces = parts["interface: slave faces"]
    assert len(faces["points"]) == 4 + 4 * 3  # a quadrangle and four triangles
    assert faces["fields"]["contact pressure p"].tolist() == [24.0] * 4 + [25.0] * 12
    deviation = faces["fields"]["Δp / max p"]
    assert deviation == pytest.approx([-0.04] * 4 + [0.0] * 12)
    limits = {m["title"]: m["limits"] for m in content["maps"]}
    assert limits["Δp / max p"] == pytest.approx([-0.04, 0.04])
    assert limits["contact pressure p"] == [0.0, 25.0]
    assert limits["normal stress σₙ"] == [-25.0, 0.0]
    assert next(iter(limits)) == "contact pressure p"


@pytest.mark.parametrize(
    ("kind", "number"), [("TRIA3", 1), ("QUAD4", 2), ("TRIA6", 4), ("QUAD8", 6)]
)
def test_triangles_fill_a_face_and_use_its_mid_nodes(kind, number):
    face = cell_type(kind)
    found = split([(kind, np.arange(face.n_nodes)[None])])
    corners = face.nodes[found["triangles"]]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    assert len(areas) == number
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(0.5 if kind.startswith("TRIA") else 1.0)
    assert set(found["edges"].ravel()) == set(range(face.n_nodes))


def with_rigid(folder, body, make=handmade.plane):
    """A solution whose master is a rigid surface."""
    text = {handmade.plane: handmade.PLANE, handmade.solid: handmade.SOLID}[make]
    text = text.partition("counts")[0].replace("both", "first").replace("upper", "die")
    solution = make(folder)
    (folder / "case.yaml").write_text(f"{text}bodies: {{die: {body}}}\n")
    solution.case = load_case(folder / "case.yaml")
    solution.bodies[1] = BodyInfo("die", {}, 0, "master")
    return solution


SPHERE = "{sphere: {centre: [25, 80], radius: 80}}"


def test_a_rigid_circle_is_drawn_opposite_to_the_slave(tmp_path):
    solution = with_rigid(tmp_path, SPHERE)
    solution.displacement[14:] = [0.5, -0.25]
    points, moved, _, out = rigid_surface(solution, 1)
    away = points - [25, 80, 0]
    assert np.linalg.norm(away, axis=1) == pytest.approx(80)
    assert out == pytest.approx(away / 80)
    assert moved == pytest.approx(np.tile([0.5, -0.25, 0], (len(points), 1)))
    assert points[:, 0].min() < 0 < 50 < points[:, 0].max()
    assert points[:, 1].min() == pytest.approx(0, abs=0.1)  # between two points
    assert rigid_surface(handmade.plane(tmp_path), 1) is None


@pytest.mark.parametrize(
    ("body", "implicit"),
    [
        ("{plane: {point: [3, 4, 1], normal: [0, 0, -2]}}", lambda x, y, z: z - 1),
        ("{sphere: {centre: [5, 5, 30], radius: 30}}", lambda x, y, z: (
            np.sqrt((x - 5) ** 2 + (y - 5) ** 2 + (z - 30) ** 2) - 30)),
        ("{cylinder: {point: [0, 5, 20], axis: [3, 0, 0], radius: 20}}", lambda x, y, z: (
            np.hypot(y - 5, z - 20) - 20)),
        ("{parabola: {point: [5, 5, 0], normal: [0, 0, -1], radius: 40}}", lambda x, y, z: (
            z - ((x - 5) ** 2 + (y - 5) ** 2) / 80)),
        ("{parabola: {point: [5, 5, 0], normal: [0, 0, -1], radius: 40, hollow: true}}",
         lambda x, y, z: z + ((x - 5) ** 2 + (y - 5) ** 2) / 80),
    ],
)  # fmt: skip
def test_rigid_surfaces_in_space(tmp_path, body, implicit):
    points, _, _, out = rigid_surface(with_rigid(tmp_path, body, handmade.solid), 1)
    assert implicit(*points.T) == pytest.approx(0, abs=1e-9)
    low, high = points.min(axis=0), points.max(axis=0)
    assert (low[:2] < 0).all(), "beyond the slave"
    assert (high[:2] > 10).all()
    assert ((low + high) / 2)[:2] == pytest.approx([5, 5], abs=0.5), "opposite to the slave"
    assert np.abs(points[:, 2]).min() < 1.8
    assert out[:, 2].min() < -0.7, "out of the body, towards the slave below"


@pytest.mark.parametrize(
    ("largest", "expected"), [(1.0, 10.0), (0.003, 1000.0), (70.0, 0.1), (0.0, 1.0)]
)
def test_the_displacement_is_magnified_by_a_power_of_ten(largest, expected):
    assert magnification(np.array([[0.0, largest]]), 100.0) == expected


def test_bodies_move_apart_with_their_masters(tmp_path):
    solution = handmade.plane(tmp_path)
    assert ways_apart(solution).tolist() == [[0, 0], [0, 1]]
    solution = handmade.solid(tmp_path)
    assert ways_apart(solution).tolist() == [[0, 0, 0], [0, 0, 1]]


def test_all_positions_of_bodies_that_move_far_are_there():
    """Points of each step, and the pressure there: a slider shows them."""
    case = load_case(CASES / "motion/slide-c.yaml")
    solution = solved(case, mesh_of(case), LEAN, Clock())
    text = surfaces(solution, "c")
    _, content = json.loads(text.removeprefix("surfaces(...").removesuffix(");\n"))
    assert content["steps"] == [float(step) for step in range(1, 9)]
    top = next(part for part in content["parts"] if part["name"] == "top")
    moved = [np.frombuffer(base64.b64decode(one["points"]), "<f4")[::3] for one in top["earlier"]]
    assert [float(x.min()) for x in moved] == pytest.approx([5.0 * step for step in range(1, 8)])
    slave = next(part for part in content["parts"] if not part["body"])
    for one in slave["earlier"]:
        pressure = np.frombuffer(base64.b64decode(one["pressure"]), "<f4")
        assert sorted(set(pressure.round(3).tolist())) == [0.0, 25.0]


def test_a_surface_without_cells_goes_along(tmp_path):
    """Each position has it where the step had it: here a parabola, its points on it."""
    case = load_case(CASES / "motion/hertz.yaml")
    solution = solved(case, mesh_of(case), LEAN, Clock())
    _, content = json.loads(surfaces(solution, "c").removeprefix("surfaces(...")[:-3])
    part = next(part for part in content["parts"] if part["name"] == "cylinder")
    for step, one in zip(case.steps, part["earlier"], strict=False):
        points, moved = (
            np.frombuffer(base64.b64decode(one[key]), "<f4").reshape(-1, 3)
            for key in ("points", "displacement")
        )
        x, y, _ = (points + moved).T
        np.testing.assert_allclose(y, (x - step["go"]) ** 2 / 10000, atol=1e-6)


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_the_slider_goes_to_a_step(tmp_path):
    case = load_case(CASES / "motion/slide-c.yaml")
    solution = solved(case, mesh_of(case), LEAN, Clock())
    (tmp_path / "c.html").write_text(page(solution, "c"))
    slider = "[...document.querySelectorAll('input[type=range]')].find(i => i.max == 8)"
    with browser() as window:
        window.open(tmp_path / "c.html", width=1300)
        canvas = "document.querySelector('canvas').toDataURL()"
        last = window.run(canvas)
        window.run(f"(() => {{ const s = {slider}; s.value = 2; s.oninput(); return 1; }})()")
        window.wait(f"{canvas} != {json.dumps(last)}")
        assert window.run(f"{slider}.parentNode.textContent").split() == ["step", "2"]


@pytest.mark.parametrize(
    ("normal", "azimuth"),
    [([0, 0, 1], -58), ([0.1, 0, 0.99], -58), ([1, 0, 0], 30), ([0, -1, 0], -60)],
)
def test_a_view_is_from_the_side_that_is_pressed(normal, azimuth):
    assert np.degrees(_eye(np.array(normal))[0]) == pytest.approx(azimuth)


def test_bodies_move_apart_along_the_normal_where_it_is_pressed(tmp_path):
    """A pin in a hole has no mean normal; pressed on a side it moves away from that one."""
    solution = handmade.plane(tmp_path)
    (zone,) = solution.zones
    zone.normal = np.array([[1.0, 0.0], [-1.0, 0.0]])
    zone.multiplier = np.array([0.0, 25.0])
    assert mean_normal(solution) == pytest.approx([-1.0, 0.0])
    zone.multiplier = np.zeros(2)
    assert mean_normal(solution) == pytest.approx([0.0, 1.0])
