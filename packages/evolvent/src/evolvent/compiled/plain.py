"""How numba compiles this package's functions without its private interfaces; see `compiled.interfaces`."""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import njit

#: In which functions are compiled and loaded, one thread at a time.
compiling: Any = threading.RLock()


def without_counts(function: Callable, **options: Any) -> Any:
    """Numba's dispatcher."""
    return njit(error_model="numpy", **options)(function)


def dispatcher(function: Callable, *, disjoint: bool = False) -> Any:
    """Dispatcher of a function with code of its own, with nothing compiled yet."""
    return without_counts(function)


def linked(function: Callable, *, inline: bool) -> Any:
    """Dispatcher of a function that goes into its compiled callers."""
    return without_counts(function)


def is_kept(found: Any, signature: Any) -> bool:
    """Whether a function is in the cache: none is."""
    return False


def turn(is_needed: Callable[[], bool]) -> Any:
    """The turn to compile: every process has it, since nothing is kept."""
    return contextlib.nullcontext(lambda: None)


def keep(function: Any) -> Callable:
    """A user's function with the values that its globals have now."""
    found = FunctionType(
        function.__code__, dict(function.__globals__), function.__name__, function.__defaults__, function.__closure__
    )
    return functools.update_wrapper(found, function)


def compile_law(signature: Any, kept: Callable) -> Any:
    """Compile a user's function, with checked indices."""
    compiled = without_counts(kept, boundscheck=True)
    compiled.compile(signature)
    compiled.disable_compile()
    return compiled
