"""Order in which the blocks of a system's graph are eliminated, and the storage that follows from it."""

from __future__ import annotations

import hashlib
import heapq
import itertools
import threading
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from evolvent.algebra import dissection, sparse
from evolvent.algebra.sparse import SparseBlocks

Array = np.ndarray

#: Stands for the ground among the blocks that a group of multipliers acts on.
_GROUND = -1
#: Stands for no edge; edges of no group have names from here down.
_NONE = -1
#: Operations of an elimination by minimum degree, in pairs, from which nested dissection is tried, and the share of
#: them below which it is taken.
MANY, FEWER = 2e6, 0.9
#: Matrices of the last patterns, the latest last, and how many are kept.
_kept: dict[bytes, SparseBlocks] = {}
_MOST_KEPT = 4
_keeping = threading.Lock()


class Pattern(NamedTuple):
    """Blocks of unknowns and which of them couple.

    Attributes
    ----------
    blocks : list of (m,) int, unknowns of each block: of a node, a body, a point, or the multipliers of the constraints
        between the same two of these; each unknown in exactly one
    multipliers : (nb,) bool, which of the blocks hold multipliers
    pairs : (ne, 2) int, blocks that couple, multipliers with what they act on included
    fixed : (nb,) bool, blocks that cannot move freely in space even without constraints, as a body on a fixed axis
    owner : dict of blocks of multipliers to the block that each is eliminated with: of a chain, whose constraints have
        full rank in their own blocks alone, whatever else they act on, and on which no other constraint acts
    stiff : set of blocks that resist every motion by themselves, so that no constraint needs to hold them
    carried : dict of blocks of multipliers to a block in which alone their constraints have full rank, and which they
        carry with stiff ones, as the interface nodes of a reduced body: they are eliminated with it where they are in a
        loop, since what little stiffness it has by itself is no pivot
    """

    blocks: list[Array]
    multipliers: Array
    pairs: Array
    fixed: Array
    owner: Mapping[int, int] = MappingProxyType({})
    stiff: frozenset[int] = frozenset()
    carried: Mapping[int, int] = MappingProxyType({})


class Order(NamedTuple):
    """Blocks as they are eliminated.

    Attributes
    ----------
    blocks : list of (m,) int, unknowns, multipliers last
    multipliers : list of int, how many unknowns at the end of each block are multipliers
    later : list of (s,) int, later blocks that each couples to when it is eliminated, fill included, ascending
    """

    blocks: list[Array]
    multipliers: list[int]
    later: list[Array]


def matrix_of(pattern: Pattern, *, spare: int = 0, inner: int = 0) -> SparseBlocks:
    """Zero matrix of a pattern, with room for `spare` deferred pivots and `inner` inner unknowns.

    Patterns come again where a model is analysed again, such as with other loads: the last few are kept with their
    matrices, of whose values nothing is ever written.
    """
    key = _digest(pattern, spare, inner)
    with _keeping:
        found = _kept.pop(key, None)
    if found is None:
        found = stored(elimination_order(pattern), spare=spare, inner=inner)
    with _keeping:
        _kept[key] = found
        if len(_kept) > _MOST_KEPT:
            del _kept[next(iter(_kept))]
    return found.copy()


def _digest(pattern: Pattern, spare: int, inner: int) -> bytes:
    """What tells patterns apart."""
    parts = [np.array([len(block) for block in pattern.blocks]), *pattern.blocks, pattern.multipliers, pattern.pairs]
    text = repr((spare, inner, sorted(pattern.owner.items()), sorted(pattern.stiff), sorted(pattern.carried.items())))
    found = hashlib.sha256(text.encode())
    for part in [*parts, pattern.fixed]:
        found.update(np.ascontiguousarray(part, dtype=np.int64).tobytes())
        found.update(b"|")
    return found.digest()


def elimination_order(pattern: Pattern) -> Order:
    """Order of elimination in which no pivot need vanish: by minimum degree, or by nested dissection with less to do.

    Notes
    -----
    Of surfaces minimum degree costs up to twice as much as nested dissection (`dissection`), of chains less.

    The diagonal of multipliers is zero, so what precedes them must have filled it: the rows G of all constraints
    eliminated so far, in the columns of all coordinates eliminated so far, must have full rank. It has if each
    constraint waits for all that it acts on. In the graph of what constraints join, the ground included, those of a
    bridge (an edge in no loop) need wait for the part on the side away from the ground only, which moves freely without
    it: they are eliminated together with that part, in one block with pivots of both. So trees fill nothing, stiff or
    massless, and only what is in a loop waits. Of a chain the pattern itself says which block each belongs to. What
    acts on a block that is carried waits for the stiff blocks that carry it, which then resist it, and the other blocks
    that carry it, which resist nothing by themselves, wait for what acts on it.

    Ties go to the smaller block and then to the first one, so a chain is eliminated from a free end.
    """
    owner = _owners(pattern)
    merged = [list(block) for block in pattern.blocks]
    count = [len(block) if m else 0 for block, m in zip(pattern.blocks, pattern.multipliers, strict=True)]
    alias = np.arange(len(merged))
    for group, block in owner.items():
        merged[block] += list(pattern.blocks[group])
        count[block] += len(pattern.blocks[group])
        alias[group] = block
    size = [len(block) for block in merged]
    near: list[set[int]] = [set() for _ in merged]
    for a, b in alias[np.asarray(pattern.pairs, dtype=np.int64).reshape(-1, 2)].tolist():
        if a != b:
            near[a].add(b)
            near[b].add(a)
    carried = {b for g, b in pattern.carried.items() if owner.get(g) == b}
    waits = {
        g: {b for b in near[g] if not pattern.multipliers[b]}
        for g in np.flatnonzero(pattern.multipliers).tolist()
        if g not in owner
    }
    if carried:
        _wait_by_carriers(pattern, carried, near, waits)
    left = [b for b in range(len(merged)) if alias[b] == b]
    order, later = _least_degrees([left], size, near, waits)
    cost = _cost(order, later, size)
    if cost > MANY:
        divided = dissection.groups(near, size, left)
        rank = {b: k for k, own in enumerate(divided) for b in own}
        ranks: dict[int, int] = {}
        while ranks != rank:  # with the last of what it waits for
            ranks = dict(rank)
            for group, blocks in waits.items():
                rank[group] = max(rank[b] for b in (group, *blocks))
        found = _least_degrees([[b for b in left if rank[b] == k] for k in range(len(divided))], size, near, waits)
        if _cost(*found, size) < FEWER * cost:
            order, later = found
    rank = {b: i for i, b in enumerate(order)}
    return Order(
        blocks=[np.array(merged[b], dtype=np.int64) for b in order],
        multipliers=[count[b] for b in order],
        later=[np.array(sorted(rank[c] for c in found), dtype=np.int64) for found in later],
    )


def _wait_by_carriers(pattern: Pattern, carried: set[int], near: list[set[int]], waits: dict[int, set[int]]) -> None:
    """Let what acts on carried blocks wait for their stiff carriers, and their other carriers for what acts on them."""
    carriers: dict[int, set[int]] = {b: set() for b in carried}
    for pair in pattern.pairs.tolist():
        for group, block in (pair, pair[::-1]):
            own = pattern.carried.get(group)
            if own in carriers and block != own:
                carriers[own].add(block)
    acting = {b: {g for g in near[b] if g in waits} for b in carried}
    for b, groups in acting.items():
        for group in groups:
            waits[group] |= carriers[b] & pattern.stiff
    for b, groups in acting.items():
        for block in carriers[b] - pattern.stiff:
            waits.setdefault(block, set()).update(groups)


def _least_degrees(
    groups: Sequence[Sequence[int]], size: Sequence[int], couples: Sequence[set[int]], waits: Mapping[int, set[int]]
) -> tuple[list[int], list[set[int]]]:
    """Blocks group after group, by least coupled unknowns at their elimination, and what each coupled to then."""
    near = [set(own) for own in couples]

    def key(b: int) -> tuple[int, int, int]:
        return sum(map(size.__getitem__, near[b])), size[b], b

    waiting = {g: set(blocks) for g, blocks in waits.items() if blocks}
    waited: dict[int, list[int]] = {}
    for g, blocks in waiting.items():
        for b in blocks:
            waited.setdefault(b, []).append(g)
    order: list[int] = []
    later: list[set[int]] = []
    for group in groups:
        keys = {b: key(b) for b in group}
        heap = [keys[b] for b in group if b not in waiting]
        heapq.heapify(heap)
        while heap:
            found = heapq.heappop(heap)
            b = found[2]
            if keys.get(b) != found:
                continue
            del keys[b]
            around = near[b]
            order.append(b)
            later.append(set(around))
            for c in around:
                near[c] |= around
                near[c] -= {b, c}
            freed = []
            for g in waited.get(b, ()):
                waiting[g].discard(b)
                if not waiting[g]:
                    del waiting[g]
                    freed.append(g)
            for c in around & keys.keys():
                keys[c] = key(c)
                if c not in waiting:
                    heapq.heappush(heap, keys[c])
            for g in freed:
                if g in keys and g not in around:
                    heapq.heappush(heap, keys[g])
            near[b] = set()
    return order, later


def _cost(order: Sequence[int], later: Sequence[set[int]], size: Sequence[int]) -> int:
    """Multiplications and additions of a factorisation, in pairs."""
    own = np.array([size[b] for b in order], dtype=np.int64)
    return _pairs(own, np.array([sum(size[c] for c in found) for found in later], dtype=np.int64))


def _pairs(m: Array, w: Array) -> int:
    """Multiplications and additions, in pairs, of blocks of m unknowns that couple to w later ones."""
    return int(np.sum(m * (m - 1) * (2 * m - 1) // 6 + m * m * w + m * w * w))


def _owners(pattern: Pattern) -> dict[int, int]:
    """Groups of multipliers that are bridges, and the block on their side away from the ground."""
    acts: dict[int, set[int]] = {
        g: set() for g in np.flatnonzero(pattern.multipliers).tolist() if g not in pattern.owner
    }
    for a, b in np.asarray(pattern.pairs, dtype=np.int64).reshape(-1, 2).tolist():
        if pattern.multipliers[a] != pattern.multipliers[b] and not {a, b} & pattern.stiff:
            group, block = (a, b) if pattern.multipliers[a] else (b, a)
            acts.get(group, set()).add(block)
    edges: dict[int, tuple[int, int]] = {}
    free = _NONE - 1  # edges of no group: fixed blocks, and groups that act on more than two
    for block in np.flatnonzero(pattern.fixed).tolist():
        edges[free] = (_GROUND, block)
        free -= 1
    for group, blocks in acts.items():
        ends = sorted(blocks)
        if len(ends) == 1:
            edges[group] = (_GROUND, ends[0])
        elif len(ends) == 2:
            edges[group] = (ends[0], ends[1])
        for a, b in itertools.pairwise(ends) if len(ends) > 2 else ():
            edges[free], edges[free - 1] = (a, b), (a, b)
            free -= 2
    found = dict(pattern.owner)
    for edge, child in _bridges(edges):
        if edge >= 0 and len(pattern.blocks[edge]) <= len(pattern.blocks[child]):
            found[edge] = child
    taken = set(found.values())
    for group, block in pattern.carried.items():
        if group not in found and block not in taken:
            found[group] = block
    return found


def _bridges(edges: dict[int, tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Edges in no loop, with their end away from the root: the ground, else the vertex with most edges of a component.

    Notes
    -----
    Tarjan (1974): in a depth-first search, an edge is a bridge if nothing below it reaches beyond its lower end.
    """
    at: dict[int, list[tuple[int, int]]] = {}
    for name, (a, b) in edges.items():
        at.setdefault(a, []).append((name, b))
        at.setdefault(b, []).append((name, a))
    reached: dict[int, int] = {}
    lowest: dict[int, int] = {}
    for root in sorted(at, key=lambda v: (v != _GROUND, -len(at[v]), v)):
        if root in reached:
            continue
        reached[root] = lowest[root] = len(reached)
        stack = [(root, _NONE, iter(at[root]))]
        while stack:
            vertex, above, rest = stack[-1]
            for name, other in rest:
                if name == above:
                    continue
                if other in reached:
                    lowest[vertex] = min(lowest[vertex], reached[other])
                    continue
                reached[other] = lowest[other] = len(reached)
                stack.append((other, name, iter(at[other])))
                break
            else:
                stack.pop()
                if stack:
                    lowest[stack[-1][0]] = min(lowest[stack[-1][0]], lowest[vertex])
                    if lowest[vertex] == reached[vertex]:
                        yield above, vertex


# ------------------------------------------------------------------------------------------------ storage


def stored(order: Order, *, spare: int = 0, inner: int = 0) -> SparseBlocks:
    """Zero matrix whose blocks are eliminated in an order."""
    size = np.array([len(block) for block in order.blocks], dtype=np.int64)
    unknown = np.concatenate(order.blocks) if order.blocks else np.zeros(0, dtype=np.int64)
    n, count = unknown.size, np.array([len(found) for found in order.later], dtype=np.int64)
    if not np.array_equal(np.sort(unknown), np.arange(n)):
        raise ValueError("the blocks must hold each unknown once")
    columns = [np.concatenate([[0], np.cumsum(size[found])]).astype(np.int64) for found in order.later]
    width = np.array([c[-1] for c in columns], dtype=np.int64)
    table = np.zeros((size.size, sparse.N_TABLE), dtype=np.int64)
    table[:, sparse.SIZE], table[:, sparse.WIDTH], table[:, sparse.COUNT] = size, width, count
    table[:, sparse.START] = _starts(size)
    table[:, sparse.AT] = _starts(size * size + 2 * size * width)
    table[:, sparse.FIRST] = _starts(count)
    table[:, sparse.TARGET] = _starts(count * (count + 1) // 2)
    table[:, sparse.MULTIPLIERS] = order.multipliers
    later = np.zeros((int(count.sum()), 2), dtype=np.int64)
    for b, found in enumerate(order.later):
        rows = slice(table[b, sparse.FIRST], table[b, sparse.FIRST] + found.size)
        later[rows, sparse.BLOCK], later[rows, sparse.COLUMN] = found, columns[b][:-1]
    place = np.empty(n, dtype=np.int64)
    place[unknown] = np.arange(n)
    corner = inner + spare
    return SparseBlocks(
        values=np.zeros(int((size * size + 2 * size * width).sum())),
        table=table,
        later=later,
        target=_targets(order, table, columns),
        place=place,
        unknown=unknown,
        block=np.repeat(np.arange(size.size), size),
        pivots=np.zeros(n, dtype=np.int64),
        size=np.zeros(n),
        terms=np.zeros(n),
        x=np.zeros(n),
        loose=np.zeros(int(size.max(initial=1))),
        B=np.zeros((n, corner)),
        C=np.zeros((n, corner)),
        E=np.zeros((corner, corner)),
        order=np.zeros((2, corner), dtype=np.int64),
        scale=np.zeros((2, corner)),
        work=np.zeros((2, corner)),
        deferred=np.zeros(spare, dtype=np.int64),
        counts=np.zeros(sparse.N_COUNTS, dtype=np.int64),
        quality=np.ones(1),
    )


def _starts(sizes: Array) -> Array:
    return np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64) if sizes.size else sizes


def _targets(order: Order, table: Array, columns: list[Array]) -> Array:
    """`SparseBlocks.target`."""
    found = []
    for later in order.later:
        for i, p in enumerate(later):
            found.append(table[p, sparse.AT])
            own, m = order.later[p], table[p, sparse.SIZE]
            at = np.searchsorted(own, later[i + 1 :])
            found.extend((table[p, sparse.AT] + m * m + columns[p][at]).tolist())
    return np.array(found, dtype=np.int64)


def operations(matrix: SparseBlocks) -> int:
    """Multiplications and additions of one factorisation without deferred pivots, in pairs."""
    return _pairs(matrix.table[:, sparse.SIZE], matrix.table[:, sparse.WIDTH])


def redundant_unknowns(matrix: SparseBlocks) -> Array:
    """Unknowns that the last `factor` left undetermined, in ascending order."""
    inner, deferred = int(matrix.counts[sparse.INNER]), int(matrix.counts[sparse.DEFERRED])
    left = matrix.order[1, int(matrix.counts[sparse.RANK]) : inner + deferred]
    return np.sort(matrix.deferred[left[left >= inner] - inner])


def entries(matrix: SparseBlocks) -> tuple[Array, Array, Array]:
    """Values, rows and columns of the blocks before `factor`, fill included: (nz,) each, in the order of `values`."""
    rows, columns = [], []
    for b, (m, w, start) in enumerate(matrix.table[:, [sparse.SIZE, sparse.WIDTH, sparse.START]].tolist()):
        own = np.arange(start, start + m)
        first, count = matrix.table[b, [sparse.FIRST, sparse.COUNT]].tolist()
        others = [
            np.arange(s, s + k)
            for s, k in matrix.table[matrix.later[first : first + count, sparse.BLOCK]][:, [sparse.START, sparse.SIZE]]
        ]
        far = np.concatenate(others) if others else np.zeros(0, dtype=np.int64)
        rows += [np.repeat(own, m), np.repeat(own, w), np.tile(far, m)]
        columns += [np.tile(own, m), np.tile(far, m), np.repeat(own, w)]
    joined = [np.concatenate(part) if part else np.zeros(0, dtype=np.int64) for part in (rows, columns)]
    return matrix.values, matrix.unknown[joined[0]], matrix.unknown[joined[1]]
