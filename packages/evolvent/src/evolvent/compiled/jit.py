"""The one way to compile in this package: kernels, functions called by address, and users' laws.

Only functions made by `indirect` have machine code of their own; kernels go into those. `compiled.codecache` says
where that is kept. ``NUMBA_DISABLE_JIT=1`` runs everything as plain Python (coverage, debugging).
"""

from __future__ import annotations

import ctypes
import functools
import importlib
import inspect
import math
import operator
import os
import subprocess
import sys
import time
import warnings
import zlib
from collections.abc import Callable, Iterable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import config, f8, i8, types
from numba.core import cgutils
from numba.core.errors import NumbaExperimentalFeatureWarning, TypingError
from numba.core.typing.templates import infer, make_intrinsic_template

from evolvent.compiled import lanes
from evolvent.compiled.codecache.files import say_once
from evolvent.compiled.codecache.folder import is_own
from evolvent.compiled.codecache.linked import Linked
from evolvent.compiled.interfaces import PLAIN, REASON
from evolvent.compiled.pointer import has_addresses, load_attribute
from evolvent_base import progress

#: How functions are compiled.
compilers: Any = importlib.import_module("evolvent.compiled.plain" if PLAIN else "evolvent.compiled.compilers")

# functions in 1-tuples are typed as pointers, which numba calls experimental; tests pin what is used of it
warnings.filterwarnings("ignore", message="First-class function type", category=NumbaExperimentalFeatureWarning)

#: Types of arguments: a number, a vector, a matrix, integers.
REAL, VECTOR, MATRIX, CUBE, INTEGERS = f8, f8[::1], f8[:, ::1], f8[:, :, ::1], i8[::1]


class Kernel(Linked):
    """A function that compiled code links in; called from Python it is compiled on its own.

    Attributes
    ----------
    py_func : the plain function
    kinds : tuple of the types of its arguments, or of functions that return them, where it is declared by `entry`
    """

    def __init__(self, function: Callable, *, inline: bool) -> None:
        self.py_func, self._inline = function, inline
        self.kinds: tuple[Any, ...] | None = None
        self.is_own, self.options = is_own(function.__module__), f"inline={inline}"
        functools.update_wrapper(self, function)

    def around(self, function: Callable) -> Kernel:
        """Another one, of a copy of its function."""
        return Kernel(function, inline=self._inline)

    @functools.cached_property
    def _numba_type_(self) -> Any:
        """What compiled code sees: a dispatcher whose functions go into their callers."""
        self._inside = compilers.linked(self.py_func, inline=self._inline)
        return types.Dispatcher(self._inside)

    def __call__(self, *arguments: Any) -> Any:  # noqa: D102
        with compilers.compiling:
            return _call(self.dispatcher, arguments)

    @property
    def place(self) -> str:
        """Where it is found in its module."""
        return self.py_func.__qualname__

    @functools.cached_property
    def dispatcher(self) -> Any:
        """Numba's dispatcher for calls from Python, with nothing compiled yet."""
        return compilers.dispatcher(self.py_func)

    @functools.cached_property
    def signature(self) -> tuple[Any, ...] | None:
        """Types of its arguments."""
        if self.kinds is None:
            return None
        return tuple(kind() if inspect.isfunction(kind) else kind for kind in self.kinds)

    @property
    def is_loaded(self) -> bool:
        """Whether it can be called from Python without compilation or loading."""
        return self.signature in self.dispatcher.overloads

    def load(self) -> None:
        """Compile it for calls from Python, or load it from the cache folder."""
        with compilers.compiling:
            self.dispatcher.compile(self.signature)


def kernel(function: Callable) -> Any:
    """Compile `function` into its compiled callers, as its own function there."""
    return function if config.DISABLE_JIT else Kernel(function, inline=False)


def inlined(function: Callable) -> Any:
    """As `kernel`, and always inlined into the compiled caller, which is for what is small or called once."""
    return function if config.DISABLE_JIT else Kernel(function, inline=True)


#: Kernels declared by `entry`.
_ENTRIES: list[Kernel] = []


def entry(*kinds: Any) -> Callable[[Any], Any]:
    """Declare the types of arguments with which Python calls a kernel, so that it can be compiled beforehand."""

    def decorate(function: Any) -> Any:
        if isinstance(function, Kernel):
            function.kinds = kinds
            _ENTRIES.append(function)
        return function

    return decorate


# ------------------------------------------------------------------------------------------------ calls by address

#: Places for functions that are called by address; as many follow, in the same order, for those for lanes.
_SLOTS = TO_LANES = 1 << 20
#: Index 0: address of `_load_now`. The others: of the functions made by `indirect`, that of `_not_loaded`, which stands
#: at index 1, until they are loaded. A struct that such functions take refers to this table.
ADDRESSES = np.zeros(2 + 2 * _SLOTS, dtype=np.int64)
#: Status that `_not_loaded` returns, which no function of numba does.
_NOT_LOADED = -77
_BY_SLOT: dict[int, Any] = {}
#: Functions that were loaded because compiled code called them.
loaded_late: list[Any] = []
#: Why one of them could not be loaded, until that is raised.
_refused: list[BaseException] = []


def _place(name: str) -> int:
    return zlib.crc32(name.encode("utf-8", "surrogatepass")) % _SLOTS


def _free_slot(name: str) -> int:
    """Index for a function of this name: the same in every process, whatever others there are, as its callers have it.

    Only of two of one place the later gets the next one.
    """
    if len(_BY_SLOT) == _SLOTS:
        raise RuntimeError(f"there are more than {_SLOTS} functions that are called by address")
    place = _place(name)
    while 2 + place in _BY_SLOT:
        place = (place + 1) % _SLOTS
    return 2 + place


@ctypes.CFUNCTYPE(None, ctypes.c_int64)
def _load_now(slot: int) -> None:
    """Load a function that compiled code calls, which is not loaded; where it still is not, that code raises."""
    try:
        loaded_late.append(at_slot(slot))
        load([at_slot(slot)])
    except BaseException as error:  # noqa: BLE001  (no exception passes through compiled code)
        _refused.append(error)


@ctypes.CFUNCTYPE(ctypes.c_int32)
def _not_loaded() -> int:
    """Stand for a function that is not loaded, whatever its arguments: its caller tests the status in any case."""
    return _NOT_LOADED


ADDRESSES[:] = ctypes.cast(_not_loaded, ctypes.c_void_p).value or 0
ADDRESSES[0] = ctypes.cast(_load_now, ctypes.c_void_p).value or 0


def _call(compiled: Any, arguments: tuple[Any, ...]) -> Any:
    """What a compiled function returns; where one that it called could not be loaded, the reason is raised."""
    try:
        return compiled(*arguments)
    except RuntimeError:
        if not _refused:
            raise
    raise _refused.pop()


def _load_late(context: Any, builder: Any, table: Any, slot: Any) -> Any:
    """Code that loads a function which is not loaded, and returns from its caller where that fails; its address."""
    unknown = builder.load(builder.gep(table, [cgutils.intp_t(1)]))
    load_now = ir.FunctionType(ir.VoidType(), [unknown.type]).as_pointer()
    builder.call(builder.inttoptr(builder.load(table), load_now), [slot])
    loaded = builder.load(builder.gep(table, [slot]))
    with cgutils.if_unlikely(builder, builder.icmp_unsigned("==", loaded, unknown)):
        context.call_conv.return_user_exc(builder, RuntimeError, ("a function could not be loaded",))
    return loaded


def address_in_table(context: Any, builder: Any, kind: Any, holder: Any, slot: Any) -> Any:
    """Code for the address of a function from the table of a struct; a function that is not loaded is, first."""
    table = load_attribute(context, builder, kind, holder, "addresses").data
    known, unknown = (builder.load(builder.gep(table, [at])) for at in (slot, cgutils.intp_t(1)))
    before = builder.block
    with builder.if_then(builder.icmp_unsigned("==", known, unknown), likely=False):
        loaded = _load_late(context, builder, table, slot)
        after = builder.block
    found = builder.phi(known.type)
    found.add_incoming(known, before)
    found.add_incoming(loaded, after)
    return found


def pointer_of(compiled: Any, signature: Any) -> int:
    """Address of a function that is compiled for a signature."""
    result = compiled.get_compile_result(signature)
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


class Indirect(Linked):
    """A function with its own signature that compiled code calls by its address.

    It is compiled once, whoever calls it, and only where it is called: a caller may name functions that a model never
    needs. The address is taken from the table `addresses` of the first struct among the arguments. What a model needs
    is better loaded beforehand (`load`), in two processes and with its progress reported.

    Attributes
    ----------
    py_func : the plain function
    slot : int, its index in `ADDRESSES`
    used_for : what a model must have for it to be called, as of `evolvent.model.having`; None for nothing
    """

    def __init__(
        self, function: Callable, signature: Any, *, disjoint: bool = False, used_for: Any = None,
        of: Indirect | None = None,
    ) -> None:  # fmt: skip
        self.py_func, self.signature, self._disjoint, self.used_for = function, signature, disjoint, used_for
        self.is_own, self.options = is_own(function.__module__), f"{signature} disjoint={disjoint}"
        functools.update_wrapper(self, function)
        self.place: str = function.__qualname__ if of is None else f"{of.place}.lanes"
        if of is None:
            self.slot = _free_slot(f"{function.__module__}.{self.place}")
            _BY_SLOT[self.slot] = self
        else:
            self.slot = of.slot + TO_LANES

    @functools.cached_property
    def lanes(self) -> Indirect:
        """The same function for copies side by side (`compiled.lanes`)."""
        signature = lanes.lane_signature(self.signature)
        return Indirect(self.py_func, signature, disjoint=self._disjoint, used_for=self.used_for, of=self)

    def around(self, function: Callable) -> Indirect:
        """Itself: its place in the table is its own."""
        return self

    @functools.cached_property
    def _numba_type_(self) -> Any:
        """What compiled code sees: a function of one signature, which calls the address."""
        return _intrinsic(self, self.py_func, self._define)

    def _define(self, arguments: tuple[Any, ...], *, parts: bool = False) -> Any:
        """Signature and code of a call; where lanes may part there, the status of that is what it returns."""
        if (
            any(lanes.is_of_lanes(kind) for kind in arguments)
            and lanes.lane_signature(self.signature) != self.signature
        ):
            return self.lanes._define(arguments, parts=parts)
        signature = self.signature
        if len(arguments) != len(signature.args):
            raise TypingError(f"{self.py_func.__name__} takes {len(signature.args)} arguments, not {len(arguments)}")
        holder = next(k for k, kind in enumerate(signature.args) if has_addresses(kind))
        kind, slot = signature.args[holder], self.slot

        def codegen(context: Any, builder: Any, _: Any, values: Any) -> Any:
            called = context.call_conv.get_function_type(signature.return_type, signature.args).as_pointer()
            table, at = load_attribute(context, builder, kind, values[holder], "addresses").data, cgutils.intp_t(slot)

            no = ir.IntType(1)(0)

            def call(address: Any) -> Any:
                pointer = builder.inttoptr(address, called)
                return context.call_conv.call_function(builder, pointer, signature.return_type, signature.args, values)

            status, result = call(builder.load(builder.gep(table, [at])))
            kept = cgutils.alloca_once_value(builder, result)
            with cgutils.if_unlikely(builder, status.is_error):
                missing = builder.icmp_signed("==", status.code, status.code.type(_NOT_LOADED))
                with builder.if_else(missing) as (is_missing, has_failed):
                    with is_missing:  # the test of the status is needed anyway: a test of the address would cost more
                        again, result = call(_load_late(context, builder, table, at))
                        with cgutils.if_unlikely(builder, again.is_error):
                            context.call_conv.return_status_propagate(builder, again)
                        builder.store(result, kept)
                    with has_failed:
                        with builder.if_then(builder.not_(lanes.has_parted(builder, status.code) if parts else no)):
                            context.call_conv.return_status_propagate(builder, status)
                        if parts:
                            builder.store(builder.sext(status.code, result.type), kept)
            return builder.load(kept)

        return signature, codegen

    @functools.cached_property
    def dispatcher(self) -> Any:
        """Numba's dispatcher, with nothing compiled yet."""
        return compilers.dispatcher(self.py_func, disjoint=self._disjoint)

    @property
    def is_loaded(self) -> bool:
        """Whether its address is in the table."""
        return bool(ADDRESSES[self.slot] != ADDRESSES[1])

    def load(self) -> None:
        """Compile it, or load it from the cache folder, and enter its address."""
        if not self.is_loaded:
            with compilers.compiling:
                if self.signature.args not in self.dispatcher.overloads:
                    self.dispatcher.compile(self.signature)
                    self.dispatcher.disable_compile()
                ADDRESSES[self.slot] = pointer_of(self.dispatcher, self.signature)

    def __call__(self, *arguments: Any) -> Any:  # noqa: D102
        load([self])
        return _call(self.dispatcher, arguments)


class Attempt(Linked):
    """A function for lanes that returns an integer, called so that it returns as well where its lanes part.

    It then returns the status of that (`lanes.PARTED`).
    """

    def __init__(self, of: Indirect) -> None:
        self.of, self.py_func, self.slot, self.signature = of, of.py_func, of.slot, of.signature
        self.is_own, self.options = of.is_own, f"attempt {of.options}"

    def around(self, function: Callable) -> Attempt:
        """Itself."""
        return self

    @functools.cached_property
    def _numba_type_(self) -> Any:
        """What compiled code sees."""
        return _intrinsic(self, self.py_func, functools.partial(self.of._define, parts=True))


def _intrinsic(key: Any, function: Callable, define_call: Callable) -> Any:
    """Type in compiled code of a function whose calls are defined by the types of their arguments."""

    def define(typing_context: Any, *arguments: Any) -> Any:
        return define_call(arguments)

    own = inspect.signature(function)
    first = inspect.Parameter("typing_context", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    define.__signature__ = own.replace(parameters=[first, *own.parameters.values()])  # type: ignore[attr-defined]
    template = make_intrinsic_template(key, define, function.__name__)
    infer(template)
    return types.Function(template)


def unload() -> None:
    """Take every address out of the table, as at the start of a process."""
    ADDRESSES[2:] = ADDRESSES[1]
    loaded_late.clear()


def indirect(signature: Any, *, disjoint: bool = False, used_for: Any = None) -> Callable[[Callable], Any]:
    """Compile a function for `signature`, to be called by address; see `Indirect`.

    `disjoint` promises that the array that it writes to overlaps none of its other arguments: sums then stay in
    registers. It is called only on models that have what it is `used_for` (`evolvent.model.having`), and what its
    module has as `USED_FOR`.
    """

    def decorate(function: Callable) -> Any:
        return function if config.DISABLE_JIT else Indirect(function, signature, disjoint=disjoint, used_for=used_for)

    return decorate


def load(functions: Iterable[Any]) -> None:
    """Load functions made by `indirect` or declared by `entry`; what is in no cache is compiled, in two processes.

    Another process that compiles at the same time is waited for: what both need is compiled once.
    """
    if config.DISABLE_JIT:
        return
    wanted = [function for function in dict.fromkeys(functions) if not function.is_loaded]
    if not wanted:
        return
    with compilers.compiling:  # so that threads see the same dispatchers
        missing = [function for function in wanted if not compilers.is_kept(function.dispatcher, function.signature)]
    if missing:
        _compile(missing)
    for function in wanted:
        function.load()


def count_missing(functions: Iterable[Any]) -> int:
    """How many functions would have to be compiled to load them."""
    left = [one for one in functions if not one.is_loaded]
    return sum(not compilers.is_kept(one.dispatcher, one.signature) for one in left)


def _compile(missing: list[Any]) -> None:
    """Compile functions, the first ones here and the last ones in another process, until both meet."""
    if PLAIN:
        say_once("plain", f"functions are compiled at each start, by plain numba {numba.__version__}: {REASON}")
    weights = [200 + len(function.py_func.__code__.co_code) for function in missing]
    began, aside = time.perf_counter(), None

    def is_left() -> bool:
        """Whether a function is still to be compiled; tells how far the compilation is."""
        done = [other.is_loaded or compilers.is_kept(other.dispatcher, other.signature) for other in missing]
        part = sum(weight for weight, is_done in zip(weights, done, strict=True) if is_done) / sum(weights)
        left = (time.perf_counter() - began) * (1.0 / part - 1.0) if part else math.nan
        progress.report_compilation(progress.Compilation(sum(done), len(missing), left))
        return not all(done)

    with compilers.turn(is_left) as live:
        try:
            if not PLAIN and len(missing) >= 4 and os.cpu_count() != 1 and is_left():
                aside = _compile_aside(missing[::-1])
            for function in missing:
                function.load()
                live()
                is_left()
        finally:
            if aside is not None:
                aside.terminate()
                aside.wait()


def _compile_aside(functions: list[Any]) -> subprocess.Popen | None:
    """Start a process that compiles functions into the cache, but those that are there by then."""
    names = [(function.py_func.__module__, function.place) for function in functions]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    try:
        return subprocess.Popen(
            [sys.executable, "-c", f"from {__name__} import compile_named; compile_named({names!r})"],
            env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    except OSError:
        return None


def at_slot(slot: int) -> Any:
    """Function made by `indirect` at an index of `ADDRESSES`."""
    return _BY_SLOT[slot - _SLOTS].lanes if slot >= 2 + _SLOTS else _BY_SLOT[slot]


def functions() -> list[Any]:
    """All functions made by `indirect` or declared by `entry` in the modules that are loaded."""
    return [*_ENTRIES, *_BY_SLOT.values()]


def compile_named(names: list[tuple[str, str]]) -> None:
    """Compile functions, given as modules and names, into the cache, but those that are there by then."""
    for module, name in names:
        function = operator.attrgetter(name)(importlib.import_module(module))
        if not compilers.is_kept(function.dispatcher, function.signature):
            with compilers.compiling:
                function.dispatcher.compile(function.signature)
