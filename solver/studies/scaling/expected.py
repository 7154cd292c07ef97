"""How long the points of the scaling family take, before any is begun."""

from solver.mesh.catalogue import BY_NAME
from solver.studies.scaling.description import Point, Scaling

_START = 5.0  # seconds: three interpreters, libraries loaded, small mesh
# Wall seconds, meshing included: factor and power of the unknowns, by dimension and order.
_COST = {
    (2, 1): (2.8e-5, 1.0),
    (2, 2): (2.8e-5, 1.0),
    (3, 1): (2.5e-5, 1.1),
    (3, 2): (5.5e-5, 1.1),
}


def model(scaling: Scaling) -> dict[str, float]:
    """Seconds that each point takes, by name, on a machine like that of the model."""
    return {point.name: _modelled(point) for point in scaling.points}


def _modelled(point: Point) -> float:
    kind = BY_NAME[point.series.cells]
    factor, power = _COST[kind.dim, kind.order]
    return _START + factor * point.size**power
