"""Options of a solve beside its case: shortcuts, and safeguards against lost digits."""

from dataclasses import dataclass, field, fields
from typing import Self


@dataclass(frozen=True)
class Switches:
    """Base of a dataclass whose fields are all true by default."""

    @classmethod
    def none(cls) -> Self:
        """All of them off."""
        return cls(**{field.name: False for field in fields(cls)})


@dataclass(frozen=True)
class Shortcuts(Switches):
    """Work that is left out where the scene does not need it. Results change by round-off at most.

    quadrature: where all faces are affine images, plain Gauss rules integrate over the segments,
        without more points and without closure; cells with straight edges have the rules of these.
    status: no second solve where the first fulfils the conditions of contact, which starts from a
        guess; a factor is kept while the closed multipliers stay the same.
    unloaded: groups of bodies that nothing moves are not solved (see `simulation.scene.bodies`).
    """

    quadrature: bool = True
    status: bool = True
    unloaded: bool = True


@dataclass(frozen=True)
class Safeguards(Switches):
    """Safeguards against lost digits; each can be turned off to show its effect.

    local_coordinates: points are counted from the middle of the mesh.
    gap_threshold: an initial gap of the size of the coordinates' rounding counts as zero.
    closure: integrals over segments sum exactly to those over whole faces.
    refinement: the linear solution is refined by its residual.
    differences: residuals and gaps are summed from differences of displacement, else the residual
        is the product with the assembled stiffness.
    remainder: a displacement is kept as rigid motions plus a remainder in two parts, else as one
        number for each unknown.
    mixed: nearly incompressible material is solved with displacement and pressure as unknowns.
    extended: where double precision would lose too many digits of the residual, it is summed in
        extended precision.
    """

    local_coordinates: bool = True
    gap_threshold: bool = True
    closure: bool = True
    refinement: bool = True
    differences: bool = True
    remainder: bool = True
    mixed: bool = True
    extended: bool = True


@dataclass(frozen=True)
class Options:
    """How a case is solved: by default with all shortcuts and all safeguards.

    `solver`: what linear systems are solved by, `auto`, `cholmod` or `multigrid`.
    """

    shortcuts: Shortcuts = field(default_factory=Shortcuts)
    safeguards: Safeguards = field(default_factory=Safeguards)
    solver: str = "auto"

    @classmethod
    def everything(cls) -> Self:
        """No work is left out, needed or not."""
        return cls(shortcuts=Shortcuts.none())


LEAN = Options()
"""The default: only the work that is needed."""
