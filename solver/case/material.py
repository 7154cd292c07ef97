"""The material of a body."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Material:
    """Isotropic linear elasticity: Young's modulus (stress) and Poisson's ratio.

    `form` of its cells is displacement, mixed (see `solver.mechanics.fem.mixed`), or automatic.
    """

    young: float
    poisson: float
    form: str = field(default="automatic", compare=False)
