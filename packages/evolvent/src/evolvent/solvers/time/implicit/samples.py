"""What a run by implicit steps keeps at its samples, between the ends of its steps."""

from __future__ import annotations

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.equations.kept_fields import count_kept, restore_cleared, write_forces
from evolvent.kernels import rigid, rod_payout
from evolvent.kernels.rotations import turn
from evolvent.kernels.springs import marker_kinematics
from evolvent.kernels.thread import MOVING, is_end, paid_out, spool, take_up
from evolvent.model import MODEL
from evolvent.model.family import NEARER, SUMMED
from evolvent.solvers.time.dense import interpolate, momenta_between
from evolvent.solvers.time.implicit.workspace import WORKSPACE

_I = types.int64


@inlined
def _between(theta, a, b):
    """Value at the part `theta` of the straight line from a to b."""
    return a + theta * (b - a) if theta < 1.0 else b


@inlined
def fill_forces(model, work):
    """Forces of the last residual into the workspace, as those of the step's end."""
    write_forces(model, work.forces[1])


@indirect(void(MODEL, WORKSPACE))
def begin_next(model, work):
    """Make forces of the last residual, and the balance of now, those of the start of the next step."""
    fill_forces(model, work)
    start_next(work)


@inlined
def start_next(work):
    """Make forces and balance of a step's end those of the start of the next one."""
    for i in range(work.row.size):
        work.row0[i] = work.row[i]
    _copy_forces(work.forces.shape[1], work)


@inlined
def _copy_forces(count, work):
    """Make the first `count` forces of the step's end those of its start."""
    for i in range(count):
        work.forces[0, i] = work.forces[1, i]


@inlined
def restore_wrenches(model, work):
    """What acts on the bodies at the step's end, which `kinematics` clears."""
    restore_cleared(model, work.forces[1])


@indirect(void(_I, REAL, MODEL, WORKSPACE))
def keep_forces(n, theta, model, work):
    """Keep accelerations, multipliers and forces at the part `theta` of the step as those of sample n."""
    forces, summed, nearer = work.forces, count_kept(SUMMED, model), count_kept(NEARER, model)
    for i in range(work.dq.size):
        work.out_a[n, i] = _between(theta, work.dv0[i], work.dv1[i])
    for i in range(work.la.size):
        work.out_la[n, i] = _between(theta, work.la0[i], work.la[i])
    for i in range(forces.shape[1]):
        work.out_forces[n, i] = _between(theta, forces[0, i], forces[1, i])
    for i in range(forces.shape[1] - summed - nearer, forces.shape[1] - summed):
        work.out_forces[n, i] = forces[1 if theta > 0.5 else 0, i]
    if work.out_points.shape[0] > 0:
        for i in range(work.out_points.shape[1]):
            work.out_points[n, i] = model.contact_points[i].force


@indirect(void(_I, REAL, REAL, REAL, MODEL, WORKSPACE))
def keep_sample(n, theta, t, h, model, work):
    """Keep what is at the part `theta` of the step of length h from t on as sample n.

    States are interpolated (`dense.interpolate`); accelerations, multipliers, forces, momenta and balance lie on
    straight lines.
    """
    switches = model.switches
    for k in range(model.rods.size):
        if model.rods[k].payout != 0:
            rod_payout.note_lengths(theta, t, h, model)
            break
    interpolate(theta, h, work.y0, work.y, model, work.out_y[n])
    if model.threads.size > 0 and theta < 1.0:
        keep_lengths_at_spools(theta, t, h, work.out_y[n], model, work)
    for i in range(switches.size):
        work.out_s[n, i] = switches[i]
    keep_forces(n, theta, model, work)
    for i in range(work.row.size):
        work.out_balance[n, i] = _between(theta, work.row0[i], work.row[i])
    if work.out_momenta.shape[0] > 0:
        momenta_between(theta, t, h, work.y0, work.y, model, work.momenta, work.out_momenta[n])
        restore_wrenches(model, work)
    if work.ends.shape[0] > 0:
        work.end_times[n, 0], work.end_times[n, 1] = t, t + h
        for i in range(work.y.size):
            work.ends[n, 0, i], work.ends[n, 1, i] = work.y0[i], work.y[i]


@inlined
def _from_spool(t, y, k, q, model):
    """Vector to the node at q from where thread k leaves its spool, and the rest length of that segment."""
    rigid.kinematics(t, y, model)
    b, d = model.threads[k].body, model.threads[k].departure
    R, x = model.bodies[b].R, model.bodies[b].x
    dx, dy, dz = turn(R, d[0], d[1], d[2])
    phi, _, _ = spool(t, y, model.threads, model.parameters, k)
    rest = paid_out(model.threads, k, phi) - (model.switches[k] - 1) * model.threads[k].segment
    return y[q] - x[0] - dx, y[q + 1] - x[1] - dy, y[q + 2] - x[2] - dz, max(rest, 0.0)


@inlined
def keep_strains(theta, t, h, k, y, model, work):
    """Move the nodes of thread k, on a mesh that moves, to where its elements' strains lie on straight lines.

    Where the outer end is fixed, what is left over there is spread over the length.
    """
    q, last, held = model.threads[k].iq, model.threads[k].n - 1, is_end(model.threads, k, 0)
    first, rest0 = _exit(t, work.y0, k, model)
    outer0 = _outer_end(work.y0, k, model)
    end, rest1 = _exit(t + h, work.y, k, model)
    outer1 = _outer_end(work.y, k, model)
    place, rest = _exit(t + theta * h, y, k, model)
    outer = _outer_end(y, k, model)
    moved = old = place
    for i in range(last, -1, -1):
        at = q + 3 * i
        next0, next1, here = _at(work.y0, at), _at(work.y, at), _at(y, at)
        if held and i == 0:
            next0, next1, here = outer0, outer1, outer
        a = _distance(next0, first) / rest0
        b = _distance(next1, end) / rest1
        first, end = next0, next1
        size = _distance(here, old)
        scale = (a + theta * (b - a)) * rest / size if size > 0.0 else 1.0
        moved = (
            moved[0] + scale * (here[0] - old[0]), moved[1] + scale * (here[1] - old[1]),
            moved[2] + scale * (here[2] - old[2]),
        )  # fmt: skip
        old = here
        if not (held and i == 0):
            y[at], y[at + 1], y[at + 2] = moved
    for i in range(1, last + 1 if held else 0):
        part = (last + 1 - i) / (last + 1)
        for c in range(3):
            y[q + 3 * i + c] += part * (outer[c] - moved[c])


@inlined
def _at(y, q):
    """A place in a state: three floats."""
    return y[q], y[q + 1], y[q + 2]


@inlined
def _distance(y, x):
    """Distance of two places, m."""
    a, b, c = y[0] - x[0], y[1] - x[1], y[2] - x[2]
    return math.sqrt(a * a + b * b + c * c)


@inlined
def _exit(t, y, k, model):
    """Place (three floats) where thread k leaves its spool, and the rest length of an element of its moving mesh."""
    rigid.kinematics(t, y, model)
    b, d = model.threads[k].body, model.threads[k].departure
    R, x = model.bodies[b].R, model.bodies[b].x
    dx, dy, dz = turn(R, d[0], d[1], d[2])
    phi, _, _ = spool(t, y, model.threads, model.parameters, k)
    take_up(t, model.threads, model.parameters, k)
    out = paid_out(model.threads, k, phi) - model.threads[k].taken[0]
    return (x[0] + dx, x[1] + dy, x[2] + dz), out / model.threads[k].n


@inlined
def _outer_end(y, k, model):
    """Place of the fixed end of thread k, after `kinematics`; of another thread none is needed."""
    if model.threads[k].end < 0:
        return 0.0, 0.0, 0.0
    place = marker_kinematics(y, model.markers, model.points, model.bodies, model.threads[k].end)
    return place[0], place[1], place[2]


@indirect(void(REAL, REAL, REAL, VECTOR, MODEL, WORKSPACE), used_for="threads")
def keep_lengths_at_spools(theta, t, h, y, model, work):
    """Move threads to where the elongations of their segments at the spools lie on straight lines (see `dense`).

    A segment that is slack at an end of the step stays where it is.
    """
    for k in range(model.threads.size):
        count = model.switches[k]
        held = is_end(model.threads, k, 0)  # what the end is fixed to stays where it is
        if model.threads[k].kind == MOVING:
            if model.threads[k].slack == 0:
                keep_strains(theta, t, h, k, y, model, work)
            continue
        if count <= (1 if held else 0) or model.switches[model.threads.size + k] != 0:  # wound, or gone
            continue
        q = model.threads[k].iq
        at = q + 3 * (count - 1)
        a, b, c, rest = _from_spool(t, work.y0, k, at, model)
        first = math.sqrt(a * a + b * b + c * c) - rest
        a, b, c, rest = _from_spool(t + h, work.y, k, at, model)
        last = math.sqrt(a * a + b * b + c * c) - rest
        if model.threads[k].slack != 0 and min(first, last) <= 0.0:
            continue
        a, b, c, rest = _from_spool(t + theta * h, y, k, at, model)
        size = math.sqrt(a * a + b * b + c * c)
        more = (rest + first + theta * (last - first)) / size - 1.0 if size > 0.0 else 0.0
        for i in range(1 if held else 0, count):
            part = more * i / (count - 1) if held else more
            y[q + 3 * i] += part * a
            y[q + 3 * i + 1] += part * b
            y[q + 3 * i + 2] += part * c
    rigid.kinematics(t + h, work.y, model)
    restore_wrenches(model, work)


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def keep_samples(t, h, model, work):
    """Keep the samples in a step of length h that starts at t, and has just been accepted.

    The forces of energy-momentum are those of the whole step, and of its start: those of the first step stand there.
    """
    loop, near = work.loop, 10.0 * work.options.smallest
    if work.options.midpoint != 0:
        _copy_forces(work.forces.shape[1] - count_kept(SUMMED, model), work)
        if loop.steps == 1:
            keep_forces(0, 0.0, model, work)
    while loop.sample < work.samples.size and work.samples[loop.sample] <= t + h + near:
        theta = (work.samples[loop.sample] - t) / h
        keep_sample(loop.sample, 1.0 if theta > 1.0 - 1e-9 else max(theta, 0.0), t, h, model, work)
        loop.sample += 1
