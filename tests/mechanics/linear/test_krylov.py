"""Conjugate gradients on a matrix with known eigenvalues."""

import numpy as np

from solver.mechanics.linear import krylov


def test_conjugate_gradients_end_after_as_many_steps_as_eigenvalues():
    """With three eigenvalues after three; a start that is exact needs none."""
    diagonal = np.repeat([1.0, 2.0, 5.0], 7)
    exact = np.random.default_rng(1).standard_normal(21)
    about = lambda x: diagonal * x, lambda x: x.copy()
    found, iterations = krylov.conjugate_gradients(*about, diagonal * exact, 1e-13, 9)
    assert iterations == 3
    np.testing.assert_allclose(found, exact, rtol=1e-12)
    nothing = np.zeros(21)
    found, iterations = krylov.conjugate_gradients(*about, nothing, 1e-13, 9)
    assert iterations == 0
    np.testing.assert_array_equal(found, nothing)
