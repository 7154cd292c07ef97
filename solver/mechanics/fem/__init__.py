"""Finite elements on arrays; elements that scikit-fem does not have join the kernel's here."""

from typing import Any

from ...lac.cells.shape import MORE_ELEMENTS


def _wedge() -> Any:
    from .extra_elements import ElementWedgeS2

    return ElementWedgeS2()


def _pyramid(name: str) -> Any:
    from .extra_elements import ElementPyramid

    return ElementPyramid(name)


MORE_ELEMENTS |= {
    "PENTA15": _wedge,
    "PYRA5": lambda: _pyramid("PYRA5"),
    "PYRA13": lambda: _pyramid("PYRA13"),
}
