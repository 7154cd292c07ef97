"""Files declared as types: what they read, what they refuse, and the schemas made from them."""

import json
from pathlib import Path
from typing import Annotated, Literal

import pytest
from jsonschema.validators import Draft202012Validator
from msgspec import field

from solver.case.typed import ONCE, FieldError, Positive, Section, Text, read_as
from solver.case.yaml import parse_mapping, read_mapping
from solver.commands.schemas import FOLDER, TYPES, schema_text
from solver.system.errors import InputError

WHERE = Path("box.yaml")
CASES = Path(__file__).parents[2] / "cases"
FILES = {
    "case": "ssnp170/[a-e].yaml",
    "code": "../docs/examples/toy/code.yaml",
    "family": "*/family.yaml",
    "map": "../docs/examples/map.yaml",
    "recorded": "*/recorded/*.yaml",
    "study": "studies/*.yaml",
}


class Bolt(Section, frozen=True):
    name: Text
    size: Positive
    head: Literal["hex", "round"] = "hex"
    turns: tuple[int, ...] | int = 1


class Box(Section, frozen=True):
    bolts: tuple[Bolt, ...]
    by_place: dict[Literal["left", "right"], Bolt] = field(default_factory=dict)
    sizes: Annotated[tuple[Positive, ...], ONCE] = (1.0,)
    limits: tuple[float | None, float | None] = (None, None)

    def __post_init__(self):
        super().__post_init__()
        if len(self.bolts) > 2:
            raise FieldError(("bolts", 2, "name"), "there is no third place")


def test_a_file_becomes_an_object():
    text = "bolts: [{name: a, size: 3, turns: [1, 2]}]\nlimits: [1, null]"
    box = read_as(Box, parse_mapping(text, WHERE), WHERE)
    assert box == Box(bolts=(Bolt("a", 3.0, "hex", (1, 2)),), limits=(1.0, None))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "bolt: []",
            "bolt = []: unknown key; did you mean bolts? (allowed: bolts, by_place, limits, ",
        ),
        ("{}", "bolts: this key is needed"),
        ("bolts: 1", "bolts = 1: must be a list of {name, size, head, turns}"),
        ("bolts: [{nam: a, size: 1}]", "bolts[0].nam = 'a': unknown key; did you mean name?"),
        ("bolts: [{name: a}]", "bolts[0].size: this key is needed"),
        ("bolts: [{name: '', size: 1}]", "bolts[0].name = '': must be text"),
        (
            "bolts: [{name: a, size: 1e31}]",
            "bolts[0].size = 1e+31: must be a positive number from",
        ),
        ("bolts: [{name: a, size: true}]", "bolts[0].size = True: must be a positive number"),
        ("bolts: [{name: a, size: 1, head: oval}]", "bolts[0].head = 'oval': must be hex or round"),
        ("bolts: [{name: a, size: 1, head: null}]", "bolts[0].head: must be hex or round"),
        ("bolts: [{name: a, size: 1, turns: [1.5]}]", "turns[0] = 1.5: must be a whole number"),
        (
            "bolts: [{name: a, size: 1, turns: x}]",
            "turns = 'x': must be a list of a whole number or",
        ),
        ("by_place: {top: 1}\nbolts: []", "by_place.top = 1: unknown key; allowed: left, right"),
        ("by_place: {left: {name: a}}\nbolts: []", "by_place.left.size: this key is needed"),
        ("by_place: {left: null}\nbolts: []", "by_place.left: must be {name, size, head, turns}"),
        ("sizes: [1, 2, 1.0]\nbolts: []", "= [1, 2, 1.0]: must be a list of a positive number"),
        ("sizes: [1, 1]\nbolts: []", "a positive number from 1e-30 to 1e30, each once"),
        (
            "sizes: []\nbolts: []",
            "sizes = []: must be a list of a positive number from 1e-30 to 1e30",
        ),
        (
            "bolts: [{name: a, size: 1}, {name: b, size: 1}, {name: c, size: 1}]",
            "bolts[2].name = 'c': there is no third place",
        ),
    ],
)
def test_a_refusal_names_the_innermost_key(text, message):
    with pytest.raises(InputError) as refusal:
        read_as(Box, parse_mapping(text, WHERE), WHERE)
    assert str(refusal.value).startswith("box.yaml: ")
    assert message in str(refusal.value)


@pytest.mark.parametrize("name", TYPES)
def test_the_schemas_are_up_to_date(name):
    assert (FOLDER / f"{name}.schema.json").read_text(encoding="utf-8") == schema_text(name)


@pytest.mark.parametrize("name", TYPES)
def test_the_schema_of_our_own_files_accepts_them(name):
    schema = json.loads(schema_text(name))
    Draft202012Validator.check_schema(schema)
    files = sorted(CASES.glob(FILES[name]))
    assert files
    for file in files:
        assert not list(Draft202012Validator(schema).iter_errors(read_mapping(file))), file
