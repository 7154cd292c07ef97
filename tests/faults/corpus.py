"""Whole files to be damaged: a case, its mesh in every format, its result; what reads each."""

from dataclasses import dataclass
from pathlib import Path

import gmsh
import meshio
import numpy as np

from solver.commands.cli import main
from solver.lac.cells.catalogue import cell_type
from solver.mesh import generate, write_mesh
from solver.mesh.recipes.gmsh_session import session

MESHES = ("mesh.med", "mesh.msh", "binary.msh", "mesh.inp", "mesh.vtu", "mesh.vtkhdf")
CASE = """\
name: block
title: Two blocks
mesh: {file: %s}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: base, fix: [y]}
  - {group: symx, fix: {x: 0.0}}
loads: [{group: press, pressure: 25.0 + 0*sqrt(x**2)}]
contact: [{name: interface, slave: bottom_contact, master: top_contact}]
steps: [0.5, 1.0]
observe: [{zone: interface, nearest: [0.5, 0.0]}]
reference:
  kind: analytical
  contact_pressure: 25.0
  normal_stress: -25.0
  gap: 0.0
  displacement: [0.004875*x, -0.011375*(y + 1)]
"""
RECIPE = {
    "recipe": "blocks",
    "size": 1.0,
    "bottom": {"cells": "QUAD4", "divisions": [3, 3]},
    "top": {"cells": "QUAD4", "divisions": [2, 2]},
}


@dataclass(frozen=True)
class Sample:
    """A file to be damaged and the command that reads it; `{}` stands for the damaged file."""

    path: Path
    command: tuple[str, ...]


def write_corpus(folder: Path) -> list[Sample]:
    """Write the files; every one of them passes as it is written."""
    mesh = generate(RECIPE, "corpus")
    write_mesh(mesh, folder / "mesh.vtkhdf")
    meshio.write(folder / "mesh.vtu", _with_masks(mesh))
    _write_by_gmsh(mesh, folder)
    case, result = folder / "case.yaml", folder / "result.vtkhdf"
    case.write_text(CASE % "mesh.vtkhdf", encoding="utf-8")
    into = ("-o", str(folder / "out.vtkhdf"))
    samples = [
        Sample(folder / name, ("solve", str(case), "--mesh", "{}", *into)) for name in MESHES
    ]
    assert main(["solve", str(case), "-o", str(result), "--quiet"]) == 0
    return [
        *samples,
        Sample(case, ("solve", "{}", "--mesh", str(folder / "mesh.vtkhdf"), *into)),
        Sample(result, ("check", "{}", "--json")),
    ]


def _with_masks(mesh: meshio.Mesh) -> meshio.Mesh:
    masks = {
        name: [
            np.isin(np.arange(len(block.data)), ids).astype(int)
            for block, ids in zip(mesh.cells, sets, strict=True)
        ]
        for name, sets in mesh.cell_sets.items()
    }
    points = np.c_[mesh.points, np.zeros(len(mesh.points))]
    return meshio.Mesh(points, mesh.cells, cell_data=masks)


def _write_by_gmsh(mesh: meshio.Mesh, folder: Path) -> None:
    """Each group an entity of its own, as a program that meshes geometry would write it."""
    with session(Mesh__SaveGroupsOfElements=1):
        points = np.c_[mesh.points, np.zeros(len(mesh.points))]
        first = gmsh.model.add_discrete_entity(2)
        tags = np.arange(1, len(points) + 1)
        gmsh.model.mesh.add_nodes(2, first, tags, points.ravel())
        for name, sets in mesh.cell_sets.items():
            for block, ids in zip(mesh.cells, sets, strict=True):
                if len(ids):
                    kind = cell_type(block.type)
                    entity = gmsh.model.add_discrete_entity(kind.dim)
                    nodes = block.data[ids].ravel() + 1
                    gmsh.model.mesh.add_elements_by_type(entity, kind.gmsh, [], nodes)
                    gmsh.model.add_physical_group(kind.dim, [entity], name=name)
        for name in ("mesh.med", "mesh.msh", "mesh.inp"):
            gmsh.write(str(folder / name))
        gmsh.option.set_number("Mesh.Binary", 1)
        gmsh.write(str(folder / "binary.msh"))
