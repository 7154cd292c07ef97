"""Damaged files, read: each must be refused in one line, fail its checks, or be read correctly."""

import json
import random
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.faults.corpus import Sample, write_corpus
from tests.faults.mutate import damaged

ROOT = Path(__file__).resolve().parents[2]
REFUSED, FAILED, CORRECT = "refused", "failed", "read correctly"


@dataclass(frozen=True)
class Attempt:
    """One damaged file: which, how it was damaged, what came of it, and the line that said so."""

    file: str
    damage: str
    ending: str
    message: str

    @property
    def sound(self) -> bool:
        """Whether it ended as damaged files must."""
        return self.ending in (REFUSED, FAILED, CORRECT)


class Worker:
    """A process that runs commands, started again when one of them killed it."""

    def __init__(self) -> None:
        self.process: subprocess.Popen | None = None

    def run(self, arguments: list[str]) -> dict:
        """The command's outcome; its status is `hang` or `crash` where the process died of it."""
        if self.process is None:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "tests.faults.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                cwd=ROOT,
            )
        self.process.stdin.write(json.dumps(arguments) + "\n")
        self.process.stdin.flush()
        if answer := self.process.stdout.readline():
            return json.loads(answer)
        code = self.process.wait()
        self.process = None
        ending = "hang" if code == -signal.SIGPROF else f"crash ({code})"
        return {"status": ending, "out": "", "err": ""}

    def close(self) -> None:
        """End the process."""
        if self.process:
            self.process.stdin.close()
            self.process.wait()
            self.process.stdout.close()


def fuzz(folder: Path, count: int, seed: int = 0) -> Iterator[Attempt]:
    """Damage `count` files one after the other and read each; what is not sound is kept."""
    samples = write_corpus(folder)
    worker = Worker()
    whole = {s.path: worker.run(_command(s, s.path)) for s in samples}
    assert all(outcome["status"] == 0 for outcome in whole.values()), whole
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        sample = samples[number % len(samples)]
        path = folder / f"damaged{sample.path.suffix}"
        damage = damaged(sample.path, path, rng)
        found = worker.run(_command(sample, path))
        attempt = Attempt(sample.path.name, damage, *_judged(found, whole[sample.path]))
        if not attempt.sound:
            shutil.copy(path, folder / f"kept-{number}{path.suffix}")
        yield attempt
    worker.close()


def _command(sample: Sample, path: Path) -> list[str]:
    return [str(path) if word == "{}" else word for word in sample.command]


def _judged(found: dict, whole: dict) -> tuple[str, str]:
    """How it ended, and the message."""
    status, lines = found["status"], found["err"].splitlines()
    if status in (2, 3):
        one_line = len(lines) == 1 and lines[0].strip()
        return (REFUSED, lines[0]) if one_line else ("not one line", " | ".join(lines))
    if status == 1 and not lines:
        return FAILED, ""
    if status == 0 and not lines:
        # A solve that passes holds an exact solution; a stored result must be the one there was.
        same = not found["out"].startswith("[") or _checks(found) == _checks(whole)
        return (CORRECT, "") if same else ("passed, changed", found["out"])
    return str(status), " ".join(found["err"].split())[-300:]


def _checks(found: dict) -> object:
    return [verdict["checks"] for verdict in json.loads(found["out"])]


def table(attempts: list[Attempt]) -> list[str]:
    """How the attempts ended, file by file, and every one that did not end well."""
    ends = [REFUSED, FAILED, CORRECT, "fault"]
    counts = Counter((a.file, a.ending if a.sound else "fault") for a in attempts)
    lines = [f"{'file':<16}" + "".join(f"{end:>16}" for end in ends)]
    lines += [
        f"{file:<16}" + "".join(f"{counts[file, end]:>16}" for end in ends)
        for file in dict.fromkeys(a.file for a in attempts)
    ]
    sound = sum(a.sound for a in attempts)
    lines.append(f"{sound} of {len(attempts)} damaged files refused, failed or read correctly")
    lines += [
        f"FAULT {a.file}, {a.damage}: {a.ending}: {a.message}" for a in attempts if not a.sound
    ]
    return lines
