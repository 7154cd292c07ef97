"""Covering arrays over the options, and the smallest row that still fails.

There are two: one of plane and axisymmetric cases, one of cases in space. So each pair of options
meets in both, with the cell types that there are.
"""

import json
from collections.abc import Callable, Iterator
from itertools import combinations, product
from pathlib import Path

from covertable import make

from .options import EXCLUDED, OPTIONS, PLAIN, PLANE, REFUSED, SOLID, Row, possible

PAIRS = 2
_STORED = Path(__file__).with_name("rows.json")
Part = tuple[tuple[str, str], ...]
_CELLS = ("slave cells", "master cells")
DOMAINS = tuple(
    {**OPTIONS, "space": spaces, **dict.fromkeys(_CELLS, cells)}
    for spaces, cells in ((OPTIONS["space"][:-1], PLANE), (OPTIONS["space"][-1:], SOLID))
)


def covering(strength: int) -> list[Row]:
    """Rows that hold every possible combination of `strength` values, in the plane and in space."""
    return [row for domain in DOMAINS for row in _rows(domain, strength)]


def _rows(domain: dict[str, tuple[str, ...]], strength: int) -> list[Row]:
    constraints = []
    for rule in (*REFUSED, *EXCLUDED):
        inside = {
            name: [v for v in values if v in domain[name]] for name, values in rule.when.items()
        }
        if all(inside.values()):
            both = [{"operator": "in", "left": name, "values": v} for name, v in inside.items()]
            joined = {"operator": "and", "conditions": both}
            constraints.append({"operator": "not", "condition": joined})
    values = {name: list(values) for name, values in domain.items()}
    return make(values, strength=strength, constraints=constraints)


def stored() -> list[Row]:
    """The rows for pairs that are kept, half a minute to make; none where options have changed."""
    rows = [dict(zip(OPTIONS, row, strict=True)) for row in json.loads(_STORED.read_text())]
    whole = all(possible(row) for row in rows) and not any(missing(rows))
    return rows if whole else []


def store(rows: list[Row]) -> None:
    """Keep the rows for pairs."""
    lines = ",\n".join(json.dumps([row[name] for name in OPTIONS]) for row in rows)
    _STORED.write_text(f"[\n{lines}\n]\n")


def missing(rows: list[Row], strength: int = PAIRS) -> Iterator[Part]:
    """The combinations that no row covers and that some possible row could."""
    for domain in DOMAINS:
        mine = [row for row in rows if row["space"] in domain["space"]]
        covered = {part for row in mine for part in parts(row, strength)}
        for part in wanted(domain, strength):
            if part not in covered and _completed(dict(part), domain):
                yield part


def _completed(part: dict[str, str], domain: dict[str, tuple[str, ...]]) -> bool:
    """Whether a row can have a part, by search: options that rules tie to it first."""
    tied = {name for rule in (*REFUSED, *EXCLUDED) if rule.when.keys() & part for name in rule.when}
    free = sorted((name for name in domain if name not in part), key=lambda name: name not in tied)

    def filled(row: dict[str, str], left: list[str]) -> bool:
        if not left:
            return True
        longer = ({**row, left[0]: value} for value in domain[left[0]])
        return any(possible(one) and filled(one, left[1:]) for one in longer)

    return filled(part, free)


def parts(row: Row, strength: int) -> Iterator[Part]:
    """The combinations that a row covers."""
    return combinations([(name, row[name]) for name in OPTIONS], strength)


def wanted(domain: dict[str, tuple[str, ...]], strength: int) -> Iterator[Part]:
    """The combinations of values of a domain that no rule excludes."""
    for names in combinations(domain, strength):
        for values in product(*(domain[name] for name in names)):
            part = tuple(zip(names, values, strict=True))
            if possible({"space": domain["space"][0], **dict(part)}):
                yield part


def smallest(row: Row, fails: Callable[[Row], bool]) -> Row:
    """The row with as many plain values as still let it fail."""
    solid = row["space"] == "solid"
    cells = dict.fromkeys(_CELLS, "HEXA8" if solid else "QUAD4")
    plain = {**PLAIN, "space": "solid" if solid else "strain", **cells}
    changed = True
    while changed:
        changed = False
        for name, value in plain.items():
            simpler = {**row, name: value}
            if simpler != row and possible(simpler) and fails(simpler):
                row, changed = simpler, True
    return row
