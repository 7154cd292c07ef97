"""Every refusal in the sources, found by their syntax: the table of `docs/design/refusals.md`.

`python -m tests.faults.refusals` prints the page.
"""

import ast
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_RAISED = {
    "InputError",
    "FieldError",
    "MachineError",
    "SolveError",
    "error",
    "_error",
    "_no_result",
    "_refused",
}

HEAD = """\
# Refusals

This page lists every message that refuses input or gives up a solve, by module. `…` stands for
the parts that vary. A message is one line. It starts with the file and usually the key and its
value. The exit status is 2 for input and 3 for a solve. If a key of a case file is invalid, the
message describes the allowed values by the type of the key (`solver/case/file.py`).

`python -m tests.faults.refusals` generates the table from the sources; a test compares both.

| module | message |
|---|---|
"""


@dataclass(frozen=True)
class Refusal:
    """A message in its module; `parts` are its fixed pieces of text."""

    module: str
    parts: tuple[str, ...]

    @property
    def message(self) -> str:
        """The message, `…` for what changes."""
        return " ".join("…".join(self.parts).split())


def refusals() -> list[Refusal]:
    """All refusals of the solver, in the order of modules and lines."""
    found: dict[Refusal, None] = {}
    for path in sorted((ROOT / "solver").rglob("*.py")):
        module = str(path.relative_to(ROOT))
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                found |= {Refusal(module, parts): None for parts in _messages(function)}
    return list(found)


def _messages(function: ast.FunctionDef) -> list[tuple[str, ...]]:
    messages = []
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and _name(node.func) in _RAISED and node.args:
            last = node.args[-1]
            parts = _parts(_assigned(function, last) if isinstance(last, ast.Name) else last)
            if any(len(part.strip()) > 3 for part in parts):
                messages.append(parts)
    return messages


def _assigned(function: ast.FunctionDef, name: ast.Name) -> ast.expr:
    """What a name was last given before the line that uses it."""
    given = [
        (node.lineno, node.value)
        for node in ast.walk(function)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name) and target.id == name.id and node.lineno < name.lineno
    ]
    return max(given, key=lambda found: found[0], default=(0, name))[1]


def _name(function: ast.expr) -> str:
    return getattr(function, "attr", getattr(function, "id", ""))


def _parts(text: ast.expr) -> tuple[str, ...]:
    """The fixed pieces of a text or of a formatted one, between what changes."""
    if isinstance(text, ast.Constant) and isinstance(text.value, str):
        return (text.value,)
    if isinstance(text, ast.JoinedStr):
        pieces = [""]
        for value in text.values:
            if isinstance(value, ast.Constant):
                pieces[-1] += str(value.value)
            else:
                pieces.append("")
        return tuple(pieces)
    return ()


def page() -> str:
    """The page of all refusals."""
    rows = [f"| `{r.module}` | {r.message.replace('|', '∣')} |" for r in refusals()]
    return HEAD + "\n".join(rows) + "\n"


if __name__ == "__main__":
    print(page(), end="")
