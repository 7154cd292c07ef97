"""What recovery gains on ladders whose errors are known powers, and which goals they reach."""

import pytest

from solver.studies.orders.description import read_ladders
from solver.studies.orders.gains import GOALS, GainGoal, gains
from solver.studies.orders.page import GAINS, PAGE, write_orders
from solver.studies.orders.records import read_curves
from tests.studies.orders.test_page import put, read

LADDERS = """
title: Powers
levels: [1, 5, 10]
smooth: true
ladders:
  - {case: quad8.yaml, recovery: none}
  - {case: quad8.yaml, recovery: automatic}
  - {case: quad8.yaml, recovery: linear}
"""


@pytest.fixture
def family(tmp_path):
    path = tmp_path / "cases" / "powers" / "orders.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(LADDERS)
    (path.parent / "quad8.yaml").touch()
    return read_ladders(path)


@pytest.fixture
def results(tmp_path):
    """Constants of order 1; recovered ones of order 3 and 2, with stress of order 2 and 1."""
    folder = tmp_path / "results" / "powers"
    for k in (1, 5, 10):
        put(folder / "quad8-none", k, "QUAD8", 2, pressure_l2=0.1 / k, stress_max=1 / k)
        put(folder / "quad8-automatic", k, "QUAD8", 2, pressure_l2=4e-3 / k**3, stress_max=k**-2.0)
        put(folder / "quad8-linear", k, "QUAD8", 2, pressure_l2=2e-3 / k**2, stress_max=1 / k)
    return folder.parent


def test_gain_and_order_between_the_last_two_levels(family, results):
    automatic, linear = gains(read_curves(family, results))
    assert (automatic.cells, automatic.form, automatic.pair) == (
        "QUAD8",
        "automatic",
        "QUAD8–QUAD4",
    )
    assert (automatic.faces, automatic.order) == (40, pytest.approx(3))
    assert automatic.gain == pytest.approx(0.01 / 4e-6)
    assert linear.gain == pytest.approx(0.01 / 2e-5)
    assert linear.stress_order == pytest.approx(1)


def test_goals_are_those_of_cells_and_form(family, results):
    automatic, linear = gains(read_curves(family, results))
    assert automatic.goal == GOALS["automatic", "QUAD8"] == GainGoal(2.2, 300)
    assert automatic.marks == {"order": True, "gain": True, "stress": True}
    assert linear.marks == {"order": False, "gain": True}


def test_the_page_marks_goals_that_are_reached_and_those_that_are_not(family, results, tmp_path):
    write_orders([family], results, tmp_path)
    page = (tmp_path / PAGE).read_text()
    assert "3.00 ✓" in page
    assert "2.00 ✗" in page
    assert [row["reached"] for row in read(tmp_path / GAINS)] == ["True", "False"]


def test_goals_in_2d_are_those_of_forty_faces(family, results, tmp_path):
    path = family.folder / "orders.yaml"
    path.write_text(LADDERS.replace("[1, 5, 10]", "[1, 5]"))
    assert [one.marks for one in gains(read_curves(read_ladders(path), results))] == [{}, {}]


def test_other_pressures_have_no_goals(family, results, tmp_path):
    path = family.folder / "orders.yaml"
    path.write_text(LADDERS.replace("smooth: true\n", ""))
    assert [one.marks for one in gains(read_curves(read_ladders(path), results))] == [{}, {}]
