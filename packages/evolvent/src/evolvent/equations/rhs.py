"""Right-hand side of the equations of motion."""

import math

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import constraint_rows, points, rigid
from evolvent.kernels.calls import force_at
from evolvent.kernels.loads import weight
from evolvent.model import (
    BY_CONTACT,
    BY_JOINTS,
    BY_MASS,
    BY_STIFFNESS,
    DISSIPATED,
    DRIVE,
    KEPT,
    LOAD,
    MODEL,
    N_ACCOUNTS,
    SPOOL,
)
from evolvent.model.interval import state_interval
from evolvent.model.powers import (
    CONTACTS,
    DRIVEN,
    JOINTS,
    MARKER_LOADS,
    MASS_DAMPING,
    N_POWERS,
    SPOOLS,
    SPRINGS,
    STIFFNESS_DAMPING,
)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
def rhs(t, y, s, model, dy):
    """State derivative dy : (ny,) at time t of the state y, s; leaves tensions in the nodes and in la.

    Not a number throughout where constraints are redundant (one of them follows from the others).
    """
    n_q, n_v, info, powers = model.info.nq, model.info.nv, model.info, model.powers
    F, P, account = model.F, model.P, model.info.nq + model.info.nv
    info.step = math.inf
    for i in range(y.size):
        dy[i] = 0.0
    if info.generalized != 0:
        for i in range(n_v):
            F[i] = P[i] = 0.0
    for i in range(N_POWERS):
        powers[i] = 0.0
    rigid.kinematics(t, y, model)
    points.clear_forces(model.points)
    gravity = info.gravity
    if gravity[0] != 0.0 or gravity[1] != 0.0 or gravity[2] != 0.0:
        powers[MARKER_LOADS] += weight(y, model.bodies, model.points, gravity)
    at = model.interval
    set_state(t, math.inf if info.stepping != 0 else -1.0, at)
    interval = state_interval(at, y, dy[n_q : n_q + n_v], model.la, dy, powers, s, dy)
    calls = model.explicit_force_calls
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    if info.generalized != 0:
        points.pass_to_beams(n_q, model.points, F)
        points.take_forces(n_q, model.points, F)
    calls = model.explicit_rate_calls
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    if not accelerate(interval, model):
        for i in range(y.size):
            dy[i] = math.nan
        return
    calls = model.explicit_end_calls
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    lost = powers[MASS_DAMPING] + powers[STIFFNESS_DAMPING] + powers[CONTACTS] + powers[JOINTS]
    dy[account + DISSIPATED] += powers[SPRINGS] + lost
    dy[account + SPOOL] += powers[SPOOLS]
    dy[account + LOAD] += powers[MARKER_LOADS]
    dy[account + DRIVE] += powers[DRIVEN]
    if model.info.causes != 0:
        dy[account + N_ACCOUNTS + BY_MASS] += powers[MASS_DAMPING]
        dy[account + N_ACCOUNTS + BY_STIFFNESS] += powers[STIFFNESS_DAMPING]
        dy[account + N_ACCOUNTS + BY_CONTACT] += powers[CONTACTS]
        dy[account + N_ACCOUNTS + BY_JOINTS] += powers[JOINTS]


@inlined
def set_state(t, rub, at):
    """Set the numbers of the interval of a state of an explicit method; rub: as of `kernels.contact.add_contacts`."""
    at.t, at.tm, at.h, at.span, at.rub, at.factor, at.inertia = t, t, 0.0, KEPT, rub, 1.0, 1.0
    at.over, at.chi, at.chi_v, at.ratio, at.soft = 1.0, 0.0, 0.0, 0.0, 1.0


@inlined
def accelerate(interval, model):
    """Accelerations of all under what has been applied; adds to powers; False for redundant rows."""
    t, y, s, dy, powers = interval.step.t, interval.ym, interval.s, interval.rates, interval.powers
    bodies = model.bodies
    rigid.factorise(bodies)
    for b in range(bodies.size):
        rigid.respond(bodies, b, bodies[b].F, bodies[b].a)
        if bodies[b].path != 0:
            for c in range(3):
                bodies[b].a[c] = bodies[b].along * bodies[b].direction[c]
    if model.rows.size > 0:
        if constraint_rows.build_rows(t, y, s, model) >= 0:
            return False
        constraint_rows.row_velocity_terms(t, y, s, model)
        constraint_rows.solve_rows(s, model, dy)
        powers[DRIVEN] += constraint_rows.driven_power(t, s, model)
    calls = model.explicit_carried_calls
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    for b in range(bodies.size):
        powers[DRIVEN] += rigid.write_rates(y, bodies, b, dy)
    points.write_point_rates(y, model.points, dy)
    return True
