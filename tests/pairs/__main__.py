"""Solve the covering array and write what goes with what: `make pairs`.

STRENGTH=3 takes every three options instead of every two.
"""

import os
import sys
import time
from pathlib import Path

import yaml

from tests.arguments import whole

from .array import PAIRS, covering, smallest, store, stored
from .judge import Outcome, tried
from .options import Row
from .page import page
from .problem import problem_of

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    """Solve all rows; the page, and each failure reduced."""
    started = time.monotonic()
    strength = whole("STRENGTH", os.environ.get("STRENGTH", str(PAIRS)), PAIRS, PAIRS + 1)
    rows = stored() if strength == PAIRS else covering(strength)
    if not rows:
        store(rows := covering(strength))
    print(f"{len(rows)} cases for every {strength} options", flush=True)
    outcomes = []
    for row in rows:
        outcomes.append((row, tried(row)))
        if outcomes[-1][1].word != "exact":
            told(*outcomes[-1])
    seconds = time.monotonic() - started
    wrong = sum(outcome.word != "exact" for _, outcome in outcomes)
    said = f"{len(rows) - wrong} of {len(rows)} cases exact, {seconds:.0f} s"
    target = ROOT / "results/report/pairs.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    page(target, outcomes, said, wrong == 0)
    print(f"{said}. Page: {target.relative_to(ROOT)}")
    return int(wrong > 0)


def told(row: Row, outcome: Outcome) -> None:
    """Print a row that is not exact as the smallest case that still is not, in YAML."""
    small = smallest(row, lambda other: tried(other).word == outcome.word)
    found = tried(small)
    print(f"{found.word}: {found.what}, error {found.error:.1e}\n{yaml.safe_dump(small)}")
    try:
        print(yaml.safe_dump(problem_of(small).text, sort_keys=False), flush=True)
    except Exception as error:  # noqa: BLE001
        print(f"no case: {error}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
