"""Drawings as PNG: the right colour at the right place."""

from io import BytesIO

import numpy as np
import pytest

from solver.report.raster import available, to_png
from solver.report.svg import Drawing

pytestmark = pytest.mark.skipif(not available(), reason="matplotlib is not installed")
RED, BLUE, WHITE = (255, 0, 0), (0, 0, 255), (255, 255, 255)


@pytest.fixture(scope="module")
def pixels():
    """A picture of 100 × 60 pixels, by (x, y), at two dots a pixel."""
    from PIL import Image

    drawing = Drawing(100, 60, "a <title> with $ & more")
    drawing.rectangle(10, 10, 20, 30, fill="#ff0000")
    drawing.circles(np.array([[60.0, 25.0]]), 8, fill="#0000ff", stroke="#ff0000", stroke_width=2)
    drawing.line(0, 55, 100, 55, stroke="#0000ff", stroke_width=4, stroke_dasharray=(20, 20))
    drawing.crosses(np.array([[85.0, 20.0]]), 6, stroke="#ff0000", stroke_width=3)
    drawing.open_link("#", "tip")
    drawing.text(99, 48, "$ε⁻⁶<", "end", size=14, color="#0000ff", weight="bold")
    drawing.close_link()
    image = Image.open(BytesIO(to_png(drawing.svg()))).convert("RGB")
    assert image.size == (200, 120)
    return lambda x, y: image.getpixel((round(2 * x), round(2 * y)))


def test_a_rectangle_is_filled_within_its_corners(pixels):
    assert [pixels(x, 20) for x in (8, 12, 28, 32)] == [WHITE, RED, RED, WHITE]
    assert [pixels(20, y) for y in (8, 12, 38, 42)] == [WHITE, RED, RED, WHITE]


def test_a_circle_is_filled_and_has_its_rim(pixels):
    assert pixels(60, 25) == BLUE
    for x, y in ((68, 25), (52, 25), (60, 17), (60, 33)):
        assert pixels(x, y) == RED
    assert pixels(67, 18) == WHITE


def test_dashes_are_as_long_as_asked_for(pixels):
    assert [pixels(x, 55) for x in (10, 30, 50, 70, 90)] == [BLUE, WHITE, BLUE, WHITE, BLUE]
    assert pixels(10, 51) == WHITE


def test_a_cross_has_four_arms_and_nothing_between(pixels):
    assert [pixels(x, y) for x, y in ((85, 20), (81, 16), (89, 24), (81, 24), (89, 16))] == [
        RED
    ] * 5
    assert pixels(85, 15) == WHITE


def test_text_ends_where_it_is_anchored(pixels):
    columns, rows = np.arange(40, 100, 0.5), np.arange(38, 50, 0.5)
    inked = [x for x in columns if any(pixels(x, y)[0] < 128 for y in rows)]
    assert min(inked) > 50
    assert 95 <= max(inked) < 100
