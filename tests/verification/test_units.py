"""Units as labels: those that follow from length and stress, and where a page shows them."""

import pytest

from solver.report import write_report
from solver.verification.units import derived
from tests.report.test_report import verdict
from tests.report.verdicts import put


@pytest.mark.parametrize(
    ("length", "stress", "spatial", "area", "force", "moment"),
    [
        ("mm", "MPa", True, "mm²", "N", "N·mm"),
        ("mm", "MPa", False, "mm", "N/mm", "N"),
        ("m", "kPa", True, "m²", "kN", "kN·m"),
        ("in", "psi", True, "in²", "psi·in²", "psi·in²·in"),
    ],
)
def test_units_of_forces_follow_from_length_and_stress(
    length, stress, spatial, area, force, moment
):
    found = derived({"length": length, "stress": stress}, spatial)
    assert (found["area"], found["force"], found["moment"]) == (area, force, moment)
    assert found["energy"] == moment


def test_nothing_follows_from_a_length_alone():
    assert derived({"length": "mm"}, True) == {"length": "mm"}
    assert derived({}, True) == {}


def test_the_table_of_a_family_has_the_unit_that_all_its_solves_share(tmp_path):
    mixed = [verdict("a", "passed", units={"stress": "MPa", "length": "mm"}, dofs=9)]
    for others, expected in (({"stress": "MPa"}, True), ({"stress": "Pa"}, False)):
        contents = [*mixed, verdict("b", "passed", units=others, dofs=9, pressure=[25.0, 25.0])]
        files = [put(tmp_path / c["job"] / "verdict.json", c) for c in contents]
        write_report(files, tmp_path / "report")
        page = (tmp_path / "report" / "fam.html").read_text()
        head = page[page.index("<th>p min") : page.index("<th>Worst")]
        assert ("[MPa]" in head) == expected
        assert ("<td>25 <small>Pa</small></td>" in page) == (others["stress"] == "Pa")
