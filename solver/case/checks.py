"""The table of checks: one row is all that names, describes and feeds a check.

The types of the case file, the schema, the run of the checks, the report and the documentation read
it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

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
    quantity (`verification.scales`), `fixed` whether that measure holds even where the reference is
    not zero, `accepted` the tolerance against the accepted value, `like` the check whose tolerance
    holds where its own is not given. `needs`, of errors in norms: what an exact solution must have.
    """

    name: str
    what: str
    sample: str
    scale: str
    of: str = ""
    alias: str | None = None
    key: str | None = None
    needs: str = ""
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
    Check(
        "multiplier",
        "contact pressure: the multiplier of every macro-element",
        alias="LAGS_C",
        key="contact_pressure",
        sample="pressure",
        scale="load",
    ),
    Check(
        "nodal_stress",
        "normal stress at every node of both bodies",
        alias="SIEF_NOEU",
        key="normal_stress",
        sample="nodal_stress",
        scale="load",
        by_zone=False,
    ),
    Check(
        "surface_stress_slave",
        "normal stress on the slave surface",
        key="normal_stress",
        sample="surface_stress",
        of="slave",
        scale="load",
    ),
    Check(
        "surface_stress_master",
        "normal stress on the master surface",
        key="normal_stress",
        sample="surface_stress",
        of="master",
        scale="load",
    ),
    Check(
        "element_pressure",
        "pressure of every contact element, from the forces at the slave nodes",
        alias="CONT_ELEM/PRES",
        key="contact_pressure",
        sample="pressure_of_forces",
        scale="load",
    ),
    Check(
        "element_gap",
        "average gap of every contact element, relative to the block size",
        alias="CONT_ELEM/JEU",
        key="gap",
        sample="gap",
        scale="block_size",
        tolerance=GAP,
        fixed=True,
    ),
    Check(
        "element_status",
        "contact status of every contact element: 1 in contact, 0 open",
        alias="CONT_ELEM/CONT",
        key="contact_pressure",
        sample="status",
        scale="unit",
        tolerance=0.0,
        fixed=True,
    ),
    Check(
        "coverage",
        "intersected area over the area of the macro-element",
        alias="CONT_ELEM/COEFSURF",
        key="contact_pressure",
        sample="coverage",
        scale="unit",
        tolerance=1e-06,
        fixed=True,
    ),
    Check(
        "covered_pressure",
        "coverage × pressure",
        alias="CONT_ELEM/PRESCOOR",
        key="contact_pressure",
        sample="covered_pressure",
        scale="load",
        accepted=1e-06,
    ),
    Check(
        "displacement",
        "displacement at every node",
        alias="DEPL",
        key="displacement",
        sample="displacement",
        scale="elongation",
        by_zone=False,
    ),
    Check(
        "stress_components",
        "the other components of stress at every node",
        key="stress",
        sample="stress_components",
        scale="load",
        by_zone=False,
    ),
    Check(
        "integration_stress",
        "stress at the integration points, from the displacement alone",
        key="stress",
        sample="integration_stress",
        scale="load",
        by_zone=False,
        like="stress_components",
    ),
    Check(
        "balance",
        "contact forces of both sides, and reactions against loads: forces and moments",
        sample="balance",
        scale="unit",
        tolerance=1e-10,
        fixed=True,
        by_zone=False,
    ),
    Check(
        "friction_law",
        "Coulomb's law: traction within μp, along the slip, none without contact; work of friction",
        sample="friction_law",
        scale="unit",
        tolerance=1e-09,
        fixed=True,
    ),
    Check(
        "friction_traction",
        "traction of friction on every contact element of the slave",
        key="friction_traction",
        sample="friction",
        of="friction_traction",
        scale="load",
    ),
    Check(
        "slip",
        "slip of the master on every contact element, in the last step",
        key="slip",
        sample="friction",
        of="slip",
        scale="elongation",
    ),
    Check("stick_area", "area that sticks", key="stick_area", sample="stick_area", scale="unit"),
    Check(
        "dissipation",
        "work of friction in each step",
        key="dissipation",
        sample="dissipation",
        scale="unit",
        by_zone=False,
    ),
    Check(
        "force",
        "contact force on the surface listed as slave",
        key="force",
        sample="contact_force",
        scale="total_force",
    ),
    Check(
        "contact_area", "area of contact", key="contact_area", sample="contact_area", scale="unit"
    ),
    Check(
        "reaction",
        "forces that hold groups",
        key="reaction",
        sample="reaction",
        scale="total_force",
        by_zone=False,
    ),
    Check(
        "moment",
        "moment of contact on rigid bodies, about their reference points",
        key="moment",
        sample="moment",
        scale="total_moment",
        by_zone=False,
    ),
    Check(
        "displacement_at",
        "displacement at probes",
        key="displacement_at",
        sample="probed",
        of="displacement",
        scale="elongation",
        by_zone=False,
    ),
    Check(
        "stress_at",
        "stress at probes",
        key="stress_at",
        sample="probed",
        of="stress",
        scale="load",
        by_zone=False,
    ),
    Check(
        "pressure_at",
        "contact pressure at probes",
        key="pressure_at",
        sample="probed",
        of="pressure",
        scale="load",
        by_zone=False,
    ),
    Check(
        "strain_energy",
        "strain energy of all bodies",
        key="strain_energy",
        sample="strain_energy",
        scale="unit",
        by_zone=False,
    ),
    Check(
        "counts",
        "cells and contact faces of the bodies before the cut",
        sample="counts",
        scale="unit",
        tolerance=0.0,
        fixed=True,
        by_zone=False,
    ),
    Check(
        "observation",
        "pressure of one contact element at every load step",
        alias="OBSERVATION/PRES",
        key="contact_pressure",
        sample="observed",
        of="pressure",
        scale="load",
    ),
    Check(
        "observation_gap",
        "gap of one contact element at every load step",
        alias="OBSERVATION/JEU",
        key="gap",
        sample="observed",
        of="gap",
        scale="block_size",
        tolerance=GAP,
        fixed=True,
    ),
    *(_norm(*row) for row in _NORMS),
)
BY_NAME = {check.name: check for check in CHECKS}
# The errors in norms, in words.
ERRORS = {name: what for name, what, _ in _NORMS}
