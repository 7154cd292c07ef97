"""Groups, supports, loads and probes: keys of a case file, and objects of a solve.

Types marked with `read` are read further (see `reader`): a `group` becomes the name of one group,
text in a `value` or an `expression` a function of position, `solution` in a `value` `EXACT`.
"""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from msgspec import Meta, field
from msgspec.structs import force_setattr

from .expressions import Exact, Expression
from .typed import ONCE, FieldError, Number, Positive, Section, Text

# A load factor, or the factors of named loads and supports.
Step = float | dict[str, float]


def factor_of(name: str, step: Step) -> float:
    """The factor that a step gives a name: of loads, supports and bodies."""
    return step.get(name, 1.0) if isinstance(step, dict) else step


def in_step(step: Step, names: Iterable[str], of: Callable[[str | None], Any]) -> Any:
    """The sum over names of what each has, by the factors of a step; `of(None)` is all of it."""
    if not isinstance(step, dict):
        return step * of(None)
    return sum(factor_of(name, step) * of(name) for name in names)


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
GROUP, VALUE, EXPRESSION = ({"read": mark} for mark in ("group", "value", "expression"))
_UNIT = "the name of a unit, 20 letters, digits, `/`, `*`, `^`, `²` and the like at most"
Unit = Annotated[str, Meta(pattern=r"^[\w/*^·²³µ%()-]{1,20}$(?!\n)", description=_UNIT)]
Whole = Annotated[int, Meta(ge=0, lt=2**31, description="a whole number, not negative, below 2^31")]
Angle = Annotated[Number, Meta(description="an angle in degrees")]
_VECTOR = "a list of two (plane) or three numbers"
Vector = Annotated[tuple[Number, ...], Meta(min_length=2, max_length=3, description=_VECTOR)]
_SCALAR = "a number or an expression (numbers from -1e30 to 1e30)"
_SCALARS = "a list of two (plane) or three numbers or expressions, or `solution`"
if TYPE_CHECKING:
    Groups: TypeAlias = str
    Scalar: TypeAlias = float | Expression
    Value: TypeAlias = Scalar | Exact
    Values: TypeAlias = tuple[Scalar, ...] | Exact
else:
    Groups = Annotated[Group | GroupList, Meta(description=_GROUPS, extra=GROUP)]
    Scalar = Annotated[Number | Text, Meta(description=_SCALAR, extra=EXPRESSION)]
    Value = Annotated[Number | Text, Meta(description=_SCALAR, extra=VALUE)]
    _Several = Annotated[tuple[Scalar, ...], Meta(min_length=2, max_length=3)]
    Values = Annotated[_Several | Literal["solution"], Meta(description=_SCALARS, extra=VALUE)]


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


class Probe(Section, frozen=True):
    """A place whose displacement and stress, or contact pressure, are results.

    at: this point
    group: the nodes of this group
    within: of several bodies at the point, the one with these cells
    zone: the contact pressure there, on the slave surface of this zone
    """

    at: Vector | None = None
    group: Groups = ""
    within: Groups = ""
    zone: Name = ""

    def __post_init__(self) -> None:
        if (self.at is None) == (not self.group):
            raise FieldError((), "must be {exactly one of at, group; zone or within}")
        if self.within and (self.at is None or self.zone):
            raise FieldError(("within",), "only for a displacement and stress at a point")


_Axis = Literal["x", "y", "z", "normal"]
_Fixed = Annotated[tuple[_Axis, ...], Meta(min_length=1)]
_Imposed = Annotated[dict[_Axis, Scalar], Meta(min_length=1)]
_SPRING = "a mapping of x, y, z, normal to positive numbers or expressions"
_FIX = "a list of x, y, z, normal, or a mapping of them to imposed values"
_STRAIN = "a mapping of xx, yy, zz, xy, yz, xz to numbers or expressions"
_TOGETHER = "a list of x, y, z"
_Component = Literal["xx", "yy", "zz", "xy", "yz", "xz"]
Components = Annotated[dict[_Component, Scalar], Meta(min_length=1)]
if TYPE_CHECKING:
    _Fix: TypeAlias = dict[str, Value]
    _Springs: TypeAlias = dict[str, Scalar]
else:
    _Fix = Annotated[
        _Fixed | _Imposed,
        Meta(description=_FIX, extra_json_schema=ONCE.extra_json_schema, extra=VALUE),
    ]
    _Springs = Annotated[
        dict[_Axis, Scalar], Meta(min_length=1, description=_SPRING, extra=EXPRESSION)
    ]
_Together = Annotated[tuple[Literal["x", "y", "z"], ...], ONCE, Meta(description=_TOGETHER)]


class Cyclic(Section, frozen=True):
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


class Support(Section, frozen=True):
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

    fix: _Fix = field(default_factory=dict)
    spring: _Springs = field(default_factory=dict)
    together: _Together = ()
    cyclic: Cyclic | None = None
    name: Name = ""
    group: Groups = ""
    at: Vector | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        kinds = (self.fix, self.spring, self.together, self.cyclic)
        if (not self.group) == (self.at is None):
            raise FieldError((), "must be {fix, spring or together, and exactly one of group, at}")
        if sum(map(bool, kinds)) != 1:
            problem = "must be {group or at, and exactly one of fix, spring, together, cyclic}"
            raise FieldError((), problem)
        if self.at and (self.together or self.cyclic):
            kind = "together" if self.together else "cyclic"
            raise FieldError(("at",), f"{kind} needs a group")
        fixed: Any = self.fix
        if isinstance(fixed, tuple):
            force_setattr(self, "fix", dict.fromkeys(fixed, 0.0))

    @property
    def components(self) -> dict[str, Any]:
        """Its values by component: displacements, or stiffnesses."""
        return {**self.fix, **self.spring}

    @property
    def by_area(self) -> bool:
        """Whether the faces of a group share it by their areas."""
        return bool(self.spring)


LOAD_KINDS = ("pressure", "traction", "body_force", "force", "strain", "temperature")


class Load(Section, frozen=True):
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

    group: Groups = ""
    at: Vector | None = None
    pressure: Value | None = None
    traction: Values | None = None
    body_force: Values | None = None
    force: Vector | None = None
    strain: Annotated[Components, Meta(description=_STRAIN, extra=EXPRESSION)] | None = None
    temperature: Scalar | None = None
    expansion: Scalar | None = None
    name: Name = ""

    def __post_init__(self) -> None:
        if sum(getattr(self, kind) is not None for kind in LOAD_KINDS) != 1:
            problem = (
                "must be {group, and exactly one of pressure, traction, body_force, force, strain, "
                "temperature (with expansion)}"
            )
            raise FieldError((), problem)
        if (self.temperature is None) != (self.expansion is None):
            raise FieldError((), "must be {group, expansion, temperature}: one needs the other")
        if (not self.group) == (self.at is None) or (self.at and self.force is None):
            raise FieldError((), "must be {group} with its load, or {at, force}")

    @property
    def kind(self) -> str:
        """The one of `LOAD_KINDS` that is given."""
        return next(kind for kind in LOAD_KINDS if getattr(self, kind) is not None)

    @property
    def value(self) -> Any:
        """Its value: by component of an initial strain; of a temperature with the expansion."""
        if self.kind == "temperature":
            return {"temperature": self.temperature, "expansion": self.expansion}
        return getattr(self, self.kind)

    @property
    def of_cells(self) -> bool:
        """Whether it acts on volume cells."""
        return self.kind == "body_force" or self.strains

    @property
    def strains(self) -> bool:
        """Whether it is an initial strain, which a temperature is too."""
        return self.kind in ("strain", "temperature")

    def factor(self, step: Step) -> float:
        """Its factor in a step."""
        return factor_of(self.name, step)
