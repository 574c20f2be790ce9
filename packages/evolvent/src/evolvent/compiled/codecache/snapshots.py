"""Users' functions as they are now: with the values of their globals, and a digest of all that they are compiled from.

Numba compiles globals and closures as constants, but looks at a function's own file and bytecode where it keeps the
result. Here the content of all that a function refers to enters the digest, function by function; and the function
that is compiled refers to copies, so that a helper is compiled with the same values as the digest has.
"""

from __future__ import annotations

import dis
import enum
import functools
import hashlib
import os
import platform
import sys
import sysconfig
import uuid
from collections.abc import Callable
from types import BuiltinFunctionType, CellType, CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic
from numba.core.registry import CPUDispatcher
from numba.core.typing.templates import builtin_registry

from evolvent.compiled.codecache.contents import linked_digest
from evolvent.compiled.codecache.linked import Linked, names_in

#: Packages whose functions are known by their names and versions; the standard library is found by its folder.
_LIBRARIES = ("builtins", "numpy", "scipy", "numba", "llvmlite", "evolvent")
_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(Ellipsis))
_DEEPEST = 100


class Snapshot(NamedTuple):
    """A function with the values that it refers to.

    Attributes
    ----------
    function : its copy, to be compiled, whose name in machine code is that of no other content
    digest : str, of all that it is compiled from; '' where that cannot be decided
    signed : list of (dispatcher, signatures), helpers that are compiled for these alone, before the function
    """

    function: Callable
    digest: str
    signed: list[tuple[Any, list[Any]]]


def snapshot(function: Callable) -> Snapshot:
    """A copy of a function, of its helpers and of the values that both refer to, and their digest."""
    walk = _Walk()
    copy = walk.function(function, 0)
    digest = walk.digest.hexdigest() if walk.is_decided and not foreign_overloads() else ""
    for one in walk.copies:  # functions of the same name in stored code must not be taken for these
        one.__qualname__ = f"{one.__qualname__}-{digest or uuid.uuid4().hex}"
    return Snapshot(copy, digest, walk.signed)


class _Walk:
    """What a function refers to, followed to the end.

    Attributes
    ----------
    digest : of everything that was met
    is_decided : bool, whether all of it is known by its content, or by name and version
    copies : functions that were made
    signed : see `Snapshot`
    """

    def __init__(self) -> None:
        self.digest = hashlib.sha256()
        self.is_decided = True
        self.copies: list[Any] = []
        self.signed: list[tuple[Any, list[Any]]] = []
        self._seen: dict[int, tuple[int, Any, Any]] = {}
        self._followed: set[int] = set()
        self._modules: dict[tuple[int, frozenset[str]], tuple[Any, Any]] = {}
        self._feed(platform.python_version(), *(f"{name} {_version(name)}" for name in _LIBRARIES))

    def _feed(self, *words: str | bytes) -> None:
        for word in words:
            content = word if isinstance(word, bytes) else word.encode("utf-8", "surrogatepass")
            self.digest.update(len(content).to_bytes(8, "little") + content)

    # ------------------------------------------------------------------------------------------ functions

    def function(self, function: Any, depth: int, *, value: Any = None, wrap: Callable | None = None) -> Any:
        """A copy of a plain function, or of the compiled function `value` that `wrap` makes of such a copy."""
        code, space = function.__code__, function.__globals__
        own: dict[str, Any] = dict(space)
        cells = [CellType() for _ in code.co_freevars]
        copy = FunctionType(code, own, function.__name__, function.__defaults__, tuple(cells) or None)
        copy.__kwdefaults__, copy.__qualname__ = function.__kwdefaults__, function.__qualname__
        copy.__module__, copy.__doc__ = function.__module__, function.__doc__
        self.copies.append(copy)
        made = copy if wrap is None else wrap(copy)
        if wrap is not None:
            self._remember(value, made)  # before it is followed: it may call itself
            self._followed.add(id(value))
        self._feed("function", str(function.__module__), function.__qualname__)
        if space.get("__name__") not in sys.modules:  # which stored code asks for by name
            self.is_decided = False
        self._code(code, depth)
        self.value(function.__defaults__, depth + 1)
        self.value(function.__kwdefaults__, depth + 1)
        names = names_in(code)
        for name, cell, given in zip(code.co_freevars, cells, function.__closure__ or (), strict=True):
            self._feed(name)
            try:
                cell.cell_contents = self.value(given.cell_contents, depth + 1, names=names)
            except ValueError:  # it is empty
                self.is_decided = False
        for name in sorted(names & space.keys()):
            self._feed(name)
            own[name] = self.value(space[name], depth + 1, names=names)
        self._followed.discard(id(value))
        return made

    def _code(self, code: CodeType, depth: int) -> None:
        numbers = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        self._feed(code.co_exceptiontable, repr(numbers), repr(code.co_names))
        self._feed(repr(code.co_varnames), repr(code.co_freevars), repr(code.co_cellvars))
        # exceptions in machine code name their places
        self._feed(code.co_filename, str(code.co_firstlineno))
        for one in dis.get_instructions(code):
            line = one.positions.lineno if one.positions is not None else None
            if one.opname == "NOP":  # for a docstring under -OO, where constants have other numbers
                continue
            if one.opcode not in dis.hasconst:
                self._feed(f"{one.opcode} {one.arg} {line}")
                continue
            self._feed(f"{one.opcode} {line}")
            if isinstance(one.argval, CodeType):
                self._code(one.argval, depth)
            else:
                self.value(one.argval, depth + 1)

    def _compiled(self, value: Any, depth: int) -> Any:
        """A copy of a compiled function, with nothing compiled yet."""
        if isinstance(value, Linked):
            if value.is_own:
                self._feed("of the package", linked_digest(value))
                return value
            self._feed("linked", value.options)
            made = self.function(value.py_func, depth + 1, value=value, wrap=value.around)
            return self._undecided(value) if made is value else made
        pipeline = value._compiler.pipeline_class
        signatures = [] if value._can_compile else list(value.nopython_signatures)
        self._feed("compiled", repr(sorted(value.locals.items())), f"{pipeline.__module__}.{pipeline.__qualname__}")
        self._feed(repr(signatures), str(value._can_compile))
        options = self.value(dict(value.targetoptions), depth + 1)
        if type(value) is not CPUDispatcher or not pipeline.__module__.startswith("numba."):
            self.is_decided = False

        def wrap(copy: Callable) -> Any:
            return type(value)(copy, value.locals, options, pipeline)

        made = self.function(value.py_func, depth + 1, value=value, wrap=wrap)
        if not value._can_compile:
            self.signed.append((made, signatures))
        return made

    # ------------------------------------------------------------------------------------------ values

    def value(self, value: Any, depth: int, *, names: frozenset[str] = frozenset()) -> Any:
        """A copy of a value that compiled code takes as a constant; of a module what `names` ask of it."""
        if type(value) in _PLAIN:
            self._feed(type(value).__name__, repr(value))
            return value
        if depth > _DEEPEST:
            return self._undecided(value)
        if isinstance(value, ModuleType):
            return self._module(value, depth, names)
        if id(value) in self._seen:
            number, copy, _ = self._seen[id(value)]
            self._feed("seen", str(number))
            if id(value) in self._followed:  # stored machine code of what calls itself ends the process (numba 0.68)
                self.is_decided = False
            return copy
        if isinstance(value, Dispatcher | Linked):
            return self._compiled(value, depth)
        if isinstance(value, np.ndarray | np.generic):
            return self._numbers(value)
        if type(value) in (tuple, list, dict, set, frozenset):
            return self._several(value, depth)
        return self._other(value, depth)

    def _remember(self, value: Any, copy: Any) -> None:
        self._seen[id(value)] = len(self._seen), copy, value  # itself as well: no other gets its address

    def _undecided(self, value: Any) -> Any:
        self.is_decided = False
        return value

    def _module(self, module: ModuleType, depth: int, names: frozenset[str]) -> Any:
        """A module: of one of the user, a copy whose attributes are copies."""
        self._feed("module", module.__name__)
        key = (id(module), names)
        if key in self._modules:
            return self._modules[key][0]
        is_library = _is_library(module.__name__)
        copy = module if is_library else ModuleType(module.__name__)
        self._modules[key] = copy, module
        if not is_library:
            copy.__dict__.update(module.__dict__)
            if "__getattr__" in module.__dict__:
                self.is_decided = False
        for name in sorted(names & module.__dict__.keys()):
            self._feed(name)
            own = self.value(module.__dict__[name], depth + 1, names=names)
            if not is_library:
                copy.__dict__[name] = own
        return copy

    def _numbers(self, value: Any) -> Any:
        """An array or number of NumPy."""
        kind = value.dtype
        self._feed(type(value).__name__, repr(kind), repr(value.shape))
        if kind.hasobject or not (type(value) is np.ndarray or isinstance(value, np.generic)):
            return self._undecided(value)
        if isinstance(value, np.generic):
            self._feed(value.tobytes())
            return value
        flags = value.flags
        self._feed(repr((flags.c_contiguous, flags.f_contiguous, flags.aligned, flags.writeable)))
        self._feed(value.tobytes())
        if not (flags.c_contiguous or flags.f_contiguous):
            return value
        copy = value.copy(order="K")
        copy.flags.writeable = flags.writeable
        self._remember(value, copy)
        return copy

    def _several(self, values: Any, depth: int) -> Any:
        """A tuple, list, dictionary or set."""
        self._feed(type(values).__name__, str(len(values)))
        if isinstance(values, set | frozenset):
            if all(type(one) in _PLAIN for one in values):
                self._feed(repr(sorted(map(repr, values))))
                return values
            return self._undecided(values)
        if isinstance(values, dict):
            return {self.value(key, depth + 1): self.value(one, depth + 1) for key, one in values.items()}
        return type(values)(self.value(one, depth + 1) for one in values)

    def _other(self, value: Any, depth: int) -> Any:
        """What is known by its name, or by its class and parts."""
        kind = type(value)
        if isinstance(value, types.Type | np.dtype | slice):
            self._feed(kind.__qualname__, repr(value))
        elif isinstance(value, enum.Enum):
            self._feed(kind.__module__, kind.__qualname__, value.name)
            self.value(value.value, depth + 1)
        elif isinstance(value, type) and issubclass(value, enum.Enum):
            for one in value:
                self._other(one, depth + 1)
        elif isinstance(value, tuple) and hasattr(kind, "_fields"):
            self._feed(kind.__module__, kind.__qualname__, repr(kind._fields))
            return kind._make(self.value(one, depth + 1) for one in value)
        elif isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
            self._feed(value.__module__, value.__qualname__, repr(value._fields))
            self.value(getattr(value, "_field_defaults", {}), depth + 1)
        elif not self._is_known_by_name(value):
            return self._undecided(value)
        return value

    def _is_known_by_name(self, value: Any) -> bool:
        """Whether it is a function or class of the standard library or of NumPy, SciPy or numba."""
        if isinstance(value, np.ufunc):
            self._feed("ufunc", value.__name__)
            return getattr(np, value.__name__, None) is value
        if isinstance(value, _Intrinsic):
            value = value._defn
        if not isinstance(value, type | FunctionType | BuiltinFunctionType):
            return False
        owner, name = getattr(value, "__self__", None), str(getattr(value, "__qualname__", ""))
        self._feed(str(type(value).__name__), str(value.__module__), name)
        return _is_library(str(value.__module__)) and (owner is None or isinstance(owner, ModuleType))


@functools.cache
def _is_library(module: str) -> bool:
    """Whether a module is of the standard library, or of a package whose functions are known by name and version."""
    top = module.partition(".")[0]
    if top in _LIBRARIES:
        return True
    if top not in sys.stdlib_module_names:
        return False
    file = getattr(sys.modules.get(top), "__file__", None)  # a user's file may have such a name
    if file is None:
        return top in sys.builtin_module_names or top not in sys.modules
    folders = (sysconfig.get_path("stdlib"), sysconfig.get_path("platstdlib"))
    own = os.path.realpath(file)
    return any(own.startswith(os.path.realpath(folder) + os.sep) for folder in folders) and "site-packages" not in own


def _version(name: str) -> str:
    return str(getattr(sys.modules.get(name), "__version__", ""))


def foreign_overloads() -> bool:
    """Whether others than numba define what compiled code does with known functions and types."""
    templates = [*builtin_registry.functions, *builtin_registry.attributes]
    owners = {getattr(getattr(one, "_overload_func", None), "__module__", None) for one in templates}
    return not all(_is_library(owner) for owner in owners if owner is not None)  # None: made by numba, or no function
