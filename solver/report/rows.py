"""The rows of the report: one for each verdict, failures first, with what every format shows."""

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from solver.mesh.catalogue import BY_NAME

# In this order they stand in every table.
WORDS = ("crashed", "refused", "failed", "unreliable", "passed")
# The checks that say how accurate a solve is; their errors are relative.
ACCURACY = (
    "multiplier",
    "nodal_stress",
    "surface_stress_slave",
    "surface_stress_master",
    "displacement",
    "stress_components",
)


@dataclass(frozen=True)
class Row:
    """One verdict, and the folder it lies in."""

    verdict: Mapping[str, Any]
    folder: Path

    def __getattr__(self, key: str) -> Any:
        """A value of the verdict; None where it has none."""
        return self.verdict.get(key)

    @cached_property
    def name(self) -> str:
        """The name of the solve."""
        return str(self.verdict.get("job") or self.folder.name)

    @cached_property
    def group(self) -> str:
        """The family's name."""
        return str(self.verdict.get("family") or self.folder.parent.name)

    @cached_property
    def anchor(self) -> str:
        """Where the solve stands on the page: its own, also where families share names."""
        return f"{self.group}/{self.name}"

    @cached_property
    def word(self) -> str:
        """The verdict in one word; what is none of ours counts as crashed."""
        word = self.verdict.get("verdict")
        return word if word in WORDS else "crashed"

    @cached_property
    def why(self) -> str:
        """The reason where it did not pass, in one line that is safe to print."""
        if self.word == "passed":
            return ""
        reason = " ".join(str(self.verdict.get("reason") or "no reason given").split())
        return "".join(c if c.isprintable() else "�" for c in reason)

    @cached_property
    def result_file(self) -> Path | None:
        """The result file, if there is one."""
        name = self.verdict.get("result")
        path = self.folder / name if name else None
        return path if path and path.is_file() else None

    def errors(self, names: Iterable[str]) -> list[tuple[float, str]]:
        """Errors of the checks of these names, largest first, with the checks' names."""
        wanted = set(names)
        found = [(c["error"], c["name"]) for c in self.verdict.get("checks", ())]
        return sorted(((e, n) for e, n in found if n in wanted and e is not None), reverse=True)

    @cached_property
    def accuracy(self) -> tuple[float, str] | None:
        """The worst relative error of pressure, stress and displacement, and its check.

        Where no place is compared, but a norm of the error, it is the largest of these.
        """
        return next(iter(self.errors(ACCURACY) or self.errors(self.norms)), None)

    @cached_property
    def allowed(self) -> float | None:
        """The tolerance of that check."""
        names = self.accuracy[1:] if self.accuracy else ()
        return next((c["tolerance"] for c in self.verdict["checks"] if c["name"] in names), None)

    @cached_property
    def norms(self) -> Mapping[str, float]:
        """Errors against the exact solution by their names in `solver.verification.norms`."""
        errors = self.verdict.get("errors") or {}
        return {name: value for name, value in errors.items() if value is not None}

    def origin(self, kinds: Mapping[str, str]) -> str:
        """Where the reference comes from, given the kinds in words; empty where there is none."""
        kind = self.verdict.get("reference_kind") or ""
        code = self.verdict.get("reference_code") or {}
        named = f": {code.get('name')} {code.get('version')}" if code else ""
        return f"{kinds.get(kind, kind)}{named}"

    def files(self, folder: Path) -> list[tuple[str, str]]:
        """What lies in the solve's folder: names, and paths as seen from `folder`."""
        found = {"result": self.result_file, "verdict": self.folder / "verdict.json"}
        found["log"] = self.folder / "log"
        return [
            (name, os.path.relpath(path, folder))
            for name, path in found.items()
            if path and path.is_file()
        ]

    @cached_property
    def total(self) -> float | None:
        """Wall time of the solve, seconds."""
        return (self.verdict.get("seconds") or {}).get("total")

    @cached_property
    def stages(self) -> dict[str, float]:
        """Wall time by stage, seconds."""
        seconds = self.verdict.get("seconds") or {}
        return {stage: s for stage, s in seconds.items() if stage != "total" and s}

    @cached_property
    def slave(self) -> str:
        """The names of the slave bodies."""
        return ", ".join(b["name"] for b in self.sides if b["role"] in ("slave", "both"))

    @cached_property
    def dim(self) -> int:
        """The dimension of the bodies; 0 where it is not known."""
        names = [name for body in self.sides for name in body["cells"]]
        return BY_NAME[names[0]].dim if names and names[0] in BY_NAME else 0

    @cached_property
    def sides(self) -> list[Mapping[str, Any]]:
        """The bodies, slave first."""
        order = {"slave": 0, "both": 1, "master": 2}
        bodies = self.verdict.get("bodies") or ()
        return sorted(bodies, key=lambda body: order.get(body["role"], 3))


def read_rows(verdicts: Iterable[Path]) -> list[Row]:
    """All verdicts as rows, failures first; a file that cannot be read is a row too."""
    rows = [Row(_read(path), path.parent) for path in verdicts]
    return sorted(rows, key=lambda row: (row.group, WORDS.index(row.word), natural(row.name)))


def natural(name: str) -> list[tuple[int, int | str]]:
    """A key that sorts z2 before z10."""
    parts = re.findall(r"\d+|\D+", name)
    return [(0, int(p)) if p.isdecimal() else (1, p) for p in parts]


def _read(path: Path) -> dict[str, Any]:
    try:
        verdict = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        verdict = f"the verdict cannot be read: {error}"
    if isinstance(verdict, dict):
        return verdict
    return {
        "case": path.parent.name,
        "job": path.parent.name,
        "family": path.parent.parent.name,
        "verdict": "crashed",
        "passed": False,
        "reason": verdict if isinstance(verdict, str) else "the verdict is no JSON object",
        "checks": [],
        "seconds": {},
    }


def families(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows by family, in their order."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.group, []).append(row)
    return found


def counted(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows there are of each verdict, those that occur."""
    counts = {word: sum(row.word == word for row in rows) for word in WORDS}
    return {word: n for word, n in counts.items() if n}
