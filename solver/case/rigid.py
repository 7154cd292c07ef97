"""Rigid bodies: keys of a case file, and objects of a solve."""

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from msgspec import Meta, field, structs

from .acting import Name, PlaneKeys, SphereKeys, Step, Vector, factor_of
from .typed import FieldError, Number, Positive, Section

SURFACES = ("plane", "sphere", "cylinder", "parabola")
_MOTION = "a mapping of x, y, z, rx, ry, rz to numbers"
if TYPE_CHECKING:
    _Motion: TypeAlias = dict[str, float]
else:
    _Axes = Literal["x", "y", "z", "rx", "ry", "rz"]
    _Motion = Annotated[dict[_Axes, Number], Meta(min_length=1, description=_MOTION)]


class RigidSphereKeys(SphereKeys, frozen=True):
    """A rigid sphere; a circle in 2D, a ring where axisymmetric.

    centre: its centre
    radius: its radius
    hollow: the body is around the sphere, as a cup
    """

    hollow: bool = False


class RigidCylinderKeys(Section, frozen=True):
    """A rigid cylinder, in 3D.

    point: a point of its axis
    axis: the direction of its axis, of any length
    radius: its radius
    hollow: the body is around the cylinder, as a bore
    """

    point: Vector
    axis: Vector
    radius: Positive
    hollow: bool = False

    def __post_init__(self) -> None:
        if not any(self.axis):
            raise FieldError(("axis",), "must have a direction")


class RigidParabolaKeys(PlaneKeys, frozen=True):
    """A rigid parabola; a paraboloid of revolution in 3D and where axisymmetric.

    point: its apex
    normal: out of the body at the apex, of any length
    radius: the radius of curvature at the apex
    hollow: the body is around the parabola, as a cup
    """

    radius: Positive
    hollow: bool = False


class Rigid(Section, frozen=True):
    """A body.

    rigid: the body does not deform; a rigid side is always master
    plane: a rigid plane without a mesh, its normal out of the body; the body's name is the master
    sphere: a rigid sphere, circle or ring without a mesh
    cylinder: a rigid cylinder without a mesh
    parabola: a rigid parabola or paraboloid without a mesh
    reference: the point that a rigid body turns about and that its moments refer to
    move: its displacement there, and its small rotation in radians
    force: force and moment there; the body is free to move in these components
    name: the name that `steps` gives factors of `move` and `force`
    """

    rigid: bool = False
    plane: PlaneKeys | None = None
    sphere: RigidSphereKeys | None = None
    cylinder: RigidCylinderKeys | None = None
    parabola: RigidParabolaKeys | None = None
    reference: Vector | None = None
    move: _Motion = field(default_factory=dict)
    force: _Motion = field(default_factory=dict)
    name: Name = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if sum(getattr(self, kind) is not None for kind in SURFACES) > 1:
            raise FieldError((), f"must have at most one of {', '.join(SURFACES)}")
        for key in ("reference", "move", "force"):
            if getattr(self, key) and not (self.rigid or self.surface):
                raise FieldError((key,), "only a rigid body has it: add `rigid: true`")
        if self.name and not self.moves:
            raise FieldError(("name",), "only a body with `move` or `force` has a factor")
        if both := sorted(self.move.keys() & self.force.keys()):
            raise FieldError(("force", both[0]), "`move` gives this component too")

    @property
    def surface(self) -> str:
        """The kind of its surface without a mesh; empty where it has none."""
        return next((s for s in SURFACES if getattr(self, s)), "")

    @property
    def values(self) -> dict[str, Any]:
        """The values of that surface by key."""
        return structs.asdict(getattr(self, self.surface)) if self.surface else {}

    @property
    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Its points and directions by key."""
        given = {"reference": self.reference}
        given |= {f"{self.surface}.{key}": value for key, value in self.values.items()}
        return [(key, value) for key, value in given.items() if isinstance(value, tuple)]

    def factor(self, step: Step) -> float:
        """Its factor in a step."""
        return factor_of(self.name, step)

    @property
    def moves(self) -> bool:
        """Whether it has a motion, imposed or free; it is held in all other components."""
        return bool(self.move or self.force)
