"""Files declared as types: a class names the keys of a file, reads it, and is its JSON Schema.

    class Way(Section, frozen=True):
        title: Text
        solver: Literal["auto", "cholmod"] = "auto"
        sizes: Annotated[tuple[Size, ...], ONCE] = ()

`read_as` turns the content of a file into an object of the class. A value that does not fit is
refused with its key and what is allowed. The words for that are the `description` in the type's
`Meta`; a type without one is described by its parts.
"""

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import cache, partial
from inspect import getdoc
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin

import msgspec
from msgspec import Meta, Struct

from ..system.errors import InputError, hint, key_path

Text = Annotated[str, Meta(min_length=1, description="text")]
Version = Annotated[str, Meta(min_length=1, description="text (in quotes if it is a number)")]
Number = Annotated[float, Meta(ge=-1e30, le=1e30, description="a number from -1e30 to 1e30")]
Positive = Annotated[
    float, Meta(ge=1e-30, le=1e30, description="a positive number from 1e-30 to 1e30")
]
ONCE = Meta(min_length=1, extra_json_schema={"uniqueItems": True})
"""Of a list: it has items, and they differ."""

_WORDS = {
    Path: "the path of a file",
    str: "text",
    bool: "true or false",
    int: "a whole number",
    float: "a number",
}
Keys = tuple[str | int, ...]
Convert = Callable[[Any, Any], Any]
AnySection = TypeVar("AnySection", bound="Section")


class FieldError(ValueError):
    """A fault of a value in a section, with the keys that lead to the value."""

    def __init__(self, keys: Keys, problem: str, value: object = None):
        self.keys, self.problem, self.value = keys, problem, value
        super().__init__(problem)


class _UnknownKeyError(FieldError):
    """A key that a section does not have."""


class Section(Struct, frozen=True, forbid_unknown_fields=True):
    """A mapping in a file, with a field for each key.

    A subclass may check its values in `__post_init__`, and raise `FieldError`. `out_of_scope`: keys
    that are refused for a reason, wherever they are in a file that is read as the subclass.
    """

    out_of_scope: ClassVar[Mapping[str, str]] = {}

    def __post_init__(self) -> None:
        for name in _different(type(self)):
            items = getattr(self, name) or ()
            if len({repr(item) for item in items}) < len(items):
                allowed = f"must be {described(fields(type(self))[name].type)}, each once"
                raise FieldError((name,), allowed)


def read_as(
    kind: type[AnySection], content: object, where: str | Path, key: str = ""
) -> AnySection:
    """An object of the class from the content of the file `where`; raises `InputError`.

    A `Path` in the class is a file that has to be there, named relative to `where`. `key`: the
    content is what the file has under this key.
    """
    convert = partial(msgspec.convert, dec_hook=partial(_file_beside, where))
    try:
        if not _null(content):
            return convert(content, kind)
    except msgspec.ValidationError:
        pass
    fault = _fault(convert, content, kind, (key,) if key else ())
    if isinstance(fault, _UnknownKeyError):
        name = str(fault.keys[-1])
        fault.problem = kind.out_of_scope.get(name.lower(), fault.problem)
    raise InputError(where, key_path(fault.keys) or "file", fault.value, fault.problem)


def _file_beside(where: str | Path, kind: type, value: object) -> Path:
    if kind is not Path or not isinstance(value, str) or not value:
        raise FieldError((), f"must be {_WORDS[Path]}")
    file = Path(where).parent / value
    if not file.is_file():
        raise FieldError((), "no such file")
    return file


def refuse_duplicates(key: str, items: Iterable[Any]) -> None:
    """Raise `FieldError` for the first name in a list, under `key`, that occurs twice."""
    seen: set[str] = set()
    for i, item in enumerate(items):
        if item.name in seen:
            raise FieldError((key, i, "name"), "the name is given twice; each needs its own")
        seen.add(item.name)


def refuse_unknown(keys: Keys, name: str, kind: str, known: Collection[str]) -> None:
    """Raise `FieldError` for an unknown name of its kind."""
    if name not in known:
        raise FieldError(keys, f"no such {kind}; {hint(name, known)}")


def json_schema(kind: type[Section], **alternatives: Collection[type[Section]]) -> dict[str, Any]:
    """The JSON Schema of a class, for editors.

    `alternatives`: of a key that the class leaves open, the classes of what it may be.
    """
    others = [other for kinds in alternatives.values() for other in kinds]
    (schema, *parts), definitions = msgspec.json.schema_components(
        (kind, *others), schema_hook=lambda _: {"type": "string"}, ref_template="#/$defs/{name}"
    )
    for key, kinds in alternatives.items():
        options, parts = parts[: len(kinds)], parts[len(kinds) :]
        open_key = definitions[kind.__name__]["properties"][key]
        definitions[kind.__name__]["properties"][key] = {"anyOf": options} | {
            name: open_key[name] for name in ("description",) if name in open_key
        }
    schema = {**schema, "$defs": definitions}
    for part in schema["$defs"].values():
        part["description"], titles = _headed(part.get("description", ""))
        for name, key in part["properties"].items():
            if key.get("default", 0) in (None, "", [], (), {}):  # the key may be left out
                del key["default"]
            others = [one for one in key.get("anyOf", ()) if one != {"type": "null"}]
            if len(others) < len(key.get("anyOf", ())):
                del key["anyOf"]
                key.update(others[0] if len(others) == 1 else {"anyOf": others})
            if name in titles:
                key["title"] = titles[name]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def titles_of(kind: type[Section]) -> dict[str, str]:
    """The titles of a class's keys, from the lines `key: title` of its docstring."""
    return _headed(getdoc(kind) or "")[1]


def _headed(text: str) -> tuple[str, dict[str, str]]:
    """The first part of a docstring, and its titles; further lines of a title are indented."""
    found = re.findall(r"^([a-z_]+): (.+(?:\n {2,}.+)*)$", text, re.MULTILINE)
    head = text.split("\n\n", maxsplit=1)[0]
    return " ".join(head.split()), {key: " ".join(title.split()) for key, title in found}


@cache
def fields(kind: type[Section]) -> dict[str, Any]:
    """The keys of a class, with their types and defaults."""
    return {field.encode_name: field for field in msgspec.structs.fields(kind)}


Read = Callable[[str, Any, Keys], Any]


def read_marked(section: AnySection, keys: Keys, read: Read) -> AnySection:
    """The section with those values read further whose type is marked.

    The mark is `extra={"read": MARK}` in its `Meta`; `read` takes the mark, the value, its keys.
    """
    changed = {}
    for name, field in fields(type(section)).items():
        value = getattr(section, field.name)
        if isinstance(value, Section):
            changed[field.name] = read_marked(value, (*keys, name), read)
        elif value is not None and (mark := _mark(field.type)):
            changed[field.name] = read(mark, value, (*keys, name))
    return msgspec.structs.replace(section, **changed)


def _mark(kind: Any) -> str:
    """The outermost mark of a type, also of a type that may be left out."""
    if get_origin(kind) is Annotated:
        marks = (meta.extra["read"] for meta in reversed(kind.__metadata__) if meta.extra)
        return next(marks, "") or _mark(kind.__origin__)
    if get_origin(kind) in (Union, UnionType):
        return next(filter(None, map(_mark, get_args(kind))), "")
    return ""


def described(kind: Any) -> str:
    """The values that a type allows, in words."""
    if said := _description(kind):
        return said
    kind = _bare(kind)
    if get_origin(kind) is Literal:
        *rest, last = map(str, get_args(kind))
        return f"{', '.join(rest)} or {last}" if rest else last
    if is_section(kind):
        return f"{{{', '.join(fields(kind))}}}"
    if get_origin(kind) in (list, tuple):
        return f"a list of {described(get_args(kind)[0])}"
    if get_origin(kind) is dict:
        return "a mapping of keys to values"
    parts = [part for part in parts_of(kind) if part is not NoneType]
    return _WORDS.get(kind) or " or ".join(map(described, parts if parts != [kind] else []))


def is_section(kind: Any) -> bool:
    """Whether a type is a mapping with a field for each key."""
    return isinstance(kind, type) and issubclass(kind, Section)


def _description(kind: Any) -> str:
    """The description in the `Meta` of a type, also of a type that may be left out."""
    if get_origin(kind) is Annotated:
        said = (getattr(meta, "description", None) for meta in reversed(kind.__metadata__))
        return next(filter(None, said), "") or _description(kind.__origin__)
    if get_origin(kind) in (Union, UnionType):
        others = [part for part in get_args(kind) if part is not NoneType]
        return _description(others[0]) if len(others) == 1 else ""
    return ""


def _bare(kind: Any) -> Any:
    return _bare(kind.__origin__) if get_origin(kind) is Annotated else kind


def parts_of(kind: Any) -> list[Any]:
    """The members of a union, or the type itself."""
    kind = _bare(kind)
    if get_origin(kind) in (Union, UnionType):
        return [part for member in get_args(kind) for part in parts_of(member)]
    return [kind]


@cache
def _different(kind: type[Section]) -> list[str]:
    """The fields whose items must differ."""
    return [
        field.name
        for field in fields(kind).values()
        for meta in getattr(field.type, "__metadata__", ())
        if meta.extra_json_schema and "uniqueItems" in meta.extra_json_schema
    ]


def _null(value: object) -> Keys:
    """The path to the first key that has no value; empty if every key has one."""
    if isinstance(value, dict):
        items = value.items()
        return next(((k, *inner) for k, v in items if (inner := _null(v)) or v is None), ())
    places = enumerate(value) if isinstance(value, list) else ()
    return next(((i, *inner) for i, v in places if (inner := _null(v))), ())


def _fits(convert: Convert, value: object, kind: Any) -> bool:
    try:
        convert(value, kind)
    except msgspec.ValidationError:
        return False
    return not _null(value)


def _fault(convert: Convert, value: Any, kind: Any, keys: Keys) -> FieldError:
    """The innermost value that does not fit its type, and why."""
    for part in parts_of(kind):
        if not _is_like(part, value):
            continue
        if is_section(part) and (fault := _wrong_key(value, fields(part), keys)):
            return fault
        for key, item, inner in _children(convert, value, part):
            if inner is None:
                of_key = get_args(part)[0]
                names = get_args(_bare(of_key)) if get_origin(_bare(of_key)) is Literal else ()
                problem = f"unknown key; {hint(str(key), names)}" if names else ""
                problem = problem or f"the key must be {described(of_key)}"
                return FieldError((*keys, key), problem, item)
            if (item is None and isinstance(value, dict)) or not _fits(convert, item, inner):
                return _fault(convert, item, inner, (*keys, key))
    try:
        convert(value, kind)
    except msgspec.ValidationError as error:
        if isinstance(own := error.__cause__, FieldError):
            for key in own.keys:
                value = value.get(key) if isinstance(value, dict) else value[key]
            return FieldError((*keys, *own.keys), own.problem, value)
    # `2,5`, as some countries write it, is text.
    point = "; write numbers with a point" * bool(re.fullmatch(r"-?\d+,\d+", str(value)))
    words, empty = described(kind), FieldError((*keys, *_null(value)), "must have a value")
    return FieldError(keys, f"must be {words}{point}", value) if words else empty


def _is_like(kind: Any, value: object) -> bool:
    """Whether a type is of mappings as the value is one, or of lists as it is one."""
    if isinstance(value, dict):
        return is_section(kind) or get_origin(kind) is dict
    return isinstance(value, list) and get_origin(kind) in (list, tuple)


def _wrong_key(value: Any, known: Any, keys: Keys) -> FieldError | None:
    """The first key that is unknown, else the first that is missing."""
    for key in value:
        if key not in known:
            return _UnknownKeyError((*keys, key), f"unknown key; {hint(key, known)}", value[key])
    missing = (name for name in known if known[name].required and name not in value)
    name = next(missing, None)
    return name and FieldError((*keys, name), "this key is needed")


def _children(convert: Convert, value: Any, kind: Any) -> Iterator[tuple[str | int, object, Any]]:
    """The keys of a value, what each holds, and its type; None as the type of an unknown key."""
    if is_section(kind):
        yield from ((key, item, fields(kind)[key].type) for key, item in value.items())
    elif get_origin(kind) is dict:
        of_key, of_item = get_args(kind)
        for key, item in value.items():
            yield key, item, of_item if _fits(convert, key, of_key) else None
    else:
        inner = get_args(kind)
        for i, item in enumerate(value):
            yield i, item, inner[i] if len(inner) > i and Ellipsis not in inner else inner[0]
