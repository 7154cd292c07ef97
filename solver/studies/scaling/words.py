"""What the measurements show, in sentences whose every number comes from them."""

from collections.abc import Sequence

from solver.report import formats
from solver.studies.scaling.growth import Growth
from solver.studies.scaling.records import OTHER, WHOLE, Line, Measured, Reached
from solver.studies.work_precision.words import listed

LINEAR = 1.15


def count(unknowns: float) -> str:
    """Unknowns in words: `102,357`."""
    return f"{unknowns:,.0f}"


def seconds(value: float) -> str:
    """Two digits, or whole seconds."""
    return f"{value:.2g} s" if value < 9.95 else f"{value:.0f} s"


def exponent(growth: Growth | None) -> str:
    """An exponent with its spread, or nothing."""
    if growth is None:
        return formats.NOTHING
    spread = "" if growth.spread != growth.spread else f" ± {growth.spread:.2f}"
    return f"{growth.value:.2f}{spread}"


def span(line: Line) -> str:
    """The unknowns between which exponents are fitted."""
    sizes = [m.record["dofs"] for m in line.fitted]
    return f"{count(min(sizes))} … {count(max(sizes))}" if sizes else formats.NOTHING


def largest(line: Line) -> str:
    """What the largest solve of a series took, and how the series grows."""
    if not line.solved:
        return f"{line.series.title}: no point has a solve."
    m = line.solved[-1]
    text = (
        f"{line.series.title}: {count(m.record['dofs'])} unknowns take {seconds(m.cpu)} of "
        f"processor time and {m.memory:.2g} GB, by {m.record['linear_solver']}"
    )
    if m.record["linear_iterations"]:
        text += f" ({m.record['linear_iterations']} iterations)"
    text += f"; the largest error of the pressure is {formats.error(m.pressure)}."
    growth = line.growth(WHOLE)
    if growth:
        text += (
            f" From {span(line)} unknowns the whole process grows with exponent {exponent(growth)}."
        )
    return text + _dominant(m)


def _dominant(m: Measured) -> str:
    """The stage that takes most of a point."""
    stage = max(m.stages, key=lambda name: m.stages[name])
    name = "start-up and what no stage counts" if stage == OTHER else f"the stage “{stage}”"
    return f" There {name} takes {100 * m.stages[stage] / m.cpu:.0f} %."


def growing(lines: Sequence[Line]) -> str:
    """Which series stay near-linear, and which do not."""
    fitted = [line for line in lines if line.on_large]
    known = [(line, growth) for line in fitted if (growth := line.growth(WHOLE))]
    if not known:
        return "Too few large sizes are measured to tell how cost grows; small ones are start-up."
    near = [line.series.title for line, growth in known if growth.value <= LINEAR]
    above = [
        f"{line.series.title} ({growth.value:.2f})"
        for line, growth in known
        if growth.value > LINEAR
    ]
    parts = []
    if near:
        parts.append(f"{listed(near)} {_grow(near)} with an exponent of at most {LINEAR}")
    if above:
        parts.append(f"{listed(above)} {_grow(above)} faster")
    return "; ".join(parts) + "."


def _grow(names: Sequence[str]) -> str:
    return "grows" if len(names) == 1 else "grow"


def goals(found: Sequence[Reached]) -> str:
    """How many goals are reached, and which are not."""
    known = [one for one in found if one.value is not None]
    if not known:
        return "No goal can be judged by the sizes measured here."
    short = [one.goal.title for one in known if not one.good]
    text = f"{len(known) - len(short)} of {len(known)} goals measured here are reached"
    text += f", out of {len(found)}" if len(found) > len(known) else ""
    return text + (f"; short of it: {'; '.join(short)}." if short else ".")
