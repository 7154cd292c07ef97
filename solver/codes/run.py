"""Runs another code on a case, in a process of its own with a limit of time and of memory."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..system.errors import SolveError
from ..system.process import cores_for, run_apart
from .deck import Deck
from .foreign import ForeignResult
from .registry import Code


class CrashError(Exception):
    """The process of a code died, or came to no end in time."""


@dataclass(frozen=True)
class Limits:
    """What a process may take: seconds, memory (bytes), and the cores that it is pinned to."""

    seconds: float = 120.0
    memory: float = 4e9
    cores: Sequence[int] = field(default_factory=lambda: cores_for(1))


def run_code(code: Code, deck: Deck, folder: Path, limits: Limits) -> ForeignResult:
    """Write the input into `folder`, run the code there, read what it found.

    What it prints is in `folder/log`. Raises UnsupportedError for what the code cannot express,
    CrashError where its process dies or is stopped, SolveError where it does not converge or what
    it wrote cannot be read.
    """
    code.write(deck, folder)
    ended = run_apart(code.command(folder), limits.cores, limits.seconds, limits.memory, folder)
    said = ended.output + ended.complaint
    (folder / "log").write_text(said, encoding="utf-8")
    if ended.status is None:
        raise CrashError(ended.reason)
    if found := code.gave_up and re.search(code.gave_up, said):
        raise SolveError(f"no convergence: {' '.join(found[0].split())}")
    if ended.status:
        raise CrashError(ended.reason)
    return replace(
        code.read(deck, folder),
        settings=code.settings,
        seconds=ended.wall,
        cpu_seconds=ended.cpu,
        peak_memory_mb=ended.peak_memory_mb,
    )
