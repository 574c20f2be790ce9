"""The one way to compile in this package: decorators, cache folder and user laws as function pointers.

Every compiled function is kept on disk in a folder named by numba's version and a hash of the sources of all the floors
that compile, so that a change in one file can never serve a stale result in another (numba alone looks at a function's
own file only); compiling anything elsewhere in the package is refused. ``NUMBA_DISABLE_JIT=1`` runs everything as
plain Python (coverage, debugging).
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import math
import os
import pathlib
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba import config, f8, i8, njit, types
from numba.core import cgutils
from numba.core.dispatcher import _FunctionCompiler
from numba.core.errors import NumbaError, NumbaExperimentalFeatureWarning, TypingError
from numba.core.targetconfig import TargetConfig
from numba.extending import _Intrinsic, intrinsic

from evolvent.errors import InputError
from evolvent.pointer import has_addresses, load_attribute

# functions in 1-tuples are typed as pointers, which numba calls experimental; tests pin what is used of it
warnings.filterwarnings("ignore", message="First-class function type", category=NumbaExperimentalFeatureWarning)

_PACKAGE = pathlib.Path(__file__).parent


#: Modules and packages that may hold compiled functions or constants that these use.
_COMPILED = ("jit", "pointer", "model", "kernels", "flow", "solvers")


def _sources() -> list[pathlib.Path]:
    """Files of the modules that may hold compiled functions."""
    found = sorted(_PACKAGE.rglob("*.py"))
    return [path for path in found if path.relative_to(_PACKAGE).with_suffix("").parts[0] in _COMPILED]


def _module_name(path: pathlib.Path) -> str:
    return ".".join(("evolvent", *path.relative_to(_PACKAGE).with_suffix("").parts))


def _source_hash() -> str:
    digest = hashlib.sha256()
    for path in _sources():
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

#: Types of arguments: a number, a vector, a matrix, integers.
REAL, VECTOR, MATRIX, INTEGERS = f8, f8[::1], f8[:, ::1], i8[::1]


def _njit(function: Callable, *signature: Any, cache: bool = True, **options: Any) -> Any:
    """Compile without numba's reference counts, which cost more than the arithmetic of a small model.

    Arrays are borrowed from the caller; a kernel that tried to allocate one would not compile.
    """
    options = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True} | options
    previous, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_DIR)
    try:
        return njit(*signature, cache=cache, **options)(function)
    finally:
        config.CACHE_DIR = previous


@contextlib.contextmanager
def _fast_flags() -> Iterator[None]:
    """Let numba hash and compare its compiler flags quickly while it compiles for this package.

    Notes
    -----
    numba 0.68 does so for every operator that it types, by building a dictionary option by option: a fifth of the time
    of compilation. These functions return the same.
    """
    own = {name: getattr(TargetConfig, name) for name in ("__hash__", "values")}
    defaults: dict[Any, dict[str, Any]] = {}

    def values(flags: Any) -> dict[str, Any]:
        kind = type(flags)
        if kind not in defaults:
            defaults[kind] = {name: option.default for name, option in kind.options.items()}
        return defaults[kind] | flags._values

    hashes: dict[Any, int] = {}

    def hash_of(flags: Any) -> int:
        kind = type(flags)
        if kind not in hashes:
            hashes[kind] = own["__hash__"](flags)  # of the names of the options alone
        return hashes[kind]

    TargetConfig.values, TargetConfig.__hash__ = values, hash_of
    try:
        yield
    finally:
        TargetConfig.values, TargetConfig.__hash__ = own["values"], own["__hash__"]


def _check_followed(function: Callable) -> None:
    package, _, module = function.__module__.partition(".")
    if package == "evolvent" and module.split(".")[0] not in _COMPILED:
        raise RuntimeError(f"{function.__module__} is not among the modules whose changes the cache folder follows")


class _IntoCallers(_FunctionCompiler):
    """Compiler of functions that are linked into their callers: typed and lowered, without code of their own."""

    def _customize_flags(self, flags: Any) -> Any:
        flags.no_compile = True
        return flags

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        found = super()._compile_core(args, return_type)
        unused: list[Any] = []
        key = unused.append  # any built-in function of its own, by which numba finds what was compiled
        self.targetdescr.target_context.insert_user_function(key, found.fndesc, [found.library])
        return found._replace(entry_point=key)


class Kernel:
    """A function that compiled code links in; called from Python it is compiled on its own.

    Attributes
    ----------
    py_func : the plain function
    """

    def __init__(self, function: Callable, *, inline: bool) -> None:
        self.py_func = function
        inside = _njit(function, cache=False, forceinline=inline, no_cpython_wrapper=True)
        old = inside._compiler
        inside._compiler = _IntoCallers(function, old.targetdescr, old.targetoptions, old.locals, old.pipeline_class)
        self._inside = inside
        self._numba_type_ = types.Dispatcher(inside)
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:  # noqa: D102
        _unloaded()
        with _fast_flags():
            return self._called(*arguments)

    @functools.cached_property
    def _called(self) -> Any:
        return _njit(self.py_func)


def kernel(function: Callable) -> Any:
    """Compile `function` into its compiled callers, as a function of its own there."""
    _check_followed(function)
    return function if config.DISABLE_JIT else Kernel(function, inline=False)


def inlined(function: Callable) -> Any:
    """As `kernel`, and always inlined into the compiled caller, which is for what is small or called from one place."""
    _check_followed(function)
    return function if config.DISABLE_JIT else Kernel(function, inline=True)


# ------------------------------------------------------------------------------------------------ calls by address

#: Functions of one module that may be called by address.
_SLOTS = 64
_MODULES = [_module_name(path) for path in _sources()]
#: Address of every function made by `indirect`, once it is loaded; a struct that such functions take refers to it.
ADDRESSES = np.zeros(_SLOTS * len(_MODULES), dtype=np.int64)
_counts: dict[str, int] = {}
_BY_SLOT: dict[int, Any] = {}


class Indirect(_Intrinsic):
    """A function with a signature of its own that compiled code calls by its address.

    It is compiled once, whoever calls it, and only where it is loaded: a caller may name functions that a model never
    needs. The address is taken from the table `addresses` of the first struct among the arguments.

    Attributes
    ----------
    py_func : the plain function
    slot : int, its place in `ADDRESSES`
    """

    def __init__(self, function: Callable, signature: Any) -> None:

        def define(typing_context: Any, *arguments: Any) -> Any:
            return self._define(arguments)

        own = inspect.signature(function)
        first = inspect.Parameter("typing_context", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        define.__signature__ = own.replace(parameters=[first, *own.parameters.values()])  # type: ignore[attr-defined]
        super().__init__(function.__name__, define)
        functools.update_wrapper(self, function)
        self.py_func, self.signature = function, signature
        module = function.__module__
        place = _MODULES.index(module) * _SLOTS if module in _MODULES else 0
        number = _counts[module] = _counts.get(module, -1) + 1
        if number >= _SLOTS:
            raise RuntimeError(f"{module} has more than {_SLOTS} functions that are called by address")
        self.slot = place + number
        _BY_SLOT[self.slot] = self
        self._register()

    def _define(self, arguments: tuple[Any, ...]) -> Any:
        signature = self.signature
        if len(arguments) != len(signature.args):
            raise TypingError(f"{self._name} takes {len(signature.args)} arguments, not {len(arguments)}")
        holder = next(k for k, kind in enumerate(signature.args) if has_addresses(kind))
        kind, slot = signature.args[holder], self.slot

        def codegen(context: Any, builder: Any, _: Any, values: Any) -> Any:
            called = context.call_conv.get_function_type(signature.return_type, signature.args).as_pointer()
            table = load_attribute(context, builder, kind, values[holder], "addresses")
            place = builder.gep(table.data, [cgutils.intp_t(slot)])
            address = builder.load(place)
            pointer = builder.inttoptr(address, called)
            status, result = context.call_conv.call_function(
                builder, pointer, signature.return_type, signature.args, values
            )
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return result

        return signature, codegen

    @functools.cached_property
    def dispatcher(self) -> Any:
        """Numba's dispatcher, with nothing compiled yet."""
        return _njit(self.py_func)

    @property
    def is_loaded(self) -> bool:
        """Whether it can be called."""
        return bool(ADDRESSES[self.slot] != _unloaded())

    def load(self) -> None:
        """Compile it, or load it from the cache folder, and enter its address."""
        if not self.is_loaded:
            with _fast_flags():
                self.dispatcher.compile(self.signature)
            ADDRESSES[self.slot] = _pointer(self.dispatcher, self.signature)

    def __call__(self, *arguments: Any) -> Any:  # noqa: D102
        self.load()
        return self.dispatcher(*arguments)


@functools.cache
def _unloaded() -> int:
    """Address of a function that says what is wrong, in the place of all that are not loaded."""

    def fail() -> None:
        raise RuntimeError("a compiled function was called that was not loaded for this model")

    address = _pointer(_njit(fail, types.void()), types.void())
    ADDRESSES[ADDRESSES == 0] = address
    return address


def indirect(signature: Any) -> Callable[[Callable], Any]:
    """Compile a function for `signature`, to be called by address; see `Indirect`."""

    def decorate(function: Callable) -> Any:
        _check_followed(function)
        return function if config.DISABLE_JIT else Indirect(function, signature)

    return decorate


def load(functions: Iterable[Any]) -> None:
    """Load functions made by `indirect`."""
    if config.DISABLE_JIT:
        return
    for function in functions:
        function.load()


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


def _compile_law(signature: Any, function: Callable) -> Any:
    try:
        return _njit(function, signature)
    except (RuntimeError, ImportError) as error:
        # no source file to key the cache by (an interactive prompt), or a law kept under another name of its module
        if isinstance(error, RuntimeError) and "cannot cache" not in str(error):
            raise
        return _njit(function, signature, cache=False)


def _law(kind: str, function: Callable) -> Any:
    if not isinstance(function, FunctionType):
        raise InputError(f"@evolvent.{kind}_law stands before a function, not before {function!r}")
    if config.DISABLE_JIT:
        return function
    try:
        return _compile_law(LAWS[kind], function)
    except (NumbaError, TypeError) as error:
        raise InputError(
            f"{describe_law(function)} cannot be compiled as {FORMS[kind]}: {_one_line(str(error))}"
        ) from error


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
    try:
        result = law(*arguments)
        values = tuple(float(x) for x in (result if isinstance(result, tuple) else (result,)))
    except Exception as error:  # whatever a user's code may raise
        raise InputError(f"{describe_law(law)} fails: {type(error).__name__}: {error}") from error
    if not all(math.isfinite(x) for x in values):
        shown = values if isinstance(result, tuple) else values[0]
        raise InputError(f"{describe_law(law)} returns {shown}; it must return finite numbers")
    return values


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
        Its address goes into the model; editing the law recompiles the law alone. Exceptions reach the user.

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


def slot(function: Any) -> int:
    """Place in `ADDRESSES` of a function made by `indirect`, which is entered there once it is loaded."""
    if config.DISABLE_JIT:
        if function not in _plain_laws:
            _plain_laws.append(function)
        ADDRESSES[:] = np.arange(ADDRESSES.size)
        return _plain_laws.index(function)
    return int(function.slot)


def at_slots(slots: np.ndarray) -> list[Any]:
    """Functions made by `indirect` at places that `slot` gave."""
    return [] if config.DISABLE_JIT else [_BY_SLOT[int(k)] for k in np.unique(slots)]


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
