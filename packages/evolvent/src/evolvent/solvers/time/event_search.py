"""Events that rise within a step: where their values are evaluated, and between which places the first one rises.

The values at the ends of a step do not show an event that rises and falls again in it. So they are evaluated in its
middle and at its quarters. In a half of the step, the parabola through its ends and its middle gives the values in
between; the parabola of the whole step was off by `spread` at the quarters. Where twice that and a part of the values'
range could bring a value from below zero to zero, the half is halved, and so on: values far from zero cost three
evaluations a step, and one that nearly reaches zero a few more.

What is found: an excursion through zero, as short as 2^-DEPTH of the step, of a value that has one extremum or kink
between neighbouring places. What is not: a pulse between places at which the value shows no sign of it, such as that of
a value that is constant elsewhere.
"""

from __future__ import annotations

import numpy as np
from numba import types

from evolvent.compiled.jit import ADDRESSES, indirect, inlined
from evolvent.compiled.pointer import Struct, array, record, shared, zeros_record

#: Halvings of a step at most.
DEPTH = 20
#: Rows of values: at the start of the step, its end, its middle, and two of each halving.
START, END, MIDDLE, FIRST = 0, 1, 2, 3
ROWS = FIRST + 2 * DEPTH
#: Spreads, and part of the range of the values, by which a value in between may differ from the parabola; the share of
#: the largest value above which that leaves open how often it crosses zero.
MARGIN, RANGE, OPEN = 2.0, 0.05, 0.5
#: Value, beside those later in the step, up to which an event at its start has just fired.
FIRED = 1e-6
#: What a search knows. asked: 1 for the middle, 2 and 3 for the quarters of the part at hand (left, middle, right:
#: rows; level: number of halvings), 0 for none; height: of the stack of parts; low, high: rows between which an event
#: rises.
SEARCH = np.dtype(
    [(name, np.int64) for name in ("asked", "height", "left", "middle", "right", "level", "low", "high")], align=True
)


class EventSearch(Struct):
    """Scratch of a search.

    Attributes
    ----------
    state : record (see `SEARCH`)
    place : (ROWS,) float, parts of the step; values : (ROWS, n) float, of n events there
    spread : (DEPTH + 1, n) float, by which parabolas were off; stack : (DEPTH + 2, 4) int, parts left to look at
    addresses : of functions that compiled code calls by address
    always : (n,) int, whether an event is due from zero on wherever it comes from; else only from below
    """

    state: np.record = record(SEARCH)
    place: np.ndarray = array(1)
    values: np.ndarray = array(2)
    spread: np.ndarray = array(2)
    stack: np.ndarray = array(2, np.int64)
    always: np.ndarray = array(1, np.int64)
    addresses: np.ndarray = shared(ADDRESSES)


def room(always: np.ndarray) -> EventSearch:
    """Room for the search of events."""
    place = np.zeros(ROWS)
    place[END], place[MIDDLE] = 1.0, 0.5
    return EventSearch(
        state=zeros_record(SEARCH),
        place=place,
        values=np.zeros((ROWS, always.size)),
        spread=np.zeros((DEPTH + 1, always.size)),
        stack=np.zeros((DEPTH + 2, 4), dtype=np.int64),
        always=always.astype(np.int64),
    )


_I = types.int64
SEARCHES = EventSearch._numba_type_


@inlined
def begin_search(search):
    """Begin the search; the rows of both ends of the step hold the values there."""
    search.state.asked = search.state.height = 0
    search.state.low = search.state.high = -1


@indirect(_I(SEARCHES))
def next_row(search):
    """Row into which the values at its place are to be written next; -1 where the search has ended.

    Then `state.low` and `state.high` are the rows between which the first event rises, or -1.
    """
    state = search.state
    if state.asked == 0 and state.height == 0:
        state.asked = 1
        return MIDDLE
    if state.asked == 1:
        return _ask(START, MIDDLE, END, 0, search)
    if state.asked == 2:
        state.asked = 3
        return FIRST + 2 * state.level + 1
    _halve(search)
    while state.height > 0:
        state.height -= 1
        part = search.stack[state.height]
        left, middle, right, level = part[0], part[1], part[2], part[3]
        if level < DEPTH and _is_open(left, middle, right, level, search):
            return _ask(left, middle, right, level, search)
        if _rises(left, middle, search) or _rises(middle, right, search):
            return -1
    return -1


@inlined
def _ask(left, middle, right, level, search):
    """Ask for the values at the quarters of a part: the row of the first."""
    state, place, row = search.state, search.place, FIRST + 2 * level
    state.left, state.middle, state.right, state.level, state.asked = left, middle, right, level, 2
    place[row] = 0.5 * (place[left] + place[middle])
    place[row + 1] = 0.5 * (place[middle] + place[right])
    return row


@inlined
def _halve(search):
    """Put the halves of the part at hand on the stack, the first one on top, with the spread of its parabola."""
    state, G, level = search.state, search.values, search.state.level
    a, b, c, first = state.left, state.middle, state.right, FIRST + 2 * state.level
    for k in range(G.shape[1]):
        one = 0.125 * (3.0 * G[a, k] + 6.0 * G[b, k] - G[c, k])
        other = 0.125 * (3.0 * G[c, k] + 6.0 * G[b, k] - G[a, k])
        search.spread[level + 1, k] = max(abs(G[first, k] - one), abs(G[first + 1, k] - other))
    _push(b, first + 1, c, level + 1, search)
    _push(a, first, b, level + 1, search)
    state.asked = 0


@inlined
def _push(left, middle, right, level, search):
    """Put a part on the stack."""
    part = search.stack[search.state.height]
    part[0], part[1], part[2], part[3] = left, middle, right, level
    search.state.height += 1


@inlined
def _rises(low, high, search):
    """Whether an event rises between two rows, which are then the result."""
    G = search.values
    for k in range(G.shape[1]):
        if G[high, k] >= 0.0 and (search.always[k] != 0 or G[low, k] < 0.0):
            search.state.low, search.state.high = low, high
            return True
    return False


@inlined
def _is_open(left, middle, right, level, search):
    """Whether an event may rise in a part where its values at three places do not show it."""
    G = search.values
    for k in range(G.shape[1]):
        if _may_rise(G[left, k], G[middle, k], G[right, k], MARGIN * search.spread[level, k]):
            return True
    return False


@inlined
def _extremum(a, b, c, sign):
    """Largest (sign 1) or least (-1) value of the parabola through three values, between its ends; else the middle."""
    slope, bend = 4.0 * b - 3.0 * a - c, 2.0 * (a + c - 2.0 * b)
    if sign * bend < 0.0 and 0.0 < -slope * bend < 2.0 * bend * bend:
        return a - 0.25 * slope * slope / bend
    return b


@inlined
def _may_rise(a, b, c, d):
    """Whether a value may rise through zero where a, b and c, off by d in between, do not show it.

    An event that has just fired stands at zero, which is no sign of another one.
    """
    d += RANGE * (max(a, b, c) - min(a, b, c))
    if a < 0.0 and b < 0.0 and c < 0.0:
        return max(_extremum(a, b, c, 1.0), a, c) + d >= 0.0
    if a >= 0.0 and b >= 0.0 and c >= 0.0:
        return min(_extremum(a, b, c, -1.0), c, a if a > FIRED * max(b, c) else b) - d < 0.0
    if a < 0.0 and b < 0.0 and max(a, b) + d < 0.0:
        return False
    return d > OPEN * max(abs(a), abs(b), abs(c))
