"""Gears: q_1 + ratio q_2 keeps its value, of two angles or travels between bodies; a kind of the family `joints`.

An angle is that of the direction `local` of the body `other` about the axis of `body`, from its direction `zero` on; a
travel that of the point `local` of `other` along the axis. The sum of angles counts modulo 2 pi/teeth, so that angles
need no counted turns: whole numbers of teeth make it the same after any number of them.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sparse import SPARSE, first_entry
from evolvent.model import MODEL

_I = types.int64
_ROTATIONS = types.float64[:, :, ::1]
ANGLE, TRAVEL = 0, 1
#: Change of an angle below which secants are tangents, rad.
_SMALL = 1e-7


@inlined
def _directions(R, coordinates, i):
    """Direction `zero` of a coordinate and the one a quarter turn on, inertial axes, R the rotation of `body`."""
    z, n = coordinates[i].zero, coordinates[i].axis
    ax, ay, az = turn(R, z[0], z[1], z[2])
    bx, by, bz = cross(n[0], n[1], n[2], z[0], z[1], z[2])
    bx, by, bz = turn(R, bx, by, bz)
    return ax, ay, az, bx, by, bz


@inlined
def wrapped(sum_, period):
    """A sum of angles, nearest to zero; all of it where the period is 0."""
    return sum_ - period * math.floor(sum_ / period + 0.5) if period > 0.0 else sum_


@indirect(void(_I, MODEL))
def gear_geometry(k, model):
    """Gap and rate of gear k of the family `joints`; gradients of its coordinates: `force` at `x`, and `torque`."""
    joints, coordinates, bodies = model.flexible.joints, model.flexible.gear_coordinates, model.bodies
    gap, rate = -joints[k].value, 0.0
    for i in range(joints[k].first, joints[k].last):
        b, o, local = coordinates[i].body, coordinates[i].other, coordinates[i].local
        n, factor = coordinates[i].axis, coordinates[i].factor
        f, t, x = coordinates[i].force, coordinates[i].torque, coordinates[i].x
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        w, v = bodies[b].w, bodies[o].w
        ux, uy, uz = turn(bodies[o].R, local[0], local[1], local[2])
        if coordinates[i].kind == ANGLE:
            ax, ay, az, bx, by, bz = _directions(bodies[b].R, coordinates, i)
            p, q = ux * ax + uy * ay + uz * az, ux * bx + uy * by + uz * bz
            gap += factor * math.atan2(q, p)
            rate += factor * (nx * (v[0] - w[0]) + ny * (v[1] - w[1]) + nz * (v[2] - w[2]))
            t[0], t[1], t[2] = factor * nx, factor * ny, factor * nz
            continue
        c = coordinates[i].centre
        cx, cy, cz = turn(bodies[b].R, c[0], c[1], c[2])
        for j in range(3):
            x[j] = bodies[o].x[j] + (ux if j == 0 else uy if j == 1 else uz)
        dx, dy, dz = x[0] - bodies[b].x[0], x[1] - bodies[b].x[1], x[2] - bodies[b].x[2]
        gap += factor * (nx * (dx - cx) + ny * (dy - cy) + nz * (dz - cz))
        sx, sy, sz = cross(v[0], v[1], v[2], ux, uy, uz)
        rx, ry, rz = cross(w[0], w[1], w[2], dx, dy, dz)
        a, e = bodies[b].v, bodies[o].v
        rate += factor * (nx * (e[0] + sx - a[0] - rx) + ny * (e[1] + sy - a[1] - ry) + nz * (e[2] + sz - a[2] - rz))
        f[0], f[1], f[2] = factor * nx, factor * ny, factor * nz
    joints[k].gap, joints[k].rate = wrapped(gap, joints[k].radius), rate


@indirect(void(_I, MODEL, _ROTATIONS, _ROTATIONS))
def secant_gear(k, model, R0, R1):
    """Torques of the angles of gear k over a step along its mean, as `kernels.hinge_step` has them.

    Parameters
    ----------
    R0, R1 : (nb, 3, 3) float, rotations of the bodies at both ends; `bodies` hold their means
    """
    joints, coordinates, bodies = model.flexible.joints, model.flexible.gear_coordinates, model.bodies
    for i in range(joints[k].first, joints[k].last):
        if coordinates[i].kind != ANGLE:
            continue
        b, o, l, t = coordinates[i].body, coordinates[i].other, coordinates[i].local, coordinates[i].torque  # noqa: E741
        ux, uy, uz = turn(R0[o], l[0], l[1], l[2])
        ax, ay, az, bx, by, bz = _directions(R0[b], coordinates, i)
        p0, q0 = ux * ax + uy * ay + uz * az, ux * bx + uy * by + uz * bz
        ux, uy, uz = turn(R1[o], l[0], l[1], l[2])
        ax, ay, az, bx, by, bz = _directions(R1[b], coordinates, i)
        p1, q1 = ux * ax + uy * ay + uz * az, ux * bx + uy * by + uz * bz
        swept, along = p0 * q1 - q0 * p1, p0 * p1 + q0 * q1
        turned = math.atan2(swept, along)
        scale = turned / swept if abs(turned) > _SMALL else 1.0 / along
        p, q = 0.5 * scale * (p0 + p1), 0.5 * scale * (q0 + q1)
        ax, ay, az, bx, by, bz = _directions(bodies[b].R, coordinates, i)
        ux, uy, uz = turn(bodies[o].R, l[0], l[1], l[2])
        tx, ty, tz = cross(ux, uy, uz, p * bx - q * ax, p * by - q * ay, p * bz - q * az)
        factor = coordinates[i].factor
        t[0], t[1], t[2] = factor * tx, factor * ty, factor * tz


@indirect(void(_I, REAL, MODEL))
def add_gear_force(k, la, model):
    """Wrenches of the multiplier la on the bodies of gear k, by the last gradients."""
    joints, coordinates, bodies = model.flexible.joints, model.flexible.gear_coordinates, model.bodies
    for i in range(joints[k].first, joints[k].last):
        f, t, x = coordinates[i].force, coordinates[i].torque, coordinates[i].x
        for side in range(2):
            index = coordinates[i].body if side == 0 else coordinates[i].other
            s, G, X = la if side == 0 else -la, bodies[index].F, bodies[index].x
            if coordinates[i].kind == ANGLE:
                for c in range(3):
                    G[3 + c] += s * t[c]
            else:
                rigid.add_wrench(G, x[0] - X[0], x[1] - X[1], x[2] - X[2], s * f[0], s * f[1], s * f[2])


@indirect(void(_I, _I, REAL, REAL, MODEL, SPARSE))
def add_gear(k, row, scale, damped, model, matrix):
    """Add the gradient of gear k as row and column `row`, times `scale`, the row times `damped` as well."""
    joints, coordinates, bodies = model.flexible.joints, model.flexible.gear_coordinates, model.bodies
    values = matrix.values
    for i in range(joints[k].first, joints[k].last):
        f, t, x = coordinates[i].force, coordinates[i].torque, coordinates[i].x
        for side in range(2):
            index = coordinates[i].body if side == 0 else coordinates[i].other
            motion, sign = bodies[index].motion, -scale if side == 0 else scale
            if motion == rigid.DRIVEN:
                continue
            tx, ty, tz = t[0], t[1], t[2]
            if coordinates[i].kind == TRAVEL:
                X = bodies[index].x
                tx, ty, tz = cross(x[0] - X[0], x[1] - X[1], x[2] - X[2], f[0], f[1], f[2])
            tx, ty, tz = turn_back(bodies[index].R, tx, ty, tz)
            at = bodies[index].iv - model.info.nq
            to, right, _ = first_entry(matrix, row, at)
            of, _, down = first_entry(matrix, at, row)
            if motion == rigid.SPIN:
                n = bodies[index].axis
                value = sign * (n[0] * tx + n[1] * ty + n[2] * tz)
                values[to] += value * damped
                values[of] += value
                continue
            for c in range(3):
                value = sign * (tx if c == 0 else ty if c == 1 else tz)
                values[to + (3 + c) * right] += value * damped
                values[of + (3 + c) * down] += value
                if coordinates[i].kind == TRAVEL:
                    values[to + c * right] += sign * f[c] * damped
                    values[of + c * down] += sign * f[c]
