"""What holds and joins the bodies of a model: a chain, a link for each key of the case.

Each link fixes displacements or changes what is left free, and knows no other one. A link is made
only where the case has its key. A new one is a new file here and a line in `holdings_of`.

    imposed      displacements of supports, the axis of axisymmetric bodies
    cyclic       sides that move as others do
    together     nodes that move as one
    rigid        rigid bodies; rigid_surfaces: their cells, where the mesh has none
"""

from __future__ import annotations

from ..cut_groups import CutGroups
from .holding import Holding
from .imposed import Imposed, RingAxis


def holdings_of(groups: CutGroups) -> list[Holding]:
    """The chain of a case."""
    case = groups.case
    found: list[Holding] = [RingAxis(groups)] if groups.axisymmetric else []
    found.append(Imposed(groups))
    if any(support.cyclic for support in case.supports):
        from .cyclic import CyclicSides

        found.append(CyclicSides(groups))
    if any(support.together for support in case.supports):
        from .together import Together

        found.append(Together(groups))
    if case.rigid:
        from .rigid import RigidBodies

        found.append(RigidBodies(groups))
    return found
