"""Names that mean something to a shell, to HTML or to JUnit stay text everywhere."""

import xml.etree.ElementTree as ET

from solver.commands.cli import main
from tests.faults.corpus import CASE, RECIPE

FOLDER = "a $(touch hurt)'; touch hurt #<b>&"
TITLE = "<script>alert('1')</script> | `x` ]]> &amp;"


def test_a_folder_and_a_title_of_special_characters(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / FOLDER
    folder.mkdir()
    text = CASE.replace("{file: %s}", str(RECIPE)).replace("Two blocks", f'"{TITLE}"')
    (folder / "case.yaml").write_text(text, encoding="utf-8")
    out = folder / "out"
    verdict = str(out / "all" / "family" / "a" / "verdict.json")
    solve = ["solve", str(folder / "case.yaml"), "-o", str(out / "r.vtkhdf"), "--verdict", verdict]
    assert main([*solve, "--quiet"]) == 0
    broken = folder / "broken.yaml"
    broken.write_text(text.replace("young: 2000.0", f'young: "{TITLE}"'), encoding="utf-8")
    bad = str(out / "all" / "family" / "broken" / "verdict.json")
    assert main(["solve", str(broken), "-o", str(out / "b.vtkhdf"), "--verdict", bad]) == 2
    assert main(["report", str(out / "all"), "-o", str(out / "report")]) == 1
    for page in (out / "report").glob("*.html"):
        html = page.read_text(encoding="utf-8")
        assert "<script>alert" not in html
        assert "#<b>&" not in html
    suite = ET.parse(out / "report" / "junit.xml").getroot()
    told = " ".join([*suite.itertext(), *(v for e in suite.iter() for v in e.attrib.values())])
    assert "<script>alert('1')" in told  # whole, as text
    markdown = (out / "report" / "summary.md").read_text(encoding="utf-8")
    assert "<script>" not in markdown
    assert not list(tmp_path.rglob("hurt"))
