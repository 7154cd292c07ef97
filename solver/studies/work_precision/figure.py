"""The charts of a panel: log–log error against time, one for each pair, a line per treatment."""

from collections.abc import Sequence

from ...report.charts import (
    EPSILON,
    MUTED,
    RED,
    SHAPES,
    Axis,
    Chart,
    Look,
    floor_band,
    level,
    series_chart,
)
from ...report.html import NORMS
from .records import LevelLine, Panel, shown

_NEAR = 1e-11
LIMIT = 1e-3
# Okabe and Ito's colours; yellow is left out, which paper does not show.
_COLORS = ("#0072b2", "#d55e00", "#aa5588", "#1f2933", "#009e73", "#e69f00", "#56b4e9")
_DASHES: tuple[tuple[float, ...], ...] = ((), (6, 3), (1.5, 3), (7, 2, 1.5, 2))
_TIPS = {
    "level": "level",
    "low": "shortest time, s",
    "high": "longest time, s",
    "unknowns": "unknowns",
}


class Looks(dict[str, Look]):
    """The look of every line by its title: one colour a kind of treatment, one mark a line."""

    def __init__(self, lines: Sequence[LevelLine]):
        super().__init__()
        kinds: dict[str, int] = {}
        for line in lines:
            if line.title not in self:
                kind = f"{line.treatment.zone.get('treatment')} {line.linear_solver}"
                variant = kinds[kind] = kinds.get(kind, -1) + 1
                color = _COLORS[list(kinds).index(kind) % len(_COLORS)]
                shape = SHAPES[len(self) % len(SHAPES)]
                self[line.title] = Look(color, shape, _DASHES[variant % len(_DASHES)])


def draw_figure(panel: Panel, looks: Looks, prefix: str = "") -> list[Chart]:
    """A chart for each pair of a panel, with the same scales."""
    points = [m for line in panel.lines for m in line.having(panel.error)]
    times = [t for m in points for t in (m.time.low, m.time.high)]
    errors = [shown(m.error(panel.error) or 0) for m in points]
    close = min(errors) < _NEAR
    unknowns = max(m.record["dofs"] for m in points)
    low = EPSILON / 8 if close else min(LIMIT, *errors, panel.uncertainty or LIMIT) / 2
    x = Axis("time", "time of a warm solve, s", True, (min(times) / 1.3, max(times) * 1.3))
    name = NORMS[panel.error]
    y = Axis("error", f"relative error: {name}", True, (low, max(1.0, 2 * max(errors))))
    layers = [level(LIMIT, "0.1 %", RED), *([floor_band(unknowns)] if close else [])]
    if panel.uncertainty:
        layers.append(level(panel.uncertainty, "reference ±", MUTED, (6, 4), left=True))
    charts = []
    for pair in panel.pairs:
        lines = [line for line in panel.lines if line.pair == pair]
        title = f"{panel.problem.title}, {pair}: error of {name}, against run time"
        records = [record for line in lines for record in _records(line, panel.error)]
        found = {line.title: looks[line.title] for line in lines}
        charts.append(
            series_chart(
                f"{prefix}{panel.name}-{pair}",
                title,
                records,
                x,
                y,
                found,
                tips=_TIPS,
                layers=layers,
                order="level",
                span=("low", "high"),
                width=460,
            )
        )
    return charts


def _records(line: LevelLine, error: str) -> list[dict[str, object]]:
    """A record for each level; one without a solve has no error, and breaks the line."""
    having = line.having(error)
    return [
        {"series": line.title, "level": m.point.level}
        | (
            {
                "time": _short(m.time.median),
                "low": _short(m.time.low),
                "high": _short(m.time.high),
                "error": _short(shown(m.error(error) or 0)),
                "unknowns": m.record["dofs"],
            }
            if m in having
            else {"time": None, "error": None}
        )
        for m in line.levels
    ]


def _short(value: float) -> float:
    """Four digits, as under the pointer: the page holds thousands of numbers."""
    return float(f"{value:.4g}")


def draw_note(panel: Panel) -> str:
    """How the marks show the levels, in words."""
    levels = ", ".join(map(str, panel.problem.levels))
    return f"Marks grow with the level: {levels} times the divisions of the coarsest mesh."
