"""Parts of the pages that are made from the sources, so that they are never out of date.

A page asks for one by a line `<!-- table: NAME -->`, which a forge does not show.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from importlib import import_module
from inspect import getdoc
from typing import Any

from solver.case.material import Material
from solver.case.model import Case, Zone
from solver.case.schemas import CASE_SCHEMA
from solver.case.solutions import SOLUTIONS
from solver.report.html import MEANING
from solver.verification.checks import CHECKS, RELATIVE, Check

# What the objects of a case file become, which knows the defaults of their keys.
_CLASSES = {"": Case, "contact[]": Zone, "materials.*": Material}
_RECIPES = (
    "solver.mesh.recipes.blocks",
    "solver.mesh.recipes.hybrid",
    "solver.mesh.recipes.mapped",
)


def case_keys() -> str:
    """Every key of a case file: what it is, what is allowed, its default."""
    schema = json.loads(CASE_SCHEMA.read_text(encoding="utf-8"))
    rows = [
        (f"`{path}`", key["title"], _allowed(schema, key), "needed" if needed else _default(path))
        for path, key, needed in _keys(schema, "")
    ]
    return _table(("key", "what it is", "allowed", "default"), rows)


def _keys(schema: Mapping[str, Any], path: str) -> Iterator[tuple[str, Mapping[str, Any], bool]]:
    """Path, schema and whether it is needed, of each key that has a title."""
    for name, key in schema.get("properties", {}).items():
        if "title" in key:
            here = f"{path}.{name}".lstrip(".")
            yield here, key, name in schema.get("required", ())
            yield from _keys(key, here)
    for part, ending in (("items", "[]"), ("additionalProperties", ".*")):
        if isinstance(schema.get(part), Mapping):
            yield from _keys(schema[part], path + ending)


def _allowed(schema: Mapping[str, Any], key: Mapping[str, Any]) -> str:
    named = key.get("$ref", "").rpartition("/")[2]
    return key.get("description") or schema["$defs"][named]["description"]


def _default(path: str) -> str:
    place, _, name = path.rpartition(".")
    known = {field.name: field.default for field in fields(_CLASSES.get(place, ()) or Case)}
    value = known.get(name, MISSING) if place in _CLASSES else MISSING
    if value in (MISSING, None, "", ()):
        return ""
    return f"`{list(value) if isinstance(value, tuple) else value}`"


def checks() -> str:
    """Every check but the norms of errors, which the page explains."""
    head = ("check", "of what", "fed by", "tolerance", "relative to")
    return _table(head, [_check(check) for check in CHECKS if check.norm == "max"])


def _check(check: Check) -> tuple[str, ...]:
    scale = (getdoc(check.scale) or "").rstrip(".").lower()
    return (
        f"`{check.name}`" + (f"<br>{check.alias}" if check.alias else ""),
        MEANING[check.name],
        f"`{check.key}`" if check.key else "always run",
        f"{RELATIVE:g}, or `tolerance`" if check.tolerance is None else f"{check.tolerance:g}",
        scale if check.fixed else f"the reference, or {scale}",
    )


def solutions() -> str:
    """Every exact solution: what it says of itself, what is known, its parameters."""
    return "\n\n".join(_solution(name, cls) for name, cls in SOLUTIONS.items())


def _solution(name: str, cls: type) -> str:
    rows = [
        (f"`{field.name}`", field.metadata["doc"], _left_out(field))
        for field in fields(cls)
        if field.init and field.metadata["source"] != "dimension"
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
    return _told("solver.mesh.changes.transforms")


def _told(module: str) -> str:
    """The docstring of a module, its indented examples fenced."""
    lines, fenced = [], False
    for line in (getdoc(import_module(module)) or "").splitlines():
        inside = line.startswith("    ") or (fenced and not line)
        if inside != fenced:
            lines.append("```yaml" if inside else "```\n")
        fenced = inside
        lines.append(line.removeprefix("    ") if inside else line)
    return "\n".join([*lines, *(["```"] if fenced else [])])


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    cells = [[cell.replace("|", r"\|") for cell in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


TABLES = {
    "case-keys": case_keys,
    "checks": checks,
    "recipes": recipes,
    "solutions": solutions,
    "transforms": transforms,
}
