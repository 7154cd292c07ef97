"""Who is first to an accuracy on quadratic slave cells, and why where it is not LAC with recovery.

A reason compares the first treatment with the fastest recovered one: the mesh on which each reaches
the accuracy, its errors there, and its times by stage.
"""

from dataclasses import dataclass, replace

from ...mesh.catalogue import BY_NAME
from ..fits import ROUND_OFF
from .description import StudyTreatment
from .records import Panel, TimedSolve

TARGETS = {1e-2: "1 %", 1e-3: "0.1 %", 1e-4: "0.01 %"}
RECOVERED, TIED, OTHER, NONE = "recovery", "tied", "other", "none"


def is_recovered(treatment: StudyTreatment) -> bool:
    """Whether the treatment recovers the pressure."""
    return treatment.zone.get("recovery", "none") != "none"


@dataclass(frozen=True)
class First:
    """The first to one accuracy: `word` of the above, treatment, solve, and the reason."""

    word: str
    title: str = ""
    solve: TimedSolve | None = None
    why: str = ""


def firsts(panel: Panel) -> dict[str, dict[float, First]]:
    """By pair with quadratic slave cells and target, where a recovered treatment is measured."""
    found = {}
    for pair in panel.pairs:
        mine = replace(panel, lines=[line for line in panel.lines if line.pair == pair])
        slave = mine.lines[0].levels[0].point.slave
        if BY_NAME[slave].order == 2 and any(is_recovered(x.treatment) for x in mine.lines):
            found[pair] = {target: _first(mine, target) for target in TARGETS}
    return found


def _first(panel: Panel, target: float) -> First:
    quickest = panel.quickest(target)
    if not quickest:
        return First(NONE)
    recovered = {line.title for line in panel.lines if is_recovered(line.treatment)}
    title, solve = next(iter(quickest.items()))
    if title in recovered:
        return First(RECOVERED, title, solve)
    if recovered & set(quickest):
        return First(TIED, title, solve)
    return First(OTHER, title, solve, _reason(panel, target, solve, recovered))


def _reason(panel: Panel, target: float, solve: TimedSolve, recovered: set[str]) -> str:
    """Why no recovered treatment is as quick as `solve`."""
    error, level = panel.error, solve.point.level
    known = [(m, t) for t in sorted(recovered) if (m := panel.cheapest(t, target))]
    if not known:
        return f"recovery never reaches it; its least error is {_least(panel, recovered):.1e}"
    ours, title = min(known, key=lambda pair: pair[0].time.median)
    if ours.point.level == level:
        slower = ours.time.median / solve.time.median - 1
        stage, more = _costliest(ours, solve)
        exact = max(ours.error(error) or 0, solve.error(error) or 0) <= ROUND_OFF
        errors = (
            f"errors {solve.error(error) or 0:.1e} and, recovered, {ours.error(error) or 0:.1e}"
        )
        same = "both are exact" if exact else f"{errors} on the same mesh"
        return f"{same}; recovery takes {slower:.0%} longer, most in {stage} (+{1e3 * more:.1f} ms)"
    there = next(
        (m for line in panel.of(title) for m in line.having(error) if m.point.level == level), None
    )
    if there is None:
        return f"recovery reaches it at level {ours.point.level}, not solved at {level}"
    if level > ours.point.level:
        return (
            f"recovery reaches it on a coarser mesh, at level {ours.point.level}, but takes longer"
        )
    return (
        f"at level {level} its error is {solve.error(error) or 0:.1e}, the recovered one "
        f"{there.error(error) or 0:.1e}, which needs level {ours.point.level}"
    )


def _least(panel: Panel, titles: set[str]) -> float:
    return min(v for line in panel.lines if line.title in titles for v in line.values(panel.error))


def _costliest(ours: TimedSolve, solve: TimedSolve) -> tuple[str, float]:
    """The stage in which `ours` takes most more, and how much."""
    more = {stage: s - solve.stages.get(stage, 0.0) for stage, s in ours.stages.items()}
    stage = max(more, key=lambda name: more[name])
    return stage, more[stage]
