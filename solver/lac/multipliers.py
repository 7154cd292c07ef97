"""Multipliers of a slave surface: what each constraint averages the gap over.

The contact pressure is Σ pᵢ φᵢ, with φᵢ = Σₐ Cₐᵢ Nₐ on each slave face. The LAC method has one
multiplier for each macro-element, φ = 1 there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from .facets import Facets
from .segments import Segments
from .surface_points import Samples

Intersections = Sequence[Segments]
"""Between all pairs of blocks of a slave and a master surface."""


@dataclass(frozen=True, kw_only=True)
class Multipliers:
    """`count` multipliers on blocks of slave faces, k of them on each face.

    By block: `number` (n, k) which; `coefficients` (n or 1, n_nodes, k) of the functions φ that the
    gap is weighted with; `shapes` (n_nodes, k) of the functions that interpolate the pressure, the
    same unless `dual`. `nodes` (count,): the nodes they belong to, None for those of
    macro-elements.
    """

    count: int
    number: list[np.ndarray]
    coefficients: list[np.ndarray]
    shapes: list[np.ndarray]
    nodes: np.ndarray | None = None
    dual: bool = False

    def at(self, block: int, face: np.ndarray, values: np.ndarray) -> np.ndarray:
        """φ (s, q, k) where shape functions of the faces (s,) have the values (s, q, n_nodes)."""
        coefficients = self.coefficients[block]
        return values @ (coefficients if len(coefficients) == 1 else coefficients[face])

    def averages(self, samples: list[Samples], macro: list[np.ndarray], n_macro: int) -> "Averages":
        """Integrals of the interpolating functions over whole macro-elements, `macro` by block."""
        rows, columns, values = [], [], []
        for sample, number, shape, owner in zip(
            samples, self.number, self.shapes, macro, strict=True
        ):
            part = sample.weight @ (sample.values @ shape)
            rows.append(np.repeat(owner, part.shape[1]))
            columns.append(number.ravel())
            values.append(part.ravel())
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        shares = sparse.coo_matrix(entries, shape=(n_macro, self.count)).tocsr()
        area = np.asarray(shares.sum(axis=0)).ravel()
        if self.nodes is None:
            return Averages(area=area, mean=sparse.identity(n_macro, format="csr"))
        whole = np.asarray(shares.sum(axis=1)).ravel()
        return Averages(area=area, mean=(sparse.diags(1 / whole) @ shares).tocsr())


@dataclass(frozen=True, kw_only=True)
class Averages:
    """`area` (count,): ∫ φ of each multiplier; `mean` (m, count): averages over macro-elements."""

    area: np.ndarray
    mean: sparse.csr_matrix


@dataclass(frozen=True, kw_only=True)
class InterfaceData:
    """What multipliers may depend on: slave faces by block, points on them, the intersections."""

    slaves: list[Facets]
    samples: list[Samples]
    found: Intersections
    n_macro: int


Space = Callable[[InterfaceData], Multipliers]


def constants(data: InterfaceData) -> Multipliers:
    """One multiplier for each macro-element, constant on it.

    >>> data = InterfaceData(slaves=[slave], samples=[], found=[], n_macro=1)
    >>> space = constants(data)
    >>> space.count, space.at(0, np.array([0]), np.array([[[0.25, 0.75]]])).tolist()
    (1, [[[1.0]]])
    """
    ones = [np.ones((block.type.n_nodes, 1)) for block in data.slaves]
    number = [block.number[:, None] for block in data.slaves]
    return Multipliers(
        count=data.n_macro, number=number, coefficients=[one[None] for one in ones], shapes=ones
    )
