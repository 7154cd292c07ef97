"""A planted fault: what it is, and what the case that has to notice says of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from solver.case.reader import load_case
from solver.lac.errors import SolveError
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.judge import judge
from solver.verification.run import checked, mesh_of
from solver.verification.verdict import CheckResult
from tests.faults.patches import Wrapped

CASES = Path(__file__).resolve().parents[2] / "cases"


@dataclass(frozen=True)
class Mutant:
    """A planted fault: `patch` makes a faulty function of the true one.

    `place` is module:name in `solver`; `case`: the case of the batch that has to notice.
    """

    name: str
    what: str
    case: str
    place: str
    patch: Callable[[Wrapped], Any]


def checks(case: str) -> dict[str, CheckResult]:
    """The checks of a case of the batch by name."""
    loaded, mesh = _case(case)
    return {check.name: check for check in run_checks(simulate(loaded, mesh))}


def verdict(case: str) -> dict[str, Any]:
    """The verdict of a case of the batch, with its checks and accepted values."""
    loaded, mesh = _case(case)
    try:
        solution = simulate(loaded, mesh)
        found = judge(solution, checked(solution))
        return {"passed": found.passed, "reason": found.reason}
    except (InputError, SolveError) as error:
        return {"passed": False, "reason": str(error)}
    except Exception as error:  # noqa: BLE001 -- the batch's verdict is then `crashed`
        return {"passed": False, "reason": f"crashed: {type(error).__name__}: {error}"}


@cache
def _case(case: str) -> tuple[Any, Any]:
    loaded = load_case(CASES / f"{case}.yaml")
    return loaded, mesh_of(loaded)


@contextmanager
def planted(mutant: Mutant) -> Iterator[None]:
    """The fault is in the program while the block runs."""
    module, name = mutant.place.split(":")
    owner: Any = import_module(f"solver.{module}")
    *path, last = name.split(".")
    for part in path:
        owner = getattr(owner, part)
    faulty = mutant.patch(getattr(owner, last))
    with patch.object(owner, last, faulty):
        yield


def reason(mutant: Mutant) -> str:
    """Why the mutant's case turns red with the fault in the program; empty where it does not."""
    with planted(mutant), np.errstate(all="ignore"):
        found = verdict(mutant.case)
    return "" if found["passed"] else found["reason"]
