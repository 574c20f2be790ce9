"""Coordinates of joints with spring, damper, stops, latch and friction: angles of hinges, and travels.

An angle is that of a second direction, of a beam or of a body, as seen from a body; it is continuous over any number of
turns. Each has two switches in the state: the angle of the last step in quarter turns, rounded, which gives the number
of whole turns, and whether the latch has locked. Travels: `travel`.
"""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, entry, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.coordinate import (
    TRAVEL,
    add_motors,
    add_synchronizations,
    bristle_energy,
    friction_force,
    measure_motor_slopes,
    note_peaks,
)
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import (
    ON_BODY,
    ON_COORDINATES,
    add_relative,
    add_relative_body,
    body_columns,
    side_columns,
    side_vector,
    turn_axis,
)
from evolvent.kernels.sparse import SPARSE, add_block, first_entry
from evolvent.kernels.travel import add_travel_tangent, place_on_body, push_travel, travel_geometry
from evolvent.model import MODEL, family_type

_I = types.int64
TURN, QUARTER = 2.0 * math.pi, 0.5 * math.pi
#: Angle that a step may turn a hinge by, rad; the quarter turns of its start distinguish turns up to 3/4 pi.
MOST_TURNED = 1.5
#: An angle this near to the latch's, rad, has reached it.
REACHED = 1e-10


@inlined
def _hinge_geometry(hinges, bodies, k, ux, uy, uz):
    """Zero direction a and the one across it b, parts p and q of the direction u along them, and g = d(angle)/du.

    Notes
    -----
    angle = atan2(q, p), g = (p b - q a)/(p^2 + q^2).
    """
    R = bodies[hinges[k].body].R
    z, n = hinges[k].zero, hinges[k].axis
    ax, ay, az = turn(R, z[0], z[1], z[2])
    nx, ny, nz = turn(R, n[0], n[1], n[2])
    bx, by, bz = cross(nx, ny, nz, ax, ay, az)
    p, q = ux * ax + uy * ay + uz * az, ux * bx + uy * by + uz * bz
    rr = p * p + q * q
    g = ((p * bx - q * ax) / rr, (p * by - q * ay) / rr, (p * bz - q * az) / rr)
    return (ax, ay, az), (bx, by, bz), p, q, g


@inlined
def continuous_angle(p, q, quarters):
    """Angle of (p, q) that is nearest to a number of quarter turns."""
    wrapped = math.atan2(q, p)
    return wrapped + TURN * math.floor((quarters * QUARTER - wrapped) / TURN + 0.5)


@inlined
def _second_side(y, hinges, bodies, k):
    """Second direction of hinge k, or the point of travel k, and its rate, inertial axes."""
    return side_vector(
        y, bodies, hinges[k].on, hinges[k].other, hinges[k].iq, hinges[k].iv, hinges[k].local,
        hinges[k].kind == TRAVEL,
    )  # fmt: skip


@entry(VECTOR, INTEGERS, family_type("hinges"), family_type("bodies"), types.int64)
@inlined
def measure_coordinate(y, s, hinges, bodies, k):
    """Coordinate k and its rate, its second side u and the derivative g of the coordinate by that, into its record."""
    u = _second_side(y, hinges, bodies, k)
    if hinges[k].kind == TRAVEL:
        g, x, rate = travel_geometry(hinges, bodies, k, u)
    else:
        _, _, p, q, g = _hinge_geometry(hinges, bodies, k, u[0], u[1], u[2])
        tx, ty, tz = cross(u[0], u[1], u[2], g[0], g[1], g[2])
        w = bodies[hinges[k].body].w
        rate = g[0] * u[3] + g[1] * u[4] + g[2] * u[5] - tx * w[0] - ty * w[1] - tz * w[2]
        x = continuous_angle(p, q, s[hinges[k].switch])
    hinges[k].angle, hinges[k].rate = x, rate
    for i in range(3):
        hinges[k].u[i], hinges[k].g[i] = u[i], g[i]


@entry(family_type("hinges"), types.int64, REAL, REAL, REAL)
@inlined
def hinge_law(hinges, k, latched, angle, rate):
    """Torque that resists, its derivatives with respect to angle and rate, energy and dissipated power."""
    torque, stiffness, damping = 0.0, hinges[k].stiffness, hinges[k].damping
    turned = angle - hinges[k].rest
    torque += stiffness * turned
    energy = 0.5 * stiffness * turned * turned
    over = max(angle - hinges[k].high, 0.0) + min(angle - hinges[k].low, 0.0)
    if over != 0.0:
        stiffness += hinges[k].stop
        torque += hinges[k].stop * over
        energy += 0.5 * hinges[k].stop * over * over
    if latched != 0:
        off = angle - hinges[k].latch
        stiffness += hinges[k].latch_stiffness
        damping += hinges[k].latch_damping
        torque += hinges[k].latch_stiffness * off
        energy += 0.5 * hinges[k].latch_stiffness * off * off
    return torque + damping * rate, stiffness, damping, energy, damping * rate * rate


@inlined
def add_applied(t, share, s, model):
    """Torques of motors and synchronizations of all coordinates; returns the latter's energy (J) and power lost (W).

    Parameters
    ----------
    share, s : as of `coordinate.add_motors`
    """
    hinges = model.flexible.hinges
    for k in range(hinges.size):
        hinges[k].applied = hinges[k].applied_slope = hinges[k].applied_damper = 0.0
    if model.flexible.motors.size > 0:
        add_motors(t, share, s, model)
    if model.flexible.synchronizations.size > 0:
        return add_synchronizations(share, model)
    return 0.0, 0.0


@indirect(types.UniTuple(REAL, 2)(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
def add_hinges(t, y, s, model, F):
    """Torques of all coordinates; returns (energy, power dissipated by dampers).

    Notes
    -----
    With g = d(angle)/du of the second direction u, a turn w of the first body changes the angle by -(u x g) . w, one of
    the second body by (u x g) . w.
    """
    hinges, bodies, n_q = model.flexible.hinges, model.bodies, model.info.nq
    for k in range(hinges.size):
        measure_coordinate(y, s, hinges, bodies, k)
    energy, power = add_applied(t, 1.0, s, model)
    for k in range(hinges.size):
        u, g = hinges[k].u, hinges[k].g
        body, latched, rate = hinges[k].body, s[hinges[k].switch + 1], hinges[k].rate
        torque, stiffness, damping, stored, lost = hinge_law(hinges, k, latched, hinges[k].angle, rate)
        rubs, stick = friction_force(hinges, k, hinges[k].angle)
        torque += rubs + hinges[k].applied
        hinges[k].torque, hinges[k].slope = torque, stiffness + stick + hinges[k].applied_slope
        hinges[k].damper = damping + hinges[k].applied_damper
        hinges[k].lost, hinges[k].latch_lost = lost, hinges[k].latch_damping * rate * rate if latched != 0 else 0.0
        energy += stored + bristle_energy(hinges, k)
        power += lost
        if hinges[k].kind == TRAVEL:
            push_travel(model, k, u, g, torque, F)
            continue
        tx, ty, tz = cross(u[0], u[1], u[2], g[0], g[1], g[2])
        G = bodies[body].F
        G[3] += torque * tx
        G[4] += torque * ty
        G[5] += torque * tz
        if hinges[k].on == ON_COORDINATES:
            at = hinges[k].iv - n_q
            F[at] += torque * g[0]
            F[at + 1] += torque * g[1]
            F[at + 2] += torque * g[2]
        else:
            H = bodies[hinges[k].other].F
            H[3] -= torque * tx
            H[4] -= torque * ty
            H[5] -= torque * tz
    return energy, power


# ------------------------------------------------------------------------------------------------ turns and latches


@inlined
def end_hinge_step(s, hinges):
    """Take the angles of the last forces as those of an accepted step: into the switches, and as its start."""
    for k in range(hinges.size):
        hinges[k].before, hinges[k].pace = hinges[k].angle, 0.0
        if hinges[k].kind != TRAVEL:
            hinges[k].pace = abs(hinges[k].rate)
            s[hinges[k].switch] = math.floor(hinges[k].angle / QUARTER + 0.5)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def note_turns(t, y, s, model):
    """`end_hinge_step` of a state whose forces have not been evaluated."""
    hinges, bodies = model.flexible.hinges, model.bodies
    rigid.kinematics(t, y, model)
    for k in range(hinges.size):
        measure_coordinate(y, s, hinges, bodies, k)
    note_peaks(s, hinges, 1.0)
    end_hinge_step(s, hinges)


@inlined
def longest_step(hinges):
    """Time in which a hinge turns by `MOST_TURNED` at the rate of the last step, s; infinity where none turns."""
    pace = 0.0
    for k in range(hinges.size):
        pace = max(pace, hinges[k].pace)
    return MOST_TURNED / pace if pace > 0.0 else math.inf


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, _I, VECTOR))
def latch_values(t, y, s, model, first, g):
    """Values of the events of all latches, from g[first] on: angle beyond the latch, -1 where none is open."""
    hinges, bodies = model.flexible.hinges, model.bodies
    rigid.kinematics(t, y, model)
    for k in range(hinges.size):
        g[first + k] = -1.0
        switch = hinges[k].switch
        if s[switch + 1] == 0 and math.isfinite(hinges[k].latch):
            measure_coordinate(y, s, hinges, bodies, k)
            g[first + k] = -hinges[k].side * (hinges[k].angle - hinges[k].latch)


@inlined
def until_latch(s, hinges):
    """Part of the step at which the first latch is passed, by a secant; 1 where none is, or the step ends on it."""
    part = 1.0
    for k in range(hinges.size):
        if s[hinges[k].switch + 1] == 0 and math.isfinite(hinges[k].latch):
            off, before = hinges[k].angle - hinges[k].latch, hinges[k].before - hinges[k].latch
            if hinges[k].side * off < -REACHED and hinges[k].side * before > REACHED:
                part = min(part, before / (before - off))
    return part


@inlined
def latch_reached(s, hinges, k):
    """Whether the open latch of hinge k is reached at the angle of the last step."""
    if s[hinges[k].switch + 1] != 0 or not math.isfinite(hinges[k].latch):
        return False
    return hinges[k].side * (hinges[k].angle - hinges[k].latch) <= REACHED


# ------------------------------------------------------------------------------------------------ tangent


@indirect(void(VECTOR, REAL, MODEL, SPARSE))
def add_hinge_tangents(y, c_rate, model, matrix):
    """Tangents of all hinges, at the angles of the last forces.

    Notes
    -----
    With f = torque g: df = (stiffness + c_rate damping) g g^T + damping g (H r)^T + torque H, H = d2(angle)/du2, and r
    is the rate of u as seen from the body.
    """
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    hinges = flexible.hinges
    K = flexible.K12
    if flexible.motors.size > 0:
        measure_motor_slopes(model)
    if flexible.synchronizations.size > 0:
        add_synchronization_tangents(c_rate, model, matrix)
    for k in range(hinges.size):
        torque, damping = hinges[k].torque, hinges[k].damper + hinges[k].motor_damper
        slope = hinges[k].slope + hinges[k].motor_slope + c_rate * damping
        u = _second_side(y, hinges, bodies, k)
        ux, uy, uz = u[0], u[1], u[2]
        if hinges[k].kind == TRAVEL:
            add_travel_tangent(k, slope, model, matrix)
            continue
        a, b, p, q, g = _hinge_geometry(hinges, bodies, k, ux, uy, uz)
        body = hinges[k].body
        rr = p * p + q * q
        w = bodies[body].w
        rx, ry, rz = cross(w[0], w[1], w[2], ux, uy, uz)
        r = (u[3] - rx, u[4] - ry, u[5] - rz)
        x, d = 2.0 * p * q / (rr * rr), (q * q - p * p) / (rr * rr)
        if hinges[k].on == ON_BODY:
            for j in range(3):
                for i in range(3):
                    K[3 + i, 3 + j] = x * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])
            _add_between_bodies(model, k, (ux, uy, uz), g, torque, slope, damping, K, matrix)
            continue
        for j in range(3):
            turned = 0.0
            for i in range(3):
                turned += (x * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])) * r[i]
            for i in range(3):
                second = x * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])
                K[i, j] = slope * g[i] * g[j] + torque * second + damping * g[i] * turned
        at = hinges[k].iv - n_q
        add_block(matrix, at, at, K, 0, 0, 3, 3, 1.0)
        if bodies[body].motion != rigid.DRIVEN:
            local = flexible.e[2]
            local[0], local[1], local[2] = turn_back(bodies[body].R, ux, uy, uz)
            body_columns(model, body, local, False, flexible.J[1])
            f = (torque * g[0], torque * g[1], torque * g[2])
            add_relative(matrix, model, body, flexible.J[1], K, f, at, 1.0)
            add_relative_body(matrix, model, body, False, flexible.J[1], K, f)


@inlined
def _add_between_bodies(model, k, u, g, torque, slope, damping, K, matrix):
    """Tangent of hinge k between two bodies; K[3:6, 3:6] = H.

    Notes
    -----
    A turn z of the second body as seen from the first (inertial axes) changes u by z x u, and t = u x g by T z beside
    what turns with the first body; the torque by s . z, s = slope t + damping (T^T r + w_b x t), r = w_b - w_a. The
    torques on the axes of the bodies then change by A z of the first, A = t s^T + torque T, and by
    (A + torque [t]x) z of the second one, with opposite signs.
    """
    bodies, hinges = model.bodies, model.flexible.hinges
    a, b = hinges[k].body, hinges[k].other
    t = cross(u[0], u[1], u[2], g[0], g[1], g[2])
    wb = bodies[b].w
    r = (wb[0] - bodies[a].w[0], wb[1] - bodies[a].w[1], wb[2] - bodies[a].w[2])
    c = cross(wb[0], wb[1], wb[2], t[0], t[1], t[2])
    for j in range(3):
        e = (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
        dx, dy, dz = cross(e[0], e[1], e[2], u[0], u[1], u[2])
        hx = K[3, 3] * dx + K[3, 4] * dy + K[3, 5] * dz
        hy = K[4, 3] * dx + K[4, 4] * dy + K[4, 5] * dz
        hz = K[5, 3] * dx + K[5, 4] * dy + K[5, 5] * dz
        one, two = cross(dx, dy, dz, g[0], g[1], g[2]), cross(u[0], u[1], u[2], hx, hy, hz)
        T = (one[0] + two[0], one[1] + two[1], one[2] + two[2])
        s = slope * t[j] + damping * (T[0] * r[0] + T[1] * r[1] + T[2] * r[2] + c[j])
        turned = cross(t[0], t[1], t[2], e[0], e[1], e[2])
        for i in range(3):
            K[i, j] = t[i] * s + torque * T[i]
            K[6 + i, j] = K[i, j] + torque * turned[i]
    _add_turns(matrix, model, a, a, K, 0, 1.0)
    _add_turns(matrix, model, a, b, K, 0, -1.0)
    _add_turns(matrix, model, b, a, K, 6, -1.0)
    _add_turns(matrix, model, b, b, K, 6, 1.0)


@indirect(void(SPARSE, MODEL, _I, _I, MATRIX, _I, REAL))
def _add_turns(matrix, model, i, j, K, first, scale):
    """Add scale K[first : first + 3, :3], torques on body i by turns of body j in inertial axes, to their unknowns."""
    bodies, n_q = model.bodies, model.info.nq
    if bodies[i].motion == rigid.DRIVEN or bodies[j].motion == rigid.DRIVEN:
        return
    row = 3 if bodies[i].motion == rigid.FREE else 0
    column = 3 if bodies[j].motion == rigid.FREE else 0
    to, right, down = first_entry(matrix, bodies[i].iv - n_q + row, bodies[j].iv - n_q + column)
    if to < 0:
        return
    values = matrix.values
    for c in range(3 if column == 3 else 1):
        nx, ny, nz = turn_axis(bodies, j, bodies[j].motion, 3 + c)
        z = turn(bodies[j].R, nx, ny, nz)
        for m in range(3 if row == 3 else 1):
            nx, ny, nz = turn_axis(bodies, i, bodies[i].motion, 3 + m)
            x = turn(bodies[i].R, nx, ny, nz)
            value = 0.0
            for d in range(3):
                value += x[d] * (K[first + d, 0] * z[0] + K[first + d, 1] * z[1] + K[first + d, 2] * z[2])
            values[to + m * down + c * right] += scale * value


@inlined
def _gradients(model, k, J):
    """Derivatives of coordinate k by the unknowns of its body, J[0], and of its second side, J[1].

    Returns the first unknown and their number of both.
    """
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    hinges, local, columns = flexible.hinges, flexible.e[2], flexible.K12
    a, on, g, u = hinges[k].body, hinges[k].on, hinges[k].g, hinges[k].u
    if hinges[k].kind == TRAVEL:
        place_on_body(model, k, u, local)
        at, na = side_columns(model, ON_BODY, a, -1, local, True, columns)
        for c in range(na):
            J[0, c] = -(g[0] * columns[0, c] + g[1] * columns[1, c] + g[2] * columns[2, c])
        bt, nb = side_columns(model, on, hinges[k].other, hinges[k].iv, hinges[k].local, True, columns)
        for c in range(nb):
            J[1, c] = g[0] * columns[0, c] + g[1] * columns[1, c] + g[2] * columns[2, c]
        return at, na, bt, nb
    t = cross(u[0], u[1], u[2], g[0], g[1], g[2])
    at, na = _turn_gradient(bodies, n_q, a, t, -1.0, J, 0)
    if on == ON_BODY:
        bt, nb = _turn_gradient(bodies, n_q, hinges[k].other, t, 1.0, J, 1)
    else:
        bt, nb = hinges[k].iv - n_q, 3
        for c in range(3):
            J[1, c] = g[c]
    return at, na, bt, nb


@inlined
def _turn_gradient(bodies, n_q, b, t, sign, J, row):
    """Write sign t . (turn) of body b by its unknowns to a row of J; returns the first of them and their number."""
    motion = bodies[b].motion
    if motion == rigid.DRIVEN:
        return 0, 0
    first, count = (3, 3) if motion == rigid.FREE else (0, 1)
    for c in range(count):
        nx, ny, nz = turn_axis(bodies, b, motion, first + c)
        x, y, z = turn(bodies[b].R, nx, ny, nz)
        J[row, c] = sign * (t[0] * x + t[1] * y + t[2] * z)
    return bodies[b].iv - n_q + first, count


@indirect(void(REAL, MODEL, SPARSE))
def add_synchronization_tangents(c_rate, model, matrix):
    """What cables couple between different coordinates; the rest is among the slopes of each."""
    rows, J = model.flexible.synchronizations, model.flexible.J
    for k in range(rows.size):
        factor = -rows[k].ratio_a * rows[k].ratio_b * (rows[k].stiffness + c_rate * rows[k].damping)
        a = _gradients(model, rows[k].a, J[0])
        b = _gradients(model, rows[k].b, J[1])
        for i in range(2):
            for j in range(2):
                _add_outer(matrix, a[2 * i], a[2 * i + 1], J[0], i, b[2 * j], b[2 * j + 1], J[1], j, factor)
                _add_outer(matrix, b[2 * j], b[2 * j + 1], J[1], j, a[2 * i], a[2 * i + 1], J[0], i, factor)


@indirect(void(SPARSE, _I, _I, MATRIX, _I, _I, _I, MATRIX, _I, REAL))
def _add_outer(matrix, at, n, J, i, bt, m, L, j, factor):
    """Add factor J[i]^T L[j]; rows of unknowns at, at + 1 ..., columns bt, bt + 1 ..."""
    if n == 0 or m == 0:
        return
    to, right, down = first_entry(matrix, at, bt)
    if to < 0:
        return
    for c in range(m):
        for r in range(n):
            matrix.values[to + r * down + c * right] += factor * J[i, r] * L[j, c]


def hinge_bound(hinges):
    """Stiffness (N m/rad) and damping (N m s/rad) of all hinges, every stop reached and every latch locked.

    Not compiled.
    """
    locked = np.isfinite(hinges["latch"])
    stiffness = hinges["stiffness"] + np.maximum(hinges["stop"], 0.0) + np.where(locked, hinges["latch_stiffness"], 0.0)
    return stiffness, hinges["damping"] + np.where(locked, hinges["latch_damping"], 0.0)
