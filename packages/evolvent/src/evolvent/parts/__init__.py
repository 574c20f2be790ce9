"""What a user composes: each part is a frozen section of keys that writes itself into the model's arrays.

The names of this package are those of its modules, and of the parts beside the families of their records
(`model.registry.beside`): parts that a case file may name by their kind, and the sections that parts take, such as
shapes and drives, which stand in the `__all__` of their module. Their modules are found by a search of the source code,
and are imported when one of their names is used; modules without source code are imported at once.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from evolvent.model.registry import module_names, module_source
from evolvent.parts.base import Part, kind_of
from evolvent_base.schema import Section

#: Lines of a source file that declare `__all__`, a class, or the kind of a part.
_DECLARATION = re.compile(
    r"""^__all__ = \[(?P<names>[^]]*)\]|^class (?P<name>\w+)|^    kind: Literal\["(?P<kind>[^"]+)"\]""", re.MULTILINE
)


class Definition(NamedTuple):
    """Module in which a class is defined, and its kind; '' if it is not a part."""

    module: str
    kind: str


@functools.cache
def definitions() -> Mapping[str, Definition]:
    """Definitions of all parts, and of classes in `__all__` of their modules, by class name; read from the sources."""
    found: dict[str, Definition] = {}
    for module in (*(f"{__name__}.{one.name}" for one in pkgutil.iter_modules(__path__)), *module_names("part")):
        source = module_source(module)
        kinds = _imported_kinds(module) if source is None else _declared_kinds(source)
        found |= {name: Definition(module, kind) for name, kind in kinds.items()}
    return MappingProxyType(dict(sorted(found.items())))


def _declared_kinds(source: str) -> dict[str, str]:
    """Kinds of the parts that source code declares, by class name; '' for other classes in its `__all__`."""
    declarations, found, last = [*_DECLARATION.finditer(source)], dict[str, str](), ""
    public = {name for one in declarations if one["names"] is not None for name in re.findall(r"\w+", one["names"])}
    for one in declarations:
        if one["kind"] is not None:
            found[last] = one["kind"]
        elif one["name"] is not None:
            last = one["name"]
            if last in public:
                found[last] = ""
    return found


def _imported_kinds(module: str) -> dict[str, str]:
    """As `_declared_kinds`, of a module without source code, which is imported."""
    names = vars(importlib.import_module(module))
    own = {name: one for name, one in names.items() if isinstance(one, type) and one.__module__ == module}
    return {name: kind_of(one) for name, one in own.items() if kind_of(one) or name in names.get("__all__", ())}


def _load_section(name: str) -> type[Section] | None:
    """The class of a name, after import of its module; None unless it is a part with a kind, or another section."""
    definition = definitions().get(name)
    found = None if definition is None else getattr(importlib.import_module(definition.module), name)
    if not (isinstance(found, type) and issubclass(found, Section)):
        return None
    return found if kind_of(found) or not issubclass(found, Part) else None


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return [one for one in definitions() if _load_section(one) is not None]
    found = None if name.startswith("_") else _load_section(name)
    if found is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return found


def __dir__() -> list[str]:
    return [one for one in definitions() if _load_section(one) is not None]
