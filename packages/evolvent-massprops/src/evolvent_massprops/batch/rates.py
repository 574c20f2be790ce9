"""A rigid body on springs that stand or hang on the ground, for many cases at once, side by side.

The bodies of a batch lie side by side: every quantity is a row of `WIDTH` numbers in a record, and each loop over a row
is straight arithmetic that the compiler turns into vector instructions. Columns do not depend on one another, so a case
gives the same bits in any company. A case costs a twentieth of what the general right-hand side (`evolvent.equations`)
takes for it, which is what a map of a thousand cases is for; tests compare the two.

Axes: inertial, y up. State of a case: position x of the centre of mass, quaternion q (body to inertial, scalar part
first), velocity v and angular velocity w in inertial axes, and the energy that the dampers have taken.
"""

import numpy as np
from numba.np import numpy_support

from evolvent.compiled.jit import inlined, kernel
from evolvent.families.springs.springs import distance, lateral_force

WIDTH = 8
#: Rows of a state.
X, Q, V, W, DISSIPATED, N_STATE = 0, 3, 7, 10, 13, 14


def _rows(**shapes: int) -> np.dtype:
    return np.dtype([(name, np.float64, (rows, WIDTH)) for name, rows in shapes.items()], align=True)


#: Bodies of a batch. y, dy: state and its derivative; inertia and its inverse: xx, yy, zz, xy, xz, yz, body axes;
#: guided: 1 where lateral motion and yaw are held; R, F, M, power: scratch.
BODIES = _rows(
    y=N_STATE, dy=N_STATE, compliance=1, gravity=3, inertia=6, inverse=6, guided=1, R=9, F=3, M=3, power=1, spring=14
)  # fmt: skip
#: Type of an array of such bodies in signatures of compiled functions.
BODIES_TYPE = numpy_support.from_dtype(BODIES)[::1]
#: Rows of one spring of every case: attachment (from the centre of mass, body axes), ground point, unit axis of its
#: mount; stiffness, damping, natural length, lateral stiffness, lateral damping.
ATTACHMENT, GROUND, AXIS = 0, 3, 6
STIFFNESS, DAMPING, LENGTH, LATERAL, LATERAL_DAMPING, N_SPRING = 9, 10, 11, 12, 13, 14


@inlined
def orient(bodies):
    """Orientation of every body, with force, torque and power set to zero."""
    y, R, F, M, power = bodies.y, bodies.R, bodies.F, bodies.M, bodies.power
    for c in range(WIDTH):
        a, b, d, e = y[Q, c], y[Q + 1, c], y[Q + 2, c], y[Q + 3, c]
        s = 2.0 / (a * a + b * b + d * d + e * e)
        R[0, c] = 1.0 - s * (d * d + e * e)
        R[1, c] = s * (b * d - a * e)
        R[2, c] = s * (b * e + a * d)
        R[3, c] = s * (b * d + a * e)
        R[4, c] = 1.0 - s * (b * b + e * e)
        R[5, c] = s * (d * e - a * b)
        R[6, c] = s * (b * e - a * d)
        R[7, c] = s * (d * e + a * b)
        R[8, c] = 1.0 - s * (b * b + d * d)
    for c in range(WIDTH):
        F[0, c] = F[1, c] = F[2, c] = 0.0
        M[0, c] = M[1, c] = M[2, c] = 0.0
        power[0, c] = 0.0


@inlined
def pull(bodies, spring):
    """Add the forces of one spring in every body.

    Notes
    -----
    As `families.springs.springs`, with e = attachment - ground.
    """
    y, R, F, M, power = bodies.y, bodies.R, bodies.F, bodies.M, bodies.power
    own = bodies.spring  # in the same record as what is written: else the compiler must fear that they overlap
    for r in range(N_SPRING):
        for c in range(WIDTH):
            own[r, c] = spring[r, c]
    for c in range(WIDTH):
        ax, ay, az = own[ATTACHMENT, c], own[ATTACHMENT + 1, c], own[ATTACHMENT + 2, c]
        dx = R[0, c] * ax + R[1, c] * ay + R[2, c] * az
        dy = R[3, c] * ax + R[4, c] * ay + R[5, c] * az
        dz = R[6, c] * ax + R[7, c] * ay + R[8, c] * az
        ex = y[X, c] + dx - own[GROUND, c]
        ey = y[X + 1, c] + dy - own[GROUND + 1, c]
        ez = y[X + 2, c] + dz - own[GROUND + 2, c]
        ox, oy, oz = y[W, c], y[W + 1, c], y[W + 2, c]
        vx = y[V, c] + oy * dz - oz * dy
        vy = y[V + 1, c] + oz * dx - ox * dz
        vz = y[V + 2, c] + ox * dy - oy * dx
        length, nx, ny, nz, rate = distance(ex, ey, ez, vx, vy, vz)
        damping = own[DAMPING, c] * rate
        T = own[STIFFNESS, c] * (length - own[LENGTH, c]) + damping
        u = (own[AXIS, c], own[AXIS + 1, c], own[AXIS + 2, c])
        fx, fy, fz, rubbed = lateral_force(u, own[LATERAL, c], own[LATERAL_DAMPING, c], ex, ey, ez, vx, vy, vz)
        fx, fy, fz = fx - T * nx, fy - T * ny, fz - T * nz
        F[0, c] += fx
        F[1, c] += fy
        F[2, c] += fz
        M[0, c] += dy * fz - dz * fy
        M[1, c] += dz * fx - dx * fz
        M[2, c] += dx * fy - dy * fx
        power[0, c] += damping * rate + rubbed


@inlined
def respond(bodies):
    """State derivative of every body from its force and torque.

    Notes
    -----
    m a = F + m g; I eps + w x I w = M. A guided body keeps the x and z of its centre of mass, and its x axis X keeps no
    component along z: X_z'' = n . eps + n' . w = 0 with n = X x z, held by a torque along n.
    """
    y, dy, R, F, M, power = bodies.y, bodies.dy, bodies.R, bodies.F, bodies.M, bodies.power
    compliance, gravity, inertia, inverse = bodies.compliance, bodies.gravity, bodies.inertia, bodies.inverse
    guided = bodies.guided
    for c in range(WIDTH):
        r11, r12, r13 = R[0, c], R[1, c], R[2, c]
        r21, r22, r23 = R[3, c], R[4, c], R[5, c]
        r31, r32, r33 = R[6, c], R[7, c], R[8, c]
        ox, oy, oz = y[W, c], y[W + 1, c], y[W + 2, c]
        # angular velocity and torque in body axes
        bx, by, bz = r11 * ox + r21 * oy + r31 * oz, r12 * ox + r22 * oy + r32 * oz, r13 * ox + r23 * oy + r33 * oz
        tx, ty, tz = M[0, c], M[1, c], M[2, c]
        mx, my, mz = r11 * tx + r21 * ty + r31 * tz, r12 * tx + r22 * ty + r32 * tz, r13 * tx + r23 * ty + r33 * tz
        ixx, iyy, izz, ixy, ixz, iyz = (
            inertia[0, c], inertia[1, c], inertia[2, c], inertia[3, c], inertia[4, c], inertia[5, c],
        )  # fmt: skip
        hx, hy, hz = ixx * bx + ixy * by + ixz * bz, ixy * bx + iyy * by + iyz * bz, ixz * bx + iyz * by + izz * bz
        mx -= by * hz - bz * hy
        my -= bz * hx - bx * hz
        mz -= bx * hy - by * hx
        jxx, jyy, jzz, jxy, jxz, jyz = (
            inverse[0, c], inverse[1, c], inverse[2, c], inverse[3, c], inverse[4, c], inverse[5, c],
        )  # fmt: skip
        ex, ey, ez = jxx * mx + jxy * my + jxz * mz, jxy * mx + jyy * my + jyz * mz, jxz * mx + jyz * my + jzz * mz
        # n = X x z in body axes, the third row of R crossed with (1, 0, 0) but for the sign
        ny, nz = -r33, r32
        sx, sy, sz = jxy * ny + jxz * nz, jyy * ny + jyz * nz, jyz * ny + jzz * nz
        turned_x, turned_y = oy * r31 - oz * r21, oz * r11 - ox * r31  # X'
        lack = ny * ey + nz * ez + turned_y * ox - turned_x * oy
        la = guided[0, c] * lack / (ny * sy + nz * sz)
        ex -= la * sx
        ey -= la * sy
        ez -= la * sz
        free = 1.0 - guided[0, c]
        dy[V, c] = free * (F[0, c] * compliance[0, c] + gravity[0, c])
        dy[V + 1, c] = F[1, c] * compliance[0, c] + gravity[1, c]
        dy[V + 2, c] = free * (F[2, c] * compliance[0, c] + gravity[2, c])
        dy[W, c] = r11 * ex + r12 * ey + r13 * ez
        dy[W + 1, c] = r21 * ex + r22 * ey + r23 * ez
        dy[W + 2, c] = r31 * ex + r32 * ey + r33 * ez
    for c in range(WIDTH):
        ox, oy, oz = y[W, c], y[W + 1, c], y[W + 2, c]
        a, b, d, e = y[Q, c], y[Q + 1, c], y[Q + 2, c], y[Q + 3, c]
        dy[X, c] = y[V, c]
        dy[X + 1, c] = y[V + 1, c]
        dy[X + 2, c] = y[V + 2, c]
        dy[Q, c] = 0.5 * (-ox * b - oy * d - oz * e)
        dy[Q + 1, c] = 0.5 * (ox * a + oy * e - oz * d)
        dy[Q + 2, c] = 0.5 * (oy * a + oz * b - ox * e)
        dy[Q + 3, c] = 0.5 * (oz * a + ox * d - oy * b)
        dy[DISSIPATED, c] = power[0, c]


@kernel
def rates(bodies, springs):
    """State derivative bodies.dy of the state bodies.y, in every body.

    Parameters
    ----------
    bodies : record of `BODIES`
    springs : (n, N_SPRING, WIDTH) float
    """
    orient(bodies)
    for k in range(springs.shape[0]):
        pull(bodies, springs[k])
    respond(bodies)
