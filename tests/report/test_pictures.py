"""What the pictures draw, counted on solutions written by hand."""

import os
import xml.etree.ElementTree as ET
from dataclasses import replace

import meshio
import numpy as np
import pytest

from solver.case.acting import Load
from solver.case.expressions import EXACT, Expression
from solver.lac.cells.faces import outer_faces
from solver.mechanics.fem.faces import volume_cells
from solver.report.case_picture import draw_case
from solver.report.charts import BLUE, GREEN, ORANGE, RED
from solver.report.layout import (
    DEVIATION,
    Drawing,
    macro_edges,
    mixed,
    normals,
    outlines,
    pressed_box,
    shade,
)
from solver.report.pictures import picture
from solver.report.profile import reference
from solver.report.rows import Row
from solver.verification.results import write_result
from tests import handmade
from tests.report.test_surfaces import with_rigid
from tests.report.verdicts import record

SVG = "{http://www.w3.org/2000/svg}"


def polygons(svg, **attributes):
    """How many closed polygons are drawn with these attributes."""
    paths = [
        path.get("d")
        for path in ET.fromstring(svg).iter(f"{SVG}path")
        if all(path.get(key) == value for key, value in attributes.items())
    ]
    return sum(data.count("Z") for data in paths)


def test_plane_picture_shows_every_cell_of_both_blocks(tmp_path):
    svg = draw_case(handmade.plane(tmp_path), "two blocks")
    slave, master = (mixed(color, "#ffffff", 0.25) for color in (BLUE, ORANGE))
    assert polygons(svg, stroke=slave) == 6
    assert polygons(svg, stroke=master) == 3
    words = {text.text for text in ET.fromstring(svg).iter(f"{SVG}text")}
    assert {"bottom", "top", "slave", "master", "QUAD4", "x", "y", "50 × 100"} <= words


def test_loads_and_supports_of_a_plane_picture(tmp_path):
    svg = draw_case(handmade.plane(tmp_path), "two blocks")
    assert polygons(svg, stroke=GREEN, fill="#ffffff") == 4 + 6  # of 4 and of 7 nodes
    held = [p.get("d") for p in ET.fromstring(svg).iter(f"{SVG}path") if p.get("fill") == "#ffffff"]
    bases = [tuple(map(int, data.split("l")[1].split()[:2])) for data in held]
    # From the tip to a corner of the base: to the left of x = 0, and below the foot.
    assert sorted(bases) == [(-70, -42)] * 4 + [(-42, 70)] * 6
    heads = [p.get("d") for p in ET.fromstring(svg).iter(f"{SVG}path") if p.get("fill") == RED]
    assert len(heads) == 4
    for head in heads:  # the tip first, then what is behind it, above
        tip, behind = head.removeprefix("M").rstrip("Z").split("l")
        assert float(behind.split()[1]) == -60.0
        assert float(tip.split()[1]) == pytest.approx(480, abs=1), "the top of the upper block"
    words = {text.text for text in ET.fromstring(svg).iter(f"{SVG}text")}
    assert "pressure 25" in words


def test_arrows_follow_the_load(tmp_path):
    solution = handmade.plane(tmp_path)
    load = Load("press", traction=(Expression("x"), 0.0))
    solution.case = replace(solution.case, loads=(load,))
    svg = draw_case(solution, "two blocks")
    shafts = {"stroke": RED, "stroke-width": "13"}
    lines = [
        p.get("d")
        for p in ET.fromstring(svg).iter(f"{SVG}path")
        if shafts.items() <= dict(p.items()).items()
    ]
    steps = sorted(tuple(map(float, line.split("l")[1].split())) for line in lines)
    # No arrow is at x = 0, where the load is zero; the longest has 30 pixels.
    assert np.array(steps) == pytest.approx(np.array([(100, 0), (200, 0), (300, 0)]), abs=1)
    assert "traction (x, 0)" in svg
    long = Load("press", traction=(Expression("sin(x) * sin(x) + cos(x) * cos(x)"), 0.0))
    acted = solution.places.acted["loads[0].group"]
    solution.places.acted |= {f"loads[{i}].group": acted for i in (1, 2)}
    solution.case = replace(solution.case, loads=(load, long, load))
    texts = list(ET.fromstring(draw_case(solution, "")).iter(f"{SVG}text"))
    labels = {t.text: float(t.get("y")) for t in texts if t.get("fill") == RED}
    assert [t.text for t in texts if t.get("fill") == RED] == [
        "traction (x, 0)",
        "traction f(x, y)",
    ]
    first, second = labels.values()
    assert abs(first - second) > 100, "one above the other"


def test_supports_of_a_picture_in_space(tmp_path):
    solution = handmade.solid(tmp_path)
    svg = draw_case(solution, "solid")
    seen = 3  # corners of the foot: the eye is above
    assert polygons(svg, stroke=GREEN, fill="#ffffff") == seen
    assert polygons(svg, fill=RED) == 4
    words = {text.text for text in ET.fromstring(svg).iter(f"{SVG}text")}
    assert {"10 × 10 × 20", "pressure 25", "z"} <= words
    solution.places.acted = {}
    assert polygons(draw_case(solution, "solid"), stroke=GREEN) == 0


def test_a_rigid_circle_is_drawn_as_a_hatched_line(tmp_path):
    solution = with_rigid(tmp_path, "{sphere: {centre: [25, 80], radius: 80}}")
    svg = draw_case(solution, "rigid")
    words = {text.text for text in ET.fromstring(svg).iter(f"{SVG}text")}
    assert {"die", "rigid circle"} <= words
    lines = [
        p.get("d").count("M")
        for p in ET.fromstring(svg).iter(f"{SVG}path")
        if p.get("stroke") == ORANGE and p.get("stroke-width") == "20"
    ]
    assert lines == [6], "one for each face of the slave"


def test_space_picture_colours_sub_faces_by_pressure(tmp_path):
    svg = draw_case(handmade.solid(tmp_path), "solid")
    assert polygons(svg, fill=shade(1.0)) == 4  # the triangles, under 25
    assert polygons(svg, fill=shade(31 / 32)) == 1  # the quadrangle, under 24
    assert polygons(svg, fill=shade(0.5, DEVIATION)) == 4  # no deviation from 25
    assert polygons(svg, fill=shade(0.0, DEVIATION)) == 1  # 24 for 25
    words = {text.text for text in ET.fromstring(svg).iter(f"{SVG}text")}
    assert {"0.04", "-0.04"} <= words


def test_a_small_contact_is_enlarged(tmp_path):
    solution = handmade.plane(tmp_path)
    zone, solution.scalars.length = solution.zones[0], 100.0
    whole = draw_case(solution, "")
    assert '<svg x="' not in whole
    zone.multiplier[1] = 0.0  # the contact from 0 to 25, and 15 % around it
    box = pressed_box(solution.mesh.points, solution.zones, solution.mesh.points)
    assert box == pytest.approx(np.array([[0.0, -16.25], [28.75, 16.25]]))
    assert draw_case(solution, "").count('<svg x="') == 1


def test_boundary_of_two_cubes_on_each_other():
    layers = [(x, y, z) for z in (0, 1, 2) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    points = np.array(layers, dtype=float)
    cubes = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])
    mesh = meshio.Mesh(points, [("hexahedron", cubes)])
    [(kind, faces)] = outer_faces(volume_cells(mesh).items())
    assert kind == "QUAD4"
    assert len(faces) == 10
    centre = points[faces].mean(axis=1)
    outward = ((centre - [0.5, 0.5, 1.0]) * normals(outlines(points, kind, faces))).sum(axis=1)
    assert np.all(outward > 0)


def test_outline_of_a_macro_element_leaves_out_the_cut():
    # A triangle cut into three about node 3: the three inner edges are not its outline.
    faces = [("TRIA3", np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]]), np.zeros(3, dtype=int))]
    assert macro_edges(faces)[:, :2].tolist() == [[0, 1], [0, 2], [1, 2]]


def test_edges_of_macro_elements_have_their_mid_nodes():
    faces = [("TRIA6", np.array([[0, 1, 2, 10, 11, 12], [0, 2, 3, 12, 13, 14]]), np.array([5, 5]))]
    found = {tuple(row) for row in macro_edges(faces).tolist()}
    assert found == {(0, 1, 10), (1, 2, 11), (2, 3, 13), (0, 3, 14)}


def test_mid_nodes_are_drawn_only_where_the_edge_bends():
    straight = np.array([[0, 0], [2, 0], [0, 2], [1, 0], [1, 1], [0, 1]], dtype=float)
    bent = straight.copy()
    bent[4] += 0.1
    nodes = np.arange(6)[None]
    assert outlines(straight, "TRIA6", nodes).shape == (1, 3, 2)
    assert outlines(bent, "TRIA6", nodes).shape == (1, 6, 2)


def test_text_in_a_drawing_is_escaped():
    drawing = Drawing(10, 10, "<b> & co")
    drawing.text(1, 1, "<script>")
    root = ET.fromstring(drawing.svg())
    assert [e.text for e in root.iter(f"{SVG}text")] == ["<script>"]


def test_pressure_colours_darken():
    lightness = [
        sum(int(shade(share)[i : i + 2], 16) for i in (1, 3, 5)) for share in np.linspace(0, 1, 20)
    ]
    assert lightness == sorted(lightness, reverse=True)
    assert len(set(lightness)) == 20


def test_picture_is_drawn_again_only_for_a_newer_result(tmp_path):
    result = tmp_path / "job" / "result.vtkhdf"
    write_result(result, handmade.plane(tmp_path), [], {})
    row = Row(record({"result": result.name}), result.parent)
    assert 'src="pictures/fam-job.svg"' in picture(row, tmp_path / "pictures")
    kept = tmp_path / "pictures" / "fam-job.svg"
    kept.write_text(kept.read_text().replace("slave", "kept"))
    picture(row, tmp_path / "pictures")
    assert ">kept<" in kept.read_text()
    later = kept.stat().st_mtime + 10
    os.utime(result, (later, later))
    picture(row, tmp_path / "pictures")
    assert ">slave<" in kept.read_text()


def test_a_result_that_cannot_be_read_is_said_in_place_of_its_picture(tmp_path):
    (tmp_path / "result.vtkhdf").write_text("no HDF5 <b>")
    row = Row(record({"result": "result.vtkhdf"}), tmp_path)
    assert "No picture: InputError" in picture(row, tmp_path / "pictures")


def test_a_result_too_large_to_be_drawn_or_turned_says_so(tmp_path, monkeypatch):
    result = tmp_path / "job" / "result.vtkhdf"
    write_result(result, handmade.plane(tmp_path), [], {})
    row = Row(record({"result": result.name}), result.parent)
    monkeypatch.setattr("solver.report.pictures.MOST_POINTS", 28)
    found = picture(row, tmp_path / "pictures")
    assert "<img" in found
    assert "No view to turn: ValueError: 29 points on surfaces; 28 at most are allowed" in found
    monkeypatch.setattr("solver.report.pictures.MOST_POINTS", 29)
    monkeypatch.setattr("solver.report.case_picture.MOST_FACES", 14)
    found = picture(row, tmp_path / "others")
    assert "No picture: ValueError: 15 faces are too many to draw; 14 at most are allowed" in found
    assert "<button" in found


def test_what_is_given_by_a_solution_has_its_reference_in_every_zone(tmp_path):
    """The pressure of another zone has one only where the case says so."""
    solution, exact = handmade.plane(tmp_path), handmade.uniform()
    given = replace(solution.case.reference, values={"displacement": EXACT}, exact=exact)
    solution.case = replace(solution.case, zones=solution.case.zones * 2, reference=given)
    assert reference(solution, "displacement").exact is exact
    assert reference(solution, "contact_pressure") is None
    given = replace(given, values={"contact_pressure": EXACT})
    solution.case = replace(solution.case, reference=given)
    assert reference(solution, "contact_pressure").exact is exact
    stated = replace(given, values={"contact_pressure": 12.0})
    solution.case = replace(solution.case, zones=solution.case.zones[:1], reference=stated)
    assert reference(solution, "contact_pressure") == 12.0
