"""Copies side by side: the same kernels, compiled for lane numbers (`compiled.lane_types`).

Arithmetic and functions take all lanes at once, each lane with the very operations of one copy, so that a copy gets the
bits that it gets alone. A branch is taken by all copies or by none: where a comparison, or a float that is asked of
lane numbers, differs between lanes, the function returns at once with a status that tells which lanes found it true,
and so do its callers, up to one called by `jit.Attempt`. The copies then go on alone (`solvers.time.explicit.lanes`).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import f8, i8, types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.experimental.function_type import FunctionModel
from numba.extending import lower_builtin, lower_cast, register_model

from evolvent.compiled.lane_types import LANES, VECTOR_OF_LANES, WIDTH, LanesType
from evolvent.compiled.pointer import LaneStruct, StructType, lane_struct

#: Status of a function whose lanes have parted: this less the mask of the lanes where a comparison holds.
PARTED = -1000
_ALL = (1 << WIDTH) - 1
_MASK = ir.IntType(WIDTH)
_INTEGERS = ir.VectorType(ir.IntType(64), WIDTH)


def has_parted(builder: Any, code: Any) -> Any:
    """Whether a status is that of lanes that have parted."""
    return builder.icmp_signed("<=", code, code.type(PARTED))


def _splat(builder: Any, number: Any) -> Any:
    """The same float in all lanes."""
    if isinstance(number, ir.Constant):
        return ir.Constant(VECTOR_OF_LANES, [number] * WIDTH)
    lane = builder.insert_element(ir.Constant(VECTOR_OF_LANES, ir.Undefined), number, ir.IntType(32)(0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [ir.IntType(32)(0)] * WIDTH)
    return builder.shuffle_vector(lane, ir.Constant(VECTOR_OF_LANES, ir.Undefined), places)


def _lane(builder: Any, value: Any, k: int) -> Any:
    return builder.extract_element(value, ir.IntType(32)(k))


def _together(builder: Any, lanes: list[Any]) -> Any:
    found = ir.Constant(VECTOR_OF_LANES, ir.Undefined)
    for k, one in enumerate(lanes):
        found = builder.insert_element(found, one, ir.IntType(32)(k))
    return found


def _agreed(context: Any, builder: Any, condition: Any) -> Any:
    """A condition of lanes as one of all; the function returns where they differ."""
    mask = builder.bitcast(condition, _MASK)
    every = builder.icmp_unsigned("==", mask, _MASK(_ALL))
    none = builder.icmp_unsigned("==", mask, _MASK(0))
    with cgutils.if_unlikely(builder, builder.not_(builder.or_(every, none))):
        code = builder.sub(ir.IntType(32)(PARTED), builder.zext(mask, ir.IntType(32)))
        context.call_conv._return_errcode_raw(builder, code)
    return every


@lower_cast(types.Number, LanesType)
@lower_cast(types.Boolean, LanesType)
def _constant(context: Any, builder: Any, from_type: Any, to_type: Any, value: Any) -> Any:
    return _splat(builder, context.cast(builder, value, from_type, f8))


def _one_of_all(context: Any, builder: Any, integers: Any) -> Any:
    """The integer that all lanes have; the function returns where they differ."""
    first = _lane(builder, integers, 0)
    places = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [ir.IntType(32)(0)] * WIDTH)
    every = builder.shuffle_vector(integers, ir.Constant(_INTEGERS, ir.Undefined), places)
    _agreed(context, builder, builder.icmp_unsigned("==", integers, every))
    return first


@lower_cast(LanesType, types.Float)
def _one(context: Any, builder: Any, from_type: Any, to_type: Any, value: Any) -> Any:
    bits = _one_of_all(context, builder, builder.bitcast(value, _INTEGERS))
    return context.cast(builder, builder.bitcast(bits, ir.DoubleType()), f8, to_type)


@lower_cast(types.Array(LANES, 1, "C"), types.Array(f8, 1, "C"))
@lower_cast(types.Array(f8, 1, "C"), types.Array(LANES, 1, "C"))
def _never(context: Any, builder: Any, from_type: Any, to_type: Any, value: Any) -> Any:
    """An array that a user's law or an expression is called with: the copies go on alone."""
    with builder.if_then(ir.IntType(1)(1)):
        context.call_conv._return_errcode_raw(builder, ir.IntType(32)(PARTED))
    return ir.Constant(context.get_value_type(to_type), ir.Undefined)


@infer_global(operator.setitem)
class _SetFloat(AbstractTemplate):
    """A lane number that is written where floats stand, as of expressions: it must be the same in all lanes."""

    def generic(self, args: Any, kws: Any) -> Any:
        if kws or args[2] != LANES or args[0] != types.Array(f8, 1, "C") or not isinstance(args[1], types.Integer):
            return None
        return signature(types.none, args[0], types.intp, f8)


class LawType(types.FunctionType):
    """Type of a user's law, which takes floats: of lanes what is the same in all."""

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Signature of a call."""
        if any(is_of_lanes(kind) for kind in args):
            return self.signature
        return super().get_call_type(context, args, kws)


register_model(LawType)(FunctionModel)


# ------------------------------------------------------------------------------------------ typing and lowering


def _define(function: Any, arguments: tuple[Any, ...], result: Any, build: Callable[..., Any]) -> None:
    """Let compiled code call `function` with lane numbers among its arguments; `build` makes the code."""

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != len(arguments) or LANES not in args:
                return None
            for given, wanted in zip(args, arguments, strict=True):
                is_fit = given == LANES or isinstance(given, types.Number | types.Boolean)
                if not (isinstance(given, types.Integer) if wanted == i8 else is_fit):
                    return None
            return signature(result, *arguments)

    infer_global(function)(Template)
    lower_builtin(function, *arguments)(lambda context, builder, sig, args: build(context, builder, *args))


def _each(function: Any, *kinds: Any) -> Callable[..., Any]:
    """Builder that calls a function of floats lane by lane; `kinds` of its arguments, i8 for an integer of all."""

    def build(context: Any, builder: Any, *values: Any) -> Any:
        found = context.get_function(function, signature(f8, *kinds))
        return _together(
            builder,
            [
                found(
                    builder, [v if kind == i8 else _lane(builder, v, k) for v, kind in zip(values, kinds, strict=True)]
                )
                for k in range(WIDTH)
            ],
        )

    return build


def _named(name: str) -> Callable[..., Any]:
    """Builder of an instruction."""
    return lambda context, builder, *values: getattr(builder, name)(*values)


def _of_llvm(builder: Any, name: str, count: int) -> Any:
    kind = ir.FunctionType(VECTOR_OF_LANES, [VECTOR_OF_LANES] * count)
    return cgutils.get_or_insert_function(builder.module, kind, f"{name}.v{WIDTH}f64")


def _of_all(name: str) -> Callable[..., Any]:
    """Builder of a function of LLVM of one value."""

    def build(context: Any, builder: Any, value: Any) -> Any:
        return builder.call(_of_llvm(builder, name, 1), [value])

    return build


def _compared(how: str) -> Callable[..., Any]:
    def build(context: Any, builder: Any, a: Any, b: Any) -> Any:
        compare = builder.fcmp_unordered if how == "!=" else builder.fcmp_ordered
        return _agreed(context, builder, compare(how, a, b))

    return build


def _chosen(how: str) -> Callable[..., Any]:
    """Of values the first, but a later one that compares so with it, as Python's min and max do."""

    def build(context: Any, builder: Any, found: Any, *others: Any) -> Any:
        for other in others:
            found = builder.select(builder.fcmp_ordered(how, other, found), other, found)
        return found

    return build


def _finite(context: Any, builder: Any, x: Any) -> Any:
    rest = builder.fsub(x, x)  # not a number where x is none or is infinite
    return _agreed(context, builder, builder.fcmp_ordered("==", rest, rest))


def _is_nan(context: Any, builder: Any, x: Any) -> Any:
    return _agreed(context, builder, builder.fcmp_unordered("uno", x, x))


def _sign_taken(context: Any, builder: Any, a: Any, b: Any) -> Any:
    return builder.call(_of_llvm(builder, "llvm.copysign", 2), [a, b])


_TWO: list[tuple[tuple[Any, ...], Callable[..., Any]]] = [
    ((operator.add, operator.iadd), _named("fadd")),
    ((operator.sub, operator.isub), _named("fsub")),
    ((operator.mul, operator.imul), _named("fmul")),
    ((operator.truediv, operator.itruediv), _named("fdiv")),
    ((operator.pow, operator.ipow), _each(operator.pow, f8, f8)),
    ((math.pow,), _each(math.pow, f8, f8)),
    ((operator.mod, operator.imod), _each(operator.mod, f8, f8)),
    ((math.fmod,), _each(math.fmod, f8, f8)),
    ((operator.floordiv,), _each(operator.floordiv, f8, f8)),
    ((math.atan2,), _each(math.atan2, f8, f8)),
    ((math.hypot,), _each(math.hypot, f8, f8)),
    ((np.nextafter,), _each(np.nextafter, f8, f8)),
    ((math.copysign,), _sign_taken),
    ((min,), _chosen("<")),
    ((max,), _chosen(">")),
]
for _functions, _build in _TWO:
    for _function in _functions:
        _define(_function, (LANES, LANES), LANES, _build)
for _count in (3, 4):
    _define(min, (LANES,) * _count, LANES, _chosen("<"))
    _define(max, (LANES,) * _count, LANES, _chosen(">"))
for _function in (operator.pow, operator.ipow):
    _define(_function, (LANES, i8), LANES, _each(operator.pow, f8, i8))
for _function in (
    math.sin, math.cos, math.tan, math.asin, math.acos, math.atan, math.sinh, math.cosh, math.tanh, math.asinh,
    math.acosh, math.atanh, math.exp, math.expm1, math.log, math.log2, math.log10, math.log1p, math.erf, math.erfc,
    np.sign,
):  # fmt: skip
    _define(_function, (LANES,), LANES, _each(_function, f8))
for _function in (math.sqrt, np.sqrt):
    _define(_function, (LANES,), LANES, _of_all("llvm.sqrt"))
for _function in (abs, math.fabs):
    _define(_function, (LANES,), LANES, _of_all("llvm.fabs"))
_define(operator.neg, (LANES,), LANES, _named("fneg"))
for _function in (operator.pos, float):
    _define(_function, (LANES,), LANES, lambda context, builder, x: x)
for _function, _how in {
    operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">=", operator.eq: "==", operator.ne: "!=",
}.items():  # fmt: skip
    _define(_function, (LANES, LANES), types.boolean, _compared(_how))
_define(math.isfinite, (LANES,), types.boolean, _finite)
_define(math.isnan, (LANES,), types.boolean, _is_nan)
for _function, _name in {
    math.floor: "llvm.floor", math.ceil: "llvm.ceil", math.trunc: "llvm.trunc", int: "llvm.trunc",
}.items():  # fmt: skip

    def _whole(context: Any, builder: Any, x: Any, name: str = _name) -> Any:
        found = builder.fptosi(builder.call(_of_llvm(builder, name, 1), [x]), _INTEGERS)
        return _one_of_all(context, builder, found)

    _define(_function, (LANES,), i8, _whole)


# ------------------------------------------------------------------------------------------ types for lanes


def lane_type(kind: Any) -> Any:
    """Type in a signature for lanes, of one in the signature for one model."""
    if isinstance(kind, types.Float):
        return LANES
    if isinstance(kind, types.Array) and kind.dtype == f8:
        return kind.copy(dtype=LANES)
    if isinstance(kind, StructType):
        return kind if issubclass(kind.struct, LaneStruct) else lane_struct(kind.struct)._numba_type_
    if isinstance(kind, types.UniTuple):
        return types.UniTuple(lane_type(kind.dtype), kind.count)
    if isinstance(kind, types.Tuple):
        return types.Tuple([lane_type(one) for one in kind])
    return kind


def lane_signature(of: Any) -> Any:
    """Signature for lanes."""
    return signature(lane_type(of.return_type), *(lane_type(kind) for kind in of.args))


def is_of_lanes(kind: Any) -> bool:
    """Whether a type is one for lanes."""
    if isinstance(kind, StructType):
        return issubclass(kind.struct, LaneStruct)
    return kind == LANES or (isinstance(kind, types.Array) and kind.dtype == LANES)
