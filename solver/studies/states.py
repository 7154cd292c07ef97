"""The exact answer of a sweep's point, in extended precision: a uniform state in each body.

    compression  σ = −p n⊗n, both blocks free to widen; n points from the lower block to the upper
    hydrostatic  σ = −p I in 2D or 3D, in both bodies of one material

The blocks are those of the recipes: they stand on a corner of the lower block, over which a corner
of the upper one comes down by what gap there is. `transform:` moves these corners with the mesh.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import meshio
import numpy as np

from ..case.material import Material
from ..case.model import Case
from ..mesh import transform

LOWER, UPPER = "bottom", "top"
# Steps of `transform:` that leave the corners of the blocks where they are.
_INSIDE = ("perturb", "renumber", "turn", "pick")


@dataclass(frozen=True)
class State:
    """Strain of the lower and the upper body (2, dim, dim), and where each has no displacement.

    `corner` (2, dim); `lowered` (dim,): by how much the upper body moves. `stress` (2, 6);
    `volumetric` (2,): its part λ div u.
    """

    pressure: float
    normal: np.ndarray
    strain: np.ndarray
    corner: np.ndarray
    lowered: np.ndarray
    stress: np.ndarray
    volumetric: np.ndarray

    def displacement(self, points: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """Displacement (n, dim) at points (n, dim); `upper` (n,): whether in the upper body."""
        body = upper.astype(int)
        moved = np.einsum("nij,nj->ni", self.strain[body], points - self.corner[body])
        return moved + body[:, None] * self.lowered

    def stress_at(self, upper: np.ndarray) -> np.ndarray:
        """Stress (n, 6) in the upper body where `upper` (n,), else in the lower one."""
        return self.stress[upper.astype(int)].astype(float)


def exact_state(case: Case, kind: str, mesh: meshio.Mesh) -> State:
    """The state of a case on the untransformed mesh (of a recipe) of its blocks."""
    corner, foot, head = _corners(case, mesh)
    up = head[0] - foot
    normal = up / np.sqrt((up * up).sum())
    dim = len(normal)
    values = [load.value for load in case.loads if load.kind == "pressure"]
    pressure = next(value for value in values if isinstance(value, float))
    materials = [case.materials.get(b) or case.materials["all"] for b in (LOWER, UPPER)]
    identity, along = np.eye(dim, dtype=np.longdouble), np.outer(normal, normal)
    strain = []
    for material in materials:
        lateral, axial = _strains(material, np.longdouble(pressure), dim, kind == "hydrostatic")
        strain.append(lateral * (identity - along) + axial * along)
    tensor = -pressure * (identity if kind == "hydrostatic" else along)
    stress = np.array([_six(tensor, material) for material in materials])
    opened = np.trace(np.array(strain), axis1=1, axis2=2)
    volumetric = np.array([_lame(material) for material in materials]) * opened
    gap = normal @ (head[1] - head[0])
    lowered = normal * (normal @ (strain[0] @ up) - gap)
    return State(pressure, normal, np.array(strain), corner, lowered, stress, volumetric)


def _corners(
    case: Case, mesh: meshio.Mesh
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Corners (2, dim) of both bodies, the lower one's foot, and the two that meet above it."""
    foot = mesh.points.min(axis=0)
    head = foot.copy()
    head[-1] = 0.0
    corners = meshio.Mesh(
        np.array([foot, head, head], dtype=np.longdouble),
        [("vertex", np.arange(3)[:, None])],
        cell_sets={LOWER: [np.array([0, 1])], UPPER: [np.array([2])]},
    )
    spec: Mapping[str, Any] = case.transform or {}
    outer = {key: value for key, value in spec.items() if key not in _INSIDE}
    foot, below, above = transform(corners, outer, str(case.path)).points
    return np.array([foot, above]), foot, (below, above)


def _strains(
    material: Material, pressure: np.longdouble, dim: int, hydrostatic: bool
) -> tuple[np.longdouble, np.longdouble]:
    """Lateral and axial strain; in two dimensions in plane strain."""
    young, poisson = np.longdouble(material.young), np.longdouble(material.poisson)
    if hydrostatic:
        strain = -pressure * (1 - 2 * poisson) / young * (1 + poisson if dim == 2 else 1)
        return strain, strain
    if dim == 2:
        young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
    return poisson * pressure / young, -pressure / young


def _lame(material: Material) -> np.longdouble:
    young, poisson = np.longdouble(material.young), np.longdouble(material.poisson)
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson))


def _six(tensor: np.ndarray, material: Material) -> np.ndarray:
    """A stress tensor (dim, dim) as six components; plane strain has one across the plane."""
    if len(tensor) == 3:
        return tensor[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    xx, yy, xy = tensor[0, 0], tensor[1, 1], tensor[0, 1]
    zz = material.poisson * (xx + yy)
    return np.array([xx, yy, zz, xy, 0, 0], dtype=np.longdouble)
