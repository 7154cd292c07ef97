"""The record of the inf-sup test and the half-loaded block, and where they do not hold."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from ...system.files import write_text
from .description import InfSupLadder
from .half_loaded import PressureProfile

OSCILLATION = 0.15
"""Second difference, over the pressure, that the cut has to stay below; an edge of contact has one
of 0.1 of its own."""
InfSupRecord = tuple[list[InfSupLadder], list[PressureProfile]]


def write_record(
    path: Path, ladders: Sequence[InfSupLadder], profiles: Sequence[PressureProfile]
) -> None:
    """Write what was run as JSON."""
    content = {"ladders": list(map(asdict, ladders)), "profiles": list(map(asdict, profiles))}
    write_text(path, json.dumps(content))


def read_record(path: Path) -> InfSupRecord:
    """Read it back."""
    content = json.loads(path.read_text(encoding="utf-8"))
    ladders = [InfSupLadder(**each) for each in content["ladders"]]
    return ladders, [PressureProfile(**each) for each in content["profiles"]]


def failures(record: InfSupRecord) -> list[str]:
    """The failures of the method with the cut, a line each."""
    ladders, profiles = record
    lines = [
        f"{ladder.name}: {ladder.reason or f'β_h falls with order {ladder.order:.2f}'}"
        for ladder in ladders
        if ladder.reason or (ladder.cut and not ladder.levels_off)
    ]
    return lines + [
        f"half-loaded block, {profile.cells}: the pressure oscillates by {profile.oscillation:.2f}"
        for profile in profiles
        if profile.cut and profile.oscillation > OSCILLATION
    ]
