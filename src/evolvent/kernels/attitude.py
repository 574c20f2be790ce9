"""Reaction wheels, thrusters, and the controllers that command them.

A wheel is a rotor (`kernels.rotor`) with the rate W relative to its body: Q = u - c W - d tanh(W/slip), u the torque of
its motor. That is limited, and fades out over the last hundredth of the largest rate where it would raise it further.
A thruster pushes its body by a force f >= 0 along a direction fixed to the body.

A controller turns a body to a target attitude. With the rotation vector e of the body relative to the target, and the
difference d of their rates, both in body axes, it wants the torque -(P e + D d), component by component; less a dead
band, and limited. Wheels share it by the pseudo-inverse of their axes. Thrusters, which only push, share each of the
six torques along +- the body's axes by forces found beforehand (`evolvent.parts.attitude_controller`).
"""

import math

import numpy as np
from numba import types, void

from evolvent.jit import REAL, VECTOR, indirect, inlined, spring_law_at
from evolvent.kernels.drive import drive
from evolvent.kernels.profile import profile
from evolvent.kernels.rigid import add_wrench, point_kinematics
from evolvent.kernels.rotations import turn, turn_back
from evolvent.kernels.rotor import acceleration_about, add_reaction, take_inertia
from evolvent.model import H_BODY, KINETIC, MODEL

WHEELS, THRUSTERS = 0, 1
#: Part of the largest rate over which the torque that raises it fades out.
FADE = 0.01


@inlined
def has_actuators(model):
    """Whether a model has wheels or thrusters."""
    return model.wheels.size + model.thrusters.size > 0


@inlined
def quaternion_product(a, b):
    """Quaternion a b, scalar first."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@indirect(void(REAL, VECTOR, MODEL, types.int64))
def find_error(t, y, model, k):
    """Rotation vector `error` (rad) and difference of rates `slip` (rad/s) of controller k, body axes."""
    controllers, bodies = model.controllers, model.bodies
    b = controllers[k].body
    q, v, g = bodies[b].iq + 3, bodies[b].iv + 3, controllers[k].target
    goal, wx, wy, wz = (g[0], g[1], g[2], g[3]), 0.0, 0.0, 0.0
    if controllers[k].path >= 0:
        u = controllers[k].axis
        p = model.parameters[controllers[k].first : controllers[k].last]
        angle, rate, _ = drive(controllers[k].path, p, controllers[k].law, t)
        s = math.sin(0.5 * angle)
        goal = quaternion_product(goal, (math.cos(0.5 * angle), s * u[0], s * u[1], s * u[2]))
        wx, wy, wz = rate * u[0], rate * u[1], rate * u[2]  # in the target's axes
    off = quaternion_product((goal[0], -goal[1], -goal[2], -goal[3]), (y[q], y[q + 1], y[q + 2], y[q + 3]))
    sense = 1.0 if off[0] >= 0.0 else -1.0
    size = math.sqrt(off[1] * off[1] + off[2] * off[2] + off[3] * off[3])
    scale = 2.0 * sense if size < 1e-9 else 2.0 * sense * math.atan2(size, sense * off[0]) / size
    for c in range(3):
        controllers[k].error[c] = scale * off[1 + c]
    # the target's rate in body axes: turned back by `off`
    back = (off[0], -off[1], -off[2], -off[3])
    turned = quaternion_product(quaternion_product(back, (0.0, wx, wy, wz)), off)
    for c in range(3):
        controllers[k].slip[c] = y[v + c] - turned[1 + c]


@inlined
def wanted_torque(controllers, k, c):
    """Component c of the torque that controller k asks for, N m."""
    value = -controllers[k].proportional[c] * controllers[k].error[c]
    value -= controllers[k].derivative[c] * controllers[k].slip[c]
    size = min(max(abs(value) - controllers[k].dead_band, 0.0), controllers[k].limit)
    return size if value > 0.0 else -size


@indirect(void(REAL, VECTOR, MODEL))
def command(t, y, model):
    """Torques of wheels and forces of thrusters that controllers ask for, into their `command`."""
    controllers, wheels, thrusters, p = model.controllers, model.wheels, model.thrusters, model.parameters
    for i in range(wheels.size):
        wheels[i].command = 0.0
    for i in range(thrusters.size):
        thrusters[i].command = 0.0
    for k in range(controllers.size):
        find_error(t, y, model, k)
        T = controllers[k].torque
        for c in range(3):
            T[c] = wanted_torque(controllers, k, c)
        count, at = controllers[k].count, controllers[k].place
        shares = at + count
        for i in range(count):
            target = int(p[at + i])
            if controllers[k].actuators == WHEELS:
                for c in range(3):
                    wheels[target].command += p[shares + 3 * i + c] * T[c]
            else:
                for c in range(3):
                    side = 0 if T[c] >= 0.0 else 3
                    thrusters[target].command += p[shares + 6 * i + side + c] * abs(T[c])


@inlined
def motor_torque(t, y, model, i):
    """Torque of the motor of wheel i, limited, N m."""
    wheels = model.wheels
    rate = y[wheels[i].iv]
    u = wheels[i].torque + wheels[i].command
    if wheels[i].profile >= 0:
        u += profile(t, wheels[i].profile, model)
    if wheels[i].law != 0:
        p = model.parameters[wheels[i].first : wheels[i].last]
        u += spring_law_at(wheels[i].law)(y[wheels[i].iq], rate, t, p)
    u = min(max(u, -wheels[i].torque_limit), wheels[i].torque_limit)
    if u * rate > 0.0 and wheels[i].rate_limit < math.inf:
        left = (wheels[i].rate_limit - abs(rate)) / (FADE * wheels[i].rate_limit)
        u *= min(max(left, 0.0), 1.0)
    return u


@indirect(types.UniTuple(REAL, 3)(REAL, VECTOR, MODEL))
def add_actuators(t, y, model):
    """Wheels and thrusters onto their bodies.

    Returns
    -------
    lost, given, driven : float, W, powers that friction of wheels takes, and that thrusters and motors give
    """
    wheels, thrusters, bodies = model.wheels, model.thrusters, model.bodies
    lost = given = driven = 0.0
    command(t, y, model)
    for i in range(wheels.size):
        b, S, rate = wheels[i].body, wheels[i].inertia, y[wheels[i].iv]
        u = wheels[i].motor = motor_torque(t, y, model, i)
        drag = wheels[i].viscous * rate
        if wheels[i].friction > 0.0:
            drag += wheels[i].friction * math.tanh(rate / wheels[i].slip)
        wheels[i].drag = drag
        n = wheels[i].axis
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        take_inertia(bodies, b, S, nx, ny, nz)
        add_reaction(bodies, b, u - drag, S * rate, nx, ny, nz)
        lost += drag * rate
        driven += u * rate
    for i in range(thrusters.size):
        b, x, e = thrusters[i].body, thrusters[i].local, thrusters[i].direction
        f = thrusters[i].force + thrusters[i].command
        if thrusters[i].profile >= 0:
            f += profile(t, thrusters[i].profile, model)
        f = thrusters[i].push = min(max(f, 0.0), thrusters[i].limit)
        dx, dy, dz, vx, vy, vz = point_kinematics(bodies, b, x[0], x[1], x[2])
        fx, fy, fz = turn(bodies[b].R, f * e[0], f * e[1], f * e[2])
        add_wrench(bodies[b].F, dx, dy, dz, fx, fy, fz)
        given += fx * vx + fy * vy + fz * vz
    return lost, given, driven


@inlined
def actuator_rates(y, model, dy):
    """Rates of wheels, their bodies' a known, and of the impulses of thrusters."""
    wheels, thrusters, bodies = model.wheels, model.thrusters, model.bodies
    for i in range(wheels.size):
        b, n = wheels[i].body, wheels[i].axis
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        dy[wheels[i].iq] = y[wheels[i].iv]
        torque = wheels[i].motor - wheels[i].drag
        dy[wheels[i].iv] = torque / wheels[i].inertia - acceleration_about(bodies, b, nx, ny, nz)
    for i in range(thrusters.size):
        dy[thrusters[i].iv] = thrusters[i].push


@inlined
def add_wheel_inventory(y, model, out):
    """Kinetic energy and angular momentum of all wheels, beyond what their bodies' inertia has, to an inventory."""
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, S, n, rate = wheels[i].body, wheels[i].inertia, wheels[i].axis, y[wheels[i].iv]
        wx, wy, wz = turn_back(bodies[b].R, bodies[b].w[0], bodies[b].w[1], bodies[b].w[2])
        out[KINETIC] += S * rate * (0.5 * rate + n[0] * wx + n[1] * wy + n[2] * wz)
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        out[H_BODY] += S * rate * nx
        out[H_BODY + 1] += S * rate * ny
        out[H_BODY + 2] += S * rate * nz


def add_actuator_bound(model, body):
    """Add the gains of controllers, and friction of wheels, to what bodies feel. Not compiled.

    Parameters
    ----------
    body : (2, nb, 6, 6) float, stiffness and damping felt by bodies
    """
    for row in model.controllers:
        b = int(row["body"])
        R = np.array(model.bodies["R"][b])
        for what, gains in enumerate((row["proportional"], row["derivative"])):
            body[what, b, 3:, 3:] += R @ np.diag(gains) @ R.T


def wheel_bounds(model):
    """(0, damping rate in 1/s) of every wheel; a rotor on a light body counts with the body's share. Not compiled."""
    found = []
    for row in model.wheels:
        slope = row["viscous"] + (row["friction"] / row["slip"] if row["friction"] > 0.0 else 0.0)
        n, b = np.array(row["axis"]), int(row["body"])
        J = np.array(model.bodies["inertia"][b])
        left = 1.0 / float(n @ np.linalg.solve(J, n)) - row["inertia"] if np.linalg.det(J) > 0.0 else row["inertia"]
        found.append((0.0, float(slope * (1.0 / row["inertia"] + 1.0 / left))))
    return found
