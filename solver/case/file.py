"""The keys of a case file, as types; the lines of a docstring say what each key is."""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from msgspec import Meta, field

from .acting import (
    Angle,
    Group,
    GroupList,
    Groups,
    Load,
    Name,
    Probe,
    Scalar,
    SelectionKeys,
    Support,
    Unit,
    Vector,
    Whole,
)
from .checks import CHECKS
from .reference import ReferenceKeys
from .rigid import Rigid
from .typed import FieldError, Number, Positive, Section

FORM = "{file: MESH, refine: 2}, or {recipe: NAME, …}"
HALVINGS = (1, 2, 4, 8, 16, 32, 64)
"""How often finer a mesh file can be made: by halving all edges, once or several times."""
HALVINGS_TEXT = "1, 2, 4, 8, 16, 32 or 64"

Poisson = Annotated[
    float, Meta(gt=-1, lt=0.5, description="a number greater than -1 and less than 0.5")
]
if TYPE_CHECKING:
    CheckName = str
else:
    CheckName = Literal[("all", *(check.name for check in CHECKS))]


class Rotation(Section, frozen=True):
    """A turn about an axis through the origin.

    axis: the axis, in 3D
    angle: the angle
    """

    axis: Annotated[tuple[Number, Number, Number], Meta(description="a list of three numbers")]
    angle: Angle


class Perturbation(Section, frozen=True):
    """Random moves of inner nodes.

    amplitude: by at most this share of the shortest edge at a node
    seed: of the random numbers
    group: only the nodes of this group
    """

    amplitude: Positive
    seed: Whole = 0
    group: Groups | None = None


class Shift(Section, frozen=True):
    """A group moved.

    group: the group
    by: the vector of the move
    """

    group: Groups
    by: Vector


class Turn(Section, frozen=True):
    """A group turned.

    group: the group
    angle: the angle of rotation
    """

    group: Groups
    angle: Angle


class Pick(Section, frozen=True):
    """A group made of the cells of another that are in a box."""

    source: Groups = field(name="from")
    low: Vector
    high: Vector
    name: Group
    rest: Group | None = None


class Renumbering(Section, frozen=True):
    """A new order of nodes and cells.

    seed: of the random numbers
    """

    seed: Whole


_ROTATE = "an angle in degrees (2D), or {axis: [x, y, z], angle: degrees}"
_STRETCH = "a list of two (2D) or three positive numbers"
_PERTURB = "a positive share of the edges, or {amplitude, seed, group}"
_RENUMBER = "a seed (a whole number, not negative), or {seed}"
_PICK = "{from, low, high, name, rest}, or a list of them"
_Picks = Annotated[tuple[Pick, ...], Meta(min_length=1)]


class Transform(Section, frozen=True):
    """Changes of the mesh, in the order of the keys.

    scale: multiply all coordinates
    rotate: turn the mesh about the origin
    translate: move the mesh
    stretch: multiply each coordinate by its own factor
    perturb: move inner nodes at random
    shift: move the nodes of a group
    turn: turn the nodes of a group about the last axis
    pick: make a group of the cells of another that are in a box
    renumber: number nodes and cells in another order, at random
    """

    scale: Positive | None = None
    rotate: Annotated[Number | Rotation, Meta(description=_ROTATE)] | None = None
    translate: Vector | None = None
    stretch: (
        Annotated[tuple[Positive, ...], Meta(min_length=2, max_length=3, description=_STRETCH)]
        | None
    ) = None
    perturb: Annotated[Positive | Perturbation, Meta(description=_PERTURB)] | None = None
    shift: Shift | None = None
    turn: Turn | None = None
    pick: Annotated[Pick | _Picks, Meta(description=_PICK)] | None = None
    renumber: Annotated[Whole | Renumbering, Meta(description=_RENUMBER)] | None = None


class Units(Section, frozen=True):
    """The units of the numbers.

    length: such as mm
    stress: such as MPa
    """

    length: Unit | None = None
    stress: Unit | None = None

    def __post_init__(self) -> None:
        if not (self.length or self.stress):
            raise FieldError((), "must be {length, stress}")


class MaterialKeys(Section, frozen=True):
    """An elastic material.

    young: Young's modulus
    poisson: Poisson's ratio
    form: the unknowns: displacement, or displacement and pressure (mixed) for nearly
      incompressible material; automatic: mixed above 0.499
    """

    young: Positive
    poisson: Poisson
    form: Literal["automatic", "displacement", "mixed"] = "automatic"

    def __post_init__(self) -> None:
        if self.form == "mixed" and self.poisson <= 0:
            raise FieldError(("poisson",), "must be greater than 0 in the mixed form")


Coefficient = Annotated[float, Meta(ge=0, le=10, description="a number from 0 to 10")]


# Below this the traction of friction is of the size of the rounding of forces.
_LEAST_FRICTION = 1e-5


class Zone(Section, frozen=True):
    """A contact zone.

    name: the zone's name in the results
    slave: the faces that carry the multipliers: the finer ones, or the softer body's
    master: the faces opposite to them
    hexahedra: the cells into which slave hexahedra are cut
    treatment: the treatment of the interface
    points: points per direction on a slave face, only for the treatment quadrature
    normal: the direction of gaps: normals of the slave's faces, their means at its nodes, or the
      normals of a plane or smooth master
    recovery: how a pressure of higher order is recovered from the constants
    sweeps: at most so many solves with the loads of the recovered pressure, until it settles; of
      several zones the largest number counts
    stabilised: contact gives way to pressures that scatter from face to face
    friction: Coulomb's coefficient of friction; the steps are then a path
    interference: initial overlap of bodies that are modelled without it; subtracted from the gap
    clearance: the initial gap, which replaces the gap between the meshed faces
    """

    slave: Groups
    master: Groups
    name: Name = "contact"
    hexahedra: Literal["pyramids", "hexahedra"] = "pyramids"
    treatment: Literal["lac", "uncut", "quadrature", "node_to_segment", "nodal", "nodal_dual"] = (
        "lac"
    )
    normal: Literal["element", "nodal", "master"] = "element"
    recovery: Literal["none", "linear", "quadratic", "smooth", "automatic"] = "none"
    sweeps: Annotated[int, Meta(ge=2, le=100, description="a number from 2 to 100")] | None = None
    stabilised: bool = False
    friction: Coefficient = 0.0
    interference: Number = 0.0
    points: Annotated[int, Meta(ge=1, le=16, description="a number from 1 to 16")] | None = None
    clearance: Scalar | None = None

    @property
    def gives_way(self) -> bool:
        """Whether a closed gap depends on the pressures: they have a compliance."""
        return self.stabilised

    def __post_init__(self) -> None:
        if 0 < self.friction < _LEAST_FRICTION:
            raise FieldError(("friction",), f"must be 0, or at least {_LEAST_FRICTION:g}")


class Observation(Section, frozen=True):
    """A macro-element to report at every step.

    zone: its zone
    nearest: the macro-element nearest to this point
    """

    zone: Name
    nearest: Vector


class CountKeys(Section, frozen=True):
    """The size of a body.

    cells: cells of the group
    faces: its faces on contact surfaces
    """

    cells: Whole | None = None
    faces: Whole | None = None


_MATERIALS = "a mapping of cell groups, or `all`, to {young, poisson}"
_SUPPORTS = "a list of {group, fix}, at least one"
_STEPS = "a list of load factors, none negative, or of mappings of names to factors"
_Factor = Annotated[float, Meta(ge=0, le=1e30)]
_Factors = Annotated[dict[Name, Number], Meta(min_length=1)]
MOST_STEPS = 1000
"""A case has at most so many steps, those between included."""
_STEP = "a factor from 0 to 1e30, or a mapping of names to factors"
_Step = Annotated[_Factor | _Factors, Meta(description=_STEP)]
_SUBSTEPS = f"a whole number from 1 to {MOST_STEPS}"
_Substeps = Annotated[int, Meta(ge=1, le=MOST_STEPS, description=_SUBSTEPS)]
_Steps = Annotated[tuple[_Step, ...], Meta(min_length=1, max_length=MOST_STEPS, description=_STEPS)]
_Tolerance = Annotated[float, Meta(gt=0, description="a positive number")]
_TOLERANCE = (
    "a positive number below 1, or a mapping of checks (`all`: the relative ones) to such numbers"
)
_OUT_OF_SCOPE = {
    "the coefficient of friction is the key friction of a contact zone": (
        "mu", "coulomb", "friction_coefficient", "stick"),
    "the keys of a material are young and poisson": ("e", "youngs_modulus", "nu", "poissons_ratio"),
    "contact that holds in tension is out of scope: it may open": (
        "tied", "glue", "glued", "bonded", "adhesion", "cohesive"),
    "out of scope: small strain only": (
        "large_strain", "finite_strain", "large_displacement", "large_deformation", "nlgeom",
        "hyperelastic"),
    "out of scope: linear elasticity only": (
        "plasticity", "plastic", "yield", "yield_stress", "hardening", "creep", "viscosity"),
    "initial strain is a load: {group, expansion, temperature}, or {group, strain}": (
        "thermal_expansion", "thermal", "initial_strain", "eigenstrain", "alpha"),
    "dynamics is out of scope: static equilibrium only": (
        "dynamics", "dynamic", "density", "mass", "inertia", "damping", "velocity", "time"),
    "beams, shells and trusses are out of scope: bodies are meshed with plane or solid cells": (
        "beam", "beams", "shell", "shells", "truss", "trusses"),
}  # fmt: skip


class CaseFile(Section, frozen=True):
    """A case file.

    name: the name of the case, in the report and of its results folder
    title: one line for the report
    description: free text for readers
    mesh: either `file`, a mesh file (.med, .msh, .inp, .vtu, .vtkhdf), relative to the case file,
      and `refine` to halve its edges (2: once, 4: twice), or `recipe`, a recipe that generates the
      mesh, and the keys of the recipe
    transform: changes of the mesh, in the order of the keys
    plane: plane strain, plane stress, or a section of axisymmetric bodies with x as the radius and
      y along the axis; only for 2D meshes
    units: the units of the numbers, only labels of fields and pictures
    materials: the material of each group of cells, or of `all`
    groups: groups that the case makes on the mesh, by name; a list of groups makes one of them all
    supports: imposed displacements
    loads: loads on the bodies
    bodies: further properties of bodies
    contact: the contact zones
    directions: solved once, or again with slave and master exchanged
    steps: load factors, solved one after the other in any order, or the factors of named loads and
      supports
    substeps: each step is reached in so many equal parts, from the one before it or from nothing
    motion: small, or large where bodies slide or roll far along the path of the steps, with small
      strains
    observe: macro-elements to report at every step
    probes: points and nodes whose displacement and stress, or contact pressure, are results
    reference: what the result is compared with
    tolerance: the tolerance of the relative checks, or one for each check
    expected: the error of a check that a refinement ladder predicts for this mesh, in place of its
      tolerance; 1.5 times as much is allowed
    counts: the expected numbers of cells and contact faces of a body
    """

    out_of_scope: ClassVar = {word: why for why, words in _OUT_OF_SCOPE.items() for word in words}

    name: Name
    mesh: Annotated[dict[str, Any], Meta(description=FORM)]
    materials: Annotated[dict[Group, MaterialKeys], Meta(min_length=1, description=_MATERIALS)]
    supports: Annotated[tuple[Support, ...], Meta(min_length=1, description=_SUPPORTS)]
    title: str = ""
    description: str = ""
    transform: Transform | None = None
    plane: Literal["strain", "stress", "axisymmetric"] | None = None
    units: Units | None = None
    groups: dict[Group, SelectionKeys | GroupList] = field(default_factory=dict)
    loads: tuple[Load, ...] = ()
    bodies: dict[Group, Rigid] = field(default_factory=dict)
    contact: tuple[Zone, ...] = ()
    directions: Literal["first", "both"] = "first"
    steps: _Steps = (1.0,)
    substeps: _Substeps = 1
    motion: Literal["small", "large"] = "small"
    observe: tuple[Observation, ...] = ()
    probes: dict[Name, Probe] = field(default_factory=dict)
    reference: ReferenceKeys | None = None
    tolerance: (
        Annotated[_Tolerance | dict[CheckName, _Tolerance], Meta(description=_TOLERANCE)] | None
    ) = None
    expected: Annotated[dict[CheckName, _Tolerance], Meta(min_length=1)] | None = None
    counts: dict[Group, CountKeys] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        keys = self.mesh.keys() & {"file", "recipe"}
        if len(keys) != 1 or ("file" in keys and self.mesh.keys() - {"file", "refine"}):
            raise FieldError(("mesh",), f"must be {FORM}")
        if "file" in keys and self.mesh.get("refine", 1) not in HALVINGS:
            raise FieldError(("mesh", "refine"), f"must be {HALVINGS_TEXT}")
        for key in keys:
            if not isinstance(self.mesh[key], str) or not self.mesh[key]:
                problem = "the path of a mesh file" if key == "file" else "the name of a recipe"
                raise FieldError(("mesh", key), f"must be {problem}")
