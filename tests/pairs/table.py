"""What goes with what, as a table of the documentation."""

from collections.abc import Iterator, Sequence

from .options import EXCLUDED, OPTIONS, REFUSED, Rule


def lines_of(rules: Sequence[Rule]) -> Iterator[tuple[str, str]]:
    """The values that do not go together, and why."""
    for rule in rules:
        values = (f"{name}: {' or '.join(given)}" for name, given in rule.when.items())
        yield " with ".join(values), rule.why


def markdown() -> str:
    """The options with their values, and what the program refuses, with the keys it names."""
    lines = ["| option | values |", "|---|---|"]
    lines += [f"| {name} | {', '.join(values)} |" for name, values in OPTIONS.items()]
    lines += ["", "| refused together | why | keys that the message names |", "|---|---|---|"]
    for rule, (what, why) in zip(REFUSED, lines_of(REFUSED), strict=True):
        lines.append(f"| {what} | {why} | {', '.join(f'`{key}`' for key in rule.keys)} |")
    lines += ["", "| not tried together | why |", "|---|---|"]
    lines += [f"| {what} | {why} |" for what, why in lines_of(EXCLUDED)]
    return "\n".join(lines) + "\n"
