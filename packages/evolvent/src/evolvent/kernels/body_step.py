"""Bodies over a step of energy-momentum, with the thread that they carry: velocities, inertia, and its tangent."""

from __future__ import annotations

from evolvent.algebra import sparse
from evolvent.algebra.sparse import add_block
from evolvent.compiled.jit import inlined
from evolvent.kernels import rigid, rotor
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_turning


@inlined
def move_centres(c, filtered, model, work):
    """Velocities of free bodies that carry thread: what changes by the increments is that of the common centre."""
    n_q, h, y0, y1, bodies = model.info.nq, work.step.h, work.y0, work.y1, model.bodies
    for b in range(bodies.size):
        if bodies[b].motion != rigid.FREE or bodies[b].carried == 0.0:
            continue
        v, p = bodies[b].iv, bodies[b].moment
        x0, x1 = turn(work.R0[b], p[0], p[1], p[2]), turn(work.R1[b], p[0], p[1], p[2])
        ux, uy, uz = cross(y0[v + 3], y0[v + 4], y0[v + 5], p[0], p[1], p[2])
        u0 = turn(work.R0[b], ux, uy, uz)
        ux, uy, uz = cross(y1[v + 3], y1[v + 4], y1[v + 5], p[0], p[1], p[2])
        u1 = turn(work.R1[b], ux, uy, uz)
        for k in range(3):
            start, rate = y0[v + k] + u0[k], (work.dq[v - n_q + k] + x1[k] - x0[k]) / h
            change = c * (rate - start + filtered * work.before[v - n_q + k])
            work.dv[v - n_q + k] = change
            y1[v + k] = start + change - u1[k]


@inlined
def _turned_momentum(b, model, work):
    """R0^T R1 p1 of a free body, and p0: 6 numbers; p = J w with the momenta of its wheels and of carried thread."""
    J, v = model.bodies[b].inertia, model.bodies[b].iv + 3
    w0, w1 = work.y0[v : v + 3], work.y1[v : v + 3]
    g0, g1 = rotor.wheel_momentum(b, work.y0, model), rotor.wheel_momentum(b, work.y1, model)
    if model.threads.size > 0:
        p0, p1 = model.bodies[b].spin0, model.bodies[b].spin1
        g0 = (g0[0] + p0[0], g0[1] + p0[1], g0[2] + p0[2])
        g1 = (g1[0] + p1[0], g1[1] + p1[1], g1[2] + p1[2])
        if model.bodies[b].carried != 0.0:
            J = model.bodies[b].own
    h0 = (
        J[0, 0] * w0[0] + J[0, 1] * w0[1] + J[0, 2] * w0[2] + g0[0],
        J[1, 0] * w0[0] + J[1, 1] * w0[1] + J[1, 2] * w0[2] + g0[1],
        J[2, 0] * w0[0] + J[2, 1] * w0[1] + J[2, 2] * w0[2] + g0[2],
    )
    x, y, z = turn(
        work.R1[b],
        J[0, 0] * w1[0] + J[0, 1] * w1[1] + J[0, 2] * w1[2] + g1[0],
        J[1, 0] * w1[0] + J[1, 1] * w1[1] + J[1, 2] * w1[2] + g1[1],
        J[2, 0] * w1[0] + J[2, 1] * w1[1] + J[2, 2] * w1[2] + g1[2],
    )
    x, y, z = turn_back(work.R0[b], x, y, z)
    return x, y, z, h0[0], h0[1], h0[2]


@inlined
def _carried_inertia(bodies, b):
    """Inertia of thread that moves with a body on a fixed axis, about that axis, kg m2."""
    n, J, found = bodies[b].axis, bodies[b].own, 0.0
    for i in range(3):
        for j in range(3):
            found += n[i] * J[i, j] * n[j]
    return found


@inlined
def add_bodies(model, work):
    """Inertia of bodies less their wrenches; returns the power of what drives bodies, W."""
    n_q, F, bodies, h, power = model.info.nq, model.F, model.bodies, work.step.h, 0.0
    for b in range(bodies.size):
        at, G = bodies[b].iv - n_q, bodies[b].F
        if bodies[b].motion == rigid.DRIVEN:
            if bodies[b].rate != 0.0 or bodies[b].path != 0:
                w, v = bodies[b].w, bodies[b].v
                power -= w[0] * G[3] + w[1] * G[4] + w[2] * G[5] + v[0] * G[0] + v[1] * G[1] + v[2] * G[2]
            continue
        x, y, z = turn_back(work.R0[b], G[3], G[4], G[5])
        if bodies[b].motion == rigid.SPIN:
            n = bodies[b].axis
            F[at] += (bodies[b].spin_inertia + _carried_inertia(bodies, b)) * work.dv[at] / h
            F[at] -= n[0] * x + n[1] * y + n[2] * z
            for c in range(3):
                F[at] += n[c] * (bodies[b].spin1[c] - bodies[b].spin0[c]) / h
            continue
        m, mass = _turned_momentum(b, model, work), bodies[b].mass + bodies[b].carried
        if bodies[b].carried != 0.0:  # what changes is the momentum at the common centre
            p, k = turn(bodies[b].R, bodies[b].moment[0], bodies[b].moment[1], bodies[b].moment[2]), mass / h
            gx, gy, gz = cross(p[0], p[1], p[2], k * work.dv[at], k * work.dv[at + 1], k * work.dv[at + 2])
            gx, gy, gz = turn_back(work.R0[b], gx, gy, gz)
            x, y, z = x - gx, y - gy, z - gz
        torque = bodies[b].torque
        torque[0], torque[1], torque[2] = x, y, z
        for c in range(3):
            F[at + c] += mass * work.dv[at + c] / h - G[c]
            F[at + 3 + c] += (m[c] - m[3 + c]) / h - torque[c]
    return power


@inlined
def add_body_tangents(c_mass, model, work, matrix):
    """Twice the derivatives of the bodies' inertia, and of the axes of torques.

    Forces' tangents have d(R^T t) of a torque t on a free body, whose row is R0^T t: with a turn e this has e x R0^T t
    more, and the row, in which it stands on the left, that less.
    """
    n_q, bodies, K = model.info.nq, model.bodies, model.K12
    for b in range(bodies.size):
        at = bodies[b].iv - n_q
        if bodies[b].motion == rigid.SPIN:
            sparse.add_entry(matrix, at, at, c_mass * (bodies[b].spin_inertia + _carried_inertia(bodies, b)))
        elif bodies[b].motion == rigid.FREE:
            for r in range(6):
                for c in range(6):
                    K[r, c] = 0.0
            m, J, t = _turned_momentum(b, model, work), bodies[b].inertia, bodies[b].torque
            if bodies[b].carried != 0.0:
                J = bodies[b].own
            p = (0.5 * work.dq[at + 3], 0.5 * work.dq[at + 4], 0.5 * work.dq[at + 5])
            s = 1.0 / (1.0 + p[0] * p[0] + p[1] * p[1] + p[2] * p[2])  # a change of 2 p turns by s (1 + p x) of it
            for c in range(3):
                K[c, c] = c_mass * bodies[b].mass
                x, y, z = turn(work.R1[b], J[0, c], J[1, c], J[2, c])
                x, y, z = turn_back(work.R0[b], x, y, z)
                ex, ey, ez = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2)
                ux, uy, uz = cross(p[0], p[1], p[2], ex, ey, ez)
                tx, ty, tz = cross(s * (ex + ux), s * (ey + uy), s * (ez + uz), m[0], m[1], m[2])
                ux, uy, uz = cross(ex, ey, ez, t[0], t[1], t[2])
                K[3, 3 + c] = c_mass * x + 2.0 / work.step.h * tx - ux
                K[4, 3 + c] = c_mass * y + 2.0 / work.step.h * ty - uy
                K[5, 3 + c] = c_mass * z + 2.0 / work.step.h * tz - uz
            if bodies[b].carried != 0.0:
                _couple_centre(c_mass, b, model, K)
                k = (bodies[b].mass + bodies[b].carried) / work.step.h
                add_turning(
                    matrix, model, b, bodies[b].moment, k * work.dv[at], k * work.dv[at + 1], k * work.dv[at + 2]
                )
            add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)


@inlined
def _couple_centre(c_mass, b, model, K):
    """Add what carried thread changes in the inertia of free body b: its mass, at the common centre off the origin."""
    bodies, p = model.bodies, model.bodies[b].moment
    mass, R = c_mass * (bodies[b].mass + bodies[b].carried), bodies[b].R
    square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
    for i in range(3):
        K[i, i] += c_mass * bodies[b].carried
        K[3 + i, 3 + i] += mass * square
        ex, ey, ez = cross(1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2), p[0], p[1], p[2])
        x = turn(R, ex, ey, ez)
        for j in range(3):
            K[3 + i, 3 + j] -= mass * p[i] * p[j]
            K[j, 3 + i] += mass * x[j]
            K[3 + i, j] += mass * x[j]
