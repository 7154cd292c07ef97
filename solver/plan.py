"""What a solve left out, and why: read by the engineer in the result and in the report."""

from collections.abc import Sequence

import numpy as np

from solver.contact import MIN_COVERAGE, Equilibrium
from solver.lac.cut import needs_cut
from solver.mixed import AUTOMATIC_ABOVE
from solver.scene import Scene
from solver.treatments import scheme_of


def made_plan(
    scene: Scene, states: Sequence[Equilibrium], idle: np.ndarray
) -> list[tuple[str, str]]:
    """Pairs (what was left out or decided, why), in the order of the work.

    `idle` (k,): the multipliers that act on no free unknown.
    """
    plan = []
    if scene.mean.n_cells:
        why = f"nearly incompressible (Poisson's ratio above {AUTOMATIC_ABOVE:g}), or as chosen"
        plan.append((f"mixed form in {scene.mean.n_cells} cells", why))
    for zone in scene.zones:
        name = zone.zone.name
        kinds = sorted({block.type.name for block in zone.slave_faces})
        if zone.zone.treatment != "lac":
            plan.append((f"{name}: treatment {zone.zone.treatment}", zone.treatment.what))
        whole = [kind for kind in kinds if not needs_cut(kind)]
        if zone.treatment.cut and whole:
            plan.append((f"{name}: no cut", f"{', '.join(whole)} faces own an inner node"))
        if zone.operator.closed_faces:
            why = "some faces are no affine images of their reference face"
            plan.append((f"{name}: closure of {zone.operator.closed_faces} face integrals", why))
        elif scheme_of(zone.zone.treatment, zone.zone.points).closure:
            plan.append((f"{name}: plain Gauss rules", "every face is an affine image"))
        surface = zone.operator.surface
        bare = int((surface.covered <= MIN_COVERAGE * surface.area).sum())
        if bare:
            why = f"less than {MIN_COVERAGE:.0%} of their area lies under the master surface"
            plan.append((f"{name}: {bare} macro-elements out of contact", why))
        held = int(idle[zone.numbers].sum())
        if held:
            why = "supports hold the nodes of both surfaces there"
            plan.append((f"{name}: {held} multipliers left out", why))
    if all(state.status.iterations == 1 for state in states):
        why = "the first status already fulfils p ≥ 0, ḡ ≥ 0, p ḡ = 0"
        plan.append(("no second active-set solve", why))
    return plan
