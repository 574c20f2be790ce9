"""The order in which parts are assembled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evolvent.base.errors import InputError, nearest


def in_order(parts: Mapping[str, Any]) -> list[str]:
    """Names of parts in an order in which every part follows those that it refers to, else as they were added.

    Raises
    ------
    InputError
        If a part refers to one that is not there, or parts refer to one another in a circle.
    """
    found: dict[str, None] = {}
    path: list[str] = []

    def visit(name: str) -> None:
        if name in path:
            cycle = [*path[path.index(name) :], name]
            if len(cycle) == 2:
                raise InputError(f"{name!r} refers to itself; it must refer to another part")
            raise InputError(
                f"the parts {' -> '.join(map(repr, cycle))} refer to one another in a cycle; one of them must "
                "refer to another part, or to none"
            )
        if name in found:
            return
        path.append(name)
        for other in parts[name].references():
            if other not in parts:
                raise InputError(f"{name!r} refers to {other!r}, but no part is called that; {nearest(other, parts)}")
            visit(other)
        path.pop()
        found[name] = None

    for name in parts:
        visit(name)
    return list(found)
