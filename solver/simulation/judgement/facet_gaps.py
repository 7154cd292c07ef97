"""What the facets of curved surfaces do to a pressure: gaps and overlaps that are none.

Linear faces lie inside a convex surface and outside a concave one, up to the sagitta. Where the
gap of bodies is taken from the mesh, it is wrong by what the facets of both sides miss, and contact
presses it out. How much a face misses is seen at its vertices: with κ the curvature, the mean
normal there leans by κ (x − c) against the face's own, and the surface is κ/2 (R² − |x − c|²) above
the face at x, c its middle and R the distance of the vertices. The pressure that this brings up is
found with the factor of the solve, the status kept. Quadratic faces follow their surface: their
vertices have one normal.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ...lac.cells.faces import FLAT, FaceBlock, area_vectors, surface_normals
from ...lac.cells.shape import shape_functions
from ..equilibrium.problem import ContactProblem
from ..equilibrium.rest import LITTLE
from ..equilibrium.state import Equilibrium
from ..results.balance import energy_at_nodes
from ..scene.scene import Scene, ZoneScene

# A vertex whose mean normal leans by more against a face's own is on an edge of the body.
_EDGE = np.cos(np.radians(25))
# Gaps of mesh and case agree where they differ by less than this share of what facets may miss;
# bodies whose gap is smaller touch.
_FITS = 1e-3
# So many faces at most are as near to a place as others: those around a vertex.
_AS_NEAR = 8
# The mean over a face of what it misses, over κ R² / 2 with the κ seen at its vertices, by order:
# 1 − |x − c|² / R² for linear lines and quadrangles (3/4 on triangles), (1 − r²) r² / 2 for arcs.
_MEAN = {1: 2 / 3, 2: 2 / 15}


class _Bend(NamedTuple):
    """By face (f,): its middle (f, dim), and the mean rise of the surface above the face."""

    middle: np.ndarray
    rise: np.ndarray


class _Missed(NamedTuple):
    """By macro-element (m,): what facets add to a gap, a mean over neighbours, and their depth."""

    gap: np.ndarray
    depth: np.ndarray


class FacetEffect(NamedTuple):
    """What facets do to a zone, or the most that they do to any; zero without facets.

    `pressure`: the L2 change of a zone's pressure by the gap that facets add on the average, over
    the pressure; `depth`: how far facets miss their surfaces, over the elastic closing of the
    contact, or over the smallest gap that is left where nothing touches.
    """

    pressure: float = 0.0
    depth: float = 0.0


def facets_of(problem: ContactProblem, states: Sequence[Equilibrium]) -> FacetEffect:
    """What facets do to each zone in the last step that presses it, or in the last of all.

    A pressure far below those of other steps comes from rounded coordinates and is not judged.
    """
    zones, steps = problem.scene.zones, []
    for zone in zones:
        largest = np.array([_pressing(state)[zone.numbers].max(initial=0.0) for state in states])
        presses = np.flatnonzero(largest > LITTLE * largest.max())
        steps.append(int(presses[-1]) if len(presses) else len(states) - 1)
    missed = [_missed(problem.scene, zone) for zone in zones]
    by_step = {step: _facets_in(problem, states[step], missed) for step in set(steps)}
    found = [by_step[step][number] for number, step in enumerate(steps)]
    return FacetEffect(*np.max([FacetEffect(), *found], axis=0).tolist())


def _pressing(state: Equilibrium) -> np.ndarray:
    """The pressures (k,), zero where they are round-off."""
    return np.where(state.pressure > state.trial.pressure_limit, state.pressure, 0.0)


def _facets_in(
    problem: ContactProblem, state: Equilibrium, missed: Sequence[_Missed | None]
) -> list[FacetEffect]:
    """What facets do to each zone in a state with its status kept; `missed` is by zone.

    A pressure below its round-off limit counts as zero.
    """
    gaps, depths = np.zeros(len(state.pressure)), []
    pushed = _pressing(state) * problem.constraints.covered
    closing = _closing(problem, state, pushed)
    for zone, miss in zip(problem.scene.zones, missed, strict=True):
        mine, depth = zone.numbers, 0.0
        if miss is not None and pushed[mine].any():
            gaps[mine] = miss.gap
            if (closed_by := float(pushed[mine] @ closing[mine])) > 0:
                depth = float(pushed[mine] @ miss.depth) / closed_by
        elif miss is not None:
            met = zone.operator.covered > 0
            left, peak = state.gap[mine][met], float(miss.depth.max()) / _MEAN[1]
            if (left > np.maximum(state.trial.gap_limit[mine][met], _FITS * peak)).all():
                depth = peak / float(left.min(initial=np.inf))
        depths.append(depth)
    closed = state.iterate.closed & problem.constraints.normal
    change = problem.pressure_of_gaps(closed, gaps) if gaps[closed].any() else 0.0 * gaps
    found = []
    for zone, depth in zip(problem.scene.zones, depths, strict=True):
        weight, mine, share = zone.operator.covered, zone.numbers, 0.0
        if gaps[mine].any():
            size = weight @ state.pressure[mine] ** 2
            share = float(np.sqrt(weight @ change[mine] ** 2 / size))
        found.append(FacetEffect(share, depth))
    return found


def _closing(problem: ContactProblem, state: Equilibrium, pushed: np.ndarray) -> np.ndarray:
    """By how much (k,) contact closes elastically where forces `pushed` (k,) act.

    Twice the strain energy over ∫ p, the largest it can be, of the bodies that contact joins: what
    stands apart from them does not count.
    """
    scene, found = problem.scene, np.zeros(len(pushed))
    dim, normal = scene.points.shape[1], problem.constraints.normal
    energy = np.bincount(scene.body, energy_at_nodes(state).astype(float))
    for part in problem.parts:
        moving = np.flatnonzero(scene.free.spread(part.unknowns.astype(float))) // dim
        force = float(pushed[part.multipliers & normal].sum())
        if force > 0:
            joined = np.unique(scene.body[moving])
            found[part.multipliers] = 2 * energy[joined].sum() / force
    return found


def _missed(scene: Scene, zone: ZoneScene) -> _Missed | None:
    """What the facets of a zone miss; None where they miss nothing, or both sides the same.

    Zones with a given gap have none, nor have rigid surfaces without a mesh and multipliers at
    nodes.
    """
    operator = zone.operator
    if zone.zone.clearance is not None or operator.nodes is not None or not zone.master_faces:
        return None
    slave = _bend(scene.points, zone.slave_faces)
    rise, depth = slave.rise, np.abs(slave.rise)
    if zone.zone.master not in scene.case.surfaces:
        master = _bend(scene.points, zone.master_faces)
        opposite = _nearest(slave.middle, master.middle)
        rise, depth = rise + opposite @ master.rise, depth + opposite @ np.abs(master.rise)
    apart = operator.initial + zone.zone.interference * operator.covered
    if not (np.abs(apart) > _FITS * depth.max() * operator.covered).any():
        return None  # the facets of both sides lie on one another
    number = np.concatenate([block.number for block in zone.slave_faces])
    around = zone.near.astype(float) @ sparse.diags(operator.surface.area)
    by_macro = np.zeros((2, zone.count))
    by_macro[:, number] = rise, depth
    gap = around @ by_macro[0] / np.asarray(around.sum(axis=1)).ravel()
    return _Missed(gap, by_macro[1])


def _nearest(places: np.ndarray, middle: np.ndarray) -> sparse.csr_matrix:
    """The mean (n, f) of values (f,) over the faces nearest to places (n, dim): all that tie.

    >>> _nearest(np.zeros((1, 2)), np.array([[1.0, 0], [0, -1.0], [3.0, 0]])).toarray().tolist()
    [[0.5, 0.5, 0.0]]
    """
    most = np.arange(1, min(_AS_NEAR, len(middle)) + 1)
    distance, face = cKDTree(middle).query(places, most)
    i, j = np.nonzero(distance <= (1 + FLAT) * distance[:, :1])
    shares = 1 / np.bincount(i)[i]
    return sparse.csr_matrix((shares, (i, face[i, j])), shape=(len(places), len(middle)))


def _bend(points: np.ndarray, blocks: Sequence[FaceBlock]) -> _Bend:
    """The bend of all faces of a surface; zero where one of the inner vertices shows none."""
    normal = surface_normals(points, blocks)
    shared = np.zeros(len(points), dtype=int)
    for block in blocks:
        np.add.at(shared, block.nodes[:, : block.type.n_vertices], 1)
    parts = []
    for block in blocks:
        kind, vertex = block.type, block.nodes[:, : block.type.n_vertices]
        at = kind.nodes[: kind.n_vertices]
        own = area_vectors(points, block.nodes, shape_functions(kind.name).gradients(at))
        own /= np.linalg.norm(own, axis=2, keepdims=True)
        middle = points[vertex].mean(axis=1)
        arm = points[vertex] - middle[:, None]
        square = (arm**2).sum(axis=2)
        mean = normal[vertex]
        lean = ((mean - own) * arm).sum(axis=2) / square  # the curvature κ
        level = (mean * own).sum(axis=2) > _EDGE
        lean[np.abs(mean - own).max(axis=2) <= FLAT] = 0.0
        inner = shared[vertex] > 1
        size = np.where(inner, np.where(level, np.abs(lean), 0.0), np.inf).min(axis=1)
        curved = np.where(np.isfinite(size), size, 0.0) * np.sign((lean * inner).sum(axis=1))
        parts.append(_Bend(middle, _MEAN[kind.order] * curved * square.mean(axis=1) / 2))
    return _Bend(*(np.concatenate(values) for values in zip(*parts, strict=True)))
