"""The keys of `mesh:` in a case file, as a type for each recipe; see `recipes`."""

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from msgspec import Meta

from ..case.typed import FieldError, Number, Positive, Section, Text, fields
from ..lac.cells.catalogue import BY_NAME

LARGEST = 1e150
"""The largest magnitude of a coordinate: the square of twice it is finite."""

if TYPE_CHECKING:  # cells are looked up by text
    Cells: TypeAlias = str
else:
    Cells = Literal[tuple(name for name, cell in BY_NAME.items() if cell.dim > 1)]
Pieces = Annotated[int, Meta(ge=1, le=100_000, description="a whole number from 1 to 100000")]
_PIECES = "a whole number from 1 to 100000, or a list of one for each axis"
Divisions = Annotated[Pieces | tuple[Pieces, ...], Meta(description=_PIECES)]
_LENGTHS = "a positive number, or a list of one for each axis"
Lengths = Annotated[Positive | tuple[Positive, ...], Meta(description=_LENGTHS)]
_Height = Annotated[float, Meta(gt=-0.5, lt=0.5, description="a number between -0.5 and 0.5")]
_Share = Annotated[float, Meta(gt=0, le=1, description="a share of the side, at most 1")]


def each(value: Any, count: int, key: str) -> list[Any]:
    """A value for each of `count` axes, where one stands for all. Raises FieldError."""
    values = list(value) if isinstance(value, tuple) else [value] * count
    if len(values) != count:
        raise FieldError((key,), f"must be one number, or a list of {count}")
    return values


class MeshFileKeys(Section, frozen=True):
    """A mesh of your own.

    file: .med, .msh, .inp, .vtu or .vtkhdf, relative to the case file
    refine: 2 halves all edges, 4 does so twice, and so on
    """

    file: Text
    refine: Literal[1, 2, 4, 8, 16, 32, 64] = 1


class BlockKeys(Section, frozen=True):
    """One of the two blocks.

    cells: its cell type
    divisions: pieces of its edges along each axis
    far: of TRIA and TETRA cells, pieces of the lateral edges on the side away from the interface
    inner: of TRIA and TETRA cells, the edge length inside
    algorithm: of TRIA and TETRA cells, gmsh's algorithm for surfaces
    contact: of PENTA and PYRA cells, the type of the faces on the interface
    """

    cells: Cells
    divisions: Divisions | None = None
    far: Divisions | None = None
    inner: Positive | None = None
    algorithm: Literal["frontal", "delaunay", "meshadapt"] | None = None
    contact: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        kind = BY_NAME[self.cells]
        allowed, needed = ["cells", "divisions"], "divisions"
        if self.cells.startswith(("PENTA", "PYRA")):
            allowed, needed = [*allowed, "contact"], "contact"
            faces = sorted({face.type for face in kind.faces})
            if self.contact and self.contact not in faces:
                raise FieldError(("contact",), f"must be {' or '.join(faces)}")
        elif self.cells.startswith(("TRIA", "TETRA")):
            allowed += ["far", "inner", "algorithm"]
        for key in fields(type(self)):
            if getattr(self, key) is not None and key not in allowed:
                problem = f"unknown key for {self.cells}; allowed: {', '.join(allowed)}"
                raise FieldError((key,), problem)
        if getattr(self, needed) is None:
            raise FieldError((needed,), "this key is needed")
        each(self.divisions, kind.dim, "divisions")
        each(self.far, kind.dim - 1, "far")


class Recipe(Section, frozen=True, kw_only=True):
    """The keys that all recipes share.

    bottom: the lower block
    top: the upper block
    refine: multiplies all divisions
    """

    bottom: BlockKeys
    top: BlockKeys
    refine: Pieces = 1

    @property
    def dim(self) -> int:
        """The dimension of the mesh."""
        return BY_NAME[self.bottom.cells].dim

    def __post_init__(self) -> None:
        super().__post_init__()
        if BY_NAME[self.top.cells].dim != self.dim:
            raise FieldError(("top", "cells"), f"must be of dimension {self.dim} as bottom")


class BlocksKeys(Recipe, frozen=True, kw_only=True):
    """Two rectangular blocks, one on the other.

    size: of each block along each axis
    """

    recipe: Literal["blocks"]
    size: Lengths

    def __post_init__(self) -> None:
        super().__post_init__()
        each(self.size, self.dim, "size")


class _Nested(Recipe, frozen=True, kw_only=True):
    radii: Annotated[
        tuple[Positive, Positive, Positive], Meta(description="a list of three positive numbers")
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.radii[0] < self.radii[1] < self.radii[2]:
            raise FieldError(("radii",), "must increase: bore, interface, rim")
        wanted = 2 if self.recipe == "rings" else 3  # type: ignore[attr-defined]
        if self.dim != wanted:
            raise FieldError(("bottom", "cells"), f"must be a cell type of {wanted}D")


class RingsKeys(_Nested, frozen=True, kw_only=True):
    """2D: a quarter of two nested tubes.

    radii: bore, interface, rim
    """

    recipe: Literal["rings"]


class ShellsKeys(_Nested, frozen=True, kw_only=True):
    """3D: a sector of two nested spheres.

    radii: bore, interface, rim
    """

    recipe: Literal["shells"]


class WavyKeys(Recipe, frozen=True, kw_only=True):
    """Two blocks of edge 1 with an interface that is no plane.

    shape: the shape of the interface
    height: its largest height
    """

    recipe: Literal["wavy"]
    shape: Literal["tilt", "kink", "arc", "wave", "twist"]
    height: _Height


class ParabolaKeys(Recipe, frozen=True, kw_only=True):
    """A block of edge 1 above a parabolic die.

    height: of the parabola
    """

    recipe: Literal["parabola"]
    height: Number


class HertzKeys(Recipe, frozen=True, kw_only=True):
    """A parabolic body on a flat one, their cells even around the point of contact.

    radius: of the parabolic body
    size: the edge of each body
    core: the length of the even part
    share: the share of the divisions in the even part
    """

    recipe: Literal["hertz"]
    radius: Positive
    size: Positive
    core: Positive
    share: Positive

    def __post_init__(self) -> None:
        super().__post_init__()
        least, largest = self.core / self.size, 2 * self.radius / (self.dim - 1)
        if not least < self.share < 1:
            raise FieldError(("share",), f"must lie between core / size = {least:g} and 1")
        if not self.size < largest:
            raise FieldError(("size",), f"must be smaller than {largest:g}, or it folds")


class PunchKeys(Recipe, frozen=True, kw_only=True):
    """A straight block on another.

    bottom_size: of the lower block along each axis
    top_size: of the upper block along each axis
    gap: between the blocks; negative: they overlap
    loaded: the share of `press` along x that belongs to `press_left`
    """

    recipe: Literal["punch"]
    bottom_size: Lengths
    top_size: Lengths
    gap: Number = 0.0
    loaded: _Share = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        each(self.bottom_size, self.dim, "bottom_size")
        each(self.top_size, self.dim, "top_size")


class BrickKeys(Section, frozen=True, kw_only=True):
    """A rectangular block.

    name: of its body
    low: the corner with the smallest coordinates
    high: the corner opposite
    block: its cells, as of a block
    """

    name: Text
    low: tuple[Number, ...]
    high: tuple[Number, ...]
    block: BlockKeys

    def __post_init__(self) -> None:
        super().__post_init__()
        dim = BY_NAME[self.block.cells].dim
        for key in ("low", "high"):
            if len(getattr(self, key)) != dim:
                raise FieldError((key,), f"must be a list of {dim} numbers for {self.block.cells}")
        if not all(a < b for a, b in zip(self.low, self.high, strict=True)):
            raise FieldError(("high",), "must be greater than low along each axis")


class BricksKeys(Section, frozen=True, kw_only=True):
    """Bodies put together from rectangular blocks, anywhere.

    bricks: the blocks; blocks of one name share their nodes where they touch
    refine: multiplies all divisions
    """

    recipe: Literal["bricks"]
    bricks: Annotated[tuple[BrickKeys, ...], Meta(min_length=1, description="a list of blocks")]
    refine: Pieces = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        if len({len(brick.low) for brick in self.bricks}) > 1:
            raise FieldError(("bricks",), "all must be of one dimension")


RECIPES: dict[str, type[Recipe] | type[BricksKeys]] = {
    "blocks": BlocksKeys,
    "rings": RingsKeys,
    "shells": ShellsKeys,
    "wavy": WavyKeys,
    "parabola": ParabolaKeys,
    "hertz": HertzKeys,
    "punch": PunchKeys,
    "bricks": BricksKeys,
}
