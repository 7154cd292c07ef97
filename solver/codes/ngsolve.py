"""NGSolve: the plain input, and a script that solves it in an environment of its own.

Contact is its class `ContactBoundary`: an energy of the overlap at points of the slave's faces.
Each point is paired with the closest one of the master.
"""

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..lac.cells.catalogue import cell_type
from ..lac.errors import SolveError
from ..system.process import printed_by
from .deck import Deck, UnsupportedError, face_size, refuse_rings
from .foreign import Field, ForeignResult
from .plain import FILE, Plain, content

PYTHON = Path(__file__).resolve().parents[2] / ".venv-ngsolve/bin/python"
LINEAR = ("TRIA3", "QUAD4", "TETRA4", "PENTA6", "HEXA8")
QUADRATIC = ("TRIA6", "TETRA10")
# Pressure by overlap, over Young's modulus by the size of a slave face.
STIFFNESS = 2.5e4
# How far from the middle of its edge, over the size of the mesh, a node is still in the middle.
_STRAIGHT = 1e-9
_VERSION = "import importlib.metadata as m; print(m.version('ngsolve'))"


class NGSolve(Plain):
    """Write, run and read; see `solver.codes.run`."""

    name = "ngsolve"
    install = "make code-environment CODE=ngsolve"
    gave_up = r"NGSolve: no convergence[^\n]*"
    settings: Mapping[str, str] = {
        "contact": f"ContactBoundary, penalty energy, {STIFFNESS:g} E / face size, "
        "integration of order 20",
        "elements": "H1 of order 1 or 2; geometry not updated",
    }

    def version(self) -> str:
        """The version; empty if it is not installed."""
        return printed_by(PYTHON, "-I", _VERSION)

    def write(self, deck: Deck, folder: Path) -> None:
        """Write `deck.json` and the script; UnsupportedError for what they lack."""
        _refuse(deck)
        text = json.dumps(content(deck) | {"stiffness": STIFFNESS * deck.softest / face_size(deck)})
        (folder / FILE).write_text(text, encoding="ascii")
        shutil.copyfile(Path(__file__).with_name("ngsolve_main.py"), folder / "main.py")

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002
        """The command to run in `folder`."""
        return [str(PYTHON), "-I", "main.py"]

    def read(self, deck: Deck, folder: Path) -> ForeignResult:
        """The fields at the end; SolveError without a result."""
        try:
            found = json.loads((folder / "result.json").read_text(encoding="ascii"))
        except (OSError, ValueError):
            raise SolveError("NGSolve: it wrote no result") from None
        names = ("displacement", "stress", "pressure")
        displacement, stress, pressure = (np.array(found[name]) for name in names)
        if deck.points.shape[1] == 2:
            stress = deck.of_plane_strain(stress)
        nodes, slave = np.arange(len(deck.points)), pressure[:, 0].astype(int)
        return ForeignResult(
            code=self.name,
            displacement=Field(places=deck.points, values=displacement, nodes=nodes),
            stress=Field(places=deck.points, values=stress, nodes=nodes),
            pressure=Field(places=deck.points[slave], values=pressure[:, 1], nodes=slave),
            step=deck.case.factors[-1],
        )


def _refuse(deck: Deck) -> None:
    refuse_rings(deck, "NGSolve")
    straight = deck.points.copy()
    for name, cells in deck.cells.items():
        if name not in LINEAR + QUADRATIC:
            raise UnsupportedError(f"{name}: not written for NGSolve")
        cell_type(name).put_between(straight, cells)
    if np.abs(straight - deck.points).max() > _STRAIGHT * np.ptp(deck.points):
        raise UnsupportedError("curved sides of cells: not written for NGSolve")
    if len({name in LINEAR for name in deck.cells}) == 2:
        raise UnsupportedError("linear and quadratic cells in one mesh: not written for NGSolve")
    if deck.oblique:
        raise UnsupportedError("supports across the axes: NGSolve's space holds components")
