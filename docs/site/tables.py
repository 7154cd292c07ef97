"""Tables of the pages that are made from the sources: `python docs/site/tables.py` writes them.

A page has a link to one, alone on its line; the site has the table in its place.
"""

from collections.abc import Iterator, Sequence
from dataclasses import MISSING, fields
from importlib import import_module
from inspect import getdoc
from pathlib import Path
from typing import Any, get_args, get_origin

from msgspec import NODEFAULT

from solver.case.checks import CHECKS, RELATIVE, Check
from solver.case.file import CaseFile
from solver.case.solutions.catalogue import SOLUTIONS
from solver.case.typed import Section, described, is_section, titles_of
from solver.case.typed import fields as keys_of
from solver.verification.checks import SCALES
from tests.pairs.table import markdown

_RECIPES = ("solver.mesh.recipes.blocks", "solver.mesh.recipes.mapped")


def case_keys() -> str:
    """Every key of a case file: what it is, what is allowed, its default."""
    return _table(("key", "what it is", "allowed", "default"), list(_keys(CaseFile, "")))


def _keys(kind: type[Section], path: str) -> Iterator[tuple[str, ...]]:
    """The rows of a class of keys, and of those inside."""
    for name, title in titles_of(kind).items():
        field, here = keys_of(kind)[name], f"{path}.{name}".lstrip(".")
        default = "needed" if field.required else _default(field.default)
        yield f"`{here}`", title, described(field.type), default
        yield from _inside(field.type, here)


def _inside(kind: Any, path: str) -> Iterator[tuple[str, ...]]:
    if is_section(kind):
        yield from _keys(kind, path)
    ending = {tuple: "[]", dict: ".*"}.get(get_origin(kind), "")
    for part in get_args(kind):
        yield from _inside(part, path + ending)


def _default(value: Any) -> str:
    if value in (NODEFAULT, None, "", ()):
        return ""
    return f"`{list(value) if isinstance(value, tuple) else value}`"


def checks() -> str:
    """Every check but the norms of errors, which the page explains."""
    head = ("check", "of what", "fed by", "tolerance", "relative to")
    return _table(head, [_check(check) for check in CHECKS if check.norm == "max"])


def _check(check: Check) -> tuple[str, ...]:
    scale = (getdoc(SCALES[check.scale]) or "").split("\n\n")[0].rstrip(".").lower()
    return (
        f"`{check.name}`" + (f"<br>{check.alias}" if check.alias else ""),
        check.what,
        f"`{check.key}`" if check.key else "always run",
        f"{RELATIVE:g}, or `tolerance`" if check.tolerance is None else f"{check.tolerance:g}",
        scale if check.fixed else f"the reference, or {scale}",
    )


def solutions() -> str:
    """Every exact solution: what it says of itself, what is known, its parameters."""
    # By module: they are registered in the order in which modules happen to be imported.
    ordered = sorted(SOLUTIONS.items(), key=lambda item: item[1].__module__)
    return "\n\n".join(_solution(name, cls) for name, cls in ordered)


def _solution(name: str, cls: type) -> str:
    rows = [
        (f"`{field.name}`", field.metadata["doc"], _left_out(field))
        for field in fields(cls)
        if field.init and field.name != "dim"
    ]
    known = ", ".join(f"`{quantity}`" for quantity in sorted(cls.quantities))  # type: ignore[attr-defined]
    table = _table(("parameter", "what it is", "where left out"), rows)
    return f"### `{name}`\n\n{getdoc(cls)}\n\nKnown: {known}.\n\n{table}"


def _left_out(field: Any) -> str:
    """What a parameter is where a case file does not give it."""
    source = field.metadata["source"]
    if source == "material":
        return f"the material of the group `{field.name}`, or of `all`"
    default = "needed" if field.default is MISSING else f"`{field.default}`"
    return f"the case's only {source}; else {default}" if source else default


def recipes() -> str:
    """What the modules of the mesh recipes say of their keys."""
    return "\n\n".join(_told(module) for module in _RECIPES)


def transforms() -> str:
    """What the module of the transform says of its keys."""
    return _told("solver.mesh.transforms")


def _told(module: str) -> str:
    """The docstring of a module, its indented examples fenced."""
    lines, fenced = [], False
    for line in (getdoc(import_module(module)) or "").splitlines():
        inside = line.startswith("    ") or (fenced and not line)
        if inside != fenced:
            lines.append("```yaml" if inside else "```\n")
        fenced = inside
        lines.append(line.removeprefix("    ") if inside else line)
    return "\n".join([*lines, *(["```"] if fenced else [])]).replace("\n\n```\n\n", "\n```\n\n")


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    cells = [[cell.replace("|", r"\|") for cell in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


FOLDER = Path(__file__).parents[1] / "design" / "tables"
TABLES = {
    "pairs": markdown,
    "case-keys": case_keys,
    "checks": checks,
    "recipes": recipes,
    "solutions": solutions,
    "transforms": transforms,
}


def page(name: str) -> str:
    """A table as a page of its own."""
    return f"# {name.replace('-', ' ').capitalize()}\n\n{TABLES[name]()}\n"


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name in TABLES:
        (FOLDER / f"{name}.md").write_text(page(name), encoding="utf-8")
