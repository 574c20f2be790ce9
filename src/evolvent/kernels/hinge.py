"""Hinges: spring, damper, stops and latch between a direction of a body and a beam's slope."""

import math

import numpy as np
from numba import types, void

from evolvent.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_relative, add_relative_body, body_columns
from evolvent.kernels.sparse import SPARSE, add_block
from evolvent.model import MODEL


@inlined
def _hinge_geometry(y, hinges, bodies, k):
    """Zero direction a and the one across it b, parts p and q of the slope along them, and g = d(angle)/d(slope).

    Notes
    -----
    angle = atan2(q, p), g = (p b - q a)/(p^2 + q^2).
    """
    R, iq = bodies[hinges[k].body].R, hinges[k].iq
    z, n = hinges[k].zero, hinges[k].axis
    ax, ay, az = turn(R, z[0], z[1], z[2])
    nx, ny, nz = turn(R, n[0], n[1], n[2])
    bx, by, bz = cross(nx, ny, nz, ax, ay, az)
    ux, uy, uz = y[iq], y[iq + 1], y[iq + 2]
    p, q = ux * ax + uy * ay + uz * az, ux * bx + uy * by + uz * bz
    rr = p * p + q * q
    g = ((p * bx - q * ax) / rr, (p * by - q * ay) / rr, (p * bz - q * az) / rr)
    return (ax, ay, az), (bx, by, bz), p, q, g


@inlined
def hinge_law(hinges, k, angle, rate):
    """Torque that resists, its derivatives with respect to angle and rate, energy and dissipated power."""
    torque, stiffness, damping = 0.0, hinges[k].stiffness, hinges[k].damping
    turned = angle - hinges[k].rest
    torque += stiffness * turned
    energy = 0.5 * stiffness * turned * turned
    over = max(angle - hinges[k].high, 0.0) + min(angle - hinges[k].low, 0.0)
    if over != 0.0:
        stiffness += hinges[k].stop
        torque += hinges[k].stop * over
        energy += 0.5 * hinges[k].stop * over * over
    if hinges[k].latched != 0.0:
        off = angle - hinges[k].latch
        stiffness += hinges[k].latch_stiffness
        damping += hinges[k].latch_damping
        torque += hinges[k].latch_stiffness * off
        energy += 0.5 * hinges[k].latch_stiffness * off * off
    return torque + damping * rate, stiffness, damping, energy, damping * rate * rate


@indirect(types.UniTuple(REAL, 2)(VECTOR, MODEL, VECTOR))
def add_hinges(y, model, F):
    """Torques of all hinges; returns (energy, power dissipated).

    Notes
    -----
    With g = d(angle)/du of the slope u, a turn w of the body changes the angle by -(u x g) . w.
    """
    hinges, bodies, n_q = model.flexible.hinges, model.bodies, model.info.nq
    energy = power = 0.0
    for k in range(hinges.size):
        _, _, p, q, (gx, gy, gz) = _hinge_geometry(y, hinges, bodies, k)
        iq, iv, body = hinges[k].iq, hinges[k].iv, hinges[k].body
        tx, ty, tz = cross(y[iq], y[iq + 1], y[iq + 2], gx, gy, gz)
        w = bodies[body].w
        rate = gx * y[iv] + gy * y[iv + 1] + gz * y[iv + 2] - tx * w[0] - ty * w[1] - tz * w[2]
        angle = math.atan2(q, p)
        torque, _, _, u, lost = hinge_law(hinges, k, angle, rate)
        hinges[k].angle, hinges[k].rate, hinges[k].torque = angle, rate, torque
        energy += u
        power += lost
        at, G = iv - n_q, bodies[body].F
        F[at] += torque * gx
        F[at + 1] += torque * gy
        F[at + 2] += torque * gz
        G[3] += torque * tx
        G[4] += torque * ty
        G[5] += torque * tz
    return energy, power


@indirect(void(VECTOR, REAL, MODEL, SPARSE))
def add_hinge_tangents(y, c_rate, model, matrix):
    """Tangents of all hinges.

    Notes
    -----
    With f = torque g: df = (stiffness + c_rate damping) g g^T + damping g (H r)^T + torque H, H = d2(angle)/du2, and r
    is the slope's rate as seen from the body.
    """
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    hinges = flexible.hinges
    K = flexible.K12
    for k in range(hinges.size):
        a, b, p, q, g = _hinge_geometry(y, hinges, bodies, k)
        iq, iv, body = hinges[k].iq, hinges[k].iv, hinges[k].body
        ux, uy, uz = y[iq], y[iq + 1], y[iq + 2]
        rr = p * p + q * q
        torque, stiffness, damping, _, _ = hinge_law(hinges, k, hinges[k].angle, hinges[k].rate)
        slope = stiffness + c_rate * damping
        w = bodies[body].w
        rx, ry, rz = cross(w[0], w[1], w[2], ux, uy, uz)
        r = (y[iv] - rx, y[iv + 1] - ry, y[iv + 2] - rz)
        s, d = 2.0 * p * q / (rr * rr), (q * q - p * p) / (rr * rr)
        for j in range(3):
            turned = 0.0
            for i in range(3):
                turned += (s * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])) * r[i]
            for i in range(3):
                second = s * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])
                K[i, j] = slope * g[i] * g[j] + torque * second + damping * g[i] * turned
        at = iv - n_q
        add_block(matrix, at, at, K, 0, 0, 3, 3, 1.0)
        if bodies[body].motion != rigid.DRIVEN:
            local = flexible.e[2]
            local[0], local[1], local[2] = turn_back(bodies[body].R, ux, uy, uz)
            body_columns(model, body, local, False, flexible.J[1])
            f = (torque * g[0], torque * g[1], torque * g[2])
            add_relative(matrix, model, body, flexible.J[1], K, f, at, 1.0)
            add_relative_body(matrix, model, body, False, flexible.J[1], K, f)


def hinge_bound(hinges):
    """Stiffness of all hinges with every stop reached, N m/rad. Not compiled."""
    return hinges["stiffness"] + np.maximum(hinges["stop"], 0.0)
