"""Derivatives of users' laws by dual numbers, against closed forms."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest
from numba import config

from evolvent.assembly.expressions import compile_expression
from evolvent.compiled import laws
from evolvent.compiled.lookups import PLAIN
from evolvent.kernels import expression

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="laws have no dual numbers without compilation")
P = np.array([2.0, 3.0, 5.0])
Pair = tuple[float, float]
#: Laws of (x, v, t, p), with their derivatives by x and v.
SCALAR: list[tuple[Callable[..., Any], Callable[[float, float], Pair]]] = []


def case(derivatives: Callable[[float, float], Pair]) -> Callable[[Any], Any]:
    def enter(law: Any) -> Any:
        SCALAR.append((law, derivatives))
        return law

    return enter


@numba.njit
def helper(x, power):
    return x**power


@case(lambda x, v: (P[0] + 3.0 * P[1] * x * x, P[2]))
def cubic(x, v, t, p):
    return p[0] * x + p[1] * x**3 + p[2] * v


@case(lambda x, v: (0.0, 0.0))
def constant(x, v, t, p):
    return 3


@case(lambda x, v: (math.cos(x) * math.exp(v) - 1.0 / math.cos(x) ** 2, math.sin(x) * math.exp(v)))
def waves(x, v, t, p):
    return math.sin(x) * np.exp(v) - math.tan(x)


@case(lambda x, v: (2.0 * x if x > 0.0 else 0.0, 0.0))
def one_sided(x, v, t, p):
    force = 0.0
    if x > 0.0:
        force = x * x
    return force


@case(lambda x, v: (sum(k * x ** (k - 1) for k in range(4)), 0.0))
def by_a_loop(x, v, t, p):
    total = 0.0
    for k in range(4):
        total += x**k
    return total


@case(lambda x, v: (v / (1.0 + x * v), x / (1.0 + x * v)))
def logarithm(x, v, t, p):
    return np.log1p(x * v)


@case(lambda x, v: (1.5 * math.copysign(abs(x) ** 0.5, x), -2.0 * abs(v)))
def roots_and_signs(x, v, t, p):
    return abs(x) ** 1.5 - np.sign(v) * np.square(v)


@case(lambda x, v: (x / math.hypot(x, v) + v / (x * x + v * v), v / math.hypot(x, v) - x / (x * x + v * v)))
def polar(x, v, t, p):
    return math.hypot(x, v) + math.atan2(x, v)


@case(lambda x, v: (1.0 / (3.0 * abs(x) ** (2.0 / 3.0)), 2.0**v * math.log(2.0)))
def cube_root_and_power(x, v, t, p):
    return np.cbrt(x) + 2.0**v


@case(lambda x, v: (0.0 if x < -0.5 else 1.0, 1.0 / math.cosh(v) ** 2))
def limited(x, v, t, p):
    return max(x, -0.5) + min(math.tanh(v), 2)


@case(lambda x, v: (2.0 * x, 3.0))
def with_helpers(x, v, t, p):
    return helper(x, 2) + 3.0 * float(v)


@case(lambda x, v: (-P[0] / (1.0 + x * x) / 1.2, 0.1 / math.sqrt(1.0 - 0.01 * v * v)))
def arcs(x, v, t, p):
    return math.asin(0.1 * v) - p[0] * math.atan(x) / 1.2


@case(lambda x, v: (math.cosh(x), 1.0 / math.sqrt(v * v + 1.0)))
def hyperbolic(x, v, t, p):
    y = math.sinh(x)
    return y + np.arcsinh(v) if math.isfinite(y) else 0.0


@case(lambda x, v: (1.0, 2.0 / math.sqrt(math.pi) * math.exp(-v * v)))
def saw(x, v, t, p):
    return (x % 0.25) + math.erf(v) + math.floor(x) + p[int(abs(x))]


def derivative_at(law: Any, kind: str, *arguments: Any) -> Any:
    """What the second function of a law's pair of addresses returns."""
    compiled = law.of(kind)
    pair = np.ctypeslib.as_array((ctypes.c_int64 * 2).from_address(laws.law_address(compiled, kind)))
    assert pair[1] != 0
    return compiled.slope(*arguments)


POINTS = [(0.3, 0.7), (1.2, -0.4), (-0.8, 0.9)]


@pytest.mark.slow
@pytest.mark.parametrize(("function", "exact"), SCALAR, ids=lambda one: getattr(one, "__name__", ""))
@pytest.mark.parametrize("first", ["x", "t"])
def test_derivatives_of_scalar_laws(first: str, function: Any, exact: Any) -> None:
    if first == "t":

        def swapped(t, x, v, p):  # type: ignore[no-untyped-def]
            return numba_law(x, v, t, p)

        numba_law = numba.njit(function)
        law = laws.law(swapped)
    else:
        law = laws.law(function)
    for x, v in POINTS:
        if function is logarithm and 1.0 + x * v <= 0.0:
            continue
        for dx, dv in ((1.0, 0.0), (0.0, 1.0), (0.5, -2.0)):
            by_x, by_v = exact(x, v)
            found = derivative_at(law, "spring", x, dx, v, dv, 0.3, P)
            assert found == pytest.approx(dx * by_x + dv * by_v, rel=1e-12, abs=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("first", [False, True])
def test_derivatives_of_a_force_law(first: bool) -> None:
    def drag(x, v, t, p):  # type: ignore[no-untyped-def]
        speed = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
        return -p[0] * speed * v[0], -p[0] * speed * v[1] + x[0] * x[x.size - 1], 1.0

    def time_first(t, x, v, p):  # type: ignore[no-untyped-def]
        speed = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
        return -p[0] * speed * v[0], -p[0] * speed * v[1] + x[0] * x[2], 1.0

    law = laws.law(time_first if first else drag)
    x, v, dx, dv = np.array([[0.3, -0.2, 0.5], [1.0, 2.0, -2.0], [0.7, 0.1, -0.3], [0.2, -0.4, 0.6]])
    speed, rate = 3.0, float(v @ dv) / 3.0
    wanted = [-2.0 * (speed * dv[0] + rate * v[0]), -2.0 * (speed * dv[1] + rate * v[1]), 0.0]
    wanted[1] += dx[0] * x[2] + x[0] * dx[2]
    pairs = (np.ascontiguousarray(np.stack(both, axis=1).ravel()) for both in ((x, dx), (v, dv)))
    found = derivative_at(law, "force", *pairs, 0.0, P)
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


@pytest.mark.slow
def test_derivatives_of_a_law_between_points() -> None:
    @laws.law
    def tie(t, x, v, p, f):  # type: ignore[no-untyped-def]
        stretch = math.sqrt((x[3] - x[0]) ** 2 + (x[4] - x[1]) ** 2 + (x[5] - x[2]) ** 2)
        for c in range(3):
            f[c] += p[0] * stretch * (x[3 + c] - x[c])
            f[3 + c] -= p[0] * stretch * (x[3 + c] - x[c]) + v[c]
        return 0.0, 0.0

    x, v, f = np.zeros((3, 6, 2))
    x[:, 0], x[:, 1], v[:, 1] = [0.0, 0.0, 0.0, 1.0, 2.0, 2.0], [0.3, 0.0, 0.0, 0.0, 0.0, 0.2], 0.5
    derivative_at(tie, "element", 0.0, x.reshape(-1), v.reshape(-1), P, f.reshape(-1))
    e, de = np.array([1.0, 2.0, 2.0]), np.array([-0.3, 0.0, 0.2])
    force = P[0] * (3.0 * de + float(e @ de) / 3.0 * e)
    np.testing.assert_allclose(f[:, 1], [*force, *(-force - 0.5)], rtol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "2*x + x**3 - v", "sin(x)*exp(v)", "where(x > 0, x**2, 0)", "abs(x)**1.5", "max(x, -0.5) + min(tanh(v), 2)",
        "sqrt(x**2 + v**2)", "atan2(x, v)", "x/(1 + v**2)", "log(2 + x*v)", "2**v",
    ],
)  # fmt: skip
def test_derivatives_of_expressions(text: str) -> None:
    code = np.array(compile_expression(text, ("x", "v", "t")).code)
    names = {"sin": np.sin, "exp": np.exp, "abs": np.abs, "tanh": np.tanh, "sqrt": np.sqrt, "log": np.log}
    names |= {"where": lambda one, a, b: a if one else b, "atan2": np.arctan2, "max": max, "min": min}

    def value(x: complex, v: complex) -> complex:
        """By a complex step, which has no difference; the functions are analytic there."""
        if text.startswith("atan2"):
            return complex(np.arctan(x / v) if v.real > 0.0 else np.arctan(x / v) + math.pi)
        if text.startswith("abs"):
            return complex((x if x.real > 0.0 else -x) ** 1.5)
        if text.startswith("max"):
            return (x if x.real > -0.5 else -0.5) + complex(np.tanh(v))
        if text.startswith("where"):
            return x * x if x.real > 0.0 else 0.0
        return complex(eval(text, {"__builtins__": {}}, names | {"x": x, "v": v}))

    for x, v in POINTS:
        for dx, dv in ((1.0, 0.0), (0.0, 1.0), (0.5, -2.0)):
            wanted = value(x + 1e-30j * dx, v + 1e-30j * dv).imag / 1e-30
            found = expression.scalar_expression_slope(x, dx, v, dv, 0.0, code)
            assert found == pytest.approx(wanted, rel=1e-12, abs=1e-13)


def test_a_law_that_dual_numbers_cannot_pass_has_differences_and_a_warning() -> None:
    @laws.law
    def special(x, v, t, p):  # type: ignore[no-untyped-def]
        return math.gamma(x)

    with pytest.warns(UserWarning, match=r"special.*is differentiated by central differences: "):
        address = laws.law_address(special.of("spring"), "spring")
    assert np.ctypeslib.as_array((ctypes.c_int64 * 2).from_address(address))[1] == 0


def test_a_law_of_another_kind_is_refused() -> None:
    @laws.law
    def law(x, v, t, p):  # type: ignore[no-untyped-def]
        return x

    laws.law_address(law.of("spring"), "spring")
    with pytest.raises(TypeError, match="'law' is no compiled law of kind 'force'"):
        laws.law_address(law.of("spring"), "force")
    assert PLAIN == [None]
