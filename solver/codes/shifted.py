"""Slave surfaces apart from their bodies: a layer of soft cells that moves with each of them.

CalculiX takes one clearance per pair. The faces of this layer have the gap that the case prescribes
at each node; equations give each node of the layer the displacement of the body's node.
"""

from dataclasses import replace

import numpy as np

from ..case.material import Material
from ..mechanics.fem.faces import FaceBlock, nodal_normals
from .deck import Deck, PairedFaces, UnsupportedError
from .layer import columns, over

# Thickness over the extent of the model, and stiffness over the softest body's.
_THIN, _SOFT = 1e-3, 1e-6
# Normals of a flat surface differ by no more.
_FLAT = 1e-6
# The level of a node in the outer face of the layer; 0 is the inner one, 2 between.
_ABOVE = 1


def needed(pair: PairedFaces) -> bool:
    """Whether the gap of a pair is given by place, or adds to the meshed one."""
    if pair.gap is None:
        return bool(pair.zone.interference)
    return not isinstance(pair.zone.clearance, float)


def with_layers(deck: Deck) -> tuple[Deck, np.ndarray]:
    """The deck with a layer on each slave that needs one, and the node below each new node (k,).

    Raises UnsupportedError where a gap is given by place between faces that are not flat.
    """
    below = [np.empty(0, dtype=int)]
    for number, pair in enumerate(deck.pairs):
        if needed(pair):
            deck, new = _with_layer(deck, number)
            below.append(new)
    return deck, np.concatenate(below)


def _with_layer(deck: Deck, number: int) -> tuple[Deck, np.ndarray]:
    pair, size = deck.pairs[number], len(deck.points)
    nodes = np.unique(np.concatenate([block.nodes.ravel() for block in pair.slave]))
    normals = _normals(deck, pair.slave)[nodes]
    shift = _shift(deck, pair, nodes, normals)
    thick = _THIN * np.ptp(deck.points, axis=0).max()
    heights = np.array([-thick, 0.0, -thick / 2])[:, None] + shift
    places = deck.points[nodes] + heights[:, :, None] * normals
    local = np.full(size, -1)
    local[nodes] = np.arange(len(nodes))
    raised = [
        np.stack([local[b.nodes[:, i]] + len(nodes) * level for i, level in _columns(b)], axis=1)
        for b in pair.slave
    ]
    used = np.zeros(3 * len(nodes), dtype=bool)
    used[np.concatenate([cells.ravel() for cells in raised])] = True
    label = size + np.cumsum(used) - 1
    new, points = np.tile(nodes, 3)[used], places.reshape(-1, deck.points.shape[1])[used]
    cells, material, slave = dict(deck.cells), dict(deck.material), []
    for block, rows in zip(pair.slave, raised, strict=True):
        kind = over(block.type)
        before = cells.get(kind.name, np.empty((0, kind.n_nodes), dtype=int))
        numbers = material.get(kind.name, np.empty(0, dtype=int))
        cells[kind.name] = np.concatenate([before, label[rows]])
        material[kind.name] = np.append(numbers, np.full(len(rows), len(deck.materials)))
        top = [level == _ABOVE for _, level in _columns(block)]
        face = next(i for i, f in enumerate(kind.faces) if all(top[node] for node in f.nodes))
        slave.append(
            FaceBlock(
                type=block.type,
                nodes=cells[kind.name][len(before) :, list(kind.faces[face].nodes)],
                number=block.number,
                owner_type=kind,
                owner=len(before) + np.arange(len(rows)),
                local=np.full(len(rows), face),
            )
        )
    zone = replace(pair.zone, clearance=None, interference=0.0)
    pairs = [*deck.pairs]
    pairs[number] = replace(pair, zone=zone, slave=slave, gap=None)
    nothing = np.zeros_like(points)
    longer = replace(
        deck,
        points=np.concatenate([deck.points, points]),
        cells=cells,
        materials=[*deck.materials, Material(_SOFT * deck.softest, 0.0)],
        material=material,
        held=np.concatenate([deck.held, np.full_like(points, np.nan)]),
        start=np.concatenate([deck.start, nothing]),
        forces=np.concatenate([deck.forces, nothing]),
        all_forces=np.concatenate([deck.all_forces, nothing]),
        pairs=pairs,
    )
    return longer, new


def _normals(deck: Deck, faces: list[FaceBlock]) -> np.ndarray:
    return nodal_normals(deck.points, [(block.type.name, block.nodes) for block in faces])


def _shift(deck: Deck, pair: PairedFaces, nodes: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """How far outward (k,) the slave's nodes are moved."""
    if pair.gap is None:
        return np.full(len(nodes), pair.zone.interference)
    others = np.unique(np.concatenate([block.nodes.ravel() for block in pair.master]))
    facing = _normals(deck, pair.master)[others]
    if np.abs(facing - facing[0]).max() > _FLAT or np.abs(normals + facing[0]).max() > _FLAT:
        raise UnsupportedError("initial gap by place on curved faces: CalculiX takes one number")
    return (deck.points[nodes] - deck.points[others[0]]) @ facing[0] - pair.gap[nodes]


def _columns(block: FaceBlock) -> list[tuple[int, int]]:
    """For each node of the cell over a face: the face's node, and its level."""
    found = columns(block.type.name)
    # A line turned outward has the outside on its right; the cell over it is on its left.
    mirror = over(block.type).mirror if block.type.dim == 1 else range(len(found))
    return [found[node] for node in mirror]
