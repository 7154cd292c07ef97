"""Records of past batches: a small JSON file a revision, and what its last values are marked for.

A solve is marked where its verdict changed, where an error grew more than tenfold, and where its
processor time grew beyond its noise; each compared with the revisions before.
"""

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from typing import Annotated, Literal

import msgspec

from ..system.errors import InputError
from ..system.files import replacing
from ..system.package import PROJECT
from ..system.provenance import PACKAGES
from ..verification.verdict import WORDS
from .differences import Batch
from .formats import duration
from .formats import error as shown
from .rows import Row

# An error is marked from this growth on. Below the floor it is round-off and counts as the floor.
GROWTH, FLOOR = 10.0, 1e-13
# Records of the same machine that the noise of times needs, and the most that it takes.
FEWEST, MOST = 4, 10
# A time is marked from so many times the noise above the median. The noise is the median absolute
# deviation, scaled to the standard deviation of a normal distribution, but at least a share of the
# median.
WIDTH, NORMAL, LEAST = 4.0, 1.4826, 0.05

_Size = Annotated[float, msgspec.Meta(ge=0)]


class SolveRecord(msgspec.Struct, frozen=True, array_like=True):
    """A solve: `errors` by check, the largest of all zones; `version` is another code's."""

    verdict: Literal["crashed", "refused", "failed", "unreliable", "solved", "passed"]
    cpu_seconds: _Size | None
    worst: str
    errors: dict[str, _Size]
    version: str = ""

    @property
    def error(self) -> float | None:
        """The largest checked error as in the report; None where it is unknown."""
        return self.errors.get(self.worst)


class BatchRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Solves of one revision on one machine, by family and name; `time` is the last one's."""

    time: Annotated[datetime, msgspec.Meta(tz=True)]
    revision: str
    machine: str
    versions: dict[str, str]
    solves: dict[str, SolveRecord]


@dataclass(frozen=True)
class Mark:
    """What changed: `kind` is verdict, error or time; `bad` where the exit status reports it."""

    kind: str
    words: str
    bad: bool = False


@dataclass(frozen=True)
class Past:
    """A solve in one record."""

    batch: BatchRecord
    solve: SolveRecord

    @property
    def label(self) -> str:
        """What the series goes by: the version of another code, or the project's revision."""
        named = self.solve.version or self.batch.revision or self.batch.versions.get(PROJECT)
        return named or "unknown"


def read_records(folder: Path) -> list[BatchRecord]:
    """All records in a folder by time; raises `InputError` for a file that is not a record."""
    found = []
    for file in sorted(folder.glob("*.json")):
        try:
            found.append(msgspec.json.decode(file.read_bytes(), type=BatchRecord))
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            said = " ".join(str(error).split())
            raise InputError(file, "file", None, f"damaged record ({said})") from None
    return sorted(found, key=lambda batch: batch.time)


def series(records: Iterable[BatchRecord]) -> dict[str, list[Past]]:
    """The records of each solve by family and name, oldest first."""
    found: dict[str, list[Past]] = {}
    for batch in records:
        for name, solve in batch.solves.items():
            found.setdefault(name, []).append(Past(batch, solve))
    return found


def add_records(batch: Batch, folder: Path) -> list[Path]:
    """Write what is new in a batch: a file for each revision and machine; the files.

    A solve that equals its last record, to all digits of its time, has not run again.
    """
    known = series(read_records(folder))
    groups: dict[tuple[str, ...], dict[str, Row]] = {}
    for row in batch.rows.values():
        last = known.get(row.anchor)
        if not last or last[-1].solve != _solve(row):
            groups.setdefault(_origin(row.verdict.provenance), {})[row.anchor] = row
    return [_write(folder, _batch(rows, batch)) for rows in groups.values()]


def _origin(provenance: Mapping[str, str | int]) -> tuple[str, ...]:
    """Revision, machine and versions; empty where the result does not have them."""
    keys = ("revision", "cpu", "cores", "threads", "python", PROJECT, *PACKAGES)
    return tuple(str(provenance.get(key, "")) for key in keys) if provenance else ()


def _batch(rows: Mapping[str, Row], batch: Batch) -> BatchRecord:
    """The record of solves of one origin.

    Results of other codes and solves that crashed have no origin: they are of the time of the
    record, and have the revision and machine of the batch's latest solve.
    """
    dated = [r.verdict.provenance for r in rows.values() if r.verdict.provenance.get("time_utc")]
    every = [r.verdict.provenance for r in batch.rows.values()]
    origin = max(dated or every, key=lambda each: str(each.get("time_utc", "")), default={})
    machine = [str(origin[key]) for key in ("cpu", "cores", "threads") if key in origin]
    versions = {key: str(origin[key]) for key in ("python", PROJECT, *PACKAGES) if origin.get(key)}
    return BatchRecord(
        time=datetime.fromisoformat(str(origin["time_utc"])) if dated else datetime.now(UTC),
        revision=str(origin.get("revision", "")),
        machine=" / ".join(machine),
        versions=versions,
        solves={name: _solve(row) for name, row in rows.items()},
    )


def _solve(row: Row) -> SolveRecord:
    errors: dict[str, float] = {}
    for check in row.verdict.checks:
        if math.isfinite(check.error):
            errors[check.name] = max(errors.get(check.name, 0.0), float(f"{check.error:.2g}"))
    time = row.verdict.cpu_seconds
    return SolveRecord(
        verdict=row.word,  # type: ignore[arg-type]
        cpu_seconds=None if time is None or math.isnan(time) else float(f"{time:.6g}"),
        worst=row.accuracy[1] if row.accuracy else "",
        errors=errors,
        version=row.verdict.code_version or row.verdict.code or "",
    )


def _write(folder: Path, batch: BatchRecord) -> Path:
    # A line a solve, so that git shows what changed.
    head = {key: getattr(batch, key) for key in ("time", "revision", "machine", "versions")}
    lines = ",\n".join(
        f"{_json(name)}:{_json(solve)}" for name, solve in sorted(batch.solves.items())
    )
    text = f'{_json(head)[:-1]},"solves":{{\n{lines}\n}}}}\n'
    digest = hashlib.sha256(text.encode()).hexdigest()[:8]
    path = folder / f"{batch.time.astimezone(UTC):%Y%m%dT%H%M%S}-{digest}.json"
    with replacing(path) as file:
        file.write_text(text, encoding="utf-8")
    return path


def _json(value: object) -> str:
    return msgspec.json.encode(value).decode()


def marks(points: Sequence[Past]) -> list[Mark]:
    """What the last of the records of a solve is marked for.

    It is compared with the records before its revision; where all are of one revision, with the
    records before it.
    """
    *before, last = points
    earlier = list(before)
    while earlier and earlier[-1].label == last.label:
        earlier.pop()
    earlier = earlier or before
    if not earlier:
        return []
    return [*_verdict(earlier[-1], last), *_errors(earlier, last), *_time(earlier, last)]


def _verdict(before: Past, last: Past) -> list[Mark]:
    was, now = before.solve.verdict, last.solve.verdict
    if was == now:
        return []
    return [Mark("verdict", f"{was} → {now}", WORDS.index(now) < WORDS.index(was))]


def _errors(earlier: Sequence[Past], last: Past) -> list[Mark]:
    """One mark: the check whose error grew most, and how many others did."""
    grown = []
    for name, error in last.solve.errors.items():
        known = [p.solve.errors[name] for p in earlier if name in p.solve.errors]
        if known and (growth := error / max(known[-1], FLOOR)) > GROWTH:
            grown.append((growth, f"{name.replace('_', ' ')} {shown(known[-1])} → {shown(error)}"))
    if not grown:
        return []
    more = f", and {len(grown) - 1} more" if len(grown) > 1 else ""
    return [Mark("error", f"error of {max(grown)[1]}{more}", bad=True)]


def _time(earlier: Sequence[Past], last: Past) -> list[Mark]:
    now = last.solve.cpu_seconds
    same = [p.solve.cpu_seconds for p in earlier if p.batch.machine == last.batch.machine]
    times = [time for time in same if time is not None][-MOST:]
    if now is None or len(times) < FEWEST:
        return []
    middle = median(times)
    noise = max(NORMAL * median(abs(time - middle) for time in times), LEAST * middle)
    if now <= middle + WIDTH * noise:
        return []
    return [Mark("time", f"time {duration(middle)} ± {duration(noise)} → {duration(now)}")]
