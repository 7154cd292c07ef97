"""Labels, springs, tied and cyclic sides in pictures: where they are, and that none meet."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from solver import solve_case
from solver.case.acting import Cyclic, Support
from solver.case.expressions import Expression
from solver.report.case_picture import draw_case
from solver.report.charts import GREEN
from tests import handmade

CASES = Path(__file__).parents[2] / "cases"
SVG = "{http://www.w3.org/2000/svg}"
# The mean width of a character over the size of its font, as browsers draw these texts.
WIDE = 0.5


def texts(svg):
    """The boxes (left, top, right, bottom) of all texts in a picture, in pixels, by their words."""
    found = []
    for text in ET.fromstring(svg).iter(f"{SVG}text"):
        x, y, size = (float(text.get(key)) / 10 for key in ("x", "y", "font-size"))
        width = WIDE * size * len(text.text)
        left = x - {"start": 0, "middle": width / 2, "end": width}[text.get("text-anchor")]
        found.append((text.text, (left, y - 0.75 * size, left + width, y + 0.1 * size)))
    return found


def meet(first, second):
    (_, a), (_, b) = first, second
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def assert_apart(svg):
    found = texts(svg)
    assert not [(a, b) for a, b in combinations(found, 2) if meet(a, b)]
    width, height = (float(ET.fromstring(svg).get(key)) for key in ("width", "height"))
    for words, (left, top, right, bottom) in found:
        assert min(left, top) >= 0, words
        assert right <= width, words
        assert bottom <= height, words


@pytest.mark.parametrize("name", ["shared/cross-hexa8-tetra10", "rigid/between-planes"])
def test_texts_of_crowded_pictures_do_not_meet(name):
    solved = solve_case(CASES / f"{name}.yaml")
    svg = solved.picture()
    assert_apart(svg)
    words = {words for words, _ in texts(svg)}
    assert {body.name for body in solved.solution.bodies} <= words


def shapes(svg, corners, **attributes):
    """The places of the first points of lines or polygons of so many points, in pixels."""
    found = []
    for path in ET.fromstring(svg).iter(f"{SVG}path"):
        if all(path.get(key) == value for key, value in attributes.items()):
            for piece in path.get("d").split("M")[1:]:
                start, _, steps = piece.partition("l")
                if len(steps.rstrip("Z").split()) == 2 * (corners - 1):
                    found.append(tuple(int(x) / 10 for x in start.split()))
    return found


def with_support(folder, support):
    """Two blocks of which the upper one's top has another support, and no load."""
    solution = handmade.plane(folder)
    solution.places.acted = {"supports[0].group": np.arange(18, 22)}
    solution.case = replace(solution.case, supports=(support,), loads=())
    return solution


def test_springs_do_not_look_like_supports(tmp_path):
    solution = with_support(tmp_path, Support(group="press", spring={"y": 12.5}))
    svg = draw_case(solution, "")
    assert shapes(svg, 3, stroke=GREEN, fill="#ffffff") == [], "no triangle"
    tips = shapes(svg, 8, stroke=GREEN)
    assert len(tips) == 4
    assert {y for _, y in tips} == {48.0}, "the top of the upper block"
    assert "springs y 12.5" in svg


def test_imposed_displacements_are_written(tmp_path):
    held = Support({"x": 0.0, "y": -0.5}, group="press")
    solution = with_support(tmp_path, held)
    solution.case = replace(
        solution.case, about=replace(solution.case.about, units={"length": "mm"})
    )
    svg = draw_case(solution, "")
    assert len(shapes(svg, 3, stroke=GREEN, fill="#ffffff")) == 8
    assert "moved y -0.5 mm" in svg
    assert "moved" not in draw_case(with_support(tmp_path, Support({"y": 0.0}, group="press")), "")
    turned = with_support(tmp_path, Support({"x": Expression("y**2")}, group="press"))
    assert "moved x y²" in draw_case(turned, "")


def test_nodes_that_move_together_have_one_hub(tmp_path):
    svg = draw_case(with_support(tmp_path, Support(group="press", together=("y",))), "")
    lines = [
        path.get("d").split("M")[1:]
        for path in ET.fromstring(svg).iter(f"{SVG}path")
        if path.get("stroke") == GREEN and path.get("stroke-width") == "11"
    ]
    [spokes] = lines
    ends = set()
    for spoke in spokes:
        start, step = (tuple(map(int, part.split())) for part in spoke.split("l"))
        assert start[1] == 480, "at a node of the top"
        ends.add((start[0] + step[0], start[1] + step[1]))
    assert len(spokes) == 4
    assert len(ends) == 1
    assert ends.pop()[1] == 480 - 140, "above the top"
    assert "moves together in y" in svg


def test_both_sides_of_a_sector_are_marked(tmp_path):
    cyclic = Cyclic("sym", shift=(50.0, 0.0))
    solution = with_support(tmp_path, Support(group="far", cyclic=cyclic))
    right, left = np.array([6, 13, 17, 21]), np.array([0, 7, 14, 18])
    solution.places.acted = {"supports[0].group": right, "supports[0].cyclic.of": left}
    svg = draw_case(solution, "")
    marks = sorted({x - 2.5 for x, _ in shapes(svg, 4, fill=GREEN)})
    assert len(shapes(svg, 4, fill=GREEN)) == 8
    assert len(marks) == 2
    assert "cyclic (50, 0)" in svg
    turned = Support(group="far", cyclic=Cyclic("sym", angle=90.0))
    solution.case = replace(solution.case, supports=(turned,))
    assert "cyclic 90°" in draw_case(solution, "")
    assert solution.case.acting["supports[0].cyclic.of"] == "sym"
