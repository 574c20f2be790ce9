"""Matrices and rows of many steps, interpolated between few of them, and their products.

K, C and the derivatives of the equations by parameters are functions of the time at which steps end, as smooth as the
motion where steps are equally long and nothing in the forces has a kink. In a window of steps they are polynomials
through `NODES` of them. Two more steps are evaluated in each window, one in each half: the error goes as a derivative
that may pass zero at one of them. Where the polynomials are off there by more than what is allowed, the window is
halved, and below the shortest one each step is evaluated.
"""

from __future__ import annotations

import numpy as np

from evolvent.compiled.jit import inlined
from evolvent.compiled.pointer import Struct, array

#: Steps of a window through which polynomials go, and steps that are evaluated, of which the last ones are compared;
#: row of matrices of the present step.
NODES, TAKEN, PRESENT = 5, 7, 7
#: Part of a window behind its last step, and before its first one, where a step is compared.
COMPARED = 0.32
#: Steps of a window, and those between two trials; and error of one beside what is allowed behind which there are
#: more steps to the next.
SHORTEST, LONGEST, TRIED_AGAIN, HOPELESS, LONG = 8, 64, 64, 1e3, 1024
#: Errors of matrices and of rows beside their largest entry in the steps that are evaluated, and what of them lets a
#: window grow.
OFF_MATRIX, OFF_ROWS, GROWS = 1e-10, 1e-8, 1e-2
#: Part of a step by which those of a window differ at most.
ALIKE = 1e-9
#: `Windows.counts`: first step of the present window; steps that are evaluated in it; steps of the next one, and before
#: it; steps between the last trials; and whether there are windows at all.
FIRST, EVALUATED, NEXT, WAITS, BETWEEN, SMOOTH, N_COUNTS = range(7)


class Windows(Struct):
    """Matrices of the steps of a window that are evaluated, and scratch memory.

    Attributes
    ----------
    counts : (N_COUNTS,) int
    steps : (TAKEN,) int, those that are evaluated, the last one of the window first; weights : (NODES,) float
    first, entry, place : columns that K and C may have (`transposed.columns_of`)
    K, C : (PRESENT + 1, nk) float, of their columns
    K_first, C_first : (nv + nj + 1,) int, entries of each column of K and C, of which K_entry, C_entry : (nk,) int are
        the rows, and K_place, C_place : (nk,) int the indices in the values of a matrix
    rows : (TAKEN, groups + 1, nv + nj) float; W : (NODES, values, nv + nj) float, sums of solutions
    """

    counts: np.ndarray = array(1, np.int64)
    steps: np.ndarray = array(1, np.int64)
    weights: np.ndarray = array(1)
    first: np.ndarray = array(1, np.int64)
    entry: np.ndarray = array(1, np.int64)
    place: np.ndarray = array(1, np.int64)
    K: np.ndarray = array(2)
    C: np.ndarray = array(2)
    K_first: np.ndarray = array(1, np.int64)
    C_first: np.ndarray = array(1, np.int64)
    K_entry: np.ndarray = array(1, np.int64)
    C_entry: np.ndarray = array(1, np.int64)
    K_place: np.ndarray = array(1, np.int64)
    C_place: np.ndarray = array(1, np.int64)
    rows: np.ndarray = array(3)
    W: np.ndarray = array(3)


WINDOWS = Windows._numba_type_


def windows_of(columns, groups, values, smooth):
    """Room for windows of a matrix by its columns: `Windows`; smooth : bool, whether steps are interpolated."""
    (first, entry, place), counts = columns, np.zeros(N_COUNTS, dtype=np.int64)
    counts[NEXT], counts[BETWEEN], counts[SMOOTH] = 2 * SHORTEST, TRIED_AGAIN, smooth
    n, size = first.size - 1, place.size
    of = (np.zeros(shape, dtype=np.int64) for shape in (n + 1, n + 1, size, size, size, size))
    names = ("K_first", "C_first", "K_entry", "C_entry", "K_place", "C_place")
    return Windows(
        counts=counts,
        steps=np.zeros(TAKEN, dtype=np.int64),
        weights=np.zeros(NODES),
        first=first,
        entry=entry,
        place=place,
        K=np.zeros((PRESENT + 1 if smooth else 1, size)),
        C=np.zeros((PRESENT + 1 if smooth else 1, size)),
        rows=np.zeros((TAKEN if smooth else 1, groups + 1, n)),
        W=np.zeros((NODES if smooth else 1, values, n)),
        **dict(zip(names, of, strict=True)),
    )


@inlined
def place_nodes(last, size, windows):
    """Steps that are evaluated in a window of some size up to a step."""
    nodes, n = windows.steps, size - 1
    nodes[0], nodes[4] = last, last - n
    nodes[1], nodes[2], nodes[3] = last - int(0.146 * n + 0.5), last - n // 2, last - int(0.854 * n + 0.5)
    nodes[NODES], nodes[NODES + 1] = last - int(COMPARED * n + 0.5), last - int((1.0 - COMPARED) * n + 0.5)


@inlined
def weigh(n, windows):
    """Weights of the steps of a window that are evaluated in step n."""
    nodes, weights = windows.steps, windows.weights
    for j in range(NODES):
        weight = 1.0
        for i in range(NODES):
            if i != j:
                weight *= (n - nodes[i]) / (nodes[j] - nodes[i])
        weights[j] = weight


@inlined
def _off(of, step, weights):
    """Largest error of what is interpolated at a step that is compared, and largest entry of all that are evaluated."""
    off = largest = 0.0
    for k in range(of.shape[1]):
        value = -of[step, k]
        for j in range(NODES):
            value += weights[j] * of[j, k]
            largest = max(largest, abs(of[j, k]))
        off, largest = max(off, abs(value)), max(largest, abs(of[step, k]))
    return off, largest


@inlined
def error_of(rated, windows):
    """Error of a window beside what is allowed; rated : bool, whether there is C."""
    error = 0.0
    for step in range(NODES, TAKEN):
        weigh(windows.steps[step], windows)
        off, largest = _off(windows.K, step, windows.weights)
        if rated:
            by_rate, most = _off(windows.C, step, windows.weights)
            off, largest = max(off, by_rate), max(largest, most)
        error = max(error, off / (OFF_MATRIX * largest) if largest > 0.0 else 0.0)
        for g in range(windows.rows.shape[1]):
            off, largest = _off(windows.rows[:, g], step, windows.weights)
            error = max(error, off / (OFF_ROWS * largest) if largest > 0.0 else 0.0)
    return error


@inlined
def _join(first, entry, place, many, values, own_first, own_entry, own_place):
    """Leave entries out that are zero in all of the first `many` of some matrices."""
    at = 0
    for j in range(first.size - 1):
        own_first[j] = at
        for k in range(first[j], first[j + 1]):
            held = False
            for s in range(many):
                held = held or values[s, k] != 0.0
            if held:
                for s in range(many):
                    values[s, at] = values[s, k]
                own_entry[at], own_place[at] = entry[k], place[k]
                at += 1
    own_first[first.size - 1] = at


@inlined
def begin_window(first, evaluated, rated, windows):
    """Make a window of the steps from the first one on, of which some are evaluated."""
    w = windows
    w.counts[FIRST], w.counts[EVALUATED] = first, evaluated
    _join(w.first, w.entry, w.place, evaluated, w.K, w.K_first, w.K_entry, w.K_place)
    if rated:
        _join(w.first, w.entry, w.place, evaluated, w.C, w.C_first, w.C_entry, w.C_place)
    for j in range(evaluated):
        for q in range(w.W.shape[1]):
            for i in range(w.W.shape[2]):
                w.W[j, q, i] = 0.0


@inlined
def interpolate_step(n, rated, windows):
    """Matrices of step n of the window; returns the row of K and C in which they are."""
    w, weights = windows, windows.weights
    if w.counts[EVALUATED] == 1:
        weights[0] = 1.0
        return 0
    weigh(n, windows)
    a, b, c, d, e = weights[0], weights[1], weights[2], weights[3], weights[4]
    K, C = w.K, w.C
    for k in range(w.K_first[w.K_first.size - 1]):
        K[PRESENT, k] = a * K[0, k] + b * K[1, k] + c * K[2, k] + d * K[3, k] + e * K[4, k]
    for k in range(w.C_first[w.C_first.size - 1] if rated else 0):
        C[PRESENT, k] = a * C[0, k] + b * C[1, k] + c * C[2, k] + d * C[3, k] + e * C[4, k]
    return PRESENT


@inlined
def multiply_columns(first, entry, values, x, out):
    """Out = product of the transpose of a matrix, by its columns, with x."""
    for j in range(x.size):
        total = 0.0
        for k in range(first[j], first[j + 1]):
            total += values[k] * x[entry[k]]
        out[j] = total


@inlined
def note_solutions(W, windows):
    """Add solutions (values, nv + nj) of a step to the sums by which rows of the window are multiplied."""
    for j in range(windows.counts[EVALUATED]):
        weight, sums = windows.weights[j], windows.W[j]
        for q in range(W.shape[0]):
            for i in range(W.shape[1]):
                sums[q, i] += weight * W[q, i]


@inlined
def end_window(derivatives, found, windows):
    """Add products of solutions and rows of a window to `found`, and those by the time to the last derivatives."""
    rows, last = windows.rows, derivatives.shape[1] - 1
    groups = rows.shape[1] - 1
    for j in range(windows.counts[EVALUATED]):
        for q in range(derivatives.shape[0]):
            W = windows.W[j, q]
            for g in range(groups):
                for i in range(W.size):
                    found[q * groups + g, i] += W[i] * rows[j, g, i]
            for i in range(W.size):
                derivatives[q, last] -= W[i] * rows[j, groups, i]


@inlined
def note_trial(error, size, windows):
    """Size of the next window by the error of one, and how many steps are evaluated before it where that fails."""
    counts = windows.counts
    if error <= 1.0:
        counts[BETWEEN] = TRIED_AGAIN
        if error <= GROWS and size == counts[NEXT]:
            counts[NEXT] = min(2 * size, LONGEST)
    elif error > HOPELESS:
        counts[WAITS], counts[NEXT] = LONG, SHORTEST
    elif size >= 2 * SHORTEST:
        counts[NEXT] = size // 2
    else:
        counts[WAITS], counts[NEXT] = counts[BETWEEN], SHORTEST
        counts[BETWEEN] *= 2
