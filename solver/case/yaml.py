"""YAML read strictly: one mapping of plain values, nothing that two readers could take differently.

PyYAML's parser gives the events; the values are put together here, which keeps out aliases, tags,
duplicate keys and deep nesting, and reads `no`, `on`, `12:30` and `1e-3` as YAML 1.2 does.
"""

import math
import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from ..system.errors import InputError, key_path

MAX_BYTES = 1_000_000
MAX_DEPTH = 20

Keys = tuple[str | int, ...]

_INTEGER = re.compile(r"[-+]?[0-9]{1,300}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")
_WORDS = {"": None, "~": None, "null": None, "true": True, "false": False}


def read_text(path: Path) -> str:
    """The text of a regular file of at most 1 MB in UTF-8; raises `InputError` for any other."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise InputError(path, "file", None, "its name must be UTF-8") from None
    try:
        # Opened without waiting: a FIFO has no writer.
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as stream:
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                raise InputError(path, "file", None, "must be a regular file")
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(path, "file", None, f"cannot be read ({reason})") from None
    if len(data) > MAX_BYTES:
        raise InputError(path, "file", None, f"larger than {MAX_BYTES} bytes")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = f"byte {error.start} is not UTF-8"
        raise InputError(path, "file", None, f"must be UTF-8 text ({place})") from None


def parse_mapping(text: str, where: Path) -> dict[str, Any]:
    """The mapping in a YAML text.

    Raises `InputError`, under the name `where`, for a text that is not one mapping, or holds an
    alias, a tag, a duplicate key or a number that is not finite.
    """
    try:
        content = _Builder(where, text).document()
    except yaml.YAMLError as error:
        raise InputError(where, *_place(error, text)) from None
    if not isinstance(content, dict):
        raise InputError(where, "file", content, "must be a mapping of keys to values")
    return content


def read_mapping(path: Path) -> dict[str, Any]:
    """The mapping in a file; `InputError` says what is refused."""
    return parse_mapping(read_text(path), path)


def _place(error: yaml.YAMLError, text: str) -> tuple[str, None, str]:
    """Key, value and remedy for a text that is no YAML."""
    mark = getattr(error, "problem_mark", None)
    reason = getattr(error, "problem", None) or getattr(error, "reason", None) or "syntax error"
    if mark is None:
        return "file", None, f"must be YAML ({reason})"
    line = (text.splitlines() or [""])[min(mark.line, len(text.splitlines()) - 1)]
    if "\t" in line[: len(line) - len(line.lstrip())]:
        return f"line {mark.line + 1}", None, "a tab indents this line: indent with spaces"
    context = getattr(error, "context", None) or ""
    begun = getattr(error, "context_mark", None) or mark
    if "simple key" in context:  # the parser goes on to the next line
        return f"line {begun.line + 1}", None, "must be YAML (a key without a colon and a space)"
    if "mapping values" in reason:
        reason += ": indent the line like its neighbours; quote a text with a colon"
    if "flow" in context or "quoted" in context:
        reason += f", from line {begun.line + 1} on"
    elif "block" in context:
        reason += ": is this line, or one before, indented unlike the others?"
    return f"line {mark.line + 1}", None, f"must be YAML ({reason})"


def _not_text(key: object, text: str, items: dict) -> str:
    """Why a key is refused that is not text, given its text and the items before it."""
    before = [None, *items.values()][-1]
    if isinstance(key, int) and type(before) is int:
        return f"{before},{text} is no number: write {before}.{text}"
    return f"the key {key!r} is not text: put it in quotes"


class _Builder:
    """Puts the values of one document together from the parser's events."""

    def __init__(self, path: Path, text: str):
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        self.path = path
        self.events: Iterator[yaml.Event] = yaml.parse(text, Loader=loader)

    def document(self) -> object:
        next(self.events)  # the stream's start
        if isinstance(next(self.events), yaml.StreamEndEvent):
            return None
        content = self.value(next(self.events), ())
        next(self.events)  # the document's end
        if not isinstance(next(self.events), yaml.StreamEndEvent):
            raise InputError(self.path, "file", None, "must hold one document, without `---`")
        return content

    def value(self, event: yaml.Event, keys: Keys) -> object:
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
            raise self.error(keys, event, "anchors and aliases are not allowed: write it out")
        tag = getattr(event, "tag", None)
        if tag is not None:
            raise self.error(keys, event, f"the tag {tag} is not allowed")
        if len(keys) > MAX_DEPTH:
            raise self.error(keys[:4], event, f"nested deeper than {MAX_DEPTH} levels")
        if isinstance(event, yaml.ScalarEvent):
            return self.scalar(event, keys)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(keys)
        return self.mapping(keys)

    def sequence(self, keys: Keys) -> list:
        items: list = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self.value(event, (*keys, len(items))))
        return items

    def mapping(self, keys: Keys) -> dict:
        items: dict = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if isinstance(event, yaml.CollectionStartEvent):
                raise self.error(keys, event, "a list or mapping cannot be a key")
            key = self.value(event, keys)
            if not isinstance(key, str):
                raise self.error(keys, event, _not_text(key, getattr(event, "value", ""), items))
            if key in items:
                raise self.error((*keys, key), event, "the key is given twice")
            items[key] = self.value(next(self.events), (*keys, key))
            if items[key] is None and ":" in key and getattr(event, "implicit", [False])[0]:
                raise self.error((*keys, key), event, "write a space after the colon")
        return items

    def scalar(self, event: yaml.ScalarEvent, keys: Keys) -> object:
        text = event.value
        if _CONTROL.search(text):
            raise self.error(keys, event, "control characters are not allowed")
        if not event.implicit[0]:  # quoted
            return text
        if text.lower() in _WORDS:
            return _WORDS[text.lower()]
        if _INTEGER.fullmatch(text):
            return int(text)
        if _FLOAT.fullmatch(text):
            if not math.isfinite(float(text)):
                raise self.error(keys, event, f"{text[:40]} is too large a number")
            return float(text)
        return text

    def error(self, keys: Keys, event: yaml.Event, allowed: str) -> InputError:
        line = f"line {event.start_mark.line + 1}" if event.start_mark else "somewhere"
        return InputError(self.path, key_path(keys) or line, None, f"{allowed} ({line})")
