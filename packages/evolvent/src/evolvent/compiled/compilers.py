"""How numba compiles this package's functions, by compilers and a cache of its own; see `compiled.plain`."""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]
from numba.core.typeinfer import register_dispatcher

from evolvent.compiled.codecache import folder
from evolvent.compiled.codecache.compiled import Cache, LawCache, compiling, without_path
from evolvent.compiled.codecache.folder import is_own
from evolvent.compiled.codecache.snapshots import Snapshot, snapshot
from evolvent_base import locks

__all__ = ["compile_law", "compiling", "dispatcher", "is_kept", "keep", "linked", "turn", "without_counts"]
#: Files of the locks of those who compile functions and laws.
_FUNCTIONS, _LAWS = "compiling.lock", "laws.lock"


def without_counts(function: Callable, **options: Any) -> Any:
    """Numba's dispatcher without reference counts, which cost more than the arithmetic of a small model.

    Arrays are borrowed from the caller, and a kernel that tried to allocate one would not compile.
    """
    return njit(error_model="numpy", _nrt=False, **options)(function)


def dispatcher(function: Callable, *, disjoint: bool = False) -> Any:
    """Dispatcher of a function with code of its own, with nothing compiled yet.

    A function of another package is compiled with the values that its globals have now, and kept by a digest of these;
    it is not kept where that cannot be decided. Called from Python it lets other threads run: it works on arrays of its
    arguments alone.
    """
    digest, compiled, cached = "", function, True
    if not is_own(function.__module__):
        compiled, digest, _ = snapshot(function)
        cached = bool(digest)
    found = without_counts(without_path(compiled), no_cfunc_wrapper=True, nogil=True)
    _set_compiler(found, _Disjoint if disjoint else _Compiler)
    if cached:
        found._cache = Cache(function, f"disjoint={disjoint}", digest)
    return found


def linked(function: Callable, *, inline: bool) -> Any:
    """Dispatcher of a function that goes into its compiled callers."""
    found = without_counts(
        without_path(function),
        no_cfunc_wrapper=True, forceinline=inline, no_cpython_wrapper=True, pipeline_class=_IntoModule,
    )  # fmt: skip
    _set_compiler(found, _IntoCallers)
    return found


def is_kept(found: Any, signature: Any) -> bool:
    """Whether a function is in the cache; one of another package may have none."""
    return isinstance(found._cache, Cache) and found._cache.exists(signature)


def turn(is_needed: Callable[[], bool]) -> AbstractContextManager[Callable[[], None]]:
    """The turn to compile functions, which one process has at a time; see `evolvent_base.locks.turn`."""
    return locks.turn(folder.CACHE_DIR / _FUNCTIONS, is_needed)


def keep(function: Callable) -> tuple[Callable, Snapshot]:
    """A user's function with the values that its globals and helpers have now."""
    return function, snapshot(function)


def compile_law(signature: Any, kept: tuple[Callable, Snapshot]) -> Any:
    """Compile what `keep` has kept as numba compiles its own, for the host, with checked indices, and store it.

    It is stored by a digest of all values that it refers to.
    """
    function, found = kept
    compiled = without_counts(found.function, boundscheck=True)
    cache = compiled._cache = LawCache(found)
    # registered for a law that calls itself
    with locks.turn(folder.CACHE_DIR / _LAWS, lambda: not cache.exists(signature)), register_dispatcher(compiled):
        compiled.compile(signature)
    compiled.disable_compile()
    compiled.py_func = function
    return functools.update_wrapper(compiled, function)


class _Compiler(_FunctionCompiler):
    """Compiler of this package's functions."""

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        compiling.take_indices()
        return super()._compile_core(args, return_type)


class _Module(JITCodeLibrary):
    """Code that goes into that of callers: no machine code is made of it, which took 8 % of all compilation."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class _IntoModule(Compiler):
    """Numba's passes, with such a module in place of one that is made ready to run."""

    def __init__(self, typing_context: Any, target_context: Any, library: Any, *rest: Any) -> None:
        if library is None:
            library = _Module(target_context.codegen(), "linked")
            library.enable_object_caching()
        super().__init__(typing_context, target_context, library, *rest)


class _IntoCallers(_Compiler):
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


class _Disjoint(_Compiler):
    """Compiler of functions whose arguments do not overlap."""

    def _customize_flags(self, flags: Any) -> Any:
        flags.noalias = True
        return flags


def _set_compiler(dispatcher: Any, kind: type[_FunctionCompiler]) -> None:
    """Have a dispatcher compile by another compiler."""
    old = dispatcher._compiler
    dispatcher._compiler = kind(old.py_func, old.targetdescr, old.targetoptions, old.locals, old.pipeline_class)
