"""The stress at the integration points of all cells by Hooke's law, as samples for a check.

It follows from the displacement, less initial strains, without extrapolation to nodes and averages.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import meshio
import numpy as np

from ..case.expressions import evaluate
from ..lac.cells.catalogue import cell_type
from ..lac.threads import prefetch
from ..mechanics.fem.block import volume_rule
from ..mechanics.fem.elasticity import lame_parameters
from ..mechanics.fem.stress import COMPONENTS
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution
from ..simulation.scene.groups import ALL
from ..simulation.scene.parts.strain import strain_in
from .in_cells import deformable_parts, in_cells
from .samples import Reference, Sample


def integration_stress(solution: Solution, _: None, reference: Reference) -> Sample:
    """The given components, in what decides a check.

    Of each chunk of cells this is the extreme values, and the largest reference and deviation.
    """
    names = COMPONENTS if isinstance(reference, ExactValues) else tuple(reference)

    def decisive(chunk: tuple[np.ndarray, ...]) -> list[tuple[np.ndarray, ...]]:
        place, stress, node, cell = chunk
        if isinstance(reference, ExactValues):
            expected = reference.exact.stress(place, reference.part[node]).T
        else:
            expected = np.stack([evaluate(reference[name], place) for name in names])
        found: list[tuple[np.ndarray, ...]] = []
        for name, wanted in zip(names, expected, strict=True):
            values = stress[:, COMPONENTS.index(name)]
            worst = np.abs(values - wanted).argmax(), np.abs(wanted).argmax()
            kept = np.unique([values.argmin(), values.argmax(), *worst])
            found.append((values[kept], wanted[kept], cell[kept]))
        return found

    by_name = zip(*map(decisive, _by_hooke(solution)), strict=True)
    listed = [
        (name, *found) for name, chunks in zip(names, by_name, strict=True) for found in chunks
    ]
    places = [(cell, name) for name, _, _, cells in listed for cell in cells]
    return Sample(
        np.concatenate([values for _, values, _, _ in listed]),
        np.concatenate([expected for _, _, expected, _ in listed]),
        lambda i: "cell {} ({})".format(*places[i]),
    )


def _by_hooke(solution: Solution) -> Iterator[tuple[np.ndarray, ...]]:
    """By chunk of deformable cells, at their k integration points in all: place, stress, owner.

    Place (k, dim), stress (k, 6), and of the cell: its first node (k,) and its number (k,).
    """
    first = 0
    for number, block in enumerate(solution.mesh.cells):
        found_in = partial(_stress_in, solution, number, first, _material(solution, number))
        yield from prefetch(found_in, deformable_parts(solution, block, len(_points(block))))
        first += len(block.data)


def _points(block: meshio.CellBlock) -> np.ndarray:
    return volume_rule(cell_type(block.type).name)[0]


def _stress_in(
    solution: Solution, number: int, first: int, elastic: np.ndarray, part: np.ndarray
) -> tuple[np.ndarray, ...]:
    """See `_by_hooke`: a part of the cells of a block, its first cell numbered `first`."""
    block = solution.mesh.cells[number]
    at = in_cells(solution, block, part, _points(block))
    dim, place = at.slope.shape[-1], at.place.reshape(-1, at.place.shape[-1])
    lame, shear = (each[:, None] for each in lame_parameters(*elastic[part].T))
    initial = np.zeros((*at.slope.shape[:2], 6))
    if any(load.strains for load in solution.case.loads):
        sets = {name: of_blocks[number] for name, of_blocks in solution.mesh.cell_sets.items()}
        initial = strain_in(solution.case, sets, part, place).reshape(initial.shape)
    mean = lame * (np.einsum("cqii->cq", at.slope) - initial[..., :3].sum(axis=-1))
    if at.mean is not None:
        mean = np.where(np.isnan(at.mean), mean, at.mean)
    tensor = np.zeros((*mean.shape, 3, 3))
    tensor[..., :dim, :dim] = at.slope + np.swapaxes(at.slope, 2, 3)
    tensor = shear[..., None, None] * tensor + mean[..., None, None] * np.eye(3)
    if solution.case.thin:
        tensor[..., 2, 2] = 0.0
    stress = tensor[..., [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    stress = (stress - 2 * shear[..., None] * initial).reshape(-1, 6)
    owners = block.data[part, 0], first + part
    return place, stress, *(np.repeat(each, mean.shape[1]) for each in owners)


def _material(solution: Solution, block: int) -> np.ndarray:
    """Young's modulus and Poisson's ratio (n, 2) of the cells of a block."""
    given = solution.case.materials
    start = (given[ALL].young, given[ALL].poisson) if ALL in given else (1.0, 0.0)
    found = np.repeat([start], len(solution.mesh.cells[block].data), axis=0)
    for group in given.keys() - {ALL}:
        members = np.asarray(solution.mesh.cell_sets[group][block], dtype=int)
        found[members] = given[group].young, given[group].poisson
    return found
