"""Refusals of the case file: one clear line for whatever is wrong."""

import re

import pytest

from solver.case.reader import parse_case
from solver.system.errors import InputError
from tests.case.files import FULL, MINIMAL, PATH

CONTACT = "contact: [{name: a, slave: S, master: M}]\n"


@pytest.mark.parametrize("key", ["name", "mesh", "materials", "supports"])
def test_needed_keys(key):
    lines = [line for line in MINIMAL.splitlines() if not line.startswith(key)]
    with pytest.raises(InputError, match=f"^family/c.yaml: {key}: this key is needed$"):
        parse_case("\n".join(lines), PATH)


SOLUTION_ALONE = (
    "reference: {kind: analytical, solution: {name: hydrostatic, pressure: 1, material: all}}"
)
PLANE = "plane: {point: [0, 0], normal: [0, 1]}"
REFUSED = [
    # unknown keys, with the nearest allowed one
    ('"a\\nb": 1', "'a\\nb' = 1: unknown key; allowed: "),
    ("suports: []", "suports = []: unknown key; did you mean supports?"),
    ("bodies: {die: {E: 1}}", "bodies.die.E = 1: the keys of a material are young and poisson"),
    ("bodies: {die: {nu: 0}}", "bodies.die.nu = 0: the keys of a material are young and poisson"),
    ("loads: [{group: g, pressure: '8,03'}]", "'8,03': write numbers with a point: 8.03"),
    ("plane: stressed", "plane = 'stressed': must be strain, stress or axisymmetric"),
    ("transform: {rotation: 1}", "transform.rotation = 1: unknown key; did you mean rotate?"),
    ("transform: {scale: 0}", "transform.scale = 0: must be a positive number"),
    ("transform: {stretch: [1, 0]}", "transform.stretch[1] = 0: must be a positive number"),
    ("transform: {rotate: left}", "transform.rotate = 'left': must be an angle in degrees"),
    ("transform: {rotate: {angle: 3}}", "transform.rotate.axis: this key is needed"),
    (
        "transform: {rotate: {axis: [0, 0, 1], angel: 3, angle: 3}}",
        "transform.rotate.angel = 3: unknown key; did you mean angle?",
    ),
    ("transform: {perturb: -0.1}", "transform.perturb = -0.1: must be a positive share"),
    ("transform: {perturb: {seed: 1}}", "transform.perturb.amplitude: this key is needed"),
    ("transform: {renumber: 1.5}", "transform.renumber = 1.5: must be a seed"),
    ("transform: {renumber: {seed: -1}}", "transform.renumber.seed = -1: must be a whole number"),
    (
        "contact: [{name: a, slave: S, master: M, normals: element}]",
        "contact[0].normals = 'element': unknown key; did you mean normal?",
    ),
    (
        "bodies: {die: {stiff: true}}",
        "bodies.die.stiff = True: unknown key; allowed: cylinder, force",
    ),
    ("bodies: {die: {rigid: 1}}", "bodies.die.rigid = 1: must be true or false"),
    ("bodies: {die: {sphere: {centre: [0, 0]}}}", "bodies.die.sphere.radius: this key is needed"),
    (
        "bodies: {die: {sphere: {centre: [0, 0], radius: 0}}}",
        "die.sphere.radius = 0: must be a posi",
    ),
    (
        "bodies: {die: {cone: {angle: 3}}}",
        "bodies.die.cone = {'angle': 3}: unknown key; allowed: c",
    ),
    (
        "bodies: {die: {move: {y: 1}}}",
        "bodies.die.move = {'y': 1}: only a rigid body has it: add `r",
    ),
    ("bodies: {die: {rigid: true, name: push}}", "bodies.die.name = 'push': only a body with `mov"),
    (
        "bodies: {die: {rigid: true, move: {y: 1, rz: 0}, force: {rz: 0}}}",
        "bodies.die.force.rz = 0: `move` gives this component too",
    ),
    (
        "bodies: {die: {rigid: true, move: {w: 1}}}",
        "bodies.die.move.w",
    ),
    (
        "bodies: {die: {plane: {point: [0, 0], normal: [0, 0]}}}",
        "bodies.die.plane.normal = [0, 0]: must have a direction",
    ),
    (
        "bodies: {die: {cylinder: {point: [0, 0, 0], axis: [0, 0, 0], radius: 1}}}",
        "bodies.die.cylinder.axis = [0, 0, 0]: must have a direction",
    ),
    (
        f"bodies: {{die: {{{PLANE}, sphere: {{centre: [0, 0], radius: 1}}}}}}",
        "bodies.die = {'plane'",
    ),
    (
        f"bodies: {{die: {{{PLANE}}}}}",
        "bodies.die = 'plane': has no mesh and is the master of no contact zone",
    ),
    (
        f"bodies: {{die: {{{PLANE}}}}}\ncontact: [{{slave: die, master: M}}]",
        "contact[0].slave = 'die': is a rigid plane; a rigid side is always the master",
    ),
    (
        f"bodies: {{die: {{{PLANE}}}}}\ndirections: both\ncontact: [{{slave: S, master: die}}]",
        "contact[0].master = 'die': is a rigid plane; a rigid side is always the master, so direc",
    ),
    # values out of a list
    (
        "contact: [{slave: S, master: M, hexahedra: prisms}]",
        "contact[0].hexahedra = 'prisms': must be pyramids or hexahedra",
    ),
    (
        "contact: [{slave: S, master: M, treatment: penalty}]",
        (
            "contact[0].treatment = 'penalty': must be lac, uncut, quadrature, "
            "node_to_segment, nodal or nodal_dual"
        ),
    ),
    (
        "contact: [{slave: S, master: M, treatment: node_to_segment, normal: nodal}]",
        (
            "contact[0].normal = 'nodal': the treatment node_to_segment has normals of its own; "
            "allowed: element"
        ),
    ),
    (
        "expected: {all: 1.0e-3}",
        "expected.all = 0.001: must be the name of a check without a tolerance of its own",
    ),
    (
        "contact: [{slave: S, master: M, sweeps: 4}]",
        "contact[0].sweeps = 4: only a recovery has sweeps",
    ),
    (
        "contact: [{slave: S, master: M, points: 4}]",
        "contact[0].points = 4: only the treatment quadrature has points",
    ),
    (
        "contact: [{slave: S, master: M, treatment: quadrature, points: 0}]",
        "contact[0].points = 0: must be a number from 1 to 16",
    ),
    (
        "contact: [{slave: S, master: M, normal: smooth}]",
        "contact[0].normal = 'smooth': must be element",
    ),
    ("directions: second", "directions = 'second': must be first or both"),
    # contact
    ("contact: [{master: M}]", "contact[0].slave: this key is needed"),
    (
        "contact: [{slave: S, master: S}]",
        "contact[0].master = 'S': the slave is its own master: they must be two groups",
    ),
    (
        "contact: [{name: a, slave: S, master: M}, {name: a, slave: T, master: M}]",
        "contact[1].name = 'a': the name is given to two zones",
    ),
    (
        "contact: [{name: a/b, slave: S, master: M}]",
        "contact[0].name = 'a/b': must be a name of letters, digits",
    ),
    (
        "contact: [{slave: 3, master: M}]",
        "contact[0].slave = 3: must be the name of a group of the mesh (in quotes",
    ),
    (
        "contact: [{slave: S, master: M, interference: small}]",
        "contact[0].interference = 'small': must be a number",
    ),
    # loads
    (
        "loads: [{group: Top}]",
        "loads[0] = {'group': 'Top'}: must be {group, and exactly one of pressure, traction",
    ),
    (
        "loads: [{group: Top, pressure: 1, traction: [0, 0, 1]}]",
        "must be {group, and exactly one of pressure, traction, body_force, force, strain, ",
    ),
    ("loads: [{pressure: 1}]", "must be {group} with its load, or {at, force}"),
    ("loads: [{group: Top, pressure: true}]", "loads[0].pressure = True: must be a number or"),
    ("loads: [{group: Top, pressure: [1]}]", "loads[0].pressure = [1]: must be a number or an"),
    ("loads: [{group: Top, traction: 1}]", "loads[0].traction = 1: must be a list of two (plane)"),
    (
        "loads: [{group: Top, pressure: 25*t}]",
        "loads[0].pressure = '25*t': `t` is not allowed in it; it must be a number or an expr",
    ),
    (
        "loads: [{group: Top, traction: [0, 0, open]}]",
        "loads[0].traction[2] = 'open': `open` is not allowed in it",
    ),
    (
        "loads: [{group: Top, pressure: 1}, {group: Top, pressure: 2}]",
        "loads[1].group = 'Top': the group is listed twice with pressure",
    ),
    # steps, observations, references, tolerances, counts
    ("steps: []", "steps = []: must be a list of load factors, none negative, or of mappings"),
    ("steps: [-1, 1]", "steps[0] = -1: must be a factor from 0 to 1e30, or a mapping"),
    ("steps: 1", "steps = 1: must be a list of load factors, none negative, or of mappings"),
    ("steps: [1, {press: 1}]", "steps[1] = {'press': 1.0}: steps are factors, or mappings"),
    ("steps: [{press: 1}]", "steps[0].press: no load, support or rigid body has this name"),
    (
        "loads: [{group: Top, pressure: 1, name: press}]\nsteps: [{pres: 1, press: 2}]",
        "steps[0].pres: no load, support or rigid body has this name",
    ),
    (
        "loads: [{group: Top, pressure: 1, name: press}]",
        "steps[0] = 1.0: gives no factor of press",
    ),
    (
        CONTACT + "observe: [{zone: b, nearest: [0, 0]}]",
        "observe[0].zone = 'b': no such zone; allowed: a",
    ),
    (
        CONTACT + "observe: [{zone: a, nearest: [0]}]",
        "observe[0].nearest = [0]: must be a list of two (plane) or three numbers",
    ),
    ("reference: {gap: 0}", "reference.kind: this key is needed"),
    ("reference: {kind: guess}", "reference.kind = 'guess': must be analytical, manufactured"),
    ("reference: {kind: refined, gap: 0}", "reference.uncertainty: this key is needed"),
    (
        "reference: {kind: refined, uncertainty: 0}",
        "reference.uncertainty = 0: must be a positive number: the possible relative error",
    ),
    ("reference: {kind: other_code, gap: 0}", "reference.code: this key is needed"),
    (
        "reference: {kind: other_code, code: {name: solver}}",
        "reference.code.version: this key is needed",
    ),
    (
        "reference: {kind: other_code, code: {name: solver, version: 14.6}}",
        "reference.code.version = 14.6: must be text (in quotes if it is a number)",
    ),
    (
        "reference: {kind: analytical, code: {name: solver, version: '14'}}",
        "must be left out: only the kind other_code has one",
    ),
    (
        "reference: {kind: analytical, pressure: 1}",
        "reference.pressure = 1: unknown key; did you mean pressure_at?",
    ),
    ("tolerance: 0", "tolerance = 0: must be a positive number below 1, or a mapping of"),
    ("tolerance: {multiplier: -1}", "tolerance.multiplier = -1: must be a positive number"),
    (
        "tolerance: {multipliers: 1}",
        "tolerance.multipliers = 1: unknown key; did you mean multiplier?",
    ),
    ("tolerance: 1.0e+300", "tolerance.all = 1e+300: must be below 1"),
    ("tolerance: {balance: 1}", "tolerance.balance = 1.0: must be below 1"),
    ("expected: {multiplier: 0.7}", "expected.multiplier = 0.7: 1.5 times it must be below 1"),
    # a reference that nothing would be compared with
    ("reference: {kind: analytical}", "reference.kind = 'analytical': gives no value to compare"),
    (
        "reference: {kind: analytical, contact_pressure: 25}",
        "reference.contact_pressure: cannot be compared: the case has no contact",
    ),
    (
        SOLUTION_ALONE,
        "reference.solution = 'hydrostatic': nothing is compared with it; give a value",
    ),
    ("counts: {top: {cells: 1.5}}", "counts.top.cells = 1.5: must be a whole number"),
    # what the reader of the text refuses
    ("name: again", "the key name is given twice"),
]


@pytest.mark.parametrize(("lines", "message"), REFUSED, ids=[line for line, _ in REFUSED])
def test_refusals(lines, message):
    with pytest.raises(InputError, match="^family/c.yaml: .*" + re.escape(message)) as refusal:
        parse_case(MINIMAL + lines, PATH)
    assert "\n" not in str(refusal.value)


CHANGED = [
    ("name: block", "name: ../block", "name = '../block': must be a name of letters"),
    ("name: block", 'name: "block\\n"', "name = 'block\\n': must be a name of letters"),
    ("name: block", "name: 3", "name = 3: must be a name of letters"),
    ("name: block", "name: a-swapped", "name = 'a-swapped': must not end in -swapped"),
    ("young: 1.0", "young: 0.0", "materials.all.young = 0.0: must be a positive number"),
    ("young: 1.0", "young: -1", "materials.all.young = -1: must be a positive number"),
    ("young: 1.0", "young: 1e-31", "materials.all.young = 1e-31: must be a positive number from"),
    ("mesh: {", "mesh: {top: {cells: TRIA3, far: null}, ", "mesh.top.far: must have a value"),
    ("young: 1.0", "young: stiff", "materials.all.young = 'stiff': must be a positive number"),
    ("young: 1.0, ", "", "materials.all.young: this key is needed"),
    ("young: 1.0, ", "young: 1.0, rho: 1, ", "materials.all.rho = 1: unknown key; allowed: "),
    ("poisson: 0.0", "poisson: 0.5", "materials.all.poisson = 0.5: must be a number greater"),
    ("poisson: 0.0", "poisson: -1", "poisson = -1: must be a number greater than -1 and less"),
    ("poisson: 0.0", "poisson: .nan", "materials.all.poisson = '.nan': must be a number"),
    ("{all: {young: 1.0, poisson: 0.0}}", "{}", "materials = {}: must be a mapping of cell"),
    ("[{group: base, fix: [x, y, z]}]", "[]", "supports = []: must be a list of {group, fix}"),
    ("[x, y, z]", "[]", "supports[0].fix = []: must be a list of x, y, z, normal, or a mapping"),
    ("[x, y, z]", "{}", "supports[0].fix = {}: must be a list of x, y, z, normal, or a mapping"),
    ("[x, y, z]", "[x, x]", "supports[0].fix = ['x', 'x']: must be a list of x, y, z, normal"),
    ("[x, y, z]", "[w]", "supports[0].fix[0] = 'w': must be x, y, z or normal"),
    ("[x, y, z]", "{w: 1}", "supports[0].fix.w = 1: unknown key; allowed: normal, x, y, z"),
    ("[x, y, z]", "{x: 1/}", "supports[0].fix.x = '1/': must be a number or an expression"),
    ("z]}]", "z]}, {group: base, fix: [z]}]", "supports[1].group = 'base': the group is listed"),
    ("recipe: blocks, size: 1.0", "size: 1.0", "mesh = {'size': 1.0}: must be {file: MESH, ref"),
    ("recipe: blocks, ", "recipe: blocks, file: a.med, ", "must be {file: MESH, refine: 2}, or {"),
    ("recipe: blocks, ", "file: a.med, ", "must be {file: MESH, refine: 2}, or {recipe: NAME, …}"),
    ("{recipe: blocks, size: 1.0}", "a.med", "mesh = 'a.med': must be {file: MESH, refine: 2}, or"),
]


OF_PLANES = [
    ("fix: [normal]", "fix: [z]", "supports[2].fix = 'z': z in a plane case; allowed are x, y an"),
    ("1e-3*x", "1e-3*z", "supports[1].fix.x = '1e-3*z': z in a plane case; allowed are x, y and r"),
    ("[0.0, 2*y]", "[0.0, 0.0, 2*y]", "loads[1].traction = [0.0, 0.0, '2*y']: must have 2 comp"),
    ("[25, 0]", "[25, 0, 0]", "observe[0].nearest = [25.0, 0.0, 0.0]: must have 2 components"),
    ("-7.5*x/x", "z", "reference.stress.zz = 'z': z in a plane case; allowed are x, y and r"),
    ("-0.1*y]", "-0.1*y, 0]", "reference.displacement = [0.0, '-0.1*y', 0.0]: must have 2 comp"),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [*((MINIMAL, *change) for change in CHANGED), *((FULL, *change) for change in OF_PLANES)],
    ids=[change[1] for change in CHANGED + OF_PLANES],
)
def test_refusals_of_what_is_needed_and_of_z_in_a_plane_case(text, old, new, message):
    assert text.count(old) == 1
    with pytest.raises(InputError, match="^family/c.yaml: .*" + re.escape(message)):
        parse_case(text.replace(old, new), PATH)
