"""A ball pressed into a cup, from CAD to the contact pressure.

    .venv/bin/python docs/examples/two_curved_bodies.py [folder]

draws a quarter of each body with gmsh's OpenCASCADE kernel, meshes it with second-order tetrahedra,
solves the contact and writes `ball.msh`, `ball.vtkhdf`, `pressure.svg` and `picture.svg` into the
folder. Lengths in mm, stresses in MPa, forces in N.
"""

import sys
from math import pi
from pathlib import Path

import gmsh

from solver import solve_case

BALL, CUP = 10.0, 20.0  # radii
TOP, BOTTOM = 6.0, -8.0  # where the ball is cut off, and the foot of the cup
FORCE = 3800.0  # of the whole ball

# The geometry


def write_mesh(path: Path, fine: float) -> None:
    """Mesh a quarter of the ball and of the cup, faces of edge `fine` where they touch."""
    gmsh.initialize(readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    ball = occ.addSphere(0, 0, BALL, BALL, angle3=pi / 2)
    above = occ.addBox(0, 0, TOP, BALL, BALL, 2 * BALL)
    [(_, ball)], _ = occ.cut([(3, ball)], [(3, above)])
    block = occ.addCylinder(0, 0, BOTTOM, 0, 0, 3 - BOTTOM, 9, angle=pi / 2)
    hollow = occ.addSphere(0, 0, CUP, CUP)
    [(_, cup)], _ = occ.cut([(3, block)], [(3, hollow)])
    occ.synchronize()
    name_groups({"ball": ball, "cup": cup})

    field = gmsh.model.mesh.field
    ring = field.add("Ball")
    sizes = {"Radius": 1.3, "Thickness": 6, "VIn": fine, "VOut": 3.0}
    for option, value in sizes.items():
        field.setNumber(ring, option, value)
    field.setAsBackgroundMesh(ring)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    gmsh.write(str(path))
    gmsh.finalize()


def name_groups(bodies: dict[str, int]) -> None:
    """Give the bodies and their faces names, by which the case knows them."""
    faces: dict[str, list[int]] = {}
    for name, body in bodies.items():
        gmsh.model.addPhysicalGroup(3, [body], name=name)
        for _, face in gmsh.model.getBoundary([(3, body)], oriented=False):
            x, y, z = gmsh.model.occ.getCenterOfMass(2, face)
            if gmsh.model.getType(2, face) == "Sphere":
                faces[f"{name}_face"] = [face]
            elif abs(x) < 1e-6:
                faces.setdefault("symmetry_x", []).append(face)
            elif abs(y) < 1e-6:
                faces.setdefault("symmetry_y", []).append(face)
            elif abs(z - TOP) < 1e-6:
                faces["top"] = [face]
            elif abs(z - BOTTOM) < 1e-6:
                faces["base"] = [face]
    for name, members in faces.items():
        gmsh.model.addPhysicalGroup(2, members, name=name)


# The case

DISC = pi * (BALL**2 - (BALL - TOP) ** 2)  # the area that is pressed

CASE = {
    "name": "ball-in-cup",
    "units": {"length": "mm", "stress": "MPa"},
    "materials": {
        "ball": {"young": 210000.0, "poisson": 0.3},
        "cup": {"young": 70000.0, "poisson": 0.3},
    },
    "supports": [
        {"group": "symmetry_x", "fix": ["x"]},
        {"group": "symmetry_y", "fix": ["y"]},
        {"group": "base", "fix": ["z"]},
    ],
    "loads": [{"group": "top", "pressure": FORCE / DISC}],
    "contact": [{"name": "seat", "slave": "cup_face", "master": "ball_face", "normal": "nodal"}],
    # Hertz: for ball and cup 1/R = 1/10 - 1/20.
    "reference": {
        "kind": "analytical",
        "solution": {
            "name": "hertz_sphere",
            "radius": 1 / (1 / BALL - 1 / CUP),
            "lower": "cup",
            "upper": "ball",
            "force": FORCE,
        },
    },
    # What finite bodies differ from half-spaces, and what a mesh of this size misses.
    "tolerance": {"peak": 0.05, "half_width": 0.05},
}


def main(folder: Path, fine: float = 0.15) -> None:
    """Mesh, solve, look at the numbers, write the figures."""
    folder.mkdir(parents=True, exist_ok=True)
    write_mesh(folder / "ball.msh", fine)
    solved = solve_case(CASE, folder / "ball.msh", log=print)
    print(solved)

    seat = solved.zones["seat"]
    hertz = solved.solution.case.reference.exact
    force = 4 * seat.multiplier @ (seat.area * seat.coverage * seat.normal[:, 2])
    print(f"force {force:.1f} N of {FORCE:.1f} N")
    print(f"{seat.closed.sum()} of {len(seat.closed)} macro-elements in contact")
    print(f"largest pressure {solved.pressure.max():.1f} MPa, Hertz {hertz.peak:.1f} MPa")

    solved.save(folder / "ball.vtkhdf")
    (folder / "pressure.svg").write_text(solved.profile(along="r"), encoding="utf-8")
    (folder / "picture.svg").write_text(solved.picture(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
