"""The commands that write and check case files, and the commented case file that `new` writes."""

import argparse
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from string import Template

from ..case.reader import parse_case
from ..lac.errors import SolveError
from ..system.errors import InputError
from ..system.files import write_text
from ..system.package import PROGRAM, workflow_folder
from . import jobs
from .cli import PASSED, REFUSED

# Where each template of the folder `family/` goes.
FILES = {
    "Snakefile.template": "Snakefile",
    "family.yaml.template": "cases/{}/family.yaml",
    "README.md.template": "README.md",
    "github.yml.template": ".github/workflows/verification.yml",
    "gitlab.yml.template": ".gitlab-ci.yml",
}
_PROFILE = "profiles/default/config.yaml"


def add_new(command: argparse.ArgumentParser) -> None:
    command.add_argument("name", nargs="?", metavar="NAME", help="default: as FILE")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: NAME.yaml")


def run_new(options: argparse.Namespace) -> int:

    name = options.name or (options.output.stem if options.output else "new-case")
    path = options.output or Path(f"{name}.yaml")
    write_template(name, path)
    print(f"{path}: written; next: {PROGRAM} solve {path} -o {path.with_suffix('.vtkhdf')}")
    return PASSED


def add_validate(command: argparse.ArgumentParser) -> None:
    command.add_argument("cases", type=Path, nargs="+", metavar="CASE.yaml")
    command.add_argument(
        "--mesh", action="store_true", help="also mesh them: groups, surfaces, supports"
    )


def run_validate(options: argparse.Namespace) -> int:
    status = PASSED
    for path in options.cases:
        refused = False
        for error in _refusals(path, options.mesh):
            print(error, file=sys.stderr)
            status, refused = REFUSED, True
        if not refused:
            print(f"{path}: valid")
    return status


def _refusals(path: Path, with_mesh: bool) -> Iterator[InputError | str]:
    """What is wrong with a case; `with_mesh`: on its mesh too, each once."""
    from ..case.reader import check_mesh_file, load_case

    try:
        case = load_case(path)
        check_mesh_file(case)
        if "recipe" in case.mesh.source:
            from ..mesh import read_recipe

            read_recipe(case.mesh.source, path)
        if with_mesh:
            from ..simulation.simulate import refusals_on
            from ..verification.run import mesh_of

            mesh, told = mesh_of(case), set()
            for swapped in (False, True)[: 1 + (case.about.directions == "both")]:
                for error in refusals_on(case.as_solved(swapped, None, None), mesh):
                    if str(error) not in told:
                        yield error
                    told.add(str(error))
    except InputError as error:
        yield error
    except SolveError as error:
        yield f"{path}: {error}"


def add_mesh(command: argparse.ArgumentParser) -> None:
    command.add_argument("case", type=Path, metavar="CASE", help="a case file, or a name")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="MESH")


def run_mesh(options: argparse.Namespace) -> int:
    from ..case.reader import load_case
    from ..mesh import write_mesh
    from ..verification.run import mesh_of

    file, _ = jobs.named(options.case)
    write_mesh(mesh_of(load_case(file), limited=True), options.output)
    return PASSED


def add_init(command: argparse.ArgumentParser) -> None:
    command.add_argument("folder", type=Path, metavar="FOLDER", help="its name is the family's")


def run_init(options: argparse.Namespace) -> int:
    folder, name = options.folder, options.folder.absolute().name
    if not re.fullmatch(jobs.PLAIN, name):
        raise InputError(folder, "name", name, "must be letters, digits, `_`, `-` and `.`")
    if folder.exists() and any(folder.iterdir()):
        raise InputError(folder, "folder", None, "is not empty; name a new one")
    templates = Path(__file__).with_name("family")
    for template, target in FILES.items():
        text = Template((templates / template).read_text(encoding="utf-8")).substitute(name=name)
        write_text(folder / target.format(name), text)
    write_template("block", folder / "cases" / name / "block.yaml")
    write_text(folder / ".gitignore", "results/\n.snakemake/\n")
    (folder / _PROFILE).parent.mkdir(parents=True)
    shutil.copy(workflow_folder() / _PROFILE, folder / _PROFILE)
    print(f"{folder}: written; next: cd {folder} && snakemake --cores all")
    return PASSED


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
    # sweeps: 24                         # at most so many solves with its loads, until it settles
    stabilised: false                    # true: contact gives way to pressures that scatter
#   clearance: 0.0                       # the initial gap, a number or an expression; replaces
                                         # the gap between the meshed faces

directions: first                        # or both: also with slave and master exchanged
steps: [0.5, 1.0]                        # load factors
# substeps: 10                           # each step in so many equal parts
motion: small                            # or large: bodies slide, turn and roll far, with small
                                         # strains, along the path of the steps
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
