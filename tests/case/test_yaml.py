"""The strict reader: YAML 1.2's plain values, and a clear line for everything else."""

import json
import os
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
        ("a: 1\nb: 2\na: 3", r"^c.yaml: a: the key is given twice \(line 3\)$"),
        ("a: {b: [{c: 1, c: 2}]}", r"^c.yaml: a.b\[0\].c: the key is given twice"),
        ("a: &x 1", r"^c.yaml: a: anchors and aliases are not allowed"),
        ("a: *x", r"^c.yaml: a: anchors and aliases are not allowed"),
        ("a: !!python/object:os.system 1", r"^c.yaml: a: the tag .* is not allowed"),
        ("a: !!binary aGk=", r"^c.yaml: a: the tag .* is not allowed"),
        ("1: a", r"^c.yaml: line 1: the key 1 is not text: put it in quotes"),
        ("a: {b: 1,5}", r"^c.yaml: a: 1,5 is no number: write 1\.5 \(line 1\)$"),
        ("a: {b: 8,033, c: 1}", r"^c.yaml: a: 8,033 is no number: write 8\.033"),
        ("a: {b: x, 5: y}", r"^c.yaml: a: the key 5 is not text: put it in quotes"),
        ("a: {b:1, c: 2}", r"^c.yaml: a.b:1: write a space after the colon \(line 1\)$"),
        ("a: {b: 1\nc: 2\n", r"^c.yaml: line 2: must be YAML \(.*, from line 1 on\)$"),
        ("a: 'b\nc: 2\n", r"^c.yaml: line \d: must be YAML \(.*, from line 1 on\)$"),
        ("a:\n  b: 1\n   c: 2\n", r"^c.yaml: line 3: must be YAML \("),
        ("a:\n  b: 1\n c: 2\n", r"^c.yaml: line 3: must be YAML \(.*indented unlike the others"),
        ("a:\n  b:1\n  c: 2\n", r"^c.yaml: line \d: must be YAML \("),
        ("a:\n\tb: 1", r"^c.yaml: line 2: a tab indents this line: indent with spaces$"),
        ("a: {[1]: b}", r"^c.yaml: a: a list or mapping cannot be a key"),
        ('a: "x\\0"', r"^c.yaml: a: control characters are not allowed"),
        ("a: 1e999", r"^c.yaml: a: 1e999 is too large a number"),
        ("a: [1, 2", r"^c.yaml: line \d: must be YAML \("),
        ("a: b: c", r"^c.yaml: line 1: must be YAML \("),
        ("a: \x01", r"^c.yaml: file: must be YAML \("),
        ("", r"^c.yaml: file: must be a mapping"),
        ("- 1", r"^c.yaml: file = \[1\]: must be a mapping"),
        ("text", r"^c.yaml: file = 'text': must be a mapping"),
        ("a: 1\n---\nb: 2", r"^c.yaml: file: must hold one document"),
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


@pytest.mark.parametrize("text", ["a: " + "{" * 100_000, "? " * 100_000, "a: " + "[a: " * 100_000])
def test_nested_keys_do_not_exhaust_the_stack(text):
    with pytest.raises(InputError, match=r"mapping cannot be a key|nested deeper than"):
        parse_mapping(text, WHERE)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match=r"none\.yaml: file: cannot be read \(No such file"):
        read_text(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="file: cannot be read"):
        read_text(tmp_path)
    with pytest.raises(InputError, match="file: cannot be read"):
        read_text(Path("a\x00b"))
    os.mkfifo(tmp_path / "fifo.yaml")
    with pytest.raises(InputError, match="file: must be a regular file"):
        read_text(tmp_path / "fifo.yaml")
    (tmp_path / ".#c.yaml").symlink_to("user@host.1234:5678")  # Emacs' lock of a file being edited
    with pytest.raises(InputError, match=r"file: cannot be read \(No such file"):
        read_text(tmp_path / ".#c.yaml")
    with pytest.raises(InputError, match=r"file: cannot be read \(File name too long"):
        read_text(tmp_path / ("a" * 256))
    unnamed = tmp_path / os.fsdecode(b"\xff\n.yaml")
    unnamed.write_bytes(b"name: a")
    with pytest.raises(InputError, match=r"\\udcff\\n\.yaml: file: its name must be UTF-8$"):
        read_text(unnamed)
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
