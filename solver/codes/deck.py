"""What every code is given: a case on its mesh, all values evaluated."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import meshio
import numpy as np

from ..case.acting import Load
from ..case.expressions import evaluate
from ..case.file import Zone
from ..case.material import Material
from ..case.model import Case
from ..lac.cells.faces import FaceBlock, surface_nodes, surface_normals
from ..lac.cut import cut
from ..lac.motions import body_numbers
from ..mechanics.fem.faces import volume_cells
from ..mechanics.fem.supports import FreeMotion
from ..simulation.scene.attributes import Attributes
from ..simulation.scene.cut_groups import faces_of
from ..simulation.scene.groups import check_groups, named_parts
from ..simulation.scene.selections import with_groups
from .layer import as_layer
from .path import DeckStep, steps_of

# Supports as codes take them: displacements of nodes along axes, and along other directions.

# A component of a unit vector below this is round-off.
_ZERO = 1e-12
# A unit vector has a part along an axis from here on.
_ALONG = 0.1
# How deep closed bodies overlap, over the extent of the model, and what gap counts as closed.
_OVERLAP, _CLOSED = 3e-4, 1e-6


@dataclass(frozen=True)
class Oblique:
    """Support of a node across the axes: direction (dim,) · displacement = value.

    The component `axis` of the direction is 1. It is 0 in the node's other supports, so that the
    displacement along this axis follows from the others.
    """

    node: int
    axis: int
    direction: np.ndarray
    value: float

    @property
    def terms(self) -> list[tuple[int, float]]:
        """Axis and coefficient of each component that is not zero, `axis` first."""
        rest = [a for a in np.flatnonzero(self.direction).tolist() if a != self.axis]
        return [(a, float(self.direction[a])) for a in [self.axis, *rest]]


def split(free: FreeMotion, dim: int) -> tuple[np.ndarray, list[Oblique]]:
    """Imposed displacements (n, dim) along axes, NaN in free directions, and all other supports."""
    held, oblique = free.offset.reshape(-1, dim).copy(), []
    basis = free.basis.tocsr()
    entries = np.diff(basis.indptr)
    plain = np.ones(len(entries), dtype=bool)
    single = entries == 1
    plain[single] = np.abs(np.abs(basis.data[basis.indptr[:-1][single]]) - 1) < _ZERO
    plain &= entries <= 1
    held.reshape(-1)[entries > 0] = np.nan
    for node in np.flatnonzero(~plain.reshape(-1, dim).all(axis=1)).tolist():
        block = basis[dim * node : dim * (node + 1)]
        block = block[:, np.unique(block.indices)].toarray()
        across = np.linalg.svd(block)[0][:, block.shape[1] :].T
        values = across @ free.offset[dim * node : dim * (node + 1)]
        held[node] = np.nan
        for row, axis in _reduced(np.column_stack([across, values])):
            if np.count_nonzero(row[:-1]) == 1:
                held[node, axis] = row[-1]
            else:
                oblique.append(Oblique(node, axis, row[:-1], float(row[-1])))
    return held, oblique


def _reduced(rows: np.ndarray) -> Iterable[tuple[np.ndarray, int]]:
    """Rows that say the same, each with the axis whose coefficient is 1 there and 0 elsewhere.

    >>> [(row.tolist(), axis) for row, axis in _reduced(np.array([[3.0, 4.0, 20.0]]))]
    [([0.75, 1.0, 5.0], 1)]
    """
    rows, axes = rows.copy(), []
    for i in range(len(rows)):
        axes.append(int(np.abs(rows[i, :-1]).argmax()))
        rows[i] /= rows[i, axes[i]]
        others = np.arange(len(rows)) != i
        rows[others] -= np.outer(rows[others, axes[i]], rows[i])
    rows[np.abs(rows) < _ZERO] = 0.0
    return zip(rows, axes, strict=True)


def closing(
    points: np.ndarray,
    cells: dict[str, np.ndarray],
    held: np.ndarray,
    oblique: Sequence[Oblique],
    pairs: Sequence[tuple[Zone, list[FaceBlock], list[FaceBlock]]],
    touching: bool = False,
) -> np.ndarray:
    """Displacement (n, dim), zero except on bodies that contact alone can hold.

    Such a body, of an open zone, or of one that is `touching`, is moved to the other side until
    they overlap a little. Without contact at the start the first matrix of a code is singular.
    """
    start = np.zeros_like(points)
    body = body_numbers(len(points), cells)
    for zone, slave, master in pairs:
        for mine, other in ((slave, master), (master, slave)):
            direction = _mean_normal(points, mine)
            of = body == body[mine[0].nodes[0, 0]]
            along = np.abs(direction) > _ALONG
            tilted = any(abs(o.direction @ direction) > _ALONG for o in oblique if of[o.node])
            if not along.any() or tilted or not np.isnan(held[np.ix_(of, along)]).all():
                continue
            gap = _gaps(points, zone, mine, other)
            extent = float(np.ptp(points, axis=0).max())
            if touching or np.median(gap) > _CLOSED * extent:
                moved = (max(gap.min(), 0.0) + _OVERLAP * extent) * direction
                start[of] = np.where(np.isnan(held[of]), moved, 0.0)
            break
    return start


def _mean_normal(points: np.ndarray, faces: list[FaceBlock]) -> np.ndarray:
    """The direction of the sum of normals at nodes; zero for a closed surface."""
    total = surface_normals(points, faces)[surface_nodes(faces)].mean(axis=0)
    length = float(np.linalg.norm(total))
    return total / length if length > _ALONG else np.zeros_like(total)


def _gaps(
    points: np.ndarray, zone: Zone, mine: list[FaceBlock], other: list[FaceBlock]
) -> np.ndarray:
    """About the initial gap at the nodes of one side: to the plane at the other's nearest node."""
    from scipy.spatial import cKDTree

    nodes, others = surface_nodes(mine), surface_nodes(other)
    if zone.clearance is not None:
        return evaluate(zone.clearance, points[nodes]) - zone.interference
    normals = surface_normals(points, other)[others]
    near = cKDTree(points[others]).query(points[nodes])[1]
    offset = points[nodes] - points[others][near]
    return np.einsum("nd,nd->n", offset, normals[near]) - zone.interference


# Normals of a flat surface differ by no more.
_FLAT = 1e-6
# What the cells of a rigid body are made of; all their nodes are held.
_RIGID = Material(1.0, 0.0)


class UnsupportedError(Exception):
    """A code has no way to express something; the text names it and says why."""


@dataclass(frozen=True, kw_only=True)
class PairedFaces:
    """One contact zone with its faces, turned outward.

    `gap` (n,) at the nodes of the slave is the initial gap that the case prescribes, NaN elsewhere;
    None: as meshed, less `zone.interference`.
    """

    zone: Zone
    slave: list[FaceBlock]
    master: list[FaceBlock]
    gap: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class Deck:
    """A case as solved on its mesh: nodes (n, dim), cells by type, values at the last load step.

    `material` holds each cell's number (m,) in `materials`, by type. `held` (n, dim) are the
    displacements given to nodes, NaN where they are free, `oblique` the supports across the axes.
    `start` (n, dim) closes gaps of bodies that contact alone holds (see `supports.closing`).
    `pressures`: faces, turned outward, and the constant pressure on them. `forces` (n, dim) are the
    consistent nodal forces of all other loads, `all_forces` those of the pressures too. `plane`:
    how many of the nodes are those of the plane mesh under one layer of cells; 0 where the deck is
    the mesh itself. `path`: the steps of bodies that move far, of which the values are the last.
    """

    case: Case
    points: np.ndarray
    cells: dict[str, np.ndarray]
    materials: list[Material]
    material: dict[str, np.ndarray]
    held: np.ndarray
    oblique: list[Oblique]
    start: np.ndarray
    pressures: list[tuple[list[FaceBlock], float]]
    forces: np.ndarray
    all_forces: np.ndarray
    pairs: list[PairedFaces]
    plane: int = 0
    path: tuple[DeckStep, ...] = ()

    @property
    def starts(self) -> dict[str, int]:
        """The number of the first cell of each type, all cells counted from 1."""
        counts = np.cumsum([1, *map(len, self.cells.values())])
        return dict(zip(self.cells, counts.tolist(), strict=False))

    @property
    def flat(self) -> bool:
        """Whether the two surfaces of each pair are flat, and parallel."""
        return all(are_flat(self, pair) for pair in self.pairs)

    @property
    def softest(self) -> float:
        """The smallest Young's modulus of a deformable body."""
        return min(m.young for m in self.case.materials.values())

    def of_plane_strain(self, stress: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Stress (n, 6) at nodes (n,) from xx, yy, xy (n, 3): zz = ν (xx + yy), the others zero.

        At a node between materials ν is taken from one of them.
        """
        poisson = np.zeros(len(self.points))
        of = np.array([material.poisson for material in self.materials])
        for name, cells in self.cells.items():
            poisson[cells] = of[self.material[name]][:, None]
        found = np.zeros((len(stress), 6))
        found[:, [0, 1, 3]] = stress
        found[:, 2] = poisson[nodes] * (stress[:, 0] + stress[:, 1])
        return found

    def fixed(self) -> Iterator[tuple[int, int, float]]:
        """Node and axis, both from 0, and value of each displacement that is given."""
        nodes, axes = np.nonzero(~np.isnan(self.held))
        values = self.held[nodes, axes]
        yield from zip(nodes.tolist(), axes.tolist(), values.tolist(), strict=True)

    def loaded(self) -> Iterator[tuple[int, int, float]]:
        """Node and axis, both from 0, and value of each nodal force that is not round-off."""
        least = 1e-14 * np.abs(self.forces).max(initial=0.0)
        nodes, axes = np.nonzero(np.abs(self.forces) > least)
        values = self.forces[nodes, axes]
        yield from zip(nodes.tolist(), axes.tolist(), values.tolist(), strict=True)


def deck_of(case: Case, mesh: meshio.Mesh, layer: bool = False, follows: bool = False) -> Deck:
    """The deck of a case on its mesh; `layer`: a plane one as one layer of cells in space.

    `follows`: the code follows bodies that move far. Raises InputError where case and mesh do not
    fit, UnsupportedError for what no code is given: springs, groups that move as one, initial
    strain, factors of single loads.
    """
    mesh = with_groups(case, mesh)
    check_groups(case, mesh)
    mesh, _ = named_parts(case, mesh)
    _refuse(case, follows)
    layer = layer and mesh.points.shape[1] == 2 and not case.axisymmetric
    plane = len(mesh.points) if layer else 0
    if plane:
        case, mesh = as_layer(case, mesh)
    cells = volume_cells(mesh)
    whole = cut(mesh.points, cells, [], [], [], [])
    others = tuple(load for load in case.loads if not _is_constant(load))
    origin = np.zeros(mesh.points.shape[1])
    given = Attributes(replace(case, loads=others), mesh, whole, [], origin)
    materials = [*case.materials.values(), _RIGID]
    numbers = given.by_material(lambda m: float(materials.index(m)), len(materials) - 1.0)
    factor = case.factors[-1]
    held, oblique = split(given.supports(), mesh.points.shape[1])
    constant = [load for load in case.loads if _is_constant(load)]
    path: tuple[DeckStep, ...] = ()
    if case.moving:
        path = tuple(steps_of(given, np.isnan(held), constant))
    flat = 2 if plane else mesh.points.shape[1]
    pairs = [_paired(case, mesh, i, flat) for i in range(len(case.zones))]
    return Deck(
        case=case,
        points=mesh.points,
        cells=cells,
        materials=materials,
        material={name: found.astype(int) for name, found in numbers.items()},
        held=path[-1].held if path else factor * held,
        oblique=[replace(each, value=factor * each.value) for each in oblique],
        start=closing(
            mesh.points,
            cells,
            held,
            oblique,
            [(p.zone, p.slave, p.master) for p in pairs],
            touching=bool(path),
        ),
        pressures=[
            (
                faces_of(mesh, load.group, case, f"loads[{i}].group"),
                load.factor(case.steps[-1]) * load.value,
            )
            for i, load in enumerate(case.loads)
            if isinstance(load.value, float) and _is_constant(load)
        ],
        forces=path[-1].forces if path else factor * given.forces(),
        all_forces=factor * Attributes(case, mesh, whole, [], origin).forces(),
        pairs=pairs,
        plane=plane,
        path=path,
    )


def refuse_rings(deck: Deck, code: str) -> None:
    """Refuse axisymmetric bodies for a code that has or is given none."""
    if deck.case.axisymmetric:
        raise UnsupportedError(f"axisymmetric bodies: not written for {code}")


def _is_constant(load: Load) -> bool:
    """Whether a load is a pressure that is the same everywhere, which codes take as one."""
    return load.kind == "pressure" and isinstance(load.value, float)


def _refuse(case: Case, follows: bool) -> None:
    if case.moving and not follows:
        raise UnsupportedError("bodies that move far (motion: large): not written for this code")
    _refuse_parts(case)
    if case.moving:
        _refuse_moving(case)
        return
    if case.histories:
        raise UnsupportedError("factors of single loads in steps: not written for codes")
    if len(case.steps) > 1 and case.frictional:
        raise UnsupportedError("a path of steps with friction: not written for codes")


def _refuse_moving(case: Case) -> None:
    for what, found in (
        ("a support along normals", any("normal" in s.fix for s in case.supports)),
        ("an interference", any(zone.interference for zone in case.zones)),
        (
            "a pressure that varies",
            any(x.kind == "pressure" and not _is_constant(x) for x in case.loads),
        ),
    ):
        if found:
            raise UnsupportedError(f"{what} of bodies that move far: not written for codes")


def _refuse_parts(case: Case) -> None:
    if any(load.strains for load in case.loads):
        raise UnsupportedError("initial strain and change of temperature: not written for codes")
    if any(support.together or support.cyclic for support in case.supports):
        raise UnsupportedError("groups that move as one: not written for codes")
    if any(support.spring for support in case.supports):
        raise UnsupportedError("springs and elastic foundations: not written for codes")
    for name, body in case.rigid.items():
        if body.moves or body.surface:
            what = f"a rigid {body.surface}" if body.surface else "a rigid body that moves"
            raise UnsupportedError(f"{name} is {what}: not written for codes")


def _paired(case: Case, mesh: meshio.Mesh, number: int, flat: int) -> PairedFaces:
    zone = case.zones[number]
    slave, master = (
        faces_of(mesh, getattr(zone, side), case, case.zone_key(number, side))
        for side in ("slave", "master")
    )
    gap = None
    if zone.clearance is not None:
        gap = np.full(len(mesh.points), np.nan)
        nodes = surface_nodes(slave)
        gap[nodes] = evaluate(zone.clearance, mesh.points[nodes, :flat]) - zone.interference
    return PairedFaces(zone=zone, slave=slave, master=master, gap=gap)


def are_flat(deck: Deck, pair: PairedFaces) -> bool:
    """Whether the normals of both sides agree everywhere."""
    outward = surface_normals(deck.points, pair.slave)[surface_nodes(pair.slave)]
    facing = surface_normals(deck.points, pair.master)[surface_nodes(pair.master)]
    return bool(np.abs(np.concatenate([-outward, facing]) - facing[0]).max() < _FLAT)


def face_size(deck: Deck) -> float:
    """The size of a slave face, the median: a length, or the root of an area."""
    if not deck.pairs:
        return 0.0
    sizes = []
    for block in (block for pair in deck.pairs for block in pair.slave):
        corner = deck.points[block.nodes[:, : block.type.n_vertices]]
        area = np.linalg.norm(np.ptp(corner, axis=1), axis=1) / np.sqrt(block.type.dim)
        sizes.append(area)
    return float(np.median(np.concatenate(sizes)))
