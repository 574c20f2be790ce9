"""Arithmetic expressions: the stack machine against Python's own evaluation, derivatives, and what is refused."""

from __future__ import annotations

import math
import re

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from evolvent import InputError
from evolvent.assembly import expressions
from evolvent.assembly.expressions import FUNCTIONS, LENGTH, check_grammar, compile_expression, is_true, sign, where
from evolvent.kernels import expression as kernels

VARIABLES = ("x", "v", "t")
NAMES = {name: function for name, (_, _, function) in FUNCTIONS.items()} | {"pi": math.pi, "k": 2.5, "c": -0.3}


def value(text: str, x: float = 0.0, v: float = 0.0, t: float = 0.0) -> float:
    """An expression's value by the stack machine."""
    program = compile_expression(text, VARIABLES, {"k": 2.5, "c": -0.3})
    return float(kernels.spring_expression(x, v, t, np.array(program.code)))


def derivatives(text: str, t: float) -> tuple[float, float, float]:
    program = compile_expression(text, ("t",))
    return kernels.drive_expression(t, np.array(program.code))


def conditions(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    signs = st.sampled_from(["<", "<=", ">", ">=", "==", "!="])
    simple = st.builds(lambda a, op, b: f"{a} {op} {b}", inner, signs, inner)
    return simple | st.builds(lambda a, op, b, other, c: f"{a} {op} {b} {other} {c}", inner, signs, inner, signs, inner)


def larger(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    one = st.sampled_from(["abs", "sign", "sqrt", "sin", "cos", "tan", "exp", "log", "tanh"])
    return st.one_of(
        st.builds(lambda a, op, b: f"({a} {op} {b})", inner, st.sampled_from("+-*/"), inner),
        st.builds(lambda a, n: f"({a})**{n}", inner, st.integers(-4, 6)),
        st.builds(lambda a, b: f"abs({a})**({b})", inner, inner),
        st.builds(lambda a: f"(-{a})", inner),
        st.builds(lambda name, a: f"{name}({a})", one, inner),
        st.builds(lambda name, a, b: f"{name}({a}, {b})", st.sampled_from(["min", "max", "atan2"]), inner, inner),
        st.builds(lambda a, b, c: f"max({a}, {b}, {c})", inner, inner, inner),
        st.builds(lambda a, b, c: f"where({a}, {b}, {c})", conditions(inner), inner, inner),
    )


ATOMS = st.sampled_from([*VARIABLES, "k", "c", "pi", "2", "0.5", "1e-3", "7."])
TEXTS = st.recursive(ATOMS, larger, max_leaves=12).filter(lambda text: len(text) <= LENGTH)
NUMBERS = st.floats(-3.0, 3.0)


@pytest.mark.slow
@settings(max_examples=400, deadline=None)
@given(text=TEXTS, x=NUMBERS, v=NUMBERS, t=NUMBERS)
def test_value_is_that_of_python(text: str, x: float, v: float, t: float) -> None:
    try:
        exact = eval(text, {"__builtins__": {}}, {**NAMES, "x": x, "v": v, "t": t})
    except (ArithmeticError, ValueError):  # where Python raises, or what where() leaves out does
        return
    try:
        found = value(text, x, v, t)
    except InputError as error:  # a constant part of it is not finite or large
        if "not a finite number" not in str(error):
            raise
        return
    if math.isfinite(exact) and abs(exact) < 1e100:
        # a whole power is a product here; a difference of large numbers enlarges that
        assert found == pytest.approx(exact, rel=1e-6, abs=1e-9) or _is_delicate(text, x, v, t, exact)


def _is_delicate(text: str, x: float, v: float, t: float, exact: float) -> bool:
    """Whether round-off of the variables changes the value that much."""
    values = []
    for share in (1.0 - 1e-13, 1.0 + 1e-13):
        names = {**NAMES, "x": x * share, "v": v * share, "t": t * share, "k": 2.5 * share, "c": -0.3 / share}
        try:
            values.append(eval(text, {"__builtins__": {}}, names))
        except (ArithmeticError, ValueError):
            return True
    return any(abs(value - exact) > 1e-9 * (abs(exact) + 1.0) for value in values)


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("-x**2", -4.0),
        ("2**-1 + x", 2.5),
        ("2**x**2", 16.0),
        ("x - 3 - v", -2.0),
        ("x/4/v", 0.5),
        ("where(x > 3, 1, where(x > 1, 5, 9))", 5.0),
        ("where(0 < v < x, 1, 0)", 1.0),
        ("where(0 < x < v, 1, 0)", 0.0),
        ("where(x < 0, sqrt(-x), 3)", 3.0),
        ("min(x, v, -7) + max(x, v)", -5.0),
        ("  k * x\n + c", 4.7),
        ("x**0.5", math.sqrt(2.0)),
        ("x**-2", 0.25),
        ("x**64", 2.0**64),
        ("x**65", 2.0**65),
        ("sign(-x) + sign(0*x)", -1.0),
        ("atan2(v, -x)", math.atan2(1.0, -2.0)),
        ("+x", 2.0),
    ],
)
def test_values(text: str, exact: float) -> None:
    assert value(text, 2.0, 1.0) == pytest.approx(exact, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x < 2", True),
        ("0 < x <= y", True),
        ("0 < x < y < 2", False),
        ("abs(x - y) > 1e-3 * y", True),
        ("x == 2", False),
    ],
)
def test_comparisons_of_numbers(text: str, expected: bool) -> None:
    assert is_true(text, {"x": 1.0, "y": 2.0}) is expected


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("x", "is no comparison"),
        ("x < z", "'z' at character 5 is neither a variable nor a constant"),
        ("x <", "it cannot be read"),
        ("x < 2 and x > 0", "is no comparison"),
    ],
)
def test_comparisons_that_are_refused(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        is_true(text, {"x": 1.0, "y": 2.0})


def test_not_a_number_where_a_value_is_undefined() -> None:
    assert math.isnan(value("sqrt(x)", -1.0))
    assert math.isnan(value("log(x)", -1.0))
    assert not math.isfinite(value("1/x", 0.0))
    assert math.isnan(value("x**0.5", -1.0))


SMOOTH = {
    "t**3 - 2*t + 1": lambda t: (3.0 * t**2 - 2.0, 6.0 * t),
    "sin(2*t)*exp(-t)": lambda t: (
        math.exp(-t) * (2.0 * math.cos(2.0 * t) - math.sin(2.0 * t)),
        math.exp(-t) * (-3.0 * math.sin(2.0 * t) - 4.0 * math.cos(2.0 * t)),
    ),
    "sqrt(1 + t)": lambda t: (0.5 * (1.0 + t) ** -0.5, -0.25 * (1.0 + t) ** -1.5),
    "log(t)": lambda t: (1.0 / t, -1.0 / t**2),
    "t**t": lambda t: (t**t * (math.log(t) + 1.0), t**t * ((math.log(t) + 1.0) ** 2 + 1.0 / t)),
    "2**t": lambda t: (math.log(2.0) * 2.0**t, math.log(2.0) ** 2 * 2.0**t),
    "t**2.5": lambda t: (2.5 * t**1.5, 3.75 * t**0.5),
    "t**-2": lambda t: (-2.0 * t**-3, 6.0 * t**-4),
    "1/(1 + t*t)": lambda t: (-2.0 * t / (1.0 + t * t) ** 2, (6.0 * t * t - 2.0) / (1.0 + t * t) ** 3),
    "atan2(t, 1)": lambda t: (1.0 / (1.0 + t * t), -2.0 * t / (1.0 + t * t) ** 2),
    "tanh(t)": lambda t: (1.0 - math.tanh(t) ** 2, -2.0 * math.tanh(t) * (1.0 - math.tanh(t) ** 2)),
    "tan(t)": lambda t: (1.0 + math.tan(t) ** 2, 2.0 * math.tan(t) * (1.0 + math.tan(t) ** 2)),
    "cos(t)": lambda t: (-math.sin(t), -math.cos(t)),
    "abs(-t)": lambda t: (1.0, 0.0),
    "where(t < 5, t*t, 0)": lambda t: (2.0 * t, 2.0),
    "where(t > 5, t*t, 3*t)": lambda t: (3.0, 0.0),
    "min(t*t, t) + max(t, t**3)": lambda t: (1.0 + 3.0 * t**2, 6.0 * t) if t > 1.0 else (2.0 * t + 1.0, 2.0),
    "sign(t) - t": lambda t: (-1.0, 0.0),
    "pi": lambda t: (0.0, 0.0),
}


@pytest.mark.parametrize("text", SMOOTH)
@pytest.mark.parametrize("t", [0.3, 1.7])
def test_derivatives(text: str, t: float) -> None:
    found = derivatives(text, t)
    program = compile_expression(text, ("t",))
    assert found[0] == kernels.spring_expression(t, 0.0, 0.0, np.array(program.code))
    assert found[1:] == pytest.approx(SMOOTH[text](t), rel=1e-13, abs=1e-13)


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(text=st.recursive(st.sampled_from(["t", "2", "0.5", "pi"]), larger, max_leaves=8), t=st.floats(0.2, 2.0))
def test_derivatives_are_those_of_differences(text: str, t: float) -> None:
    try:
        h = 1e-4
        values = [derivatives(text, t + k * h) for k in range(-2, 3)]
    except InputError:
        return
    array = np.array(values)
    if not np.all(np.isfinite(array)) or np.abs(array).max() > 1e3:
        return
    for order in (0, 1):
        f = array[:, order]
        wide, near = (f[4] - f[0]) / (4.0 * h), (f[3] - f[1]) / (2.0 * h)
        if abs(wide - near) < 1e-4:  # no kink or pole nearby
            assert array[2, order + 1] == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-4, abs=1e-4)


REFUSED = {
    "": "it is empty",
    "x.real": "'x.real' at character 1 is not allowed; allowed are numbers",
    "2 + ().__class__": "'().__class__' at character 5 is not allowed",
    "x[0]": "'x[0]' at character 1 is not allowed",
    "(lambda: 1)()": "is not allowed",
    "lambda: 1": "is not allowed",
    "(y := 3)": "is not allowed",
    "'a'": "is not allowed",
    "f'{x}'": "is not allowed",
    "b'a'": "is not allowed",
    "[x]": "is not allowed",
    "{x: 1}": "is not allowed",
    "[x for x in t]": "is not allowed",
    "x if t else 1": "is not allowed",
    "x and t": "is not allowed",
    "not x": "is not allowed",
    "~x": "is not allowed",
    "x // 2": "is not allowed",
    "x % 2": "is not allowed",
    "x @ v": "is not allowed",
    "x << 2": "is not allowed",
    "1j*x": "'1j' at character 1 is not allowed",
    "True": "is not allowed",
    "None": "is not allowed",
    "...": "is not allowed",
    "x^2": "a power is written **",
    "x < 1": "only as the first argument of where",
    "2*(x < 1 < v)": "only as the first argument of where",
    "where(x, 1, 2)": "'x' at character 7 is no comparison",
    "where(x in v, 1, 2)": "is no comparison",
    "where(x < 1, 2)": "has 2; where takes 3 arguments",
    "__import__('os')": "'__import__' at character 1 is no function",
    "eval('1')": "'eval' at character 1 is no function",
    "sinn(x)": "'sinn' at character 1 is no function; did you mean 'sin'?",
    "sin(x, 1)": "has 2; sin takes 1 argument",
    "min(x)": "has 1; min takes two or more arguments",
    "max(*x)": "is not allowed",
    "sin(x=1)": "is not allowed",
    "x.sin(1)": "is not allowed",
    "sin": "is a function; write sin(...)",
    "kk*x": "'kk' at character 1 is neither a variable nor a constant; did you mean 'k'?",
    "9**9**9": "'9**9**9' at character 1 is not a finite number of at most 1e+100",
    "9**9**9**9**9": "is not a finite number",
    "1/0": "'1/0' at character 1 is not a finite number",
    "sqrt(-1)": "is not a finite number",
    "(-8)**(1/3)": "is not a finite number",
    "exp(1000)": "is not a finite number",
    "1e200": "is not a finite number of at most 1e+100",
    "9" * 900: "is not a finite number of at most 1e+100",
    "sin(x": "it cannot be read at character 4",
    "x +": "it cannot be read at character",
    "x; v": "it cannot be read at character 2",
    "import os": "it cannot be read at character 1",
    "x = 1": "it cannot be read",
    "2x": "it cannot be read",
    "\0x": "it cannot be read",
    "x" * (LENGTH + 1): f"at most {LENGTH} are allowed",
    "-" * 900 + "x": "nested more than",
    "(" * 400 + "x" + ")" * 400: "it cannot be read",
    "x+(" * 60 + "x" + ")" * 60: "values at a time",
}


@pytest.mark.parametrize("text", REFUSED)
def test_refused(text: str) -> None:
    with pytest.raises(InputError) as refused:
        compile_expression(text, VARIABLES, {"k": 1.0}, name="spring.law")
    message = str(refused.value)
    assert REFUSED[text] in message
    assert message.startswith("spring.law is ")
    assert "\n" not in message
    assert len(message) < 500


@pytest.mark.parametrize("value", [3, None, b"x", ["x"]])
def test_only_texts(value: object) -> None:
    with pytest.raises(InputError, match="it must be a text such as"):
        compile_expression(value, VARIABLES)


@pytest.mark.parametrize("name", ["x", "pi", "sin", "a b", "2a", "a.b", ""])
def test_names_of_constants(name: str) -> None:
    with pytest.raises(InputError, match="a name that is taken"):
        compile_expression("x", VARIABLES, {name: 1.0})


def test_grammar_without_names() -> None:
    assert check_grammar(" a*x \n + b ") == "a*x + b"
    with pytest.raises(ValueError, match=r"write sin\(\.\.\.\)"):
        check_grammar("sin*x")


def test_times_of_jumps() -> None:
    text = "where(t < t1 + 1, 1, 0) + where(0.5 <= t <= 4, x, where(x > 7, 1, where(t > x, 1, 2)))"
    assert compile_expression(text, VARIABLES, {"t1": 1.5}).corners == (0.5, 2.5, 4.0)


def test_constants_are_folded() -> None:
    program = compile_expression("2*pi/4*k*t", ("t",), {"k": 3.0})
    assert len(program.code) < 8


def test_helpers() -> None:
    assert [sign(-2.0), sign(0.0), sign(3.0)] == [-1.0, 0.0, 1.0]
    assert where(True, 1.0, 2.0) == 1.0


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("sin(t) + 3*t", []),
        ("where(2*t - 1 < t, 1, t)", [1.0]),
        ("where(1 < t < a, 0, 1)", [1.0, 4.0]),
        ("max(0, min(t - 1, 1))", [1.0, 2.0]),
        ("abs(-t/2 + a) + sign(t*t)", [8.0]),
        ("min(t, a*2, 3) + abs(max(t, 5) - 6)", [3.0, 5.0, 6.0, 8.0]),
        ("where(x < t, 1, 2)", []),
    ],
)
def test_times_at_which_an_expression_goes_over(text, times):
    assert expressions.corners_of(text, {"a": 4.0}) == pytest.approx(times)
