"""Which compiled functions a model needs: what a function calls, but the kernels of what the model does not have."""

from __future__ import annotations

import dataclasses
import functools
import sys
import weakref
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from numba import config

from evolvent.compiled import jit, lookups
from evolvent.compiled.codecache import Linked, names_in
from evolvent.model import Model, has
from evolvent.model.having import Condition
from evolvent.model.registry import TABLES, asked


@functools.cache
def _declared(_: int) -> dict[Condition, list[str]]:
    """What loaded modules and functions are used for, and their names; by the number of functions."""
    found: dict[Condition, dict[str, None]] = {}
    for function in jit.functions():
        module = function.py_func.__module__
        name, used_for = _short(module), vars(sys.modules[module]).get("USED_FOR")
        if used_for is not None:
            found.setdefault(used_for, {})[name] = None
        if isinstance(function, jit.Indirect) and function.used_for is not None:
            found.setdefault(function.used_for, {})[f"{name}.{function.py_func.__name__}"] = None
    return {condition: [*names] for condition, names in found.items()}


def _short(module: str) -> str:
    return module.removeprefix("evolvent.").removeprefix("kernels.")


def absent(model: Model) -> frozenset[str]:
    """Modules and functions that are used for what a model does not have; without `evolvent.` and `kernels.`.

    What does not say what it is used for costs compilation; what is called in spite of it is loaded then.
    """
    declared = _declared(len(jit.functions()))
    return frozenset(name for condition, names in declared.items() if not has(model, condition) for name in names)


#: Tables of calls, which functions name that walk over the families of a model.
_TABLES = frozenset(TABLES)


@functools.cache
def _called(function: Any) -> tuple[tuple[Any, ...], frozenset[str]]:
    """Functions called by their address, and tables of calls, in a compiled function and in what goes into it."""
    found: dict[Any, None] = {}
    seen, waiting, tables = {function}, [function], set[str]()
    while waiting:
        inside = waiting.pop().py_func
        tables |= _TABLES & names_in(inside.__code__)
        for other in _linked(inside):
            if isinstance(other, jit.Indirect):
                found[other] = None
            elif other not in seen:
                waiting.append(other)
            seen.add(other)
    return tuple(found), frozenset(tables)


def _linked(function: Any) -> Iterator[Any]:
    """Compiled functions that a Python function names."""
    names = names_in(function.__code__)
    for name in names:
        value = function.__globals__.get(name)
        if isinstance(value, Linked):
            yield value
        elif isinstance(value, ModuleType):
            yield from (other for at in names if isinstance(other := getattr(value, at, None), Linked))


@functools.cache
def _reached(roots: tuple[Any, ...], absent: frozenset[str]) -> tuple[Any, ...]:
    """Functions that some functions call, but those that are absent, themselves first."""
    found: dict[Any, None] = dict.fromkeys(roots)
    waiting = list(roots)
    while waiting:
        for other in _called(waiting.pop())[0]:
            module = _short(other.py_func.__module__)
            if other not in found and absent.isdisjoint((module, f"{module}.{other.py_func.__name__}")):
                found[other] = None
                waiting.append(other)
    return tuple(found)


def needed(model: Model, roots: tuple[Any, ...], without: frozenset[str]) -> list[Any]:
    """Functions that `roots` call on a model that lacks what `absent` names, `roots` among them."""
    found, size = _reached(roots, without), 0
    while size != len(found):  # what a table names may walk over another one
        size = len(found)
        tables = sorted({table for function in found for table in _called(function)[1]})
        found = _reached(
            (*roots, *(one for table in tables for one in lookups.at_slots(getattr(model, table)))), without
        )
    for name, callers in asked("parts.calls").items():
        slots = [getattr(model, name)[field] for caller, field in callers.items() if caller in found]
        found = (*found, *(one for own in slots for one in lookups.at_slots(own[own != 0])))
    return [*found]


@dataclasses.dataclass
class _Loaded:
    """Number of functions that there were, what of them a model does not need, and what was loaded for it."""

    count: int = 0
    lacks: frozenset[str] = frozenset()
    roots: set[Any] = dataclasses.field(default_factory=set)


#: Models that are alike share theirs.
_LOADED: weakref.WeakKeyDictionary[Model, _Loaded] = weakref.WeakKeyDictionary()


def load(model: Model, *roots: Any, without: frozenset[str] = frozenset()) -> None:
    """Load functions, and all that they call on a model, before they are called; what is in no cache is compiled.

    Parameters
    ----------
    without : names that are not called either, as of `absent`
    """
    if config.DISABLE_JIT:
        return
    own = _LOADED.setdefault(model, _Loaded())
    if own.count != len(jit.functions()):
        own.count, own.lacks = len(jit.functions()), absent(model)
    if (roots, without) not in own.roots:
        jit.load(needed(model, roots, own.lacks | without))
        own.roots.add((roots, without))


def note_alike(model: Model, other: Model) -> None:
    """Note that another model needs the functions that a model does, as its copy or a variant."""
    _LOADED[other] = _LOADED.setdefault(model, _Loaded())


def unload() -> None:
    """Unload all functions, as at the start of a process."""
    jit.unload()
    _LOADED.clear()
