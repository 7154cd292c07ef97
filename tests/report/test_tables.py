"""JUnit XML as others read it: by a library, and by the schema of Jenkins."""

from pathlib import Path

import pytest
import xmlschema
from junitparser import Error, Failure, JUnitXml

from solver.report.rows import Row
from solver.report.tables import to_junit
from tests.report.test_report import BATCH, NASTY, unfinished, verdict
from tests.report.verdicts import record

SCHEMA = xmlschema.XMLSchema(Path(__file__).parent / "schemas" / "jenkins-junit.xsd")
OTHER = verdict("other-a", "passed", family="other family")
UNTOLD = unfinished("untold", "refused", "the case cannot be read") | {"family": "untold"}


def rows(*verdicts):
    return [Row(record(each), Path()) for each in verdicts]


@pytest.mark.parametrize(
    "verdicts",
    [[], [UNTOLD], [OTHER], [*BATCH, OTHER, UNTOLD]],
    ids=["none", "refused", "one", "all"],
)
def test_the_schema_holds(verdicts):
    SCHEMA.validate(to_junit(rows(*verdicts)))


def test_the_schema_refuses_what_is_none():
    text = to_junit(rows(OTHER)).replace("testcase", "case")
    assert not SCHEMA.is_valid(text)


def test_a_library_reads_back_what_was_written():
    suites = list(JUnitXml.fromstring(to_junit(rows(*BATCH, OTHER)).encode()))
    assert [(suite.name, suite.tests) for suite in suites] == [("fam", 7), ("other family", 1)]
    fam = suites[0]
    assert (fam.failures, fam.errors, fam.skipped) == (2, 3, 0)
    assert fam.time == pytest.approx(4 * 0.75)
    assert fam.timestamp == "2026-01-02T03:04:05"
    properties = {each.name: each.value for each in fam.properties()}
    assert properties["revision"] == "abc"
    assert properties["verdicts"] == "1 crashed, 2 refused, 1 failed, 1 unreliable, 2 passed"
    cases = {case.name: case for case in fam}
    assert cases["fam-a2"].is_passed
    assert cases["fam-a2"].time == 0.75
    [failure] = cases["fam-bad"].result
    assert isinstance(failure, Failure)
    assert (failure.type, failure.message) == ("failed", f"multiplier: {NASTY}")
    assert failure.text == "multiplier interface: error 4.0e-03, tolerance 1.0e-03"
    [error] = cases[NASTY].result
    assert isinstance(error, Error)
    assert error.type == "refused"


def test_counts_are_those_that_the_library_finds():
    suites = JUnitXml.fromstring(to_junit(rows(*BATCH, OTHER, UNTOLD)).encode())
    for suite in suites:
        told = (suite.tests, suite.failures, suite.errors, suite.skipped)
        suite.update_statistics()
        assert told == (suite.tests, suite.failures, suite.errors, suite.skipped)
