"""Numbers with a derivative, by which compiled code differentiates users' laws exactly (forward mode).

A dual number is a value and its derivative along one direction. Arithmetic, comparisons (by value), and the functions
of `math` and NumPy below take it as they take a float, and a float counts as a constant. A law that is compiled for
dual numbers therefore returns its derivative beside its value, to round-off. At a corner, as of abs(x) at 0, it is that
of the side that the law takes there, of abs and sign 0.

Notes
-----
Griewank & Walther (2008), Evaluating Derivatives, ch. 3. Numba's types are inferred as for floats; a variable that is a
float on one path and a dual number on another is a dual number.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import f8, i8, types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model


class DualType(types.Type):
    """Type of dual numbers in compiled code."""

    def __init__(self) -> None:
        super().__init__(name="Dual")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Numbers are constants."""
        return Conversion.safe if isinstance(other, types.Number | types.Boolean) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """A variable that is a number elsewhere is a dual number."""
        return self if isinstance(other, types.Number | types.Boolean) else None


DUAL = DualType()


@register_model(DualType)
class _DualModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("value", f8), ("slope", f8)])


class _Code:
    """A float in code that is being built, with Python's operators."""

    def __init__(self, context: Any, builder: Any, ir: Any) -> None:
        self.context, self.builder, self.ir = context, builder, ir

    def number(self, value: Any) -> _Code:
        """A constant."""
        return value if isinstance(value, _Code) else self._of(self.context.get_constant(f8, float(value)))

    def call(self, function: Any, *others: Any) -> _Code:
        """A function of floats, this one the first."""
        kinds = [i8 if isinstance(other, _Whole) else f8 for other in others]
        found = self.context.get_function(function, signature(f8, f8, *kinds))
        return self._of(found(self.builder, [self.ir, *(self.number(other).ir for other in others)]))

    def test(self, how: str, other: Any) -> Any:
        """A comparison; false where one of both is not a number, but for !=."""
        compare = self.builder.fcmp_unordered if how == "!=" else self.builder.fcmp_ordered
        return compare(how, self.ir, self.number(other).ir)

    def where(self, condition: Any, other: Any) -> _Code:
        """The number itself where a condition holds, else another one."""
        return self._of(self.builder.select(condition, self.ir, self.number(other).ir))

    def _of(self, ir: Any) -> _Code:
        return _Code(self.context, self.builder, ir)

    def _with(self, other: Any, how: str) -> _Code:
        return self._of(getattr(self.builder, how)(self.ir, self.number(other).ir))

    def __add__(self, other: Any) -> _Code:
        return self._with(other, "fadd")

    def __sub__(self, other: Any) -> _Code:
        return self._with(other, "fsub")

    def __mul__(self, other: Any) -> _Code:
        return self._with(other, "fmul")

    def __truediv__(self, other: Any) -> _Code:
        return self._with(other, "fdiv")

    def __neg__(self) -> _Code:
        return self._of(self.builder.fneg(self.ir))


class _Whole(_Code):
    """A whole number in code."""

    def number(self, value: Any) -> _Code:
        """Itself."""
        return value


def _parts(context: Any, builder: Any, dual: Any) -> tuple[_Code, _Code]:
    """Value and slope of a dual number."""
    found = cgutils.create_struct_proxy(DUAL)(context, builder, value=dual)
    return _Code(context, builder, found.value), _Code(context, builder, found.slope)


def _join(value: _Code, slope: _Code) -> Any:
    """A dual number."""
    found = cgutils.create_struct_proxy(DUAL)(value.context, value.builder)
    found.value, found.slope = value.ir, slope.ir
    return found._getvalue()


@lower_cast(types.Number, DualType)
@lower_cast(types.Boolean, DualType)
def _constant(context: Any, builder: Any, from_type: Any, to_type: Any, value: Any) -> Any:
    number = _Code(context, builder, context.cast(builder, value, from_type, f8))
    return _join(number, number.number(0.0))


# ------------------------------------------------------------------------------------------ typing and lowering


def _define(function: Any, arguments: tuple[Any, ...], result: Any, build: Callable[..., Any]) -> None:
    """Let compiled code call `function` with dual numbers among its arguments; `build` makes the code.

    `build` takes context, builder and the arguments: a pair (value, slope) of each dual number, a whole number.
    """

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != len(arguments) or DUAL not in args:
                return None
            for given, wanted in zip(args, arguments, strict=True):
                is_fit = given == DUAL or isinstance(given, types.Number | types.Boolean)
                if not (isinstance(given, types.Integer) if wanted == i8 else is_fit):
                    return None
            return signature(result, *arguments)

    infer_global(function)(Template)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        given = [
            _parts(context, builder, arg) if kind == DUAL else _Whole(context, builder, arg)
            for kind, arg in zip(sig.args, args, strict=True)
        ]
        return build(context, builder, *given)

    lower_builtin(function, *arguments)(lower)


def _ruled(rule: Callable[..., tuple[_Code, _Code]]) -> Callable[..., Any]:
    """Builder of a dual number from a rule for value and slope."""
    return lambda context, builder, *given: _join(*rule(*given))


Pair = tuple[_Code, _Code]


def _times(slope: _Code, factor: _Code) -> _Code:
    """Product of a slope and a factor; zero where the slope is, whatever the factor."""
    return (slope * factor).where(slope.test("!=", 0.0), 0.0)


def _quotient(a: Pair, b: Pair) -> Pair:
    value = a[0] / b[0]
    return value, (a[1] - value * b[1]) / b[0]


def _power(a: Pair, b: Pair) -> Pair:
    value = a[0].call(operator.pow, b[0])
    by_base = (b[0] * a[0].call(operator.pow, b[0] - 1.0)).where(b[0].test("!=", 0.0), 0.0)
    return value, _times(a[1], by_base) + _times(b[1], value * a[0].call(math.log))


def _whole_power(a: Pair, n: _Whole) -> Pair:
    builder, context = n.builder, n.context
    less = _Whole(context, builder, builder.sub(n.ir, n.ir.type(1)))
    factor = _Code(context, builder, context.cast(builder, n.ir, i8, f8))
    slope = (factor * a[0].call(operator.pow, less)).where(factor.test("!=", 0.0), 0.0)
    return a[0].call(operator.pow, n), _times(a[1], slope)


def _modulus(a: Pair, b: Pair) -> Pair:
    value = a[0].call(operator.mod, b[0])
    return value, a[1] - _times(b[1], (a[0] - value) / b[0])


def _truncated(a: Pair, b: Pair) -> Pair:
    value = a[0].call(math.fmod, b[0])
    return value, a[1] - _times(b[1], (a[0] - value) / b[0])


def _floor_quotient(a: Pair, b: Pair) -> Pair:
    value = a[0].call(operator.floordiv, b[0])
    return value, value.number(0.0)


def _angle(y: Pair, x: Pair) -> Pair:
    square = x[0] * x[0] + y[0] * y[0]
    slope = (y[1] * x[0] - y[0] * x[1]) / square
    return y[0].call(math.atan2, x[0]), slope.where(square.test("!=", 0.0), 0.0)


def _hypotenuse(a: Pair, b: Pair) -> Pair:
    value = a[0].call(math.hypot, b[0])
    slope = _times(a[1], a[0] / value) + _times(b[1], b[0] / value)
    return value, slope.where(value.test("!=", 0.0), 0.0)


def _with_sign(a: Pair, b: Pair) -> Pair:
    value = a[0].call(math.copysign, b[0])
    one = value.number(1.0)
    return value, a[1] * one.call(math.copysign, a[0]) * one.call(math.copysign, b[0])


def _lesser(a: Pair, b: Pair) -> Pair:
    second = b[0].test("<", a[0])
    return b[0].where(second, a[0]), b[1].where(second, a[1])


def _greater(a: Pair, b: Pair) -> Pair:
    second = b[0].test(">", a[0])
    return b[0].where(second, a[0]), b[1].where(second, a[1])


_TWO: dict[Callable[[Pair, Pair], Pair], tuple[Any, ...]] = {
    lambda a, b: (a[0] + b[0], a[1] + b[1]): (operator.add, operator.iadd, np.add),
    lambda a, b: (a[0] - b[0], a[1] - b[1]): (operator.sub, operator.isub, np.subtract),
    lambda a, b: (a[0] * b[0], a[1] * b[0] + a[0] * b[1]): (operator.mul, operator.imul, np.multiply),
    _quotient: (operator.truediv, operator.itruediv, np.divide),
    _power: (operator.pow, operator.ipow, math.pow, np.power),
    _modulus: (operator.mod, operator.imod, np.mod),
    _truncated: (math.fmod, np.fmod),
    _floor_quotient: (operator.floordiv, operator.ifloordiv),
    _angle: (math.atan2, np.arctan2),
    _hypotenuse: (math.hypot, np.hypot),
    _with_sign: (math.copysign, np.copysign),
    _lesser: (min, np.minimum, np.fmin),
    _greater: (max, np.maximum, np.fmax),
}
#: Functions of one value: names, the function of a float, and its derivative from x and y = f(x).
_ONE: list[tuple[tuple[Any, ...], Any, Callable[[_Code, _Code], Any]]] = [
    ((math.sin, np.sin), math.sin, lambda x, y: x.call(math.cos)),
    ((math.cos, np.cos), math.cos, lambda x, y: -x.call(math.sin)),
    ((math.tan, np.tan), math.tan, lambda x, y: y * y + 1.0),
    ((math.asin, np.arcsin), math.asin, lambda x, y: x.number(1.0) / (x.number(1.0) - x * x).call(math.sqrt)),
    ((math.acos, np.arccos), math.acos, lambda x, y: x.number(-1.0) / (x.number(1.0) - x * x).call(math.sqrt)),
    ((math.atan, np.arctan), math.atan, lambda x, y: x.number(1.0) / (x * x + 1.0)),
    ((math.sinh, np.sinh), math.sinh, lambda x, y: x.call(math.cosh)),
    ((math.cosh, np.cosh), math.cosh, lambda x, y: x.call(math.sinh)),
    ((math.tanh, np.tanh), math.tanh, lambda x, y: x.number(1.0) - y * y),
    ((math.asinh, np.arcsinh), math.asinh, lambda x, y: x.number(1.0) / (x * x + 1.0).call(math.sqrt)),
    ((math.acosh, np.arccosh), math.acosh, lambda x, y: x.number(1.0) / (x * x - 1.0).call(math.sqrt)),
    ((math.atanh, np.arctanh), math.atanh, lambda x, y: x.number(1.0) / (x.number(1.0) - x * x)),
    ((math.exp, np.exp), math.exp, lambda x, y: y),
    ((math.expm1, np.expm1), math.expm1, lambda x, y: y + 1.0),
    ((math.log, np.log), math.log, lambda x, y: x.number(1.0) / x),
    ((math.log2, np.log2), math.log2, lambda x, y: x.number(1.0 / math.log(2.0)) / x),
    ((math.log10, np.log10), math.log10, lambda x, y: x.number(1.0 / math.log(10.0)) / x),
    ((math.log1p, np.log1p), math.log1p, lambda x, y: x.number(1.0) / (x + 1.0)),
    ((math.sqrt, np.sqrt), math.sqrt, lambda x, y: x.number(0.5) / y),
    ((math.erf,), math.erf, lambda x, y: (-(x * x)).call(math.exp) * (2.0 / math.sqrt(math.pi))),
    ((math.erfc,), math.erfc, lambda x, y: (-(x * x)).call(math.exp) * (-2.0 / math.sqrt(math.pi))),
    ((math.degrees, np.degrees, np.rad2deg), math.degrees, lambda x, y: x.number(180.0 / math.pi)),
    ((math.radians, np.radians, np.deg2rad), math.radians, lambda x, y: x.number(math.pi / 180.0)),
    ((abs, math.fabs, np.abs, np.fabs), abs, lambda x, y: _sign(x)),
    ((np.square,), lambda x: x * x, lambda x, y: x + x),
    ((np.cbrt,), lambda x: _cube_root(x), lambda x, y: x.number(1.0) / (y * y * 3.0)),
    ((operator.neg, np.negative), lambda x: -x, lambda x, y: x.number(-1.0)),
    ((operator.pos, float), lambda x: x, lambda x, y: x.number(1.0)),
    ((np.sign,), lambda x: _sign(x), lambda x, y: x.number(0.0)),
    ((np.floor,), math.floor, lambda x, y: x.number(0.0)),
    ((np.ceil,), math.ceil, lambda x, y: x.number(0.0)),
]
_COMPARED = {
    operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">=", operator.eq: "==", operator.ne: "!=",
}  # fmt: skip


def _sign(x: _Code) -> _Code:
    return x.number(1.0).where(x.test(">", 0.0), x.number(-1.0).where(x.test("<", 0.0), x))


def _cube_root(x: _Code) -> _Code:
    """Of either sign, by a power and one step of Newton's method."""
    y = x.call(math.fabs).call(operator.pow, 1.0 / 3.0).call(math.copysign, x)
    better = y - (y * y * y - x) / (y * y * 3.0)
    return better.where(x.test("!=", 0.0), x)


def _of_one(function: Any, derivative: Callable[[_Code, _Code], Any]) -> Callable[[Pair], Pair]:
    is_rule = getattr(function, "__name__", "") == "<lambda>"

    def rule(x: Pair) -> Pair:
        value = function(x[0]) if is_rule else x[0].call(function)
        return value, _times(x[1], derivative(x[0], value))

    return rule


def _compared(how: str) -> Callable[..., Any]:
    return lambda context, builder, a, b: a[0].test(how, b[0])


def _by_value(function: Any, result: Any) -> Callable[..., Any]:
    """Builder of what a function returns for the value alone."""

    def build(context: Any, builder: Any, x: Pair) -> Any:
        return context.get_function(function, signature(result, f8))(builder, [x[0].ir])

    return build


for _rule, _functions in _TWO.items():
    for _function in _functions:
        if _rule is _power:
            _define(_function, (DUAL, i8), DUAL, _ruled(_whole_power))
        _define(_function, (DUAL, DUAL), DUAL, _ruled(_rule))
for _functions, _plain, _derivative in _ONE:
    for _function in _functions:
        _define(_function, (DUAL,), DUAL, _ruled(_of_one(_plain, _derivative)))
for _function, _how in _COMPARED.items():
    _define(_function, (DUAL, DUAL), types.boolean, _compared(_how))
for _function in (math.isnan, math.isfinite, math.isinf):
    _define(_function, (DUAL,), types.boolean, _by_value(_function, types.boolean))
for _function in (math.floor, math.ceil, math.trunc):
    _define(_function, (DUAL,), i8, _by_value(_function, i8))
_define(int, (DUAL,), i8, lambda context, builder, x: context.cast(builder, x[0].ir, f8, i8))
_define(bool, (DUAL,), types.boolean, lambda context, builder, x: x[0].test("!=", 0.0))
_define(operator.not_, (DUAL,), types.boolean, lambda context, builder, x: x[0].test("==", 0.0))


@intrinsic
def dual(typing_context, value, slope):  # type: ignore[no-untyped-def]
    """Dual number of a value and its derivative."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _join(*(_Code(context, builder, arg) for arg in args))

    return DUAL(f8, f8), codegen


@intrinsic
def dual_vector(typing_context, numbers):  # type: ignore[no-untyped-def]
    """Values and slopes, (2 n,) float, one after the other, as (n,) dual numbers in the same memory."""
    kind = types.Array(DUAL, 1, "C")

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        source = context.make_array(sig.args[0])(context, builder, args[0])
        view = context.make_array(kind)(context, builder)
        size = builder.lshr(source.nitems, source.nitems.type(1))
        item = context.get_constant(types.intp, 16)
        view.data = builder.bitcast(source.data, view.data.type)
        view.nitems, view.itemsize = size, item
        view.shape, view.strides = cgutils.pack_array(builder, [size]), cgutils.pack_array(builder, [item])
        view.meminfo = context.get_constant_null(types.MemInfoPointer(DUAL))
        view.parent = context.get_constant_null(types.pyobject)
        return view._getvalue()

    return kind(numbers), codegen


@intrinsic
def slope_of(typing_context, number):  # type: ignore[no-untyped-def]
    """Derivative of a dual number; 0 of a constant."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _parts(context, builder, args[0])[1].ir if number == DUAL else context.get_constant(f8, 0.0)

    if number == DUAL or isinstance(number, types.Number | types.Boolean):
        return f8(number), codegen
    return None
