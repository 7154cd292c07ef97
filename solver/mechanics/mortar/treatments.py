"""Treatments of the interface: how the gap is weighted and integrated, by the case file's name.

They share everything else: pairing, segments, gap operator, active set, solve, checks, results.
`docs/treatments.md` has the formulas.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from ...lac.cells.catalogue import BY_NAME
from ...lac.operator import LAC, Scheme, meet_in_segments
from .lost import without_partner
from .nodal import dual, linear
from .points import at_nodes, gauss, meet_at_points, one_each

DEFAULT_POINTS = 4
# Slave nodes at the end of a bent surface may look past the master's by this part of a face.
_BEYOND = 0.05
_LINEAR = ("SEG2", "TRIA3", "QUAD4")
_ALL = tuple(name for name, kind in BY_NAME.items() if kind.dim < 3)


@dataclass(frozen=True)
class Treatment:
    """One treatment.

    `cut`: whether slave faces are cut, so that each macro-element owns an unknown; `scheme` the
    integration, given the number of points; `faces` the slave faces that it exists for, and `why`
    not for others; `what` it is, in words. `joins`: whether multipliers of held nodes join those of
    their neighbours.
    """

    what: str
    cut: bool
    scheme: Callable[[int], Scheme]
    faces: tuple[str, ...] = _ALL
    why: str = ""
    joins: bool = False


def _quadrature(points: int) -> Scheme:
    return Scheme(sample=partial(gauss, n=points), meet=meet_at_points, closure=False)


_NODES = Scheme(
    sample=at_nodes, meet=partial(meet_at_points, beyond=_BEYOND), space=one_each, closure=False
)
_NODAL = Scheme(meet=partial(meet_in_segments, weighted=True), space=linear)

TREATMENTS: dict[str, Treatment] = {
    "lac": Treatment("one pressure for each macro-element, exact segments", True, lambda _: LAC),
    "uncut": Treatment("one pressure for each slave face, not cut", False, lambda _: LAC),
    "quadrature": Treatment(
        "one pressure for each macro-element, points projected to the master", True, _quadrature
    ),
    "node_to_segment": Treatment(
        "a force at each slave node, which meets one master face",
        False,
        lambda _: _NODES,
        (*_LINEAR, "SEG3", "QUAD9"),
        "forces of a uniform pressure are zero at vertices of TRIA6, negative at those of QUAD8",
    ),
    "nodal": Treatment(
        "mortar: pressure linear between slave vertices, exact segments",
        False,
        lambda _: _NODAL,
        joins=True,
    ),
    "nodal_dual": Treatment(
        "mortar: dual multipliers at slave nodes, exact segments",
        False,
        lambda _: replace(_NODAL, space=dual),
        _LINEAR,
        "it is built of linear shape functions; quadratic ones ask for a change of their basis",
        joins=True,
    ),
}


def scheme_of(name: str, points: int | None) -> Scheme:
    """The integration of a treatment, by as many points each way where it has them.

    >>> scheme_of("quadrature", 2).closure, scheme_of("lac", None).closure
    (False, True)
    """
    scheme = TREATMENTS[name].scheme(points or DEFAULT_POINTS)
    return replace(scheme, lost=without_partner)
