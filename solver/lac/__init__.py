"""Frictionless contact by the Local Average Contact (LAC) method, on scikit-fem's own meshes.

`LocalAverageContact` cuts the slave's mesh and assembles the contact of two boundaries; `contact`
documents it. The package is the kernel that the batch verifies. It needs NumPy, SciPy and
scikit-fem, and nothing else of this program. Its files in the order of the method:

- `contact`, `arguments`, `saddle_point`, `meshes`: the interface to scikit-fem
- `cells`: cell types, shape functions, rules
- `cut`: slave cells are cut, so that each macro-element has a node inside
- `facets`: geometry of faces, projection, directions of the gap
- `pairing`, `clipping`, `regions`, `segments`: mortar segments and points on them
- `partners`: the surface that a macro-element meets, and its area
- `multipliers`, `operator`: the gap operator B, its sums as exact as the area
- `friction`: the slip of each macro-element
- `motions`: rigid motions of bodies, and what resists them; `roughness`: the surface behind facets
- `status`: which macro-elements are closed
- `reconstruction`, `recovery`: a pressure of second order

Examples in it use its public names, NumPy as `np`, the catalogue `BY_NAME`, and two surfaces in the
plane: `slave`, one edge of length 2 on y = 0 that faces up, with the nodes 1 and 0 at its ends
(2, 0) and (0, 0); and `master`, two edges of length 1 on y = 1/2 that face down, with the nodes 2,
3, 4 at x = 0, 1, 2. Their coordinates are `points`.
"""

from importlib import import_module
from typing import Any

_PUBLIC = {"ContactState": "contact", "LocalAverageContact": "contact"}
__all__ = ["ContactState", "LocalAverageContact"]


def __getattr__(name: str) -> Any:
    """Load the interface when it is first used: the batch needs cell types without scikit-fem."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_PUBLIC[name]}", __name__), name)
