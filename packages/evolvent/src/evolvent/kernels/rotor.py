"""Rotors whose rate relative to a body is a state: spools of threads, and reaction wheels.

A rotor turns about the direction n of a body, whose inertia J contains that of the rotor at rest. With its moment of
inertia S about n, its rate phi' relative to the body and the torque Q on it about n,

    S (phi'' + n . w') = Q,     (J - S n n^T) w' + w x J w = T - Q n - w x (S phi' n).
"""

from evolvent.compiled.jit import inlined
from evolvent.kernels.rigid import FREE, SPIN, assemble_mass_matrix
from evolvent.kernels.rotations import cross, turn


@inlined
def take_inertia(bodies, b, S, nx, ny, nz):
    """Take S n n^T, which the rotor's own equation holds, out of the inertia of its body."""
    if bodies[b].motion == SPIN:
        ax, ay, az = turn(bodies[b].R, bodies[b].axis[0], bodies[b].axis[1], bodies[b].axis[2])
        along = ax * nx + ay * ny + az * nz
        bodies[b].J -= S * along * along
    elif bodies[b].motion == FREE:
        assemble_mass_matrix(bodies, b)
        n = (nx, ny, nz)
        for i in range(3):
            for j in range(3):
                bodies[b].M[3 + i, 3 + j] -= S * n[i] * n[j]


@inlined
def add_reaction(bodies, b, Q, h, nx, ny, nz):
    """The torques -Q n and -w x (h n) on a rotor's body; h : its angular momentum relative to the body."""
    w, F = bodies[b].w, bodies[b].F
    gx, gy, gz = cross(w[0], w[1], w[2], nx, ny, nz)
    F[3] -= Q * nx + h * gx
    F[4] -= Q * ny + h * gy
    F[5] -= Q * nz + h * gz


@inlined
def acceleration_about(bodies, b, nx, ny, nz):
    """Angular acceleration of a body about the direction n, rad/s2."""
    a = bodies[b].a
    return nx * a[3] + ny * a[4] + nz * a[5]


@inlined
def wheel_momentum(b, y, model):
    """Angular momentum of the wheels of body b relative to it, body axes, kg m2/s."""
    wheels, hx, hy, hz = model.wheels, 0.0, 0.0, 0.0
    for i in range(wheels.size):
        if wheels[i].body == b:
            h, n = wheels[i].inertia * y[wheels[i].iv], wheels[i].axis
            hx, hy, hz = hx + h * n[0], hy + h * n[1], hz + h * n[2]
    return hx, hy, hz


@inlined
def inertia_without_wheels(b, model, K):
    """Inertia of body b less that of its wheels about their axes, body axes, into K[:3, :3]."""
    wheels, J = model.wheels, model.bodies[b].inertia
    for i in range(3):
        for j in range(3):
            K[i, j] = J[i, j]
    for k in range(wheels.size):
        if wheels[k].body == b:
            S, n = wheels[k].inertia, wheels[k].axis
            for i in range(3):
                for j in range(3):
                    K[i, j] -= S * n[i] * n[j]
