"""Free spools under implicit methods: residual, tangent, and the part of a step at which a node leaves or comes back.

The angle phi of a free spool is an unknown, with S (phi'' + n . w') = r T + tau as in `spool`; all terms are multiplied
by the number of copies. Friction that holds the spool is regularised: the torque is that of a stiff viscous damper,
which lets the spool creep at `CREEP` at most.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_entry
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL, LEAST_OUT
from evolvent.kernels.law_means import SPRING, scalar_slope
from evolvent.kernels.law_slopes import spring_law_slope
from evolvent.kernels.rigid import FREE, SPIN
from evolvent.kernels.rotor import acceleration_about, add_reaction
from evolvent.kernels.thread.boundary import pull_slopes
from evolvent.kernels.thread.end import TINY
from evolvent.kernels.thread.moving_tangent import add_payout
from evolvent.kernels.thread.spool import MOVING, paid_out, spool_direction, spool_pull, spool_torques
from evolvent.kernels.thread.springs import damper_slope, segment_columns, segment_vector, turning_columns
from evolvent.model import MODEL, having

USED_FOR = having("threads", drive=FREE_SPOOL)
#: Rate at which the regularised friction reaches its limit, rad/s.
CREEP = 1e-6
#: Part of a segment by which a step may run past the release of a node.
WINDOW = 1e-5
#: Part of a segment by which a free spool may run past the end of its thread.
OVERRUN = 1e-6


@inlined
def turn_spools(t, y, a, model):
    """Accelerations of free spools from a, their friction, and their reactions on their bodies; after `reels`."""
    threads, n_q = model.threads, model.info.nq
    hold_spools(t, y, model)
    for p in range(threads.size):
        if threads[p].drive != FREE_SPOOL:
            continue
        rate, acceleration = y[threads[p].spool_v], a[threads[p].spool_v - n_q]
        threads[p].b[2] = threads[p].r * acceleration - threads[p].coiling * rate * rate
        nx, ny, nz = spool_direction(threads, model.bodies, p)
        I = threads[p].copies * threads[p].spool_inertia  # noqa: E741
        add_reaction(model.bodies, threads[p].body, I * acceleration, I * rate, nx, ny, nz)


@inlined
def hold_spools(t, y, model):
    """Torques of motors and friction of free spools; what explicit methods add to their bodies is left out.

    A spool that slips sticks when its rate changes sign, without a limit of the torque in that evaluation: Newton's
    method would otherwise alternate between the two senses of slip.
    """
    threads, s = model.threads, model.switches
    for p in range(threads.size):
        if threads[p].drive != FREE_SPOOL:
            continue
        rate, k, held = y[threads[p].spool_v], threads[p].spool_switch, 0.0
        threads[p].loose = 0.0
        if k >= 0:
            held = threads[p].spool_friction / CREEP * rate
            if s[k] == 0 and abs(held) > threads[p].spool_friction:
                s[k] = 1 if rate > 0.0 else -1
            elif s[k] * rate < 0.0:
                s[k] = 0
        threads[p].motor, threads[p].friction = spool_torques(t, y[threads[p].spool_q], rate, s, model, p)
        if k >= 0 and s[k] == 0:
            threads[p].friction -= held


@inlined
def add_spool_residual(y, a, model, r):
    """Equations of motion of free spools into r, the accelerations of the bodies known; returns what friction takes."""
    threads, bodies, n_q, lost = model.threads, model.bodies, model.info.nq, 0.0
    for p in range(threads.size):
        if threads[p].drive != FREE_SPOOL:
            continue
        k, copies = threads[p].spool_v - n_q, float(threads[p].copies)
        nx, ny, nz = spool_direction(threads, bodies, p)
        turning = a[k] + acceleration_about(bodies, threads[p].body, nx, ny, nz)
        torque = threads[p].r * spool_pull(model.switches, model, p)
        torque += threads[p].motor + threads[p].friction
        r[k] = copies * (threads[p].spool * turning - torque)
        lost -= copies * threads[p].friction * y[threads[p].spool_v]
    return lost


@indirect(void(REAL, VECTOR, REAL, REAL, REAL, REAL, types.int64, MODEL, SPARSE))
def add_spool_tangent(t, y, h, c_mass, c_rate, along, p, model, matrix):
    """Tangent of free spool p of a state (h = 0), or twice that of a step.

    Parameters
    ----------
    along : float, N/m, of `springs.segment_slope`, of the segment at the spool; 0 where it is slack
    """
    threads, bodies, n_q = model.threads, model.bodies, model.info.nq
    s, k, copies = model.switches, threads[p].spool_v - n_q, float(threads[p].copies)
    phi, rate, S = y[threads[p].spool_q], y[threads[p].spool_v], threads[p].spool
    own = c_mass * S + c_rate * threads[p].spool_viscous
    own += threads[p].coiling * spool_pull(s, model, p)
    if threads[p].spool_switch >= 0 and s[threads[p].spool_switch] == 0:
        own += c_rate * threads[p].spool_friction / CREEP
    if threads[p].motor_law != 0:
        law, q = threads[p].motor_law, model.parameters[threads[p].motor_first : threads[p].motor_last]
        if model.info.over == 0.0:
            own -= spring_law_slope(law, phi, 1.0, rate, c_rate, t, q, 1.0)
        else:
            over = model.info.over
            own -= scalar_slope(SPRING, law, phi, 1.0, rate, c_rate, t, over, q, 0.0, math.inf, 1.0, model)
    b, Y = threads[p].body, threads[p].chord
    at = bodies[b].iv - n_q
    if bodies[b].motion == SPIN:
        n = bodies[b].axis
        inertia = c_mass * copies * S * (n[0] * Y[0] + n[1] * Y[1] + n[2] * Y[2])
        add_entry(matrix, k, at, inertia)
        add_entry(matrix, at, k, inertia)
    elif bodies[b].motion == FREE:
        for c in range(3):
            inertia = c_mass * copies * S * Y[c]
            add_entry(matrix, k, at + 3 + c, inertia)
            add_entry(matrix, at + 3 + c, k, inertia)
    if threads[p].kind == MOVING:
        own += add_payout(y, c_mass, c_rate, p, model, matrix)
    elif s[p] > 0 and s[threads.size + p] == 0 and along != 0.0:
        r = threads[p].r
        tension_by_out, pull_by_length, pull_by_out = pull_slopes(h, along, p, model)
        damped = damper_slope(h, p, s[p] - 1, model) * threads[p].coiling * rate  # as the radius falls
        own -= (pull_by_out * r + damped) * r
        add_boundary(y, h, tension_by_out * r + damped, pull_by_length * r, p, model, matrix)
    add_entry(matrix, k, k, copies * own)


@inlined
def add_boundary(y, h, tension, torque, p, model, matrix):
    """Couple free spool p with both ends of its segment.

    Parameters
    ----------
    tension, torque : float, N, derivative of the tension by the angle, and of the torque on the spool by the length
    """
    threads, n_q = model.threads, model.info.nq
    s, k, copies = model.switches, threads[p].spool_v - n_q, float(threads[p].copies)
    Ja, Jb = model.J[0], model.J[1]
    dx, dy, dz, _, _, _ = segment_vector(y, s, p, s[p] - 1, model)
    a, n, b, m = segment_columns(p, s[p] - 1, s, model, Ja, Jb)
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    ex, ey, ez = threads[p].X[0], threads[p].X[1], threads[p].X[2]
    if length > TINY:
        ex, ey, ez = dx / length, dy / length, dz / length
    for c in range(n):
        along = Ja[0, c] * ex + Ja[1, c] * ey + Ja[2, c] * ez
        add_entry(matrix, a + c, k, tension * along)
        add_entry(matrix, k, a + c, -copies * torque * along)
    for c in range(m):
        along = copies * (Jb[0, c] * ex + Jb[1, c] * ey + Jb[2, c] * ez)
        add_entry(matrix, b + c, k, -tension * along)
        add_entry(matrix, k, b + c, torque * along)
    damper = damper_slope(h, p, s[p] - 1, model)
    if damper != 0.0 and length > TINY:
        _add_boundary_rates(y, -copies * threads[p].r * damper, (ex, ey, ez), length, p, model, matrix)


@inlined
def _add_boundary_rates(y, factor, e, length, p, model, matrix):
    """Add factor times what a change of place alone changes in the rate of the segment at free spool p to its row."""
    s, k = model.switches, model.threads[p].spool_v - model.info.nq
    Ja, Jb, L = model.J[0], model.J[1], model.K12
    _, _, _, vx, vy, vz = segment_vector(y, s, p, s[p] - 1, model)
    rate, scale = vx * e[0] + vy * e[1] + vz * e[2], factor / length
    across = (scale * (vx - rate * e[0]), scale * (vy - rate * e[1]), scale * (vz - rate * e[2]))
    a, n, b, m = segment_columns(p, s[p] - 1, s, model, Ja, Jb)
    _add_row(matrix, k, a, n, Ja, across, 1.0)
    _add_row(matrix, k, b, m, Jb, across, -1.0)
    a, n, b, m = turning_columns(p, s[p] - 1, s, model, Ja, L)
    along = (factor * e[0], factor * e[1], factor * e[2])
    _add_row(matrix, k, a, n, Ja, along, 1.0)
    _add_row(matrix, k, b, m, L, along, -1.0)


@inlined
def _add_row(matrix, k, at, n, J, h, scale):
    """Add scale h . J, J the columns of the unknowns at, at + 1 ..., to row k."""
    for c in range(n):
        add_entry(matrix, k, at + c, scale * (h[0] * J[0, c] + h[1] * J[1, c] + h[2] * J[2, c]))


@inlined
def next_levels(s, threads, p):
    """Nodes' worth of thread that is out at which the next node leaves spool p, and at which the last one comes back.

    Of a thread that is all out, or all wound, these are the ends beyond which its spool must not turn.
    """
    up, down = float(s[p]), s[p] - 1 + threads[p].capture
    if s[p] == threads[p].n and not threads[p].separates:
        up += OVERRUN
    if s[p] == 0 or (s[p] == 1 and threads[p].end >= 0):
        down = -OVERRUN
    if threads[p].kind == MOVING:
        down = LEAST_OUT * threads[p].n + threads[p].taken[0] / threads[p].segment - OVERRUN
    return up, down


@inlined
def _passed(out, rate, up, down):
    """Part of a segment by which a spool has passed its next level; below zero where it has not."""
    if rate > 0.0:
        return out - up
    return down - out if rate < 0.0 else -1.0


@indirect(REAL(REAL, VECTOR, VECTOR, INTEGERS, MODEL))
def until_release(h, y0, y, s, model):
    """Part of a step from y0 to y at which the first node of a free spool leaves or comes back; 1 where none does.

    Notes
    -----
    The angle lies on the cubic of both ends. A step that ends within `WINDOW` past a level ends there.
    """
    threads, part = model.threads, 1.0
    for p in range(threads.size):
        if threads[p].drive != FREE_SPOOL or s[threads.size + p] != 0:
            continue
        q, v, l0 = threads[p].spool_q, threads[p].spool_v, threads[p].segment
        up, down = next_levels(s, threads, p)
        if not _passed(paid_out(threads, p, y[q]) / l0, y[v], up, down) > WINDOW:
            continue
        low, high = 0.0, 1.0
        d = y[q] - y0[q]
        for _ in range(50):
            theta = 0.5 * (low + high)
            rest = 1.0 - theta
            bend = rest * (h * y0[v] - d) + theta * (d - h * y[v])
            out = paid_out(threads, p, rest * y0[q] + theta * y[q] + theta * rest * bend) / l0
            if _passed(out, y[v], up, down) > 0.5 * WINDOW:
                high = theta
            else:
                low = theta
        part = min(part, high)
    return part


@indirect(types.boolean(VECTOR, INTEGERS, MODEL))
def has_release(y, s, model):
    """Whether a node of a free spool is to leave or come back at the state y."""
    threads = model.threads
    for p in range(threads.size):
        if threads[p].drive == FREE_SPOOL and s[threads.size + p] == 0:
            up, down = next_levels(s, threads, p)
            out = paid_out(threads, p, y[threads[p].spool_q]) / threads[p].segment
            if _passed(out, y[threads[p].spool_v], up, down) >= 0.0:
                return True
    return False
