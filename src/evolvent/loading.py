"""Compiled functions that are loaded from the cache folder without setting up the compiler.

numba registers all that it can compile before it looks into its cache: that takes half as long as importing it, and
loads scipy.linalg. What was compiled before needs none of it; a function that is not found in the cache still gets it,
for compiling registers it anyway.
"""

from __future__ import annotations

from typing import Any

from numba.core.caching import FunctionCache


def load_overload(cache: Any, signature: Any, target_context: Any) -> Any:
    """The compiled function for a signature out of numba's cache of it; None if it is not kept."""
    with cache._guard_against_spurious_io_errors():
        return cache._load_overload(signature, target_context)


def load_without_compiler() -> None:
    """Have numba load what it keeps by `load_overload`; for a process of our own."""
    FunctionCache.load_overload = load_overload
