"""The cures against lost digits, each with a switch for the map of numerical stability."""

from dataclasses import dataclass

from solver.simulation.switches import Switches


@dataclass(frozen=True)
class Cures(Switches):
    """What the solver does to keep its digits: all of it unless a sweep turns something off.

    local_coordinates: points are counted from the middle of the mesh.
    gap_threshold: an initial gap of the size of the coordinates' rounding is none.
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


ALL = Cures()
