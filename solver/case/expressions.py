"""Expressions of position in a case file: `25*(1 - r**2/100)`, parsed from a whitelist.

The text is parsed into Python's syntax tree, and each of its nodes must be on the list below; it is
never compiled or run. All numbers are floats, so that no power can grow without bound.
"""

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import reduce
from typing import TYPE_CHECKING, Any

from ..system.errors import InputError

if TYPE_CHECKING:
    import numpy as np

MAX_LENGTH = 10_000
MAX_DEPTH = 300
MAX_EXPONENT = 32.0
MAX_NUMBER = 1e300

ALLOWED = (
    "a number or an expression of x, y, z, r, pi, sqrt, sin, cos, atan2, abs, min, max, "
    "+ - * / **, parentheses"
)
_COORDINATES = ("x", "y", "z")
_BINARY: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
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
_UNARY: dict[type, Callable] = {ast.UAdd: operator.pos, ast.USub: operator.neg}


@dataclass(frozen=True)
class Expression:
    """A scalar function of position, written in x, y, z and r = √(x² + y² (+ z²)).

    `axisymmetric`: r is the radius x, of a point of the meridian plane. `where` and `key` (file and
    key that hold the text) serve the messages of `InputError`, raised for a text that is not on the
    whitelist and for a value that is not finite.
    """

    text: str
    where: str = field(default="expression", compare=False)
    key: str = field(default="text", compare=False)
    axisymmetric: bool = False
    _tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Parse the text."""
        object.__setattr__(self, "_tree", self._parse())

    @property
    def names(self) -> frozenset[str]:
        """The names that occur in the expression."""
        return frozenset(node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name))

    def __call__(self, points: "np.ndarray") -> "np.ndarray":
        """Values (n,) at points (n, dim), dim = 2 or 3; `InputError` where one is not finite."""
        import numpy as np

        points = np.asarray(points, dtype=float)
        names = dict(zip(_COORDINATES, points.T, strict=False))
        if "z" in self.names and "z" not in names:
            raise self._error("z in a plane case; allowed are x, y and r")
        radius = points[:, 0] if self.axisymmetric else np.linalg.norm(points, axis=1)
        names |= {"r": radius, "pi": np.float64(math.pi)}
        with np.errstate(all="ignore"):
            values = np.broadcast_to(_value(self._tree, names), len(points)).astype(float)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise self._error(f"not a finite number at {points[bad[0]].tolist()}")
        return values

    def _error(self, allowed: str) -> InputError:
        return InputError(self.where, self.key, self.text, allowed)

    def _parse(self) -> ast.expr:
        if len(self.text) > MAX_LENGTH:
            raise self._error(f"longer than {MAX_LENGTH} characters")
        if re.fullmatch(r"[-+]?\d+,\d+", self.text.strip()):
            raise self._error(f"write numbers with a point: {self.text.replace(',', '.')}")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                tree = ast.parse(self.text.strip(), mode="eval").body
        except (SyntaxError, ValueError, MemoryError, RecursionError):
            raise self._error(f"must be {ALLOWED}") from None
        level, depth = [tree], 0
        while level:
            depth += 1
            if depth > MAX_DEPTH:
                raise self._error(f"nested deeper than {MAX_DEPTH} levels")
            level = [child for node in level for child in self._operands(node)]
        return tree

    def _operands(self, node: ast.expr) -> list[ast.expr]:
        """The sub-expressions of an allowed node; refuses any other node."""
        match node:
            case ast.Constant() if _number(node) is not None:
                return []
            case ast.Name(id="x" | "y" | "z" | "r" | "pi"):
                return []
            case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
                return [operand]
            case ast.BinOp(op=ast.Pow(), left=left, right=right):
                exponent = _number(right)
                if exponent is None or not abs(exponent) <= MAX_EXPONENT:
                    limit = f"{MAX_EXPONENT:g}"
                    raise self._error(f"an exponent must be a number from -{limit} to {limit}")
                return [left]
            case ast.BinOp(op=op, left=left, right=right) if type(op) in _BINARY:
                return [left, right]
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _FUNCTIONS:
                _, least, most = _FUNCTIONS[name]
                if least <= len(args) <= most:
                    return args
        shown = ast.get_source_segment(self.text.strip(), node) or ""
        shown = f"`{shown}` is not allowed in it; " if len(shown) < 40 else ""
        raise self._error(f"{shown}it must be {ALLOWED}")


def evaluate(scalar: float | Expression, points: "np.ndarray") -> "np.ndarray":
    """Values (n,) of a number or an expression at points (n, dim)."""
    import numpy as np

    if isinstance(scalar, Expression):
        return scalar(points)
    return np.full(len(points), float(scalar))


def _number(node: ast.expr) -> float | None:
    """The value of a signed number literal; None for anything else."""
    match node:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant() as operand):
            inner = _number(operand)
            return None if inner is None else -inner
        case ast.UnaryOp(op=ast.UAdd(), operand=ast.Constant() as operand):
            return _number(operand)
        case ast.Constant(value=bool()):
            return None
        case ast.Constant(value=int() | float() as number) if abs(number) < MAX_NUMBER:
            return float(number)
    return None


def _value(node: ast.expr, names: dict[str, Any]) -> Any:
    import numpy as np

    match node:
        case ast.Constant():
            return np.float64(_number(node))
        case ast.Name(id=name):
            return names[name]
        case ast.UnaryOp(op=op, operand=operand):
            return _UNARY[type(op)](_value(operand, names))
        case ast.BinOp(op=op, left=left, right=right):
            return _BINARY[type(op)](_value(left, names), _value(right, names))
        case ast.Call(func=ast.Name(id=name), args=args):
            function = getattr(np, _FUNCTIONS[name][0])
            values = [_value(argument, names) for argument in args]
            return reduce(function, values) if len(values) > 1 else function(*values)
    raise AssertionError(node)
