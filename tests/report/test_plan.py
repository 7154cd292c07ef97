"""What the report says of the plans of solves."""

from solver.report.plan import TITLES, LeftOut, left_out
from solver.report.rows import Row
from solver.simulation.options import Shortcuts
from tests.report.test_report import verdict
from tests.report.verdicts import record

PLAN = [
    ["interface: plain Gauss rules", "every face is an affine image", "quadrature"],
    ["no second active-set solve", "complementary", "status"],
    ["linear solver: CHOLMOD", "in the plane a factor is small", ""],
    ["a line of", "another version"],
]


def test_the_table_of_a_family(tmp_path):
    rows = [
        Row(record(verdict(name, "passed", plan=PLAN)), tmp_path) for name in ("fam-a", "fam-b")
    ]
    assert left_out(rows) == [
        LeftOut(TITLES["quadrature"], "every face is an affine image", 2),
        LeftOut(TITLES["status"], "complementary", 2),
    ]


def test_every_switch_has_a_title():
    assert TITLES.keys() == vars(Shortcuts()).keys()
