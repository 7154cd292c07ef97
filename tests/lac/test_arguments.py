"""Arguments of `LocalAverageContact` that do not fit are refused in one line."""

import re

import numpy as np
import pytest
import skfem
from scipy.sparse import diags, eye

from solver.lac import LocalAverageContact
from tests.lac.blocks import FORM, basis_on, block


def good():
    return block(skfem.MeshTri1, 2, 2, 0.0), block(skfem.MeshTri1, 2, 3, 25.0)


def posed(kinds=(skfem.MeshTri1, skfem.MeshTri1)):
    """The arguments of `solve` for two pressed blocks in the plane, and their contact."""
    lower, upper = block(kinds[0], 2, 2, 0.0), block(kinds[1], 2, 3, 25.0)
    contact = LocalAverageContact((upper, "bottom"), (lower, "top"))
    a, b = basis_on(contact.mesh), basis_on(lower)
    K = skfem.bmat([[FORM.assemble(a), None], [None, FORM.assemble(b)]], "csr")
    push = skfem.LinearForm(lambda v, w: -25.0 * v[1])
    held = [a.get_dofs("side0").all("u^1"), a.N + b.get_dofs("side0").all("u^1")]
    held.append(a.N + b.get_dofs("bottom").all("u^2"))
    f = np.concatenate([push.assemble(a.boundary("top")), b.zeros()])
    return contact, {"K": K, "f": f, "B": contact.matrix(a, b), "D": np.concatenate(held)}, (a, b)


def nan_at(array, place):
    changed = np.array(array, dtype=float)
    changed[place] = np.nan
    return changed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda g: {"K": None}, "K = NoneType: must be a matrix"),
        (lambda g: {"K": g["K"][:-1]}, "K: 55 × 56; B has 56 unknowns"),
        (lambda g: {"K": g["K"] * 1j}, "K: must have finite real numbers"),
        (lambda g: {"K": g["K"] * np.nan}, "K: must have finite real numbers"),
        (lambda g: {"K": -g["K"]}, "K: has a negative diagonal"),
        (lambda g: {"K": g["K"] + np.triu(g["K"].toarray())}, "K: must be symmetric"),
        (lambda g: {"K": g["K"] + eye(56)}, "K: resists rigid motions of the slave's body"),
        (lambda g: {"K": g["K"][::-1, ::-1]}, "K: resists rigid motions of the slave's body"),
        (lambda g: {"f": g["f"][:-1]}, "f: 55 of float64; must be 56 real numbers"),
        (lambda g: {"f": g["f"][:, None]}, "f: 56 × 1 of float64; must be 56 real numbers"),
        (lambda g: {"f": nan_at(g["f"], 7)}, "f: number 7 is not finite"),
        (lambda g: {"f": g["f"] * 1j}, "f: 56 of complex128; must be 56 real numbers"),
        (lambda g: {"x": nan_at(g["f"], 3)}, "x: number 3 is not finite"),
        (lambda g: {"B": g["B"].T}, "B: must be the matrix that `matrix` returned"),
        (lambda g: {"B": None}, "B: must be the matrix that `matrix` returned"),
        (lambda g: {"D": np.zeros(56, dtype=bool)}, "D: of bool; must be numbers of unknowns"),
        (lambda g: {"D": [1.0]}, "D: of float64; must be numbers of unknowns"),
        (lambda g: {"D": [56]}, "D: 56 to 56; there are unknowns 0 to 55"),
        (lambda g: {"D": [-1]}, "D: -1 to -1; there are unknowns 0 to 55"),
        (lambda g: {"springs": -eye(56)}, "springs: has a negative diagonal"),
    ],
)
def test_arguments_of_solve_that_do_not_fit_are_refused(change, message):
    contact, given, _ = posed()
    with pytest.raises(ValueError, match="^" + re.escape(message)) as refusal:
        contact.solve(**given | change(given))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("kind", [skfem.MeshTri1, skfem.MeshQuad1])
def test_exchanged_parts_of_the_stiffness_are_refused(kind):
    contact, given, (a, b) = posed((kind, kind))
    parts = [FORM.assemble(b), FORM.assemble(a)]
    K = skfem.bmat([[parts[0], None], [None, parts[1]]], "csr")
    with pytest.raises(ValueError, match=r"K: resists rigid motions of the .*body: its parts"):
        contact.solve(**given | {"K": K})


def test_springs_to_the_ground_are_given_apart():
    """A block on springs: the upper one is held along x by a spring at one node alone."""
    contact, given, (a, _) = posed()
    held = a.get_dofs("side0").all("u^1")
    diagonal = np.zeros(56)
    diagonal[held[0]] = 1e3
    D = np.setdiff1d(given["D"], held)
    with pytest.raises(RuntimeError, match=r"nothing keeps the slave's body .*move along x"):
        contact.solve(**given | {"D": D})
    state = contact.solve(**given | {"D": D, "springs": diags(diagonal)})
    assert state.pressure.mean() == pytest.approx(25.0, rel=1e-12)


@pytest.mark.parametrize(
    ("gap", "message"),
    [
        (np.nan, "gap: number 0 is not finite"),
        (lambda x: np.where(x[0] > 9, np.inf, 0.0), "gap: number .* is not finite"),
        (lambda x: x, "gap: 2 × .*; must be .* real numbers"),
        ("much", "gap: .*; must be .* real numbers"),
    ],
)
def test_gaps_that_are_no_lengths_are_refused(gap, message):
    lower, upper = good()
    with pytest.raises(ValueError, match=message):
        LocalAverageContact((upper, "bottom"), (lower, "top"), gap=gap)


@pytest.mark.parametrize("search", ["far", -1.0, np.nan, True])
def test_a_search_that_is_no_length_is_refused(search):
    lower, upper = good()
    with pytest.raises(ValueError, match=r"search = .*: must be a length, zero or more"):
        LocalAverageContact((upper, "bottom"), (lower, "top"), search=search)


@pytest.mark.parametrize("slave", [None, "bottom", (None, "bottom"), [], "xy"])
def test_a_slave_that_is_no_pair_is_refused(slave):
    lower, upper = good()
    for given in (slave, (upper, []), (upper, None), (upper, [1])):
        with pytest.raises(ValueError, match="slave: must be a pair: a mesh, and the name"):
            LocalAverageContact(given, (lower, "top"))


def test_states_and_bases_that_are_none_are_refused():
    contact, _, (a, _) = posed()
    with pytest.raises(ValueError, match="state = NoneType: must be a ContactState"):
        contact.recover(None)
    with pytest.raises(ValueError, match="master: basis of NoneType"):
        contact.matrix(a, None)


def test_a_body_that_moves_freely_ends_in_one_line():
    contact, given, _ = posed()
    with pytest.raises(RuntimeError, match=r"nothing keeps the .* body from a free motion"):
        contact.solve(**given | {"D": None})
