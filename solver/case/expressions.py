"""Expressions of position in a case file: `25*(1 - r**2/100)`, of names on a list.

The text is parsed into Python's syntax tree. Each of its nodes must be on the list below, and all
numbers become floats, so that no power can grow without bound, before it is evaluated.
"""

import ast
import math
import re
import warnings
from dataclasses import dataclass, field
from enum import Enum
from functools import lru_cache, reduce
from types import CodeType
from typing import TYPE_CHECKING, Any

from ..system.errors import InputError

if TYPE_CHECKING:
    import numpy as np

MAX_LENGTH = 10_000
ALLOWED = (
    "a number or an expression of x, y, z, r, pi, sqrt, sin, cos, atan2, abs, min, max, "
    "+ - * / **, parentheses"
)
_COORDINATES = ("x", "y", "z")
_NODES = (
    *(ast.Constant, ast.Name, ast.Load, ast.UnaryOp, ast.UAdd, ast.USub, ast.Call),
    *(ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow),
)
# The numpy function of each name, and the least and the largest number of its arguments.
_FUNCTIONS: dict[str, tuple[str, int, int]] = {
    "sqrt": ("sqrt", 1, 1),
    "sin": ("sin", 1, 1),
    "cos": ("cos", 1, 1),
    "abs": ("abs", 1, 1),
    "atan2": ("arctan2", 2, 2),
    "min": ("minimum", 2, 32),
    "max": ("maximum", 2, 32),
}


class Exact(Enum):
    """`solution` in place of a value: the value of the case's exact solution."""

    VALUE = "solution"


EXACT = Exact.VALUE


@dataclass(frozen=True)
class Expression:
    """A scalar function of position, written in x, y, z and r = √(x² + y² (+ z²)).

    `axisymmetric`: r is the radius x, of a point of the meridian plane. `where` and `key` (file and
    key that hold the text) serve the messages of `InputError`, raised for a text that is not on the
    list and for a value that is not finite.
    """

    text: str
    where: str = field(default="expression", compare=False)
    key: str = field(default="text", compare=False)
    axisymmetric: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no expression."""
        try:
            _compiled(self.text)
        except ValueError as error:
            raise self._error(str(error)) from None

    def __repr__(self) -> str:
        """As a case file has it."""
        return repr(self.text)

    @property
    def names(self) -> frozenset[str]:
        """The names that occur in the expression."""
        return frozenset(_compiled(self.text).co_names)

    def __call__(self, points: "np.ndarray") -> "np.ndarray":
        """Values (n,) at points (n, dim), dim = 2 or 3; `InputError` where one is not finite."""
        import numpy as np

        points = np.asarray(points, dtype=float)
        names: dict[str, Any] = dict(zip(_COORDINATES, points.T, strict=False))
        if "z" not in names and "z" in self.names:
            raise self._error("z in a plane case; allowed are x, y and r")
        names["r"] = points[:, 0] if self.axisymmetric else np.linalg.norm(points, axis=1)
        names["pi"] = np.float64(math.pi)
        for name, (function, _, most) in _FUNCTIONS.items():
            names[name] = _folded(getattr(np, function)) if most > 2 else getattr(np, function)
        try:
            with np.errstate(all="ignore"):
                found = eval(_compiled(self.text), {"__builtins__": {}}, names)  # noqa: S307
                values = np.broadcast_to(found, len(points)).astype(complex)
        except ArithmeticError:  # of numbers alone: too large, or over zero
            raise self._error("not a finite number") from None
        values = np.where(values.imag == 0, values.real, np.nan)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise self._error(f"not a finite number at {points[bad[0]].tolist()}")
        return values

    def _error(self, allowed: str) -> InputError:
        return InputError(self.where, self.key, self.text, allowed)


@lru_cache(1000)
def _compiled(text: str) -> CodeType:
    """Compile an expression of allowed nodes; raise ValueError with the reason for any other."""
    text = text.strip()
    if len(text) > MAX_LENGTH:
        raise ValueError(f"longer than {MAX_LENGTH} characters")
    if re.fullmatch(r"[-+]?\d+,\d+", text):
        raise ValueError(f"write numbers with a point: {text.replace(',', '.')}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text, mode="eval")
        nodes = list(ast.walk(tree.body))
        called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
        refused = next((n for n in nodes if not _is_allowed(n, id(n) in called)), None)
        if refused is None:
            for number in (node for node in nodes if isinstance(node, ast.Constant)):
                number.value = float(number.value)  # type: ignore[arg-type]
        code = compile(tree, "<expression>", "eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ValueError(f"must be {ALLOWED}") from None
    if refused is not None:
        shown = ast.get_source_segment(text, refused) or ""
        shown = f"`{shown}` is not allowed in it; " if 0 < len(shown) < 40 else ""
        raise ValueError(f"{shown}it must be {ALLOWED}")
    return code


def _is_allowed(node: ast.AST, called: bool) -> bool:
    """Whether a node may be in an expression; `called`: as the name of a function."""
    match node:
        case ast.Constant(value=bool()):
            return False
        case ast.Constant(value=value):
            return isinstance(value, int | float) and abs(value) < 1e300
        case ast.Name(id=name):
            return name in _FUNCTIONS if called else name in (*_COORDINATES, "r", "pi")
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            _, least, most = _FUNCTIONS.get(name, ("", 0, -1))
            return least <= len(args) <= most
    return isinstance(node, _NODES) and not isinstance(node, ast.Call)


def _folded(function: Any) -> Any:
    """A function of two arguments, for any number of them."""
    return lambda *values: reduce(function, values)


def evaluate(scalar: float | Expression, points: "np.ndarray") -> "np.ndarray":
    """Values (n,) of a number or an expression at points (n, dim)."""
    import numpy as np

    if isinstance(scalar, Expression):
        return scalar(points)
    return np.full(len(points), float(scalar))
