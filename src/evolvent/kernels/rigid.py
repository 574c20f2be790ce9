"""Rigid bodies: driven about an axis, spinning about a fixed axis, or free in six degrees of freedom.

A body's wrench and twist are taken at its origin, which is its centre of mass, in inertial axes: (force, torque),
(acceleration, angular acceleration). Wound thread adds to its 6 x 6 mass.
"""

from numba import void

from evolvent.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels.linalg import cholesky, cholesky_solve
from evolvent.kernels.rotations import (
    cross,
    quaternion_rate,
    rotation_about_axis,
    rotation_from_quaternion,
    turn,
    turn_back,
)
from evolvent.model import MODEL

DRIVEN, SPIN, FREE = 0, 1, 2


@indirect(void(REAL, VECTOR, MODEL))
def kinematics(t, y, model):
    """Orientation, position and velocities (R, x, v, w, inertial axes) of every body; wrenches and masses reset."""
    bodies = model.bodies
    for b in range(bodies.size):
        q, v = bodies[b].iq, bodies[b].iv
        R = bodies[b].R
        if bodies[b].motion == FREE:
            rotation_from_quaternion(y[q + 3], y[q + 4], y[q + 5], y[q + 6], R)
            for i in range(3):
                bodies[b].x[i] = y[q + i]
                bodies[b].v[i] = y[v + i]
            bodies[b].w[0], bodies[b].w[1], bodies[b].w[2] = turn(R, y[v + 3], y[v + 4], y[v + 5])
        else:
            axis = bodies[b].axis
            if bodies[b].motion == SPIN:
                angle, rate = y[q], y[v]
            else:
                rate = bodies[b].rate
                angle = rate * t
                if rate == 0.0:  # stands as it was assembled
                    for i in range(6):
                        bodies[b].F[i] = 0.0
                    continue
            rotation_about_axis(axis, angle, bodies[b].R0, R)
            for i in range(3):
                bodies[b].x[i] = bodies[b].x0[i]
                bodies[b].v[i] = 0.0
            bodies[b].w[0], bodies[b].w[1], bodies[b].w[2] = turn(R, rate * axis[0], rate * axis[1], rate * axis[2])
        for i in range(6):
            bodies[b].F[i] = 0.0
        if bodies[b].motion == SPIN:
            bodies[b].J = bodies[b].spin_inertia
        elif bodies[b].motion == FREE:
            free_mass(bodies[b].mass, bodies[b].inertia, R, bodies[b].w, bodies[b].M, bodies[b].F)


@kernel
def free_mass(mass, inertia, R, omega, M, F):
    """6 x 6 mass in inertial axes, and the gyroscopic torque -omega x I omega in F[3:]."""
    for i in range(6):
        for j in range(6):
            M[i, j] = 0.0
    for i in range(3):
        M[i, i] = mass
        for j in range(3):
            s = 0.0
            for k in range(3):
                for n in range(3):
                    s += R[i, k] * inertia[k, n] * R[j, n]
            M[3 + i, 3 + j] = s
    hx = M[3, 3] * omega[0] + M[3, 4] * omega[1] + M[3, 5] * omega[2]
    hy = M[4, 3] * omega[0] + M[4, 4] * omega[1] + M[4, 5] * omega[2]
    hz = M[5, 3] * omega[0] + M[5, 4] * omega[1] + M[5, 5] * omega[2]
    gx, gy, gz = cross(omega[0], omega[1], omega[2], hx, hy, hz)
    F[3] -= gx
    F[4] -= gy
    F[5] -= gz


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
    """Cholesky factors of the free bodies' masses into L; call once all carried masses are in."""
    for b in range(bodies.size):
        if bodies[b].motion == FREE:
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
        for i in range(6):
            a[i] = F[i]
        cholesky_solve(bodies[b].L, 6, a)


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
