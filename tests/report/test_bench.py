"""Other codes in the report: rows of their own, the page of all codes, two codes compared."""

import csv
import json
import re
import shutil
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from solver.codes.foreign import Field, ForeignResult
from solver.codes.recorded import recorded_verdicts
from solver.codes.verdicts import folder_of, store, without_foreign
from solver.commands.cli import main
from solver.report import write_report
from solver.report.bench import digits
from solver.system.errors import InputError
from solver.verification.run import Job, solve
from solver.verification.stored import write_verdict
from tests.browser import MISSING, browser
from tests.codes import results as handmade
from tests.report.test_charts import specifications

RECORDED = """
kind: recorded
code: elder
version: "3"
date: "2020"
source: its manual, chapter 7
results:
  - {cases: [ssnp170-a], pressure: 4.0e-13, stress: 2.0e-3}
"""


def foreign(code, answer, factor=1.0):
    slave = answer.pressure > 0
    return ForeignResult(
        code=code,
        version="1.0",
        displacement=Field(places=answer.points, values=answer.displacement),
        stress=Field(places=answer.points, values=factor * answer.stress),
        pressure=Field(places=answer.points[slave], values=factor * answer.pressure[slave]),
        settings={"penalty": "50 E"},
        seconds=0.25,
        digits=6,
    )


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Ours, a code that is right, one that is 1 % off, one that cannot, and a recorded one."""
    root = tmp_path_factory.mktemp("bench") / "results"
    mesh, case = handmade.mesh_and_case("ssnp170/a")
    ours = root / "ssnp170/ssnp170-a"
    ours.mkdir(parents=True)
    solve(Job(case.path), ours / "result.vtkhdf", ours / "verdict.json")
    answer = handmade.patch()
    for code, factor in (("right", 1.0), ("near", 1.01)):
        folder = folder_of(root, case, code)
        store(case, foreign(code, answer, factor), folder, mesh)
    cannot = folder_of(root, case, "cannot")
    cannot.mkdir(parents=True)
    verdict = without_foreign(case, "cannot", "refused", "TRIA3: it has no such element")
    write_verdict(cannot / "verdict.json", verdict)
    family = root.parent / "cases/ssnp170"
    (family / "recorded").mkdir(parents=True)
    (family / "recorded/elder.yaml").write_text(RECORDED, encoding="utf-8")
    (family / "family.yaml").write_text("title: Patch test\n", encoding="utf-8")
    shutil.copy(case.path, family)
    said = write_report(
        sorted(root.glob("*/*/verdict.json")), root / "report", [family / "family.yaml"]
    )
    return root / "report", said


def test_digits_of_an_error():
    assert [digits(e) for e in (1e-3, 1.0, 5.0, 0.0, None)] == [3.0, 0.0, 0.0, 16.0, None]
    assert digits(float("nan")) is None


def test_the_batch_is_judged_by_our_own_solves(report):
    folder, said = report
    assert "The one solve passed. Of 3 results of other codes 1 passed." in said
    assert (folder / "failures.txt").read_text(encoding="utf-8") == ""


def test_rows_of_their_own_in_every_format(report):
    folder, _ = report
    names = {"ssnp170-a", "ssnp170-a@right", "ssnp170-a@near", "ssnp170-a@cannot"}
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert {row["job"] for row in summary} == names
    assert summary[0]["job"] == "ssnp170-a"  # before the failures of other codes
    with (folder / "summary.csv").open(encoding="utf-8", newline="") as file:
        assert {row["job"] for row in csv.DictReader(file)} == names
    suite = ET.parse(folder / "junit.xml").getroot()[0]
    assert {case.get("name") for case in suite.iter("testcase")} == {"ssnp170-a"}
    page = (folder / "ssnp170.html").read_text(encoding="utf-8")
    assert "results of other codes" in page
    for name in names:
        assert f'id="ssnp170/{name}"' in page
    assert 'href="bench.html"' in (folder / "summary.html").read_text(encoding="utf-8")


def test_the_cells_of_the_bench(report):
    folder, _ = report
    with (folder / "bench.csv").open(encoding="utf-8", newline="") as file:
        cells = {row["code"]: row for row in csv.DictReader(file)}
    assert set(cells) == {"this project", "right", "near", "cannot", "elder-3"}
    assert float(cells["right"]["pressure_digits"]) == 6.0  # as many as its file has
    assert float(cells["near"]["pressure_digits"]) == pytest.approx(2.0)
    assert float(cells["near"]["stress_digits"]) == pytest.approx(2.0)
    assert float(cells["near"]["seconds"]) == 0.25
    assert (cells["cannot"]["verdict"], cells["cannot"]["pressure_digits"]) == ("refused", "")
    assert cells["cannot"]["reason"] == "TRIA3: it has no such element"
    assert float(cells["elder-3"]["pressure_digits"]) == pytest.approx(12.4, abs=0.01)
    assert cells["elder-3"]["recorded"] == "its manual, chapter 7"
    assert len(json.loads((folder / "bench.json").read_text(encoding="utf-8"))) == 5
    suite = ET.parse(folder / "bench-junit.xml").getroot()[0]
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("3", "1", "1")


def test_the_page_of_the_bench(report):
    folder, _ = report
    page = (folder / "bench.html").read_text(encoding="utf-8")
    assert '<a href="ssnp170.html#ssnp170/ssnp170-a">ssnp170-a</a>' in page
    assert "refused: TRIA3: it has no such element" in page
    assert page.count('class="d no"') == 2
    assert re.search(r"failed: [a-z ]+: error 1.0e.02, allowed 1.0e.03<", page)
    assert "near passes 0 of 1; right passes 1 of 1" in page
    assert "cannot passes 0 of 0 and cannot express 1" in page
    assert "<strong>recorded</strong> 2020, not computed here; its manual, chapter 7" in page
    assert "penalty: 50 E" in page
    records = next(iter(specifications(page).values()))["data"]["values"]
    by_code = {
        r["series"]: [s["pressure"] for s in records if s["series"] == r["series"]] for r in records
    }
    assert set(by_code) == {"this project", "reference", "right", "near"}
    assert (len(by_code["right"]), len(by_code["this project"])) == (18, 17)
    assert np.allclose(by_code["near"], 25.25)


@pytest.mark.skipif(bool(MISSING), reason=MISSING or "-")
def test_the_page_sorts_and_draws(report):
    folder, _ = report
    with browser() as window:
        window.open(folder / "bench.html")
        window.wait("document.querySelector('.drawn svg') !== null")
        heads = "[...document.querySelectorAll('table.bench th')]"
        window.run(f"{heads}[1].click() || true")
        assert window.run(f"{heads}[1].ariaSort") == "ascending"


def test_two_codes_compared(report, capsys):
    folder, _ = report
    root = folder.parent
    assert main(["compare", f"{root}@ours", f"{root}@right"]) == 0
    assert "1 solves: no verdict changed; no number changed" in capsys.readouterr().out
    assert main(["compare", f"{root}@right", f"{root}@near"]) == 1
    said = capsys.readouterr().out
    assert "ssnp170/ssnp170-a | passed → failed" in said
    assert "multiplier interface: maximum | 25 | 25.25" in said
    assert main(["compare", f"{root}@right", f"{root}@other"]) == 2
    assert "it has no result there; allowed: cannot, near, ours, right" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("kind: recorded", "kind: measured"), "kind = 'measured': must be recorded"),
        (("code: elder", "code: a b"), "letters, digits"),
        (("source: its manual, chapter 7", ""), "source: this key is needed"),
        (("pressure: 4.0e-13", "pressure: -1"), "a positive number"),
        (
            ("ssnp170-a", "ssnp170-aa"),
            r"results\[0\].cases = 'ssnp170-aa': not a solve of .* mean ssnp",
        ),
    ],
)
def test_a_recorded_file_that_is_not_valid_is_refused(tmp_path, change, told):
    shutil.copy(handmade.ROOT / "cases/ssnp170/a.yaml", tmp_path)
    (tmp_path / "recorded").mkdir()
    (tmp_path / "recorded/a.yaml").write_text(RECORDED.replace(*change), encoding="utf-8")
    with pytest.raises(InputError, match=told):
        recorded_verdicts(tmp_path)


def test_our_recorded_files_name_solves_of_the_batch():
    assert recorded_verdicts(handmade.ROOT / "cases/ssnp170")
