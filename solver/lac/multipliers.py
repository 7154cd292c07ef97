"""Multipliers of a slave surface: what each constraint averages the gap over.

The contact pressure is Σ pᵢ φᵢ, with φᵢ = Σₐ Cₐᵢ Nₐ on each slave face. The LAC method has one
multiplier for each macro-element, φ = 1 there.

Closure makes integrals over segments sum exactly to the integrals over whole faces. The patch test
asks that the contact forces of a uniform pressure be those of that pressure on each whole face,
∫ N_a dS. Sums over segments miss it on faces that are no affine images of their reference face,
since the place of a point on them is then no polynomial of its coordinates. The defect is returned
to the segments such that gaps of linear displacement fields stay exact.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from .cells.faces import FLAT
from .cells.shape import face_rule
from .facets import Facets, measured
from .partners import Samples
from .segments import Segments

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


# A face counts as fully covered when the segments miss less than this share of its area.
_FULL = 1e-11
SLAVE, MASTER = 0, 1


@dataclass(frozen=True, kw_only=True)
class Integrals:
    """Integrals over s segments, with k multipliers φ on each.

    `vectors`: ∫ φ N n dS (s, k, n_nodes, dim) of the slave's and the master's shape functions;
    `gap`, `weight` (s, k): ∫ φ gap dS and ∫ φ dS; `number` (s, k): which multipliers.
    """

    segments: Segments
    number: np.ndarray
    vectors: tuple[np.ndarray, np.ndarray]
    gap: np.ndarray
    weight: np.ndarray


def integrals(space: Multipliers, segments: Segments) -> Integrals:
    """The integrals over segments of one pair of blocks.

    Each master node of the two edges gets half of its length:

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> data = InterfaceData(slaves=[slave], samples=[], found=[segments], n_macro=1)
    >>> part = integrals(constants(data), segments)
    >>> part.vectors[MASTER][..., 1].round(15).tolist(), part.gap.tolist()
    ([[[0.5, 0.5]], [[0.5, 0.5]]], [[0.5], [0.5]])
    """
    side = segments.slave
    functions = space.at(side.index, side.face, side.values)
    weights = segments.weight[..., None] * functions
    measure = weights[..., None] * segments.normal[:, :, None]
    slave, master = (np.einsum("sqa,sqkd->skad", s.values, measure) for s in segments.sides)
    return Integrals(
        segments=segments,
        number=space.number[side.index][side.face],
        vectors=(slave, master),
        gap=np.einsum("sqk,sq->sk", weights, segments.gap),
        weight=weights.sum(axis=1),
    )


def close_faces(parts: Sequence[Integrals]) -> tuple[list[Integrals], int]:
    """Return the defect of ∫ N_a dS on flat, fully covered faces to their segments.

    In proportion to area, and in each segment to the integrals of the multipliers, which sum to
    the area. The defect sums to zero, and so does its first moment, since both integrals are exact
    for linear functions. Also the number of faces treated.

    Edges are affine, where nothing is missing:

    >>> close_faces([])
    ([], 0)
    """
    closed, count = list(parts), 0
    for side in (SLAVE, MASTER):
        blocks = [part.segments.sides[side].index for part in closed]
        for block in sorted(set(blocks)):
            mine = [k for k, index in enumerate(blocks) if index == block]
            seen = [one for k in mine for one in closed[k].segments.sides]
            if not all(one.faces.affine[one.face].all() for one in seen):
                changed, number = _close_block([closed[k] for k in mine], side)
                count += number
                for k, part in zip(mine, changed, strict=True):
                    closed[k] = part
    return closed, count


def _close_block(parts: Sequence[Integrals], side: int) -> tuple[list[Integrals], int]:
    """The same for the faces of one block, given all integrals on it."""
    block = parts[0].segments.sides[side].faces
    n, dim = len(block.number), block.normal.shape[1]
    area, lowest, highest = np.zeros(n), np.ones((n, dim)), -np.ones((n, dim))
    summed = np.zeros((n, block.type.n_nodes))
    for part in parts:
        face, normal = part.segments.sides[side].face, part.segments.normal
        area += np.bincount(face, part.segments.area, minlength=n)
        for axis in range(dim):
            np.minimum.at(lowest[:, axis], face, normal[..., axis].min(axis=1))
            np.maximum.at(highest[:, axis], face, normal[..., axis].max(axis=1))
        np.add.at(summed, face, np.einsum("skad,sd->sa", part.vectors[side], normal[:, 0]))
    # Along one normal, a face is seen by its cosine.
    cosine = np.abs(np.einsum("nd,nd->n", (lowest + highest) / 2, block.normal))
    exact = shape_integrals(block) * cosine[:, None]
    whole = exact.sum(axis=1)
    full = block.flat & (area > 0) & (np.abs(area - whole) <= _FULL * whole)
    full &= (highest - lowest <= FLAT).all(axis=1)
    defect = np.where(full[:, None], exact - summed, 0.0)
    changed = []
    for part in parts:
        face, normal = part.segments.sides[side].face, part.segments.normal[:, 0]
        share = defect[face][:, None] * (part.weight / area[face][:, None])[..., None]
        vectors = list(part.vectors)
        vectors[side] = vectors[side] + share[..., None] * normal[:, None, None]
        changed.append(replace(part, vectors=(vectors[SLAVE], vectors[MASTER])))
    return changed, int(full.sum())


def shape_integrals(block: Facets) -> np.ndarray:
    """∫ N_a dS (n, n_nodes) of flat faces, exact.

    >>> shape_integrals(slave).round(15).tolist()
    [[1.0, 1.0]]
    """
    reference, weights = face_rule(block.type.name)
    values, vectors = measured(block, reference)
    return np.einsum("q,qa,fqd,fd->fa", weights, values, vectors, block.normal, optimize=True)
