"""What a user composes: each part is a frozen section of keys that writes itself into the model's arrays.

The names of this package are those of its modules, and of the parts beside the families of their records
(`model.registry.beside`): parts that a case file may name by their kind, and the sections that parts take, such as
shapes and drives, which stand in the `__all__` of their module. The sources say where each of them is, so that only the
modules are loaded whose parts are asked for. Modules without a source are loaded.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from evolvent.model.registry import names_beside, source_of
from evolvent.parts.base import Part, kind_of
from evolvent_base.schema import Section

#: What a module says of its names, its classes and their kinds, each at its place in the source.
_SAID = re.compile(
    r"""^__all__ = \[(?P<names>[^]]*)\]|^class (?P<name>\w+)|^    kind: Literal\["(?P<kind>[^"]+)"\]""", re.MULTILINE
)


class Place(NamedTuple):
    """Where a class is: its module, and its kind, '' of what is no part."""

    module: str
    kind: str


@functools.cache
def places() -> Mapping[str, Place]:
    """Where the parts, and the classes that modules name for users, are by their sources; by name."""
    found: dict[str, Place] = {}
    for module in (*(f"{__name__}.{one.name}" for one in pkgutil.iter_modules(__path__)), *names_beside("part")):
        source = source_of(module)
        own = _loaded(module) if source is None else _said(source)
        found |= {name: Place(module, kind) for name, kind in own.items()}
    return MappingProxyType(dict(sorted(found.items())))


def _said(source: str) -> dict[str, str]:
    """Kinds of the classes that a source has for users, '' of what is no part; by name."""
    said, found, last = [*_SAID.finditer(source)], dict[str, str](), ""
    named = {name for one in said if one["names"] is not None for name in re.findall(r"\w+", one["names"])}
    for one in said:
        if one["kind"] is not None:
            found[last] = one["kind"]
        elif one["name"] is not None:
            last = one["name"]
            if last in named:
                found[last] = ""
    return found


def _loaded(module: str) -> dict[str, str]:
    """As `_said`, of a module without a source."""
    held = vars(importlib.import_module(module))
    own = {name: one for name, one in held.items() if isinstance(one, type) and one.__module__ == module}
    return {name: kind_of(one) for name, one in own.items() if kind_of(one) or name in held.get("__all__", ())}


def _section(name: str) -> type[Section] | None:
    """The class of a name, whose module is loaded; None where it is no section of its own kind or for users."""
    place = places().get(name)
    found = None if place is None else getattr(importlib.import_module(place.module), name)
    if not (isinstance(found, type) and issubclass(found, Section)):
        return None
    return found if kind_of(found) or not issubclass(found, Part) else None


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return [one for one in places() if _section(one) is not None]
    found = None if name.startswith("_") else _section(name)
    if found is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return found


def __dir__() -> list[str]:
    return [one for one in places() if _section(one) is not None]
