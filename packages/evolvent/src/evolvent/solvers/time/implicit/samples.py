"""What a run by implicit steps keeps at its samples, between the ends of its steps."""

from __future__ import annotations

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.equations.between_steps import note_extremes
from evolvent.equations.kept_fields import count_kept, restore_cleared, write_forces
from evolvent.kernels import rigid
from evolvent.kernels.calls import between_at, note_part_at
from evolvent.model import MODEL
from evolvent.model.questions import NEARER, SUMMED
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
    note_extremes(model.switches, model)
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
    calls = model.samples_note_part_calls
    for k in range(calls.size):
        note_part_at(model, calls[k])(theta, t, h, model)
    interpolate(theta, h, work.y0, work.y, model, work.out_y[n])
    calls = model.samples_between_calls
    if calls.size > 0 and theta < 1.0:
        for k in range(calls.size):
            between_at(model, calls[k])(theta, t, h, work.y0, work.y, model, work.out_y[n])
        rigid.kinematics(t + h, work.y, model)
        restore_wrenches(model, work)
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
