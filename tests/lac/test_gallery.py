"""The gallery of scripts over scikit-fem: each is run, with its picture, and asserts a number."""

import runpy
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import skfem

from solver.lac import LocalAverageContact
from tests.lac.blocks import FORM, basis_on

ROOT = Path(__file__).resolve().parents[2]


@cache
def run(name, as_program=False):
    given = {"run_name": "__main__"} if as_program else {}
    return runpy.run_path(str(ROOT / "docs" / "examples" / "lac" / f"{name}.py"), **given)


def test_the_example_of_the_patch_test():
    assert run("ex01_patch")["state"].pressure == pytest.approx([25.0] * 6, rel=1e-12)


def test_the_example_of_hertz(capsys):
    space = run("ex02_hertz", as_program=True)
    assert capsys.readouterr().out.startswith("largest pressure 39.29, Hertz: 38.8")
    _, pressure, coarse = space["hertz"](6)
    assert np.log(coarse / space["fine"]) / np.log(10 / 6) > 0.6
    for found in (pressure, space["found"]):
        assert found.max() == pytest.approx(space["P0"], rel=0.02)


@pytest.mark.parametrize("name", ["ex01_patch", "ex02_hertz", "ex03_opening", "ex04_method"])
def test_the_examples_have_pictures(name, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    ax = run(name)["visualize"]()
    assert ax.lines or ax.patches or ax.collections
    lines = (ROOT / f"docs/examples/lac/{name}.py").read_text().count("\n")
    assert lines <= (150 if name == "ex04_method" else 80)


def test_the_example_that_opens_balances_its_forces():
    space = run("ex03_opening")
    assert 0 < space["state"].closed.sum() < 40
    assert space["force"] + space["supports"] == pytest.approx(0.02 * 40, rel=1e-9)


def test_the_method_in_one_file_is_the_package():
    space = run("ex04_method")
    upper, lower = space["upper"], space["lower"]
    contact = LocalAverageContact((upper, "low"), (lower, "high"))
    a, b = basis_on(contact.mesh), basis_on(lower)
    K = skfem.bmat([[FORM.assemble(a), None], [None, FORM.assemble(b)]], "csr")
    top = contact.mesh.facets_satisfying(lambda x: (x[1] == 1.0) & (x[0] < 2.0))
    push = skfem.LinearForm(lambda v, w: -25.0 * v[1])
    f = np.concatenate([push.assemble(a.boundary(top)), b.zeros()])
    held = a.get_dofs("left").all("u^1"), a.N + b.get_dofs("left").all("u^1")
    D = np.concatenate([*held, a.N + b.get_dofs("low").all("u^2")])
    state = contact.solve(K, f, contact.matrix(a, b), D=D)
    assert 0 < state.closed.sum() < 14
    assert state.pressure == pytest.approx(space["pressure"], abs=1e-12 * 25)
