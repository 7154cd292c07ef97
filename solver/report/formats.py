"""Numbers and lists as the tables of the report show them."""

from collections.abc import Mapping, Sequence
from typing import Any

NOTHING = "–"


def number(value: float | None) -> str:
    """Six significant digits, and no negative zero."""
    return NOTHING if value is None else f"{value + 0.0:.6g}"


def error(value: float | None) -> str:
    """Two digits and the power of ten; a zero is a zero."""
    return NOTHING if value is None else "0" if value == 0 else f"{value:.1e}"


def extremes(pair: Sequence[float] | None, scale: float | None = None) -> str:
    """Minimum … maximum; one number where both show alike; round-off of `scale` shown as such."""
    if not pair:
        return NOTHING
    low, high = (_near_zero(value, scale) for value in pair)
    return low if low == high else f"{low} … {high}"


def _near_zero(value: float, scale: float | None) -> str:
    return f"{value:.1e}" if scale and 0 < abs(value) < 1e-6 * scale else number(value)


def seconds(value: float | None) -> str:
    """Three digits at most."""
    return NOTHING if value is None else f"{value:.3g} s" if value >= 0.1 else f"{value:.2f} s"


def cells(body: Mapping[str, Any]) -> str:
    """Cells of a body by type."""
    return ", ".join(f"{kind}" for kind in body["cells"])


def against(count: int, reference: int | None) -> str:
    """A count beside the reference code's."""
    return f"{count}" if reference is None else f"{count} / {reference}"


def digits(value: float | None) -> str:
    """All the digits there are."""
    return NOTHING if value is None else f"{value + 0.0:.15g}"
