"""What is verified: no key of the case file without a case of the batch, or a reason."""

from fnmatch import fnmatchcase
from pathlib import Path

import pytest

from solver.case.checks import CHECKS
from solver.case.reader import load_case
from solver.case.yaml import read_mapping
from solver.commands.jobs import case_files
from solver.mesh.keys import RECIPES
from tests.case.features import features, used

CASES = Path(__file__).resolve().parents[2] / "cases"
REASONS = read_mapping(CASES / "unverified.yaml")["features"]
ROUND_OFF = 1e-10
FOLDERS = sorted(file.parent for file in CASES.glob("*/family.yaml"))
CASE = """\
name: {name}
mesh: {{recipe: blocks, size: 1.0, bottom: {{cells: QUAD4}}, top: {{cells: QUAD4}}}}
plane: {plane}
materials: {{all: {{young: 1.0, poisson: 0.3}}}}
supports: [{{group: base, fix: [y]}}]
contact: [{{slave: bottom_contact, master: top_contact, treatment: nodal}}]
reference: {{kind: analytical, contact_pressure: 1.0}}
"""


def features_of(file):
    return used(read_mapping(file), file)


@pytest.fixture(scope="module")
def unused():
    found = {
        feature
        for folder in FOLDERS
        for file in case_files(folder)
        for feature in features_of(file)
    }
    assert found <= {*features(RECIPES), "mesh", "reference.solution"}
    return [feature for feature in features(RECIPES) if feature not in found]


def fits(feature, pattern):
    """`[]` is literal."""
    return fnmatchcase(feature, pattern.replace("[", "[[]"))


def test_every_key_and_choice_has_a_case_or_a_reason(unused):
    assert [f for f in unused if not any(fits(f, pattern) for pattern in REASONS)] == []


def test_no_reason_outlives_its_hole(unused):
    assert [p for p in REASONS if not any(fits(f, p) for f in unused)] == []


def test_features_of_a_file(tmp_path):
    file = tmp_path / "c.yaml"
    file.write_text(CASE.format(name="c", plane="strain"))
    assert features_of(file) >= {
        "plane: strain",
        "mesh.recipe: blocks",
        "contact[].treatment: nodal",
        "contact[].recovery: none",
        "materials.*.young",
        "reference.contact_pressure",
        "supports[].group",
    }
    assert not {"loads", "contact[].treatment: lac", "contact[].clearance"} & features_of(file)


def test_no_case_of_the_batch_has_a_stated_tolerance():
    """Each check is exact to round-off, or has the error that a ladder predicts."""
    stated = [
        (case.name, check.name)
        for folder in FOLDERS
        for case in map(load_case, case_files(folder))
        for check in CHECKS
        if _compared(check, case)
        and check.tolerance_in(case.reference.tolerance) > ROUND_OFF
        and check.expected_in(case.reference.expected) is None
    ]
    assert stated == []


def _compared(check, case):
    if check.norm == "error":
        return check.name in case.reference.tolerance
    if check.name.startswith("observation") and not case.observe:
        return False
    return check.key is not None and check.key in case.reference.values
