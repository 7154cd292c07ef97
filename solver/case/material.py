"""The material of a body."""

from dataclasses import dataclass, field, replace

MIXED_ABOVE = 0.499
"""Poisson's ratio above which the mixed form is taken where a case does not choose."""


@dataclass(frozen=True)
class Material:
    """Isotropic linear elasticity: Young's modulus (stress) and Poisson's ratio.

    `form` of its cells is displacement, mixed (see `solver.mechanics.fem.mixed`), or automatic.
    `thin`: the constants are those with which plane strain has the strains and the stress in the
    plane of another material in plane stress; the stress across the plane is zero.
    """

    young: float
    poisson: float
    form: str = field(default="automatic", compare=False)
    thin: bool = False

    @property
    def mixed(self) -> bool:
        """Whether its cells are solved in mixed form: as chosen, or above the bound."""
        nearly = self.form == "automatic" and self.poisson > MIXED_ABOVE
        return self.form == "mixed" or nearly

    def in_plane_stress(self) -> "Material":
        """E (1 + 2ν)/(1 + ν)² and ν/(1 + ν): E and E ν/(1 − ν²) stay as plane stress has them.

        Source: Timoshenko, Goodier, Theory of Elasticity, §17.

        >>> Material(1.0, 0.25).in_plane_stress()
        Material(young=0.96, poisson=0.2, form='automatic', thin=True)
        """
        young, nu = self.young, self.poisson
        poisson = nu / (1 + nu)
        return replace(self, young=young * (1 + 2 * nu) / (1 + nu) ** 2, poisson=poisson, thin=True)
