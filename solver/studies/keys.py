"""Types of keys that several study files have in common."""

from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from msgspec import Meta

from ..case.typed import ONCE

Cut = Literal["pyramids", "hexahedra"]
Recovered = Literal["none", "linear", "quadratic", "smooth", "automatic"]
if TYPE_CHECKING:  # cells, errors and degrees are looked up by text
    Cell: TypeAlias = str
    ErrorName: TypeAlias = str
    Degree: TypeAlias = str
else:
    Cell = Annotated[
        Literal[
            "TRIA3", "TRIA6", "QUAD4", "QUAD8", "QUAD9", "TETRA4", "TETRA10",
            "HEXA8", "HEXA20", "HEXA27", "PENTA6", "PENTA15", "PYRA5", "PYRA13",
        ],
        Meta(description="a cell type such as TRIA3 or HEXA20"),
    ]  # fmt: skip
    ErrorName = Literal[
        "displacement_l2", "displacement_h1", "stress_l2", "stress_max", "pressure_l2",
        "pressure_max", "pressure_means", "pressure_total", "pressure_oscillation",
        "pressure_inner", "half_width", "peak",
    ]  # fmt: skip
    Degree = Literal["linear", "quadratic"]
Name = Annotated[
    str,
    Meta(
        pattern=r"^[a-z0-9][a-z0-9-]{0,31}$(?!\n)",
        description="a name of small letters, digits and `-`, at most 32",
    ),
]
Count = Annotated[int, Meta(ge=1, le=1024, description="a whole number from 1 to 1024")]
Counts = Annotated[tuple[Count, ...], ONCE]
Seconds = Annotated[float, Meta(gt=0, le=1e9, description="a positive number of seconds")]
Unknowns = Annotated[
    float, Meta(ge=100, le=1e8, description="a number of unknowns from 100 to 1e8")
]
