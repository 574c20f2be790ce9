"""Matrices and parameter derivatives of many steps, interpolated between a few steps, and their products.

K, C and the derivatives of the equations by parameters are functions of the time at which steps end, as smooth as the
motion where steps are equally long and nothing in the forces has a kink. In a window of steps they are interpolated
by polynomials through `NODES` of them. Two more steps are evaluated in each window to check this, one in each half,
because the error may be zero at one of them: if it exceeds a tolerance, the window is halved, and below the shortest
window each step is evaluated.
"""

from __future__ import annotations

import numpy as np

from evolvent.compiled.jit import inlined
from evolvent.compiled.pointer import Struct, array

#: Number of nodes of a window, and of all steps evaluated in it, of which the last ones are the checks; rows of
#: `Windows.K` and `C`: those of these steps, then of the current step.
NODES, TAKEN, CURRENT = 5, 7, 7
#: Distance of a check from either end of a window, relative to its length.
CHECKED = 0.32
#: Numbers of steps of the shortest and the longest window, and before the next trial; ratio of error to tolerance above
#: which the next trial is after `LONG_WAIT` steps.
SHORTEST, LONGEST, RETRY, LARGE_ERROR, LONG_WAIT = 8, 64, 64, 1e3, 1024
#: Tolerances of matrices and of rows, relative to their largest entry in the steps evaluated; and ratio of error to
#: tolerance below which the next window is doubled.
MATRIX_TOLERANCE, ROW_TOLERANCE, GROWTH_LIMIT = 1e-10, 1e-8, 1e-2
#: Largest relative difference of the lengths of steps in a window.
STEP_TOLERANCE = 1e-9
#: `Windows.counts`: first step of the current window; number of its steps that are evaluated; number of steps of the
#: next window; steps before it is tried; steps before a trial after the next failure; 1 if steps are interpolated.
FIRST, EVALUATED, NEXT, WAIT, RETRY_WAIT, SMOOTH, N_COUNTS = range(7)


class Windows(Struct):
    """Matrices of the evaluated steps of a window, and scratch memory.

    Attributes
    ----------
    counts : (N_COUNTS,) int
    steps : (TAKEN,) int, numbers of the steps that are nodes, the last step of the window first, and of the checks
    weights : (NODES,) float, of the nodes in the current step
    first, entry, place : possible entries of K and C by columns (`transposed.columns_of`)
    K, C : (CURRENT + 1, nk) float, their entries
    K_first, C_first : (nv + nj + 1,) int, first nonzero entry of each column of K and C
    K_entry, C_entry : (nk,) int, rows of these entries
    K_place, C_place : (nk,) int, indices of these entries in the values of a matrix
    rows : (TAKEN, groups + 1, nv + nj) float, derivatives of the equations by groups of parameters and by time
    W : (NODES, values, nv + nj) float, weighted sums of solutions
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
    """Allocate `Windows` for the columns of a matrix; smooth : bool, whether steps are interpolated."""
    (first, entry, place), counts = columns, np.zeros(N_COUNTS, dtype=np.int64)
    counts[NEXT], counts[RETRY_WAIT], counts[SMOOTH] = 2 * SHORTEST, RETRY, smooth
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
        K=np.zeros((CURRENT + 1 if smooth else 1, size)),
        C=np.zeros((CURRENT + 1 if smooth else 1, size)),
        rows=np.zeros((TAKEN if smooth else 1, groups + 1, n)),
        W=np.zeros((NODES if smooth else 1, values, n)),
        **dict(zip(names, of, strict=True)),
    )


@inlined
def choose_nodes(last, size, windows):
    """Choose the nodes (near Chebyshev-Lobatto points) and the checks of a window of `size` steps up to step `last`."""
    nodes, n = windows.steps, size - 1
    nodes[0], nodes[4] = last, last - n
    nodes[1], nodes[2], nodes[3] = last - int(0.146 * n + 0.5), last - n // 2, last - int(0.854 * n + 0.5)
    nodes[NODES], nodes[NODES + 1] = last - int(CHECKED * n + 0.5), last - int((1.0 - CHECKED) * n + 0.5)


@inlined
def lagrange_weights(n, windows):
    """Lagrange weights of the nodes of a window in step n."""
    nodes, weights = windows.steps, windows.weights
    for j in range(NODES):
        weight = 1.0
        for i in range(NODES):
            if i != j:
                weight *= (n - nodes[i]) / (nodes[j] - nodes[i])
        weights[j] = weight


@inlined
def _interpolation_error(of, step, weights):
    """Largest interpolation error at a check, and largest entry there and at the nodes."""
    off = largest = 0.0
    for k in range(of.shape[1]):
        value = -of[step, k]
        for j in range(NODES):
            value += weights[j] * of[j, k]
            largest = max(largest, abs(of[j, k]))
        off, largest = max(off, abs(value)), max(largest, abs(of[step, k]))
    return off, largest


@inlined
def window_error(rated, windows):
    """Largest ratio of interpolation error to tolerance in a window; rated : bool, whether there is C."""
    error = 0.0
    for step in range(NODES, TAKEN):
        lagrange_weights(windows.steps[step], windows)
        off, largest = _interpolation_error(windows.K, step, windows.weights)
        if rated:
            by_rate, most = _interpolation_error(windows.C, step, windows.weights)
            off, largest = max(off, by_rate), max(largest, most)
        error = max(error, off / (MATRIX_TOLERANCE * largest) if largest > 0.0 else 0.0)
        for g in range(windows.rows.shape[1]):
            off, largest = _interpolation_error(windows.rows[:, g], step, windows.weights)
            error = max(error, off / (ROW_TOLERANCE * largest) if largest > 0.0 else 0.0)
    return error


@inlined
def _drop_zeros(first, entry, place, many, values, own_first, own_entry, own_place):
    """Remove entries that are zero in all of the first `many` matrices."""
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
    """Begin a window at step `first`, whose first `evaluated` slots are filled."""
    w = windows
    w.counts[FIRST], w.counts[EVALUATED] = first, evaluated
    _drop_zeros(w.first, w.entry, w.place, evaluated, w.K, w.K_first, w.K_entry, w.K_place)
    if rated:
        _drop_zeros(w.first, w.entry, w.place, evaluated, w.C, w.C_first, w.C_entry, w.C_place)
    for j in range(evaluated):
        for q in range(w.W.shape[1]):
            for i in range(w.W.shape[2]):
                w.W[j, q, i] = 0.0


@inlined
def interpolate_step(n, rated, windows):
    """Interpolate K and C in step n of the window; returns their row in `Windows.K` and `C`."""
    w, weights = windows, windows.weights
    if w.counts[EVALUATED] == 1:
        weights[0] = 1.0
        return 0
    lagrange_weights(n, windows)
    a, b, c, d, e = weights[0], weights[1], weights[2], weights[3], weights[4]
    K, C = w.K, w.C
    for k in range(w.K_first[w.K_first.size - 1]):
        K[CURRENT, k] = a * K[0, k] + b * K[1, k] + c * K[2, k] + d * K[3, k] + e * K[4, k]
    for k in range(w.C_first[w.C_first.size - 1] if rated else 0):
        C[CURRENT, k] = a * C[0, k] + b * C[1, k] + c * C[2, k] + d * C[3, k] + e * C[4, k]
    return CURRENT


@inlined
def multiply_columns(first, entry, values, x, out):
    """Write the product of the transpose of a matrix, given by columns, with x to out."""
    for j in range(x.size):
        total = 0.0
        for k in range(first[j], first[j + 1]):
            total += values[k] * x[entry[k]]
        out[j] = total


@inlined
def add_weighted_solutions(W, windows):
    """Add solutions (values, nv + nj) of a step, times its Lagrange weights, to the sums of the nodes."""
    for j in range(windows.counts[EVALUATED]):
        weight, sums = windows.weights[j], windows.W[j]
        for q in range(W.shape[0]):
            for i in range(W.shape[1]):
                sums[q, i] += weight * W[q, i]


@inlined
def end_window(derivatives, found, windows):
    """Add products of solutions and rows of a window to `found`, and those by time to the last of the derivatives."""
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
def adapt_window(error, size, windows):
    """Set the size of the next window, and the steps before it, by the `window_error` of a window of `size` steps."""
    counts = windows.counts
    if error <= 1.0:
        counts[RETRY_WAIT] = RETRY
        if error <= GROWTH_LIMIT and size == counts[NEXT]:
            counts[NEXT] = min(2 * size, LONGEST)
    elif error > LARGE_ERROR:
        counts[WAIT], counts[NEXT] = LONG_WAIT, SHORTEST
    elif size >= 2 * SHORTEST:
        counts[NEXT] = size // 2
    else:
        counts[WAIT], counts[NEXT] = counts[RETRY_WAIT], SHORTEST
        counts[RETRY_WAIT] *= 2
