"""Units as labels of numbers. Nothing is computed with them."""

from collections.abc import Mapping

import h5py
import numpy as np

# The kind of quantity of each field of a result.
_KINDS = {
    "Points": "length",
    "centre": "length",
    "displacement": "length",
    "friction_traction": "stress",
    "gap": "length",
    "multiplier": "stress",
    "normal_stress": "stress",
    "pressure": "stress",
    "pressure_error_estimate": "stress",
    "recovered_pressure": "stress",
    "slip": "length",
    "slip_total": "length",
    "stress": "stress",
    "stress_master": "stress",
    "stress_slave": "stress",
}


def label_fields(grid: h5py.Group, contact: h5py.Group, units: Mapping[str, str]) -> None:
    """Give the fields in both groups of a result their `unit`.

    `units` maps length and stress to their names. VTK shows no attributes, so the grid also lists
    the units of its fields as the field data `units`.
    """
    _label(contact, units)
    if listed := _label(grid, units):
        # VTK crashes on texts that are not declared as ASCII; their bytes may be UTF-8.
        texts = np.array([text.encode() for text in sorted(listed)], dtype=object)
        grid.create_dataset("FieldData/units", data=texts, dtype=h5py.string_dtype("ascii"))
        if "Steps" in grid:  # the same at all positions
            count = int(grid["Steps"].attrs["NSteps"])
            grid["Steps/FieldDataOffsets/units"] = np.zeros(count, dtype=np.int64)
            grid["Steps/FieldDataSizes/units"] = np.tile([1, len(texts)], (count, 1))


def _label(group: h5py.Group, units: Mapping[str, str]) -> set[str]:
    """Label the fields in a group; each with its unit as one text."""
    names: list[str] = []
    group.visit(names.append)  # opens none of them, which takes most of the time in a small result
    labelled = set()
    for name in names:
        field = name.rpartition("/")[2]
        unit = units.get(_KINDS.get(field, ""))
        if name.startswith("Steps/"):
            continue
        if unit is not None and isinstance(group[name], h5py.Dataset):
            group[name].attrs["unit"] = unit
            labelled.add(f"{field}: {unit}")
    return labelled


# The names of forces where they are products of these lengths and stresses.
_FORCES = {("mm", "MPa"): "N", ("m", "Pa"): "N", ("m", "kPa"): "kN", ("m", "MPa"): "MN"}


def derived(units: Mapping[str, str], spatial: bool) -> dict[str, str]:
    """The units of length, stress, area, force, moment and energy; empty without length or stress.

    In plane cases, not `spatial`, forces, moments and energies are per thickness, and an area of
    contact is a length.
    """
    length, stress = units.get("length"), units.get("stress")
    if not (length and stress):
        return dict(units)
    force = _FORCES.get((length, stress), f"{stress}·{length}²")
    found = {"area": f"{length}²", "force": force, "moment": f"{force}·{length}"}
    if not spatial:
        found = {"area": length, "force": f"{force}/{length}", "moment": force}
    return dict(units) | found | {"energy": found["moment"]}


def with_unit(text: str, unit: str | None) -> str:
    """The text of a label with its unit, if there is one."""
    return f"{text} [{unit}]" if unit else text


# No share is shown as less than a thousandth of a percent.
_LEAST = 1e-5


def percent(share: float) -> str:
    """A bound in percent, two digits of it, and 0.001 % at least.

    >>> percent(0.0412), percent(1e-9), percent(3.2)
    ('4.1 %', '0.001 %', '320 %')
    """
    rounded = float(f"{100 * max(share, _LEAST):.2g}")
    return f"{rounded:g} %"
