"""A plot's frame: scales, ticks, labels, linear or logarithmic."""

from dataclasses import dataclass

import numpy as np

from .svg import INK, MUTED, RULE, Drawing, Style

EPSILON = float(np.finfo(float).eps)
# The colour of the round-off floor.
FLOOR = "#e6eaee"


@dataclass(frozen=True)
class Scale:
    """Maps values from [low, high] to pixels [start, end], linearly or by decades."""

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def __call__(self, values: object) -> np.ndarray:
        """Pixels of values of any shape."""
        low, high, values = self._flat(self.low), self._flat(self.high), self._flat(values)
        return self.start + (values - low) / (high - low) * (self.end - self.start)

    def _flat(self, values: object) -> np.ndarray:
        array = np.asarray(values, dtype=float)
        return np.log10(array) if self.log else array

    def ticks(self) -> list[float]:
        """Round values in range: decades, or steps of 1, 2 or 5."""
        if self.log:
            return self._decades()
        rough = (self.high - self.low) / 5
        decade = 10.0 ** np.floor(np.log10(rough))
        step = decade * next(m for m in (1, 2, 5, 10) if m * decade >= rough * 0.999)
        first = np.ceil(self.low / step - 1e-9)
        last = np.floor(self.high / step + 1e-9)
        return [float(k * step) + 0.0 for k in np.arange(first, last + 1)]  # + 0.0: no -0

    def _decades(self) -> list[float]:
        first, last = np.floor(np.log10(self.low)), np.floor(np.log10(self.high))
        step = max(1, round((last - first) / 8))
        between = (1, 2, 5) if last - first <= 3 else (1,)
        ticks = [m * 10.0**k for k in np.arange(first, last + 1, step) for m in between]
        return [tick for tick in ticks if self.low <= tick <= self.high]

    def label(self, value: float) -> str:
        """A tick's text."""
        if not self.log:
            return f"{value:.6g}"
        power = int(np.floor(np.log10(value) + 1e-9))
        if -2 <= power <= 3:
            return f"{value:g}"
        mantissa = round(value / 10.0**power)
        factor = "" if mantissa == 1 else f"{mantissa}·"
        return f"{factor}10" + f"{power}".translate(_SUPERSCRIPT)


_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def draw_axes(
    drawing: Drawing,
    x: Scale,
    y: Scale,
    x_label: str,
    y_label: str,
    numbered: bool = True,
    bottom: float | None = None,
) -> None:
    """Grid lines, ticks and labels of a plot.

    `numbered`: the ticks of y have their values; `bottom`: where the axis of x lies, if not at
    the end of y.
    """
    left, right, top = x.start, x.end, y.end
    bottom = y.start if bottom is None else bottom
    for value in y.ticks():
        at = float(y(value))
        drawing.line(left, at, right, at, stroke=RULE, stroke_width=0.6)
        if numbered:
            drawing.text(left - 6, at + 4, y.label(value), "end", color=MUTED)
    for value in x.ticks():
        at = float(x(value))
        drawing.line(at, bottom, at, bottom + 4, stroke=MUTED, stroke_width=0.8)
        drawing.text(at, bottom + 16, x.label(value), "middle", color=MUTED)
    drawing.line(left, bottom, right, bottom, stroke=MUTED, stroke_width=0.8)
    drawing.text((left + right) / 2, bottom + 33, x_label, "middle", color=INK)
    drawing.text(left, top - 10, y_label, color=INK)


def draw_level(
    drawing: Drawing,
    x: Scale,
    y: Scale,
    value: float,
    label: str,
    color: str,
    dashes: tuple[float, ...] = (),
    lowered: float = 0.0,
) -> None:
    """A line across the plot at a value, its label on the right of it, `lowered` by some pixels."""
    at = float(y(value))
    dashed: dict[str, Style] = {"stroke_dasharray": dashes} if dashes else {}
    drawing.line(x.start, at, x.end, at, stroke=color, stroke_width=1.2, **dashed)
    drawing.text(x.end + 8, at + 4 + lowered, label, color=color)


def round_off(unknowns: int) -> tuple[float, float]:
    """The round-off floor: the unit round-off ε, and ε√N for N unknowns."""
    return EPSILON, EPSILON * max(1, unknowns) ** 0.5


def draw_floor(drawing: Drawing, x: Scale, y: Scale, unknowns: int, labelled: bool = True) -> None:
    """The band of round-off from ε to ε√N, N `unknowns`."""
    low, high = round_off(unknowns)
    top, bottom = float(y(high)), float(y(low))
    drawing.rectangle(x.start, top, x.end - x.start, bottom - top, fill=FLOOR)
    if labelled:
        drawing.text(x.end + 8, bottom + 4, f"ε = {low:.1e}", color=MUTED)
        drawing.text(x.end + 8, min(top, bottom - 12) + 4, f"ε√N = {high:.1e}", color=MUTED)
