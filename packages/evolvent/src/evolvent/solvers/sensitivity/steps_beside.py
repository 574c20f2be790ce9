"""Steps beside those of a run: neighbours that differ in a parameter by little, with the same factors.

The difference of two neighbours at p + d and p - d over 2 d is the derivative of the discrete solution by p, with an
error of d^2: of all that a run keeps, through latches and starts as well.

Notes
-----
A step is R(x1, x0, t, h, p) = 0. Linearised about the run, R_x1 dx1 = -(R_x0 dx0 + R_t dt + R_h dh + R_p dp). The
neighbours evaluate R as the run does, which makes the right side, and correct their increments with the factors of
R_x1 at the solution of the step: x1 <- x1 - R_x1^-1 R. They start from their own prediction and what the run's differs
from it, so that one correction leaves an error of d^2 where the tangent is exact; what it leaves out
(`evolvent.equations.energy_momentum.tangent`) takes a few more.

Steps have the lengths that they have in the run, but where something fixes their end: a time, for the last step and
those that land on a change of loads; the angle of a latch or a user's event, g(x1, p) = 0, from which the neighbour's
own length follows. So dt_e = -(g_p dp + g_x dx)/(dg/dt), and the steps behind it are shifted by dt_e. What a latch, a
release and a start of generalized-alpha change is evaluated by the same functions as in the run.
"""

from __future__ import annotations

import math

from numba import types

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import INTEGERS, MATRIX, VECTOR, indirect, inlined
from evolvent.compiled.pointer import at_address
from evolvent.equations import between_steps
from evolvent.kernels import watches
from evolvent.model import MODEL
from evolvent.solvers.common.balance import energy_of
from evolvent.solvers.time.implicit import events as implicit_events, loop as implicit_loop, methods as method
from evolvent.solvers.time.implicit.balance import has_gained, note_drives
from evolvent.solvers.time.implicit.newton import correction, count_touching
from evolvent.solvers.time.implicit.samples import keep_sample, keep_samples, start_next
from evolvent.solvers.time.implicit.workspace import BUDGET, NO_CONVERGENCE, NOT_FINITE, REDUNDANT, SINGULAR, WORKSPACE

_I, _B = types.int64, types.boolean
#: Corrections of a step at most; the last is one that leaves `LIMIT` beside the size of the unknowns, by the largest
#: ratio of a correction to the one before that was found, or one below `ROUND_OFF` that is not reduced any more. A
#: ratio counts above `FLOOR`.
MOST, LIMIT, ROUND_OFF, FLOOR = 20, 1e-17, 1e-9, 1e-15
#: Steps after which these are taken until they are not reduced any more.
MEASURED = 10
#: Numbers that a neighbour carries: that ratio, steps since it was measured, steps in which other contacts touch, or
#: joints slip, than in the run, and a status.
RATIO, SINCE, UNLIKE, STATUS, N_PACE = 0, 1, 2, 3, 4
#: Of the factored matrix: length of its step (s), scale of its constraints; and the number of the one that has failed.
LENGTH, SCALE, FAILED, N_FACTORED = 0, 1, 2, 3
#: Part of the length of a step by which that of the matrix differs at most.
NEAR = 1e-3
#: Part of a step of the run that the neighbour's has at least.
LEAST_PART = 0.05
#: Steps: as long as the loop would take them, as long as in the run, to an event, to a stop, to the end.
OWN, FROZEN, EVENT, STOP, END = 0, 1, 2, 3, 4
#: In place of a coordinate whose latch locks; the first event that fires, before which the others stand.
NONE, TRIED, FIRST_EVENT = -1, -2, -3
#: Part of the mean step that a step to the release of a joint has at least: the positions' round-off over its length is
#: in the rates with which the parts go on.
LEAST_TO_RELEASE = 1e-3
#: Status of a neighbour whose step is too short, and of one of which an event is not at the end of a step, as in the
#: run; of all where several latches and events are at the end of a step, or one at its given end, where a neighbour
#: does not take a step, and where the step to a release is too short.
TOO_SHORT, TOGETHER, LEFT, ELSEWHERE, HASTY = -10, -11, -12, -13, -14
_model_at, _work_at = at_address(MODEL), at_address(WORKSPACE)


@inlined
def solve_beside(t_end, h, leads, leader, model, matrix, work, pace, factored):
    """Solve a step of length h to t_end; returns the number of corrections, or a status below zero.

    Parameters
    ----------
    leads : bool, whether the step starts from the solution of `leader`; else from its correction of the prediction
    pace : (N_PACE,) float; factored : (N_FACTORED,) float, of the matrix, which is that of another step where this has
        the same length
    """
    loop, n_v, dq = work.loop, model.info.nv, work.dq
    for i in range(work.y.size):
        work.y0[i] = work.y[i]
    method.start_step(loop.time, h, model, work)
    note_drives(loop.time, h, model, work)
    own = leads or abs(h - factored[LENGTH]) > NEAR * h
    if own:
        factored[LENGTH], factored[SCALE] = h, method.scale_of(h, work.options)
    scale = factored[SCALE]
    model.info.compliance = 1.0 / scale
    method.predict(h, False, model, work)
    for i in range(n_v):
        if leads:
            work.dq0[i] = dq[i]
            work.x[i] = leader.dq[i] - dq[i]
        else:
            work.x[i] = leader.dq0[i]
    for k in range(work.la.size):
        work.la[k] = leader.la[k] if leads else work.la0[k] + leader.la1[k]
    method.correct(t_end, h, False, model, work)
    if own:
        found = method.factor_tangent(t_end, h, scale, model, matrix, work)
        if found != 0:
            return SINGULAR if found < 0 else REDUNDANT
    solved = _corrected(t_end, h, scale, model, matrix, work, pace)
    loop.contact_set = count_touching(model)
    if leads:
        for i in range(n_v):
            work.dq0[i] = dq[i] - work.dq0[i]
        for k in range(work.la.size):
            work.la1[k] = work.la[k] - work.la0[k]
    elif loop.contact_set != leader.loop.contact_set:
        pace[UNLIKE] += 1.0
    return solved


@inlined
def _corrected(t_end, h, scale, model, matrix, work, pace):
    """Correct the increments until one is the last; returns how many, or a status below zero."""
    last, worst, twice = math.inf, 0.0, method.tangent_factor(work.options)
    for iteration in range(MOST):
        norm = correction(scale, model, matrix, work)
        if not math.isfinite(norm):
            return NOT_FINITE
        for k in range(work.la.size):
            work.la[k] += scale / twice * work.x[model.info.nv + k]
        method.correct(t_end, h, False, model, work)
        ratio = norm / last if last > 0.0 else 0.0
        if iteration > 0 and norm > FLOOR:
            worst = max(worst, ratio)
        if norm <= LIMIT or (ratio > 0.5 and norm <= ROUND_OFF):
            if worst > 0.0:
                pace[RATIO], pace[SINCE] = worst, 0.0
            return iteration + 1
        if pace[SINCE] < MEASURED and norm * max(pace[RATIO], worst) <= LIMIT:
            pace[SINCE] += 1.0
            return iteration + 1
        last = norm
    return NO_CONVERGENCE


@inlined
def _end_of(kind, tried, work):
    """Time reached by a step, of its last equations, and its length, where that of the run was `tried`."""
    loop, t, smallest = work.loop, work.loop.time, work.options.smallest
    h = tried
    if kind == OWN:
        h = loop.step
    elif kind == EVENT:
        h = loop.event_step
    if kind < STOP:
        return t + (h + loop.behind), t + h, h
    t1 = work.stops[loop.stop] if kind == STOP else work.samples[work.samples.size - 1]
    h = t1 - t
    before = max(1e-9 * h, 20.0 * smallest) if kind == STOP else 0.0
    if work.options.midpoint == 0:
        return t1, t1 - before, h
    h -= min(0.5 * h, before)
    return t1, t + h, h


@indirect(_I(_I, _I, _B, MODEL, WORKSPACE, WORKSPACE, MODEL, SPARSE, WORKSPACE, VECTOR, VECTOR))
def step_beside(kind, latch, leads, run_model, run, leader, model, matrix, work, pace, factored):
    """Take the step that the run has taken last; returns the number of corrections, or a status below zero.

    Parameters
    ----------
    kind : int, what the step ends on
    latch : int, joint coordinate whose latch locks at its end, `FIRST_EVENT` - k of event k that fires there, `NONE`,
        or `TRIED` of a step that the run has taken back to end it on a latch or event
    leads, pace, factored : as of `solve_beside`
    run_model, run : Model and Workspace of the run; leader : that of the middle, of the middle that of the run
    """
    loop, t, midpoint, s = work.loop, work.loop.time, work.options.midpoint != 0, model.switches
    t1, t_end, h = _end_of(kind, run.loop.tried, work)
    if not h > LEAST_PART * run.loop.tried:
        return TOO_SHORT
    found = solve_beside(t_end, h, leads, leader, model, matrix, work, pace, factored)
    if found <= 0:
        return found
    watches.note_values(t_end, work.y, model)
    if model.watches.size > 0:
        implicit_events.note_middle(t_end, h, model, work)
    fired = FIRST_EVENT - latch if latch <= FIRST_EVENT else NONE
    if latch == TRIED:
        part = implicit_loop.until_coordinate(h, model, work)
        if model.watches.size > 0:
            due = watches.until_event_beside(run.loop.event_step / run.loop.tried, run_model.watches, model)
            part = due if part == 1.0 else min(part, due)
        implicit_loop.restore_start(model, work)
        loop.event_step = h * part if part != 1.0 else run.loop.event_step
        return found
    if fired >= 0 and kind != EVENT and watches.differs(fired, run_model.watches, model):
        return ELSEWHERE
    if work.options.tolerance > 0.0:
        loop.step = run.loop.step
    elif work.options.divides != 0 and kind < STOP:
        loop.step = min(2.0 * h, loop.wanted)
    implicit_loop.accept_step(t1, t_end, h, model, work)
    loop.behind = run.loop.behind
    has_gained(False, model, work)
    keep_samples(t, h if midpoint else t1 - t, model, work)
    if fired >= 0 and model.watches[fired].stops != 0 and loop.sample < run.loop.sample:
        keep_sample(loop.sample, 1.0, t, h if midpoint else t1 - t, model, work)
        work.samples[loop.sample] = t1
        loop.sample += 1
    start_next(work)
    if latch >= 0:
        if midpoint:
            between_steps.note_state(t1, work.y, s, model)
        implicit_loop.lock(t1, latch, model, work)
    between_steps.take_step(s, model)
    released = watches.fire_beside(t1, fired, run_model.watches, model, work)
    if kind == STOP:
        loop.stop += 1
    if (latch >= 0 or released or kind == STOP) and method.restart(model, work):
        implicit_loop.book_release(energy_of(work.balance), loop.time + 20.0 * work.options.smallest, model, work)
    return found


@indirect(_I(_I, _I, MODEL, WORKSPACE, MODEL, SPARSE, WORKSPACE, INTEGERS, INTEGERS, MATRIX, VECTOR))
def steps_beside(kind, latch, run_model, run, model, matrix, work, models, works, pace, factored):
    """Have the middle, `model` and `work`, and the neighbours take a step: see `step_beside`.

    Parameters
    ----------
    models, works : (n,) int, addresses of those of the neighbours
    pace : (1 + n, N_PACE) float

    Returns
    -------
    int, number of the one that does not, the middle being 0, with its status in `pace`; -1 where all do
    """
    found = step_beside(kind, latch, True, run_model, run, run, model, matrix, work, pace[0], factored)
    if found <= 0:
        pace[0, STATUS] = found
        return 0
    for k in range(len(models)):
        own, at = _model_at(models[k]), _work_at(works[k])
        found = step_beside(kind, latch, False, run_model, run, work, own, matrix, at, pace[1 + k], factored)
        if found <= 0:
            pace[1 + k, STATUS] = found
            return 1 + k
    return -1


@indirect(types.UniTuple(_I, 3)(MODEL, SPARSE, WORKSPACE))
def take_step(model, matrix, run):
    """Take or try a step of a run.

    Returns
    -------
    status : of `loop.advance`, `TOGETHER`, or `HASTY`
    kind, latch : as of `step_beside`
    """
    loop, near, end = run.loop, 10.0 * run.options.smallest, run.samples[run.samples.size - 1]
    share = 2e-9 if run.options.midpoint != 0 else 1e-12
    steps, latches, event, step = loop.steps, loop.latches, loop.event_step, loop.step
    stops = loop.stop < run.stops.size and run.stops[loop.stop] < end - near
    left = ((run.stops[loop.stop] if stops else end) - loop.time) * (1.0 - share) - 4.0 * near
    code = implicit_loop.advance(model, matrix, run, 1)
    kind = OWN if loop.tried == step else FROZEN
    if loop.tried == event:
        kind = EVENT
    elif loop.tried >= left:
        kind = STOP if stops else END
    latch = TRIED
    if loop.steps > steps:
        latch = run.log_k[latches] if loop.latches > latches else NONE
        if loop.latches > latches + 1 or (loop.latches > latches and kind >= STOP):
            return TOGETHER, kind, latch
        if loop.latches > latches and latch < 0:
            latch += 1 + FIRST_EVENT
        short = loop.tried * loop.steps < LEAST_TO_RELEASE * (loop.time - run.samples[0])
        if (latch != NONE or kind == STOP) and short and watches.has_released(loop.time, loop.tried, model):
            return HASTY, kind, latch
    return code, kind, latch


@indirect(_I(_I, MODEL, SPARSE, WORKSPACE, MODEL, SPARSE, WORKSPACE, INTEGERS, INTEGERS, MATRIX, VECTOR))
def advance_beside(budget, run_model, run_matrix, run, model, matrix, work, models, works, pace, factored):
    """Go on for `budget` steps, tried ones among them, of the run, its middle and its neighbours.

    Returns a status: one of `loop.advance`, `TOGETHER`, `HASTY`, or `LEFT` where a neighbour does not
    take a step.
    """
    loop = run.loop
    for _ in range(budget):
        step = loop.step
        code, kind, latch = take_step(run_model, run_matrix, run)
        if code == TOGETHER or code == HASTY:  # noqa: SIM109  (compiled)
            return code
        if latch != TRIED or math.isfinite(loop.event_step):
            factored[FAILED] = steps_beside(
                kind, latch, run_model, run, model, matrix, work, models, works, pace, factored
            )
            if factored[FAILED] >= 0.0:
                return LEFT
        elif loop.step != step:  # that is divided
            work.loop.step *= loop.step / step
            for k in range(len(works)):
                at = _work_at(works[k])
                at.loop.step *= loop.step / step
        if code != BUDGET:
            return code
    return BUDGET
