"""What the pictures draw, counted on solutions written by hand."""

import os
import re
import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest

from solver.report.axes import Scale
from solver.report.geometry import boundary_faces, macro_edges, normals, outlines
from solver.report.pictures import picture
from solver.report.plane import draw_plane
from solver.report.rows import Row
from solver.report.space import draw_space, pressure_color
from solver.report.svg import BLUE, ORANGE, Drawing, mixed
from solver.verification.results import write_result
from tests import handmade
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
    svg = draw_plane(handmade.plane(tmp_path), "two blocks")
    slave, master = (mixed(color, "#ffffff", 0.25) for color in (BLUE, ORANGE))
    assert polygons(svg, stroke=slave) == 6
    assert polygons(svg, stroke=master) == 3
    words = {text.text for text in ET.fromstring(svg).iter(f"{SVG}text")}
    assert {"bottom", "top", "slave", "master", "QUAD4"} <= words


def test_space_picture_colours_sub_faces_by_pressure(tmp_path):
    svg = draw_space(handmade.solid(tmp_path), "solid")
    assert polygons(svg, fill=pressure_color(1.0)) == 4  # the triangles, under 25
    assert polygons(svg, fill=pressure_color(31 / 32)) == 1  # the quadrangle, under 24


def test_boundary_of_two_cubes_on_each_other():
    layers = [(x, y, z) for z in (0, 1, 2) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    points = np.array(layers, dtype=float)
    cubes = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])
    mesh = meshio.Mesh(points, [("hexahedron", cubes)])
    [(kind, faces)] = boundary_faces(mesh)
    assert kind == "QUAD4"
    assert len(faces) == 10
    centre = points[faces].mean(axis=1)
    outward = ((centre - [0.5, 0.5, 1.0]) * normals(outlines(points, kind, faces))).sum(axis=1)
    assert np.all(outward > 0)


def test_outline_of_a_macro_element_leaves_out_the_cut():
    # A triangle cut into three about node 3: the three inner edges are not its outline.
    faces = [("TRIA3", np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]]), np.zeros(3, dtype=int))]
    assert macro_edges(faces)[:, :2].tolist() == [[0, 1], [0, 2], [1, 2]]


def test_mid_nodes_are_drawn_only_where_the_edge_bends():
    straight = np.array([[0, 0], [2, 0], [0, 2], [1, 0], [1, 1], [0, 1]], dtype=float)
    bent = straight.copy()
    bent[4] += 0.1
    nodes = np.arange(6)[None]
    assert outlines(straight, "TRIA6", nodes).shape == (1, 3, 2)
    assert outlines(bent, "TRIA6", nodes).shape == (1, 6, 2)


@pytest.mark.parametrize(
    ("scale", "ticks"),
    [
        (Scale(0, 31.25, 0, 100), [0, 10, 20, 30]),
        (Scale(-1, 1, 0, 100), [-1, -0.5, 0, 0.5, 1]),
        (Scale(0.3, 4, 0, 100, log=True), [0.5, 1, 2]),
    ],
)
def test_ticks_are_round(scale, ticks):
    assert scale.ticks() == pytest.approx(ticks)


def test_log_scale_puts_decades_at_equal_distances():
    scale = Scale(1e-4, 1, 0, 400, log=True)
    assert scale([1e-4, 1e-2, 1]).tolist() == pytest.approx([0, 200, 400])
    assert scale.label(1e-12) == "10⁻¹²"


def test_text_in_a_drawing_is_escaped():
    drawing = Drawing(10, 10, "<b> & co")
    drawing.text(1, 1, "<script>")
    drawing.open_link('#"x', "'tip' <i>")
    drawing.close_link()
    root = ET.fromstring(drawing.svg())
    assert [e.text for e in root.iter(f"{SVG}text")] == ["<script>"]
    assert root.find(f"{SVG}a").get("href") == '#"x'


def test_pressure_colours_darken():
    lightness = [
        sum(int(pressure_color(share)[i : i + 2], 16) for i in (1, 3, 5))
        for share in np.linspace(0, 1, 20)
    ]
    assert lightness == sorted(lightness, reverse=True)
    assert len(set(lightness)) == 20


def test_picture_is_drawn_again_only_for_a_newer_result(tmp_path):
    result = tmp_path / "job" / "result.vtkhdf"
    write_result(result, handmade.plane(tmp_path), [], {})
    row = Row(record({"result": result.name}), result.parent)
    first = picture(row, tmp_path / "pictures")
    assert "<svg" in first
    kept = tmp_path / "pictures" / "fam-job.svg"
    kept.write_text(kept.read_text().replace("slave", "kept"))
    assert re.search(">kept<", picture(row, tmp_path / "pictures"))
    later = kept.stat().st_mtime + 10
    os.utime(result, (later, later))
    assert not re.search(">kept<", picture(row, tmp_path / "pictures"))


def test_a_result_that_cannot_be_read_is_said_in_place_of_its_picture(tmp_path):
    (tmp_path / "result.vtkhdf").write_text("no HDF5 <b>")
    row = Row(record({"result": "result.vtkhdf"}), tmp_path)
    assert "No picture: InputError" in picture(row, tmp_path / "pictures")
