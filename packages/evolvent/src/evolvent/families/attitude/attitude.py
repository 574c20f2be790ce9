"""Reaction wheels, thrusters, and the controllers that command them.

A wheel is a rotor (`kernels.rotor`) with the rate W relative to its body: Q = u - c W - d tanh(W/slip), u the torque of
its motor. That is limited, and fades out over the last hundredth of the largest rate where it would raise it further.
A thruster pushes its body by a force f >= 0 along a direction fixed to the body.

With n in body axes, S the wheel's moment of inertia and J the body's, which contains it, implicit methods solve

    J w' + S W' n + w x (J w + S W n) = T,     S (W' + n . w') = Q,

the first for body and wheel together, on which the motor's torque does not act. Over an energy-momentum step they are
(R0^T R1 p1 - p0)/h = T, p = J w + S W n, and S (dW + n . dw)/h = Q with the mean of W in Q: the sum of both times the
increments is the change of the kinetic energy (w . J w + 2 S W n . w + S W^2)/2.

A controller turns a body to a target attitude. With the rotation vector e of the body relative to the target, and the
difference d of their rates, both in body axes, it wants the torque -(P e + D d), component by component; less a dead
band, and limited. Wheels share it by the pseudo-inverse of their axes. Thrusters, which only push, share each of the
six torques along +- the body's axes by forces found beforehand (`part`).
"""

import math

from numba import types, void

from evolvent.algebra.sparse import add_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.compiled.lookups import spring_law_at
from evolvent.kernels.drive import drive
from evolvent.kernels.fields import ORBIT
from evolvent.kernels.law_means import SPRING, scalar_mean
from evolvent.kernels.profile import profile
from evolvent.kernels.rigid import FREE, add_wrench, point_kinematics
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.rotor import acceleration_about, add_reaction, take_inertia
from evolvent.model import MODEL

USED_FOR = ("wheels", "thrusters", "controllers")
WHEELS, THRUSTERS = 0, 1
#: Part of the largest rate over which the torque that raises it fades out.
FADE = 0.01


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
    # the target's rate in body axes: turned back by `off`, whose norm differs from 1 at the mean of two states
    back, square = (off[0], -off[1], -off[2], -off[3]), off[0] * off[0] + size * size
    turned = quaternion_product(quaternion_product(back, (0.0, wx, wy, wz)), off)
    for c in range(3):
        controllers[k].slip[c] = y[v + c] - turned[1 + c] / square


@inlined
def linear_torque(controllers, k, c):
    """Component c of -(P e + D d) of controller k, N m."""
    return -(
        controllers[k].proportional[c] * controllers[k].error[c] + controllers[k].derivative[c] * controllers[k].slip[c]
    )


@inlined
def wanted_torque(controllers, k, c):
    """Component c of the torque that controller k asks for, N m."""
    value = linear_torque(controllers, k, c)
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
def wanted_by_motor(t, angle, rate, model, i):
    """Torque that the motor of wheel i is asked for at an angle and rate relative to its body, N m."""
    wheels = model.wheels
    u = wheels[i].torque + wheels[i].command
    if wheels[i].profile >= 0:
        u += profile(t, wheels[i].profile, model)
    if wheels[i].law != 0:
        p = model.parameters[wheels[i].first : wheels[i].last]
        if model.info.over == 0.0:
            u += spring_law_at(wheels[i].law)(angle, rate, t, p)
        else:
            u = scalar_mean(SPRING, wheels[i].law, angle, rate, t, model.info.over, p, u, wheels[i].torque_limit, model)
    return u


@inlined
def limited_torque(u, rate, wheels, i):
    """What the motor of wheel i gives of a torque u that it is asked for, N m."""
    u = min(max(u, -wheels[i].torque_limit), wheels[i].torque_limit)
    if u * rate > 0.0 and wheels[i].rate_limit < math.inf:
        left = (wheels[i].rate_limit - abs(rate)) / (FADE * wheels[i].rate_limit)
        u *= min(max(left, 0.0), 1.0)
    return u


@inlined
def motor_torque(t, angle, rate, model, i):
    """Torque of the motor of wheel i at an angle and rate relative to its body, limited, N m."""
    return limited_torque(wanted_by_motor(t, angle, rate, model, i), rate, model.wheels, i)


@inlined
def drag_torque(wheels, i, rate):
    """Torque of friction against the rate of wheel i, N m."""
    drag = wheels[i].viscous * rate
    if wheels[i].friction > 0.0:
        drag += wheels[i].friction * math.tanh(rate / wheels[i].slip)
    return drag


@inlined
def torque_on(wheels, i):
    """Torque on wheel i about its axis, after `actuator_forces`, N m."""
    return wheels[i].motor - wheels[i].drag + wheels[i].coriolis


@inlined
def add_frame_torques(y, model):
    """Coriolis moments of orbital frames on the spin of wheels: -w0 x h on the body, S n . (w x w0) on the wheel.

    The fields' points (`kernels.fields`) turn with the body and have no such part. Both together do no work.
    """
    wheels, bodies, fields = model.wheels, model.bodies, model.fields
    for i in range(wheels.size):
        b, n = wheels[i].body, wheels[i].axis
        w, F, h = bodies[b].w, bodies[b].F, wheels[i].inertia * y[wheels[i].iv]
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        wheels[i].coriolis = 0.0
        for k in range(fields.size):
            if fields[k].kind == ORBIT:
                frame, scale = fields[k].w, fields[k].scale
                gx, gy, gz = cross(frame[0], frame[1], frame[2], nx, ny, nz)
                F[3] -= scale * h * gx
                F[4] -= scale * h * gy
                F[5] -= scale * h * gz
                wheels[i].coriolis += scale * wheels[i].inertia * (gx * w[0] + gy * w[1] + gz * w[2])


@indirect(types.UniTuple(REAL, 3)(REAL, VECTOR, MODEL))
def actuator_forces(t, y, model):
    """Torques on wheels into `motor` and `drag`; forces of thrusters onto their bodies.

    Returns
    -------
    lost, given, driven : float, W, powers that friction of wheels takes, and that thrusters and motors give
    """
    wheels, thrusters, bodies = model.wheels, model.thrusters, model.bodies
    lost = given = driven = 0.0
    command(t, y, model)
    for i in range(wheels.size):
        rate = y[wheels[i].iv]
        wheels[i].motor = motor_torque(t, y[wheels[i].iq], rate, model, i)
        wheels[i].drag = drag_torque(wheels, i, rate)
        lost += wheels[i].drag * rate
        driven += wheels[i].motor * rate
    add_frame_torques(y, model)
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


@indirect(void(REAL, VECTOR, MODEL))
def evaluate_actuators(t, y, model):
    """Evaluate wheels, thrusters and controllers in a state, after `kinematics`, into their records.

    Momentum and energy of a wheel are those beyond what the body's inertia has of it.
    """
    wheels, thrusters, controllers, bodies = model.wheels, model.thrusters, model.controllers, model.bodies
    actuator_forces(t, y, model)
    for i in range(wheels.size):
        row, b, n, w, h = wheels[i], wheels[i].body, wheels[i].axis, bodies[wheels[i].body].w, wheels[i].momentum
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        row.angle, row.rate, row.rubs, row.spin = y[row.iq], y[row.iv], -row.drag, row.inertia * y[row.iv]
        h[0], h[1], h[2] = row.spin * nx, row.spin * ny, row.spin * nz
        row.kinetic = row.spin * (0.5 * row.rate + nx * w[0] + ny * w[1] + nz * w[2])
    for i in range(thrusters.size):
        row, x, e, f = thrusters[i], thrusters[i].local, thrusters[i].direction, thrusters[i].push
        place, acts, R, at = row.place, row.vector, bodies[row.body].R, bodies[row.body].x
        dx, dy, dz = turn(R, x[0], x[1], x[2])
        place[0], place[1], place[2] = at[0] + dx, at[1] + dy, at[2] + dz
        acts[0], acts[1], acts[2] = turn(R, f * e[0], f * e[1], f * e[2])
        row.impulse = y[row.iv]
    for k in range(controllers.size):
        e = controllers[k].error
        controllers[k].off = math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])


# ---------------------------------------------------------------------------------------------- explicit methods


@inlined
def add_wheels(y, model):
    """Reactions of wheels on their bodies, whose inertia about the axes is left to the wheels' own equations."""
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, S, n = wheels[i].body, wheels[i].inertia, wheels[i].axis
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        take_inertia(bodies, b, S, nx, ny, nz)
        add_reaction(bodies, b, torque_on(wheels, i), S * y[wheels[i].iv], nx, ny, nz)


@inlined
def actuator_rates(y, model, dy):
    """Rates of wheels, their bodies' a known, and of the impulses of thrusters."""
    wheels, thrusters, bodies = model.wheels, model.thrusters, model.bodies
    for i in range(wheels.size):
        b, n = wheels[i].body, wheels[i].axis
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        dy[wheels[i].iq] = y[wheels[i].iv]
        dy[wheels[i].iv] = torque_on(wheels, i) / wheels[i].inertia - acceleration_about(bodies, b, nx, ny, nz)
    for i in range(thrusters.size):
        dy[thrusters[i].iv] = thrusters[i].push


# ---------------------------------------------------------------------------------------------- implicit methods


@inlined
def axis_on(bodies, b, n):
    """Component of a wheel's axis n, body axes, along the axis of a spinning body."""
    a = bodies[b].axis
    return n[0] * a[0] + n[1] * a[1] + n[2] * a[2]


@inlined
def note_reactions(y, model):
    """Add the torques of wheels on their bodies to the wrenches, when the bodies' equations have been written."""
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, n = wheels[i].body, wheels[i].axis
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        add_reaction(bodies, b, torque_on(wheels, i), wheels[i].inertia * y[wheels[i].iv], nx, ny, nz)


@inlined
def add_wheel_residual(y, a, n_q, model, F):
    """Inertia of wheels less their torques, in the rows of wheels and bodies; a : (nv,) float, accelerations.

    Impulses of thrusters are unknowns without force; `end_actuator_step` adds to them.
    """
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, S, n, at = wheels[i].body, wheels[i].inertia, wheels[i].axis, wheels[i].iv - n_q
        own, h = S * a[at], S * y[wheels[i].iv]
        row = bodies[b].iv - n_q
        F[at] += own - torque_on(wheels, i)
        if bodies[b].motion == FREE:
            w = bodies[b].iv + 3
            gx, gy, gz = cross(y[w], y[w + 1], y[w + 2], n[0], n[1], n[2])
            F[row + 3] += own * n[0] + h * gx
            F[row + 4] += own * n[1] + h * gy
            F[row + 5] += own * n[2] + h * gz
            for c in range(3):
                F[at] += S * n[c] * a[row + 3 + c]
        else:
            along = axis_on(bodies, b, n)
            F[row] += own * along
            F[at] += S * along * a[row]
    note_reactions(y, model)
    for i in range(model.thrusters.size):
        F[model.thrusters[i].iv - n_q] += a[model.thrusters[i].iv - n_q]


@inlined
def add_inertia_of_wheels(c_mass, n_q, model, matrix):
    """c_mass times the inertia of wheels, and the unit one of thrusters' impulses, but for wheels' part in bodies."""
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, n, at = wheels[i].body, wheels[i].axis, wheels[i].iv - n_q
        S, row = c_mass * wheels[i].inertia, bodies[b].iv - n_q
        add_entry(matrix, at, at, S)
        if bodies[b].motion == FREE:
            for c in range(3):
                add_entry(matrix, at, row + 3 + c, S * n[c])
        else:
            along = axis_on(bodies, b, n)
            add_entry(matrix, at, row, S * along)
            add_entry(matrix, row, at, S * along)
    for i in range(model.thrusters.size):  # without masses, in statics, an impulse is held
        at = model.thrusters[i].iv - n_q
        add_entry(matrix, at, at, c_mass if c_mass != 0.0 else 1.0)


@inlined
def add_wheel_tangent(y, c_mass, c_rate, n_q, model, matrix):
    """c_mass times the inertia of wheels, and c_rate times the derivative of their gyroscopic torques."""
    add_inertia_of_wheels(c_mass, n_q, model, matrix)
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, n, at, S = wheels[i].body, wheels[i].axis, wheels[i].iv - n_q, wheels[i].inertia
        if bodies[b].motion != FREE:
            continue
        w, row = bodies[b].iv + 3, bodies[b].iv + 3 - n_q
        g = cross(y[w], y[w + 1], y[w + 2], n[0], n[1], n[2])
        h = c_rate * S * y[wheels[i].iv]
        for c in range(3):
            add_entry(matrix, row + c, at, S * (c_mass * n[c] + c_rate * g[c]))
            u = cross(1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2), n[0], n[1], n[2])
            for d in range(3):
                add_entry(matrix, row + d, row + c, h * u[d])


@inlined
def end_actuator_step(h, share, dq, y, model):
    """Accept a step of length h and increments dq : (nv,): impulses of thrusters into y.

    Parameters
    ----------
    share : 0.5 where the last forces are those of the step's end, 1 where they are means over it

    Returns
    -------
    lost, driven : float, J, work of friction in wheels and of motors: their mean torques times the angles turned
    """
    wheels, thrusters, lost, driven = model.wheels, model.thrusters, 0.0, 0.0
    for i in range(wheels.size):
        turned = dq[wheels[i].iv - model.info.nq]
        lost += (share * wheels[i].drag + (1.0 - share) * wheels[i].drag0) * turned
        driven += (share * wheels[i].motor + (1.0 - share) * wheels[i].motor0) * turned
        wheels[i].drag0, wheels[i].motor0 = wheels[i].drag, wheels[i].motor
    for i in range(thrusters.size):
        y[thrusters[i].iv] += h * (share * thrusters[i].push + (1.0 - share) * thrusters[i].push0)
        thrusters[i].push0 = thrusters[i].push
    return lost, driven


# ---------------------------------------------------------------------------------------------- energy-momentum


@inlined
def add_wheel_step(h, dv, ym, n_q, model, F):
    """Rows of wheels over a step with changes dv of the velocities, and their part in those of spinning bodies."""
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, S, n, at = wheels[i].body, wheels[i].inertia / h, wheels[i].axis, wheels[i].iv - n_q
        row = bodies[b].iv - n_q
        F[at] += S * dv[at] - torque_on(wheels, i)
        if bodies[b].motion == FREE:
            for c in range(3):
                F[at] += S * n[c] * dv[row + 3 + c]
        else:
            along = axis_on(bodies, b, n)
            F[row] += S * along * dv[at]
            F[at] += S * along * dv[row]
    note_reactions(ym, model)
    for i in range(model.thrusters.size):
        F[model.thrusters[i].iv - n_q] += dv[model.thrusters[i].iv - n_q] / h


@inlined
def add_wheel_step_tangent(c_mass, n_q, R0, R1, model, matrix):
    """Twice the derivatives of the inertia of wheels by the increments."""
    add_inertia_of_wheels(c_mass, n_q, model, matrix)
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, n, at = wheels[i].body, wheels[i].axis, wheels[i].iv - n_q
        if bodies[b].motion == FREE:
            S, row = c_mass * wheels[i].inertia, bodies[b].iv + 3 - n_q
            x, y, z = turn(R1[b], n[0], n[1], n[2])
            x, y, z = turn_back(R0[b], x, y, z)
            add_entry(matrix, row, at, S * x)
            add_entry(matrix, row + 1, at, S * y)
            add_entry(matrix, row + 2, at, S * z)


# ---------------------------------------------------------------------------------------------- tangents


# ---------------------------------------------------------------------------------------------- energy, momentum, bound


@inlined
def add_wheel_energy(y, model, out, at):
    """Add the kinetic energy of all wheels, beyond what their bodies' inertia has, to out[at], J."""
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        b, S, n, rate = wheels[i].body, wheels[i].inertia, wheels[i].axis, y[wheels[i].iv]
        v = bodies[b].iv
        if bodies[b].motion == FREE:
            along = n[0] * y[v + 3] + n[1] * y[v + 4] + n[2] * y[v + 5]
        else:
            along = axis_on(bodies, b, n) * y[v]
        out[at] += S * rate * (0.5 * rate + along)


@inlined
def add_wheel_momenta(y, model, H):
    """Add the angular momentum of all wheels relative to their bodies to H; attitudes of the last `kinematics`."""
    wheels, bodies = model.wheels, model.bodies
    for i in range(wheels.size):
        h, n = wheels[i].inertia * y[wheels[i].iv], wheels[i].axis
        nx, ny, nz = turn(bodies[wheels[i].body].R, n[0], n[1], n[2])
        H[0] += h * nx
        H[1] += h * ny
        H[2] += h * nz
