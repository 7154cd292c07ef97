"""The map of a result: what its fields are called, and in which units they are.

code: mycode                   # the name in <case>@<code>
version: "1.2"
length: 1000                   # one length of the result in lengths of the case (m to mm)
stress: 1.0e-6                 # one stress of the result in stresses of the case (Pa to MPa)
fields:
  displacement: {name: [ux, uy]}
  stress: {name: SIG, components: [xx, yy, zz, xy, xz, yz]}
  pressure: {name: lambda_n, factor: -1}
columns: [x, y, z, lambda_n]   # of a table without a line of names
"""

from typing import Annotated, Literal

from msgspec import Meta, field

from ...case.typed import ONCE, FieldError, Number, Positive, Section, Text, Version

Component = Literal["x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz", "yx", "zy", "zx"]
Names = Annotated[tuple[Text, ...], ONCE]
CODE = r"^[A-Za-z0-9._-]+$"
CodeName = Annotated[str, Meta(pattern=CODE, description="letters, digits, -, _ and .")]


class FieldMap(Section, frozen=True):
    """A field, or one for each component.

    name: its name in the result, or a list of one name for each component; `FIELD COMPONENT` names
      a component
    components: in their order
    factor: what its values are multiplied with, besides units: -1 turns a sign
    """

    name: Text | Names
    components: Annotated[tuple[Component, ...], ONCE] = ()
    factor: Number = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the fields."""
        return (self.name,) if isinstance(self.name, str) else self.name


class FieldsMap(Section, frozen=True):
    """The fields that are not found by their names.

    displacement: two or three components
    stress: xx, yy, zz and xy at least (in plane stress without zz), positive in tension
    pressure: of contact, positive in compression
    gap: positive when open
    """

    displacement: FieldMap | None = None
    stress: FieldMap | None = None
    pressure: FieldMap | None = None
    gap: FieldMap | None = None


class ResultMap(Section, frozen=True):
    """What the fields of a result are called, and in which units they are.

    code: the name of the code, as in <case>@<code>
    version: of the code
    length: one length of the result, in lengths of the case
    stress: one stress of the result, in stresses of the case
    step: the load factor of the values
    fields: those that are not found by their names
    columns: of a table without a line of names
    settings: of the code, to be shown
    seconds: how long the code took
    """

    code: CodeName | None = None
    version: Version | None = None
    length: Positive = 1.0
    stress: Positive = 1.0
    step: Number | None = None
    fields: FieldsMap = FieldsMap()
    columns: Annotated[tuple[Text, ...], ONCE] = ()
    settings: dict[str, str] = field(default_factory=dict)
    seconds: Positive | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.columns and not {"x", "y"} <= {name.lower() for name in self.columns}:
            raise FieldError(("columns",), "must name x and y", list(self.columns))
