"""The time that the solves of a family save by the work that they leave out, measured on one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import meshio
import msgspec

from ..case.model import Case
from ..simulation.options import LEAN, Options
from ..simulation.simulate import simulate
from ..system.files import write_text
from ..system.progress import processor_time
from .results import read_result
from .run import mesh_of
from .stored import read_verdict

# The places, in the order of cost, of the solves that are measured.
_SAMPLES = (1 / 6, 1 / 2, 5 / 6)


@dataclass(frozen=True, kw_only=True)
class Savings:
    """Of the solves that leave work out, `seconds` of processor time in all, some were measured.

    `jobs` are their names, `cost` their whole processor time in the batch, `lean` and `everything`
    the times of their solutions without that work and with it (s).
    """

    jobs: list[str]
    seconds: float
    cost: float
    lean: float
    everything: float

    @property
    def saved(self) -> float:
        """The processor time (s) that all these solves save, if the others save the same share."""
        return self.seconds * (self.everything - self.lean) / self.cost


def measure(results: Sequence[Path]) -> Savings | None:
    """Solve a cheap, a middle and a dear one both ways; None where no solve leaves work out.

    `results` are files of our own solves, with their verdicts beside them.
    """
    found = [(read_verdict(result.with_name("verdict.json")), result) for result in results]
    costs = sorted(
        (v.cost.cpu_seconds or 0.0, result)
        for v, result in found
        if v.switches and not v.foreign.code
    )
    if not costs:
        return None
    chosen = [costs[i] for i in sorted({int(share * len(costs)) for share in _SAMPLES})]
    lean = everything = 0.0
    for _, result in chosen:
        case = read_result(result).solution.case
        mesh = mesh_of(case)
        lean += _cost(case, mesh, LEAN)
        everything += _cost(case, mesh, Options.everything())
    return Savings(
        jobs=[result.parent.name for _, result in chosen],
        seconds=sum(cost for cost, _ in costs),
        cost=sum(cost for cost, _ in chosen),
        lean=lean,
        everything=everything,
    )


def _cost(case: Case, mesh: meshio.Mesh, options: Options) -> float:
    start = processor_time()
    simulate(case, mesh, options)
    return processor_time() - start


def write_savings(folder: Path, output: Path) -> None:
    """Measure the family in a folder of results, and write what was found as JSON."""
    found = measure(sorted(folder.glob("[!.]*/result.vtkhdf")))
    write_text(output, msgspec.json.encode(found).decode() + "\n")


def read_savings(file: Path) -> Savings | None:
    """The savings in a file; None where nothing was measured, or otherwise than today."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=Savings | None)
    except (FileNotFoundError, msgspec.DecodeError):
        return None
