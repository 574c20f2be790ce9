"""What compiled code links in, and the names that a function refers to."""

from __future__ import annotations

from collections.abc import Callable
from types import CodeType
from typing import Any


class Linked:
    """Base of functions of `evolvent.compiled.jit` that compiled code calls.

    Attributes
    ----------
    py_func : the plain function
    is_own : bool, whether it is of this package
    options : str, how it is compiled
    """

    py_func: Callable
    is_own: bool
    options: str

    def around(self, function: Callable) -> Any:
        """Another one, of a copy of its function; itself where there can be no other."""
        raise NotImplementedError


def names_in(code: CodeType) -> frozenset[str]:
    """Names that a function may read: of globals, and of attributes, also those asked for by getattr."""
    found = {*code.co_names}
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            found |= names_in(constant)
        elif isinstance(constant, str) and constant.isidentifier():
            found.add(constant)
    return frozenset(found)
