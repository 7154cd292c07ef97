"""What a plan saves: measured line by line, kept in a file, and shown by the report."""

import json

import pytest

from solver.commands.cli import main
from solver.report import write_report
from solver.report.plan import FILE, TITLES, UNMEASURED, left_out, read_savings, saved
from solver.report.rows import Row
from solver.simulation.skips import Skips
from solver.studies.benchmark.savings import savings
from tests.commands.test_cli import PLANE
from tests.report.test_report import verdict
from tests.report.verdicts import put, record
from tests.scenes import block_case, block_mesh

CUT = {"skip": "cut", "what": "no cut", "why": "SEG3", "median": 0.02, "low": 0.01, "high": 0.03}
NONE = CUT | {"skip": "status", "median": 0.001, "low": -0.002}
MEASURED = {"fam-a": {"seconds": 0.1, "lines": [CUT, NONE]}}
PLAN = [
    ["interface: no cut", "SEG3 faces own an inner node", "cut"],
    ["no second active-set solve", "complementary", "status"],
    ["no further refinement", "round-off", "refinement"],
    ["linear solver: CHOLMOD", "in the plane a factor is small", ""],
    ["a line of", "another version"],
]


def test_every_switch_of_the_plan_is_measured():
    found = savings(block_case(2), block_mesh("QUAD9", "QUAD9", (2, 2)), rounds=2)
    assert {line.skip for line in found.lines} == {"cut", "quadrature", "status", "refinement"}
    assert found.job == "patch"
    assert found.unknowns == 100
    assert all(line.low <= line.median <= line.high for line in found.lines)
    second = next(line for line in found.lines if line.skip == "status")
    # A second solve with a factor of its own cannot be had for nothing.
    assert 0 < second.median < found.seconds
    assert found.everything > found.seconds


def test_a_file_of_them_by_the_command_line(tmp_path, capsys):
    (tmp_path / "c.yaml").write_text(PLANE)
    output = tmp_path / FILE
    output.parent.mkdir()
    assert main(["savings", str(tmp_path / "c.yaml"), "-o", str(output)]) == 0
    assert "no further refinement (the residual is round-off): " in capsys.readouterr().out
    found = read_savings(tmp_path)
    assert found["small"]["unknowns"] == 2 * (16 + 3 * 4 + 9)
    assert saved("small", "refinement", found) != UNMEASURED


@pytest.mark.parametrize("content", [None, "", "[]", "{}", '{"jobs": 3}'])
def test_a_file_that_is_none_measures_nothing(tmp_path, content):
    if content is not None:
        (tmp_path / FILE).parent.mkdir()
        (tmp_path / FILE).write_text(content)
    assert read_savings(tmp_path) == {}


def test_what_is_saved_in_words():
    assert saved("fam-a", "cut", MEASURED) == "20.0 ms, 20% of the solve"
    assert saved("fam-a", "status", MEASURED) == "nothing that shows (−2.0 … 30.0 ms)"
    assert saved("fam-a", "refinement", MEASURED) == UNMEASURED
    assert saved("fam-b", "cut", MEASURED) == UNMEASURED
    assert saved("fam-a", "", MEASURED) == ""


def test_the_table_of_a_family(tmp_path):
    rows = [
        Row(record(verdict(name, "passed", plan=PLAN)), tmp_path) for name in ("fam-a", "fam-b")
    ]
    table = {line.what: line for line in left_out(rows, MEASURED)}
    assert list(table) == [TITLES["cut"], TITLES["status"], TITLES["refinement"]]
    cut = table[TITLES["cut"]]
    assert (cut.why, cut.solves) == ("SEG3 faces own an inner node", 2)
    assert cut.saved == "fam-a: 20.0 ms, 20% of the solve"
    assert table[TITLES["refinement"]].saved == f"fam-a: {UNMEASURED}"
    assert left_out(rows, {})[0].saved == UNMEASURED


def test_every_switch_has_a_title():
    assert TITLES.keys() == vars(Skips()).keys()


def test_the_report_shows_what_was_left_out_why_and_what_that_saves(tmp_path):
    file = put(tmp_path / "fam/fam-a/verdict.json", verdict("fam-a", "passed", plan=PLAN))
    (tmp_path / FILE).parent.mkdir()
    (tmp_path / FILE).write_text(json.dumps({"jobs": MEASURED}))
    write_report([file], tmp_path / "report", log=lambda _: None)
    page = (tmp_path / "report" / "fam.html").read_text()
    for wanted in (TITLES["cut"], "20.0 ms, 20% of the solve", UNMEASURED, "a line of"):
        assert wanted in page
    assert page.index("What was left out") < page.index("Case by case")
