"""Views of the cases in which they differed once, and of a few random ones."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from solver.lac import reconstruction
from solver.lac.cells import faces
from solver.lac.errors import SolveError
from solver.mechanics.linear import condensation
from solver.mechanics.mortar.coulomb import CoulombContact
from solver.simulation.equilibrium import (
    accuracy,
    contact_stiffness,
    friction,
    friction_recovery,
    recovery,
)
from solver.simulation.equilibrium.contacts import Contacts
from solver.simulation.equilibrium.friction import Search
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.judgement import facet_gaps, validity
from solver.simulation.results.balance import strain_energy
from solver.simulation.scene.attributes import Attributes
from solver.verification import scatter

from .cases import FOUND, drawn, word_of
from .judge import compared

# `make views` compares all of them.
SOME = list(FOUND)[::3]
# Each solves in a fraction of a second, in five views.
DRAWN = range(100, 109)


@pytest.mark.parametrize("name", SOME)
def test_a_view_that_differed_once_is_the_same_now(name):
    word, differences = compared(FOUND[name])
    assert not differences
    assert word == word_of(FOUND[name])


@pytest.mark.parametrize("seed", DRAWN)
def test_random_cases_have_one_answer_in_all_views(seed):
    word, differences = compared(drawn(seed))
    assert not differences
    assert word in ("solved", "unreliable", "refused")


def frames_apart(matrix, normal):
    """Components of tractions are taken from neighbours as they are, whatever their frames."""
    return sparse.csr_matrix(sparse.block_diag([matrix] * (normal.shape[1] - 1)))


def by_column(system, _d, _form):
    """Each function has a scale of its own, which depends on the axes."""
    size = np.linalg.norm(system, axis=1)
    return np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)[:, None] * np.eye(
        system.shape[2]
    )


def from_anywhere(prepared):
    """The search for the status of contact that gives way starts from a guess."""

    def init(self, *scene):
        prepared(self, *scene)
        self._gives_way = False

    return init


def no_rest(search, _at_work, _correction):
    raise SolveError(search._why_none())


def by_rounding(true):
    """Facets are judged by pressures that are rounding."""
    return lambda problem, states: true(problem, [_known(state) for state in states])


def _known(state):
    trial = replace(state.trial, pressure_limit=np.zeros_like(state.pressure))
    return replace(state, trial=trial)


def forgotten(_given, _before):
    """A recovered pressure with friction does not go on from the last step."""
    return [None]


def of_all(problem, state, pushed):
    """Contact closes by the strain energy of all bodies, over all of its force."""
    force = pushed[problem.constraints.normal].sum()
    return np.full(len(pushed), 2 * strain_energy(state) / force if force > 0 else 0.0)


def together(made):
    """All contacts are one: none rests while another one rubs."""
    return lambda contacts, whole, group: made(contacts, whole, np.zeros_like(group))


def deforming(groups):
    """Rigid bodies have the material that the case gives to all."""
    return ((group, each) for group, each in groups.case.materials.items() if group != "all")


def alone(solve):
    """The state of contact that rests is sought where no friction holds anything else."""

    def without(problem, step, start=None, _imposed=None, correction=0.0, before=None):
        return solve(problem, step, start, None, correction, before)

    return without


def all_or_none(_problem, zones, recover):
    """No pressure is recovered where that of one contact does not settle."""
    return recover(zones)


def all_that_touch(seen, among):
    """All gaps that touch hold a body that nothing presses."""
    return among & (seen.shape[1] > 0)


def stays(_search, jump, _slips, _seen):
    """Where no gap holds a body, some of its faces do not slip: which ones, rounding chooses."""
    return np.zeros_like(jump)


PLANTED = {
    "memory": (friction_recovery, "_starts", forgotten),
    "shrunk": (validity, "facets_of", by_rounding(facet_gaps.facets_of)),
    "frames": (friction_recovery, "of_tractions", frames_apart),
    "columns": (reconstruction, "_scale", by_column),
    "kink": (reconstruction, "SAME_SIDE", np.cos(np.radians(30))),
    "pivots": (condensation, "_GOOD_PIVOT", 1e-6),
    "rest": (Search, "_resting", no_rest),
    "smooth": (CoulombContact, "_from_smooth", lambda _contact, _start: None),
    "lifts": (contact_stiffness, "_LEAST", 0.0),
    "stabilised": (ContactProblem, "__init__", from_anywhere(ContactProblem.__init__)),
    "settled": (recovery, "MOST_SWEEPS", 3),
    "apart": (facet_gaps, "_closing", of_all),
    "touching": (Contacts, "__init__", together(Contacts.__init__)),
    "bare": (Attributes, "_materials", deforming),
    "rounded": (faces, "FLAT", 1e-15),
    "soft": (ContactProblem, "gives_way_where", lambda _problem, _pressed: False),
    "cooled": (facet_gaps, "_closing", of_all),
    "idle": (scatter, "LITTLE", 0.0),
    "sideways": (accuracy, "LITTLE", 0.0),
    "held": (ContactProblem, "solve", alone(ContactProblem.solve)),
    "settles": (friction_recovery, "by_contact", all_or_none),
    "loosened": (friction, "holding", all_that_touch),
    "set_down": (Search, "_back", stays),
}


# What these faults do depends on rounding, so on the processor: seeds of cases that show them too.
OTHERS = {"lifts": [24, 34, 39], "shrunk": [128], "touching": [686]}


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_fault_shows_in_a_view(monkeypatch, name):
    monkeypatch.setattr(*PLANTED[name])
    cases = [*map(drawn, OTHERS.get(name, [])), FOUND[name]]
    seen = (compared(case, most=1) for case in cases)
    assert any(differences or word == "no solution" for word, differences in seen)
