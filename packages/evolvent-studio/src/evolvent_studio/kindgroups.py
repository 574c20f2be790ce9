"""Kinds of parts in groups, in the order in which a structure is built up."""

from __future__ import annotations

from collections.abc import Iterator

from evolvent.parts.base import Group
from evolvent.parts.registry import kinds


def grouped() -> Iterator[tuple[str, list[str]]]:
    """Groups that parts state (`Part.group`), and their kinds; a package's own groups come before the last one."""
    found: dict[str, list[str]] = {str(group): [] for group in Group if group != Group.OTHERS}
    for kind, part in sorted(kinds().items()):
        if part.group != Group.OTHERS:
            found.setdefault(str(part.group), []).append(kind)
    yield from ((group, names) for group, names in found.items() if names)
    if others := sorted(kind for kind, part in kinds().items() if part.group == Group.OTHERS):
        yield str(Group.OTHERS), others
