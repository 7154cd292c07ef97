"""The keys of a case file for what the result is compared with."""

from typing import Annotated, Any, Literal

from msgspec import Meta

from .acting import EXPRESSION, VALUE, Components, Group, Name, Scalar, Value, Values, Vector
from .typed import FieldError, Number, Section, Text, Version


class CodeKeys(Section, frozen=True):
    """Another code.

    name: the code
    version: its version
    """

    name: Text
    version: Version


_UNCERTAINTY = "a positive number: the possible relative error of the reference"
_SOLUTION = "the name of a documented solution, or {name: NAME, …} with its parameters"
_STRESS = "a mapping of xx, yy, zz, xy, yz, xz to numbers or expressions, or `solution`"
_MOMENT = "a number (plane) or a list of three numbers"
_Three = Annotated[tuple[Number, ...], Meta(min_length=3, max_length=3)]
_Moment = Annotated[Number | _Three, Meta(description=_MOMENT)]
_Components = Annotated[tuple[Scalar, ...], Meta(min_length=2, max_length=3)]
_Areas = Annotated[Number | Literal["solution"], Meta(extra=VALUE)]
_Works = Annotated[tuple[Number, ...], Meta(min_length=1)] | Literal["solution"]
_At = Meta(min_length=1, extra=EXPRESSION)


class ReferenceKeys(Section, frozen=True):
    """What the result is compared with.

    kind: the origin of the reference
    uncertainty: the possible error of the reference itself; needed with refined
    code: the code that computed it; needed with other_code
    remark: more about its origin, for the report
    solution: an exact solution of the project; then `solution` may be a value here, in loads and
      in supports
    contact_pressure: contact pressure on the slave faces, positive in compression
    normal_stress: stress along the contact normal at all nodes, positive in tension
    gap: gap on the slave faces, positive when open
    displacement: displacement of all nodes
    force: contact force on the surface that is listed as slave, around the full circle if
      axisymmetric
    contact_area: area of contact of each zone
    friction_traction: traction of friction on the slave faces
    slip: slip of the master relative to the slave, in the last step
    stick_area: area of each zone that sticks
    dissipation: work of friction in each step
    coverage: covered share of the slave faces, at their centres; left out: covered in full
    reaction: the forces with which supports hold groups
    moment: the moment of contact on rigid bodies about their reference points; one number in 2D,
      three in 3D
    strain_energy: of all bodies
    displacement_at: displacement at probes
    stress_at: components of the stress at probes, xx, yy, zz, xy, yz, xz
    pressure_at: contact pressure at probes
    stress: components of the stress at all nodes
    """

    kind: Literal["analytical", "manufactured", "refined", "other_code"]
    uncertainty: Annotated[float, Meta(gt=0, le=1e30, description=_UNCERTAINTY)] | None = None
    code: CodeKeys | None = None
    remark: str = ""
    solution: Annotated[Text | dict[str, Any], Meta(description=_SOLUTION)] | None = None
    contact_pressure: Value | None = None
    normal_stress: Value | None = None
    gap: Value | None = None
    displacement: Values | None = None
    force: Vector | None = None
    contact_area: Number | None = None
    friction_traction: Values | None = None
    slip: Values | None = None
    stick_area: _Areas | None = None
    dissipation: Annotated[_Works, Meta(extra=VALUE)] | None = None
    coverage: Scalar | None = None
    reaction: Annotated[dict[Group, Vector], Meta(min_length=1)] | None = None
    moment: Annotated[dict[Group, _Moment], Meta(min_length=1)] | None = None
    strain_energy: Number | None = None
    displacement_at: Annotated[dict[Name, _Components], _At] | None = None
    stress_at: Annotated[dict[Name, Components], _At] | None = None
    pressure_at: Annotated[dict[Name, Scalar], _At] | None = None
    stress: (
        Annotated[Components | Literal["solution"], Meta(description=_STRESS, extra=VALUE)] | None
    ) = None

    def __post_init__(self) -> None:
        needed = {"refined": "uncertainty", "other_code": "code"}.get(self.kind)
        if needed and getattr(self, needed) is None:
            raise FieldError((needed,), "this key is needed")
        if self.code and self.kind != "other_code":
            raise FieldError(("code",), "must be left out: only the kind other_code has one")
