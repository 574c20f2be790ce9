"""Derivatives of the torques of wheels and controlled thrusters."""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block, add_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.families.attitude.attitude import FADE, WHEELS, linear_torque, wanted_by_motor
from evolvent.kernels.fields import ORBIT
from evolvent.kernels.law_means import SPRING, scalar_slope
from evolvent.kernels.law_slopes import spring_law_slope
from evolvent.kernels.rigid import FREE
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import turn_axis
from evolvent.model import MODEL

USED_FOR = ("wheels", "thrusters", "controllers")


@inlined
def add_frame_tangents(y, c_rate, model, matrix):
    """Derivatives of `add_frame_torques` by the turn of bodies, and c_rate times by velocities, as residuals.

    The torque s f x n, f = R^T w0, changes with a turn d by s (f x d) x n in the body's axes; that on the wheel,
    S f . (n x w), by S (f x d) . (n x w).
    """
    wheels, bodies, fields, n_q = model.wheels, model.bodies, model.fields, model.info.nq
    for i in range(wheels.size):
        b, n, at = wheels[i].body, wheels[i].axis, wheels[i].iv - n_q
        for k in range(fields.size):
            if fields[k].kind != ORBIT:
                continue
            f = turn_back(bodies[b].R, fields[k].w[0], fields[k].w[1], fields[k].w[2])
            g, S = cross(f[0], f[1], f[2], n[0], n[1], n[2]), fields[k].scale * wheels[i].inertia
            h, kind, first = S * y[wheels[i].iv], bodies[b].motion, bodies[b].iv - n_q
            w = turn_back(bodies[b].R, bodies[b].w[0], bodies[b].w[1], bodies[b].w[2])
            e = cross(n[0], n[1], n[2], w[0], w[1], w[2])
            columns = range(3, 6) if kind == FREE else range(1)
            for c in columns:
                d = turn_axis(bodies, b, kind, c)
                along = c_rate * S * (g[0] * d[0] + g[1] * d[1] + g[2] * d[2])
                u = cross(f[0], f[1], f[2], d[0], d[1], d[2])
                turned = S * (u[0] * e[0] + u[1] * e[1] + u[2] * e[2])
                add_entry(matrix, first + c, at, along)
                add_entry(matrix, at, first + c, -along - turned)
                u = cross(u[0], u[1], u[2], n[0], n[1], n[2])
                for r in columns:
                    d = turn_axis(bodies, b, kind, r)
                    add_entry(matrix, first + r, first + c, h * (u[0] * d[0] + u[1] * d[1] + u[2] * d[2]))


@inlined
def limited_slopes(u, rate, wheels, i):
    """Derivatives of `limited_torque` by u and by the rate."""
    value = min(max(u, -wheels[i].torque_limit), wheels[i].torque_limit)
    by_torque, by_rate = 1.0 if value == u else 0.0, 0.0
    if value * rate > 0.0 and wheels[i].rate_limit < math.inf:
        left = (wheels[i].rate_limit - abs(rate)) / (FADE * wheels[i].rate_limit)
        by_torque *= min(max(left, 0.0), 1.0)
        if 0.0 < left < 1.0:
            by_rate = -abs(value) / (FADE * wheels[i].rate_limit)
    return by_torque, by_rate


@inlined
def drag_slope(wheels, i, rate):
    """Derivative of `drag_torque` by the rate."""
    slope = wheels[i].viscous
    if wheels[i].friction > 0.0:
        part = math.tanh(rate / wheels[i].slip)
        slope += wheels[i].friction / wheels[i].slip * (1.0 - part * part)
    return slope


@inlined
def motor_slopes(t, y, model, i):
    """Derivatives of the motor's torque of wheel i by what it is asked for, and by its rate."""
    wheels = model.wheels
    rate = y[wheels[i].iv]
    return limited_slopes(wanted_by_motor(t, y[wheels[i].iq], rate, model, i), rate, wheels, i)


@inlined
def error_gradient(e, G):
    """Derivative G : (3, 3) of a rotation vector e by a further turn, body axes: 1 + ex/2 + c ex ex."""
    square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    half = 0.5 * math.sqrt(square)
    c = 1.0 / 12.0 if half < 1e-3 else (1.0 - half / math.tan(half)) / square
    for j in range(3):
        u = cross(e[0], e[1], e[2], 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
        v = cross(e[0], e[1], e[2], u[0], u[1], u[2])
        for i in range(3):
            G[i, j] = 1.0 * (i == j) + 0.5 * u[i] + c * v[i]


@indirect(void(REAL, VECTOR, types.int64, REAL, MODEL, SPARSE))
def add_controller_tangent(t, y, k, c_rate, model, matrix):
    """Add what the command of controller k changes with the body's attitude, and c_rate times with its rate.

    In body axes the rate p of a path changes by p x d with a turn d of the body.
    """
    controllers, wheels, thrusters, bodies = model.controllers, model.wheels, model.thrusters, model.bodies
    n_q, p, G, K, T = model.info.nq, model.parameters, model.scratch, model.K12, controllers[k].torque
    b = controllers[k].body
    row = bodies[b].iv - n_q
    error_gradient(controllers[k].error, G)
    w, slip = bodies[b].iv + 3, controllers[k].slip
    path = (y[w] - slip[0], y[w + 1] - slip[1], y[w + 2] - slip[2])
    for i in range(3):
        size = abs(linear_torque(controllers, k, i)) - controllers[k].dead_band
        inside = 1.0 if 0.0 <= size <= controllers[k].limit else 0.0
        P, D = inside * controllers[k].proportional[i], inside * controllers[k].derivative[i]
        for j in range(3):
            turned = cross(1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2), path[0], path[1], path[2])
            G[i, j] = -P * G[i, j] - D * (turned[i] + (c_rate if i == j else 0.0))
    count, at = controllers[k].count, controllers[k].place
    shares = at + count
    for a in range(count):
        i = int(p[at + a])
        if controllers[k].actuators == WHEELS:
            slope, _ = motor_slopes(t, y, model, i)
            for j in range(3):
                value = 0.0
                for c in range(3):
                    value += p[shares + 3 * a + c] * G[c, j]
                add_entry(matrix, wheels[i].iv - n_q, row + 3 + j, -slope * value)
        elif 0.0 < thrusters[i].push < thrusters[i].limit:
            x, e = thrusters[i].local, thrusters[i].direction
            m = cross(x[0], x[1], x[2], e[0], e[1], e[2])
            f = turn(bodies[b].R, e[0], e[1], e[2])
            for j in range(3):
                value = 0.0
                for c in range(3):
                    if T[c] >= 0.0:
                        value += p[shares + 6 * a + c] * G[c, j]
                    else:
                        value -= p[shares + 6 * a + 3 + c] * G[c, j]
                for c in range(3):
                    K[c, j], K[3 + c, j] = f[c] * value, m[c] * value
            add_block(matrix, row, row + 3, K, 0, 0, 6, 3, -1.0)


@inlined
def _add_thrust_tangent(i, model, matrix):
    """Add how the force of thruster i turns with its free body."""
    K, f, d, b = model.K12, model.thrusters[i].push, model.thrusters[i].direction, model.thrusters[i].body
    for c in range(3):
        u = cross(1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2), d[0], d[1], d[2])
        K[0, c], K[1, c], K[2, c] = turn(model.bodies[b].R, -f * u[0], -f * u[1], -f * u[2])
    row = model.bodies[b].iv - model.info.nq
    add_block(matrix, row, row + 3, K, 0, 0, 3, 3, 1.0)


@indirect(void(REAL, VECTOR, REAL, MODEL, SPARSE))
def add_actuator_tangents(t, y, c_rate, model, matrix):
    """Add what torques on wheels and thrusters change with position, and c_rate times with velocity.

    After `actuator_forces` of the same state only.
    """
    wheels, n_q = model.wheels, model.info.nq
    for i in range(wheels.size):
        angle, rate = y[wheels[i].iq], y[wheels[i].iv]
        by_torque, by_rate = motor_slopes(t, y, model, i)
        slope = c_rate * (drag_slope(wheels, i, rate) - by_rate)
        if wheels[i].law != 0:
            p = model.parameters[wheels[i].first : wheels[i].last]
            if model.info.over == 0.0:
                own = spring_law_slope(wheels[i].law, angle, 1.0, rate, c_rate, t, p, 1.0)
            else:
                own = scalar_slope(
                    SPRING, wheels[i].law, angle, 1.0, rate, c_rate, t, model.info.over, p, 0.0, math.inf, 1.0, model
                )
            slope -= by_torque * own
        add_entry(matrix, wheels[i].iv - n_q, wheels[i].iv - n_q, slope)
    for i in range(model.thrusters.size):
        if model.thrusters[i].push > 0.0 and model.bodies[model.thrusters[i].body].motion == FREE:
            _add_thrust_tangent(i, model, matrix)
    for k in range(model.controllers.size):
        add_controller_tangent(t, y, k, c_rate, model, matrix)
    add_frame_tangents(y, c_rate, model, matrix)
