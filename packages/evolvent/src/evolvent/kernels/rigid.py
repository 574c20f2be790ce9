"""Rigid bodies: driven about an axis, spinning about a fixed axis, or free in six degrees of freedom.

A body's wrench and twist are taken at its origin, which is its centre of mass, in inertial axes: (force, torque),
(acceleration, angular acceleration). Wound thread adds to its 6 x 6 mass.
"""

import math

import numpy as np
from numba import types, void

from evolvent.algebra.linalg import cholesky, cholesky_solve
from evolvent.algebra.sparse import add_block, add_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels.calls import kinematics_at
from evolvent.kernels.drive import drive
from evolvent.kernels.points import add_angular_momentum
from evolvent.kernels.rotations import (
    cross,
    quaternion_rate,
    rotation_about_axis,
    rotation_from_quaternion,
    turn,
    turn_back,
)
from evolvent.model import MODEL, having, nonzero

DRIVEN, SPIN, FREE = 0, 1, 2


@indirect(void(REAL, VECTOR, MODEL))
def kinematics(t, y, model):
    """Orientation, position and velocities (R, x, v, w, inertial axes) of every body; wrenches and masses reset.

    Before that, families update what changes masses in their records (`State.kinematics`).
    """
    family_kinematics(t, y, model)
    for b in range(model.bodies.size):
        body_kinematics(t, y, b, model)


@inlined
def family_kinematics(t, y, model):
    """Let families update their records from the state (`State.kinematics`)."""
    calls = model.state_kinematics_calls
    for k in range(calls.size):
        kinematics_at(model, calls[k])(t, y, model)


@inlined
def body_kinematics(t, y, b, model):
    """Pose and velocities of body b from the state, as of `kinematics`; F is set to its gyroscopic torque."""
    bodies = model.bodies
    q, v, R = bodies[b].iq, bodies[b].iv, bodies[b].R
    for i in range(6):
        bodies[b].F[i] = 0.0
    if bodies[b].motion == FREE:
        rotation_from_quaternion(y[q + 3], y[q + 4], y[q + 5], y[q + 6], R)
        for i in range(3):
            bodies[b].x[i] = y[q + i]
            bodies[b].v[i] = y[v + i]
        bodies[b].w[0], bodies[b].w[1], bodies[b].w[2] = turn(R, y[v + 3], y[v + 4], y[v + 5])
        bodies[b].has_mass_matrix = 0
        add_gyroscopic_torque(bodies[b].inertia, R, y[v + 3], y[v + 4], y[v + 5], bodies[b].F)
        return
    axis = bodies[b].axis
    if bodies[b].motion == SPIN:
        angle, rate = y[q], y[v]
        bodies[b].J = bodies[b].spin_inertia
    else:
        rate = bodies[b].rate
        angle = rate * t
        if bodies[b].path != 0:
            move_along(t, b, model)
        if rate == 0.0:  # stands as it was assembled
            return
    rotation_about_axis(axis, angle, bodies[b].R0, R)
    if bodies[b].path == 0:
        for i in range(3):
            bodies[b].x[i] = bodies[b].x0[i]
            bodies[b].v[i] = 0.0
    bodies[b].w[0], bodies[b].w[1], bodies[b].w[2] = turn(R, rate * axis[0], rate * axis[1], rate * axis[2])


@indirect(void(REAL, types.int64, MODEL), used_for=having("bodies", path=nonzero))
def move_along(t, b, model):
    """Position, velocity and acceleration of a driven body b that a drive moves along a line."""
    bodies = model.bodies
    p = model.parameters[bodies[b].path_first : bodies[b].path_last]
    value, rate, acceleration = drive(bodies[b].path - 1, p, bodies[b].path_law, t)
    for i in range(3):
        bodies[b].x[i] = bodies[b].x0[i] + value * bodies[b].direction[i]
        bodies[b].v[i] = rate * bodies[b].direction[i]
    bodies[b].along = acceleration


@inlined
def add_gyroscopic_torque(inertia, R, x, y, z, F):
    """Add the gyroscopic torque -w x I w to F[3:], inertial axes; (x, y, z) : w, rad/s, body axes."""
    gx, gy, gz = cross(
        x, y, z,
        inertia[0, 0] * x + inertia[0, 1] * y + inertia[0, 2] * z,
        inertia[1, 0] * x + inertia[1, 1] * y + inertia[1, 2] * z,
        inertia[2, 0] * x + inertia[2, 1] * y + inertia[2, 2] * z,
    )  # fmt: skip
    gx, gy, gz = turn(R, gx, gy, gz)
    F[3] -= gx
    F[4] -= gy
    F[5] -= gz


@kernel
def assemble_mass_matrix(bodies, b):
    """Write the 6 x 6 mass matrix of a free body b, inertial axes, to its M; attached masses can then be added to M."""
    if bodies[b].motion != FREE or bodies[b].has_mass_matrix != 0:
        return
    M, R, inertia = bodies[b].M, bodies[b].R, bodies[b].inertia
    bodies[b].has_mass_matrix = 1
    for i in range(6):
        for j in range(6):
            M[i, j] = 0.0
    for i in range(3):
        M[i, i] = bodies[b].mass
        for j in range(3):
            s = 0.0
            for k in range(3):
                for n in range(3):
                    s += R[i, k] * inertia[k, n] * R[j, n]
            M[3 + i, 3 + j] = s


@inlined
def point_kinematics(bodies, b, sx, sy, sz):
    """Arm, and velocity of a body's point given in body axes: (dx, dy, dz, vx, vy, vz), inertial axes."""
    dx, dy, dz = turn(bodies[b].R, sx, sy, sz)
    vx, vy, vz = cross(bodies[b].w[0], bodies[b].w[1], bodies[b].w[2], dx, dy, dz)
    return dx, dy, dz, bodies[b].v[0] + vx, bodies[b].v[1] + vy, bodies[b].v[2] + vz


@inlined
def centripetal(bodies, b, dx, dy, dz):
    """omega x (omega x d)."""
    ax, ay, az = cross(bodies[b].w[0], bodies[b].w[1], bodies[b].w[2], dx, dy, dz)
    return cross(bodies[b].w[0], bodies[b].w[1], bodies[b].w[2], ax, ay, az)


@inlined
def add_wrench(F, dx, dy, dz, fx, fy, fz):
    """Add a force at arm d to a wrench F : (6,)."""
    tx, ty, tz = cross(dx, dy, dz, fx, fy, fz)
    F[0] += fx
    F[1] += fy
    F[2] += fz
    F[3] += tx
    F[4] += ty
    F[5] += tz


@kernel
def add_ring(bodies, b, m, r, dx, dy, dz, nx, ny, nz, rate, acceleration):
    """A thin ring of mass m and radius r, carried at arm d, that turns about its axis n at a rate given by a law.

    n is a unit vector fixed in the body; rate and acceleration (rad/s, rad/s2) are relative to the body.

    Notes
    -----
    Angular momentum about its centre: H = I omega + m r^2 rate n, I = m r^2 (1 + n n^T) / 2. Of
    H' = I omega' + omega x I omega + m r^2 (acceleration n + rate omega x n) the first term goes to the body's mass.
    """
    w, F = bodies[b].w, bodies[b].F
    cx, cy, cz = centripetal(bodies, b, dx, dy, dz)
    add_wrench(F, dx, dy, dz, -m * cx, -m * cy, -m * cz)
    gx, gy, gz = cross(w[0], w[1], w[2], nx, ny, nz)
    k = m * r * r
    turning = k * (0.5 * (w[0] * nx + w[1] * ny + w[2] * nz) + rate)
    F[3] -= turning * gx + k * acceleration * nx
    F[4] -= turning * gy + k * acceleration * ny
    F[5] -= turning * gz + k * acceleration * nz
    add_mass(bodies, b, m, dx, dy, dz)
    if bodies[b].motion == SPIN:
        ax, ay, az = turn(bodies[b].R, bodies[b].axis[0], bodies[b].axis[1], bodies[b].axis[2])
        along = ax * nx + ay * ny + az * nz
        bodies[b].J += 0.5 * k * (1.0 + along * along)
    elif bodies[b].motion == FREE:
        assemble_mass_matrix(bodies, b)
        n = (nx, ny, nz)
        for i in range(3):
            bodies[b].M[3 + i, 3 + i] += 0.5 * k
            for j in range(3):
                bodies[b].M[3 + i, 3 + j] += 0.5 * k * n[i] * n[j]


@kernel
def add_mass(bodies, b, m, dx, dy, dz):
    """Mass of a point mass m fixed to the body at arm d."""
    if bodies[b].motion == SPIN:
        nx, ny, nz = turn(bodies[b].R, bodies[b].axis[0], bodies[b].axis[1], bodies[b].axis[2])
        px, py, pz = cross(nx, ny, nz, dx, dy, dz)
        bodies[b].J += m * (px * px + py * py + pz * pz)
    elif bodies[b].motion == FREE:
        assemble_mass_matrix(bodies, b)
        M = bodies[b].M
        dd = dx * dx + dy * dy + dz * dz
        d = (dx, dy, dz)
        for i in range(3):
            M[i, i] += m
            M[3 + i, 3 + i] += m * dd
            for j in range(3):
                M[3 + i, 3 + j] -= m * d[i] * d[j]
        add_skew(M, m, dx, dy, dz)


@inlined
def add_skew(M, m, dx, dy, dz):
    """The coupling blocks of a mass m at arm d: M[:3, 3:] -= m [d]x, M[3:, :3] += m [d]x."""
    M[0, 4] += m * dz
    M[0, 5] -= m * dy
    M[1, 3] -= m * dz
    M[1, 5] += m * dx
    M[2, 3] += m * dy
    M[2, 4] -= m * dx
    M[4, 0] += m * dz
    M[5, 0] -= m * dy
    M[3, 1] -= m * dz
    M[5, 1] += m * dx
    M[3, 2] += m * dy
    M[4, 2] -= m * dx


@inlined
def factorise(bodies):
    """Cholesky factors L of all mass matrices M; to be called after all attached masses are added."""
    for b in range(bodies.size):
        factorise_body(bodies, b)


@inlined
def factorise_body(bodies, b):
    """Cholesky factor L of the mass matrix M of body b, if it is free and has one."""
    if bodies[b].motion == FREE and bodies[b].has_mass_matrix != 0:
        for i in range(6):
            for j in range(i + 1):
                bodies[b].L[i, j] = bodies[b].M[i, j]
        cholesky(bodies[b].L, 6)


@inlined
def respond(bodies, b, F, a):
    """Acceleration twist a : (6,) of body b under a wrench F : (6,) at its origin."""
    for i in range(6):
        a[i] = 0.0
    if bodies[b].motion == SPIN:
        nx, ny, nz = turn(bodies[b].R, bodies[b].axis[0], bodies[b].axis[1], bodies[b].axis[2])
        s = (nx * F[3] + ny * F[4] + nz * F[5]) / bodies[b].J
        a[3] = s * nx
        a[4] = s * ny
        a[5] = s * nz
    elif bodies[b].motion == FREE:
        if bodies[b].has_mass_matrix != 0:
            for i in range(6):
                a[i] = F[i]
            cholesky_solve(bodies[b].L, 6, a)
            return
        R, own = bodies[b].R, 1.0 / bodies[b].mass
        x, y, z = turn_back(R, F[3], F[4], F[5])
        x, y, z = solve_inertia(bodies[b].inertia, x, y, z)
        a[0], a[1], a[2] = own * F[0], own * F[1], own * F[2]
        a[3], a[4], a[5] = turn(R, x, y, z)


@inlined
def solve_inertia(J, x, y, z):
    """J^-1 (x, y, z) for J : (3, 3) symmetric positive definite, by the factors L D L^T."""
    d0 = 1.0 / J[0, 0]
    l1, l2 = J[1, 0] * d0, J[2, 0] * d0
    d1 = 1.0 / (J[1, 1] - l1 * J[1, 0])
    rest = J[2, 1] - l2 * J[1, 0]
    l21 = rest * d1
    d2 = 1.0 / (J[2, 2] - l2 * J[2, 0] - l21 * rest)
    y -= l1 * x
    z = (z - l2 * x - l21 * y) * d2
    y = y * d1 - l21 * z
    return x * d0 - l1 * y - l2 * z, y, z


@inlined
def write_rates(y, bodies, b, dy):
    """State derivative of body b from its twist and its acceleration twist bodies[b].a; returns the drive's power."""
    q, v = bodies[b].iq, bodies[b].iv
    a = bodies[b].a
    if bodies[b].motion == SPIN:
        nx, ny, nz = turn(bodies[b].R, bodies[b].axis[0], bodies[b].axis[1], bodies[b].axis[2])
        dy[q] = y[v]
        dy[v] = nx * a[3] + ny * a[4] + nz * a[5]
        return 0.0
    if bodies[b].motion == FREE:
        for i in range(3):
            dy[q + i] = y[v + i]
            dy[v + i] = a[i]
        dy[q + 3], dy[q + 4], dy[q + 5], dy[q + 6] = quaternion_rate(
            y[q + 3], y[q + 4], y[q + 5], y[q + 6], y[v + 3], y[v + 4], y[v + 5]
        )
        dy[v + 3], dy[v + 4], dy[v + 5] = turn_back(bodies[b].R, a[3], a[4], a[5])
        return 0.0
    power = 0.0
    for i in range(3):
        power -= bodies[b].F[i] * bodies[b].v[i] + bodies[b].F[3 + i] * bodies[b].w[i]
    return power


@inlined
def kick(y, bodies, b, a):
    """Change the velocities of body b in the state by a jump twist a : (6,)."""
    v = bodies[b].iv
    if bodies[b].motion == SPIN:
        nx, ny, nz = turn(bodies[b].R, bodies[b].axis[0], bodies[b].axis[1], bodies[b].axis[2])
        y[v] += nx * a[3] + ny * a[4] + nz * a[5]
    elif bodies[b].motion == FREE:
        for i in range(3):
            y[v + i] += a[i]
        x, yy, z = turn_back(bodies[b].R, a[3], a[4], a[5])
        y[v + 3] += x
        y[v + 4] += yy
        y[v + 5] += z


@inlined
def shift_body(y, bodies, b):
    """Move body b by the small displacement twist bodies[b].a."""
    q, a = bodies[b].iq, bodies[b].a
    if bodies[b].motion == SPIN:
        n = bodies[b].axis
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        y[q] += nx * a[3] + ny * a[4] + nz * a[5]
    elif bodies[b].motion == FREE:
        for c in range(3):
            y[q + c] += a[c]
        k = q + 3
        x, z, u = turn_back(bodies[b].R, a[3], a[4], a[5])
        d = quaternion_rate(y[k], y[k + 1], y[k + 2], y[k + 3], x, z, u)
        scale = 0.0
        for c in range(4):
            y[k + c] += d[c]
            scale += y[k + c] * y[k + c]
        for c in range(4):
            y[k + c] /= math.sqrt(scale)


@inlined
def normalise_quaternion(y, q):
    """The quaternion at y[q : q + 4] to unit length."""
    scale = 1.0 / math.sqrt(y[q] * y[q] + y[q + 1] * y[q + 1] + y[q + 2] * y[q + 2] + y[q + 3] * y[q + 3])
    for c in range(4):
        y[q + c] *= scale


# ---------------------------------------------------------------------------------------------- implicit methods


@inlined
def add_body_weight(gravity, n_q, bodies, P):
    """Weight of all free bodies into the loads P."""
    for b in range(bodies.size):
        if bodies[b].motion == FREE:
            for c in range(3):
                P[bodies[b].iv - n_q + c] += bodies[b].mass * gravity[c]


@inlined
def add_body_residual(a, n_q, bodies, F):
    """F += M a less the wrenches of all bodies, in their coordinates; returns the power of what drives bodies, W.

    Parameters
    ----------
    a : (nv,) float, accelerations; the gyroscopic torque is among the wrenches (see `kinematics`)
    """
    power = 0.0
    for b in range(bodies.size):
        at, G, w = bodies[b].iv - n_q, bodies[b].F, bodies[b].w
        if bodies[b].motion == DRIVEN:
            if bodies[b].rate != 0.0 or bodies[b].path != 0:
                v = bodies[b].v
                power -= w[0] * G[3] + w[1] * G[4] + w[2] * G[5] + v[0] * G[0] + v[1] * G[1] + v[2] * G[2]
        elif bodies[b].motion == SPIN:
            n = bodies[b].axis
            x, yy, z = turn_back(bodies[b].R, G[3], G[4], G[5])
            F[at] += bodies[b].spin_inertia * a[at] - (n[0] * x + n[1] * yy + n[2] * z)
        elif bodies[b].motion == FREE:
            x, yy, z = turn_back(bodies[b].R, G[3], G[4], G[5])
            torque, J = (x, yy, z), bodies[b].inertia
            for c in range(3):
                F[at + c] += bodies[b].mass * a[at + c] - G[c]
                F[at + 3 + c] -= torque[c]
                for d in range(3):
                    F[at + 3 + c] += J[c, d] * a[at + 3 + d]
    return power


@inlined
def add_body_tangent(y, c_mass, c_rate, n_q, bodies, K, matrix):
    """c_mass M, and c_rate times the derivative of w x J w, of all bodies into a matrix; K : (12, 12), scratch."""
    for b in range(bodies.size):
        if bodies[b].motion == SPIN:
            at = bodies[b].iv - n_q
            add_entry(matrix, at, at, c_mass * bodies[b].spin_inertia)
        elif bodies[b].motion == FREE:
            at = bodies[b].iv - n_q
            J, v = bodies[b].inertia, bodies[b].iv + 3
            w = y[v], y[v + 1], y[v + 2]
            h = (
                J[0, 0] * w[0] + J[0, 1] * w[1] + J[0, 2] * w[2],
                J[1, 0] * w[0] + J[1, 1] * w[1] + J[1, 2] * w[2],
                J[2, 0] * w[0] + J[2, 1] * w[1] + J[2, 2] * w[2],
            )
            for r in range(6):
                for c in range(6):
                    K[r, c] = 0.0
            for c in range(3):
                K[c, c] = c_mass * bodies[b].mass
                x, yy, z = cross(w[0], w[1], w[2], J[0, c], J[1, c], J[2, c])
                ex, ey, ez = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2)
                hx, hy, hz = cross(ex, ey, ez, h[0], h[1], h[2])
                K[3, 3 + c] = c_mass * J[0, c] + c_rate * (x + hx)
                K[4, 3 + c] = c_mass * J[1, c] + c_rate * (yy + hy)
                K[5, 3 + c] = c_mass * J[2, c] + c_rate * (z + hz)
            add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)


# ---------------------------------------------------------------------------------------------- energy, momentum, bound


@inlined
def add_body_energy(y, bodies, out, at):
    """Add the kinetic energy of all bodies to out[at], J; that of driven ones is left out."""
    for b in range(bodies.size):
        v = bodies[b].iv
        if bodies[b].motion == SPIN:
            out[at] += 0.5 * bodies[b].spin_inertia * y[v] * y[v]
        elif bodies[b].motion == FREE:
            J = bodies[b].inertia
            for c in range(3):
                out[at] += 0.5 * bodies[b].mass * y[v + c] * y[v + c]
                for d in range(3):
                    out[at] += 0.5 * y[v + 3 + c] * J[c, d] * y[v + 3 + d]


@inlined
def add_body_momenta(y, bodies, P, H):
    """Add linear momentum and angular momentum about the inertial origin of all bodies to P, H : (3,) float.

    Those of driven bodies are left out. Orientations are those of the last `kinematics`.
    """
    for b in range(bodies.size):
        if bodies[b].motion == FREE:
            q, v, m = bodies[b].iq, bodies[b].iv, bodies[b].mass
            add_angular_momentum(H, 0, m, y[q], y[q + 1], y[q + 2], y[v], y[v + 1], y[v + 2])
            for c in range(3):
                P[c] += m * y[v + c]
        add_spin(y, bodies, b, H)


@inlined
def add_spin(y, bodies, b, H):
    """Add the angular momentum of body b about its centre of mass, of a spinning one about its axis, to H."""
    R, v = bodies[b].R, bodies[b].iv
    if bodies[b].motion == FREE:
        J = bodies[b].inertia
        for c in range(3):
            h = 0.0
            for d in range(3):
                h += J[c, d] * y[v + 3 + d]
            for d in range(3):
                H[d] += R[d, c] * h
    elif bodies[b].motion == SPIN:
        n, h = bodies[b].axis, bodies[b].spin_inertia * y[v]
        for d in range(3):
            H[d] += h * (R[d, 0] * n[0] + R[d, 1] * n[1] + R[d, 2] * n[2])


@inlined
def evaluate_bodies(y, bodies):
    """Momenta, the angular one as of `add_spin`, and kinetic energy of each body into its record; of driven ones zero.

    Orientations are those of the last `kinematics`.
    """
    for b in range(bodies.size):
        row, linear, angular = bodies[b], bodies[b].linear, bodies[b].angular
        linear[0] = 0.0
        add_body_energy(y, bodies[b : b + 1], linear, 0)
        row.kinetic = linear[0]
        for c in range(3):
            linear[c] = row.mass * y[row.iv + c] if row.motion == FREE else 0.0
            angular[c] = 0.0
        add_spin(y, bodies, b, angular)


def body_bound(bodies, b, blocks):
    """M^-1 K and M^-1 C of body b, that of a spinning one about its axis. Not compiled.

    Parameters
    ----------
    blocks : (2, 6, 6) float, K and C of its displacement and rotation, inertial axes
    """
    if bodies["motion"][b] == SPIN:
        n = bodies["R"][b] @ bodies["axis"][b]
        return np.array([[[n @ block[3:, 3:] @ n]] for block in blocks]) / bodies["J"][b]
    R, M = bodies["R"][b], bodies["mass"][b] * np.eye(6)
    M[3:, 3:] = R @ bodies["inertia"][b] @ R.T
    return np.linalg.solve(bodies["M"][b] if bodies["has_mass_matrix"][b] else M, blocks)


@inlined
def relative_velocity(A, B, arm_a, arm_b):
    """Velocity of a's material at a point against that of b's."""
    va, vb, wa, wb = A.v, B.v, A.w, B.w
    ax, ay, az = cross(wa[0], wa[1], wa[2], arm_a[0], arm_a[1], arm_a[2])
    bx, by, bz = cross(wb[0], wb[1], wb[2], arm_b[0], arm_b[1], arm_b[2])
    return va[0] + ax - vb[0] - bx, va[1] + ay - vb[1] - by, va[2] + az - vb[2] - bz
