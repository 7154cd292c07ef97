"""Who is first to an accuracy, and the reason where it is not LAC with recovery."""

from pathlib import Path

import pytest

from solver.studies.work_precision import first
from solver.studies.work_precision.description import read_study
from solver.studies.work_precision.records import TimedSolve, lines, panels
from tests.studies.work_precision.test_page import record

ROOT = Path(__file__).parents[3]
STUDY = """
title: A study
threads: 1
repetitions: 3
limit: 60
treatments:
  - {name: lac, title: LAC, zone: {treatment: lac}}
  - {name: ours, title: recovered, zone: {treatment: lac, recovery: quadratic}, slaves: [QUAD8]}
  - {name: nodal, title: nodal, zone: {treatment: nodal}}
problems:
  - {name: waves, title: Waves, case: case.yaml, pairs: [[QUAD8, TRIA6], [QUAD4, TRIA3]],
     levels: [1, 2, 4]}
"""


@pytest.fixture
def found(tmp_path):
    """Who is first, given errors by level of the recovered and of the nodal pressure, and times."""
    text = (ROOT / "cases/study/templates/patch-2d.yaml").read_text()
    (tmp_path / "case.yaml").write_text(text)
    (tmp_path / "study.yaml").write_text(STUDY)
    study = read_study(tmp_path / "study.yaml")

    def of(ours, nodal, slower):
        def measured(p):
            errors = {"lac": [0.5] * 3, "ours": ours, "nodal": nodal}[p.treatment.name]
            seconds = 0.1 * p.level * (slower if p.treatment.name == "ours" else 1)
            return TimedSolve(record(p, errors[[1, 2, 4].index(p.level)], seconds), p)

        return first.firsts(panels(study.problems[0], lines(map(measured, study.points)))[0])

    return of


def test_only_quadratic_cells_with_a_recovery_are_judged(found):
    assert list(found([1e-5] * 3, [1e-5] * 3, 1.0)) == ["QUAD8–TRIA6"]


def test_recovery_is_first_or_tied_or_nobody_is(found):
    of = found([5e-3, 5e-4, 5e-4], [5e-2, 5e-3, 5e-4], 1.4)["QUAD8–TRIA6"]
    assert [one.word for one in of.values()] == [first.RECOVERED, first.RECOVERED, first.NONE]
    assert of[1e-2].solve.point.level == 1
    of = found([5e-3] * 3, [5e-3] * 3, 1.05)["QUAD8–TRIA6"]
    assert (of[1e-2].word, of[1e-2].title) == (first.TIED, "nodal")


@pytest.mark.parametrize(
    ("ours", "nodal", "slower", "why"),
    [
        ([5e-3] * 3, [2e-3] * 3, 1.5, ("errors 2.0e-03 and, recovered, 5.0e-03 on the same mesh; "
         "recovery takes 50% longer, most in solve (+25.0 ms)")),
        ([1e-15] * 3, [1e-15] * 3, 1.5, ("both are exact; recovery takes 50% longer, most in solve "
         "(+25.0 ms)")),
        ([5e-2, 5e-3, 1e-3], [5e-3] * 3, 1.0,
         "at level 1 its error is 5.0e-03, the recovered one 5.0e-02, which needs level 2"),
        ([5e-3] * 3, [5e-2, 5e-3, 5e-3], 3.0,
         "recovery reaches it on a coarser mesh, at level 1, but takes longer"),
        ([5e-2, 3e-2, 2e-2], [5e-3] * 3, 1.0,
         "recovery never reaches it; its least error is 2.0e-02"),
    ],
)  # fmt: skip
def test_the_reason_names_what_was_measured(found, ours, nodal, slower, why):
    one = found(ours, nodal, slower)["QUAD8–TRIA6"][1e-2]
    assert (one.word, one.title, one.why) == (first.OTHER, "nodal", why)
