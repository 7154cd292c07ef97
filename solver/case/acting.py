"""The keys of a case file for what acts on the bodies: supports, loads; groups, and probes."""

from typing import Annotated, Literal

from msgspec import Meta

from .kinds import Angle, Groups, Name, Scalar, Scalars, Vector
from .typed import FieldError, Number, Positive, Section, Text


class PlaneKeys(Section, frozen=True):
    """A plane; a straight line in 2D.

    point: a point of it
    normal: its normal, of any length
    """

    point: Vector
    normal: Vector

    def __post_init__(self) -> None:
        if not any(self.normal):
            raise FieldError(("normal",), "must have a direction")


class SphereKeys(Section, frozen=True):
    """The surface of a sphere; a circle in 2D.

    centre: its centre
    radius: its radius
    """

    centre: Vector
    radius: Positive


class BoxKeys(Section, frozen=True):
    """All that is in a box along the axes.

    low: its lowest corner
    high: its highest corner
    """

    low: Vector
    high: Vector


class SelectionKeys(Section, frozen=True):
    """A group made by the case: members all of whose nodes are there.

    of: volume cells, faces on the outside of bodies, or nodes
    within: only what belongs to the cells of these groups
    plane: those on a plane
    sphere: those on a sphere
    box: those in a box
    where: those where an expression is not negative
    """

    of: Literal["cells", "faces", "nodes"] = "faces"
    within: Groups | None = None
    plane: PlaneKeys | None = None
    sphere: SphereKeys | None = None
    box: BoxKeys | None = None
    where: Text | None = None

    def __post_init__(self) -> None:
        given = (self.plane, self.sphere, self.box, self.where)
        if sum(value is not None for value in given) != 1:
            problem = "must be {of, within, and exactly one of plane, sphere, box, where}"
            raise FieldError((), problem)


class ProbeKeys(Section, frozen=True):
    """A place whose displacement and stress, or contact pressure, are results.

    at: this point
    group: the nodes of this group
    within: of several bodies at the point, the one with these cells
    zone: the contact pressure there, on the slave surface of this zone
    """

    at: Vector | None = None
    group: Groups | None = None
    within: Groups | None = None
    zone: Name | None = None

    def __post_init__(self) -> None:
        if (self.at is None) == (self.group is None):
            raise FieldError((), "must be {exactly one of at, group; zone or within}")
        if self.within and (self.at is None or self.zone):
            raise FieldError(("within",), "only for a displacement and stress at a point")


_Axis = Literal["x", "y", "z", "normal"]
_Fixed = Annotated[tuple[_Axis, ...], Meta(min_length=1)]
_Imposed = Annotated[dict[_Axis, Scalar], Meta(min_length=1)]
_SPRING = "a mapping of x, y, z, normal to positive numbers or expressions"
_FIX = "a list of x, y, z, normal, or a mapping of them to imposed values"


_Springs = Annotated[dict[_Axis, Scalar], Meta(min_length=1, description=_SPRING)]


_STRAIN = "a mapping of xx, yy, zz, xy, yz, xz to numbers or expressions"
_Strain = Annotated[
    dict[Literal["xx", "yy", "zz", "xy", "yz", "xz"], Scalar],
    Meta(min_length=1, description=_STRAIN),
]
_Directions = Annotated[tuple[Literal["x", "y", "z"], ...], Meta(min_length=1)]
_TOGETHER = "a list of x, y, z"


class CyclicKeys(Section, frozen=True):
    """The side of a sector, or of a period, that the group is the copy of.

    of: the group of the other side
    angle: the copy is turned by this angle, about the origin
    axis: of the turn, in 3D; default z
    shift: the copy is moved by this vector
    """

    of: Groups
    angle: Angle | None = None
    axis: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)
    shift: Vector | None = None

    def __post_init__(self) -> None:
        if (self.angle is None) == (self.shift is None):
            raise FieldError((), "must be {of, and exactly one of angle, shift}")
        if not any(self.axis):
            raise FieldError(("axis",), "must have a direction")


class SupportKeys(Section, frozen=True):
    """Imposed displacements, springs to the ground, or nodes that move as others do.

    group: the nodes of this group, or of `all`
    at: the node at this point
    fix: the components that are fixed or have a value; `normal`: along the normal of the group's
      faces, a plane of any direction
    spring: stiffness of springs by component: force per area and displacement on faces (an elastic
      foundation), force per displacement at nodes
    together: the components in which all nodes of the group have one displacement, an unknown
    cyclic: the displacement equals another side's, turned or shifted with it
    name: the name that `steps` gives factors of the imposed values
    """

    fix: Annotated[
        _Fixed | _Imposed | None,
        Meta(description=_FIX, extra_json_schema={"uniqueItems": True}),
    ] = None
    spring: _Springs | None = None
    together: Annotated[
        _Directions | None,
        Meta(description=_TOGETHER, extra_json_schema={"uniqueItems": True}),
    ] = None
    cyclic: CyclicKeys | None = None
    name: Name | None = None
    group: Groups | None = None
    at: Vector | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        kinds = (self.fix, self.spring, self.together, self.cyclic)
        if (self.group is None) == (self.at is None):
            raise FieldError((), "must be {fix, spring or together, and exactly one of group, at}")
        if sum(value is not None for value in kinds) != 1:
            problem = "must be {group or at, and exactly one of fix, spring, together, cyclic}"
            raise FieldError((), problem)
        if self.at and (self.together or self.cyclic):
            kind = "together" if self.together else "cyclic"
            raise FieldError(("at",), f"{kind} needs a group")


class LoadKeys(Section, frozen=True):
    """A load.

    group: the faces of this group; for a body force, a strain or a temperature, its cells
    at: the node at this point, for a force
    pressure: force per area against the faces, positive inwards
    traction: force per area, as a vector
    body_force: force per volume, as a vector
    force: the whole force, as a vector: distributed evenly over the area of faces, or over nodes
    strain: initial strain, which causes no stress where it is free; xy is half the angle of shear
    temperature: change of temperature; the initial strain is its product with the expansion
    expansion: coefficient of thermal expansion, with temperature
    name: the name that `steps` gives factors of the load
    """

    group: Groups | None = None
    at: Vector | None = None
    pressure: Scalar | None = None
    traction: Scalars | None = None
    body_force: Scalars | None = None
    force: Vector | None = None
    strain: _Strain | None = None
    temperature: Scalar | None = None
    expansion: Scalar | None = None
    name: Name | None = None

    def __post_init__(self) -> None:
        of_faces = (self.pressure, self.traction, self.force)
        given = (*of_faces, self.body_force, self.strain, self.temperature)
        if sum(value is not None for value in given) != 1:
            problem = (
                "must be {group, and exactly one of pressure, traction, body_force, force, strain, "
                "temperature (with expansion)}"
            )
            raise FieldError((), problem)
        if (self.temperature is None) != (self.expansion is None):
            raise FieldError((), "must be {group, expansion, temperature}: one needs the other")
        if (self.group is None) == (self.at is None) or (self.at and self.force is None):
            raise FieldError((), "must be {group} with its load, or {at, force}")
