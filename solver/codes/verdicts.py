"""The verdicts of other codes, and where they are: `results/<family>/<case>@<code>/`.

`verdict.json` as of a solve of ours; `result.vtkhdf` with the fields that the code gives;
`pressure.csv` with the contact pressure by place; `log` is what the code said, written by whoever
runs it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..verification.verdict import Verdict

if TYPE_CHECKING:
    import meshio

    from ..case.model import Case
    from .foreign import ForeignResult

VERDICT, RESULT, PRESSURE, LOG = "verdict.json", "result.vtkhdf", "pressure.csv", "log"


def check_foreign(case: Case, foreign: ForeignResult, mesh: meshio.Mesh | None = None) -> Verdict:
    """The verdict of another code's result: our checks of each quantity that it gives.

    `case` as it was solved (`Case.as_solved`); `mesh` is its mesh, made where it is not given. What
    the result does not give is listed in the verdict's `not_given`. Raises InputError where the
    result does not belong to the case: another unit of length, mirrored, turned, shifted.
    """
    raise NotImplementedError


def store(
    case: Case, foreign: ForeignResult, folder: Path, mesh: meshio.Mesh | None = None
) -> Verdict:
    """Check a result and write verdict, fields and pressures into `folder`; the verdict.

    Raises InputError as `check_foreign` does; then nothing is written.
    """
    raise NotImplementedError


def without_foreign(
    case: Case,
    code: str,
    word: str,
    reason: str,
    *,
    version: str = "",
    settings: Mapping[str, str] | None = None,
    seconds: float | None = None,
) -> Verdict:
    """The verdict of a code that gave no result, for the reason given, to be written by `write`.

    `word`: refused (it cannot express the case, or is not installed), failed (no convergence) or
    crashed (a crash, a hang).
    """
    raise NotImplementedError
