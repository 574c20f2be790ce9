"""Poses of bodies at the ends of a step, and how forces and torques on bodies follow their turns, for tangents."""

from __future__ import annotations

from evolvent.compiled.jit import inlined
from evolvent.kernels.rotations import cross, turn, turn_back


@inlined
def add_skew(K, row, column, scale, x, y, z):
    """Add scale [x]x."""
    K[row, column + 1] -= scale * z
    K[row, column + 2] += scale * y
    K[row + 1, column] += scale * z
    K[row + 1, column + 2] -= scale * x
    K[row + 2, column] -= scale * y
    K[row + 2, column + 1] += scale * x


@inlined
def add_double(K, row, column, scale, ax, ay, az, bx, by, bz):
    """Add scale [a]x [b]x = scale (b a^T - (a . b) 1)."""
    a, b = (ax, ay, az), (bx, by, bz)
    dot = ax * bx + ay * by + az * bz
    for i in range(3):
        for j in range(3):
            K[row + i, column + j] += scale * b[i] * a[j]
        K[row + i, column + i] -= scale * dot


@inlined
def pose_after(bodies, b, h, R):
    """Rotation of body b at the half interval h after its mean into R; returns its position, all that its rates say.

    Notes
    -----
    Over a step a body's rates make dR = h [w]x R and dx = h v of its means R and x.
    """
    M, w, x, v = bodies[b].R, bodies[b].w, bodies[b].x, bodies[b].v
    for j in range(3):
        x1, y1, z1 = cross(w[0], w[1], w[2], M[0, j], M[1, j], M[2, j])
        R[0, j], R[1, j], R[2, j] = M[0, j] + h * x1, M[1, j] + h * y1, M[2, j] + h * z1
    return x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2]


@inlined
def end_axes(R0, w, h, Q):
    """Q = R0 (1 + [t]x/2)/(1 + t.t/4), by which a change of the increment t = R0^T h w turns the end, inertial axes."""
    x, y, z = turn_back(R0, 0.5 * h * w[0], 0.5 * h * w[1], 0.5 * h * w[2])
    s = 1.0 / (1.0 + x * x + y * y + z * z)
    Q[0, 0], Q[1, 0], Q[2, 0] = turn(R0, s, s * z, -s * y)
    Q[0, 1], Q[1, 1], Q[2, 1] = turn(R0, -s * z, s, s * x)
    Q[0, 2], Q[1, 2], Q[2, 2] = turn(R0, s * y, -s * x, s)
