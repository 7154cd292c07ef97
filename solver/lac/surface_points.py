"""Whole slave surfaces: quadrature points on their faces, and their macro-elements."""

from dataclasses import dataclass

import numpy as np

from .cells.quadrature import Rule, face_rule
from .facets import Facets, measured


@dataclass(frozen=True, kw_only=True)
class Surface:
    """The m macro-elements of a slave surface.

    `area`, `covered` (m,): whole and intersected area; `lost` (m,): opposite the master, but
    without a partner, where it is measured; `centre`, `normal` (m, dim).
    """

    area: np.ndarray
    covered: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    lost: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Points on the n faces of one block, the same q places on each.

    `values` (q, n_nodes) shape functions; `weight` (n, q) surface measure × quadrature weight;
    `normal` (n, q, dim) the unit normals along which the faces meet the master.
    """

    values: np.ndarray
    weight: np.ndarray
    normal: np.ndarray


def face_samples(slaves: list[Facets]) -> list[Samples]:
    """Points that integrate shape functions over whole planar faces exactly, by block.

    >>> (sample,) = face_samples([slave])
    >>> round(float(sample.weight.sum()), 15)
    2.0
    """
    return [sampled(block, face_rule(block.type.name)) for block in slaves]


def sampled(block: Facets, rule: Rule) -> Samples:
    """The points of a rule on the reference face.

    >>> sample = sampled(slave, (np.array([[0.5]]), np.array([1.0])))
    >>> sample.weight.tolist(), sample.values.tolist(), sample.normal.tolist()
    ([[2.0]], [[0.5, 0.5]], [[[0.0, 1.0]]])
    """
    places, weights = rule
    values, vectors = measured(block, places)
    measure = np.linalg.norm(vectors, axis=2)
    if block.directions is not None:
        vectors = np.einsum("qa,fad->fqd", values, block.directions)
    normal = vectors / np.linalg.norm(vectors, axis=2, keepdims=True)
    return Samples(values=values, weight=measure * weights, normal=normal)
