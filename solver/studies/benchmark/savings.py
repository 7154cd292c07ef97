"""What each line of a plan saves: a case solved with one skip switched off at a time.

    savings(load_case(path), mesh)            # of one solve
    write_savings(output, [path, …], print)   # of several cases: the command `savings CASE.yaml …`

All solves run in one process, warm, in rounds: each round solves the case as it is and once for
each switch of its plan, so that what else the machine does meets all alike. The median over the
rounds counts, of processor time, with its quartiles. The report shows the file beside
each line where it lies at `results/benchmark/savings.json`.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import meshio

from solver.case import job_name
from solver.case.reader import Case, load_case
from solver.simulation.simulate import simulate
from solver.simulation.skips import EVERYTHING, NEEDED, Skips
from solver.studies.timing import TOTAL, repeated
from solver.system.clock import Clock
from solver.system.files import write_text
from solver.system.provenance import gather
from solver.verification.run import mesh_of

ROUNDS = 7


@dataclass(frozen=True)
class Saving:
    """The processor time in seconds that one switch saves: median and quartiles.

    `what` and `why`: the lines of the plan that it stands for.
    """

    skip: str
    what: str
    why: str
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Savings:
    """Those of one solve; `seconds` is its own processor time, `everything` that of all switches.

    The last, the switches off together, is no sum of the others.
    """

    job: str
    unknowns: int
    seconds: float
    everything: float
    lines: list[Saving]


def savings(case: Case, mesh: meshio.Mesh, swapped: bool = False, rounds: int = ROUNDS) -> Savings:
    """What the switches save that the plan of a case names; raises what a solve does."""
    solution = simulate(case, mesh, swapped)
    told: dict[str, list[int]] = {}
    for number, line in enumerate(solution.plan):
        if line.skip:
            told.setdefault(line.skip, []).append(number)
    variants = {skip: replace(NEEDED, **{skip: False}) for skip in told}
    times = _times(case, mesh, swapped, {"": NEEDED, **variants, "all": EVERYTHING}, rounds)
    lines = []
    for skip, numbers in told.items():
        more = [off - on for off, on in zip(times[skip], times[""], strict=True)]
        low, middle, high = quantiles(more, n=4, method="inclusive")
        what, why = ("; ".join(dict.fromkeys(solution.plan[n][k] for n in numbers)) for k in (0, 1))
        lines.append(Saving(skip, what, why, middle, low, high))
    return Savings(
        job_name(case.name, swapped, None),
        solution.dofs,
        median(times[""]),
        median(times["all"]),
        lines,
    )


def _times(
    case: Case, mesh: meshio.Mesh, swapped: bool, variants: dict[str, Skips], rounds: int
) -> dict[str, list[float]]:
    """Processor times of each variant, a value a round, after a first round that does not count."""
    found: dict[str, list[float]] = {name: [] for name in variants}
    for number in range(rounds + 1):
        for name, skips in variants.items():

            def run(clock: Clock, skips: Skips = skips) -> object:
                return simulate(case, mesh, swapped, clock=clock, skips=skips)

            seconds = repeated(run, 1)[TOTAL]["cpu"][0]
            if number:
                found[name].append(seconds)
    return found


def write_savings(
    output: Path, cases: Sequence[Path], log: Callable[[str], Any], rounds: int = ROUNDS
) -> None:
    """Measure the savings of several cases and write them as JSON, whole or not at all."""
    found = {}
    for path in cases:
        case = load_case(path)
        one = savings(case, mesh_of(case), rounds=rounds)
        log(f"{one.job}: {one.seconds:.3f} s; with everything {one.everything:.3f} s")
        for line in one.lines:
            share = line.median / one.seconds
            log(f"  {line.what} ({line.why}): {1e3 * line.median:+.1f} ms, {share:+.0%}")
        found[one.job] = asdict(one)
    machine = {key: gather(cases[0], None)[key] for key in ("cpu", "threads", "revision")}
    content = {"rounds": rounds, **machine, "jobs": found}
    write_text(output, json.dumps(content, indent=1, ensure_ascii=False) + "\n")
