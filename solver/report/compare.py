"""Two batches side by side, as Markdown.

Verdicts, numbers and times differ. A number has changed when it moved by more than accepted values
may: 1e-9 of the check's scale. What round-off does is no change. Times are shown and never judged.
"""

import json
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from ..case.checks import ROUND_OFF
from ..system.errors import InputError, hint
from ..verification.stored import typed_list
from ..verification.verdict import WORDS, CheckResult
from . import formats
from .rows import Row, natural
from .tables import md, outcome

SUMMARY = "summary.json"
# The name of our own solver beside the names of codes.
OURS = "ours"
_COUNTS = {
    "dofs": "unknowns",
    "macro_elements": "macro-elements",
    "iterations": "iterations",
    "linear_solver": "linear solver",
}


@dataclass(frozen=True)
class Batch:
    """A batch: its summary.json, and its rows by family and name."""

    file: Path
    rows: Mapping[tuple[str, str], Row]

    @property
    def outcome(self) -> str:
        """How many solves passed."""
        return outcome(list(self.rows.values()))

    @property
    def origin(self) -> str:
        """Revision and machine, if the solves have them."""
        found = [row.verdict.files.provenance for row in self.rows.values()]
        values = [sorted({str(o[k]) for o in found if o.get(k)}) for k in ("revision", "cpu")]
        return "; ".join(", ".join(each) for each in values if each)


@dataclass(frozen=True)
class Change:
    """A quantity of a solve that has changed; `size` is relative, None where there is no number."""

    solve: str
    quantity: str
    base: str
    this: str
    size: float | None

    @property
    def cells(self) -> tuple[str, ...]:
        """A row of a table."""
        return self.solve, self.quantity, self.base, self.this, formats.error(self.size)


@dataclass(frozen=True)
class Pair:
    """A solve in both batches, or in one of them."""

    base: Row | None
    this: Row | None

    @property
    def row(self) -> Row:
        """The solve as it is now, or as it was where it vanished."""
        row = self.this or self.base
        assert row is not None
        return row

    @property
    def name(self) -> str:
        """Family and name."""
        if self.base and self.this and self.base.name != self.this.name:
            return f"{self.row.group}/{self.row.case}"
        return self.row.anchor

    @property
    def step(self) -> int:
        """How much worse the verdict is than before: negative where better.

        A solve that was not there counts as one that had passed; one that vanished has no verdict.
        """
        if self.this is None:
            return 0
        before = self.base.word if self.base else self.this.word if self.this.sound else "passed"
        return WORDS.index(before) - WORDS.index(self.this.word)

    @property
    def change(self) -> str:
        """Change of the verdict: worse, better, still (not passed), new, vanished, or ""."""
        if self.this is None:
            return "vanished"
        if self.step:
            return "worse" if self.step > 0 else "better"
        return "still" if not self.this.sound else "new" if self.base is None else ""

    @property
    def words(self) -> str:
        """The verdicts, before and now."""
        words = [row.word if row else "not there" for row in (self.base, self.this)]
        return " → ".join(dict.fromkeys(words))


@dataclass(frozen=True)
class Comparison:
    """Two batches side by side."""

    base: Batch
    this: Batch

    @cached_property
    def pairs(self) -> list[Pair]:
        """All solves of either batch, in the order of their names."""
        names = sorted({*self.base.rows, *self.this.rows}, key=lambda n: (n[0], natural(n[1])))
        return [Pair(self.base.rows.get(name), self.this.rows.get(name)) for name in names]

    @cached_property
    def groups(self) -> dict[str, list[Pair]]:
        """The solves by the change of their verdict (`Pair.change`), worst verdicts first."""
        found: dict[str, list[Pair]] = defaultdict(list)
        for pair in self.pairs:
            found[pair.change].append(pair)
        found["worse"].sort(key=lambda pair: WORDS.index(pair.row.word))
        return found

    @cached_property
    def changes(self) -> list[Change]:
        """Changes in solves that both have: those without a number first, then by size."""
        found = [change for base, this in self._solved for change in _changes(base, this)]
        return sorted(found, key=lambda c: (c.size is not None, -(c.size or 0)))

    @property
    def times(self) -> str:
        """Wall and processor time of the solves that both have, in words."""
        told = []
        for rows in zip(*self._solved, strict=True):
            wall = formats.seconds(sum(row.total or 0.0 for row in rows))
            processor = formats.seconds(sum(row.verdict.cost.cpu_seconds or 0.0 for row in rows))
            told.append(f"wall time {wall}, processor time {processor}")
        return f"{len(self._solved)} solves in both: {', before; '.join(told)} now."

    @cached_property
    def _solved(self) -> list[tuple[Row, Row]]:
        """The rows of the solves that came to their end in both batches."""
        both = [(pair.base, pair.this) for pair in self.pairs if pair.base and pair.this]
        return [(base, this) for base, this in both if base.total and this.total]


def read_batch(path: Path) -> Batch:
    """A batch, by its folder of results, the folder of its report, or its summary.json.

    `FOLDER@CODE` is what one code has in it, `FOLDER@ours` what our solver has; the solves go by
    the names of their cases then. Raises `InputError` where the file is missing or is not what
    a report writes.
    """
    code = ""
    if not path.exists() and "@" in path.name:
        name, _, code = path.name.partition("@")
        path = path.with_name(name)
    candidates = (path / "report" / SUMMARY, path / SUMMARY) if path.is_dir() else (path,)
    file = next((each for each in candidates if each.is_file()), None)
    if file is None:
        allowed = f"must be a folder of results with a report, or its {SUMMARY}"
        raise InputError(path, "batch", None, allowed)
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(file, "file", None, f"must be JSON ({error})") from None
    verdicts = typed_list(content, file)
    rows = [Row(verdict, file.parent.parent / verdict.problem.family) for verdict in verdicts]
    if not code:
        return Batch(file, {(row.group, row.name): row for row in rows})
    mine = [row for row in rows if (row.verdict.foreign.code or OURS) == code]
    if not mine:
        there = {row.verdict.foreign.code or OURS for row in rows}
        raise InputError(path, "code", code, f"it has no result there; {hint(code, there)}")
    return Batch(file, {(row.group, row.case): row for row in mine})


def _changes(base: Row, this: Row) -> Iterator[Change]:
    solve = this.anchor
    alike = base.verdict.foreign.code == this.verdict.foreign.code
    for key, name in _COUNTS.items() if alike else ():
        before, now = (getattr(row.verdict.cost, key) for row in (base, this))
        if before != now:
            yield Change(solve, name, _text(before), _text(now), None)
    checks = [{c.title: c for c in row.verdict.checks} for row in (base, this)]
    norms = {**base.norms, **this.norms}
    if not alike:  # what only one code has is no change, nor is a tolerance of its own
        both = checks[0].keys() & checks[1].keys()
        checks = [{t: replace(of[t], tolerance=0.0) for t in of if t in both} for of in checks]
        norms = {name: norms[name] for name in base.norms if name in this.norms}
    yield from _checks(solve, *checks)
    for name in norms:
        yield from _number(solve, f"error {name}", base.norms.get(name), this.norms.get(name))


def _checks(
    solve: str, base: Mapping[str, CheckResult], this: Mapping[str, CheckResult]
) -> Iterator[Change]:
    for title in {**base, **this}:
        if title not in base or title not in this:
            before, now = ("there" if title in side else "not there" for side in (base, this))
            yield Change(solve, title, before, now, None)
            continue
        old, new = base[title], this[title]
        scale = 1.0 if math.isnan(old.scale) else old.scale or 1.0
        for key, by in (("minimum", scale), ("maximum", scale), ("error", 1.0), ("tolerance", 1.0)):
            yield from _number(solve, f"{title}: {key}", getattr(old, key), getattr(new, key), by)


def _number(
    solve: str, quantity: str, base: float | None, this: float | None, scale: float = 1.0
) -> Iterator[Change]:
    """The change of a number, if it is one."""
    known = [value is not None and not math.isnan(value) for value in (base, this)]
    if base is None or this is None or not all(known):
        if any(known):
            yield Change(solve, quantity, _text(base), _text(this), None)
    elif abs(this - base) > ROUND_OFF * abs(scale):
        size = abs((this - base) / scale)
        yield Change(solve, quantity, _text(base), _text(this), size)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return formats.digits(value)
    return formats.NOTHING if value is None else str(value)


CHANGES = ("solve", "quantity", "before", "now", "change")
# By the change of a verdict: the words of the outcome, and the heading of the list.
SAID = {
    "worse": "got worse",
    "better": "got better",
    "still": "did not pass before either",
    "new": "new",
    "vanished": "vanished",
}
HEADINGS = {
    "worse": "Worse than before",
    "still": "Not passed, as before",
    "better": "Better than before",
    "new": "New, and passed",
    "vanished": "No longer there",
}
# Rows of a table, where not all are asked for.
_MOST = 40


def verdict(found: Comparison) -> str:
    """The comparison in one line."""
    words = ", ".join(
        f"{len(pairs)} {said}" for key, said in SAID.items() if (pairs := found.groups[key])
    )
    solves = len({change.solve for change in found.changes})
    numbers = f"numbers changed in {solves} of them" if solves else "no number changed"
    return f"{len(found.pairs)} solves: {words or 'no verdict changed'}; {numbers}."


def sections(found: Comparison) -> dict[str, list[Pair]]:
    """The solves with a verdict to report, by heading, new failures first."""
    return {title: pairs for key, title in HEADINGS.items() if (pairs := found.groups[key])}


def to_markdown(found: Comparison, whole: bool = False) -> str:
    """Verdicts and numbers as Markdown; `whole`: all of them."""
    most = None if whole else _MOST
    parts = [f"# Two batches\n\n{verdict(found)}\n"]
    for name, batch in (("Before", found.base), ("Now", found.this)):
        parts.append(f"- {name}: `{batch.file}`, {md(batch.outcome)} {md(batch.origin)}")
    parts.append(f"- {found.times}")
    for heading, pairs in sections(found).items():
        changed = [(pair.name, pair.words, pair.row.why) for pair in pairs]
        parts += [f"\n## {heading}\n", *_table(("solve", "verdict", "reason"), changed, most)]
    if found.changes:
        rows = [change.cells for change in found.changes]
        parts += ["\n## Numbers\n", *_table(CHANGES, rows, most)]
    return "\n".join(parts) + "\n"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], most: int | None) -> list[str]:
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    lines += ["| " + " | ".join(map(md, row)) + " |" for row in rows[:most]]
    left = len(rows) - len(rows[:most])
    return lines + [f"\n… and {left} more: `--all` lists them."] * (left > 0)
