"""Runs of codes end with a verdict, whatever becomes of them."""

import sys

import numpy as np
import pytest

from solver.codes.deck import UnsupportedError
from solver.codes.foreign import Field, ForeignResult
from solver.codes.run import Limits, run_case
from solver.lac.errors import SolveError
from solver.verification.stored import read_verdict
from tests.codes.blocks import case_of


class Fake:
    """A code whose process is a line of Python."""

    name = "fake"
    layer = False
    follows = False
    install = "make fake"
    gave_up = "no luck at .*"
    settings = {"penalty": "50 E"}  # noqa: RUF012

    def __init__(self, text="", installed="1.0"):
        self.text, self.installed = text, installed

    def version(self):
        return self.installed

    def write(self, deck, folder):
        if self.text == "refuse":
            raise UnsupportedError("PYRA5: no such element")

    def command(self, folder):
        return [sys.executable, "-c", self.text]

    def read(self, deck, folder):
        if self.text == "pass":
            raise SolveError("no result file")
        if self.text == "0":
            raise ValueError("its own fault")
        # The exact pressure, but for the factor that the text prints.
        places = deck.points[np.unique(deck.pairs[0].slave[0].nodes)]
        values = np.full(len(places), float(self.text.removeprefix("print(").rstrip(")")))
        return ForeignResult(code=self.name, pressure=Field(places=places, values=values))


def run(tmp_path, *arguments, **limits):
    case, mesh = case_of("QUAD4", "QUAD4")
    verdict = run_case(Fake(*arguments), case, mesh, tmp_path / "out", Limits(**limits))
    stored = read_verdict(tmp_path / "out/verdict.json")
    assert (stored.verdict, stored.reason) == (verdict.verdict, verdict.reason)
    assert (verdict.foreign.code, verdict.foreign.settings) == ("fake", {"penalty": "50 E"})
    return verdict


@pytest.mark.parametrize(
    ("text", "word", "reason"),
    [
        ("refuse", "refused", "PYRA5: no such element"),
        ("raise SystemExit('boom')", "crashed", "exit status 1: boom"),
        ("import os; os.kill(os.getpid(), 11)", "crashed", "exit status -11"),
        ("import time; time.sleep(60)", "crashed", "no end within 1 s"),
        ("bytearray(400_000_000)", "crashed", "MemoryError"),
        ("print('no luck at step 3')", "failed", "no convergence: no luck at step 3"),
        ("pass", "failed", "no result file"),
        ("0", "crashed", "ValueError: its own fault"),
    ],
)
def test_no_result_is_a_verdict_with_its_reason(tmp_path, text, word, reason):
    verdict = run(tmp_path, text, seconds=1, memory=200e6)
    assert (verdict.verdict, verdict.passed) == (word, False)
    assert reason in verdict.reason
    assert verdict.foreign.code_version == "1.0"


def test_a_code_that_is_not_installed(tmp_path):
    verdict = run(tmp_path, "", "")
    assert (verdict.verdict, verdict.reason) == ("refused", "not installed: make fake")


@pytest.mark.parametrize(("value", "word"), [("25.0", "passed"), ("25.5", "failed")])
def test_a_result_is_checked(tmp_path, value, word):
    verdict = run(tmp_path, f"print({value})")
    assert verdict.verdict == word
    assert verdict.cost.seconds["total"] > 0
    assert (tmp_path / "out/log").read_text() == f"{value}\n"


class PlaneStrain(Fake):
    """Stress of the equivalent plane strain: zz = -25 ν/(1 + ν)."""

    def read(self, deck, folder):
        stress = np.tile([0.0, -25.0, -25 * 0.3 / 1.3, 0.0, 0.0, 0.0], (len(deck.points), 1))
        nodes = np.arange(len(stress))
        return ForeignResult(
            code=self.name, stress=Field(places=deck.points, values=stress, nodes=nodes)
        )


@pytest.mark.parametrize(("plane", "word"), [("stress", "passed"), ("strain", "failed")])
def test_plane_stress_has_none_across_the_plane(tmp_path, plane, word):
    reference = {"kind": "analytical", "stress": {"yy": -25.0, "zz": 0.0}}
    case, mesh = case_of("QUAD4", "QUAD4", plane=plane, reference=reference)
    verdict = run_case(PlaneStrain("pass"), case, mesh, tmp_path, Limits())
    assert (verdict.verdict, [c.name for c in verdict.checks]) == (word, ["stress_components"])
