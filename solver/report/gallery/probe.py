"""Whether VTK can draw here, tried in a process of its own: without OpenGL it may die of it.

`python -m solver.report.gallery.probe` draws a box, and says with what.
"""

import os
import re
import signal
import subprocess
import sys
from importlib.util import find_spec

_WINDOW, _OSMESA = "VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow"
# The first start of a graphics driver may take its time.
_SECONDS = 120.0


def set_up() -> str:
    """Find a way for PyVista to draw here; returns why there is none, in one line, else nothing.

    VTK finds a screen's OpenGL and EGL by itself. OSMesa has to be named in the environment, which
    is done here where it is what works.
    """
    if find_spec("pyvista") is None:
        return "PyVista is not installed (make gallery installs it)"
    reason = _attempt({})
    if reason and _WINDOW not in os.environ and not _attempt({_WINDOW: _OSMESA}):
        os.environ[_WINDOW] = _OSMESA
        return ""
    return reason


def _attempt(setting: dict[str, str]) -> str:
    """Why a picture could not be drawn with these settings of the environment."""
    command = [sys.executable, "-m", __name__]
    try:
        run = subprocess.run(
            command, capture_output=True, text=True, timeout=_SECONDS, env={**os.environ, **setting}
        )
    except subprocess.TimeoutExpired:
        return f"VTK has drawn nothing within {_SECONDS:.0f} s"
    if run.returncode == 0:
        return ""
    ending = f"status {run.returncode}"
    if run.returncode < 0:
        ending = signal.Signals(-run.returncode).name
    lines = re.sub(r"\x1b\[[\d;]*m", "", run.stderr).split("\n")
    said = [line.rpartition("| ")[2].strip() for line in lines if line.strip()]
    return f"VTK finds no OpenGL here ({': '.join([ending, *said[-1:]])})"


def main() -> None:
    """Draw a red box before white; exits with a line that says what came of it, if not that."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=[40, 40])
    plotter.set_background("white")
    plotter.add_mesh(pyvista.Box(), color="red", lighting=False)
    image = plotter.screenshot(None, return_img=True)
    plotter.close()
    if image[20, 20].tolist() != [255, 0, 0] or image[0, 0].tolist() != [255, 255, 255]:
        sys.exit("nothing was drawn")


if __name__ == "__main__":
    main()
