"""Two batches side by side: Markdown for the terminal, and a page in the style of the report's."""

from collections.abc import Sequence
from pathlib import Path

from ..system.files import write_text
from .differences import Comparison, Pair, read_batch
from .html import TEMPLATES, render
from .tables import md

PAGE = "compare.html"
CHANGES = ("solve", "quantity", "before", "now", "change")
TIMES = ("before", "now", "ratio")
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
# Rows of a table in Markdown; the page has them all.
_MOST = 40


def compare(base: Path, this: Path, page: Path | None = None) -> tuple[Comparison, str]:
    """Compare two batches: write the page, by default into the report of `this`; also as Markdown.

    Raises `InputError` for what is no batch.
    """
    found = Comparison(read_batch(base), read_batch(this))
    page = page or found.this.file.with_name(PAGE)
    write_text(page, to_html(found))
    return found, f"{to_markdown(found)}\nReport: {page}"


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


def to_markdown(found: Comparison) -> str:
    """Verdicts, numbers and times as Markdown."""
    parts = [f"# Two batches\n\n{verdict(found)}\n"]
    for name, batch in (("Before", found.base), ("Now", found.this)):
        parts.append(f"- {name}: `{batch.file}`, {md(batch.outcome)} {md(batch.origin)}")
    for heading, pairs in sections(found).items():
        changed = [(pair.name, pair.words, pair.row.why) for pair in pairs]
        parts += [f"\n## {heading}\n", *_table(("solve", "verdict", "reason"), changed)]
    if found.changes:
        rows = [change.cells for change in found.changes]
        parts += ["\n## Numbers\n", *_table(CHANGES, rows)]
    parts += ["\n## Times\n", *_table(("stage", *TIMES), [t.cells for t in found.stages])]
    if found.solves:
        parts += ["", *_table(("solve", *TIMES), [t.cells for t in found.solves])]
    return "\n".join(parts) + "\n"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    lines += ["| " + " | ".join(map(md, row)) + " |" for row in rows[:_MOST]]
    return lines + [f"\n… and {len(rows) - _MOST} more."] * (len(rows) > _MOST)


def to_html(found: Comparison) -> str:
    """The page."""
    named = {"Before": found.base, "Now": found.this}
    return render(
        TEMPLATES / "compare.html.jinja",
        title="Two batches side by side",
        sortable=True,
        good=not found.groups["worse"],
        facts=[(n, f"{b.file}: {b.outcome} {b.origin}") for n, b in named.items()],
        found=found,
        outcome=verdict(found),
        sections=sections(found),
        changes=CHANGES,
        times=TIMES,
    )
