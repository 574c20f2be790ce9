"""Systems with other values of some keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from evolvent import cases
from evolvent.analysis.composition import Composition
from evolvent.assembly.variants import Variants
from evolvent.parts.base import Part
from evolvent.parts.registry import read_parts
from evolvent_base.errors import InputError, counted, nearest
from evolvent_base.schema import members

Composed = TypeVar("Composed", bound=Composition)


def with_values(system: Composed, values: Mapping[str, Any]) -> Composed:
    """A copy of a system with other values, which shares what does not change: see `evolvent.System.with_values`."""
    if not isinstance(values, Mapping):
        raise InputError(f"the values are {values!r}; they must be a mapping of keys, such as 'hinge.stiffness': 2.0")
    of_parts: dict[str, dict[str, Any]] = {}
    others: dict[str, Any] = {}
    others_known = cases.system("structure").Case.model_fields.keys() - {"system", "parts"}
    for key, value in values.items():
        words = str(key).removeprefix("parts.")
        name, _, rest = words.partition(".")
        named = parts_of(system, words) if rest else []
        if named:
            for one in named:
                of_parts.setdefault(one, {})[rest] = value
        elif words == key and name in others_known:
            others[key] = value
        else:
            raise InputError(f"cannot set {key!r}: no part is called {name!r}; {nearest(name, system.parts)}")
    found = _with_others(system, others) if others else system.copy()
    for name, changes in of_parts.items():
        found._parts[name] = _changed(name, system.parts[name], changes)
    system._variants = system._variants or Variants()
    found._variants, found._found, found._aged = system._variants, system._found, system._aged
    return found


def parts_of(system: Composition, words: str) -> list[str]:
    """Names of the parts to which a key belongs: a part, or all 'hinge 1', 'hinge 2' where none is called 'hinge'.

    Raises
    ------
    InputError
        For a key of several parts that does not hold one number, text or switch that is the same in all of them: in a
        case file it stands for the first of repeated parts, and the others follow from it.
    """
    name, _, rest = words.partition(".")
    if name in system.parts:
        return [name]
    found = members(system.parts, name)
    own = [_value(system.parts[one], rest) for one in found]
    if not all(rest.partition(".")[0] in type(system.parts[one]).model_fields for one in found):
        return found  # where it is refused by its name
    if any(type(one) is not type(own[0]) or one != own[0] or not isinstance(one, str | int | float) for one in own):
        listed = ", ".join(f"'{one}.{rest}'" for one in found[:3]) + (", ..." if len(found) > 3 else "")
        raise InputError(
            f"{words!r} is not one number that is the same in all of {counted(len(found), 'part', 'parts')} called "
            f"{name!r} with a number behind; name them: {listed}"
        )
    return found


def _value(part: Part, key: str) -> Any:
    """What a part holds at a key; None for nothing, and for entries of lists."""
    found: Any = part.model_dump()
    for word in key.split("."):
        found = found.get(word) if isinstance(found, Mapping) else None
    return found


def _changed(name: str, part: Part, changes: Mapping[str, Any]) -> Part:
    """A part with other values of its keys, read as those of a case are."""
    first = {key.partition(".")[0] for key in changes}
    written = part.model_dump(mode="json", include=first & part.model_fields_set)
    kept = {key: getattr(part, key) for key in part.model_fields_set - first}
    content = {"kind": type(part).model_fields["kind"].default, **kept, **written}
    for key, value in changes.items():
        cases.set_value({"system": "structure", "parts": {name: content}}, f"parts.{name}.{key}", value)
    return read_parts({name: content})[name]


def _with_others(system: Composed, values: Mapping[str, Any]) -> Composed:
    """A system with other keys of a case beside its parts."""
    own = {name: value for name, value in system._content().items() if name != "parts"}
    case = cases.load({**own, "parts": {}}, values)
    found: Composed = cases.system("structure").system(case)
    found._parts = dict(system.parts)
    return found
