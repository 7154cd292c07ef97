"""Faults planted in the core: a row each, with the cases of the batch that must turn red for it.

A patch replaces one function by another made from it. `python -m tests.faults.mutants` plants all
of them, one at a time, and says which check noticed.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from msgspec import structs

from solver.simulation.scene.moved import Frames
from tests.faults.patches import (
    changed,
    every_third_off,
    factor_of_half,
    first_guess_kept,
    first_nodes_exchanged,
    first_scaled,
    first_status_kept,
    first_system_kept,
    given,
    integrals_of,
    last_block_closed,
    last_cell_lost,
    last_opened,
    lower_half_softer,
    master_overlooked,
    more_covered,
    never_closes,
    never_closing,
    normals_rolled,
    of_each_row,
    one_dropped,
    rolled_sub_faces,
    shared_nodes_free,
    springs_counted,
    stays_closed,
    template_off_by_one,
    template_piece_lost,
)
from tests.faults.planted import Mutant, reason

PLANE, SOLID = "ssnp170/c", "opening/overlap-tetra10-hexa8"
CLOSING, OPEN = "opening/closing-quad4", "opening/staying-open"
TILTED, TILTED_SOLID = "hydrostatic/tilted-tria3-quad8", "hydrostatic/tilted-hexa20-tetra10"
BENT, PARTLY, VARYING = "hydrostatic/coincident-quad8", "hertz/cylinder-tria3", "manufactured/quad4"
MIXED_FACES = "hydrostatic/mixed-faces"
LAYERS, SPHERES = "lame/cylinders-two-materials", "lame/spheres-hexa20"
HEATED = "loads/heated"
FORCES, FOUNDATION, PLATEN = "loads/selected-groups", "loads/foundation", "loads/platen"
UNLOADING, SECTOR = "loads/unloading", "lame/rings-sector"
CORNER, SPLIT = "shared/corner-quad4-tria6", "shared/split-nodal"
ENDING, EDGE, CYLINDER = "partial-waves/tria6", "contact-edge/tria3", "half-planes/hertz-quad4"
RECEDING = "receding/quad8"
TUBES = "axisymmetric/compound-tube"
MIXED, NODAL_NORMALS = "bending/quad9-mixed", "lame/normal-nodal"
RATIO, SIDES = "lame/ratio-quad8", "opening/changing-sides"
BENDING, UNCOVERED = "bending/quad8-tria6", "uncovered/quad8-quad4"
CURVED, CUP = "rigid/curved-face", "rigid/hollow-sphere"
ROLLER = "rigid/cylinder"
DIE, SHAFT, LINES = "rigid/tilted-die", "rigid/shaft-in-tube", "rigid/lines-of-the-mesh"
STIFF, OBSTACLE = "waves/stiff-quad4", "hertz/plane-obstacle"
STUCK, SLIDING, STEPWISE = (f"friction-patch/{n}" for n in ("n-stick", "e-slip", "two-steps"))
UNLOADED, PULLED = "friction/unloaded-quad8", "friction/pulled-quad8"
RIGHT, RECOVERED = "friction-patch/t-slip", "friction/sliding-recovered"
SPATIAL = "friction-patch/v-slip"
SLID, RUBBING, TURNED = "motion/slide-c", "motion/slide-c-friction", "motion/rings"
ALONG = "motion/hertz"
DISC, RINGS = "axisymmetric/disc-quad4-tria6", "axisymmetric/spheres-quad8"


MUTANTS = (
    Mutant("gap-sign", "the initial gap has the wrong sign", CLOSING,
           "lac.operator:integrals",
           changed(lambda p: replace(p, gap=-p.gap))),
    Mutant("operator-sign", "the gap operator has the wrong sign: surfaces attract", PLANE,
           "simulation.scene.operators:gap_operator",
           changed(lambda o: replace(o, matrix=-o.matrix))),
    Mutant("normal-side", "slave and master faces are turned inward", PLANE,
           "simulation.scene.operators:facets",
           given(lambda x, kind, nodes, *more: (x, kind, nodes[:, ::-1], *more))),
    Mutant("master-order", "master shape functions are assigned to the next node", TILTED,
           "lac.operator:integrals",
           changed(lambda p: replace(p, vectors=(p.vectors[0], np.roll(p.vectors[1], 1, axis=2))))),
    Mutant("slave-side-lost", "slave nodes are missing in the derivative of the gap", PLANE,
           "lac.operator:integrals",
           changed(lambda p: replace(p, vectors=(0 * p.vectors[0], p.vectors[1])))),
    Mutant("sliver-lost", "the smallest segment is dropped", PLANE,
           "lac.operator:intersect", changed(one_dropped)),
    Mutant("sliver-lost-3d", "the smallest segment is dropped, in 3D", TILTED_SOLID,
           "lac.operator:intersect", changed(one_dropped)),
    Mutant("pair-lost", "the pairing misses one master face", PLANE,
           "lac.pairing:candidate_pairs", changed(master_overlooked)),
    Mutant("macro-element-dropped", "one macro-element never closes", PLANE,
           "simulation.equilibrium.problem:contact_constraints", never_closing),
    Mutant("macro-element-numbers", "sub-faces are assigned to the next macro-element", VARYING,
           "simulation.scene.scene:cut", changed(rolled_sub_faces)),
    Mutant("template-off-by-one", "the nodes of the first sub-face of the cut are shifted by one",
           PLANE, "lac.cut:_template", changed(template_off_by_one)),
    Mutant("template-piece-lost", "the cut loses a piece of the cell", SOLID,
           "lac.cut:_template", changed(template_piece_lost)),
    Mutant("jacobian", "the Jacobian of one cell is 1 % too large", PLANE,
           "mechanics.fem.elasticity:shapes_in",
           changed(lambda found: replace(found, measure=first_scaled(found.measure, 1.01)))),
    Mutant("node-order", "the first two nodes of every cell are exchanged", PLANE,
           "mechanics.fem.elasticity:shapes_in", changed(first_nodes_exchanged)),
    Mutant("quadrature-weight", "one quadrature weight of the cells is 10 % off", BENT,
           "mechanics.fem.block:volume_rule",
           changed(lambda rule: (rule[0], first_scaled(rule[1], 1.1)))),
    Mutant("compiled-cell-lost", "the compiled loop for stress at nodes leaves out a cell", SOLID,
           "mechanics.fem.stress:cell_loops", last_cell_lost),
    Mutant("segment-weight", "one quadrature weight of the segments is 10 % off", TILTED,
           "lac.segments:simplex_rule",
           changed(lambda rule: (rule[0], first_scaled(rule[1], 1.1)))),
    Mutant("closure-of-one-block", "of several blocks of faces one alone has closed integrals",
           MIXED_FACES, "lac.operator:close_faces", last_block_closed),
    Mutant("segment-arc", "the slopes of arcs in the reference face are 0.1 % too large", SPHERES,
           "lac.segments:_into_reference",
           changed(lambda image: lambda *arcs: (image(*arcs)[0], 1.001 * image(*arcs)[1]))),
    Mutant("load-weight", "one quadrature weight of the loads is 10 % off", PLANE,
           "mechanics.fem.loads:face_rule",
           changed(lambda rule: (rule[0], first_scaled(rule[1], 1.1)))),
    Mutant("poisson-term", "Lamé's λ has its value in plane stress", PLANE,
           "simulation.scene.attributes:lame_parameters",
           changed(lambda lm: (2 * lm[0] * lm[1] / (lm[0] + 2 * lm[1]), lm[1]))),
    Mutant("shear-modulus", "E / (2 + ν) instead of E / (2 (1 + ν))", PLANE,
           "simulation.scene.attributes:lame_parameters",
           changed(lambda lm: (lm[0], lm[1] * 2.6 / 2.3))),
    Mutant("pressure-sign", "a pressure pulls", PLANE,
           "simulation.scene.attributes:face_forces", changed(lambda force: -force)),
    Mutant("load-side", "a load acts on the opposite side of its faces", TILTED,
           "mechanics.fem.loads:surface_vectors",
           changed(lambda found: (found[0], -found[1]))),
    Mutant("load-mean", "a load is shared equally among the nodes of a face", BENT,
           "mechanics.fem.loads:surface_vectors",
           changed(lambda found: (np.full(found[0].shape, 1 / found[0].shape[1]), found[1]))),
    Mutant("sector-turn", "the copied side is turned by the angle and back again", SECTOR,
           "simulation.scene.holdings.cyclic:copies_of", changed(
               lambda found: {k: replace(c, turn=c.turn.T) for k, c in found.items()})),
    Mutant("probe-nodes", "probes take the nodes of a cell in the wrong order", PLATEN,
           "simulation.results.results:cell_at",
           changed(lambda found: (np.roll(found[0], 1), found[1]))),
    Mutant("traction-lost", "the exact solution's traction does not act", CYLINDER,
           "simulation.scene.attributes:Attributes._exact_force", changed(np.zeros_like)),
    Mutant("force-share", "a force on a group is 1 % too large", FORCES,
           "simulation.scene.attributes:Attributes._share", changed(lambda share: 1.01 * share)),
    Mutant("selected-side", "selected faces belong to all bodies there", FORCES,
           "simulation.scene.selections:_within", changed(np.ones_like)),
    Mutant("spring-weight", "an elastic foundation is 1 % too stiff", FOUNDATION,
           "simulation.scene.parts.springs:foundation", changed(lambda k: 1.01 * k)),
    Mutant("spring-energy", "the energy in springs counts as strain energy", FOUNDATION,
           "simulation.results.results:strain_energy", springs_counted),
    Mutant("initial-energy", "the energy of initial strain has the wrong sign", HEATED,
           "simulation.scene.parts.strain:strain_loads",
           changed(lambda found: replace(found, energy=-found.energy))),
    Mutant("axial-balance", "axisymmetric bodies have no balance along the axis", DISC,
           "simulation.results.balance:_both", changed(lambda _: {})),
    Mutant("hollow-side", "a hollow sphere is a full one", CUP,
           "mechanics.mortar.quadric:_round",
           lambda true: lambda point, across, radius, hollow: true(point, across, radius, False)),
    Mutant("cylinder-axis", "a cylinder is curved along its axis too", ROLLER,
           "mechanics.mortar.quadric:_round",
           lambda true: lambda point, across, *rest: true(point, np.eye(len(across)), *rest)),
    Mutant("segments-lost", "segments farther away than half a slave face are lost", CURVED,
           "lac.operator:on_one_surface",
           changed(lambda found: [s.of(np.abs(s.gap).max(axis=1) < 0.22) for s in found])),
    Mutant("spring-reaction", "the balance of forces leaves out springs", FOUNDATION,
           "simulation.results.balance:_of_ground", changed(np.zeros_like)),
    Mutant("initial-stress", "stress is not reduced by initial strain", HEATED,
           "simulation.scene.parts.strain:strain_loads",
           changed(lambda found: replace(found, stress=np.zeros_like(found.stress)))),
    Mutant("initial-zz", "initial strain across the plane has no effect", HEATED,
           "simulation.scene.parts.strain:strain_at",
           changed(lambda strain: strain * [1, 1, 0, 1, 1, 1])),
    Mutant("tie-lost", "nodes that should move as one move apart", PLATEN,
           "simulation.scene.holdings.together:tied", lambda _: lambda free, ties: free),
    Mutant("history-lost", "every load acts in full in every step", UNLOADING,
           "simulation.scene.scene:Scene.acting",
           lambda made: lambda scene, step: made(scene, dict.fromkeys(step, 1.0))),
    Mutant("zone-ends", "a zone has no force at nodes that an earlier zone has", CORNER,
           "simulation.scene.scene:_zones", shared_nodes_free),
    Mutant("zone-twice", "a node in two zones has a multiplier in each", SPLIT,
           "mechanics.mortar.treatments:_held",
           given(lambda operator, nodes, basis, _: (operator, nodes, basis, None))),
    Mutant("area-lost", "segments lose 3 % of every macro-element", PLANE,
           "simulation.scene.operators:gap_operator",
           changed(lambda o: replace(o, matrix=0.97 * o.matrix))),
    Mutant("coverage-lost", "a partly covered face counts as fully covered", PARTLY,
           "simulation.scene.operators:gap_operator",
           changed(lambda o: replace(o, covered=o.area,
                                     surface=replace(o.surface, covered=o.surface.area)))),
    Mutant("stress-mean", "the stress at nodes is the plain mean over the quadrature points",
           LAYERS, "mechanics.fem.stress:extrapolation",
           changed(lambda fit: np.full(fit.shape, 1 / fit.shape[1]))),
    Mutant("stress-rows", "every node of a cell gets the stress of its neighbour", VARYING,
           "mechanics.fem.stress:extrapolation",
           changed(lambda fit: np.roll(fit, 1, axis=0))),
    Mutant("stress-bits", "σ_xx is off by 9e-4 of the load at every third node", PLANE,
           "simulation.results.results:nodal_stress", changed(every_third_off)),
    Mutant("poisson-digits", "ν of the lower block is 0.2991 instead of 0.3", PLANE,
           "simulation.scene.attributes:Attributes.by_material", lower_half_softer),
    Mutant("stale-system", "the factored system belongs to the first status", CLOSING,
           "mechanics.linear.systems:Systems.closed", first_system_kept),
    Mutant("wrong-factor", "the factorisation belongs to half the stiffness", PLANE,
           "mechanics.linear.choice:Solvers.prepare", factor_of_half),
    Mutant("multiplier-sign", "the multiplier has the wrong sign in the equilibrium", PLANE,
           "mechanics.linear.condensation:CondensedSystem.multiplier",
           changed(lambda p: -p)),
    Mutant("never-closes", "the contact status never closes a macro-element", CLOSING,
           "simulation.equilibrium.problem:find_status", never_closes),
    Mutant("bears-tension-beyond", "closed contact stays closed under tension where it should end",
           RECEDING, "simulation.equilibrium.problem:find_status", stays_closed),
    Mutant("gap-short", "gaps are 1 % too small", RECEDING,
           "simulation.equilibrium.iterate:ContactIterate.gap",
           lambda true: property(lambda self: 0.99 * true.fget(self))),
    Mutant("first-guess-kept", "the contact status is its first guess", ENDING,
           "simulation.equilibrium.problem:find_status", first_guess_kept),
    Mutant("end-too-early", "the last macro-element of the contact stays open", EDGE,
           "simulation.equilibrium.problem:find_status", changed(last_opened)),
    Mutant("bears-tension", "closed contact stays closed under tension", OPEN,
           "simulation.equilibrium.problem:find_status", stays_closed),
    Mutant("support-lost", "a support loses its last node", PLANE,
           "simulation.scene.attributes:Attributes.nodes", changed(lambda nodes: nodes[:-1])),
    Mutant("material-mixed-up", "the materials of the two bodies are exchanged", LAYERS,
           "simulation.scene.attributes:Attributes.by_material",
           changed(lambda values: {k: v[::-1] for k, v in values.items()})),
    Mutant("origin-forgotten", "expressions see coordinates relative to the middle", VARYING,
           "simulation.scene.attributes:Attributes.__init__",
           lambda true: lambda self, case, mesh, cut, zones, origin: true(
               self, case, mesh, cut, zones, 0 * origin)),
    Mutant("radius-lost", "segments of axisymmetric faces lack the measure 2πr", DISC,
           "lac.segments:circumference",
           changed(lambda around: np.full(around.shape, around.mean()))),
    Mutant("load-radius-lost", "loads on axisymmetric faces lack the measure 2πr", DISC,
           "mechanics.fem.loads:surface_vectors",
           given(lambda points, nodes, kind, places, _: (points, nodes, kind, places, False))),
    Mutant("hoop-lost", "axisymmetric cells have no hoop strain", DISC,
           "mechanics.fem.elasticity:hoop_values",
           changed(lambda found: (0 * found[0], found[1]))),
    Mutant("hoop-halved", "the hoop strain of axisymmetric cells is half of what it is", RINGS,
           "mechanics.fem.elasticity:hoop_values",
           changed(lambda found: (0.5 * found[0], found[1]))),
    Mutant("recovered-load", "the loads of the recovered pressure are 0.1 % too small", BENDING,
           "lac.operator:recovery",
           changed(lambda r: r and replace(r, loads=0.999 * r.loads))),
    Mutant("sweeps-lost", "a recovery makes two sweeps, settled or not", BENDING,
           "simulation.equilibrium.recovery:most_sweeps", changed(lambda most: most and 2)),
    Mutant("covered-share", "partly covered faces have 0.1 % too much of covered area", UNCOVERED,
           "simulation.scene.operators:gap_operator", changed(more_covered)),
    Mutant("zone-interference", "every zone has the interference 0.02", TUBES,
           "simulation.scene.operators:_initial_gaps",
           given(lambda zone, *rest: (structs.replace(zone, interference=0.02), *rest))),
    Mutant("mixed-weight", "the mixed form is 1 % too stiff against a change of volume", MIXED,
           "mechanics.fem.mixed:_integrals",
           changed(lambda found: (*found[:2], 0.99 * found[2]))),
    Mutant("normals-rolled", "nodes of a face have the normals of its other end", NODAL_NORMALS,
           "simulation.scene.operators:with_nodal_normals", changed(normals_rolled)),
    Mutant("chords", "curved faces count as straight", RATIO,
           "simulation.scene.operators:facets",
           changed(lambda f: replace(f, affine=np.ones(len(f.affine), dtype=bool)))),
    Mutant("first-status", "what is open in the first step stays open", SIDES,
           "simulation.equilibrium.problem:find_status", first_status_kept),
    Mutant("moment-sign", "moments on rigid bodies have the wrong sign", DIE,
           "simulation.results.results:rigid_bodies",
           changed(lambda bodies: [replace(body, moment=-body.moment) for body in bodies])),
    Mutant("reference-point", "rigid bodies turn about another point", DIE,
           "simulation.scene.holdings.rigid:_frame",
           changed(lambda f: replace(f, motions={**f.motions, "rz": f.motions["rz"] + 1.0}))),
    Mutant("rigid-radius", "a rigid circle is too flat by 0.1 %", SHAFT,
           "simulation.scene.attributes:Attributes.surface",
           changed(lambda q: q and replace(q, curvature=0.999 * q.curvature))),
    Mutant("layer-side", "rigid lines look away from the slave", LINES,
           "simulation.scene.holdings.rigid_surfaces:turned",
           changed(lambda faces: {name: nodes[:, ::-1] for name, nodes in faces.items()})),
    Mutant("stabilisation-lost", "stabilised contact does not give way", STIFF,
           "mechanics.mortar.treatments:Stabilisation.scatter",
           changed(lambda scatter: 0 * scatter)),
    Mutant("normal-of-slave", "contact follows the slave's normals, not the master's", OBSTACLE,
           "simulation.scene.operators:with_master_normals",
           lambda _: lambda slaves, masters, points: slaves),
    Mutant("open-slips", "integrals of slip are not closed on bent faces", STUCK,
           "lac.operator:slip_operator",
           given(lambda parts, *rest: ([integrals_of(part) for part in parts], *rest))),
    Mutant("slip-direction", "the tangents of a face have units of their own in the law", SPATIAL,
           "mechanics.mortar.coulomb:CoulombContact.__init__", of_each_row),
    Mutant("bound-halved", "the bound of friction is that of half the coefficient", STEPWISE,
           "mechanics.mortar.coulomb:CoulombContact.__init__",
           given(lambda contact, s, c, friction, *of: (contact, s, c, friction / 2, *of))),
    Mutant("slip-history", "slip is counted from the undeformed state in each step", UNLOADED,
           "simulation.equilibrium.problem:ContactProblem.with_jumps",
           given(lambda problem, step, jump, last, *more: (problem, step, jump, 0 * last, *more))),
    Mutant("traction-side", "the traction of friction is that on the master", SLIDING,
           "simulation.results.results:zone_friction",
           changed(lambda f: f and replace(f, friction_traction=-f.friction_traction))),
    Mutant("tangents-exchanged", "the two tangents are exchanged", RIGHT,
           "lac.operator:slip_operator", changed(lambda rows: rows[::-1])),
    Mutant("slip-without-rings", "slip is weighted as in the plane around an axis", PULLED,
           "lac.operator:slip_operator",
           changed(lambda rows: tuple(0.9 * row for row in rows))),
    Mutant("slide-lost", "friction of a recovered pressure is that of the constants", RECOVERED,
           "simulation.equilibrium.friction_recovery:_Loads.of",
           changed(lambda loads: replace(loads, slide=0 * loads.slide))),
    Mutant("traction-unrecovered", "the recovered traction is that on the master", RECOVERED,
           "simulation.results.results:zone_friction",
           changed(lambda f: f and replace(f, recovered=-f.recovered))),
    Mutant("frames-kept", "bodies that slide far are not followed", SLID,
           "simulation.motion:_followed",
           given(lambda rest, faces, old, _: (rest, faces, old, old))),
    Mutant("slip-of-the-path", "slip leaves out how far the bodies went", RUBBING,
           "simulation.equilibrium.problem:ContactProblem.__init__",
           given(lambda problem, scene, carried=None: (problem, scene, 0 * carried))),
    Mutant("pressure-kept", "pressure does not turn with its face", TURNED,
           "simulation.scene.moved:Frames.turned",
           given(lambda frames, vectors, body: (Frames.still(len(frames.turn), len(vectors[0])),
                                                vectors, body))),
    Mutant("solution-at-the-end", "the exact solution is that of the last step in each", ALONG,
           "case.model:Case.exact_in", given(lambda case, step: (case, case.steps[-1]))),
    Mutant("surface-left", "a rigid surface stays where it is given", ALONG,
           "mechanics.mortar.quadric:Quadric.moved",
           given(lambda surface, turn, shift: (surface, turn, 0 * shift))),
    Mutant("work-halved", "friction does half the work, as if it grew with the slip", STEPWISE,
           "simulation.equilibrium.friction:_work", changed(lambda work: work / 2)),
)  # fmt: skip


def main() -> int:
    """Plant every fault and print what noticed it."""
    caught = 0
    for mutant in MUTANTS:
        why = reason(mutant)
        caught += bool(why)
        shown = f"caught by {mutant.case}: {why[:110]}" if why else f"NOT CAUGHT by {mutant.case}"
        print(f"{mutant.name}: {mutant.what}\n    {shown}", flush=True)
    print(f"{caught} of {len(MUTANTS)} planted faults caught")
    return int(caught < len(MUTANTS))


if __name__ == "__main__":
    sys.exit(main())
