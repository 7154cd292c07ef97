"""Likely causes of values that fail their check: a sign, a unit, a step, an order."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from ..verification.samples import Sample
from .placing import UNITS

# Values are a multiple of the reference where they differ from it by no more than this share.
_ALIKE = 0.05
_SAME = 0.02


def fault(sample: Sample, names: Sequence[str] = ()) -> str:
    """The change that would make the values (n,) fit, in words; empty if nothing simple does.

    `names` are those of components, whose values follow one another.
    """
    values, reference = sample.values, sample.reference
    if not np.isfinite(values).all() or not np.abs(reference).max(initial=0.0) > 0:
        return ""
    if np.linalg.norm(values - reference) < _SAME * np.linalg.norm(reference):
        return ""  # nearly right, and not by a factor
    if not np.abs(values).max() > 0:
        return "all values are zero"
    if cause := _multiple(values, reference):
        return cause
    if not names:
        return ""
    value, wanted = (array.reshape(len(names), -1) for array in (values, reference))
    return _turned(value, wanted, names) or _exchanged(value, wanted, names)


def _multiple(values: np.ndarray, reference: np.ndarray) -> str:
    """The factor between the values and the reference, in words."""
    ratio = float(values @ reference / (reference @ reference))
    if np.linalg.norm(values - ratio * reference) > _ALIKE * np.linalg.norm(values):
        return ""
    sign = "the opposite sign" if ratio < 0 else ""
    size = abs(ratio)
    if abs(size - 1) < _SAME:
        return f"values have {sign}" if sign else ""
    for factor, text in UNITS.items():
        if abs(size / factor - 1) < _SAME:
            unit = f"values are {text} times the reference: another unit?"
            return f"{unit[:-1]}, and {sign}?" if sign else unit
    also = f", with {sign}" if sign else ""
    if size < 1:
        half = "half" if abs(size - 0.5) < _SAME else f"{size:.3g}"
        return f"values are {half} of the reference{also}: an earlier load step?"
    return f"values are {size:.4g} times the reference{also}"


def _turned(value: np.ndarray, wanted: np.ndarray, names: Sequence[str]) -> str:
    """Components that have the opposite sign, where the others fit."""
    size = np.linalg.norm(wanted)
    plus, minus = (np.linalg.norm(value - s * wanted, axis=1) for s in (1.0, -1.0))
    turned = (minus < plus) & (np.linalg.norm(wanted, axis=1) > _SAME * size)
    if np.linalg.norm(np.minimum(plus, minus)) > _ALIKE * size or not turned.any():
        return ""
    odd = [n for n, t in zip(names, turned, strict=True) if t]
    return f"components with the opposite sign: {', '.join(odd)}: a mirrored mesh?"


def _exchanged(value: np.ndarray, wanted: np.ndarray, names: Sequence[str]) -> str:
    """Components in another order."""
    # Components that are all but zero may be in any order.
    most = min(_ALIKE * np.linalg.norm(wanted), np.linalg.norm(value - wanted) / 2)
    for order in permutations(range(len(names))):
        odd = [(names[i], n) for n, i in zip(names, order, strict=True) if names[i] != n]
        if odd and np.linalg.norm(value[list(order)] - wanted) < most:
            listed = ", ".join(f"{found} in place of {name}" for found, name in odd)
            return f"components are in another order: {listed}"
    return ""


def summed_up(faults: dict[str, str]) -> str:
    """The faults by quantity in one line: equal ones are listed together."""
    by_fault: dict[str, list[str]] = {}
    for name, cause in faults.items():
        by_fault.setdefault(cause, []).append(name.replace("_", " "))
    return "; ".join(f"{', '.join(names)}: {cause}" for cause, names in by_fault.items())
