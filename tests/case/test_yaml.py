"""The strict reader: YAML 1.2's plain values, and a clear line for everything else."""

import json
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.case.yaml import MAX_BYTES, MAX_DEPTH, parse_mapping, read_text
from solver.system.errors import InputError

WHERE = Path("c.yaml")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12", 12),
        ("-012", -12),
        ("1e-3", 1e-3),
        ("1.5E+2", 150.0),
        (".5", 0.5),
        ("true", True),
        ("null", None),
        ("~", None),
        ("", None),
        ("'1'", "1"),
        ('"true"', "true"),
        ("no", "no"),
        ("on", "on"),
        ("12:30", "12:30"),
        ("0x10", "0x10"),
        (".nan", ".nan"),
        ("2020-01-01", "2020-01-01"),
        ("25*x", "25*x"),
        ("[1, [a], {b: 2}]", [1, ["a"], {"b": 2}]),
    ],
)
def test_values(text, value):
    found = parse_mapping(f"key: {text}", WHERE)["key"]
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3", r"^c.yaml: line 3: the key a is given twice$"),
        ("a:\n  b: [{c: 1, c: 2}]", r"^c.yaml: line 2: the key c is given twice"),
        ("a: &x 1", r"^c.yaml: line 1: anchors and aliases are not allowed"),
        ("a: *x", r"^c.yaml: line 1: anchors and aliases are not allowed"),
        ("a: !!python/object:os.system 1", r"^c.yaml: line 1: the tag .* is not allowed"),
        ("a: !!binary aGk=", r"^c.yaml: line 1: the tag .* is not allowed"),
        ("1: a", r"^c.yaml: line 1: a key is not text: put it in quotes"),
        ("a: {b: 1,5}", r"^c.yaml: line 1: a key is not text"),
        ("a: {[1]: b}", r"^c.yaml: line 1: a key is not text"),
        ("a: {b: 1\nc: 2\n", r"^c.yaml: line 2: must be YAML \(while parsing a flow mapping, "),
        ("a:\n  b: 1\n   c: 2\n", r"^c.yaml: line 3: must be YAML \("),
        ("a:\n\tb: 1", r"^c.yaml: line 2: must be YAML \(.*cannot start any token"),
        ("a: [1, 2", r"^c.yaml: line \d: must be YAML \("),
        ("a: b: c", r"^c.yaml: line 1: must be YAML \(mapping values are not allowed"),
        ("a: 1e999", r"^c.yaml: line 1: 1e999 is too large a number"),
        ("a: \x01", r"^c.yaml: file: must be YAML \("),
        ("", r"^c.yaml: file: must be a mapping"),
        ("- 1", r"^c.yaml: file = \[1\]: must be a mapping"),
        ("text", r"^c.yaml: file = 'text': must be a mapping"),
        ("a: 1\n---\nb: 2", r"^c.yaml: line 2: the file must hold one document"),
    ],
)
def test_refusals_name_the_place(text, message):
    with pytest.raises(InputError, match=message):
        parse_mapping(text, WHERE)


def test_depth_is_limited():
    with pytest.raises(InputError, match=f"nested deeper than {MAX_DEPTH} levels"):
        parse_mapping("a: " + "[" * 30 + "]" * 30, WHERE)
    with pytest.raises(InputError):
        parse_mapping("a: " + "[" * 100_000, WHERE)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match=r"none\.yaml: file: cannot be read \(No such file"):
        read_text(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="file: must be a regular file"):
        read_text(tmp_path)
    with pytest.raises(InputError, match=r"file: cannot be read \(File name too long"):
        read_text(tmp_path / ("a" * 256))
    file = tmp_path / "c.yaml"
    file.write_bytes(b"name: \xff")
    with pytest.raises(InputError, match=r"file: must be UTF-8 text \(byte 6 is not UTF-8\)"):
        read_text(file)
    file.write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(InputError, match=f"file: larger than {MAX_BYTES} bytes"):
        read_text(file)


def test_byte_order_mark_is_no_part_of_the_text(tmp_path):
    file = tmp_path / "c.yaml"
    file.write_bytes(b"\xef\xbb\xbfname: a")
    assert parse_mapping(read_text(file), file) == {"name": "a"}


TEXT = st.text(st.characters(max_codepoint=0x17F, exclude_categories=["C"]), max_size=20)
PLAIN = st.none() | st.booleans() | st.integers() | TEXT
PLAIN |= st.floats(allow_nan=False, allow_infinity=False)
NESTED = st.recursive(PLAIN, lambda v: st.lists(v) | st.dictionaries(TEXT, v), max_leaves=10)


@given(st.dictionaries(TEXT, NESTED))
def test_json_is_yaml(content):
    assert parse_mapping(json.dumps(content, ensure_ascii=False), WHERE) == content


@given(st.text(max_size=60) | st.text("a:[]{}-&*!|>'\"%@#,? \n1.e", max_size=60))
def test_any_text_is_a_mapping_or_refused(text):
    with suppress(InputError):
        assert isinstance(parse_mapping(text, WHERE), dict)
