"""The provenance of a result: versions, revision, hashes of its inputs, machine and time."""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..lac.threads import cores
from ..system.package import PACKAGE, PROJECT, in_project, project_version

PACKAGES = ("numpy", "scipy", "scikit-fem", "meshio", "h5py", "gmsh")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def gather(case: Path, mesh: Path | None) -> dict[str, str | int]:
    """Provenance of a solve: plain texts and numbers, empty if unknown.

    `case` and `mesh` are the files that were read; `mesh` is None where it was made in memory.
    """
    return {
        **versions(),
        "command": shlex.join(_command()),
        "revision": _revision(),
        "case_sha256": _sha256(case),
        "mesh_sha256": _sha256(mesh),
        "cpu": _cpu(),
        "cores": cores(),
        "threads": next((os.environ[name] for name in _THREADS if name in os.environ), ""),
        "platform": platform.platform(),
        "time_utc": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def versions() -> dict[str, str]:
    """The versions of Python, of this project and of the packages that results depend on."""
    packages = {package: _version(package) for package in PACKAGES}
    return {"python": platform.python_version(), PROJECT: project_version()} | packages


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _command() -> list[str]:
    """The command as a user types it, without the options that the batch adds (warm.py)."""
    if Path(sys.argv[0]).name == PROJECT:
        return [PROJECT, *sys.argv[1:]]
    if Path(sys.argv[0]).name == "__main__.py":
        return ["python", "-m", PACKAGE, *sys.argv[1:]]
    return ["python", *sys.orig_argv[1:]]


@cache
def _revision() -> str:
    """The git revision of the project, marked where files differ from it; empty if installed."""
    if not in_project():
        return ""
    command = ["git", "describe", "--always", "--abbrev=12", "--dirty"]
    try:
        done = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=5
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _sha256(path: Path | None) -> str:
    if path is None or not path.is_file():
        return ""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@cache
def _cpu() -> str:
    """The processor's name; Linux has it in a file only."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())
