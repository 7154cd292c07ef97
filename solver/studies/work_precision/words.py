"""What a panel shows, in sentences whose every number comes from the measurements."""

from collections.abc import Sequence

from solver.report import formats
from solver.studies.fits import ROUND_OFF
from solver.studies.work_precision.figure import LIMIT
from solver.studies.work_precision.records import ERRORS, TARGETS, Measured, Panel


def paragraph(panel: Panel) -> str:
    """What a panel shows: who reaches 0.1 % soonest, who does not, what is exact, and the rest."""
    solved = [title for title in panel.titles if panel.finest(title) is not None]
    parts = [_soonest(panel, solved), _never(panel, solved), _exact(panel, solved)]
    parts += [_finest(panel), _reference(panel), _lost(panel)]
    return " ".join(part[:1].upper() + part[1:] for part in parts if part)


def seconds(value: float) -> str:
    """A time with two significant digits."""
    if value < 0.0995:
        return f"{value * 1000:.2g} ms"
    return f"{value:.2g} s" if value < 9.95 else f"{value:.0f} s"


def percent(error: float) -> str:
    """An error in per cent where that is readable, else as a power of ten."""
    if error < 1e-4:
        return formats.error(error)
    return f"{100 * error:.2g} %" if error < 0.995 else f"{100 * error:.0f} %"


def listed(names: Sequence[str]) -> str:
    """`a, b and c`."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def _soonest(panel: Panel, solved: Sequence[str]) -> str:
    """Who reaches 0.1 % first, and by how much before the next."""
    limit = TARGETS[LIMIT]
    ranked = panel.ranked(LIMIT)
    if not ranked:
        best = min(solved, key=lambda title: panel.finest(title) or 0.0)
        nearest = percent(panel.finest(best) or 0.0)
        if len(solved) > 1 and {percent(panel.finest(t) or 0.0) for t in solved} == {nearest}:
            return f"None reaches {limit}; all come to {nearest} on their finest mesh."
        return f"None reaches {limit}; {best} comes nearest with {nearest} on its finest mesh."
    (title, first), *others = ranked
    text = f"{title} reaches {limit} soonest, in {seconds(first.time.median)} ({first.label})"
    if not others:
        return f"{text}."
    following, second = others[0]
    if second.time.low <= first.time.high:
        return (
            f"{text}; {following} is next with {seconds(second.time.median)} ({second.label}), "
            "no later within the spread of the measurements."
        )
    times = f"{second.time.median / first.time.median:.2g} times as long"
    longer = "little longer" if times.startswith("1 ") else times
    return (
        f"{text}; {following} is next and takes {longer}, "
        f"{seconds(second.time.median)} ({second.label})."
    )


def _never(panel: Panel, solved: Sequence[str]) -> str:
    """Who does not reach 0.1 %, with its smallest error on the finest mesh of a pair."""
    reached = {title for title, _ in panel.ranked(LIMIT)}
    never = [title for title in solved if title not in reached]
    if not reached or not never:
        return ""
    told = [f"{title} ({percent(panel.finest(title) or 0.0)})" for title in never]
    verb = "does" if len(never) == 1 else "do"
    return f"{listed(told)} {verb} not (in brackets: the error on the finest meshes)."


def _exact(panel: Panel, solved: Sequence[str]) -> str:
    """Whose error is rounding on every pair and level."""
    exact = [
        title for title in solved if all(line.at_round_off(panel.error) for line in panel.of(title))
    ]
    if not exact:
        return ""
    largest = max(
        m.error(panel.error) or 0.0
        for title in exact
        for line in panel.of(title)
        for m in line.having(panel.error)
    )
    verb = "is" if len(exact) == 1 else "are"
    return (
        f"{listed(exact)} {verb} at round-off (below {formats.error(ROUND_OFF)}) at every level of "
        f"every pair; the largest error there is {formats.error(largest)}."
    )


def _finest(panel: Panel) -> str:
    """The span of errors on the finest meshes, best and worst treatment."""
    finest = [
        (m.error(panel.error) or 0.0, line.title, m)
        for line in panel.lines
        for m in line.having(panel.error)
        if m.point.level == panel.problem.levels[-1]
    ]
    if len(finest) < 2:
        return ""
    low, high = min(finest, key=_error), max(finest, key=_error)
    if percent(low[0]) == percent(high[0]):
        return ""
    return (
        f"On the finest meshes the error of the {ERRORS[panel.error]}, lies between "
        f"{percent(low[0])} ({low[1]}, {low[2].point.pair}) and {percent(high[0])} "
        f"({high[1]}, {high[2].point.pair})."
    )


def _error(entry: tuple[float, str, Measured]) -> float:
    return entry[0]


def _reference(panel: Panel) -> str:
    """How far errors can be trusted where the reference is a refined mesh."""
    if not panel.uncertainty:
        return ""
    return (
        f"The reference is a refined mesh and may itself be off by {percent(panel.uncertainty)}: "
        "errors near that are not told apart."
    )


def _lost(panel: Panel) -> str:
    lost = sum(not m.solved for line in panel.lines for m in line.levels)
    whole = sum(len(line.levels) for line in panel.lines)
    if not lost:
        return ""
    return f"{lost} of {whole} points have no solve; the reasons stand below."
