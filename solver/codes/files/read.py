"""From files of results to a `ForeignResult`: by extension, a map, or the names of usual codes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import meshio
import numpy as np

from ...case.typed import read_as
from ...case.yaml import read_mapping
from ...mechanics.fem.stress import COMPONENTS
from ...mesh.files.formats import read_apart
from ...system.errors import InputError, hint
from ..foreign import Field, ForeignResult
from .map import CODE, FieldMap, ResultMap
from .raw import Raw, RawField

# Names are compared by letters and digits alone. Pressures are factors of what is positive in
# compression, gaps of what is positive when open.
VECTORS = {
    "displacement": (
        "displacement",
        "displacements",
        "disp",
        "displ",
        "depl",
        "u",
        "rdisplacement",
    ),
    "stress": (
        *("stress", "stresses", "s", "sigma", "cauchystress", "cauchystresstensor"),
        *("cauchystressvector", "siefnoeu", "sigmnoeu", "nodalstress"),
    ),
}
SCALARS = {
    "pressure": {
        **dict.fromkeys(
            ("pressure", "contactpressure", "cpress", "p", "pcontact", "normallm"), 1.0
        ),
        "lagsc": -1.0,  # code_aster: the multiplier, negative in compression
        "augmentednormalcontactpressure": -1.0,  # Kratos
        "contactnormalstress": -1.0,
        "normalcontactstress": -1.0,
    },
    "gap": {
        **dict.fromkeys(("gap", "copen", "jeu", "contactgap", "normalgap"), 1.0),
        "penetration": -1.0,
    },
}
AREA = ("area", "nodalarea", "cnarea")
_AXES = {"x": ("x", "1"), "y": ("y", "2"), "z": ("z", "3")}
_DISPLACEMENT = "(?:d|u|disp|displ|displacement|displacements)"
_STRESS = "(?:s|si|sig|sigma|stress|stresses)"
_LAYOUTS = {
    3: ("xx", "yy", "xy"),
    4: COMPONENTS[:4],
    6: COMPONENTS,
    9: ("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),
}
_IN_PLANE = {"xx", "yy", "xy"}
_TURNED = {"yx": "xy", "zy": "yz", "zx": "xz"}


class Found(NamedTuple):
    """A quantity in a file: the fields that hold its components, and their factor."""

    label: str
    fields: tuple[RawField, ...]
    components: tuple[str, ...]
    factor: float = 1.0


def known(raw: Raw, quantity: str) -> list[Found]:
    """What a file may hold of a quantity, by the names of fields and components."""
    return list(_candidates(raw, quantity))


def _candidates(raw: Raw, quantity: str) -> Iterator[Found]:
    scalars = SCALARS.get(quantity)
    for name, field in raw.fields.items():
        if scalars is None and _plain(name) in VECTORS[quantity] and field.values.shape[1] > 1:
            yield Found(name, (field,), field.components or layout(quantity, field))
        elif scalars and field.values.shape[1] == 1 and _plain(name) in scalars:
            yield Found(name, (field,), (), scalars[_plain(name)])
        for i, component in enumerate(field.components if scalars else ()):
            if scalars and _plain(component) in scalars:
                one = field._replace(values=field.values[:, [i]], components=())
                yield Found(f"{name} {component}", (one,), (), scalars[_plain(component)])
    if scalars is None:
        yield from _columns(raw, quantity)


def _columns(raw: Raw, quantity: str) -> Iterator[Found]:
    """A vector or tensor whose components are fields of their own."""
    wanted = COMPONENTS if quantity == "stress" else tuple("xyz")
    single = {
        component_of(quantity, name): name
        for name, field in raw.fields.items()
        if field.values.shape[1] == 1
    }
    there = tuple(component for component in wanted if component in single)
    if len(there) > 1:
        names = [single[component] for component in there]
        yield Found(" ".join(names), tuple(raw.fields[n] for n in names), there)


def component_of(quantity: str, name: str) -> str:
    """The component (xx, x) that a name means; empty for an unknown name."""
    pattern = _STRESS if quantity == "stress" else _DISPLACEMENT
    axes = "([xyz123])([xyz123])" if quantity == "stress" else "([xyz123])"
    match = re.fullmatch(f"{pattern}?{axes}", _plain(name))
    if not match:
        return ""
    axis = {text: axis for axis, texts in _AXES.items() for text in texts}
    found = "".join(axis[text] for text in match.groups())
    return _TURNED.get(found, found)


def layout(quantity: str, field: RawField) -> tuple[str, ...]:
    """The components of a field that does not name them, by their number; empty for none."""
    count = field.values.shape[1]
    if quantity == "displacement":
        return tuple("xyz"[:count]) if count in (2, 3) else ()
    return _LAYOUTS.get(count, ())


def values(found: Found, quantity: str, where: object) -> tuple[np.ndarray, RawField]:
    """The values of a quantity as the checks want them, and the field that has their places.

    (k,) for scalars, (k, 2 or 3) for a displacement, (k, 6) for a stress, with NaN for a zz that is
    not given. Raises InputError where
    components are missing.
    """
    first = found.fields[0]
    joined = np.concatenate([field.values for field in found.fields], axis=1) * found.factor
    if quantity in SCALARS:
        return joined[:, 0], first
    names = [component_of(quantity, name) or name.lower() for name in found.components]
    if quantity == "displacement":
        axes = [names.index(axis) for axis in "xyz" if axis in names]
        if len(axes) < 2:
            raise _missing(where, found, quantity, names)
        return joined[:, axes], first
    if not set(names) >= _IN_PLANE:
        raise _missing(where, found, quantity, names)
    stress = np.zeros((len(joined), 6))
    stress[:, 2] = np.nan
    for i, name in enumerate(COMPONENTS):
        if name in names:
            stress[:, i] = joined[:, names.index(name)]
    return stress, first


def _missing(where: object, found: Found, quantity: str, names: Sequence[str]) -> InputError:
    wanted = "x and y" if quantity == "displacement" else "xx, yy and xy"
    problem = f"the components of the {quantity} must be known, {wanted} at least: see --map"
    return InputError(where, found.label, ", ".join(names) or None, problem)


def named(raw: Raw, names: Sequence[str], where: object, key: str) -> tuple[RawField, ...]:
    """The fields (or `FIELD COMPONENT`) of these names; InputError for an unknown name."""
    there: dict[str, RawField] = dict(raw.fields)
    for name, field in raw.fields.items():
        for i, component in enumerate(field.components):
            one = field._replace(values=field.values[:, [i]], components=())
            there[f"{name} {component}"] = one
    for name in names:
        if name not in there:
            raise InputError(where, key, name, f"no such field in the result; {hint(name, there)}")
    return tuple(there[name] for name in names)


def areas(fields: Mapping[str, RawField]) -> np.ndarray | None:
    """The areas (k,) of the places of a table, if it has them."""
    for name, field in fields.items():
        if _plain(name) in AREA and field.nodes is None:
            return field.values[:, 0]
    return None


def _plain(name: str) -> str:
    """Letters and digits of a name; that of a field of code_aster without its result's.

    >>> _plain("RESU____SIEF_NOEU"), _plain("Contact pressure")
    ('siefnoeu', 'contactpressure')
    """
    name = re.sub(r"^\w{8}(?=(DEPL|SIEF|SIGM|CONT)(_[A-Z]+)?$)", "", name)
    return re.sub(r"[^a-z0-9]", "", name.lower())


_READERS = {
    ".vtu": ("grids", "read_vtu"),
    ".vtkhdf": ("grids", "read_vtkhdf"),
    ".hdf": ("grids", "read_vtkhdf"),
    ".med": ("grids", "read_med"),
    ".rmed": ("grids", "read_med"),
    ".mmed": ("grids", "read_med"),
    ".e": ("grids", "read_exodus"),
    ".exo": ("grids", "read_exodus"),
    ".ex2": ("grids", "read_exodus"),
    ".frd": ("frd", "read"),
    ".csv": ("tables", "read"),
    ".txt": ("tables", "read"),
    ".dat": ("tables", "read"),
    ".tab": ("tables", "read"),
}
QUANTITIES = ("displacement", "stress", "pressure", "gap")


def read_result_files(
    files: Sequence[Path], names: Path | None = None, code: str = ""
) -> ForeignResult:
    """What the files hold, each quantity once; `names` is the file of a map.

    Raises InputError for files that cannot be read, for a quantity that two fields may be, and for
    files without any.
    """
    mapping = read_as(ResultMap, read_mapping(names), names) if names else ResultMap()
    raws = [(file, read_raw(file, mapping.columns)) for file in files]
    mesh = next((raw.mesh for _, raw in raws if raw.mesh is not None), None)
    found: dict[str, Field] = {}
    for file, raw in raws:
        for quantity in QUANTITIES:
            field = _field(file, raw, quantity, mapping, names)
            if field is None:
                continue
            if quantity in found:
                raise InputError(file, quantity, None, "is in another file of the result too")
            found[quantity] = field if raw.mesh is mesh else replace(field, nodes=None, cells=None)
    if not found:
        there = ", ".join(sorted({name for _, raw in raws for name in raw.fields})) or "none"
        allowed = f"none is known as {', '.join(QUANTITIES)}; fields: {there}; see --map"
        raise InputError(files[0], "fields", None, allowed)
    stated = next((raw.code for _, raw in raws if raw.code), "")
    code = code or mapping.code or stated or "other"
    if not re.fullmatch(CODE, code):
        raise InputError("command line", "--code", code, "must be letters, digits, -, _ and .")
    return ForeignResult(
        code=code,
        version=mapping.version or next((raw.version for _, raw in raws if raw.version), ""),
        mesh=mesh and meshio.Mesh(mesh.points * mapping.length, mesh.cells),
        step=mapping.step,
        digits=min((raw.digits for _, raw in raws if raw.digits), default=None),
        settings=mapping.settings,
        seconds=mapping.seconds,
        **found,  # type: ignore[arg-type]
    )


def read_raw(path: Path, columns: Sequence[str] = ()) -> Raw:
    """The content of one file; raises InputError where it cannot be read."""
    suffix = path.suffix.lower()
    if suffix not in _READERS:
        raise InputError(path, "extension", path.suffix, f"allowed: {', '.join(_READERS)}")
    if not path.is_file():
        raise InputError(path, "result", None, "no such file")
    module, name = _READERS[suffix]
    reader: Callable[..., Any] = getattr(import_module(f".{module}", __package__), name)
    if module == "tables":
        return reader(path, columns)
    return read_apart(reader, path)


def _field(file: Path, raw: Raw, quantity: str, mapping: ResultMap, where: object) -> Field | None:
    """A quantity of one file in the units of the case; None where it has none."""
    given: FieldMap | None = getattr(mapping.fields, quantity)
    found: Found | None
    if given is not None:
        found = _mapped(raw, given, quantity, where)
    else:
        candidates = known(raw, quantity)
        if len(candidates) > 1:
            listed = ", ".join(candidate.label for candidate in candidates)
            raise InputError(file, quantity, None, f"may be one of {listed}: name it with --map")
        found = candidates[0] if candidates else None
    if found is None:
        return None
    numbers, field = values(found, quantity, file)
    length, stress = mapping.length, mapping.stress
    area = areas(raw.fields) if quantity in SCALARS else None
    dim = field.places.shape[1]
    return Field(
        places=field.places * length,
        values=numbers * (stress if quantity in ("stress", "pressure") else length),
        nodes=field.nodes,
        cells=field.cells,
        area=None if area is None else area * length ** (dim - 1),
    )


def _mapped(raw: Raw, given: FieldMap, quantity: str, where: object) -> Found:
    """The fields that the map names."""
    fields = named(raw, given.names, where, f"fields.{quantity}.name")
    count = sum(field.values.shape[1] for field in fields)
    first = fields[0]
    components = given.components or (len(fields) == 1 and first.components) or ()
    if quantity in SCALARS and count == 1:
        components = ()
    if not components and quantity not in SCALARS:
        joined = np.concatenate([field.values for field in fields], axis=1)
        components = layout(quantity, first._replace(values=joined))
    if len(components) != (0 if quantity in SCALARS else count):
        key = f"fields.{quantity}.components"
        problem = f"there are {count} components in the result; name each"
        raise InputError(where, key, ", ".join(components) or None, problem)
    return Found(", ".join(given.names), fields, components, given.factor)
