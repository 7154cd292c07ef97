"""The keys below `mesh:` and `transform:` of a case file, read with care."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping
from typing import Any

from ..system.errors import InputError

LARGEST = 1e150
"""The largest magnitude of a coordinate or length: the square of twice it is finite."""
_MOST = 100_000  # pieces of an edge


class Keys:
    """The keys of a mapping, read one by one; what is missing, wrong or left over is refused."""

    def __init__(self, values: Mapping[str, Any], where: str, path: str):
        self._values, self._where, self._path = dict(values), where, path
        self._asked: set[str] = set()

    def refuse(self, key: str, value: object, allowed: str) -> InputError:
        """The refusal of a value, naming file, key and what is allowed."""
        return InputError(self._where, f"{self._path}.{key}", value, allowed)

    def _get(self, key: str) -> Any:
        self._asked.add(key)
        return self._values.get(key)

    def given(self, key: str) -> bool:
        """Whether the key is there."""
        self._asked.add(key)
        return key in self._values

    def known(self, key: str, allowed: Collection[str]) -> str:
        """The key itself, out of a list."""
        if key not in allowed:
            self._asked.update(allowed)
            self.finish()
        return key

    def choice(self, key: str, allowed: Collection[str], default: str | None = None) -> str:
        """A word out of a list."""
        value = self._get(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or value not in allowed:
            raise self.refuse(key, value, f"allowed: {', '.join(allowed)}")
        return value

    def text(self, key: str) -> str:
        """A text that is not empty."""
        value = self._get(key)
        if not isinstance(value, str) or not value:
            raise self.refuse(key, value, "must be a name")
        return value

    def numbers(self, key: str, count: int, default: float | None = None) -> list[float]:
        """Positive numbers up to 1e150; a single one stands for all `count` of them."""
        value = self._get(key)
        value = default if value is None else value
        values: list[Any] = value if isinstance(value, list) else [value] * count
        if len(values) != count or not all(_finite(v) and v > 0 for v in values):
            raise self.refuse(key, value, f"must be a positive number{_or_list(count)}")
        return [float(v) for v in values]

    def integers(
        self, key: str, count: int, default: list[int] | None = None, least: int = 1
    ) -> list[int]:
        """Whole numbers from `least` to 100,000; a single one stands for all `count` of them."""
        value = self._get(key)
        value = default if value is None else value
        values: list[Any] = value if isinstance(value, list) else [value] * count
        if len(values) != count or any(
            type(v) is not int or not least <= v <= _MOST for v in values
        ):
            allowed = f"must be a whole number from {least} to {_MOST}{_or_list(count)}"
            raise self.refuse(key, value, allowed)
        return values

    def number(self, key: str) -> float:
        """A number."""
        return self.vector(key, 1)[0]

    def vector(self, key: str, count: int) -> list[float]:
        """A list of numbers; where `count` is 1, a number."""
        value = self._get(key)
        values = [value] if count == 1 else value
        if not isinstance(values, list) or len(values) != count or not all(map(_finite, values)):
            what = "a number" if count == 1 else f"a list of {count} numbers"
            raise self.refuse(key, value, f"must be {what}")
        return [float(v) for v in values]

    def one_or_section(self, key: str, main: str) -> Keys:
        """A mapping of keys below this one, of which the key `main` may stand alone."""
        value = self._get(key)
        if isinstance(value, dict):
            return self.section(key)
        return Keys({main: value}, self._where, f"{self._path}.{key}")

    def section(self, key: str, what: str = "a mapping of keys") -> Keys:
        """A mapping of keys below this one."""
        value = self._get(key)
        if not isinstance(value, dict):
            raise self.refuse(key, value, f"must be {what}")
        return Keys(value, self._where, f"{self._path}.{key}")

    def sections(self, key: str, what: str) -> list[Keys]:
        """One mapping of keys below this one, or a list of them."""
        value = self._get(key)
        if not isinstance(value, list):
            return [self.section(key, what)]
        if not all(isinstance(item, dict) for item in value):
            raise self.refuse(key, value, f"must be {what}, or a list of them")
        return [Keys(v, self._where, f"{self._path}.{key}[{i}]") for i, v in enumerate(value)]

    def finish(self) -> None:
        """Refuse keys that nobody asked for."""
        for key in self._values:
            if key not in self._asked:
                near = difflib.get_close_matches(str(key), self._asked, 1)
                hint = f" (did you mean {near[0]}?)" if near else ""
                allowed = f"unknown key{hint}; allowed: {', '.join(sorted(self._asked))}"
                raise InputError(self._where, f"{self._path}.{key}", None, allowed)


def _finite(value: Any) -> bool:
    """Whether a value is a number of a magnitude that can be squared."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= LARGEST


def _or_list(count: int) -> str:
    return f", or a list of {count}" if count > 1 else ""
