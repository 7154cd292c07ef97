"""Balance of forces and moments, reactions, and the resultants of contact in a zone."""

import numpy as np
from scipy import sparse

from ...lac.cells.faces import surface_nodes, surface_points
from ...mechanics.fem.faces import face_integrals
from ...mechanics.fem.supports import DEPENDENT
from ...mechanics.linear.factor import factorise
from ...mechanics.mortar.edge import Edges, contact_edges
from ..equilibrium.rest import force_at_rest
from ..equilibrium.state import Equilibrium
from ..scene.scene import Scene, ZoneScene
from .forces import Reaction, Resultants, RigidMotion

# A macro-element is covered in full where its segments miss less than this share.
_COVERED = 1e-6
# Of a macro-element's largest coefficient: smaller ones are round-off, or too small to divide by.
_ROUND_OFF, _OWN = 1e-10, 1e-2


def imbalances(scene: Scene, state: Equilibrium) -> dict[str, float]:
    """Relative imbalances by name.

    Forces are divided by the sum of the sizes of the nodal forces at work (of loads, contact or
    supports; where there is no load at least the force that the displacement could cause, and the
    loads of other steps), moments by that times the length of the model. Of axisymmetric bodies
    only forces along the axis have a resultant. Friction between surfaces that are meshed apart is
    a couple, which is no imbalance.
    """
    points, around = scene.points, scene.case.axisymmetric
    contact = np.zeros_like(points)
    by_zone = {}
    for zone in scene.zones:
        forces = zone.forces(state.pressure).reshape(points.shape)
        apart = zone.operator.levers is not None
        by_zone[zone.zone.name] = forces, zone.couple(state.pressure) if apart else np.zeros(3)
        contact += forces
    total = contact + state.correction
    held, free_part = _unbalanced(scene, state, total)
    scale = max(np.abs(state.force).sum(), *(np.abs(each).sum() / 2 for each in (contact, held)))
    if not state.force.any():
        caused = force_at_rest(scene, state.displacement)
        scale = max(scale, caused, scene.loads.at_work.total) or 1.0
    result: dict[str, float] = {}
    if state.correction.any():
        by_zone["correction of the pressure"] = state.correction, state.couple
    for name, (forces, own) in by_zone.items():
        result |= _both(
            f"zone {name}", points, forces, own, scale, scene.coordinates.length, around
        )
    couple = sum((each for _, each in by_zone.values()), np.zeros(3))
    whole = held + state.force + _of_ground(state)
    result |= _both(
        "reactions and loads", points, whole, -couple, scale, scene.coordinates.length, around
    )
    result["free nodes: force"] = float(np.abs(free_part).max(initial=0.0) / scale)
    return result


def _unbalanced(
    scene: Scene, state: Equilibrium, contact: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What loads and `contact` forces leave on held unknowns, the reactions, and on free ones."""
    unbalanced = (state.iterate.internal - state.force - contact).astype(float).ravel()
    basis = scene.free.basis
    free_part = (basis @ (basis.T @ unbalanced)).reshape(contact.shape)
    return unbalanced.reshape(contact.shape) - free_part, free_part


def reactions(scene: Scene, state: Equilibrium) -> tuple[list[Reaction], np.ndarray]:
    """The reactions of each group that supports hold, of rigid bodies, the axis, springs and ties.

    With the forces (n, dim) of all of them at nodes. A support gets the force along its direction,
    without the part in those of supports before it: all forces sum to what is held.
    """
    left, _ = _unbalanced(scene, state, _contact(scene, state))
    found: dict[str, np.ndarray] = {}
    spanned = np.zeros((*left.shape, left.shape[1]))
    for fixed in scene.held.fixed:
        nodes, direction = fixed.nodes, fixed.directions
        rest = direction - np.einsum("nij,nj->ni", spanned[nodes], direction)
        size = np.linalg.norm(rest, axis=1, keepdims=True)
        unit = np.divide(rest, size, out=np.zeros_like(rest), where=size > DEPENDENT)
        spanned[nodes] += unit[:, :, None] * unit[:, None]
        part = np.einsum("nd,nd->n", left[nodes], unit)[:, None] * unit
        left[nodes] -= part
        if len(nodes):
            force = found.setdefault(fixed.holder, np.zeros_like(left))
            force[nodes] += part
    if joint := scene.held.joint:
        found[joint] = found.get(joint, 0.0) + left
    for part, term in zip(state.iterate.scene.parts, state.iterate.terms, strict=True):
        if part.holder:
            found[part.holder] = found.get(part.holder, 0.0) - term.ground
    at_nodes = sum(found.values(), np.zeros_like(left))
    return [_resultant(scene, name, force) for name, force in found.items()], at_nodes


def _contact(scene: Scene, state: Equilibrium) -> np.ndarray:
    """The contact forces (n, dim) of all zones."""
    contact = state.correction.copy()
    for zone in scene.zones:
        contact += zone.forces(state.pressure).reshape(contact.shape)
    return contact


def rigid_bodies(scene: Scene, state: Equilibrium) -> list[RigidMotion]:
    """The motion of each rigid body, and the contact force on it."""
    contact, found = _contact(scene, state), []
    for name, frame in scene.held.frames.items():
        moved = frame.amount(state.displacement[frame.nodes])
        force = frame.resultant(contact[frame.nodes])
        axes = "xyz"[: contact.shape[1]]
        turn, moment = (np.array([of.get(f"r{a}", 0.0) for a in "xyz"]) for of in (moved, force))
        found.append(
            RigidMotion(
                body=name,
                point=frame.point + scene.coordinates.origin,
                translation=np.array([moved[axis] for axis in axes]),
                rotation=turn,
                force=np.array([force[axis] for axis in axes]),
                moment=moment,
            )
        )
    return found


def _of_ground(state: Equilibrium) -> np.ndarray:
    """The forces (n, dim) on the bodies of parts that stand on the ground."""
    return -state.iterate.ground


def _resultant(scene: Scene, name: str, force: np.ndarray) -> Reaction:
    acts = np.flatnonzero(force.any(axis=1))
    return Reaction(name, force.sum(axis=0), moment(scene, acts, force[acts]))


def moment(scene: Scene, nodes: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The moment (3,) about the origin of forces (n, dim) at nodes (n,).

    Those on axisymmetric bodies have none.
    """
    if scene.case.axisymmetric:
        return np.zeros(3)
    place = scene.points[nodes] + scene.coordinates.origin
    if place.shape[1] == 3:
        return np.cross(place, force).sum(axis=0)
    turning = place[:, 0] @ force[:, 1] - place[:, 1] @ force[:, 0]
    return np.array([0.0, 0.0, turning])


def strain_energy(state: Equilibrium) -> float:
    """½ ∫ σ:(ε − ε₀) of the bodies in the last step, by the work of forces.

    Rigid motions add none.
    """
    return float(energy_at_nodes(state).sum())


def energy_at_nodes(state: Equilibrium) -> np.ndarray:
    """The terms (n,) of that sum, each at a node of the body that has it."""
    iterate = state.iterate
    work = iterate.deformation.sum(axis=0) * (iterate.internal - iterate.ground)
    return work.sum(axis=1) / 2 + sum(term.energy for term in iterate.terms)


def _both(
    name: str,
    points: np.ndarray,
    forces: np.ndarray,
    couple: np.ndarray,
    scale: float,
    length: float,
    around: bool,
) -> dict[str, float]:
    """The imbalance of forces, and of their moments less a known `couple` (3,)."""
    if around:
        return {f"{name}: force": float(abs(forces[:, 1].sum()) / scale)}
    force = np.abs(forces.sum(axis=0)).max()
    if points.shape[1] == 2:
        turning = (points[:, 0] * forces[:, 1] - points[:, 1] * forces[:, 0]).sum()
        moment = abs(float(turning - couple[2]))
    else:
        moment = float(np.abs(np.cross(points, forces).sum(axis=0) - couple).max())
    return {f"{name}: force": float(force / scale), f"{name}: moment": moment / (scale * length)}


def pressures_of_forces(scene: Scene, state: Equilibrium) -> list[np.ndarray | None]:
    """The pressure (m,) on the macro-elements of each zone, by the forces at its slave nodes.

    Internal forces less loads are -∑ p ∫ N n dS at nodes of the slave surfaces alone. They are
    solved for p by least squares, with integrals over whole faces (over segments where a
    macro-element is covered in part): neither multipliers nor the gap operator of covered faces
    enter. None where multipliers are at nodes, or where a covered macro-element has no free node of
    its own, so that its pressure is not determined.
    """
    nothing: list[np.ndarray | None] = [None] * len(scene.zones)
    if not scene.zones or any(zone.operator.nodes is not None for zone in scene.zones):
        return nothing
    rows = _free_slave_rows(scene)
    if not rows.shape[0]:
        return nothing
    integrals = sparse.hstack([_integrals(scene, zone) for zone in scene.zones], format="csr")
    integrals = (rows @ integrals).tocsr()
    size = abs(integrals).max(axis=0).toarray().ravel()
    scale = 1 / np.where(size > 0, size, 1.0)
    integrals.data *= scale[integrals.indices]
    integrals.data[np.abs(integrals.data) < _ROUND_OFF] = 0.0
    integrals.eliminate_zeros()
    alone = integrals[np.diff(integrals.indptr) == 1]
    covered = np.concatenate([zone.operator.surface.covered for zone in scene.zones])
    determined = (size == 0) & (covered == 0)
    determined[alone.indices[np.abs(alone.data) > _OWN]] = True
    if not determined.all():
        return nothing
    known = (state.force + state.correction).ravel()
    for zone in (zone for zone in scene.zones if zone.slips):
        known = known + zone.tangential_forces(state.pressure)
    forces = rows @ (state.iterate.internal.ravel() - known).astype(float)
    matrix = integrals.T @ integrals + sparse.diags_array((size == 0).astype(float))
    pressure = factorise(matrix).solve(integrals.T @ forces) * scale
    return list(np.split(pressure, np.cumsum([zone.count for zone in scene.zones])[:-1]))


def _integrals(scene: Scene, zone: ZoneScene) -> sparse.csr_matrix:
    """-∫ N n dS (n_dofs, m) over each macro-element of a zone."""
    dim, surface = scene.points.shape[1], zone.operator.surface
    partly = surface.covered < (1 - _COVERED) * surface.area
    around, shape = scene.case.axisymmetric, (scene.n_dofs, zone.count)
    parts = []
    for face in zone.sub_faces:
        whole = ~partly[face.macro]
        nodes, macro = face.nodes[whole], face.macro[whole]
        values, _ = face_integrals(scene.points, nodes, face.type.name, around)
        rows = dim * nodes[:, :, None] + np.arange(dim)
        columns = np.broadcast_to(macro[:, None, None], rows.shape)
        parts.append((-values.ravel(), rows.ravel(), columns.ravel()))
    entries, row, column = (np.concatenate(part) for part in zip(*parts, strict=True))
    matrix = sparse.csr_matrix((entries, (row, column)), shape=shape)
    if partly.any():
        matrix += zone.operator.matrix.T @ sparse.diags(partly.astype(float))
    return matrix


def _free_slave_rows(scene: Scene) -> sparse.csr_matrix:
    """The free directions (k, n_dofs) of the nodes on slave surfaces that are on no master."""
    mine = np.zeros(len(scene.points), dtype=bool)
    for side in ("sub_faces", "master_faces"):
        for face in (face for zone in scene.zones for face in getattr(zone, side)):
            mine[face.nodes] = side == "sub_faces"
    rows = sparse.csr_matrix(scene.free.basis.T)
    elsewhere = abs(rows) @ np.repeat(~mine, scene.points.shape[1]).astype(float)
    return rows[elsewhere == 0]


def resultants(scene: Scene, zone: ZoneScene, state: Equilibrium, closed: np.ndarray) -> Resultants:
    """Area and edges of the `closed` macro-elements (m,), and the forces on the slave."""
    mean = zone.by_macro_element(state.pressure)
    edges, area = extent(scene, zone, mean, closed)
    forces = zone.forces(state.pressure)
    if field := state.fields.get(zone.zone.name):
        forces = forces + field.force
    nodes = surface_nodes(zone.sub_faces)
    force = forces.reshape(scene.points.shape)[nodes]
    return Resultants(
        area=area,
        force=force.sum(axis=0),
        moment=moment(scene, nodes, force),
        edges=edges,
        pressure=np.array([mean.min(), mean.max()]),
    )


def extent(
    scene: Scene, zone: ZoneScene, mean: np.ndarray, closed: np.ndarray
) -> tuple[Edges | None, np.ndarray]:
    """The edges of contact in 2D, and the area of contact with its bounds (3,)."""
    surface = zone.operator.surface
    faces = [(b.number, b.nodes[:, : b.type.n_vertices]) for b in zone.slave_faces]
    if scene.points.shape[1] == 2:
        ends = np.empty((len(closed), 2), dtype=int)
        for number, nodes in faces:
            ends[number] = nodes
        # Where multipliers belong to nodes, means of macro-elements are no resultants of theirs.
        whole = surface.covered / surface.area * (zone.operator.nodes is None)
        points = scene.points + scene.coordinates.origin
        around = scene.case.axisymmetric
        at = surface_points(points, [(b.type.name, b.nodes, b.number) for b in zone.slave_faces])
        length = np.bincount(at.macro, at.weight)
        edges = contact_edges(points, ends, length, whole, mean, closed, around)
        areas = np.where(closed, surface.covered, 0.0)[:, None].repeat(3, axis=1)
        np.add.at(areas, edges.macro, edges.lengths)  # that ends on both sides: two edges
        return edges, np.minimum(np.maximum(areas, 0.0).sum(axis=0), surface.covered.sum())
    if closed.all() or not closed.any():
        return None, np.full(3, surface.covered[closed].sum())
    near = zone.near.astype(int)
    inside, around = closed & (near @ ~closed == 0), closed | (near @ closed > 0)
    return None, np.array([surface.covered[chosen].sum() for chosen in (closed, inside, around)])
