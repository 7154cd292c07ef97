"""Initial strain in one cell of each type: it is the strain of a linear field, by other routes."""

import numpy as np
import pytest

from solver.mechanics.fem.elasticity import internal_force
from solver.mechanics.fem.loads import strain_loads
from solver.mechanics.fem.mixed import split
from solver.mechanics.fem.stress import COMPONENTS, nodal_stress
from tests.mechanics.fem.test_mixed import VOLUMES, one_cell


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("name", VOLUMES)
def test_a_linear_field_of_that_strain_is_in_equilibrium_without_stress(name, mixed):
    """In mixed form with s = 0; twice the strain has twice the force, four times the energy."""
    points, block = one_cell(name)
    slope = np.random.default_rng(1).normal(size=points.shape[1:] * 2)
    tensor = np.zeros((3, 3))
    tensor[: len(slope), : len(slope)] = (slope + slope.T) / 2
    given = np.array([tensor["xyz".index(a), "xyz".index(b)] for a, b in COMPONENTS])

    def strains(block):
        shape = (len(block.cells), len(block.rule[1]))
        return np.stack([np.broadcast_to(f * given, (*shape, 6)) for f in (1.0, 2.0)])

    blocks, mean = split(points, [block], [np.array([mixed])], [np.array([0])])
    found, field = strain_loads(points, blocks, strains, 2), points @ slope.T
    force = internal_force(points, blocks, field)
    scale = 1e-12 * np.abs(force).max()
    assert found.force == pytest.approx(np.stack([force, 2 * force]), abs=scale)
    stress = nodal_stress(points, blocks, field)
    assert found.stress == pytest.approx(np.stack([stress, 2 * stress]), abs=1e-12)
    energy = (force * field).sum()
    assert found.energy.sum(axis=0) == pytest.approx(energy * np.array([[1, 2], [2, 4]]), rel=1e-11)
    opened = mean.divergence @ field.ravel()
    swelling = mean.integrals(points, lambda block: strains(block)[..., :3].sum(axis=-1), 2)
    assert swelling == pytest.approx(np.stack([opened, 2 * opened]), abs=1e-12)
