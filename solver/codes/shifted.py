"""Initial gaps for CalculiX: a number between flat faces, a layer of soft cells, or as meshed.

CalculiX takes one clearance per pair, and moves the slave's nodes by it to the flat triangles
between the corners of the master's faces: right between flat faces alone. Between curved ones, the
bow of each quadratic face would become an overlap. There, surfaces that fit are left as meshed.

A gap by place or an interference is a layer on the slave. Its faces have the gap that the case
prescribes at each node; equations give each of its nodes the displacement of the body's node.
"""

from dataclasses import replace

import numpy as np
from msgspec import structs
from scipy.spatial import cKDTree

from ..case.material import Material
from ..lac.cells.faces import FaceBlock, surface_nodes, surface_normals
from .deck import Deck, PairedFaces, UnsupportedError, are_flat
from .layer import columns

# Thickness over the extent of the model, and stiffness over the softest body's.
_THIN, _SOFT = 1e-3, 1e-6
# Curved surfaces fit if their gap is off by less, on the median, over the extent of the model.
_FIT = 1e-4
# The level of a node in the outer face of the layer; 0 is the inner one, 2 between.
_ABOVE = 1


def with_layers(deck: Deck) -> tuple[Deck, np.ndarray]:
    """The deck with a layer on each slave that needs one, and the node below each new node (k,).

    A pair keeps its clearance between flat faces only. Raises UnsupportedError for a gap between
    curved faces that is given by place, or by a number that is not the meshed gap.
    """
    deck = replace(deck, pairs=[_as_meshed(deck, pair) for pair in deck.pairs])
    below = [np.empty(0, dtype=int)]
    for number, pair in enumerate(deck.pairs):
        if _needs_layer(pair):
            deck, new = _with_layer(deck, number)
            below.append(new)
    return deck, np.concatenate(below)


def _as_meshed(deck: Deck, pair: PairedFaces) -> PairedFaces:
    """The pair; one with a number as gap between curved faces without this number."""
    if not isinstance(pair.zone.clearance, float) or are_flat(deck, pair):
        return pair
    extent = np.ptp(deck.points, axis=0).max()
    if abs(np.median(_meshed_gap(deck, pair)) - pair.zone.clearance) > _FIT * extent:
        problem = "initial gap on curved faces that is not the meshed one: not written for CalculiX"
        raise UnsupportedError(problem)
    return replace(pair, zone=structs.replace(pair.zone, clearance=None), gap=None)


def _needs_layer(pair: PairedFaces) -> bool:
    """Whether the gap of a pair is given by place, or adds to the meshed one."""
    if pair.gap is None:
        return bool(pair.zone.interference)
    return not isinstance(pair.zone.clearance, float)


def _meshed_gap(deck: Deck, pair: PairedFaces) -> np.ndarray:
    """About the gap (n,) at the slave's nodes, of surfaces that are near each other.

    The nearest node of the master is at an offset along the surface. On a circle, an offset is
    across the mean of the normals at its two ends.
    """
    nodes, others = surface_nodes(pair.slave), surface_nodes(pair.master)
    _, near = cKDTree(deck.points[others]).query(deck.points[nodes])
    facing = others[near]
    outward, inward = (surface_normals(deck.points, side) for side in (pair.master, pair.slave))
    normals = (outward[facing] - inward[nodes]) / 2
    return np.einsum("nd,nd->n", deck.points[nodes] - deck.points[facing], normals)


def _with_layer(deck: Deck, number: int) -> tuple[Deck, np.ndarray]:
    pair, size = deck.pairs[number], len(deck.points)
    nodes = surface_nodes(pair.slave)
    normals = surface_normals(deck.points, pair.slave)[nodes]
    shift = _shift(deck, pair, nodes)
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
        kind = block.type.layer
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
    zone = structs.replace(pair.zone, clearance=None, interference=0.0)
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


def _shift(deck: Deck, pair: PairedFaces, nodes: np.ndarray) -> np.ndarray:
    """How far outward (k,) the slave's nodes are moved."""
    if pair.gap is None:
        return np.full(len(nodes), pair.zone.interference)
    if not are_flat(deck, pair):
        raise UnsupportedError("initial gap by place on curved faces: CalculiX takes one number")
    other = surface_nodes(pair.master)[0]
    facing = surface_normals(deck.points, pair.master)[other]
    return (deck.points[nodes] - deck.points[other]) @ facing - pair.gap[nodes]


def _columns(block: FaceBlock) -> list[tuple[int, int]]:
    """For each node of the cell over a face: the face's node, and its level."""
    found = columns(block.type.name)
    # A line turned outward has the outside on its right; the cell over it is on its left.
    mirror = block.type.layer.mirror if block.type.dim == 1 else range(len(found))
    return [found[node] for node in mirror]
