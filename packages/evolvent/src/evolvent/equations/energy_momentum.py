"""One step that conserves energy and momentum, or dissipates what it does not resolve: its equations and their tangent.

With increments dq of the coordinates over a step of length h, velocities v, means m of both ends, changes d, and
chi <= rho (1 - rho)/(1 + rho)^2 of the spectral radius rho at infinite frequency (from 1/3 to 1)::

    v1 = v0 + 2/(1 + chi) (dq/h - v0 + chi/2 r dv_p)
    0  = M (v1 - v0)/h + J(qm)^T s - Q(qm) + G(qm)^T la,        g(q1) = 0
    s  = H (gm + chi/2 (dg - r dg_p)) - h_e                      strains g(q), energy g.H g/2 - h_e.g

dv_p and dg_p belong to the step before, as h_p and chi_p; r = min(h/h_p, sqrt(chi_p/chi)). Then::

    E + chi/4 (|dv|^2_M + |dg|^2_H)   falls by at least   chi/4 (|dv - r dv_p|^2_M + |dg - r dg_p|^2_H)

beside the work of loads and drives less what dampers take, for chi r^2 <= chi_p: no step gains energy, whatever its
length. Second differences at different steps have r = h/h_p. So chi falls where a step is longer than the one before,
and rises again as the tolerance permits (`evolvent.solvers.time.implicit.energy_step.filter_of`). The linear
momentum is kept; the angular one only without the filter of velocities (chi = 0 in the first line), which is left out
where nothing holds the system from outside.

Every force acts along the mean shape: J(qm) dq = dg of strains that are quadratic in q; likewise of positions and
directions fixed to bodies, if a body turns by the rotation vector 2 tan(angle/2) e, for then dR = [theta]x (R0 + R1)/2.
So `bodies` hold the mean of both rotation matrices while forces are evaluated, and velocities that are increments over
h. Springs and distances have the factor 2 abs(dm)/(l0 + l1) more, contacts and cords on drums the directions of
`kernels.surfaces` and `families.joints.cord`, threads the lengths paid out at both ends, rods secants
of functions of an angle (`families.rods.rod`). A force by a user's law is the mean of the law along the increment
(`kernels.law_means`): its work is the line integral of the law, which of a law of position alone is the change of its
potential.

Rows of free bodies' rotations are (R0^T R1 p1 - p0)/h - R0^T torque, p = J w with the momenta of their wheels
(`families.attitude.attitude`): times the rotation vector this is the change of the kinetic energy, and the angular
momentum is kept.
"""

from __future__ import annotations

import math

from numba import types, void

from evolvent.algebra import sparse
from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels import body_step, constraints, points, rigid
from evolvent.kernels.blocks import displace
from evolvent.kernels.calls import force_at, measure_at, tangent_at
from evolvent.kernels.rotations import turn
from evolvent.model import MODEL
from evolvent.model.interval import INTERVAL
from evolvent.model.powers import N_POWERS

_I = types.int64


@indirect(void(_I, MODEL, INTERVAL))
def measure(end, model, work):
    """Positions of bodies, gaps of joints and contacts, and lengths of springs, at the end (1) or the start (0)."""
    t = work.step.t + (work.step.h if end == 1 else 0.0)
    y = work.y1 if end == 1 else work.y0
    R, x = (work.R1, work.x1) if end == 1 else (work.R0, work.x0)
    bodies = model.bodies
    rigid.kinematics(t, y, model)
    for b in range(bodies.size):
        for i in range(3):
            x[b, i] = bodies[b].x[i]
            for j in range(3):
                R[b, i, j] = bodies[b].R[i, j]
    calls = model.step_measure_calls
    for k in range(calls.size):
        measure_at(model, calls[k])(end, t, y, model)


@indirect(void(MODEL, INTERVAL))
def move(model, work):
    """State y1 that the increments lead to, and the mean state; then `measure` the end and put bodies at the mean."""
    n_q, n_v, h = model.info.nq, model.info.nv, work.step.h
    y0, y1, ym, dq = work.y0, work.y1, work.ym, work.dq
    bodies = model.bodies
    c, filtered = 2.0 / (1.0 + work.step.chi_v), 0.5 * work.step.chi_v * work.step.ratio
    for i in range(n_v):
        rate = dq[i] / h
        ym[n_q + i] = rate
        work.dv[i] = c * (rate - y0[n_q + i] + filtered * work.before[i])
        y1[n_q + i] = y0[n_q + i] + work.dv[i]
    displace(y0, dq, True, model, y1)
    for i in range(n_q):
        ym[i] = 0.5 * (y0[i] + y1[i])
    measure(1, model, work)
    body_step.move_centres(c, filtered, model, work)
    for b in range(bodies.size):
        at = bodies[b].iv - n_q
        for i in range(3):
            bodies[b].x[i] = 0.5 * (work.x0[b, i] + work.x1[b, i])
            bodies[b].v[i] = (work.x1[b, i] - work.x0[b, i]) / h
            for j in range(3):
                bodies[b].R[i, j] = 0.5 * (work.R0[b, i, j] + work.R1[b, i, j])
        n = bodies[b].axis
        if bodies[b].motion == rigid.FREE:
            theta = (dq[at + 3], dq[at + 4], dq[at + 5])
        else:
            p = dq[at] if bodies[b].motion == rigid.SPIN else 2.0 * math.tan(0.5 * bodies[b].rate * h)
            theta = (p * n[0], p * n[1], p * n[2])
        w = turn(work.R0[b], theta[0], theta[1], theta[2])
        for i in range(3):
            bodies[b].w[i] = w[i] / h


@indirect(void(MODEL, INTERVAL))
def residual(model, work):
    """Residual r of the increments dq and multipliers la; powers are means over the step.

    Constraints stand last; that of a penalty is (gap0 + gap1)/2 + (damping rate - la)/stiffness.
    """
    n_v, step, powers, F, P, r = model.info.nv, work.step, work.powers, model.F, model.P, work.r
    move(model, work)
    step.tm, step.rub, step.factor, step.inertia = step.t + 0.5 * step.h, step.h, 1.0, 1.0 / step.h
    step.span = step.over = step.h
    model.info.over = step.h
    for i in range(n_v):
        F[i] = 0.0
        P[i] = model.G[i]
    for i in range(N_POWERS):
        powers[i] = 0.0
    work.contact[0] = work.contact[1] = 0.0
    for b in range(model.bodies.size):
        for i in range(6):
            model.bodies[b].F[i] = 0.0
    points.clear_forces(model.points)
    calls = model.step_force_calls
    for k in range(calls.size):
        force_at(model, calls[k])(work, model)
    calls = model.step_inertia_calls
    for k in range(calls.size):
        force_at(model, calls[k])(work, model)
    model.info.over = 0.0
    for i in range(n_v):
        r[i] = F[i] - P[i]


@indirect(void(REAL, MODEL, INTERVAL, SPARSE))
def tangent(scale, model, work, matrix):
    """Twice the derivative of `residual` by dq and la/2, constraints times `scale`; after `residual` only.

    Left out is what only slows Newton's method: what `evolvent.equations.implicit.tangent` leaves out; and that a
    vector fixed to a body, of which the mean of both ends acts, turns by (1 - [theta/2]x)^-1 times what the tangent
    has, theta the rotation vector of the step. So of a body that turns all columns are inexact: those by its turns, by
    its translation, and by the multipliers of joints on it. Rods have the factor. Others would need columns of their
    own beside those of the rows: measured on bodies with springs, joints by penalties and user's laws, it saves no
    iteration where a step turns them by less than 0.1 rad, and up to a third of them at 0.2 rad.

    Forces' tangents have torques on a free body in axes that turn with it; `body_step.add_body_tangents` takes them to
    the axes of the step's start.
    """
    add_force_tangents(scale, 1.0, 2.0 / work.step.h, model, work, matrix)
    add_inertia_tangents(model, work, matrix)


@inlined
def add_force_tangents(scale, massive, c_rate, model, work, matrix):
    """Begin `tangent`: forces, with the inertia of elements times `massive`."""
    step = work.step
    step.c_mass, step.c_rate = massive * 4.0 / ((1.0 + step.chi_v) * step.h * step.h), c_rate
    step.tm, step.scale = step.t + 0.5 * step.h, scale
    model.info.over = step.h
    sparse.clear(matrix)
    calls = model.step_tangent_calls
    for k in range(calls.size):
        tangent_at(model, calls[k])(work, model, matrix)
    model.info.over = 0.0


@inlined
def add_inertia_tangents(model, work, matrix):
    """End `tangent`: inertia, and constraints at the end."""
    model.info.over = work.step.h
    calls = model.step_inertia_tangent_calls
    for k in range(calls.size):
        tangent_at(model, calls[k])(work, model, matrix)
    model.info.over = 0.0
    if model.constraints.size > 0:
        add_end_rows(work.step.scale, work.step.c_rate, model, work, matrix)


@inlined
def add_end_rows(scale, c_rate, model, work, matrix):
    """Derivatives of the constraints at the end of the step. Bodies and gaps stay at the end."""
    bodies = model.bodies
    for b in range(bodies.size):
        for i in range(3):
            bodies[b].x[i] = work.x1[b, i]
            for j in range(3):
                bodies[b].R[i, j] = work.R1[b, i, j]
    constraints.add_end_rows(work.step.t + work.step.h, work.step.h, work.y1, work.dq, scale, c_rate, model, matrix)
