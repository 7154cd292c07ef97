"""GetFEM: the plain input, and a script that solves it in the system's Python.

Contact is integrated over the slave's faces, by the augmented Lagrangian of Alart and Curnier
(Comput. Methods Appl. Mech. Engrg. 92, 1991), with multipliers on these faces. Rays along their
normals find the master. GetFEM's contact brick for nonmatching meshes is not used: it pairs points
only where the gap is below 5 % of the size of a master cell (getfem_projected_fem.cc).
"""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..lac.errors import SolveError
from ..system.errors import InputError
from ..system.process import printed_by
from .deck import Deck, UnsupportedError, refuse_rings
from .files.read import read_result_files
from .foreign import ForeignResult
from .plain import Plain

PYTHON = Path("/usr/bin/python3")
CELLS = ("TRIA3", "TRIA6", "QUAD4", "QUAD8", "TETRA4", "TETRA10", "HEXA8", "HEXA20")
_VERSION = "import getfem, subprocess; print(subprocess.check_output(['dpkg-query', '-Wf', "
_VERSION += "'${Version}', 'python3-getfem'], text=True).partition('+')[0])"


class GetFEM(Plain):
    """Write, run and read; see `solver.codes.run`."""

    name = "getfem"
    install = "Debian has it as python3-getfem"
    gave_up = r"GetFEM: no convergence[^\n]*"
    settings: Mapping[str, str] = {
        "contact": "raytracing, integrals of the augmented Lagrangian, E / size of a face",
        "integration": "order 6 on 4 parts of each edge of the slave's faces",
        "multipliers": "on the slave's faces, of order 1",
    }

    def version(self) -> str:
        """The version of Debian's package; empty if it is not installed."""
        return printed_by(PYTHON, "-Es", _VERSION)

    def write(self, deck: Deck, folder: Path) -> None:
        """Write `deck.json` and the script; UnsupportedError for what they lack."""
        refuse_rings(deck, "GetFEM")
        for name in deck.cells:
            if name not in CELLS:
                raise UnsupportedError(f"{name}: not written for GetFEM")
        if len(deck.pairs) != 1:
            raise UnsupportedError("more or less than one contact zone: not written for GetFEM")
        super().write(deck, folder)
        shutil.copyfile(Path(__file__).with_name("getfem_main.py"), folder / "main.py")

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002
        """The command to run in `folder`."""
        return [str(PYTHON), "-Es", "main.py"]

    def read(self, deck: Deck, folder: Path) -> ForeignResult:  # noqa: ARG002
        """The fields at the end; SolveError without a result."""
        names = ("displacement", "stress", "pressure")
        try:
            return read_result_files([folder / f"{n}.csv" for n in names], code=self.name)
        except InputError as error:
            raise SolveError(f"its results: {error}") from None
