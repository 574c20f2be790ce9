"""Damping by mass of nodes that are bodies: forces -alpha M v, and the torques of their moments of inertia."""

from evolvent.algebra.sparse import add_block
from evolvent.compiled.jit import inlined
from evolvent.kernels.rotations import turn, turn_back


@inlined
def damp_bodies(alpha, bodies, first, last):
    """Add the forces of the bodies from `first` to before `last`; returns the power that they take, W."""
    lost = 0.0
    for b in range(first, last):
        J, F, v, w, m = bodies[b].inertia, bodies[b].F, bodies[b].v, bodies[b].w, alpha * bodies[b].mass
        x, y, z = turn_back(bodies[b].R, w[0], w[1], w[2])
        hx = alpha * (J[0, 0] * x + J[0, 1] * y + J[0, 2] * z)
        hy = alpha * (J[1, 0] * x + J[1, 1] * y + J[1, 2] * z)
        hz = alpha * (J[2, 0] * x + J[2, 1] * y + J[2, 2] * z)
        lost += m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + hx * x + hy * y + hz * z
        hx, hy, hz = turn(bodies[b].R, hx, hy, hz)
        F[0] -= m * v[0]
        F[1] -= m * v[1]
        F[2] -= m * v[2]
        F[3] -= hx
        F[4] -= hy
        F[5] -= hz
    return lost


@inlined
def add_damping_tangents(alpha, c_rate, bodies, first, last, n_q, K, matrix):
    """Add c_rate times the derivatives of the forces of `damp_bodies` by velocities; K : (6, 6), scratch."""
    for b in range(first, last):
        at = bodies[b].iv - n_q
        if bodies[b].iv < 0:
            continue
        for i in range(6):
            for j in range(6):
                K[i, j] = 0.0
        for i in range(3):
            K[i, i] = c_rate * alpha * bodies[b].mass
            for j in range(3):
                K[3 + i, 3 + j] = c_rate * alpha * bodies[b].inertia[i, j]
        add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)
