"""From files of results to a `ForeignResult`: by extension, known names and a map."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from ...mesh.files.apart import read_apart
from ...system.errors import InputError
from ..foreign import Field, ForeignResult
from . import names
from .map import CODE, FieldMap, ResultMap
from .raw import Raw

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
_NO_MAP = ResultMap()


def read_result_files(
    files: Sequence[Path], mapping: ResultMap = _NO_MAP, where: object = "", code: str = ""
) -> ForeignResult:
    """What the files hold, each quantity once; `where` is the file of the map.

    Raises InputError for files that cannot be read, for a quantity that two fields may be, and for
    files without any.
    """
    raws = [(file, read_raw(file, mapping.columns)) for file in files]
    mesh = next((raw.mesh for _, raw in raws if raw.mesh is not None), None)
    found: dict[str, Field] = {}
    for file, raw in raws:
        for quantity in QUANTITIES:
            field = _field(file, raw, quantity, mapping, where)
            if field is None:
                continue
            if quantity in found:
                raise InputError(file, quantity, None, "is in another file of the result too")
            found[quantity] = field if raw.mesh is mesh else replace(field, nodes=None)
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
    found: names.Found | None
    if given is not None:
        found = _mapped(raw, given, quantity, where)
    else:
        candidates = names.known(raw, quantity)
        if len(candidates) > 1:
            listed = ", ".join(candidate.label for candidate in candidates)
            raise InputError(file, quantity, None, f"may be one of {listed}: name it with --map")
        found = candidates[0] if candidates else None
    if found is None:
        return None
    values, field = names.values(found, quantity, file)
    length, stress = mapping.length, mapping.stress
    area = names.areas(raw.fields) if quantity in names.SCALARS else None
    dim = field.places.shape[1]
    return Field(
        places=field.places * length,
        values=values * (stress if quantity in ("stress", "pressure") else length),
        nodes=field.nodes,
        area=None if area is None else area * length ** (dim - 1),
    )


def _mapped(raw: Raw, given: FieldMap, quantity: str, where: object) -> names.Found:
    """The fields that the map names."""
    fields = names.named(raw, given.names, where, f"fields.{quantity}.name")
    count = sum(field.values.shape[1] for field in fields)
    first = fields[0]
    components = given.components or (len(fields) == 1 and first.components) or ()
    if quantity in names.SCALARS and count == 1:
        components = ()
    if not components and quantity not in names.SCALARS:
        joined = np.concatenate([field.values for field in fields], axis=1)
        components = names.layout(quantity, first._replace(values=joined))
    if len(components) != (0 if quantity in names.SCALARS else count):
        key = f"fields.{quantity}.components"
        problem = f"there are {count} components in the result; name each"
        raise InputError(where, key, ", ".join(components) or None, problem)
    return names.Found(", ".join(given.names), fields, components, given.factor)
