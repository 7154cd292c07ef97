"""The table of checks: one row is all that names, describes and feeds a check.

The types of the case file, the schema, the run of the checks, the report and the documentation read
it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

RELATIVE = 1e-3
GAP = 2e-5
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Check:
    """One row of the table.

    `what` it compares, in words. `alias` is the reference code's name, `key` the reference that
    feeds the check (None: always run), `sample` the function of `verification.samples` or
    `.numbers` that gives its values, and `of` what that is told, `tolerance` the default one (None:
    the relative one, which a case's single `tolerance` replaces), `scale` the measure of the
    quantity (`verification.checks`), `fixed` whether that measure holds even where the reference is
    not zero, `accepted` the tolerance against the accepted value, `like` the check whose tolerance
    holds where its own is not given. `needs`, of errors in norms: what an exact solution must have.
    `when`: what a case must be for the check to run, a property of it.
    """

    name: str
    what: str
    sample: str
    scale: str
    of: str = ""
    alias: str | None = None
    key: str | None = None
    needs: str = ""
    when: str = ""
    tolerance: float | None = None
    fixed: bool = False
    by_zone: bool = True
    accepted: float = ROUND_OFF
    norm: str = "max"
    like: str = ""

    @property
    def verifies(self) -> bool:
        """Whether the check compares the solution with a reference."""
        return self.key is not None or self.norm == "error"

    def concerns(self, case: Any) -> bool:
        """Whether a case is what it must be for the check to run."""
        return not self.when or bool(getattr(case, self.when))

    def tolerance_in(self, overrides: Mapping[str, float]) -> float:
        """The tolerance under a case's overrides: by check, or `all`.

        `all` takes the place of the relative tolerance, and of smaller ones where it is smaller.
        """
        for name in (self.name, self.like):
            if name in overrides:
                return overrides[name]
        if self.tolerance is None:
            return overrides.get("all", RELATIVE)
        return min(self.tolerance, overrides.get("all", self.tolerance))

    def expected_in(self, expected: Mapping[str, float]) -> float | None:
        """The expected error by a case's; None where a tolerance is stated."""
        return expected.get(self.name, expected.get(self.like))


def _norm(name: str, what: str, needs: str) -> Check:
    """The error of a field in a norm, against an exact solution that has what it `needs`."""
    words = f"error of {what}, relative"
    return Check(
        name, words, "norm", "unit", name, needs=needs, fixed=True, by_zone=False, norm="error"
    )


# The errors of `solver.verification.norms`.
_NORMS = (
    ("displacement_l2", "displacement, L2", "displacement"),
    ("displacement_h1", "displacement, H1", "gradient"),
    ("stress_l2", "stress, L2", "stress"),
    ("stress_max", "stress, largest at nodes", "stress"),
    ("pressure_l2", "pressure, L2", "contact_pressure"),
    ("pressure_max", "pressure, maximum", "contact_pressure"),
    ("pressure_means", "pressure, macro-element means", "contact_pressure"),
    ("pressure_total", "pressure, its integral", "contact_pressure"),
    ("pressure_oscillation", "pressure, second difference", "contact_pressure"),
    ("pressure_inner", "pressure, two macro-elements inside", "contact_pressure"),
    ("half_width", "half-width of contact", "half_width"),
    ("peak", "peak pressure", "peak"),
    ("traction_l2", "friction traction, L2", "friction_traction"),
    ("traction_means", "friction traction, macro-element means", "friction_traction"),
)
CHECKS: tuple[Check, ...] = (
    Check("multiplier", "contact pressure: the multiplier of every macro-element", "pressure",
          "load", alias="LAGS_C", key="contact_pressure"),
    Check("position_pressure",
          "contact pressure of every covered contact element at positions under the loads of the "
          "last one",
          "at_positions", "load", of="pressure", key="contact_pressure", when="moving",
          like="multiplier"),
    Check("nodal_stress", "normal stress at every node of both bodies", "nodal_stress", "load",
          alias="SIEF_NOEU", key="normal_stress", by_zone=False),
    Check("surface_stress_slave", "normal stress on the slave surface", "surface_stress", "load",
          of="slave", key="normal_stress"),
    Check("surface_stress_master", "normal stress on the master surface", "surface_stress", "load",
          of="master", key="normal_stress"),
    Check("element_pressure",
          "pressure of every contact element, from the forces at the slave nodes",
          "pressure_of_forces", "load", alias="CONT_ELEM/PRES", key="contact_pressure"),
    Check("element_gap", "average gap of every contact element, relative to the block size", "gap",
          "block_size", alias="CONT_ELEM/JEU", key="gap", tolerance=GAP, fixed=True),
    Check("element_status", "contact status of every contact element: 1 in contact, 0 open",
          "status", "unit", alias="CONT_ELEM/CONT", key="contact_pressure", tolerance=0.0,
          fixed=True),
    Check("coverage", "intersected area over the area of the macro-element", "coverage", "unit",
          alias="CONT_ELEM/COEFSURF", key="contact_pressure", tolerance=1e-06, fixed=True),
    Check("covered_pressure", "coverage × pressure", "covered_pressure", "load",
          alias="CONT_ELEM/PRESCOOR", key="contact_pressure", accepted=1e-06),
    Check("displacement", "displacement at every node", "displacement", "elongation", alias="DEPL",
          key="displacement", by_zone=False),
    Check("stress_components", "the other components of stress at every node", "stress_components",
          "load", key="stress", by_zone=False),
    Check("integration_stress", "stress at the integration points, from the displacement alone",
          "integration_stress", "load", key="stress", by_zone=False, like="stress_components"),
    Check("balance",
          "contact forces of both sides, and reactions against loads: forces and moments",
          "balance", "unit", tolerance=1e-10, fixed=True, by_zone=False),
    Check("friction_law",
          "Coulomb's law: traction within μp, along the slip, none without contact; work of "
          "friction",
          "friction_law", "unit", when="frictional", tolerance=1e-09, fixed=True),
    Check("friction_traction", "traction of friction on every contact element of the slave",
          "friction", "load", of="friction_traction", key="friction_traction"),
    Check("position_friction",
          "traction of friction on every covered contact element at positions under the loads of "
          "the last one, reached the same way",
          "at_positions", "load", of="friction_traction", key="friction_traction", when="moving",
          like="friction_traction"),
    Check("slip", "slip of the master on every contact element, in the last step", "friction",
          "elongation", of="slip", key="slip"),
    Check("stick_area", "area that sticks", "stick_area", "area", key="stick_area"),
    Check("dissipation", "work of friction in each step", "dissipation", "work", key="dissipation",
          by_zone=False),
    Check("force", "contact force on the surface listed as slave", "contact_force", "total_force",
          key="force"),
    Check("contact_area", "area of contact", "contact_area", "area", key="contact_area"),
    Check("reaction", "forces that hold groups", "reaction", "total_force", key="reaction",
          by_zone=False),
    Check("moment", "moment of contact on rigid bodies, about their reference points", "moment",
          "total_moment", key="moment", by_zone=False),
    Check("displacement_at", "displacement at probes", "probed", "elongation", of="displacement",
          key="displacement_at", by_zone=False),
    Check("stress_at", "stress at probes", "probed", "load", of="stress", key="stress_at",
          by_zone=False),
    Check("pressure_at", "contact pressure at probes", "probed", "load", of="pressure",
          key="pressure_at", by_zone=False),
    Check("strain_energy", "strain energy of all bodies", "strain_energy", "work",
          key="strain_energy", by_zone=False),
    Check("counts", "cells and contact faces of the bodies before the cut", "counts", "unit",
          tolerance=0.0, fixed=True, by_zone=False),
    Check("observation", "pressure of one contact element at every load step", "observed", "load",
          of="pressure", alias="OBSERVATION/PRES", key="contact_pressure"),
    Check("observation_gap", "gap of one contact element at every load step", "observed",
          "block_size", of="gap", alias="OBSERVATION/JEU", key="gap", tolerance=GAP, fixed=True),
    *(_norm(*row) for row in _NORMS),
)  # fmt: skip
BY_NAME = {check.name: check for check in CHECKS}
# The errors in norms, in words.
ERRORS = {name: what for name, what, _ in _NORMS}
