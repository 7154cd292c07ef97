"""The result file of CalculiX (.frd): values at nodes, by name of the block.

Its lines have fixed columns (manual of CalculiX GraphiX 2.20, "Result Format").
"""

from pathlib import Path

import numpy as np

from ..system.errors import SolveError

_WIDTH, _FIRST = 12, 13


def read_frd(path: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The blocks of the last step by name: numbers of nodes (n,) and values (n, components).

    Raises SolveError where there is no such file, or it breaks off.
    """
    if not path.is_file():
        raise SolveError(f"{path.name}: CalculiX wrote no result file")
    blocks: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    numbers: list[int] = []
    rows: list[list[float]] = []
    name = ""
    try:
        for line in path.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith(" -4"):
                name, numbers, rows = line[5:13].strip(), [], []
            elif line.startswith(" -3") and name:
                blocks[name] = np.array(numbers, dtype=int), np.array(rows)
                name = ""
            elif name and line.startswith(" -1"):
                numbers.append(int(line[3:_FIRST]))
                rows.append(_values(line))
            elif name and line.startswith(" -2"):
                rows[-1] += _values(line)
    except ValueError as error:
        raise SolveError(f"{path.name}: no number where one is due ({error})") from None
    if name:
        raise SolveError(f"{path.name}: breaks off in block {name}")
    return blocks


def _values(line: str) -> list[float]:
    return [float(line[i : i + _WIDTH]) for i in range(_FIRST, len(line.rstrip()), _WIDTH)]
