"""The one way to compile in this package: decorators, cache folder and user laws as function pointers.

Every compiled function is kept on disk in a folder named by numba's version and a hash of the sources of all the floors
that compile, so that a change in one file can never serve a stale result in another (numba alone looks at a function's
own file only); compiling anything elsewhere in the package is refused. ``NUMBA_DISABLE_JIT=1`` runs everything as
plain Python (coverage, debugging).
"""

from __future__ import annotations

import functools
import hashlib
import math
import os
import pathlib
import tempfile
import warnings
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numba
from numba import config, f8, njit, types
from numba.core import cgutils
from numba.core.errors import NumbaError, NumbaExperimentalFeatureWarning
from numba.extending import intrinsic

from evolvent.errors import InputError

# functions in 1-tuples are typed as pointers, which numba calls experimental; tests pin what is used of it
warnings.filterwarnings("ignore", message="First-class function type", category=NumbaExperimentalFeatureWarning)

_PACKAGE = pathlib.Path(__file__).parent


#: Modules and packages that may hold compiled functions or constants that these use.
_COMPILED = ("jit", "model", "kernels", "flow", "solvers")


def _source_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        if path.relative_to(_PACKAGE).with_suffix("").parts[0] not in _COMPILED:
            continue
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _find_cache_dir() -> pathlib.Path:
    """First writable of ``$EVOLVENT_CACHE``, the user's cache folder and one of theirs in the temporary folder."""
    name = f"numba-{numba.__version__}-{_source_hash()}"
    user = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    shared = os.path.join(tempfile.gettempdir(), f"evolvent-{os.getuid() if hasattr(os, 'getuid') else 'user'}")
    candidates = [os.environ.get("EVOLVENT_CACHE"), os.path.join(user, "evolvent"), shared]
    for base in candidates:
        if not base:
            continue
        folder = pathlib.Path(base) / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            continue
    return pathlib.Path(tempfile.mkdtemp(prefix="evolvent-cache-")) / name


CACHE_DIR = _find_cache_dir()


def _compile(signature: Any, function: Callable, *, inline: bool = False, bounds: bool = False) -> Any:
    # without numba's reference counts: they cost more than the arithmetic of a small model; arrays are then borrowed
    # from the caller, and a kernel that tried to allocate one would not compile
    options: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "forceinline": inline}
    if bounds:
        options["boundscheck"] = True
    args = () if signature is None else (signature,)
    previous, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_DIR)
    try:
        return njit(*args, cache=True, **options)(function)
    except (RuntimeError, ImportError) as error:
        # no source file to key the cache by (an interactive prompt), or a law kept under another name of its module
        if isinstance(error, RuntimeError) and "cannot cache" not in str(error):
            raise
        return njit(*args, **options)(function)
    finally:
        config.CACHE_DIR = previous


def _check_followed(function: Callable) -> None:
    package, _, module = function.__module__.partition(".")
    if package == "evolvent" and module.split(".")[0] not in _COMPILED:
        raise RuntimeError(f"{function.__module__} is not among the modules whose changes the cache folder follows")


def kernel(function: Callable) -> Any:
    """Compile `function` when it is first called, once per argument types, and keep it on disk."""
    _check_followed(function)
    return _compile(None, function)


def inlined(function: Callable) -> Any:
    """As `kernel`, and always inlined into the compiled caller.

    Arrays of a model fill some 150 machine words when they are passed on; inlining what is small or called from one
    place took the right-hand side of a 20-node thread from 650 to 270 ns.
    """
    _check_followed(function)
    return _compile(None, function, inline=True)


@functools.cache
def bind(function: Any, signature: Any) -> Any:
    """Compile `function` for one explicit `signature`, so that a 1-tuple of it is typed as a function pointer."""
    if config.DISABLE_JIT:
        return function
    return _compile(signature, function.py_func)


# ------------------------------------------------------------------------------------------------ user laws

_VECTOR = types.UniTuple(f8, 3)
#: Signatures of the laws that a user may write, by kind.
LAWS = {
    "force": _VECTOR(f8[::1], f8[::1], f8, f8[::1]),
    "spring": f8(f8, f8, f8, f8[::1]),
    "feed": _VECTOR(f8, f8[::1]),
    "event": f8(f8, f8[::1], f8[::1]),
}
# only used without compilation: addresses are then places in this list; 0 stands for no law
_plain_laws: list[Any] = [None]


#: How a law of each kind is called, and what it returns.
FORMS = {
    "force": "(x, v, t, parameters) -> (fx, fy, fz)",
    "spring": "(extension, rate, t, parameters) -> tension",
    "feed": "(t, parameters) -> (angle, rate, acceleration)",
    "event": "(t, y, parameters) -> value",
}


def _law(kind: str, function: Callable) -> Any:
    if not isinstance(function, FunctionType):
        raise InputError(f"@evolvent.{kind}_law stands before a function, not before {function!r}")
    if config.DISABLE_JIT:
        return function
    try:
        # its indices are checked: beyond its parameters stand those of others, and then foreign memory
        compiled = _compile(LAWS[kind], function, bounds=True)
    except (NumbaError, TypeError) as error:
        raise InputError(
            f"{describe_law(function)} cannot be compiled as {FORMS[kind]}: {_one_line(str(error))}"
        ) from error
    if compiled.nopython_signatures[0].return_type != LAWS[kind].return_type:  # numba infers none
        raise InputError(f"{describe_law(function)} never returns a value; it must be {FORMS[kind]}")
    return compiled


def describe_law(law: Any) -> str:
    """Name of a user's law and where it stands."""
    code = getattr(law, "py_func", law).__code__
    return f"the law {law.__name__!r} ({code.co_filename}:{code.co_firstlineno})"


def _one_line(message: str) -> str:
    """What numba says first, without its account of what it was doing."""
    lines = [line.strip(" >") for line in message.splitlines()]
    said = [line for line in lines if line and not line.startswith("Failed in nopython mode")]
    return " ".join(said[: 2 if said[0].endswith(":") else 1])


def try_law(law: Any, *arguments: Any) -> tuple[float, ...]:
    """What a user's law returns, as a tuple of finite numbers.

    Raises
    ------
    InputError
        If it raises an exception, or returns anything else.
    """
    count = len(arguments[-1])
    given = "1 parameter is" if count == 1 else f"{count} parameters are"
    try:
        result = law(*arguments)
        values = tuple(float(x) for x in (result if isinstance(result, tuple) else (result,)))
    except Exception as error:  # whatever a user's code may raise
        raise InputError(
            f"{describe_law(law)} fails: {type(error).__name__}: {_what(law, arguments, error)}; {given} given"
        ) from error
    if not all(math.isfinite(x) for x in values):
        shown = values if isinstance(result, tuple) else values[0]
        raise InputError(f"{describe_law(law)} returns {shown}; it must return finite numbers")
    return values


def _what(law: Any, arguments: tuple[Any, ...], error: Exception) -> str:
    """What an exception of a law says; of an index out of bounds, which one it is, by the law as plain Python."""
    if isinstance(error, IndexError):
        try:
            getattr(law, "py_func", law)(*arguments)
        except IndexError as plain:
            error = plain
        except Exception:  # noqa: BLE001  (another one: what it said when compiled stands)
            pass
    return " ".join(str(error).split())


def force_law(function: Callable) -> Any:
    """Turn ``f(x, v, t, parameters) -> (fx, fy, fz)`` into a distributed load law.

    Parameters
    ----------
    function : callable
        Receives position `x` : (3,) m and velocity `v` : (3,) m/s in the inertial frame, time `t` : s and the
        `parameters` : (k,) given with the load; returns force per length, N/m, inertial frame.

    Returns
    -------
    compiled function
        Its address goes into the model; editing the law recompiles the law alone. Its indices are checked, and a run
        in which it raises an exception fails with a message that names it.

    Notes
    -----
    Keep helpers of a law in the same file: a change in another user file is not noticed by the cache.
    """
    return _law("force", function)


def spring_law(function: Callable) -> Any:
    """Turn ``f(extension, rate, t, parameters) -> tension`` (m, m/s, s -> N) into the law of a spring."""
    return _law("spring", function)


def feed_law(function: Callable) -> Any:
    """Turn ``f(t, parameters) -> (angle, rate, acceleration)`` (rad, rad/s, rad/s2) into the law of a spool."""
    return _law("feed", function)


def event_law(function: Callable) -> Any:
    """Turn ``f(t, y, parameters) -> value`` into an event that fires where the value rises through zero."""
    return _law("event", function)


def _pointer(compiled: Any, signature: Any) -> int:
    """Address of a function that is compiled for a signature."""
    result = compiled.get_compile_result(signature)
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def law_address(law: Any, kind: str) -> int:
    """Address of a compiled law of the given `kind`; the caller keeps the law alive as long as the address.

    Raises
    ------
    TypeError
        If `law` was not made by the decorator of that kind.
    """
    if config.DISABLE_JIT:
        _plain_laws.append(law)
        return len(_plain_laws) - 1
    signature = LAWS[kind]
    signatures = getattr(law, "nopython_signatures", None)
    if signatures is None or [s.args for s in signatures] != [signature.args]:
        raise TypeError(f"the law {getattr(law, '__name__', law)!r} must be decorated with @evolvent.{kind}_law")
    return _pointer(law, signature)


def _make_lookup(signature: Any) -> Any:
    """A compiled function int64 -> callable of `signature`."""
    if config.DISABLE_JIT:
        return _plain_laws.__getitem__

    @intrinsic
    def law_at(typing_context, address):  # type: ignore[no-untyped-def]
        function_type = types.FunctionType(signature)

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            struct = cgutils.create_struct_proxy(function_type)(context, builder)
            pointer = builder.inttoptr(args[0], context.get_value_type(types.voidptr))
            struct.c_addr = pointer
            struct.jit_addr = pointer
            return struct._getvalue()

        return function_type(types.int64), codegen

    return law_at


_A, _M = f8[::1], f8[:, ::1]
#: Signatures of the package's own functions that a model calls by address, so that only those in use are compiled.
FUNCTIONS = {
    "cell_force": f8(_A, _A, f8, _M, _A, _M, _A, _A),
    "cell_tangent": types.void(_A, _A, f8, f8, _M, _A, _M, _A, _M),
    "cell_energy": f8(_A, _M, _A, f8, _A),
}


@functools.cache
def address(function: Any, kind: str) -> int:
    """Address of one of the package's functions, compiled for the signature of its kind."""
    compiled = bind(function, FUNCTIONS[kind])
    if config.DISABLE_JIT:
        _plain_laws.append(compiled)
        return len(_plain_laws) - 1
    return _pointer(compiled, FUNCTIONS[kind])


cell_force_at = _make_lookup(FUNCTIONS["cell_force"])
cell_tangent_at = _make_lookup(FUNCTIONS["cell_tangent"])
cell_energy_at = _make_lookup(FUNCTIONS["cell_energy"])
force_law_at = _make_lookup(LAWS["force"])
spring_law_at = _make_lookup(LAWS["spring"])
feed_law_at = _make_lookup(LAWS["feed"])
event_law_at = _make_lookup(LAWS["event"])


def is_warm(name: str) -> bool:
    """Whether a solver called `name` has been compiled into this cache folder before."""
    return bool(config.DISABLE_JIT) or (CACHE_DIR / f"warm-{name}").exists()


def mark_warm(name: str) -> None:
    """Remember that the solver called `name` now stands in the cache folder."""
    if not config.DISABLE_JIT:
        CACHE_DIR.mkdir(parents=True, exist_ok=True)
        (CACHE_DIR / f"warm-{name}").touch()
