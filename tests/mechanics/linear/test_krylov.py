"""Compiled steps of conjugate gradients against NumPy, on any number of threads."""

import numpy as np
import pytest

from solver.lac import threads
from solver.mechanics.linear import krylov


@pytest.mark.parametrize("size", [1, 7, krylov._PART, 20 * krylov._PART + 3])
def test_each_pass_is_that_of_numpy(size, monkeypatch):
    rng = np.random.default_rng(0)
    x, r, d, q = rng.standard_normal((4, size))
    assert krylov.product(d, q) == pytest.approx(d @ q, abs=1e-12 * size)
    exact = [(r @ (d - q)), r @ d]
    found = krylov._summed(krylov._of_change, 2, r, d, q)
    np.testing.assert_allclose(found, exact, atol=1e-12 * size)
    found = []
    for count in (1, 2, 5):
        for module in (krylov, threads):
            monkeypatch.setattr(module, "workers", lambda n=count: n)
        solution, left, turned = x.copy(), r.copy(), d.copy()
        square = krylov._summed(krylov._advance, 1, solution, left, d, q, 0.3)
        krylov._shared(krylov._turn, turned, -0.7, q)
        sums = krylov._summed(krylov._of_change, 2, r, d, q)
        found.append(np.concatenate([solution, left, turned, square, sums]))
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])
    np.testing.assert_allclose(solution, x + 0.3 * d, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(left, r - 0.3 * q, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(turned, q - 0.7 * d, rtol=1e-14, atol=1e-14)
    assert square == pytest.approx(left @ left, rel=1e-12)


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
