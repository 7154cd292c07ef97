"""The virtual environment `.venv`: made, filled from hash-locked files, and stamped with them."""

from __future__ import annotations

import hashlib
import json
import platform
import subprocess
import sys
import time
from pathlib import Path

from errors import InstallError

ROOT = Path(__file__).resolve().parents[2]
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
STAMP = VENV / "installed.json"


def lock_file(group: str) -> Path:
    """Path of a group's lock file."""
    name = "requirements.txt" if group == "run" else f"requirements-{group}.txt"
    if not (ROOT / name).is_file():
        raise InstallError(f"there is no group {group!r}: {name} is not in {ROOT}")
    return ROOT / name


def digest(group: str) -> str:
    """Hash of a group's lock file."""
    return hashlib.sha256(lock_file(group).read_bytes()).hexdigest()


def installed() -> dict:
    """Return what the stamp says: the interpreter, the groups with their hashes."""
    try:
        stamp = json.loads(STAMP.read_text())
    except (OSError, ValueError):
        return {"groups": {}}
    same = stamp.get("python") == interpreter() and PYTHON.exists()
    return stamp if same else {"groups": {}}


def interpreter() -> str:
    """Name the interpreter an environment is made for: another one makes it stale."""
    return f"{platform.python_implementation()} {platform.python_version()} {sys.platform}"


def wanted(groups: list[str]) -> dict[str, str]:
    """Hashes of the groups to have: those asked for, and those there already that still exist."""
    kept = [name for name in installed()["groups"] if (ROOT / f"requirements-{name}.txt").is_file()]
    return {name: digest(name) for name in ("build", "run", *groups, *kept)}


def current(groups: dict[str, str]) -> bool:
    """Tell whether exactly these groups are installed from exactly these lock files."""
    return installed()["groups"] == groups


def complete() -> bool:
    """Tell whether the system libraries have been seen to as well."""
    return bool(installed().get("complete"))


def install(groups: dict[str, str]) -> None:
    """Make the environment if need be and install the groups' packages into it."""
    start = time.monotonic()
    before = installed()["groups"]
    if not before or not before.keys() <= groups.keys():
        make()
    locks = [lock_file(group) for group in groups if group != "build"]
    print(f"Installing {', '.join(lock.name for lock in locks)} into .venv …", flush=True)
    pip([lock_file("build")], ["--only-binary", ":all:"])
    # One package is published as source only; it is built with the tools just installed.
    source = ["--no-binary", "connection-pool", "--no-build-isolation"]
    pip(locks, ["--only-binary", ":all:", *source])
    compile_bytecode()
    print(f"Packages installed ({time.monotonic() - start:.0f} s)", flush=True)


def pip(locks: list[Path], options: list[str]) -> None:
    """Install the packages of lock files with pip."""
    command: list[str | Path] = [PYTHON, "-m", "pip", "install", "--quiet"]
    command += ["--disable-pip-version-check", "--no-input", "--no-compile"]
    command += ["--no-cache-dir"]
    command += ["--require-hashes", *options]
    for lock in locks:
        command += ["--requirement", lock]
    if subprocess.run(command).returncode:
        raise InstallError("pip could not install the packages (its reason stands above)")


def make() -> None:
    """Make an empty environment; what an old one held is removed."""
    try:
        import ensurepip  # noqa: F401  Debian ships Python without it
        import venv
    except ImportError:
        raise InstallError(
            f"{sys.executable} cannot make virtual environments: install your system's package "
            "for it (on Debian and Ubuntu python3-venv) and run make again"
        ) from None
    venv.create(VENV, clear=True, with_pip=True, symlinks=True)


def share() -> None:
    """Let the environment's Python import the project from any folder: it runs in place."""
    for packages in VENV.glob("lib/python*/site-packages"):
        known = packages / "mortarcheck.pth"
        if not known.is_file() or known.read_text() != f"{ROOT}\n":
            known.write_text(f"{ROOT}\n")


def compile_bytecode() -> None:
    """Compile every package on all cores: otherwise each start of Snakemake pays for it."""
    # Packages hold templates and samples that are no valid Python: the status says nothing.
    subprocess.run([PYTHON, "-m", "compileall", "-q", "-q", "-j", "0", VENV / "lib"])


def keep_scripts() -> None:
    """Keep the script of all charts in the environment: otherwise each first report makes it."""
    if not (VENV / "share" / "mortarcheck" / "vega.js").is_file():
        code = "from solver.report.charts import keep_libraries; keep_libraries()"
        subprocess.run([PYTHON, "-Es", "-c", code], cwd=ROOT)


def stamp(groups: dict[str, str], complete: bool = False) -> None:
    """Write down what has been installed, when it has been."""
    content = {"python": interpreter(), "groups": groups, "complete": complete}
    STAMP.write_text(json.dumps(content, indent=1) + "\n")
