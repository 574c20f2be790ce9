"""Nested dissection of a graph: groups of its vertices in the order in which they are eliminated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence, Set

#: Vertices of a group that is not divided.
LEAST = 16
#: Vertices from which levels are counted to find a separator, and levels of a count that are tried.
STARTS, TRIED = 6, 3
#: Weight of each of two parts, at least, beside that of what is divided, and what uneven parts cost.
SHARE, UNEVEN = 0.3, 0.1
#: Passes of the refinement of a separator.
PASSES = 4


def groups(near: Sequence[Set[int]], size: Sequence[int], vertices: Sequence[int]) -> list[list[int]]:
    """Groups of vertices in the order of their elimination; each after the parts that it separates.

    Parameters
    ----------
    near : neighbours of each vertex; size : weight of each
    vertices : those to be divided

    Notes
    -----
    George 1973: where separators of about sqrt(n) vertices divide a graph of n vertices, elimination takes n^(3/2)
    operations. A separator is a level of the distances from a vertex, or from those farthest from it, and vertices move
    from it into the parts as long as it becomes lighter. Numbers are whole and ties go to the first one: the same graph
    has the same groups everywhere.
    """
    found: list[list[int]] = []  # from the last one on
    waiting = [list(vertices)]
    while waiting:
        own = waiting.pop()
        inside = set(own)
        around = {v: sorted(near[v] & inside) for v in own}
        level = _levels(around, own[:1])
        if len(level) < len(own):
            waiting += [[v for v in own if v not in level], sorted(level)]
            continue
        cut = separator(around, {v: size[v] for v in own}) if len(own) > LEAST else set()
        if cut:
            waiting.append([v for v in own if v not in cut])
        found.append(sorted(cut or inside))
    return found[::-1]


def separator(around: Mapping[int, Sequence[int]], weight: Mapping[int, int]) -> set[int]:
    """Vertices without which a connected graph falls into parts; none where every one is near every other one.

    Parameters
    ----------
    around : neighbours of each vertex
    """
    best: set[int] = set()
    least, total = math.inf, sum(weight.values())
    nearest = dict.fromkeys(around, len(around))
    start = min(around)
    for _ in range(STARTS):
        away = _levels(around, [start])
        last = max(away.values())
        for level in (away, _levels(around, [v for v in around if away[v] == last])):
            for k in _lightest(level, weight, total):
                side = {v: (d > k) - (d < k) for v, d in level.items()}
                cost = refine(around, weight, side)
                if cost < least:
                    best, least = {v for v, s in side.items() if s == 0}, cost
        nearest = {v: min(d, away[v]) for v, d in nearest.items()}
        start = max(nearest, key=lambda v: (nearest[v], -v))
    return best


def _levels(around: Mapping[int, Sequence[int]], starts: Sequence[int]) -> dict[int, int]:
    """Distances of all vertices that are connected with the first ones, from the nearest of these."""
    found, edge, k = dict.fromkeys(starts, 0), list(starts), 0
    while edge:
        k += 1
        beyond = []
        for v in edge:
            for c in around[v]:
                if c not in found:
                    found[c] = k
                    beyond.append(c)
        edge = beyond
    return found


def _lightest(level: Mapping[int, int], weight: Mapping[int, int], total: int) -> Iterator[int]:
    """The lightest levels between two parts that are even enough, or the most even ones where there are none."""
    by_level = [0] * (1 + max(level.values()))
    for v, k in level.items():
        by_level[k] += weight[v]
    before, found = 0, []
    for k, own in enumerate(by_level):
        lighter = min(before, total - before - own)
        if lighter > 0:
            found.append((max(SHARE * total - lighter, 0.0), own, -lighter, k))
        before += own
    yield from (k for *_, k in sorted(found)[:TRIED])


def refine(around: Mapping[int, Sequence[int]], weight: Mapping[int, int], side: dict[int, int]) -> float:
    """Make a separator lighter; returns its weight, and more where the parts are uneven.

    Vertices of it, 0, move to a side -1 or 1 where those of the other side that replace them weigh less.
    """
    parts = {-1: 0, 0: 0, 1: 0}
    for v, s in side.items():
        parts[s] += weight[v]
    total = sum(parts.values())
    for _ in range(PASSES):
        before = dict(parts)
        for v in [v for v, s in side.items() if s == 0]:
            moves = []
            for s in (-1, 1):
                pulled = [c for c in around[v] if side[c] == -s]
                lost = sum(weight[c] for c in pulled)
                lighter = min(parts[s] + weight[v], parts[-s] - lost)
                gain, even = weight[v] - lost, lighter - min(parts[1], parts[-1])
                if (gain > 0 and (lighter >= SHARE * total or even > 0)) or (gain == 0 and even > 0):
                    moves.append((gain, even, s, pulled))
            if moves:
                gain, _, s, pulled = max(moves)
                side[v] = s
                for c in pulled:
                    side[c] = 0
                parts[s] += weight[v]
                parts[0] -= gain
                parts[-s] -= weight[v] - gain
        if parts == before:
            break
    few, many = sorted((parts[-1], parts[1]))
    return parts[0] * (1.0 + UNEVEN * many / few) if few > 0 else math.inf
