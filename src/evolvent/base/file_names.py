"""Keys of a case whose texts name files that are read, found by the annotation `FileName`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from evolvent.base.schema import Located, Section, within


@dataclasses.dataclass(frozen=True)
class FileName:
    """An annotation of a key whose text may name a file.

    Parameters
    ----------
    endings : tuple of str, one of which is in such a text, in small letters; none where every text names a file
    """

    endings: tuple[str, ...] = ()

    def is_in(self, text: str) -> bool:
        """Whether a text may name a file."""
        return not self.endings or any(ending in text.lower() for ending in self.endings)


def renamed(kind: type[Section], content: Any, change: Callable[[str], str], key: str = "", case: Any = None) -> Any:
    """Content of a case, or values of one of its keys, with all texts changed that may name files.

    Parameters
    ----------
    kind : of the case
    content : as it is written
    change : function of such a text
    key : str, dotted, of which `content` is a value, or several in lists and mappings
    case : mapping, the case that the key belongs to
    """
    place: Located | None = Located([(kind, ())], "", entry=False)
    for name in filter(None, key.split(".")):
        place = None if place is None else within(place, name, case)
        case = case.get(name) if isinstance(case, Mapping) else None
    return content if place is None else _renamed(place, content, change)


def _renamed(place: Located, content: Any, change: Callable[[str], str]) -> Any:
    names = [mark for _, own in place.types for mark in own if isinstance(mark, FileName)]

    def inner(name: Any, value: Any) -> Any:
        found = within(place, name, content) if isinstance(name, str) else None
        found = found or (place if names else None)
        return value if found is None else _renamed(found, value, change)

    if isinstance(content, Mapping):
        return {name: inner(name, value) for name, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [inner(str(k), value) for k, value in enumerate(content)]
    return change(content) if isinstance(content, str) and any(one.is_in(content) for one in names) else content
