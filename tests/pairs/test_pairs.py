"""The array is whole and a part of it exact; refusals name both keys, faults turn it red."""

import random
from itertools import product

import pytest

from solver.system.errors import InputError
from tests.pairs.array import missing, stored
from tests.pairs.faults import FAULTS
from tests.pairs.judge import tried
from tests.pairs.options import EXCLUDED, OPTIONS, PLAIN, REFUSED, Rule, plain_in, possible
from tests.pairs.problem import problem_of

ROWS = stored()
PART = random.Random(2026).sample(ROWS, len(ROWS) // 5)


def test_every_possible_pair_is_in_the_array():
    """`make pairs` makes it anew where options have changed."""
    assert len(ROWS) > 100
    assert not list(missing(ROWS))


def test_a_lost_row_is_noticed():
    assert list(missing(ROWS[:-1]))


@pytest.mark.parametrize("row", PART, ids=lambda row: " ".join(v for v in row.values())[:60])
def test_a_fifth_of_the_array(row):
    outcome = tried(row)
    assert outcome.word == "exact", (outcome.what, outcome.error)


OPEN = {"gap": "open", "friction": "held"}
UNLOADED = {"steps": "unloaded", "friction": "held"}


@pytest.mark.parametrize("more", [OPEN, UNLOADED, {**UNLOADED, "motion": "large"}], ids=str)
@pytest.mark.parametrize("space", ["strain", "axisymmetric", "solid"])
def test_friction_where_nothing_presses(space, more):
    """All else plain: with another zone that presses, the fault did not show."""
    outcome = tried(plain_in(space) | more)
    assert outcome.word == "exact", (outcome.what, outcome.error)


def completed(part):
    """A row with a part that the program should refuse, plain but for it; None where none fits."""
    solid = any(
        part.get(k, "").startswith(("HEXA", "TETRA", "P")) for k in ("slave cells", "master cells")
    )
    solid &= part.get("space", "solid") == "solid"
    row = plain_in("solid" if solid else "strain") | part
    for side, other in (("slave cells", "master cells"), ("master cells", "slave cells")):
        if side in part and other not in part:
            row[other] = part[side]
    return None if any(rule.applies(row) for rule in EXCLUDED) else row


REFUSALS = [
    (rule, row)
    for rule in REFUSED
    for values in product(*rule.when.values())
    if (row := completed(dict(zip(rule.when, values, strict=True))))
]


@pytest.mark.parametrize(
    ("rule", "row"), REFUSALS, ids=lambda x: x.why if isinstance(x, Rule) else ""
)
def test_what_does_not_go_together_is_refused_by_both_keys(rule, row):
    outcome = tried(row)
    assert outcome.word == "refused", outcome
    assert "\n" not in outcome.what
    for key in rule.keys:
        assert key in outcome.what, outcome.what


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_where_options_meet_turns_the_array_red(fault, monkeypatch):
    """Each option alone stays exact: no test of one option notices."""
    alone = fault.plain
    fault.plant(monkeypatch)
    for name, value in fault.options.items():
        single = {**alone, name: value}
        assert not possible(single) or tried(single).word == "exact", (name, value)
    assert tried({**alone, **fault.options}).word == fault.ends
    caught = (row for row in ROWS if all(row[n] == v for n, v in fault.options.items()))
    assert any(tried(row).word == fault.ends for row in caught)


def test_every_rule_of_the_program_is_tried():
    assert {rule.why for rule, _ in REFUSALS} == {rule.why for rule in REFUSED}


def test_the_program_refuses_a_case_file_before_it_is_meshed():
    with pytest.raises(InputError, match="must be lac in a zone with friction"):
        problem_of({**plain_in("strain"), "friction": "stick", "treatment": "nodal"})
    assert set(PLAIN) == set(OPTIONS)
