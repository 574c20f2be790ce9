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
and rises again as the tolerance permits (`evolvent.solvers.energy_step.filter_of`). The linear
momentum is kept; the angular one only without the filter of velocities (chi = 0 in the first line), which is left out
where nothing holds the system from outside.

Every force acts along the mean shape: J(qm) dq = dg of strains that are quadratic in q; likewise of positions and
directions fixed to bodies, if a body turns by the rotation vector 2 tan(angle/2) e, for then dR = [theta]x (R0 + R1)/2.
So `bodies` hold the mean of both rotation matrices while forces are evaluated, and velocities that are increments over
h. Springs and distances have the factor 2 abs(dm)/(l0 + l1) more, contacts and cords on drums the directions of
`kernels.surfaces` and `kernels.cord`, threads the lengths paid out at both ends, rods secants
of functions of an angle (`kernels.rod`). A force by a user's law is the mean of the law along the increment
(`kernels.law_means`): its work is the line integral of the law, which of a law of position alone is the change of its
potential.

Rows of free bodies' rotations are (R0^T R1 p1 - p0)/h - R0^T torque, p = J w with the momenta of their wheels
(`kernels.attitude`): times the rotation vector this is the change of the kinetic energy, and the angular momentum is
kept.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.compiled.pointer import Struct, array, record
from evolvent.flow import body_step
from evolvent.flow.powers import (
    DRIVEN,
    JOINTS,
    MARKER_LOADS,
    MASS_DAMPING,
    N_POWERS,
    SPOOLS,
    SPRINGS,
    STIFFNESS_DAMPING,
)
from evolvent.kernels import (
    ancf_beams,
    attitude,
    attitude_tangent,
    beam_loads,
    bearing,
    contact,
    coordinate,
    coordinate_laws,
    coordinate_tangent,
    custom,
    fields,
    joint,
    joint_tangent,
    loads,
    node_load_tangents,
    points,
    reduced,
    rigid,
    rod,
    rod_strains,
    rod_tangent,
    sparse,
    springs,
    tape,
    thermal,
    thread,
)
from evolvent.kernels.blocks import displace
from evolvent.kernels.rotations import turn
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL

_I = types.int64
#: Of a step: its start and length (s), chi of strains and of velocities, r, the share of the contacts' stiffness,
#: whether velocities are filtered (1 or 0); of the step before chi_p, and what it filters of accelerations: the largest
#: beside the size, and the root mean square by shares of inertia (1/s2)
STEP = np.dtype(
    [(name, np.float64) for name in ("t", "h", "chi", "chi_v", "ratio", "soft", "held", "chi_p", "largest", "rms")]
)


class EnergyStep(Struct):
    """A step from 0 to 1.

    Attributes
    ----------
    step : record (see `STEP`)
    y0, y1, ym : (ny,) float, states at both ends; mean coordinates with velocities dq/h
    dq : (nv,) float, increments; of rotations 2 tan(angle/2) about the axis, in body axes
    la : (nj,) float, multipliers; r : (nv + nj,) float, residual
    dv, before : (nv,) float, changes of the velocities over this step and the one before
    R0, R1 : (nb, 3, 3) float, and x0, x1 : (nb, 3) float, rotations and positions of bodies
    powers : (N_POWERS,) float, means over the step; contact : (2,) float, J, what normal forces and friction take
    """

    step: np.record = record(STEP)
    y0: np.ndarray = array(1)
    y1: np.ndarray = array(1)
    ym: np.ndarray = array(1)
    dq: np.ndarray = array(1)
    la: np.ndarray = array(1)
    r: np.ndarray = array(1)
    dv: np.ndarray = array(1)
    before: np.ndarray = array(1)
    R0: np.ndarray = array(3)
    R1: np.ndarray = array(3)
    x0: np.ndarray = array(2)
    x1: np.ndarray = array(2)
    powers: np.ndarray = array(1)
    contact: np.ndarray = array(1)


ENERGY_STEP = EnergyStep._numba_type_


@inlined
def interval_of(step):
    """A step as `ancf.INTERVAL`."""
    return step.h, step.chi, step.chi_v, step.ratio


@indirect(void(_I, MODEL, ENERGY_STEP))
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
    joint.measure_joints(end, t, y, model)
    if model.springs.size > 0:
        springs.measure_springs(end, y, model)
    if model.rods.size > 0:
        rod_strains.measure_rods(end, model)
    if model.tapes.size > 0:
        tape.keep_nodes(end, model)
    if model.coordinates.size > 0:
        coordinate.measure_coordinates(end, y, model.switches, model)
    if model.threads.size > 0:
        thread.measure_threads(end, t, y, model)
    contact.measure(y, end, model)


@indirect(void(MODEL, ENERGY_STEP))
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
    if model.threads.size > 0:
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


@indirect(void(MODEL, ENERGY_STEP))
def residual(model, work):
    """Residual r of the increments dq and multipliers la; powers are means over the step.

    The constraints of joints stand last; that of a penalty is (gap0 + gap1)/2 + (damping rate - la)/stiffness.
    """
    n_v, h, powers = model.info.nv, work.step.h, work.powers
    F, P, r, ym = model.F, model.P, work.r, work.ym
    move(model, work)
    tm = work.step.t + 0.5 * h
    model.info.over = h
    for i in range(n_v):
        F[i] = 0.0
        P[i] = model.G[i]
    for i in range(N_POWERS):
        powers[i] = 0.0
    for b in range(model.bodies.size):
        for i in range(6):
            model.bodies[b].F[i] = 0.0
    points.clear_forces(model.points)
    if model.elements.size > 0:
        found = ancf_beams.add_elements(ym, work.dv, 1.0 / h, interval_of(work.step), model, F)
        powers[MASS_DAMPING], powers[STIFFNESS_DAMPING] = found
        if model.beam_loads.size > 0:
            beam_loads.add_beam_loads(tm, ym, 1.0, model, P)
        if model.thermal_loads.size > 0:
            thermal.add_thermal_loads(work.step.t, work.step.t + h, ym, 1.0, model, P)
    work.contact[0], work.contact[1] = contact.add_contacts(
        work.y0, work.y1, h, h, work.step.soft, work.step.chi, work.step.ratio, model, F
    )
    if model.rods.size > 0:
        if model.thermal_loads.size > 0:
            thermal.heat_rods(work.step.t, work.step.t + h, 1.0, model)
        lost, viscous, heat = rod.add_rods(h, work.step.chi, work.step.ratio, model)
        powers[MASS_DAMPING] += lost
        powers[STIFFNESS_DAMPING] += viscous
        powers[MARKER_LOADS] += heat
    if model.tapes.size > 0:
        powers[MASS_DAMPING] += tape.add_nodes(work.dv, 1.0 / h, h, model, F)
    if model.reduced_bodies.size > 0:
        _, lost = reduced.add_modes(ym, h, work.step.chi, work.step.ratio, model, F)
        powers[SPRINGS] += lost
        reduced.add_mode_inertia(work.dv, 1.0 / h, model.info.nq, model.reduced_bodies, F)
    if model.springs.size > 0:
        lost, given = springs.spring_forces(tm, ym, h, model)
        powers[SPRINGS] += lost
        powers[MARKER_LOADS] += given
    if model.loads.size > 0:
        powers[MARKER_LOADS] += loads.concentrated_loads(tm, ym, model)
    if model.fields.size > 0:
        powers[MARKER_LOADS] += fields.add_field_forces(tm, ym, model)
        fields.add_beam_fields(tm, ym, model, P)
    if model.coordinates.size > 0:
        _, lost = coordinate.add_coordinates(tm, ym, h, model.switches, model, F)
        powers[JOINTS] += lost
        powers[DRIVEN] += coordinate_laws.motor_power(model)
    if model.custom_forces.size > 0:
        lost, given = custom.add_custom_forces(tm, ym, model)
        powers[SPRINGS] += lost
        powers[MARKER_LOADS] += given
    if attitude.has_actuators(model):
        _, given, _ = attitude.actuator_forces(tm, ym, model)  # work of motors: `attitude.end_actuator_step`
        powers[MARKER_LOADS] += given
    for k in range(model.joints.size):
        if not joint.holds(work.step.t + h, model.joints, k):
            work.la[k] = 0.0
        _, lost = joint.add_joint_residual(work.step.t, h, ym, work.la[k], k, n_v + k, model, F, r)
        powers[JOINTS] += lost
    if model.bearings.size > 0:
        bearing.add_bearings(h, work.la, model, F)
    if model.threads.size > 0:
        lost, given, spools, driven = thread.add_thread_step(tm, h, ym, work.y0, work.y1, model, F)
        powers[SPRINGS] += lost
        powers[MARKER_LOADS] += given
        powers[SPOOLS] += spools
        powers[DRIVEN] += driven
    _add_points(model, work)
    powers[DRIVEN] += body_step.add_bodies(model, work)
    if attitude.has_actuators(model):
        attitude.add_wheel_step(h, work.dv, ym, model.info.nq, model, F)
    model.info.over = 0.0
    for i in range(n_v):
        r[i] = F[i] - P[i]


@inlined
def _add_points(model, work):
    """Inertia of points less their forces."""
    n_q, F, own = model.info.nq, model.F, model.points
    for i in range(own.size):
        at = own[i].iv - n_q
        for c in range(3):
            F[at + c] += own[i].mass * work.dv[at + c] / work.step.h - own[i].f[c]


@indirect(void(REAL, MODEL, ENERGY_STEP, SPARSE))
def tangent(scale, model, work, matrix):
    """Twice the derivative of `residual` by dq and la/2, constraints times `scale`; after `residual` only.

    Left out is what only slows Newton's method: what `evolvent.flow.implicit.tangent` leaves out; and that a vector
    fixed to a body, of which the mean of both ends acts, turns by (1 - [theta/2]x)^-1 times what the tangent has, theta
    the rotation vector of the step. So of a body that turns all columns are inexact: those by its turns, by its
    translation, and by the multipliers of joints on it. Rods have the factor. Others would need columns of their own
    beside those of the rows: measured on bodies with springs, joints by penalties and user's laws, it saves no
    iteration where a step turns them by less than 0.1 rad, and up to a third of them at 0.2 rad.

    Forces' tangents have torques on a free body in axes that turn with it; `body_step.add_body_tangents` takes them to
    the axes of the step's start.
    """
    n_q, n_v, h = model.info.nq, model.info.nv, work.step.h
    c_mass, c_rate = 4.0 / ((1.0 + work.step.chi_v) * h * h), 2.0 / h
    tm = work.step.t + 0.5 * h
    model.info.over = h
    sparse.clear(matrix)
    if model.elements.size > 0:
        ancf_beams.add_element_tangents(work.ym, c_mass, c_rate, interval_of(work.step), model, matrix)
        if model.thermal_loads.size > 0:
            thermal.add_thermal_tangents(work.ym, model, matrix)
    contact.add_tangents(work.y0, work.y1, h, 0.0, model, matrix)
    if model.rods.size > 0:
        rod_tangent.add_rod_tangents(h, c_rate, work.step.chi, work.step.ratio, model, matrix)
    if model.tapes.size > 0:
        tape.add_node_tangents(c_mass, c_rate, model, matrix)
    if model.reduced_bodies.size > 0:
        reduced.add_mode_tangents(c_mass, c_rate, work.step.chi, model, matrix)
    if model.springs.size > 0:
        springs.spring_tangents(tm, work.ym, h, c_rate, model, matrix)
    if model.coordinates.size > 0:
        coordinate_tangent.add_coordinate_tangents(work.ym, h, c_rate, model, matrix)
    if model.custom_forces.size > 0:
        custom.add_custom_tangents(tm, work.ym, c_rate, model, matrix)
    if model.fields.size > 0:
        fields.add_field_tangents(tm, work.ym, c_rate, model, matrix)
    loads.add_load_tangents(tm, work.ym, c_rate, model, matrix)
    node_load_tangents.add_following_tangents(tm, work.ym, c_rate, model, matrix)
    beam_loads.add_field_tangents(work.ym, model, matrix)
    for k in range(model.joints.size):  # the rows are those of the end, but of gears
        rows = 1.0 if model.joints[k].kind == joint.GEAR else 0.0
        joint_tangent.add_joint_tangent(work.step.t + h, work.la[k], k, n_v + k, scale, c_rate, rows, model, matrix)
    if model.bearings.size > 0:
        bearing.add_bearing_tangents(scale, work.la, model, matrix)
    points.add_point_tangent(c_mass, n_q, model.points, matrix)
    if model.threads.size > 0:
        thread.add_thread_step_tangent(tm, work.ym, h, c_mass, c_rate, model, matrix)
    body_step.add_body_tangents(c_mass, model, work, matrix)
    if attitude.has_actuators(model):
        attitude.add_wheel_step_tangent(c_mass, n_q, work.R0, work.R1, model, matrix)
        attitude_tangent.add_actuator_tangents(tm, work.ym, c_rate, model, matrix)
    model.info.over = 0.0
    if model.joints.size > 0:
        _add_end_rows(scale, c_rate, model, work, matrix)


@inlined
def _add_end_rows(scale, c_rate, model, work, matrix):
    """Derivatives of what joints hold at the end of the step. Bodies and geometry of joints stay at the end."""
    joints, bodies, t = model.joints, model.bodies, work.step.t + work.step.h
    for b in range(bodies.size):
        for i in range(3):
            bodies[b].x[i] = work.x1[b, i]
            for j in range(3):
                bodies[b].R[i, j] = work.R1[b, i, j]
    for k in range(joints.size):
        if joints[k].kind != joint.GEAR and joint.holds(t, joints, k):
            row = model.info.nv + k
            joint_tangent.add_end_row(t, work.y1, work.dq, k, row, scale, c_rate, model, matrix)
