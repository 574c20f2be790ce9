"""What a user composes: each part is a frozen section of keys that writes itself into the model's arrays.

The names of this package are those of its modules, and of the parts beside the families of their records
(`model.registry.beside`): parts that a case file may name by their kind, and the sections that parts take, such as
shapes and drives, which stand in the `__all__` of their module.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
from collections.abc import Mapping
from typing import Any

from evolvent.model.registry import beside
from evolvent.parts.base import Part, kind_of
from evolvent_base.schema import Section


@functools.cache
def _sections() -> Mapping[str, type]:
    """Classes by their names, in the order of these; the modules are loaded when the first is asked for."""
    found: dict[str, type] = {}
    shared = (importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    for module in (*shared, *beside("part")):
        own = vars(module)
        composed = own.get("__all__", ())
        for name, value in own.items():
            if not isinstance(value, type) or value.__module__ != own["__name__"] or not issubclass(value, Section):
                continue
            if kind_of(value) or (name in composed and not issubclass(value, Part)):
                found[name] = value
    return dict(sorted(found.items()))


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return [*_sections()]
    if not name.startswith("_") and name in _sections():
        return _sections()[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*_sections()]
