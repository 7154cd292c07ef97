"""Uniform refinement of every cell type, curved too: volumes, groups, and the patch test."""

from pathlib import Path

import meshio
import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.lac.cells.catalogue import BY_NAME, cell_type
from solver.lac.cells.shape import gauss_rule, shape_functions
from solver.mechanics.fem.refine import refined
from solver.mesh import write_mesh
from solver.mesh.tidy import tidy
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.run import mesh_of
from solver.verification.run import refined as finer
from tests.mesh.curved import KINDS, Curved
from tests.scenes import block_case, block_mesh, errors, moved, with_points


def volume(mesh):
    """∫ dV over all volume cells, by points enough for the products of quadratic maps."""
    total = 0.0
    for block in mesh.cells:
        kind = cell_type(block.type)
        if kind.dim == mesh.points.shape[1]:
            reference, weights = gauss_rule(kind.name, 6)
            slopes = shape_functions(kind.name).gradients(reference)
            jacobian = np.einsum("cad,qat->cqdt", mesh.points[block.data], slopes)
            total += (np.linalg.det(jacobian) * weights).sum()
    return total


def one_cell(name):
    """A curved cell with all of its faces in a group, two of its nodes in another."""
    kind, curved = BY_NAME[name], Curved.of(name)
    faces: dict[str, list] = {}
    for face in kind.faces:
        faces.setdefault(BY_NAME[face.type].meshio, []).append(face.nodes)
    cells = [(kind.meshio, np.arange(kind.n_nodes)[None])]
    cells += [(name, np.array(nodes)) for name, nodes in faces.items()]
    none = np.empty(0, int)
    return meshio.Mesh(
        curved.places(kind.nodes)[:, : kind.dim],
        cells,
        cell_sets={
            "rim": [none, *(np.arange(len(nodes)) for _, nodes in cells[1:])],
            "whole": [np.arange(1), *([none] * len(faces))],
        },
        point_sets={"edge": np.array(kind.edges[0])},
    )


@pytest.mark.parametrize("name", KINDS)
def test_the_children_fill_the_curved_parent(name):
    """Their volumes sum to it, their faces are the outer ones, and nothing overlaps or is left."""
    mesh = one_cell(name)
    found = tidy(refined(mesh), "test")
    kind = BY_NAME[name]
    own = volume(mesh)
    assert volume(found) == pytest.approx(own, rel=1e-12)
    children = sum(len(b.data) for b in found.cells if cell_type(b.type).dim == kind.dim)
    assert children == (10 if "PYRA" in name else 2**kind.dim)
    faces = sum(len(part) for part in found.cell_sets["rim"])
    assert faces == 2 ** (kind.dim - 1) * len(kind.faces)
    assert sum(map(len, found.cell_sets["whole"])) == children
    ends = found.points[found.point_sets["edge"]]
    assert len(ends) == (3 if kind.order == 1 else 5)


def test_neighbours_share_their_new_nodes_and_an_interface_keeps_two_surfaces():
    """Prisms and pyramids meet at triangles: nodes are counted as those of half the spacing."""
    mesh = block_mesh("HEXA8", "TETRA10", (2, 1))
    found = tidy(refined(mesh), "test")
    hexahedra = found.cells[[b.type for b in found.cells].index("hexahedron")]
    assert len(np.unique(hexahedra.data)) == 5**3
    apart = [np.unique(b.data) for b in found.cells if cell_type(b.type).dim == 3]
    assert not np.intersect1d(*apart).size


@pytest.mark.parametrize(
    "pair", [("QUAD8", "TRIA3"), ("HEXA20", "PENTA6"), ("PYRA5", "TETRA4"), ("PYRA13", "HEXA27")]
)
def test_the_patch_test_on_a_refined_mesh(pair):
    mesh = block_mesh(*pair, (2, 1))
    if mesh.points.shape[1] == 2:
        mesh = moved(mesh, 0.05)
    solution = simulate(block_case(mesh.points.shape[1]), tidy(refined(mesh), "test"))
    assert max(errors(solution).values()) < 1e-11


def test_a_mesh_file_is_refined_by_its_case(tmp_path):
    """A quarter ring of QUAD8 stays as round as its first edges were; 4 refines twice."""
    flat = block_mesh("QUAD8", "QUAD8", (2, 1))
    angle = np.pi / 4 * flat.points[:, 0]
    radius = 2 + flat.points[:, 1]
    ring = with_points(
        flat, np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)[:, ::-1]
    )
    write_mesh(tidy(ring, "ring"), tmp_path / "ring.vtkhdf")
    text = block_case(2).about.source.replace(
        "{recipe: blocks, size: 1.0}", f"{{file: {tmp_path}/ring.vtkhdf, refine: 4}}"
    )
    case = parse_case(text, Path("ring.yaml"))
    found = mesh_of(case)
    assert volume(found) == pytest.approx(volume(tidy(ring, "ring")), rel=1e-12)
    assert sum(len(b.data) for b in found.cells if b.type == "quad8") == 16 * 5
    assert len(mesh_of(finer(case, 2)).points) > 3 * len(found.points)
    with pytest.raises(InputError, match="--refine = 3: of a mesh file must be 1, 2, 4, 8"):
        finer(case, 3)
    with pytest.raises(InputError, match=r"mesh\.refine = 3: must be 1, 2, 4, 8"):
        parse_case(text.replace("refine: 4", "refine: 3"), Path("ring.yaml"))
