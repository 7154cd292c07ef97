"""The mesh of a row, and the groups of its faces."""

from typing import Any

import meshio
import numpy as np

from solver.mesh import generate
from solver.mesh.tidy import tidy

from .cells import bare, halved
from .options import KINKS
from .state import AXES, Body, States


class Places(States):
    """Where the faces of the bodies are."""

    def recipe(self) -> dict[str, Any]:
        """Of the mesh, its interface flat."""
        start = self.start
        given = [(b.name, b.cells, b.low, b.divisions) for b in self.bodies]
        if self.row["master"] == "faces":
            given.append(("upper", self.row["master cells"], 0.0, self.sizes[1]))
        bricks = []
        for name, cells, level, divisions in given:
            low = [start, *[0.0] * (self.dim - 2), level]
            high = [start + 1, *[1.0] * (self.dim - 2), level + 1]
            block = {"cells": cells, "divisions": [divisions] * self.dim}
            if cells.startswith(("PENTA", "PYRA")):
                block["contact"] = "TRIA3" if cells in ("PENTA6", "PYRA5") else "TRIA6"
            bricks.append({"name": name, "low": low, "high": high, "block": block})
        return {"recipe": "bricks", "bricks": bricks}

    def mesh(self) -> meshio.Mesh:
        """The mesh, shaped and moved."""
        mesh, start = generate(self.recipe(), "pairs"), self.start
        if self.row["slave faces"] == "two types":
            mesh = halved(mesh, "lower", start + 0.5)
        if self.row["master"] == "faces":
            mesh = bare(mesh, "upper", "wall")
        points = mesh.points[:, : self.dim]
        x, z = points[:, 0] - start, points[:, -1]
        y = points[:, 1] if self.dim == 3 else 0 * x
        shape = {
            "flat": 0 * x,
            "tilted": 0.2 * x,
            **{name: slope * np.abs(x - 0.5) for name, slope in KINKS.items()},
            "curved": 0.1 * (4 * x * (1 - x) + y * (1 - y)),
        }[self.row["interface"]]
        points[:, -1] += shape * np.clip(1 - np.abs(z), 0, None)
        if self.apart.any():
            above = np.zeros(len(points), dtype=bool)
            for block, cells in zip(mesh.cells, mesh.cell_sets["lower"], strict=True):
                above[block.data[cells]] = True
            points[~above] += self.apart
        mesh.points[:, : self.dim] = (
            self.placed.scale * points @ self.placed.turn.T + self.placed.origin
        )
        return tidy(mesh, "pairs") if self.row["form"] == "mirrored" else mesh

    def groups(self) -> dict[str, Any]:
        """The sides, ends and contact surfaces of all bodies."""
        start = self.start
        groups: dict[str, Any] = {}

        def plane(name: str, body: Body, axis: int, at: float) -> None:
            point = np.zeros(self.dim)
            point[axis] = at
            if body.name != "lower":
                point = point + self.apart
            normal = self.placed.vector(np.eye(self.dim)[axis])
            groups[name] = {
                "within": body.name,
                "plane": {"point": self.placed.point(point), "normal": normal},
            }

        for body in self.bodies:
            for axis in range(self.dim - 1):
                first = start if axis == 0 else 0.0
                plane(f"{body.name}-{AXES[axis]}0", body, axis, first)
                plane(f"{body.name}-{AXES[axis]}1", body, axis, first + 1)
            up = self.dim - 1
            inner = "top" if body.name == "lower" else "under"
            if body.name == "cap":
                plane("cap-under", body, up, 1.0)
                plane("cap-top", body, up, 2.0)
                continue
            # its height above the interface, which is 0.2 x where that is tilted
            normal = self.normal / self.normal[-1]
            at = -normal @ (self.apart if body.name == "upper" else 0 * self.apart)
            at -= normal[0] * start
            height = self.placed.affine(normal, np.eye(self.dim), at * self._up())
            reach = self.placed.scale * (0.13 if self.row["interface"] == "curved" else 1e-6)
            if self.row["interface"] in KINKS:
                along = np.eye(self.dim)[0]
                from_edge = self.placed.affine(along, np.eye(self.dim), -(start + 0.5) * along)
                height += f" - {KINKS[self.row['interface']]}*abs({from_edge})"
            there = f"{reach!r} - abs({height})"
            if body.name == "lower" and self.row["slave faces"] == "two groups":
                groups |= self._parts(there)
            else:
                groups[f"{body.name}-{inner}"] = {"within": body.name, "where": there}
            plane(
                f"{body.name}-{'base' if body.name == 'lower' else 'top'}",
                body,
                up,
                -1.0 if body.name == "lower" else 1.0,
            )
        if self.row["also"] == "body force":
            groups["lower-again"] = ["lower"]
        return groups

    def _parts(self, there: str) -> dict[str, Any]:
        """The slave's surface as a list of two groups, which part between two faces."""
        part = self.start + (2 / 3 if self.sizes[0] == 3 else 0.5)
        along = np.eye(self.dim)[0]
        beyond = self.placed.affine(along, np.eye(self.dim), -part * along)
        near = f"{1e-6 * self.placed.scale!r}"
        sides = {"lower-top-1": f"{near} - ({beyond})", "lower-top-2": f"{near} + {beyond}"}
        parts: dict[str, Any] = {
            name: {"within": "lower", "where": f"min({there}, {side})"}
            for name, side in sides.items()
        }
        return parts | {"lower-top": list(parts)}
