"""Charts of the inf-sup constants level by level, and of the half-loaded block's pressure."""

from collections.abc import Sequence
from dataclasses import replace

from ...report.charts import INK, ORANGE, Axis, Chart, Look, distinct, look_of, series_chart
from .description import InfSupLadder
from .half_loaded import CELLS, PressureProfile

# β_h below is drawn at the foot of the chart.
_RANGE = 0.02, 2.0


def draw_constants(title: str, ladders: Sequence[InfSupLadder]) -> Chart:
    """β_h against the slave divisions, log–log; without the cut dashed."""
    ladders = sorted(ladders, key=lambda one: not one.cut)
    records = [
        {"series": each.kind, "faces": level, "constant": max(constant, _RANGE[0])}
        for each in ladders
        for level, constant in zip(each.levels, each.constants, strict=False)
    ]
    looks = {
        each.kind: replace(look_of(each.cells), dashes=() if each.cut else (5.0, 3.0))
        for each in ladders
    }
    return series_chart(
        f"infsup-{title}",
        f"Inf-sup constant by level: {title}",
        records,
        Axis("faces", "slave faces along an edge of the interface", log=True),
        Axis("constant", f"βₕ, {title}", log=True, domain=_RANGE),
        distinct(looks),
        width=460,
    )


def draw_profiles(profiles: Sequence[PressureProfile]) -> list[Chart]:
    """The pressure along the interface, cut and uncut: of bilateral contact, and that opens."""
    cells = profiles[0].cells
    looks = {"with the cut" if CELLS[cells] else "needs no cut": Look(INK)}
    looks |= {"without": Look(ORANGE, "square", (5.0, 3.0))} if CELLS[cells] else {}
    charts = []
    for what in ("bilateral", "opening"):
        records = [
            {"series": next(iter(looks)) if profile.cut else "without", "x": x, "p": p}
            for profile in profiles
            if profile.bilateral is (what == "bilateral")
            for x, p in zip(profile.place, profile.pressure, strict=True)
        ]
        title = f"Pressure under a half-loaded block, {cells}, {what}"
        name = f"half-loaded-{cells}-{what}"
        if not records:
            continue
        x, y = Axis("x", "x"), Axis("p", f"p / 25, {cells}, {what}", zero=True)
        charts.append(series_chart(name, title, records, x, y, looks, marks=12, width=460))
    return charts
