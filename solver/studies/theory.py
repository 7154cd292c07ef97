"""Orders of convergence by theory.

The LAC method on cells of degree one or two has a multiplier that is constant on each macro-element
(Drouet, Hild, Numer. Math. 136 (2017) 467–502): the error of the displacement in H1 falls with
order 1 or 1.5 at least, in L2 with one more; where the solution is smooth, it may reach what
interpolation allows, 2 in H1 and 3 in L2 for degree two. The pressure error in L2 falls with order
0.5 or 1 at least; 1 is the most that a piecewise constant can show. Its values at the means of
macro-elements have no such bound. A pressure recovered from the constants is a polynomial of degree
one or two, of order two or three where the solution is smooth and its means are as exact.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Order:
    """The order guaranteed, and the best there can be (None: not known)."""

    least: float | None
    best: float | None

    def __str__(self) -> str:
        """Both, or the one that is known."""
        if self.least is None or self.best is None:
            bounds = [
                f"{sign} {v:g}"
                for sign, v in (("≥", self.least), ("≤", self.best))
                if v is not None
            ]
            return f"theory {bounds[0] if bounds else '–'}"
        return "theory " + " … ".join(dict.fromkeys(f"{v:g}" for v in (self.least, self.best)))


UNKNOWN = Order(None, None)
# The best order of a recovered pressure, by form of the recovery and degree of the cells.
RECOVERED = {
    ("linear", "quadratic"): 2.0,
    ("quadratic", "quadratic"): 3.0,
    ("automatic", "quadratic"): 3.0,
} | {(form, "linear"): 2.0 for form in ("linear", "quadratic", "smooth", "automatic")}
DEGREES = {1: "linear", 2: "quadratic"}
THEORY: Mapping[str, Mapping[str, Order]] = {
    "linear": {
        "displacement_l2": Order(2.0, 2.0),
        "displacement_h1": Order(1.0, 1.0),
        "stress_l2": Order(1.0, 1.0),
        "pressure_l2": Order(0.5, 1.0),
        "pressure_max": Order(None, 1.0),
    },
    "quadratic": {
        "displacement_l2": Order(2.5, 3.0),
        "displacement_h1": Order(1.5, 2.0),
        "stress_l2": Order(1.5, 2.0),
        "pressure_l2": Order(1.0, 1.0),
        "pressure_max": Order(None, 1.0),
    },
}


def element_size(macro_elements: int, dim: int) -> float:
    """The mean size of a macro-element over the size of the interface, for a mesh of `dim`."""
    return float(macro_elements) ** (-1 / (dim - 1))
