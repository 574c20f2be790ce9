"""Users' laws: functions for forces, springs, drives and events, compiled and called through pointers."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
from numba import config, njit, types
from numba.core.errors import NumbaError

from evolvent.compiled.jit import Kernel, compilers, pointer_of
from evolvent.compiled.lookups import LAWS, PLAIN, SLOPES
from evolvent_base.errors import InputError, counted

#: How a law of each kind is called, and what it returns.
FORMS = {
    "force": "(x, v, t, parameters) -> (fx, fy, fz)",
    "torque": "(t, x, R, w, parameters) -> (Tx, Ty, Tz)",
    "spring": "(extension, rate, t, parameters) -> tension",
    "drive": "(t, parameters) -> (angle, rate, acceleration)",
    "event": "(t, y, parameters) -> value",
    "element": "(t, x, v, parameters, f) -> (energy, power)",
    "motor": "(t, x, v, parameters) -> torque",
}


def _along(kind: str, function: Callable) -> Callable:
    """A function of the signature `SLOPES[kind]`: the derivative of a law along a direction, by dual numbers."""
    from evolvent.compiled.dual import dual, dual_vector, slope_of  # which takes a moment to tell numba what it defines

    plain = getattr(function, "plain", function)
    law = compilers.without_counts(plain, boundscheck=True)

    def spring(x: Any, dx: Any, v: Any, dv: Any, t: float, parameters: Any) -> Any:
        return slope_of(law(dual(x, dx), dual(v, dv), t, parameters))

    def motor(x: Any, dx: Any, v: Any, dv: Any, t: float, parameters: Any) -> Any:
        return slope_of(law(t, dual(x, dx), dual(v, dv), parameters))

    def force(x: Any, v: Any, t: float, parameters: Any) -> Any:
        fx, fy, fz = law(dual_vector(x), dual_vector(v), t, parameters)
        return slope_of(fx), slope_of(fy), slope_of(fz)

    def force_time_first(x: Any, v: Any, t: float, parameters: Any) -> Any:
        fx, fy, fz = law(t, dual_vector(x), dual_vector(v), parameters)
        return slope_of(fx), slope_of(fy), slope_of(fz)

    def torque(x: Any, v: Any, t: float, parameters: Any) -> Any:
        pose = dual_vector(x)
        fx, fy, fz = law(t, pose[0:3], pose[3:12].reshape(3, 3), dual_vector(v), parameters)
        return slope_of(fx), slope_of(fy), slope_of(fz)

    def element(t: float, x: Any, v: Any, parameters: Any, f: Any) -> float:
        law(t, dual_vector(x), dual_vector(v), parameters, dual_vector(f))
        return 0.0

    made: dict[str, Callable] = {"spring": spring, "motor": motor, "element": element}
    if plain is function:
        made["force"] = force
    else:
        made["force"] = torque if plain.__code__.co_argcount == 5 else force_time_first
    found = made[kind]
    found.__name__, found.__module__ = f"{function.__name__}_slope", function.__module__
    return found


def _slope_address(law: Any, kind: str) -> int:
    """Address of the derivative of a user's law, which the law keeps; 0 where it has none, or is not differentiated.

    Warns
    -----
    UserWarning
        Where it calls what dual numbers cannot pass: it is differentiated by central differences.
    """
    if kind not in SLOPES:
        return 0
    try:
        law.slope = compilers.compile_law(SLOPES[kind], _along(kind, law.py_func))
    except (NumbaError, TypeError) as error:
        why = _one_line(str(error))
        warnings.warn(f"{describe_law(law)} is differentiated by central differences: {why}", stacklevel=2)
        return 0
    return pointer_of(law.slope, SLOPES[kind])


def _require_function(kind: str, function: Any) -> None:
    """Refuse what a decorator cannot turn into a law."""
    if not isinstance(function, FunctionType):
        raise InputError(f"@evolvent.{kind}_law decorates a function, not {function!r}")


def _law(kind: str, function: Callable) -> Any:
    """A law of a kind, which it keeps: laws of several kinds have one machine signature."""
    _require_function(kind, function)
    found = _copied(function) if config.DISABLE_JIT else _compiled(kind, function)
    found.law_kind = kind
    return found


def _copied(function: Any) -> Any:
    """A function that can be a law of another kind as well."""
    found = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    return functools.update_wrapper(found, function)


def _compiled(kind: str, function: Callable) -> Any:
    try:
        # its indices are checked: beyond its parameters stand those of others, and then foreign memory
        compiled = compilers.compile_law(LAWS[kind], function)
    except (NumbaError, TypeError) as error:
        returned = _returned(kind, function)
        why = f"it returns {returned}; it must return {RETURNS[kind]}" if returned else _one_line(str(error))
        raise InputError(f"{describe_law(function)} cannot be compiled as {FORMS[kind]}: {why}") from error
    if compiled.nopython_signatures[0].return_type != LAWS[kind].return_type:  # numba infers none
        raise InputError(f"{describe_law(function)} never returns a value; it must be {FORMS[kind]}")
    return compiled


def _returned(kind: str, function: Callable) -> str:
    """How many numbers a law returns that is compiled for its arguments alone; '' where their number is right."""
    try:
        found = njit(LAWS[kind].args)(function).nopython_signatures[0].return_type
    except Exception:  # noqa: BLE001  (it cannot be compiled for another reason, which is reported)
        return ""
    number = len(found) if isinstance(found, types.BaseTuple) else 1 if isinstance(found, types.Number) else 0
    if number == _COUNTS[kind]:
        return ""
    return counted(number, "number") if number else f"a value of type {found}"


def describe_law(law: Any) -> str:
    """Name of a user's law and where it stands."""
    code = getattr(law, "py_func", law).__code__
    return f"the law {law.__name__!r} ({code.co_filename}:{code.co_firstlineno})"


def _one_line(message: str) -> str:
    """What numba says first, without its account of what it was doing."""
    lines = [line.strip(" >") for line in message.splitlines()]
    kept_lines = [line for line in lines if line and not line.startswith("Failed in nopython mode")]
    return " ".join(kept_lines[: 2 if kept_lines[0].endswith(":") else 1])


#: What a law of each kind returns, in words.
RETURNS = {
    "force": "three finite numbers, (fx, fy, fz)",
    "spring": "one finite number, the tension or torque",
    "drive": "three finite numbers, (angle, rate, acceleration)",
    "event": "one finite number",
    "element": "two finite numbers, (energy, power)",
    "motor": "one finite number, the torque or force",
}
_COUNTS = {"force": 3, "spring": 1, "drive": 3, "event": 1, "element": 2, "motor": 1}


def try_law(
    law: Any, *arguments: Any, described: str = "", parameters: Any = None, kind: str = ""
) -> tuple[float, ...]:
    """What a user's law returns, as a tuple of finite numbers; `described` names it in messages.

    Its parameters are the last argument, or `parameters`. With a `kind` of `RETURNS` their number is checked.

    Raises
    ------
    InputError
        If it raises an exception, or returns anything else.
    """
    described = described or describe_law(law)
    count = len(arguments[-1] if parameters is None else parameters)
    given = "1 parameter is" if count == 1 else f"{count} parameters are"
    try:
        result = law(*arguments)
        values = tuple(float(x) for x in (result if isinstance(result, tuple) else (result,)))
    except Exception as error:  # whatever a user's code may raise
        raise InputError(
            f"{described} fails: {type(error).__name__}: {_what(law, arguments, error)}; {given} given"
        ) from error
    if not all(math.isfinite(x) for x in values) or (kind and len(values) != _COUNTS[kind]):
        shown = values if isinstance(result, tuple) else values[0]
        raise InputError(f"{described} returns {shown}; it must return {RETURNS.get(kind, 'finite numbers')}")
    return values


def _what(law: Any, arguments: tuple[Any, ...], error: Exception) -> str:
    """What an exception of a law says; of an index out of bounds, which one it is, by the law as plain Python."""
    if isinstance(error, IndexError):
        try:
            getattr(law, "py_func", law)(*arguments)
        except IndexError as plain:
            error = plain
        except Exception:  # noqa: BLE001  (another one: its error at compilation is reported)
            pass
    return " ".join(str(error).split())


def force_law(function: Callable) -> Any:
    """Turn ``f(x, v, t, parameters) -> (fx, fy, fz)`` into the law of a load or of an acceleration field.

    Parameters
    ----------
    function : callable
        Receives position `x` : (3,) m and velocity `v` : (3,) m/s in the inertial frame, time `t` : s and the
        `parameters` : (k,) given with the part; returns three numbers: a force per length (N/m), a force (N), a torque
        (N m) or an acceleration (m/s2), depending on the part. If its first argument is named ``t``, the order is
        ``f(t, x, v, parameters)``.

    Returns
    -------
    compiled function
        Its address goes into the model; editing the law recompiles the law alone. Its indices are checked, and a run
        in which it raises an exception fails with a message that names it.

    Notes
    -----
    Globals, closures and helpers, in any file, have the values of the moment at which the law is decorated. A law is
    stored, for the next start, by the content of all that it refers to; where that cannot be decided (a function that
    numba knows from an extension, a class that is compiled) it is compiled at every start.
    """
    code = getattr(function, "__code__", None)
    if code is None or code.co_argcount != 4 or code.co_varnames[0] != "t":
        return _law("force", function)
    x, v, t, parameters = LAWS["force"].args
    inner = _compiled_first(function, (t, x, v, parameters), "(t, x, v, parameters) -> (fx, fy, fz)")

    def ordered(x: Any, v: Any, t: float, parameters: Any) -> Any:
        return inner(t, x, v, parameters)

    return _law("force", _as_force(ordered, function))


def torque_law(function: Callable) -> Any:
    """Turn ``f(t, x, R, w, parameters) -> (Tx, Ty, Tz)`` into the law of a torque, a `Load`, on a body or a rod's node.

    Parameters
    ----------
    function : callable
        Receives the time `t` : s, the position `x` : (3,) m of the point of application and the angular velocity `w` :
        (3,) rad/s in the inertial frame, the rotation matrix `R` : (3, 3) of the body, whose columns are its axes in
        the inertial frame, and the `parameters` : (k,) given with the part; returns the torque (N m), in the axes that
        the part's `frame` names.

    Returns
    -------
    compiled function

    Notes
    -----
    Under energy-momentum the law acts by its mean along a step, in which the body turns about a fixed axis.
    """
    _require_function("torque", function)
    x, v, t, parameters = LAWS["force"].args
    inner = _compiled_first(function, (t, x, types.Array(x.dtype, 2, "C"), v, parameters), FORMS["torque"])

    def ordered(x: Any, v: Any, t: float, parameters: Any) -> Any:
        return inner(t, x[0:3], x[3:12].reshape(3, 3), v, parameters)

    found = _law("force", _as_force(ordered, function))
    found.law_kind = "torque"
    return found


def _as_force(ordered: Any, function: Callable) -> Any:
    """A function of a force law's arguments that calls a user's law, under the law's name and place."""
    code = function.__code__
    named = {"co_filename": code.co_filename, "co_name": code.co_name, "co_firstlineno": code.co_firstlineno}
    ordered.__code__ = ordered.__code__.replace(**named)
    ordered.__name__, ordered.plain = function.__name__, function
    return ordered


def _compiled_first(function: Callable, arguments: tuple[Any, ...], form: str) -> Any:
    """A law of three numbers with arguments in an order of its own, compiled."""
    if config.DISABLE_JIT:
        return function
    try:
        return compilers.compile_law(LAWS["force"].return_type(*arguments), function)
    except (NumbaError, TypeError) as error:
        raise InputError(f"{describe_law(function)} cannot be compiled as {form}: {_one_line(str(error))}") from error


def spring_law(function: Callable) -> Any:
    """Turn ``f(extension, rate, t, parameters) -> tension`` (m, m/s, s -> N) into the law of a spring."""
    return _law("spring", function)


def drive_law(function: Callable) -> Any:
    """Turn ``f(t, parameters) -> (angle, rate, acceleration)`` (rad, rad/s, rad/s2) into the law of a spool."""
    return _law("drive", function)


def event_law(function: Callable) -> Any:
    """Turn ``f(t, y, parameters) -> value`` into an event that fires where the value rises through zero."""
    return _law("event", function)


def element_law(function: Callable) -> Any:
    """Turn ``f(t, x, v, parameters, f) -> (energy, power)`` into the law of a `CustomForce`.

    Parameters
    ----------
    function : callable
        Receives the time `t` : s, positions `x` : (3 k,) m and velocities `v` : (3 k,) m/s of k points, inertial axes,
        point after point, and `parameters` : (n,). It adds to `f` : (3 k,) N, zero at the call, the forces on these
        points, inertial axes, and returns the energy stored (J) and the power dissipated (W).

    Returns
    -------
    compiled function

    Notes
    -----
    The energy balance of a run closes where f . v = -(d/dt)(energy) - power. Of forces that give energy, the power is
    below zero. A law that always returns zeros states no energy: its forces do work, as loads do. Momentum is kept
    where the forces have neither a resultant nor a moment.
    """
    return _law("element", function)


def motor_law(function: Callable) -> Any:
    """Turn ``f(t, x, v, parameters) -> torque`` into the law of a `Motor`.

    Parameters
    ----------
    function : callable
        Receives the time `t` : s, the coordinate `x` : rad or m, its rate `v` : rad/s or m/s, and `parameters` : (n,).
        It returns the torque (N m) or force (N) that drives the coordinate.

    Returns
    -------
    compiled function
    """
    return _law("motor", function)


def require_kind(law: Any, kind: str, key: str) -> None:
    """Refuse a law under the wrong decorator, or under none.

    Parameters
    ----------
    kind : of the law that the key takes; a torque also takes that of a force
    key : such as "spring.law"

    Raises
    ------
    InputError
    """
    own = getattr(law, "law_kind", None)
    if own == kind or (kind == "torque" and own == "force"):
        return
    name = getattr(law, "__name__", repr(law))
    under = f"a law under @evolvent.{own}_law" if own in FORMS else "a function under no decorator for laws"
    raise InputError(f"{key} is {name!r}, {under}; it must be decorated with @evolvent.{kind}_law, as {FORMS[kind]}")


def law_address(law: Any, kind: str, slope: Kernel | None = None) -> int:
    """Address of a pair of addresses, of a compiled law of a `kind` and of its derivative along a direction or 0.

    The caller keeps the law alive as long as the address.

    Parameters
    ----------
    slope : derivative of one of the package's own laws

    Raises
    ------
    TypeError
        If `law` was not made by the decorator of that kind.
    """
    if config.DISABLE_JIT:
        PLAIN.append(law)
        return len(PLAIN) - 1
    if isinstance(law, Kernel):  # the package's own law, which runs an expression
        pair = _pair(law, kind)
        if pair[0] == 0:
            law.load()
            pair[0] = pointer_of(law.dispatcher, LAWS[kind])
            if slope is not None:
                slope.load()
                pair[1] = pointer_of(slope.dispatcher, SLOPES[kind])
        return int(pair.ctypes.data)
    signature = LAWS[kind]
    signatures = getattr(law, "nopython_signatures", None)
    if signatures is None or [s.args for s in signatures] != [signature.args]:
        raise TypeError(f"the law {getattr(law, '__name__', law)!r} must be decorated with @evolvent.{kind}_law")
    pair = _pair(law, kind)
    if pair[0] == 0:
        pair[:] = pointer_of(law, signature), _slope_address(law, kind)
    return int(pair.ctypes.data)


def _pair(law: Any, kind: str) -> np.ndarray:
    """Addresses of a law and of its derivative, which the law keeps."""
    pairs: dict[str, np.ndarray] = law.__dict__.setdefault("_pairs", {})
    return pairs.setdefault(kind, np.zeros(2, dtype=np.int64))
