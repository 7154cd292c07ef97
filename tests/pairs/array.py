"""Covering arrays over the options, and the smallest row that still fails.

There are two: one of plane and axisymmetric cases, one of cases in space. So each pair of options
meets in both, with the cell types that there are.
"""

import json
from collections.abc import Callable, Iterator
from itertools import combinations, product
from pathlib import Path

from covertable import make

from .options import EXCLUDED, OPTIONS, PLANE, REFUSED, SOLID, Row, plain_in, possible

PAIRS = 2
# Of many arrays one in which all planted faults show: a body that opens in the end hides others.
_SALT = "2"
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
    return make(values, strength=strength, constraints=constraints, salt=_SALT)


def stored() -> list[Row]:
    """The rows for pairs that are kept, minutes to make; none where options have changed."""
    given = json.loads(_STORED.read_text())
    if any(len(row) != len(OPTIONS) for row in given):
        return []
    rows = [dict(zip(OPTIONS, row, strict=True)) for row in given]
    whole = all(map(possible, rows)) and not any(missing(rows))
    return rows if whole else []


def store(rows: list[Row]) -> None:
    """Keep the rows for pairs."""
    lines = ",\n".join(json.dumps([row[name] for name in OPTIONS]) for row in rows)
    _STORED.write_text(f"[\n{lines}\n]\n")


def missing(rows: list[Row], strength: int = PAIRS) -> Iterator[Part]:
    """The combinations that no row covers and no rule excludes."""
    for domain in DOMAINS:
        mine = [row for row in rows if row["space"] in domain["space"]]
        covered = {part for row in mine for part in parts(row, strength)}
        alone = {name: values[0] for name, values in domain.items() if len(values) == 1}
        for names in combinations(domain, strength):
            for values in product(*(domain[name] for name in names)):
                part = tuple(zip(names, values, strict=True))
                if part not in covered and possible(alone | dict(part)):
                    yield part


def parts(row: Row, strength: int) -> Iterator[Part]:
    """The combinations that a row covers."""
    return combinations([(name, row[name]) for name in OPTIONS], strength)


def smallest(row: Row, fails: Callable[[Row], bool]) -> Row:
    """The row with as many plain values as still let it fail."""
    plain = plain_in("solid" if row["space"] == "solid" else "strain")
    changed = True
    while changed:
        changed = False
        for name, value in plain.items():
            simpler = {**row, name: value}
            if simpler != row and possible(simpler) and fails(simpler):
                row, changed = simpler, True
    return row
