"""The case file that `new` writes: one that runs as it is, with a comment on every key."""

from pathlib import Path

from ..system.errors import InputError
from ..system.files import write_text
from ..system.package import PROGRAM
from .reader import parse_case

TEMPLATE = """\
# A case file: change it to your problem, then
#   {program} validate --mesh FILE    checks that it is valid
#   {program} solve FILE -o RESULT.vtkhdf    solves and checks it
# Paths are relative to this file. Use consistent units of length, force and stress.

name: {name}
title: Two blocks pressed together

# The units of your numbers: labels only.
units: {{length: mm, stress: MPa}}

# A mesh made by recipe ...
mesh:
  recipe: blocks
  size: 50.0
  bottom: {{cells: HEXA8, divisions: 3}}
  top: {{cells: HEXA8, divisions: 2}}
# ... or your own mesh (.med .msh .inp .vtu) with its named groups:
# mesh: {{file: my-mesh.med}}

# plane: strain                          # only for 2D meshes

# By group of volume cells, or `all`. `form` of the unknowns: displacement, or mixed (displacement
# and pressure) for nearly incompressible material; automatic: mixed above 0.499.
materials:
  all: {{young: 2000.0, poisson: 0.3, form: automatic}}

# Directions x, y, z, or `normal` (a plane of symmetry of any direction); a mapping imposes values.
supports:
  - {{group: symx, fix: [x]}}
  - {{group: symy, fix: [normal]}}
  - {{group: base, fix: {{z: 0.0}}}}

# pressure (positive inwards) or traction: [x, y, z] on faces; body_force: [x, y, z] on cells;
# strain: {{xx: …}}, or expansion and temperature, on cells.
# A value may be an expression in x, y, z, r, pi, sqrt, sin, cos, such as "25 * (1 - x / 50)".
loads:
  - {{group: press, pressure: 25.0}}

# Contact zones. The softer body's surface is the better slave; of bodies alike, the finer one, if
# not much finer.
contact:
  - name: interface
    slave: bottom_contact
    master: top_contact
    hexahedra: pyramids                  # how slave hexahedra are cut: pyramids or hexahedra
    treatment: lac                       # or uncut, nodal, nodal_dual, node_to_segment, quadrature
    # points: 4                          # per direction on a slave face, only for quadrature
    normal: element                      # gaps are measured along: element (normals of faces),
                                         # nodal (their means at the nodes), or master: normals
                                         # of a plane or smooth master
    interference: 0.0                    # initial overlap of bodies that are modelled without it
    recovery: none                       # of a pressure of higher order from constants: none,
                                         # linear, quadratic, smooth, or automatic by the cells
    # sweeps: 24                         # solves with its loads: more bring it nearer to its limit
    stabilised: false                    # true: contact gives way to pressures that scatter
#   clearance: 0.0                       # the initial gap, a number or an expression; replaces
                                         # the gap between the meshed faces

directions: first                        # or both: also with slave and master exchanged
steps: [0.5, 1.0]                        # load factors
observe:                                 # the contact element nearest to a point, at every step
  - {{zone: interface, nearest: [25.0, 25.0, 0.0]}}

# The expected results; omit what you do not know. `solution` names a documented solution with its
# parameters. Then `solution` stands for any value here, in loads (traction: solution) and in
# supports (fix: {{x: solution}}), and errors are measured in norms.
reference:
  kind: analytical                       # analytical, manufactured, refined (with its relative
                                         # uncertainty: 2.0e-3) or other_code (with code: {{name:
                                         # …, version: "…"}})
  solution: {{name: uniform_compression, base: -50.0}}
  contact_pressure: 25.0                 # >= 0 in compression
  normal_stress: -25.0                   # > 0 in tension
  gap: 0.0                               # >= 0 open
  displacement: solution                 # or expressions: [0.00375 * x, …]

tolerance: 1.0e-3                        # or by check: {{multiplier: 1.0e-6, element_gap: 1.0e-8}}
# expected: {{displacement: 2.0e-4}}     # or an expected error (see the command expect)
"""


def write_template(name: str, path: Path) -> None:
    """Write a commented case of that name; InputError for a bad name or a file already there."""
    text = TEMPLATE.format(name=name, program=PROGRAM)
    parse_case(text, path)
    if path.exists():
        raise InputError(path, "file", None, "is there already; choose another with -o")
    write_text(path, text)
