"""Steps of generalized-alpha as linear maps, kept while a run takes them, and their transposes (the adjoint).

Notes
-----
A step from z0 = (e0, v0, a0, d0) to z1, with e changes of the coordinates along increments of the state (of a free
body's attitude a turn in its axes), v velocities, a the algorithmic and d the true accelerations, is linear in the
change u of its increments but for the turns::

    e1 = T u + E e0,   v1 = r u + ...,   a1 = u/(beta h^2) + ...,   d1 = c u + ...          T = Jr(dq), E = exp(-dq)
    K e1 + C v1 + M d1 + G^T mu + R_p dp = 0,   G e1 + g_p dp = 0                           r, c: `alpha.rates`

The states are kept, from which K, C, M and R_p of each parameter follow. Backwards, with the derivatives
(x, y, z, w) of a value by z1, the transposed equations have one solution W for all parameters::

    (K T + r C + c M)^T W = T^T x + r y + z/(beta h^2) + c w,        dvalue -= W^T R_p dp

Steps that end on a latch, an event, a change of loads or the end of the run are kept as dense maps, which
`evolvent.solvers.sensitivity.adjoint` finds by neighbours.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.algebra import sparse
from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.compiled.pointer import Struct, array, at_address
from evolvent.equations.between_steps import note_state
from evolvent.equations.implicit import residual, tangent
from evolvent.kernels import watches
from evolvent.kernels.blocks import RATE, ROTATION, displace
from evolvent.kernels.calls import tangent_at
from evolvent.model import MODEL
from evolvent.model.interval import state_interval
from evolvent.solvers.sensitivity.steps_beside import NONE, TOGETHER, TRIED, take_step
from evolvent.solvers.sensitivity.transposed import (
    BY_MASS,
    BY_RATE,
    BY_STATE,
    LINEAR,
    MOST,
    RATE_AGE,
    REMEASURE,
    TURNED,
    factor_again,
    keep_solutions,
    note_corrections,
    prepare,
    solve_transposed,
    turn_transposed,
)
from evolvent.solvers.sensitivity.windows import (
    FIRST,
    NEXT,
    NODES,
    SHORTEST,
    SMOOTH,
    STEP_TOLERANCE,
    TAKEN,
    WAIT,
    WINDOWS,
    adapt_window,
    add_weighted_solutions,
    begin_window,
    choose_nodes,
    end_window,
    interpolate_step,
    window_error,
)
from evolvent.solvers.time.dense import interpolate
from evolvent.solvers.time.implicit import alpha, loop as implicit_loop, methods as method
from evolvent.solvers.time.implicit.workspace import BUDGET, WORKSPACE

_I = types.int64
#: Numbers of a step in `RecordedSteps.numbers`: time and length, part of the algorithmic accelerations that it starts
#: from, scale of the constraints, its samples, from the first up to another one, and filter of energy-momentum.
TIME, LENGTH, PART, SCALE, FIRST_SAMPLE, END_SAMPLE, CHI, CHI_V, RATIO, N_NUMBERS = range(10)
#: `RecordedSteps.counts`: steps that are kept, whether the time of the steps depends on the parameters, and forces on
#: that time; kind and latch of the last step (`steps_beside.step_beside`).
STEPS, SHIFTED, TIMED, KIND, LATCH, N_COUNTS = range(6)
#: Status of a record that is full, before a step to a given time, and behind a step that is taken back to end on an
#: event.
FULL, LANDS, SEARCHES = 11, 12, 13
#: Change of time by which forces are derived, of a step; and sizes of changes by which samples are.
SHIFT, CHANGE = 1e-4, 1e-6
_model_at = at_address(MODEL)


class RecordedSteps(Struct):
    """Steps that are kept: n at most.

    Attributes
    ----------
    counts : (N_COUNTS,) int; numbers : (n, N_NUMBERS) float
    y0, y1 : (n, ny) float, states at the ends; dq : (n, nv) float, increments
    a : (n, nv) float, true accelerations at the end, or of energy-momentum changes of velocities over the step before
    la : (n, nj) float, multipliers at the end
    switches : (n, ns) int, with which the step was solved
    """

    counts: np.ndarray = array(1, np.int64)
    numbers: np.ndarray = array(2)
    y0: np.ndarray = array(2)
    y1: np.ndarray = array(2)
    dq: np.ndarray = array(2)
    a: np.ndarray = array(2)
    la: np.ndarray = array(2)
    switches: np.ndarray = array(2, np.int64)


RECORDED_STEPS = RecordedSteps._numba_type_


# ------------------------------------------------------------------------------------------------ forwards


@indirect(void(MODEL, WORKSPACE))
def note_start(model, work):
    """What records keep of the start of a step, of a state that has been changed."""
    t = work.loop.time
    note_state(t, work.y, model.switches, model)
    if model.watches.size > 0:
        watches.note_values(t, work.y, model)
        for k in range(model.watches.size):
            model.watches[k].value = model.watches[k].now


@inlined
def _keep_step(t0, part, h, first, model, work, recorded):
    """Keep the step of length h from t0 that a run has taken, with `part` of its algorithmic accelerations.

    `first` is its first sample. Its switches stand in the record: those of the model are counted on at its end.
    """
    n, numbers = recorded.counts[STEPS], recorded.numbers[recorded.counts[STEPS]]
    numbers[TIME], numbers[LENGTH], numbers[PART], numbers[SCALE] = t0, h, part, method.scale_of(h, work.options)
    numbers[FIRST_SAMPLE], numbers[END_SAMPLE] = first, work.loop.sample
    for i in range(work.y.size):
        recorded.y0[n, i], recorded.y1[n, i] = work.y0[i], work.y[i]
    numbers[CHI], numbers[CHI_V], numbers[RATIO] = work.step.step.chi, work.step.step.chi_v, work.step.step.ratio
    for i in range(work.dq.size):
        recorded.dq[n, i] = work.dq[i]
        if work.options.midpoint == 0:
            recorded.a[n, i] = work.dv1[i]
    for i in range(work.la.size):
        recorded.la[n, i] = work.la[i]
    recorded.counts[STEPS] += 1


@indirect(_I(_I, MODEL, SPARSE, WORKSPACE, RECORDED_STEPS))
def advance_keeping(budget, model, matrix, work, recorded):
    """Go on for `budget` steps, and keep them; returns a status.

    That is one of `steps_beside.take_step`; `FULL` or `LANDS` before a step that is not taken yet; or `SEARCHES` behind
    one that has been taken back. `TOGETHER` where an event has come without a search.
    """
    loop, near = work.loop, 10.0 * work.options.smallest
    end = work.samples[work.samples.size - 1]
    for _ in range(budget):
        n = recorded.counts[STEPS]
        if n == recorded.numbers.shape[0]:
            return FULL
        stops = loop.stop < work.stops.size and work.stops[loop.stop] < end - near
        target = work.stops[loop.stop] if stops else end
        _, lands = implicit_loop.step_length(target - loop.time, model, work)
        if lands and (stops or recorded.counts[SHIFTED] != 0):
            return LANDS
        t0, steps, first, last = loop.time, loop.steps, loop.sample, loop.last
        for i in range(model.switches.size):
            recorded.switches[n, i] = model.switches[i]
        if work.options.midpoint != 0:
            for i in range(work.dq.size):
                recorded.a[n, i] = work.step.before[i]
        code, recorded.counts[KIND], recorded.counts[LATCH] = take_step(model, matrix, work)
        if loop.steps > steps:
            if recorded.counts[LATCH] != NONE:
                return TOGETHER
            part = min(loop.last / last, 1.0) if last > 0.0 else 1.0
            _keep_step(t0, part, loop.last, first, model, work, recorded)
        elif recorded.counts[LATCH] == TRIED and math.isfinite(loop.event_step) and code == BUDGET:
            return SEARCHES
        if code != BUDGET:
            return code
    return BUDGET


# ------------------------------------------------------------------------------------------------ backwards


@inlined
def _evaluate(t, n, model, work, recorded, linear):
    """Residual of a model at the end of step n, at time t, into `linear.r`."""
    residual(t, recorded.y1[n], recorded.a[n], recorded.la[n], 0.0, 1.0, model, linear.r, work.powers[1])


@inlined
def _differentiate(n, slot, model, models, work, recorded, room, linear, windows):
    """Linearize the equations of step n of a record; rows, K and C are written to `slot` of the windows."""
    n_v, h, scale = model.info.nv, recorded.numbers[n, LENGTH], recorded.numbers[n, SCALE]
    t, y, la, size = recorded.numbers[n, TIME] + h, recorded.y1[n], recorded.la[n], linear.r.size
    _, c_rate = alpha.rates(h, work.options)
    groups, rows = linear.sides.size, windows.rows[slot]
    for i in range(model.switches.size):
        model.switches[i] = recorded.switches[n, i]
    for g in range(groups):
        for side in range(linear.sides[g]):
            own = _model_at(models[2 * g + side])
            for i in range(model.switches.size):
                own.switches[i] = model.switches[i]
            _evaluate(t, n, own, work, recorded, linear)
            for i in range(size):
                rows[g, i] = linear.r[i] if side == 0 else 0.5 * (rows[g, i] - linear.r[i])
    for i in range(size):
        rows[groups, i] = 0.0
    if recorded.counts[TIMED] != 0:
        for side in (1.0, -1.0):
            _evaluate(t + side * SHIFT * h, n, model, work, recorded, linear)
            for i in range(size):
                rows[groups, i] += 0.5 * side / (SHIFT * h) * linear.r[i]
    _evaluate(t, n, model, work, recorded, linear)
    for g in range(groups + 1):
        for i in range(size):
            if g < groups and linear.sides[g] == 1:
                rows[g, i] -= linear.r[i]
            if g < groups and rows[g, i] != 0.0:
                linear.changes[g, i] = 1
            if i >= n_v:
                rows[g, i] *= scale
    _assemble(t, y, la, c_rate, scale, model, room, linear, windows.place, windows.K[slot], windows.C[slot])


@inlined
def _assemble(t, y, la, c_rate, scale, model, room, linear, place, by_state, by_rate):
    """Write K, derivatives by coordinates, and C, derivatives by rates times c_rate; to be called after `residual`.

    Tangents without derivatives by rates are assembled once. place : (nk,) int, indices of the entries in the matrix;
    by_state, by_rate : (nk,) float, output, entries of K and C.
    """
    at, values = model.interval, room.values
    sparse.clear(room)
    at.t, at.tm, at.h, at.c_mass, at.c_rate, at.scale = t, t, 0.0, 0.0, 0.0, scale
    at.span, at.chi, at.chi_v, at.ratio, at.soft = 0.0, 0.0, 0.0, 0.0, 1.0
    interval = state_interval(at, y, y, la, la, la, model.switches, y)
    for k in range(linear.rated.size):
        tangent_at(model, linear.rated[k])(interval, model, room)
    for k in range(place.size if linear.rated.size > 0 else 0):
        by_rate[k] = -values[place[k]]
    for k in range(linear.steady.size):
        tangent_at(model, linear.steady[k])(interval, model, room)
    for k in range(place.size):
        by_state[k] = values[place[k]]
    if linear.rated.size > 0:
        sparse.clear(room)
        at.c_rate = c_rate
        for k in range(linear.rated.size):
            tangent_at(model, linear.rated[k])(interval, model, room)
        for k in range(place.size):
            by_rate[k] += values[place[k]]


@indirect(void(_I, MODEL, WORKSPACE, RECORDED_STEPS, SPARSE, LINEAR))
def find_mass(n, model, work, recorded, room, linear):
    """The mass matrix, which is constant, from step n of a record, into `room`."""
    h, scale = recorded.numbers[n, LENGTH], recorded.numbers[n, SCALE]
    t, y, la = recorded.numbers[n, TIME] + h, recorded.y1[n], recorded.la[n]
    c_mass = 1.0 / (h * h)
    _evaluate(t, n, model, work, recorded, linear)
    tangent(t, y, la, 0.0, 0.0, scale, model, room)
    for i in range(linear.K.size):
        linear.K[i] = room.values[i]
    tangent(t, y, la, c_mass, 0.0, scale, model, room)
    for i in range(linear.K.size):
        room.values[i] = (room.values[i] - linear.K[i]) / c_mass


@inlined
def _are_uniform(n, last, recorded):
    """Whether the steps n to `last` of a record have the same length and the same switches."""
    h = recorded.numbers[last, LENGTH]
    for k in range(n, last):
        if abs(recorded.numbers[k, LENGTH] - h) > STEP_TOLERANCE * h:
            return False
        for i in range(recorded.switches.shape[1]):
            if recorded.switches[k, i] != recorded.switches[last, i]:
                return False
    return True


@inlined
def _evaluate_window(first, last, model, models, work, recorded, room, linear, windows):
    """Evaluate the steps by which a window up to step `last` is interpolated, or step `last` alone.

    first : int, first step that a window may contain
    """
    counts, rated = windows.counts, linear.rated.size > 0
    size, evaluated = min(counts[NEXT], last - first + 1), 0
    if counts[SMOOTH] != 0 and counts[WAIT] == 0 and size >= SHORTEST and _are_uniform(last - size + 1, last, recorded):
        choose_nodes(last, size, windows)
        for slot in range(TAKEN):
            _differentiate(windows.steps[slot], slot, model, models, work, recorded, room, linear, windows)
        error = window_error(rated, windows)
        adapt_window(error, size, windows)
        evaluated = NODES if error <= 1.0 else 1
    if evaluated == 0:
        counts[WAIT] = max(counts[WAIT] - 1, 0)
        _differentiate(last, 0, model, models, work, recorded, room, linear, windows)
        evaluated = 1
    begin_window(last if evaluated == 1 else last - size + 1, evaluated, rated, windows)


@indirect(_I(_I, _I, RECORDED_STEPS, SPARSE, SPARSE, MODEL, INTEGERS, WORKSPACE, LINEAR, WINDOWS, MATRIX, MATRIX))
def pull_back(first, last, recorded, room, matrix, model, models, work, linear, windows, derivatives, found):
    """Take derivatives of values by the state at the end of step `last` back to the start of step `first`.

    Parameters
    ----------
    room, matrix : SparseBlocks as the run's, scratch
    model : Model, as the run's at these steps
    models : (2 groups,) int, addresses of the models of neighbours, at larger and smaller parameters
    work : Workspace, of the method's constants
    derivatives : (values, 4 nv + 1) float, by (e, v, a, d) and the time by which the steps are shifted
    found : (values groups, nv + nj) float, to which products of W and the rows are added

    Returns
    -------
    int, the number of steps that are left where one is singular; -1 where all are done
    """
    options, n_v, rated = work.options, model.info.nv, linear.rated.size > 0
    am, af, beta, gamma = options.alpha_m, options.alpha_f, options.beta, options.gamma
    k, half = (1.0 - am) / (1.0 - af), 1.0 / (2.0 * beta) - 1.0
    right, parts, values = linear.right, linear.parts, derivatives.shape[0]
    windows.counts[FIRST], linear.pace[RATE_AGE] = last + 1, REMEASURE
    for n in range(last, first - 1, -1):
        h, part, dq = recorded.numbers[n, LENGTH], recorded.numbers[n, PART], recorded.dq[n]
        c_mass, c_rate = alpha.rates(h, options)
        c_step = 1.0 / (beta * h * h)
        if n < windows.counts[FIRST]:
            _evaluate_window(first, n, model, models, work, recorded, room, linear, windows)
        row = interpolate_step(n, rated, windows)
        if not prepare(dq, c_mass, row, linear, windows, matrix):
            return n + 1
        corrections = 0
        for q in range(values):
            x, y = derivatives[q, :n_v], derivatives[q, n_v : 2 * n_v]
            z, w = derivatives[q, 2 * n_v : 3 * n_v], derivatives[q, 3 * n_v : 4 * n_v]
            turn_transposed(dq, False, model, x, parts[TURNED])
            for i in range(right.size):
                right[i] = parts[TURNED, i] + c_rate * y[i] + c_step * z[i] + c_mass * w[i] if i < n_v else 0.0
            count = solve_transposed(dq, c_mass, q, row, linear, windows, matrix, model)
            if count == 0:  # the factors are those of too different a step
                if not factor_again(dq, c_mass, row, linear, windows, matrix):
                    return n + 1
                count = MOST + solve_transposed(dq, c_mass, q, row, linear, windows, matrix, model)
            corrections += count
            for i in range(n_v):
                x[i] -= parts[BY_STATE, i]
                y[i] -= parts[BY_RATE, i] / c_rate
                w[i] -= parts[BY_MASS, i]
            turn_transposed(dq, True, model, x, parts[TURNED])
            for i in range(n_v):
                x[i] = parts[TURNED, i]
                yi, zi, wi = y[i], z[i], w[i]
                y[i] = (1.0 - gamma / beta) * yi - (zi + k * wi) / (beta * h)
                a = h * (1.0 - gamma - gamma * half) * yi - half * zi + (am / (1.0 - af) - k * half) * wi
                z[i] = part * a
                w[i] = (1.0 - part) * a - af / (1.0 - af) * wi
        keep_solutions(linear)
        add_weighted_solutions(linear.W, windows)
        if n == windows.counts[FIRST]:
            end_window(derivatives, found, windows)
        note_corrections(corrections, values, linear)
    return -1


@indirect(void(VECTOR, VECTOR, MODEL, VECTOR))
def change_of(difference, y, model, out):
    """Changes of the coordinates and rates, (2 nv,), from a difference of two states near y."""
    blocks, n_q, n_v = model.blocks, model.info.nq, model.info.nv
    for i in range(n_v):
        out[i], out[n_v + i] = 0.0, difference[n_q + i]
    for k in range(blocks.size):
        q, at = blocks[k].iq, blocks[k].iv - n_q
        if blocks[k].kind == ROTATION:  # twice the vector of the conjugate of y times the difference
            a, b, c, d = y[q], y[q + 1], y[q + 2], y[q + 3]
            p, r, s, u = difference[q], difference[q + 1], difference[q + 2], difference[q + 3]
            out[at] = 2.0 * (a * r - b * p - c * u + d * s)
            out[at + 1] = 2.0 * (a * s - c * p - d * r + b * u)
            out[at + 2] = 2.0 * (a * u - d * p - b * s + c * r)
        elif blocks[k].kind != RATE:
            for i in range(blocks[k].count):
                out[at + i] = difference[q + i]


@inlined
def _along(difference, y, seed, model, change):
    """Product of a difference of two states near y, with the derivatives by changes of its coordinates and rates."""
    change_of(difference, y, model, change)
    found = 0.0
    for i in range(change.size):
        found += seed[i] * change[i]
    return found


@indirect(void(REAL, REAL, VECTOR, VECTOR, VECTOR, MODEL, MATRIX, VECTOR, VECTOR, VECTOR, VECTOR))
def pull_back_sample(theta, h, y0, y1, seed, model, states, move, change, start, end):
    """Add to derivatives by the ends of a step those of a value by a sample between them.

    Parameters
    ----------
    theta : float, part of the step of length h
    seed : (2 nv,) float, derivatives by coordinates and rates at the sample
    states : (4, ny) float, scratch; move : (nv,) float, scratch; change : (2 nv,) float, scratch
    start, end : (m,) float, as of `pull_back`, the time last
    """
    n_q, n_v = model.info.nq, model.info.nv
    at, up, down, moved = states[0], states[1], states[2], states[3]
    interpolate(theta, h, y0, y1, model, at)
    for i in range(n_v):
        move[i] = 0.0
    for side in range(2):
        own, to = (y0, start) if side == 0 else (y1, end)
        for j in range(2 * n_v):
            for sign in (1.0, -1.0):
                out = up if sign > 0.0 else down
                for i in range(own.size):
                    moved[i] = own[i]
                if j < n_v:
                    move[j] = sign * CHANGE
                    displace(own, move, False, model, moved)
                    move[j] = 0.0
                else:
                    moved[n_q + j - n_v] += sign * CHANGE / h
                if side == 0:
                    interpolate(theta, h, moved, y1, model, out)
                else:
                    interpolate(theta, h, y0, moved, model, out)
            for i in range(at.size):
                up[i] -= down[i]
            to[j] += _along(up, at, seed, model, change) / (2.0 * CHANGE if j < n_v else 2.0 * CHANGE / h)
    if theta < 1.0:  # at a given time
        d = min(1e-4, 0.5 * theta, 0.5 * (1.0 - theta))
        interpolate(theta + d, h, y0, y1, model, up)
        interpolate(theta - d, h, y0, y1, model, down)
        for i in range(at.size):
            up[i] -= down[i]
        start[start.size - 1] -= _along(up, at, seed, model, change) / (2.0 * d * h)
