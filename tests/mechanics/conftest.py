import pytest

from solver.lac.errors import SolveError
from solver.mechanics.multigrid.multigrid import Multigrid


@pytest.fixture
def gave_up(monkeypatch):
    """Multigrid that always gives up; the list of those that did."""
    tried = []

    def give_up(self, right, accuracy):
        tried.append(self)
        raise SolveError("conjugate gradients leave a residual of 1e-02 in 50 iterations")

    monkeypatch.setattr(Multigrid, "solve", give_up)
    return tried
