"""Exact solutions: documented parameters, and fields that can be evaluated at any point.

A solution may have several parts (the inner and the outer cylinder) with formulas of their own. Its
fields take the part of each point, since a point of the interface belongs to both and a node of a
facetted circle may lie on the wrong side of it; left out, each point is taken by its place. Every
formula holds a little beyond its part, so that it can be evaluated on a mesh that does not fill the
exact geometry.
"""

from dataclasses import field, fields, replace
from typing import Any, ClassVar

import numpy as np

from ..material import Material

Part = np.ndarray | int | None
FRICTION = frozenset({"friction_traction", "slip"})
"""The quantities of solutions with friction."""


class ParameterError(ValueError):
    """A parameter has a value that is not allowed."""

    def __init__(self, parameter: str, value: object, allowed: str):
        self.parameter, self.value, self.allowed = parameter, value, allowed
        super().__init__(f"{parameter} = {value!r}: {allowed}")


def parameter(doc: str, **options: Any) -> Any:
    """A dataclass field with its meaning.

    `source`: where a case file says it already. `positive`: it must be.
    """
    more = {key: options.pop(key, None) for key in ("source", "positive")}
    return field(metadata={"doc": doc} | more, **options)


SOLUTIONS: dict[str, "type[ExactSolution]"] = {}
"""The classes that have a name; each enters itself."""


class ExactSolution:
    """A documented solution of a contact problem.

    Points `x` are (n, dim). Values: `contact_pressure` (n,) ≥ 0, `gap` (n,) ≥ 0, `displacement`
    (n, dim), `gradient` (n, dim, dim) with ∂u_i/∂x_j at [i, j], `stress` (n, 6) as xx, yy, zz, xy,
    yz, xz, `body_force` (n, dim) per volume. `quantities` lists those that the solution has; asking
    for another raises NotImplementedError.
    """

    name: ClassVar[str]
    parts: ClassVar[tuple[str, ...]] = ("body",)
    quantities: ClassVar[frozenset[str]] = frozenset({"contact_pressure"})
    dim: int

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" in vars(cls):
            SOLUTIONS[cls.name] = cls

    def __post_init__(self) -> None:
        for one in fields(self):  # type: ignore[arg-type] # every solution with parameters is one
            if one.metadata.get("positive"):
                self.require("must be positive", **{one.name: getattr(self, one.name) > 0})

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """Contact pressure (n,) at points of the interface."""
        raise self._missing("contact_pressure")

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Normal gap (n,) at points of the interface."""
        raise self._missing("gap")

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Displacement (n, dim)."""
        raise self._missing("displacement")

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Displacement gradient (n, dim, dim)."""
        raise self._missing("gradient")

    def stress(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Stress (n, 6)."""
        raise self._missing("stress")

    def body_force(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Force per volume (n, dim) that balances the stress: −div σ."""
        raise self._missing("body_force")

    def regular(self, x: np.ndarray) -> np.ndarray:
        """Where (n,) the contact pressure is smooth: away from the ends of a contact area."""
        return np.ones(len(x), dtype=bool)

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """Traction of friction (n, dim) on the first part, at points of the interface."""
        raise self._missing("friction_traction")

    def slip(self, x: np.ndarray) -> np.ndarray:
        """Slip (n, dim) of the second part relative to the first in the last step."""
        raise self._missing("slip")

    def moved(self, way: float) -> "ExactSolution | None":
        """The same contact further along x; None where it belongs to one place."""
        origin = getattr(self, "origin", None)
        return None if origin is None else replace(self, origin=origin + way)  # type: ignore[type-var]

    @property
    def states(self) -> "tuple[ExactSolution, ...]":
        """The solution of each step, where its fields do not grow with the load factor."""
        return ()

    @property
    def stick_area(self) -> float:
        """The area that sticks."""
        raise self._missing("stick_area")

    @property
    def dissipation(self) -> tuple[float, ...]:
        """The work of friction in each step."""
        raise self._missing("dissipation")

    @property
    def half_width(self) -> float:
        """Half the width, or the radius, of the contact."""
        raise self._missing("half_width")

    @property
    def peak(self) -> float:
        """The largest contact pressure."""
        raise self._missing("peak")

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """Half-width and peak of a computed pressure, from this alone, as far as they are known.

        Forces (n,) at points x (n, dim), means (m,) of macro-elements at their centres (m, dim).
        """
        raise self._missing("half_width")

    def level(self, x: np.ndarray) -> np.ndarray:
        """A distance (n,) from the interface, positive on the side of the second part.

        By default the interface is the plane where the last coordinate is 0.
        """
        return x[:, -1] if len(self.parts) == 2 else np.full(len(x), -1.0)

    def body_part(self, nodes: np.ndarray) -> int:
        """The part that a body with these nodes (n, dim) is."""
        return int(self.level(nodes).mean() > 0)

    def node_parts(self, points: np.ndarray, body: np.ndarray) -> np.ndarray:
        """The part (n,) that each node belongs to, the same for all of a body."""
        part = np.zeros(len(points), dtype=int)
        for number in np.unique(body):
            part[body == number] = self.body_part(points[body == number])
        return part

    def part_of(self, x: np.ndarray, part: Part) -> np.ndarray:
        """The part (n,) of each point; where it is not given, by place."""
        return (self.level(x) > 0).astype(int) if part is None else np.broadcast_to(part, len(x))

    def _missing(self, quantity: str) -> NotImplementedError:
        offered = ", ".join(sorted(self.quantities))
        return NotImplementedError(f"{self.name} has no {quantity}; it offers {offered}")

    def require(self, allowed: str, **values: bool) -> None:
        """Raise ParameterError for the first parameter whose condition does not hold."""
        for key, holds in values.items():
            if not holds:
                raise ParameterError(key, getattr(self, key), allowed)


class ElasticSolution(ExactSolution):
    """A solution of linear elasticity, known in the interior too: small strain, isotropic.

    In two dimensions plane strain, or plane stress of thin materials. Stress follows from
    `gradient` by Hooke's law.
    """

    quantities: ClassVar[frozenset[str]] = frozenset(
        {"contact_pressure", "gap", "displacement", "gradient", "stress", "body_force"}
    )

    @property
    def materials(self) -> tuple[Material, ...]:
        """The material of each part: the parameters that are materials."""
        own = fields(self)  # type: ignore[arg-type]
        return tuple(getattr(self, f.name) for f in own if f.metadata.get("source") == "material")

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Closed everywhere."""
        return np.zeros(len(x))

    def stress(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Stress (n, 6) by Hooke's law from the gradient."""
        return self.hooke(self.gradient(x, part), self.part_of(x, part))

    def body_force(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """None."""
        return np.zeros((len(x), self.dim))

    def hooke(self, gradient: np.ndarray, part: np.ndarray) -> np.ndarray:
        """Stress (n, 6) of displacement gradients (n, d, d) in the materials of the parts."""
        dim = gradient.shape[-1]
        lame, shear = (values[part] for values in np.array([lame_of(m) for m in self.materials]).T)
        stress = np.zeros((len(gradient), 6))
        stress[:, :3] = (lame * np.einsum("nii->n", gradient))[:, None]
        for i in range(dim):
            stress[:, i] += 2 * shear * gradient[:, i, i]
        if self.materials[0].thin:
            stress[:, 2] = 0.0
        for place, i, j in ((3, 0, 1), (4, 1, 2), (5, 0, 2))[: 3 if dim == 3 else 1]:
            stress[:, place] = shear * (gradient[:, i, j] + gradient[:, j, i])
        return stress


def lame_of(material: Material) -> tuple[float, float]:
    """Lamé's λ and μ of a material."""
    shear = material.young / (2 * (1 + material.poisson))
    return 2 * shear * material.poisson / (1 - 2 * material.poisson), shear
