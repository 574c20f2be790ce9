"""What stands for the compiler where evolvent is not installed: the same functions in plain Python."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any


def inlined(function: Callable[..., Any]) -> Any:
    """Leave a function as it is."""
    return function


def indirect(signature: Any, *, disjoint: bool = False, used_for: Any = None) -> Callable[[Callable[..., Any]], Any]:
    """Have a function take lists, whose numbers Python reads faster than an array's; the last array is written."""

    def decorate(function: Callable[..., Any]) -> Any:
        @functools.wraps(function)
        def call(*arrays: Any) -> None:
            function(*(array.tolist() for array in arrays[:-1]), arrays[-1])

        return call

    return decorate
