"""Users' laws: functions for forces, springs, drives and events, compiled and called through pointers."""

from __future__ import annotations

import functools
import inspect
import math
import warnings
from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numba import config, njit, types
from numba.core.errors import NumbaError

from evolvent.compiled.jit import Kernel, compilers, pointer_of
from evolvent.compiled.lookups import LAWS, PLAIN, SLOPES
from evolvent_base.errors import InputError, counted

#: Names by which a law may call the time, whose place tells the order of its arguments.
_TIMES = ("t", "time")


class Form(NamedTuple):
    """How laws of a kind are called.

    Attributes
    ----------
    arguments : tuple of str, in the order in which compiled code gives them
    result : str, what they return, as in a signature
    returns : str, the same in words
    numbers : int, how many that is
    time_first : whether the time may be the first argument as well
    """

    arguments: tuple[str, ...]
    result: str
    returns: str
    numbers: int
    time_first: bool = False

    @property
    def orders(self) -> list[tuple[str, ...]]:
        """Orders of the arguments that a law may have."""
        others = tuple(name for name in self.arguments if name != "t")
        return [self.arguments, ("t", *others)] if self.time_first else [self.arguments]

    @property
    def text(self) -> str:
        """Such as "law(extension, rate, t, parameters) -> tension"."""
        return f"law({', '.join(self.arguments)}) -> {self.result}"


#: By kind: what the keys of parts that hold a law call.
FORMS = {
    "force": Form(("x", "v", "t", "parameters"), "(fx, fy, fz)", "three finite numbers, (fx, fy, fz)", 3, True),
    "torque": Form(("t", "x", "R", "w", "parameters"), "(Tx, Ty, Tz)", "three finite numbers, (Tx, Ty, Tz)", 3),
    "spring": Form(("x", "v", "t", "parameters"), "force", "one finite number, the force or torque", 1, True),
    "drive": Form(
        ("t", "parameters"), "(angle, rate, acceleration)", "three finite numbers, (angle, rate, acceleration)", 3
    ),
    "event": Form(("t", "y", "parameters"), "value", "one finite number", 1),
    "element": Form(("t", "x", "v", "parameters", "f"), "(energy, power)", "two finite numbers, (energy, power)", 2),
}
#: Kinds whose keys take laws of another kind as well.
_ALSO = {"torque": ("force",)}


def law(function: Callable) -> UserLaw:
    """Make a Python function the law of a part.

    The key of the part that holds it says how it is called, and what it returns: `evolvent parts spring` shows it, as
    ``law(x, v, t, parameters) -> force``. Arguments go by their position. In laws of four arguments the time may be the
    first one, which is then called ``t`` or ``time``.

    Parameters
    ----------
    function : callable
        A plain function of numbers and arrays in SI units, which numba compiles.

    Returns
    -------
    UserLaw
        It is compiled where a part takes it, and called without Python from then on. Its indices are checked, and a run
        in which it raises an exception fails with a message that names it.

    Raises
    ------
    InputError
        If it is no function.

    Notes
    -----
    Globals, closures and helpers, in any file, have the values of the moment at which the law is decorated. A law is
    stored, for the next start, by the content of all that it refers to; where that cannot be decided (a function that
    numba knows from an extension, a class that is compiled) it is compiled at every start.

    Examples
    --------
    >>> import evolvent
    >>> @evolvent.law
    ... def hardening(x, v, t, parameters):
    ...     return parameters[0] * x + parameters[1] * x**3
    """
    return UserLaw(function)


class UserLaw:
    """A Python function as a law, see `law`; called from Python it is the function itself.

    Parameters
    ----------
    function : the function
    """

    py_func: Callable

    def __init__(self, function: Callable) -> None:
        if not isinstance(function, FunctionType):
            raise InputError(f"@evolvent.law decorates a function, not {function!r}")
        functools.update_wrapper(self, function)
        self.py_func = function
        self._kept = None if config.DISABLE_JIT else compilers.keep(function)
        self._of: dict[str, Any] = {}

    def __call__(self, *arguments: Any) -> Any:
        """What the function returns."""
        return self.py_func(*arguments)

    def __reduce__(self) -> str:
        return self.py_func.__qualname__

    def of(self, kind: str, key: str = "") -> Any:
        """The law compiled as one of a kind, once.

        Parameters
        ----------
        kind : of `FORMS`
        key : of the part that takes it, such as "spring.law", for messages

        Raises
        ------
        InputError
            If its arguments are not those of the kind, or it cannot be compiled.
        """
        if kind not in self._of:
            own, order = self._form(kind, key)
            self._of[kind] = self._made(own, order, f"{key}: " if key else "")
            self._of[kind].law_kind = own
        return self._of[kind]

    def _form(self, kind: str, key: str) -> tuple[str, tuple[str, ...]]:
        """Kind and order of arguments that the function has, of those that a kind takes."""
        given = [one for one in inspect.signature(self.py_func).parameters.values() if one.kind in _BY_POSITION]
        least = sum(one.default is inspect.Parameter.empty for one in given)
        most = math.inf if self.py_func.__code__.co_flags & inspect.CO_VARARGS else len(given)
        places = [k for k, one in enumerate(given) if one.name in _TIMES]
        orders = [(one, order) for one in (kind, *_ALSO.get(kind, ())) for order in FORMS[one].orders]
        for one, order in orders:
            if least <= len(order) <= most and (not places or order.index("t") in places):
                return one, order
        shown = " or ".join(FORMS[one].text for one in (kind, *_ALSO.get(kind, ())))
        if any(least <= len(order) <= most for _, order in orders):
            has = f"has the time as argument {places[0] + 1}"
        else:
            has = f"takes {counted(len(given), 'argument')}"
        raise InputError(f"{key or 'the key'} is {describe_law(self)}, which {has}; it must be {shown}")

    def _made(self, kind: str, order: tuple[str, ...], where: str) -> Any:
        """The compiled function with the arguments that compiled code gives for a kind."""
        machine = "force" if kind == "torque" else kind
        plain: Any = _copied(self.py_func) if config.DISABLE_JIT else self._kept
        if order == FORMS[machine].arguments:
            return plain if config.DISABLE_JIT else self._compiled(kind, LAWS[machine], plain, where)
        arguments = dict(zip(FORMS[machine].arguments, LAWS[machine].args, strict=True))
        arguments |= {"w": arguments.get("v"), "R": types.Array(types.float64, 2, "C")}
        signature = LAWS[machine].return_type(*(arguments[name] for name in order))
        inner = plain if config.DISABLE_JIT else self._compiled(kind, signature, plain, where)

        def torque(x: Any, v: Any, t: float, parameters: Any) -> Any:
            return inner(t, x[0:3], x[3:12].reshape(3, 3), v, parameters)

        def time_first(x: Any, v: Any, t: float, parameters: Any) -> Any:
            return inner(t, x, v, parameters)

        outer = _named(torque if kind == "torque" else time_first, self.py_func)
        if config.DISABLE_JIT:
            return outer
        found = self._compiled(kind, LAWS[machine], compilers.keep(outer), where)
        found.plain = self.py_func
        return found

    def _compiled(self, kind: str, signature: Any, kept: Any, where: str) -> Any:
        """A kept function, compiled; its indices are checked: beyond its parameters stand those of others."""
        form = FORMS[kind]
        try:
            compiled = compilers.compile_law(signature, kept)
        except (NumbaError, TypeError) as error:
            returned = _returned(form, signature, self.py_func)
            if returned:
                raise InputError(f"{where}{describe_law(self)} returns {returned}; it must be {form.text}") from error
            why = _one_line(str(error))
            raise InputError(f"{where}{describe_law(self)} cannot be compiled as {form.text}: {why}") from error
        if compiled.nopython_signatures[0].return_type != signature.return_type:  # numba infers none
            raise InputError(f"{where}{describe_law(self)} never returns a value; it must be {form.text}")
        return compiled


_BY_POSITION = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


def _named(outer: Any, function: Any) -> Any:
    """A function that calls a user's, under its name and place."""
    code = function.__code__
    named = {"co_filename": code.co_filename, "co_name": code.co_name, "co_firstlineno": code.co_firstlineno}
    outer.__code__ = outer.__code__.replace(**named)
    outer.__name__ = function.__name__
    return outer


def _along(kind: str, law: Any) -> Callable:
    """A function of the signature `SLOPES[kind]`: the derivative of a law along a direction, by dual numbers."""
    from evolvent.compiled.dual import dual, dual_vector, slope_of  # which takes a moment to tell numba what it defines

    outer = getattr(law, "plain", None)
    plain = law.py_func if outer is None else outer
    inner = compilers.without_counts(plain, boundscheck=True)

    def spring(x: Any, dx: Any, v: Any, dv: Any, t: float, parameters: Any) -> Any:
        return slope_of(inner(dual(x, dx), dual(v, dv), t, parameters))

    def spring_time_first(x: Any, dx: Any, v: Any, dv: Any, t: float, parameters: Any) -> Any:
        return slope_of(inner(t, dual(x, dx), dual(v, dv), parameters))

    def force(x: Any, v: Any, t: float, parameters: Any) -> Any:
        fx, fy, fz = inner(dual_vector(x), dual_vector(v), t, parameters)
        return slope_of(fx), slope_of(fy), slope_of(fz)

    def force_time_first(x: Any, v: Any, t: float, parameters: Any) -> Any:
        fx, fy, fz = inner(t, dual_vector(x), dual_vector(v), parameters)
        return slope_of(fx), slope_of(fy), slope_of(fz)

    def torque(x: Any, v: Any, t: float, parameters: Any) -> Any:
        pose = dual_vector(x)
        fx, fy, fz = inner(t, pose[0:3], pose[3:12].reshape(3, 3), dual_vector(v), parameters)
        return slope_of(fx), slope_of(fy), slope_of(fz)

    def element(t: float, x: Any, v: Any, parameters: Any, f: Any) -> float:
        inner(t, dual_vector(x), dual_vector(v), parameters, dual_vector(f))
        return 0.0

    made: dict[tuple[str, bool], Callable] = {
        ("spring", True): spring_time_first,
        ("spring", False): spring,
        ("force", True): torque if law.law_kind == "torque" else force_time_first,
        ("force", False): force,
        ("element", False): element,
    }
    found = made[kind, outer is not None]
    found.__name__, found.__module__ = f"{plain.__name__}_slope", plain.__module__
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
        law.slope = compilers.compile_law(SLOPES[kind], compilers.keep(_along(kind, law)))
    except (NumbaError, TypeError) as error:
        why = _one_line(str(error))
        warnings.warn(f"{describe_law(law)} is differentiated by central differences: {why}", stacklevel=2)
        return 0
    return pointer_of(law.slope, SLOPES[kind])


def _copied(function: Any) -> Any:
    """A function that can be a law of another kind as well."""
    found = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    return functools.update_wrapper(found, function)


def _returned(form: Form, signature: Any, function: Callable) -> str:
    """How many numbers a law returns that is compiled for its arguments alone; '' where their number is right."""
    try:
        found = njit(signature.args)(function).nopython_signatures[0].return_type
    except Exception:  # noqa: BLE001  (it cannot be compiled for another reason, which is reported)
        return ""
    number = len(found) if isinstance(found, types.BaseTuple) else 1 if isinstance(found, types.Number) else 0
    if number == form.numbers:
        return ""
    if found == types.none:
        return "nothing"
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


def try_law(
    law: Any, *arguments: Any, described: str = "", parameters: Any = None, kind: str = ""
) -> tuple[float, ...]:
    """What a user's law returns, as a tuple of finite numbers; `described` names it in messages.

    Its parameters are the last argument, or `parameters`. With a `kind` of `FORMS` their number is checked.

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
    if not all(math.isfinite(x) for x in values) or (kind and len(values) != FORMS[kind].numbers):
        shown = values if isinstance(result, tuple) else values[0]
        raise InputError(
            f"{described} returns {shown}; it must return {FORMS[kind].returns if kind else 'finite numbers'}"
        )
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


def required(law: Any, kind: str, key: str) -> Any:
    """The compiled function of what a key holds: a law under `law`; any other function is refused.

    Parameters
    ----------
    kind : of the law that the key takes
    key : such as "spring.law"

    Raises
    ------
    InputError
    """
    if isinstance(law, UserLaw):
        return law.of(kind, key)
    name = getattr(law, "__name__", repr(law))
    raise InputError(
        f"{key} is {name!r}, a function that is no law; decorate it with @evolvent.law, as {FORMS[kind].text}"
    )


def law_address(law: Any, kind: str, slope: Kernel | None = None) -> int:
    """Address of a pair of addresses, of a compiled law of a `kind` and of its derivative along a direction or 0.

    The caller keeps the law alive as long as the address.

    Parameters
    ----------
    slope : derivative of one of the package's own laws

    Raises
    ------
    TypeError
        If `law` was not made by `UserLaw.of` for that kind.
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
        raise TypeError(f"{getattr(law, '__name__', law)!r} is no compiled law of kind {kind!r}")
    pair = _pair(law, kind)
    if pair[0] == 0:
        pair[:] = pointer_of(law, signature), _slope_address(law, kind)
    return int(pair.ctypes.data)


def _pair(law: Any, kind: str) -> np.ndarray:
    """Addresses of a law and of its derivative, which the law keeps."""
    pairs: dict[str, np.ndarray] = law.__dict__.setdefault("_pairs", {})
    return pairs.setdefault(kind, np.zeros(2, dtype=np.int64))
