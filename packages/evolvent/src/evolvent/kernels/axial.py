"""Measures of a joint's coordinate: an angle about an axis of a body, or a travel along it, over an interval of time.

A row of the families `coordinates` or `gear_coordinates` has a body with an `axis` and a second side u (`sides`). An
angle is that of the direction u about the axis, from the direction `zero` on; a travel that of the point u along the
axis, from the point `zero` on.

Over an interval bodies stand at the mean of both their rotations. With p = u.a and q = u.b of `zero` a and the
direction b across it, an angle changes by d = atan2(p0 q1 - q0 p1, p0 p1 + q0 q1), and p0 q1 - q0 p1 = pm dq - qm dp
exactly, means m of both ends. So a torque T does the work T d by the forces T c (pm b - qm a) on u, T c pm u on b and
-T c qm u on a, c = d/(p0 q1 - q0 p1). A travel is quadratic in vectors that are fixed to bodies: along the mean shape a
force f along the axis does the work f dx. A state is an interval of length zero: c = 1/(p^2 + q^2).
"""

import math

from numba import types

from evolvent.compiled.jit import INTEGERS, VECTOR, entry, inlined
from evolvent.kernels import rigid
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import ON_BODY, pull, side_vector
from evolvent.model import family_type

#: Kinds of coordinates.
ANGLE, TRAVEL = 0, 1
TURN, QUARTER = 2.0 * math.pi, 0.5 * math.pi
#: Change of an angle below which secants are tangents, rad.
SMALL = 1e-7
#: An angle this near to that of a latch, rad, has reached it.
REACHED = 1e-10


@inlined
def second_side(y, rows, bodies, k):
    """Second direction, or the point of a travel, and its rate, inertial axes."""
    return side_vector(
        y, bodies, rows[k].on, rows[k].other, rows[k].iq, rows[k].iv, rows[k].local, rows[k].kind == TRAVEL
    )


@inlined
def directions(rows, bodies, k):
    """Direction `zero` of an angle, and the one a quarter turn on."""
    R, z, n = bodies[rows[k].body].R, rows[k].zero, rows[k].axis
    bx, by, bz = cross(n[0], n[1], n[2], z[0], z[1], z[2])
    return turn(R, z[0], z[1], z[2]), turn(R, bx, by, bz)


@inlined
def continuous_angle(p, q, quarters):
    """Angle of (p, q) that is nearest to a number of quarter turns."""
    wrapped = math.atan2(q, p)
    return wrapped + TURN * math.floor((quarters * QUARTER - wrapped) / TURN + 0.5)


@inlined
def _parts(a, b, u):
    """Parts p and q of the direction u along a and b."""
    return u[0] * a[0] + u[1] * a[1] + u[2] * a[2], u[0] * b[0] + u[1] * b[1] + u[2] * b[2]


@inlined
def _travel(rows, bodies, k, u):
    """Direction of a travel, the travel of its point u (a tuple with its rate), and the rate of the travel."""
    b = rows[k].body
    R, X, V, w, n, p = bodies[b].R, bodies[b].x, bodies[b].v, bodies[b].w, rows[k].axis, rows[k].zero
    dx, dy, dz = turn(R, n[0], n[1], n[2])
    px, py, pz = turn(R, p[0], p[1], p[2])
    ax, ay, az = u[0] - X[0], u[1] - X[1], u[2] - X[2]
    vx, vy, vz = cross(w[0], w[1], w[2], ax, ay, az)
    travel = dx * (ax - px) + dy * (ay - py) + dz * (az - pz)
    rate = dx * (u[3] - V[0] - vx) + dy * (u[4] - V[1] - vy) + dz * (u[5] - V[2] - vz)
    return (dx, dy, dz), travel, rate


@inlined
def measure_end(rows, bodies, k, y, quarters, end):
    """Coordinate k of the state y into its record, as that of the start (end 0) or of the end (1) of an interval."""
    u, p, q = second_side(y, rows, bodies, k), 0.0, 0.0
    if rows[k].kind == TRAVEL:
        _, x, _ = _travel(rows, bodies, k, u)
    else:
        a, b = directions(rows, bodies, k)
        p, q = _parts(a, b, u)
        x = continuous_angle(p, q, quarters)
    if end == 0:
        rows[k].before, rows[k].p0, rows[k].q0 = x, p, q
    else:
        rows[k].angle, rows[k].p1, rows[k].q1 = x, p, q


@inlined
def measure_between(rows, bodies, k, y, h, quarters):
    """Rate, second side u, and direction g of the force on it of coordinate k over an interval, into its record.

    Parameters
    ----------
    y : (ny,) float, mean state, with the increments over h as velocities, as `bodies` have them
    h : float, s, length of the interval, after `measure_end` of both ends; 0: y is a state, whose coordinate is
        written as well
    quarters : number of quarter turns to which the angle of a state is nearest
    """
    u, x = second_side(y, rows, bodies, k), rows[k].angle
    if rows[k].kind == TRAVEL:
        g, travel, rate = _travel(rows, bodies, k, u)
        if h == 0.0:
            x = travel
    else:
        a, b = directions(rows, bodies, k)
        p0, q0, p1, q1 = rows[k].p0, rows[k].q0, rows[k].p1, rows[k].q1
        if h == 0.0:
            p0, q0 = _parts(a, b, u)
            p1, q1, x = p0, q0, continuous_angle(p0, q0, quarters)
        swept, along = p0 * q1 - q0 * p1, p0 * p1 + q0 * q1
        turned = math.atan2(swept, along) if h > 0.0 else 0.0
        scale = turned / swept if abs(turned) > SMALL else 1.0 / along
        p, q = 0.5 * (p0 + p1), 0.5 * (q0 + q1)
        g = (scale * (p * b[0] - q * a[0]), scale * (p * b[1] - q * a[1]), scale * (p * b[2] - q * a[2]))
        w = bodies[rows[k].body].w
        vx, vy, vz = cross(w[0], w[1], w[2], u[0], u[1], u[2])
        rate = g[0] * (u[3] - vx) + g[1] * (u[4] - vy) + g[2] * (u[5] - vz)
    rows[k].angle, rows[k].rate = x, rate if h == 0.0 else (x - rows[k].before) / h
    for i in range(3):
        rows[k].u[i], rows[k].g[i] = u[i], g[i]


@inlined
def rate_of(rows, bodies, k, y):
    """Rate of coordinate k in the state y, by the bodies' current positions and velocities; changes no record."""
    x, y_, z, vx, vy, vz = second_side(y, rows, bodies, k)
    if rows[k].kind == TRAVEL:
        _, _, rate = _travel(rows, bodies, k, (x, y_, z, vx, vy, vz))
        return rate
    _, _, _, _, g = angle_of(rows, bodies, k, (x, y_, z))
    w = bodies[rows[k].body].w
    wx, wy, wz = cross(w[0], w[1], w[2], x, y_, z)
    return g[0] * (vx - wx) + g[1] * (vy - wy) + g[2] * (vz - wz)


@inlined
def second_rate(rows, bodies, k, y):
    """Second derivative of coordinate k without accelerations, after `measure_between` of a state.

    Notes
    -----
    Relative to the body, with its angular velocity w, a vector r that is fixed to the other body has the rate
    r' - w x r and the second derivative r'' - 2 w x r' + w x (w x r).
    """
    u, b = second_side(y, rows, bodies, k), rows[k].body
    w, x, v, is_place = bodies[b].w, bodies[b].x, bodies[b].v, rows[k].kind == TRAVEL
    r, rate, own = (u[0], u[1], u[2]), (u[3], u[4], u[5]), (0.0, 0.0, 0.0)
    if is_place:
        r, rate = (r[0] - x[0], r[1] - x[1], r[2] - x[2]), (rate[0] - v[0], rate[1] - v[1], rate[2] - v[2])
    if rows[k].on == ON_BODY:
        local = rows[k].local
        dx, dy, dz = turn(bodies[rows[k].other].R, local[0], local[1], local[2])
        own = rigid.centripetal(bodies, rows[k].other, dx, dy, dz)
    wr, wv = cross(w[0], w[1], w[2], r[0], r[1], r[2]), cross(w[0], w[1], w[2], rate[0], rate[1], rate[2])
    wwr, value = cross(w[0], w[1], w[2], wr[0], wr[1], wr[2]), 0.0
    for i in range(3):
        value += rows[k].g[i] * (own[i] - 2.0 * wv[i] + wwr[i])
    if is_place:
        return value
    a, b_ = directions(rows, bodies, k)
    p, q = _parts(a, b_, r)
    p_rate, q_rate = _parts(a, b_, (rate[0] - wr[0], rate[1] - wr[1], rate[2] - wr[2]))
    return value - 2.0 * rows[k].rate * (p * p_rate + q * q_rate) / (p * p + q * q)


@inlined
def push(rows, bodies, n_q, k, torque, F):
    """Add the torque or force of coordinate k, positive where it resists, to the left of the equations."""
    u, g, is_place = rows[k].u, rows[k].g, rows[k].kind == TRAVEL
    fx, fy, fz = torque * g[0], torque * g[1], torque * g[2]
    pull(F, bodies, n_q, rows[k].on, rows[k].other, rows[k].iv, u, is_place, fx, fy, fz)
    pull(F, bodies, n_q, ON_BODY, rows[k].body, -1, u, is_place, -fx, -fy, -fz)


@inlined
def second_derivative(a, b, p, q, i, j):
    """Entry (i, j) of the second derivative of the angle of a direction with the parts p, q by it."""
    rr = p * p + q * q
    x, d = 2.0 * p * q / (rr * rr), (q * q - p * p) / (rr * rr)
    return x * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])


@inlined
def angle_of(rows, bodies, k, u):
    """Directions a and b, parts p and q, and derivative g of the angle of the direction u (a tuple) by it."""
    a, b = directions(rows, bodies, k)
    p, q = _parts(a, b, u)
    scale = 1.0 / (p * p + q * q)
    g = (scale * (p * b[0] - q * a[0]), scale * (p * b[1] - q * a[1]), scale * (p * b[2] - q * a[2]))
    return a, b, p, q, g


@inlined
def place_on_body(rows, bodies, k, local):
    """Write the point of a travel, as seen from its body, to `local`, body axes."""
    X, u = bodies[rows[k].body].x, rows[k].u
    local[0], local[1], local[2] = turn_back(bodies[rows[k].body].R, u[0] - X[0], u[1] - X[1], u[2] - X[2])


@inlined
def gradients(model, rows, k, J):
    """Derivatives of coordinate k by the unknowns of its body, J[0], and of its second side, J[1].

    Returns the first unknown and their number of both.
    """
    g, u, none = rows[k].g, rows[k].u, (0.0, 0.0, 0.0)
    return both_sides(model, rows, k, (u[0], u[1], u[2]), (g[0], g[1], g[2]), none, none, J)


@inlined
def rate_gradients(y, model, rows, k, J):
    """As `gradients`, of what a change of place alone changes in the rate of coordinate k.

    Notes
    -----
    As seen from the body, u moves by s and has the rate r. The rate g . r of the coordinate changes by h . s,
    h = H r + w x g with H = d2(angle)/du2, none of a travel, by (g x v) . t with turns t of the body, and by
    -(g x v') . t' with those t' of the body that u is fixed to: of a direction u, v and v' are its rate, of a point
    that less the velocities of the origins of both bodies.
    """
    bodies, g, b, other = model.bodies, rows[k].g, rows[k].body, rows[k].other
    w, V = bodies[b].w, bodies[b].v
    x, y_, z, vx, vy, vz = second_side(y, rows, bodies, k)
    hx, hy, hz = cross(w[0], w[1], w[2], g[0], g[1], g[2])
    if rows[k].kind == TRAVEL:
        own = cross(g[0], g[1], g[2], vx - V[0], vy - V[1], vz - V[2])
        away = (0.0, 0.0, 0.0)
        if rows[k].on == ON_BODY:
            V = bodies[other].v
            away = cross(g[0], g[1], g[2], V[0] - vx, V[1] - vy, V[2] - vz)
        return both_sides(model, rows, k, (x, y_, z), (hx, hy, hz), own, away, J)
    a, e = directions(rows, bodies, k)
    p, q = _parts(a, e, (x, y_, z))
    dx, dy, dz = cross(w[0], w[1], w[2], x, y_, z)
    r = (vx - dx, vy - dy, vz - dz)
    for j in range(3):
        hx += second_derivative(a, e, p, q, 0, j) * r[j]
        hy += second_derivative(a, e, p, q, 1, j) * r[j]
        hz += second_derivative(a, e, p, q, 2, j) * r[j]
    own = cross(g[0], g[1], g[2], vx, vy, vz)
    return both_sides(model, rows, k, (x, y_, z), (hx, hy, hz), own, (-own[0], -own[1], -own[2]), J)


@inlined
def both_sides(model, rows, k, u, h, own, other, J):
    """Write h . s, s what u moves by as seen from its body, with own . t and other . t' of turns of both bodies."""
    bodies, n_q, is_place, b = model.bodies, model.info.nq, rows[k].kind == TRAVEL, rows[k].body
    x = _arm(bodies, b, u, is_place)
    tx, ty, tz = cross(x[0], x[1], x[2], h[0], h[1], h[2])
    turning, back = (own[0] - tx, own[1] - ty, own[2] - tz), (-h[0], -h[1], -h[2])
    at, na = _body_gradient(bodies, n_q, b, back, turning, is_place, J, 0)
    if rows[k].on == ON_BODY:
        x = _arm(bodies, rows[k].other, u, is_place)
        tx, ty, tz = cross(x[0], x[1], x[2], h[0], h[1], h[2])
        turning = (tx + other[0], ty + other[1], tz + other[2])
        bt, nb = _body_gradient(bodies, n_q, rows[k].other, h, turning, is_place, J, 1)
    else:
        bt, nb = rows[k].iv - n_q, 3
        for c in range(3):
            J[1, c] = h[c]
    return at, na, bt, nb


@inlined
def _arm(bodies, b, u, is_place):
    """The direction u, or the place u from the origin of body b."""
    x = bodies[b].x
    return (u[0] - x[0], u[1] - x[1], u[2] - x[2]) if is_place else u


@inlined
def _body_gradient(bodies, n_q, b, f, t, moves, J, row):
    """Write f . (displacement), where it counts, + t . (turn) of body b by its unknowns to a row of J.

    Returns the first of them and their number.
    """
    motion, R, at = bodies[b].motion, bodies[b].R, bodies[b].iv - n_q
    if motion == rigid.DRIVEN:
        return 0, 0
    x = turn_back(R, t[0], t[1], t[2])
    if motion == rigid.SPIN:
        n = bodies[b].axis
        J[row, 0] = n[0] * x[0] + n[1] * x[1] + n[2] * x[2]
        return at, 1
    first = 3 if moves else 0
    for c in range(3):
        if moves:
            J[row, c] = f[c]
        J[row, first + c] = x[c]
    return at + 3 - first, 3 + first


@entry(VECTOR, INTEGERS, family_type("coordinates"), family_type("bodies"), types.int64)
@inlined
def measure_coordinate(y, s, coordinates, bodies, k):
    """Coordinate k of a state and its rate, second side and direction of its force, into its record."""
    measure_between(coordinates, bodies, k, y, 0.0, s[coordinates[k].switch])
