"""Every key of the case file: described, in the schema, and refused in one line if it is wrong."""

import json
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.case.file import CaseFile
from solver.case.model import Case
from solver.case.reader import parse_case
from solver.case.typed import described, fields, is_section
from solver.case.yaml import parse_mapping
from solver.commands.schemas import FOLDER
from solver.system.errors import InputError
from tests.case.files import FULL, PATH


def sections(kind=CaseFile):
    """The classes of a case file, found in the types of the keys."""
    found = {kind}
    parts = [field.type for field in fields(kind).values()]
    while parts:
        part = parts.pop()
        if is_section(part) and part not in found:
            found |= sections(part)
        parts += get_args(part)
    return found


def test_every_key_says_what_is_allowed():
    for kind in sections():
        for name, field in fields(kind).items():
            assert described(field.type), (kind, name)


def test_snakemake_validates_by_the_same_schema():
    validate = pytest.importorskip("snakemake.utils").validate
    workflow_error = pytest.importorskip("snakemake.exceptions").WorkflowError
    base = {**BASE, "mesh": {"file": "block.msh"}}
    validate(dict(base), str(FOLDER / "case.schema.json"))
    with pytest.raises(workflow_error, match="'stressed' is not one of"):
        validate({**base, "plane": "stressed"}, str(FOLDER / "case.schema.json"))


KEYS = sorted({key for kind in sections() for key in fields(kind)} | {"all", "x"})
WORDS = [*KEYS, "S", "M", "25*x", "strain", "both", "analytical", "1/", "", "../a"]
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 3) | st.floats(-2, 2) | st.sampled_from(WORDS),
    lambda v: st.lists(v, max_size=3) | st.dictionaries(st.sampled_from(KEYS), v, max_size=3),
    max_leaves=6,
)
BASE = {
    "name": "block",
    "mesh": {"recipe": "blocks"},
    "materials": {"all": {"young": 1.0, "poisson": 0.0}},
    "supports": [{"group": "base", "fix": ["x"]}],
}


@given(st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=4))
def test_any_mapping_is_a_case_or_refused(content):
    for whole in (content, BASE | content):
        line = _refusal_of(json.dumps(whole))
        assert line is None or (line.startswith("family/c.yaml: ") and "\n" not in line)


def _refusal_of(text):
    try:
        assert isinstance(parse_case(text, PATH), Case)
    except InputError as refusal:
        return str(refusal)
    return None


WRONG = [None, True, -1, 0, 0.5, 1e300, 10**300, "", "x y", "../../etc", "<b>&", "$(x)", "9**9**9",
         "a" * 2000, "(" * 60 + "1" + ")" * 60, [], [[]], [None], {}, {"a": 1}]  # fmt: skip


def places(content, path=()):
    """The paths of everything in a mapping, whatever it holds."""
    pairs = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in pairs:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


def put(content, path, value):
    """A copy of plain content with one thing replaced."""
    copy = json.loads(json.dumps(content))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return copy


WHOLE = parse_mapping(FULL, PATH)
# Keys of which nearly everything that is text, or a number, is a value.
FREE = {"title", "description", "remark", "seed"}


@pytest.mark.parametrize("path", list(places(WHOLE)), ids=lambda p: ".".join(map(str, p)))
def test_every_key_with_a_wrong_value_is_refused_in_one_line(path):
    told = [_refusal_of(json.dumps(put(WHOLE, path, value))) for value in WRONG]
    refused = [line for line in told if line is not None]
    assert all("\n" not in line and len(line) < 1500 for line in refused)
    # At least what is neither text, number, list nor mapping, or is text of no meaning.
    assert len(refused) >= (5 if path[-1] in FREE else 9)
