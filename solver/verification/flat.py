"""Records within records, the flat mapping of keys that files have of them, and strict JSON.

A field with the metadata of `joined` holds a record of its own; the mapping has the keys of that
one beside the others.

>>> from dataclasses import field
>>> @dataclass
... class Reference:
...     kind: str = ""
>>> @dataclass
... class Outcome:
...     word: str
...     reference: Reference = field(metadata=joined(Reference, "reference_"))
>>> flat(Outcome("passed", Reference("exact")))
{'word': 'passed', 'reference_kind': 'exact'}
>>> deep(Outcome, {"word": "passed", "reference_kind": "exact"})
{'word': 'passed', 'reference': {'kind': 'exact'}}
>>> flat_key(Outcome, "reference.kind")
'reference_kind'
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import msgspec
import numpy as np

DIGEST = "digest"
"""The key of the hash of all other ones."""
_KEY = "joined"


@dataclass(frozen=True)
class _Joined:
    kind: Any
    prefix: str


def joined(kind: Any, prefix: str = "") -> dict[str, Any]:
    """The metadata of a field that holds a record of a `kind`, its keys with a `prefix`."""
    return {_KEY: _Joined(kind, prefix)}


def flat(record: Any) -> dict[str, Any]:
    """The mapping of a record; where one that it may hold is missing, its values are None."""
    return _flattened(type(record), asdict(record))


def _flattened(kind: Any, values: Mapping[str, Any] | None) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for one in fields(kind):
        value = None if values is None else values[one.name]
        if inner := one.metadata.get(_KEY):
            for key, item in _flattened(inner.kind, value).items():
                found[inner.prefix + key] = item
        else:
            found[one.name] = value
    return found


def deep(kind: Any, content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Mappings within mappings for the records of a `kind`, without those that have no key."""
    found: dict[str, Any] = {}
    for one in fields(kind):
        if inner := one.metadata.get(_KEY):
            if part := deep(inner.kind, content, prefix + inner.prefix):
                found[one.name] = part
        elif prefix + one.name in content:
            found[one.name] = content[prefix + one.name]
    return found


def flat_key(kind: Any, place: str) -> str:
    """The key of the mapping for a place in the records of a `kind`."""
    name, _, rest = place.partition(".")
    of = {one.name: one.metadata.get(_KEY) for one in fields(kind)}
    inner = of.get(name)
    return place if inner is None else inner.prefix + flat_key(inner.kind, rest)


def plain(content: Any) -> Any:
    """Plain values of content with arrays and NumPy's numbers; what is not finite is None."""
    return msgspec.json.decode(_encoded(content))


def to_json(content: Any) -> str:
    """Strict JSON of plain values, arrays and numbers; numbers that are not finite become null."""
    return msgspec.json.format(_encoded(content), indent=1).decode()


def _encoded(content: Any) -> bytes:
    return msgspec.json.encode(content, enc_hook=_of_numpy)


def _of_numpy(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in JSON")


def digest(content: Mapping[str, Any]) -> str:
    """The hash of plain values, whatever the order of their keys."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
