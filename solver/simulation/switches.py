"""Switches that are all on as a rule, each of which can be turned off to show what it does."""

from dataclasses import dataclass, fields
from typing import Self


@dataclass(frozen=True)
class Switches:
    """Base of a dataclass whose fields are all true by default."""

    @classmethod
    def none(cls) -> Self:
        """All of them off."""
        return cls(**{field.name: False for field in fields(cls)})
