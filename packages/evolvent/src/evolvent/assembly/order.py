"""The order in which parts are assembled, and that of rows of constraints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from evolvent_base.errors import InputError, nearest


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
        for named in parts[name].references():
            other = named if named in parts else _writer(parts, named)
            if other not in parts:
                raise InputError(f"{name!r} refers to {other!r}, but no part is called that; {nearest(other, parts)}")
            visit(other)
        path.pop()
        found[name] = None

    for name in parts:
        visit(name)
    return list(found)


def _writer(parts: Mapping[str, Any], name: str) -> str:
    """The part that may write one of a name, which begins with its own; the name itself where there is none."""
    found = [own for own, part in parts.items() if part.writes_others and name.startswith(f"{own} ")]
    return max(found, key=len, default=name)


def reverse_cuthill_mckee(pairs: Iterable[tuple[int, int]], n: int) -> np.ndarray:
    """Order of the nodes of a graph in which its matrix has a small bandwidth.

    Parameters
    ----------
    pairs : nodes that are connected, in both directions; repeated ones count once
    n : int, number of nodes

    Returns
    -------
    (n,) int
        The nodes level by level from the last one of each connected part, reversed; that of
        `scipy.sparse.csgraph.reverse_cuthill_mckee`, which takes 0.1 s to load.

    Notes
    -----
    Cuthill & McKee (1969), Reducing the bandwidth of sparse symmetric matrices: each connected part begins with a
    node of the least degree, and the neighbours of a node follow by degree. George (1971) reverses the order.
    """
    near: list[set[int]] = [set() for _ in range(n)]
    for a, b in pairs:
        near[a].add(b)
    if not any(near):
        return np.arange(n)
    degree = [len(own) for own in near]
    found: list[int] = []
    seen = [False] * n
    for seed in np.argsort(np.array(degree, dtype=np.int32)).tolist():
        if seen[seed]:
            continue
        seen[seed] = True
        level = len(found)
        found.append(seed)
        while level < len(found):
            following = [k for k in sorted(near[found[level]]) if not seen[k]]
            for k in following:
                seen[k] = True
            found += sorted(following, key=degree.__getitem__)
            level += 1
    return np.array(found[::-1], dtype=np.int64)
