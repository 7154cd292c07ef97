"""Expressions of position: values against numpy, and nothing but the whitelist let in."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.case.expressions import MAX_LENGTH, Expression, evaluate
from solver.system.errors import InputError

POINTS = np.array([[0.5, 2.0, -1.5], [3.0, 0.25, 4.0], [1.0, 1.0, 1.0]])
X, Y, Z = POINTS.T


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2", np.full(3, 2.0)),
        ("x - y*z", X - Y * Z),
        ("-x**2", -(X**2)),
        ("+x / -(y + 1e-3)", X / -(Y + 1e-3)),
        ("2**-1 * x", X / 2),
        ("x**0.5 + y**-1", np.sqrt(X) + 1 / Y),
        ("r", np.sqrt(X**2 + Y**2 + Z**2)),
        ("sin(pi*x) + cos(y)", np.sin(np.pi * X) + np.cos(Y)),
        ("  sqrt((x - 1)**2)", abs(X - 1)),
        ("abs(x - y)", np.where(X > Y, X - Y, Y - X)),
        ("min(x, y) + max(x, y, z)", np.minimum(X, Y) + np.array([2.0, 4.0, 1.0])),
        ("atan2(y, -x)", [math.pi - math.atan(4), math.pi - math.atan(1 / 12), 0.75 * math.pi]),
    ],
)
def test_values_are_those_of_numpy(text, expected):
    np.testing.assert_allclose(Expression(text)(POINTS), expected, rtol=1e-15, atol=1e-15)


def test_radius_in_the_plane_leaves_z_out():
    np.testing.assert_allclose(Expression("r")(POINTS[:, :2]), np.hypot(X, Y), rtol=1e-15)


def test_no_points_no_values():
    assert Expression("x + 1")(np.empty((0, 3))).shape == (0,)


def test_number_and_expression_alike():
    assert evaluate(2.5, POINTS).tolist() == [2.5, 2.5, 2.5]
    assert evaluate(Expression("x"), POINTS).tolist() == X.tolist()


def test_equal_by_text_and_survives_pickling():
    there = Expression("x + 1", where="a.yaml", key="loads")
    assert there == Expression("x + 1")
    assert pickle.loads(pickle.dumps(there))(POINTS).tolist() == (X + 1).tolist()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a",
        "x.real",
        "x[0]",
        "exp(x)",
        "sin",
        "sin()",
        "sin(x, y)",
        "abs(x, y)",
        "min(x)",
        "max()",
        "max(*x)",
        "atan2(x)",
        "atan2(x, y, z)",
        "sin(*x)",
        "sin(x=1)",
        "pi(x)",
        "x if y else z",
        "x < y",
        "x and y",
        "x % y",
        "x // y",
        "~x",
        "not x",
        "True",
        "1j",
        "'x'",
        "(x, y)",
        "[x]",
        "lambda: x",
        "x := 1",
        "f'{x}'",
        "__import__('os')",
        "().__class__",
        "x; y",
        "x = 1",
        "x\n+ y",
        "x +",
        "((x)",
        "\x00",
        "\ud800",
        "1e400",
        "9" * 400,
    ],
)
def test_everything_else_is_refused(text):
    with pytest.raises(InputError, match=r"^c\.yaml: loads\[0\]\.pressure = .*: "):
        Expression(text, where="c.yaml", key="loads[0].pressure")


def test_length_is_limited():
    with pytest.raises(InputError, match=f"longer than {MAX_LENGTH} characters"):
        Expression("+".join("x" * MAX_LENGTH))


def test_a_long_sum_has_its_value():
    text = "+".join(["(0.5 * sin(x) / cos(x))"] * 300)
    there = pickle.loads(pickle.dumps(Expression(text)))
    np.testing.assert_allclose(there(POINTS), 150 * np.tan(X), rtol=1e-13)


@pytest.mark.parametrize("text", ["9**9**9**9", "1/0", "(0 - 2)**0.5"])
def test_numbers_alone_that_are_not_finite_are_refused(text):
    with pytest.raises(InputError, match=r"not a finite number"):
        Expression(text)(POINTS)


@pytest.mark.parametrize("text", ["1/(x - 3)", "sqrt(-x)", "1/(pi - pi)", "(1e200*x)**2"])
def test_a_value_that_is_not_finite_is_refused_with_its_place(text):
    with pytest.raises(InputError, match=r"^c\.yaml: gap = .*: not a finite number at \["):
        Expression(text, where="c.yaml", key="gap")(POINTS)


def test_z_has_no_value_in_the_plane():
    with pytest.raises(InputError, match="z in a plane case; allowed are x, y and r"):
        Expression("x + z")(POINTS[:, :2])


NUMBERS = st.floats(0.1, 10).map(lambda v: f"{v:.3f}")


def _combined(parts):
    two = st.tuples(parts, st.sampled_from("+-*"), parts)
    function = st.tuples(st.sampled_from(["sin", "cos", "-"]), parts)
    return two.map(lambda p: f"({p[0]} {p[1]} {p[2]})") | function.map(lambda p: f"{p[0]}({p[1]})")


@given(st.recursive(NUMBERS | st.sampled_from(["x", "y", "z", "pi"]), _combined, max_leaves=8))
def test_any_sum_of_products_is_what_python_makes_of_it(text):
    names = {"sin": math.sin, "cos": math.cos, "pi": math.pi}
    expected = [eval(text, names, dict(zip("xyz", p, strict=True))) for p in POINTS]  # noqa: S307
    np.testing.assert_allclose(Expression(text)(POINTS), expected, rtol=1e-12, atol=1e-12)


@given(st.text(max_size=40) | st.text("xyzr()+-*/. 019esincoqrtpi", max_size=40))
def test_any_text_is_an_expression_or_refused(text):
    try:
        values = Expression(text)(POINTS)
    except InputError:
        return
    assert values.shape == (3,)
