"""Two blocks, one on the other, for the tests of the solver: cases and meshes of a few cells."""

from pathlib import Path

import meshio
import numpy as np

from solver.case.model import Case
from solver.case.reader import parse_case
from solver.lac.cells.catalogue import BY_NAME, cell_type
from solver.mesh import generate
from solver.simulation.results.solution import Solution
from solver.simulation.simulate import simulate
from solver.verification.run import mesh_of

YOUNG, POISSON, PRESSURE = 2000.0, 0.3, 25.0


def block_case(dim: int, extra: str = "", zone: str = "", size: float = 1.0) -> Case:
    """The patch test: lower block held below, pressed from above, slave the lower block's top."""
    up = "xyz"[dim - 1]
    lateral = "".join(f"  - {{group: sym{a}, fix: [{a}]}}\n" for a in "xyz"[: dim - 1])
    text = (
        f"name: patch\nmesh: {{recipe: blocks, size: {size}}}\n"
        + ("plane: strain\n" if dim == 2 else "")
        + f"materials: {{all: {{young: {YOUNG}, poisson: {POISSON}}}}}\n"
        + f"supports:\n  - {{group: base, fix: [{up}]}}\n{lateral}"
        + f"loads:\n  - {{group: press, pressure: {PRESSURE}}}\n"
        + f"contact:\n  - {{name: interface, slave: bottom_contact, master: top_contact{zone}}}\n"
        + extra
    )
    return parse_case(text, Path("patch.yaml"))


def circle_on_block(divisions: list[int], circle: str, zone: str) -> str:
    """A rigid circle on a block of 40 × 10 QUAD4, with the keys of the circle and of the zone."""
    return f"""
name: circle
mesh:
  recipe: bricks
  bricks:
    - name: block
      low: [0.0, 0.0]
      high: [40.0, 10.0]
      block: {{cells: QUAD4, divisions: {divisions}}}
plane: strain
materials: {{all: {{young: {YOUNG}, poisson: {POISSON}}}}}
groups:
  top: {{plane: {{point: [0.0, 10.0], normal: [0.0, 1.0]}}}}
  base: {{plane: {{point: [0.0, 0.0], normal: [0.0, 1.0]}}}}
bodies: {{punch: {{sphere: {circle}}}}}
supports: [{{group: base, fix: [x, y]}}]
contact: [{{name: interface, slave: top, master: punch, {zone}}}]
"""


def changed_case(dim: int, *changes: tuple[str, str], normal: bool = False, **options) -> Case:
    """`block_case` with parts of its text replaced; `normal`: its supports hold along normals."""
    text = block_case(dim, **options).about.source
    if normal:
        changes += tuple((f"fix: [{axis}]", "fix: [normal]") for axis in "xyz"[:dim])
    return parse_case(replaced(text, *changes), Path("patch.yaml"))


def replaced(text: str, *changes: tuple[str, str]) -> str:
    """A text with parts of it replaced, all of which are in it."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def solved(text: str, mesh: meshio.Mesh | None = None, **as_solved) -> Solution:
    """The case in a text on a mesh, by default its own; its forces balance."""
    case = parse_case(text, Path("case.yaml")).as_solved(**{"swapped": False} | as_solved)
    solution = simulate(case, mesh or mesh_of(case))
    assert max(solution.quality.balance.values()) < 1e-12
    return solution


def block_mesh(bottom: str, top: str, counts: tuple[int, int] = (3, 2), size: float = 1.0):
    """Two blocks of edge `size`, of so many divisions each way."""
    dim = BY_NAME[bottom].dim
    sections = {}
    for name, cells, n in (("bottom", bottom, counts[0]), ("top", top, counts[1])):
        sections[name] = {"cells": cells}
        if cells.startswith(("PENTA", "PYRA")):
            sections[name]["contact"] = "TRIA3" if BY_NAME[cells].order == 1 else "TRIA6"
        else:
            sections[name]["divisions"] = [n] * dim
    return generate({"recipe": "blocks", "size": size, **sections}, "test")


def grid(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and HEXA8 cells (count³, 8) of a unit cube."""
    ticks = np.arange(count + 1)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    first = points[(points < count).all(axis=1)] @ [(count + 1) ** 2, count + 1, 1]
    corners = BY_NAME["HEXA8"].nodes @ [(count + 1) ** 2, count + 1, 1]
    return points / count, first[:, None] + np.rint(corners).astype(int)


def moved(mesh: meshio.Mesh, amount: float, seed: int = 0) -> meshio.Mesh:
    """Every node moved at random by up to `amount`, within the planes that bound the blocks.

    Mid-edge nodes move on their own, so that edges and faces bend inside these planes.
    """
    points = mesh.points.copy()
    move = amount * np.random.default_rng(seed).uniform(-1, 1, points.shape)
    size = np.ptp(points[:, 0])
    for level in (-size, 0.0, size):
        move[np.abs(points - level) < 1e-9 * size] = 0.0
    return with_points(mesh, points + move)


def turn(dim: int, angle: float) -> np.ndarray:
    """A rotation (dim, dim); in 3D about an axis that lies in no plane of the coordinates."""
    if dim == 2:
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def straightened(mesh: meshio.Mesh) -> meshio.Mesh:
    """Mid-nodes put back on straight edges (and into the middle of faces and cells)."""
    from solver.lac.cells.shape import shape_functions

    points = mesh.points.copy()
    for block in mesh.cells:
        kind = cell_type(block.type)
        if kind.dim == points.shape[1] and kind.order == 2:
            n = kind.n_vertices
            values = shape_functions(kind.skeleton).values(kind.nodes[n:])
            points[block.data[:, n:]] = np.einsum("ka,cad->ckd", values, points[block.data[:, :n]])
    return with_points(mesh, points)


def with_points(mesh: meshio.Mesh, points: np.ndarray) -> meshio.Mesh:
    """The same cells and groups on other points."""
    return meshio.Mesh(points, mesh.cells, cell_sets=mesh.cell_sets, point_sets=mesh.point_sets)


def errors(solution, size: float = 1.0, pressure: float = PRESSURE) -> dict[str, float]:
    """Relative errors of the patch test: pressure, stress, lateral, displacement, gap, …"""
    zone = solution.zones[0]
    dim = solution.mesh.points.shape[1]
    x = solution.mesh.points
    lateral = [POISSON * (1 + POISSON)] if dim == 2 else [POISSON, POISSON]
    axial_strain = -(1 - POISSON**2) if dim == 2 else -1.0
    strain = np.array([*lateral, axial_strain]) * pressure / YOUNG
    # The foot of the lower block, at −size, does not move.
    exact = (x + np.eye(dim)[-1] * size) * strain
    rest = solution.stress.copy()
    rest[:, dim - 1] += pressure
    if dim == 2:
        rest[:, 2] += POISSON * pressure
    return {
        "pressure": np.abs(zone.multiplier / pressure - 1).max(),
        "stress": np.abs(rest).max() / pressure,
        "displacement": np.abs(solution.displacement - exact).max() / np.abs(exact).max(),
        "gap": np.abs(zone.gap).max() / size,
        "coverage": np.abs(zone.coverage - 1).max(),
        "balance": max(solution.quality.balance.values()),
    }
