"""The kinds of values that several keys of a case file share."""

from typing import Annotated, Literal

from msgspec import Meta

from .typed import Number, Text

Name = Annotated[
    str,
    Meta(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$(?!\n)",
        description="a name of letters, digits, `_`, `-` and `.`, 64 at most, starting with a "
        "letter or digit (in quotes if it is a number)",
    ),
]
_GROUP = "the name of a group of the mesh (in quotes if it is a number)"
Group = Annotated[str, Meta(min_length=1, max_length=200, description=_GROUP)]
_GROUPS = f"{_GROUP}, or a list of such names"
GroupList = Annotated[tuple[Group, ...], Meta(min_length=1)]
Groups = Annotated[Group | GroupList, Meta(description=_GROUPS)]
_UNIT = "the name of a unit, 20 letters, digits, `/`, `*`, `^`, `²` and the like at most"
Unit = Annotated[str, Meta(pattern=r"^[\w/*^·²³µ%()-]{1,20}$(?!\n)", description=_UNIT)]
Whole = Annotated[int, Meta(ge=0, lt=2**31, description="a whole number, not negative, below 2^31")]
Angle = Annotated[Number, Meta(description="an angle in degrees")]
_VECTOR = "a list of two (plane) or three numbers"
Vector = Annotated[tuple[Number, ...], Meta(min_length=2, max_length=3, description=_VECTOR)]
_SCALAR = "a number or an expression (numbers from -1e30 to 1e30)"
Scalar = Annotated[Number | Text, Meta(description=_SCALAR)]
_SCALARS = "a list of two (plane) or three numbers or expressions, or `solution`"
_Scalars = Annotated[tuple[Scalar, ...], Meta(min_length=2, max_length=3)]
Scalars = Annotated[_Scalars | Literal["solution"], Meta(description=_SCALARS)]
