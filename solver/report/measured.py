"""On what, and how undisturbed, points were measured: the same on every page of timings."""

from collections.abc import Mapping, Sequence
from typing import Any

# A machine that was busier than this when a point began may have disturbed it.
_BUSY = 1.0
_PACKAGES = ("python", "numpy", "scipy")

Record = Mapping[str, Any]


def disturbed(records: Sequence[Record]) -> int:
    """How many points began while other work kept the machine busy."""
    return sum(record["load"] > record["threads"] + _BUSY for record in records)


def facts(records: Sequence[Record]) -> list[tuple[str, str]]:
    """When, on which machine and with what the points were measured; empty where there are none."""
    if not records:
        return []

    def all_of(key: str) -> str:
        return ", ".join(sorted({str(r["machine"].get(key, "")) for r in records}))

    times = sorted(r["machine"]["time_utc"][:16].replace("T", " ") for r in records)
    return [
        ("Measured", " … ".join(dict.fromkeys([times[0], times[-1]])) + " UTC"),
        ("Machine", all_of("cpu")),
        ("Threads", ", ".join(sorted({str(r["threads"]) for r in records}))),
        ("Revision", all_of("revision")),
        ("Versions", ", ".join(f"{p} {all_of(p)}" for p in _PACKAGES)),
        ("Begun while the machine was busy", f"{disturbed(records)} of {len(records)}"),
    ]
