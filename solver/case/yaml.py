"""YAML read strictly: one mapping of plain values, nothing that two readers could take differently.

There are no aliases, tags and duplicate keys; `no`, `on`, `12:30` and `1e-3` are what YAML 1.2 has
them be: text, text, text and a number.
"""

import math
import re
from pathlib import Path
from typing import Any

import yaml

from ..system.errors import InputError

MAX_BYTES = 1_000_000
MAX_DEPTH = 20
_TAG = "tag:yaml.org,2002:"
_RESOLVED = {
    "int": r"[-+]?[0-9]{1,300}$",
    "float": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$",
    "bool": r"(?i:true|false)$",
    "null": r"(?i:~|null|)$",
}


def read_text(path: Path) -> str:
    """The text of a file of at most 1 MB in UTF-8; raises `InputError` for any other."""
    try:
        if path.exists() and not path.is_file():
            raise InputError(path, "file", None, "must be a regular file")
        data = path.read_bytes()
        if len(data) > MAX_BYTES:
            raise InputError(path, "file", None, f"larger than {MAX_BYTES} bytes")
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = f"byte {error.start} is not UTF-8"
        raise InputError(path, "file", None, f"must be UTF-8 text ({place})") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(path, "file", None, f"cannot be read ({reason})") from None


def parse_mapping(text: str, where: Path) -> dict[str, Any]:
    """The mapping in a YAML text.

    Raises `InputError`, under the name `where`, for a text that is not one mapping, or holds an
    alias, a tag, a duplicate key, a number that is not finite or half of a surrogate pair.
    """
    try:
        _refuse_markup(text)
        content = yaml.load(text, _Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}" if mark else "file"
        reason = getattr(error, "problem", None) or getattr(error, "reason", None) or "syntax"
        if not isinstance(error, yaml.constructor.ConstructorError):
            context = getattr(error, "context", None)
            reason = f"must be YAML ({f'{context}, ' if context else ''}{reason})"
        raise InputError(where, line, None, reason) from None
    except UnicodeEncodeError as error:
        allowed = "must have characters that UTF-8 can write"
        raise InputError(where, "text", text[error.start], allowed) from None
    if not isinstance(content, dict):
        raise InputError(where, "file", content, "must be a mapping of keys to values")
    return content


def read_mapping(path: Path) -> dict[str, Any]:
    """The mapping in a file; `InputError` says what is refused."""
    return parse_mapping(read_text(path), path)


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Makes mappings of text to lists, mappings, text, numbers, true, false and null."""

    yaml_implicit_resolvers: dict = {}  # noqa: RUF012 -- PyYAML's name for its own table

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """As PyYAML does it, but keys are text and differ."""
        seen = set()
        for key, _ in node.value:
            if key.tag != f"{_TAG}str":
                raise _problem("a key is not text: put it in quotes", key)
            if key.value in seen:
                raise _problem(f"the key {key.value} is given twice", key)
            seen.add(key.value)
        found: dict[Any, Any] = super().construct_mapping(node, deep)
        return found


def _finite(_: _Loader, node: yaml.ScalarNode) -> float:
    if not math.isfinite(value := float(node.value)):
        raise _problem(f"{node.value[:40]} is too large a number", node)
    return value


for _name, _pattern in _RESOLVED.items():
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(_pattern), None)
_Loader.add_constructor(f"{_TAG}int", lambda _, node: int(node.value))
_Loader.add_constructor(f"{_TAG}float", _finite)
_Loader.add_constructor(f"{_TAG}bool", lambda _, node: node.value.lower() == "true")


def _refuse_markup(text: str) -> None:
    """Raise YAMLError for aliases, anchors, tags, deep nesting and a second document."""
    depth = documents = 0
    for event in yaml.parse(text, Loader=_Loader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        documents += isinstance(event, yaml.DocumentStartEvent)
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise _problem("anchors and aliases are not allowed: write it out", event)
        if tag := getattr(event, "tag", None):
            raise _problem(f"the tag {tag} is not allowed", event)
        if depth > MAX_DEPTH:
            raise _problem(f"nested deeper than {MAX_DEPTH} levels", event)
        if documents > 1:
            raise _problem("the file must hold one document, without `---`", event)


def _problem(text: str, at: yaml.Event | yaml.Node) -> yaml.YAMLError:
    mark: Any = at.start_mark
    return yaml.constructor.ConstructorError(None, None, text, mark)
