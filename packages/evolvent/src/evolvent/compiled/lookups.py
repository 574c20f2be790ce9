"""Users' laws and the package's own functions that a model refers to by address, looked up in compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, f8, types
from numba.core import cgutils
from numba.extending import intrinsic

from evolvent.compiled import lanes
from evolvent.compiled.jit import address_in_table, at_slot

_VECTOR = types.UniTuple(f8, 3)
#: Signatures of the laws that a user may write, by kind.
LAWS = {
    "force": _VECTOR(f8[::1], f8[::1], f8, f8[::1]),
    "spring": f8(f8, f8, f8, f8[::1]),
    "drive": _VECTOR(f8, f8[::1]),
    "event": f8(f8, f8[::1], f8[::1]),
    "element": types.UniTuple(f8, 2)(f8, f8[::1], f8[::1], f8[::1], f8[::1]),
}
#: Signatures of their derivatives along a direction, which `compiled.laws` makes of them by dual numbers. Of a scalar
#: law: (x, dx, v, dv, t, parameters). Positions, velocities and forces in vectors are then value and derivative, one
#: after the other.
SLOPES = {
    "force": LAWS["force"],
    "spring": f8(f8, f8, f8, f8, f8, f8[::1]),
    "element": f8(f8, f8[::1], f8[::1], f8[::1], f8[::1]),
}
#: Only used without compilation: addresses are then indices in this list; 0 stands for no law.
PLAIN: list[Any] = [None]


def _word(context: Any, builder: Any, address: Any, at: int) -> Any:
    """Code for a word of the pair of addresses, of a law and of its derivative, that a model refers to."""
    pair = builder.inttoptr(address, ir.IntType(64).as_pointer())
    return builder.load(builder.gep(pair, [cgutils.intp_t(at)]))


def _has_slope(address: int) -> bool:
    return False


@intrinsic
def _compiled_has_slope(typing_context, address):  # type: ignore[no-untyped-def]
    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        found = _word(context, builder, args[0], 1)
        return builder.icmp_unsigned("!=", found, found.type(0))

    return types.boolean(types.int64), codegen


#: ``has_slope(address)``: whether the law at an address has a derivative by dual numbers.
has_slope = _has_slope if config.DISABLE_JIT else _compiled_has_slope


def _make_lookup(signature: Any, at: int = 0) -> Any:
    """A compiled function int64, the address of a pair of addresses -> callable of `signature`."""
    if config.DISABLE_JIT:
        return PLAIN.__getitem__

    @intrinsic
    def law_at(typing_context, address):  # type: ignore[no-untyped-def]
        function_type = lanes.LawType(signature)

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            struct = cgutils.create_struct_proxy(function_type)(context, builder)
            pointer = builder.inttoptr(_word(context, builder, args[0], at), context.get_value_type(types.voidptr))
            struct.c_addr = pointer
            struct.jit_addr = pointer
            return struct._getvalue()

        return function_type(types.int64), codegen

    return law_at


def by_slot(signature: Any) -> Any:
    """A compiled function (struct with the table `addresses`, index in it) -> callable of `signature`."""
    if config.DISABLE_JIT:
        return lambda _, slot: PLAIN[slot]

    @intrinsic
    def function_at(typing_context, holder, slot):  # type: ignore[no-untyped-def]
        function_type = types.FunctionType(lanes.lane_signature(signature) if lanes.is_of_lanes(holder) else signature)

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            struct = cgutils.create_struct_proxy(function_type)(context, builder)
            address = address_in_table(context, builder, sig.args[0], args[0], args[1])
            struct.c_addr = struct.jit_addr = builder.inttoptr(address, context.get_value_type(types.voidptr))
            return struct._getvalue()

        return function_type(holder, types.int64), codegen

    return function_at


_A, _M, _INTERVAL = f8[::1], f8[:, ::1], types.UniTuple(f8, 4)
#: Signatures of the package's own functions that a model calls by address, so that only those in use are compiled.
FUNCTIONS = {
    "element_force": f8(_A, _A, _INTERVAL, f8, _M, _A, _M, _A, _A, _A),
    "element_tangent": types.void(_A, _A, _INTERVAL, f8, f8, _M, _A, _M, _A, _A, _M),
    "element_energy": f8(_A, _M, _A, f8, _A),
}


def slot(function: Any) -> int:
    """Index in `ADDRESSES` of a function made by `indirect`, which is entered there once it is loaded."""
    if config.DISABLE_JIT:
        if function not in PLAIN:
            PLAIN.append(function)
        return PLAIN.index(function)
    return int(function.slot)


def at_slots(slots: np.ndarray) -> list[Any]:
    """Functions made by `indirect` at indices that `slot` gave."""
    return [] if config.DISABLE_JIT else [at_slot(int(k)) for k in np.unique(slots)]


element_force_at = by_slot(FUNCTIONS["element_force"])
element_tangent_at = by_slot(FUNCTIONS["element_tangent"])
element_energy_at = by_slot(FUNCTIONS["element_energy"])
force_law_at = _make_lookup(LAWS["force"])
spring_law_at = _make_lookup(LAWS["spring"])
drive_law_at = _make_lookup(LAWS["drive"])
event_law_at = _make_lookup(LAWS["event"])
element_law_at = _make_lookup(LAWS["element"])
force_slope_at = _make_lookup(SLOPES["force"], 1)
spring_slope_at = _make_lookup(SLOPES["spring"], 1)
element_slope_at = _make_lookup(SLOPES["element"], 1)
