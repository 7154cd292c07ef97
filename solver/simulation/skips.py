"""What a solve leaves out where its scene does not need it, each with a switch."""

from dataclasses import dataclass

from solver.simulation.switches import Switches


@dataclass(frozen=True)
class Skips(Switches):
    """What changes arithmetic, but, to round-off, no result: all of it is left out as a rule.

    cut: cells whose slave faces own an inner node are not cut.
    quadrature: where all faces are affine images, plain Gauss rules integrate over the segments,
        without more points and without closure; cells with straight edges have the rules of these.
    status: no second solve where the first fulfils the conditions of contact, which starts from a
        guess; a factor is kept while the closed multipliers stay the same.
    refinement: a solution is not refined further once its residual is round-off.
    unloaded: groups of bodies that nothing moves are not solved (see `solver.simulation.unloaded`).
    apart: groups of bodies that no contact joins are factored one by one.
    """

    cut: bool = True
    quadrature: bool = True
    status: bool = True
    refinement: bool = True
    unloaded: bool = True
    apart: bool = True


NEEDED = Skips()
"""Only what is needed is done."""
EVERYTHING = Skips.none()
"""All is done, needed or not."""
