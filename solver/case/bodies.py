"""The keys of a case file for bodies: rigid ones, their surfaces without a mesh, their motion."""

from typing import Annotated, Literal

from msgspec import Meta

from .acting import PlaneKeys, SphereKeys
from .kinds import Name, Vector
from .typed import FieldError, Number, Positive, Section

SURFACES = ("plane", "sphere", "cylinder", "parabola")
_COMPONENTS = "a mapping of x, y, z, rx, ry, rz to numbers"
_Component = Literal["x", "y", "z", "rx", "ry", "rz"]
_Components = Annotated[dict[_Component, Number], Meta(min_length=1, description=_COMPONENTS)]


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


class BodyKeys(Section, frozen=True):
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
    move: _Components | None = None
    force: _Components | None = None
    name: Name | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if sum(getattr(self, kind) is not None for kind in SURFACES) > 1:
            raise FieldError((), f"must have at most one of {', '.join(SURFACES)}")
        for key in ("reference", "move", "force"):
            if getattr(self, key) is not None and not (self.rigid or self.surface):
                raise FieldError((key,), "only a rigid body has it: add `rigid: true`")
        if self.name and not (self.move or self.force):
            raise FieldError(("name",), "only a body with `move` or `force` has a factor")
        if both := sorted((self.move or {}).keys() & (self.force or {}).keys()):
            raise FieldError(("force", both[0]), "`move` gives this component too")

    @property
    def surface(self) -> str:
        """The kind of its surface without a mesh; empty where it has none."""
        return next((s for s in SURFACES if getattr(self, s)), "")
