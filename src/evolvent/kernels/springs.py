"""Markers (points fixed to the ground, to a body or to a point mass) and spring-dampers between two of them."""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, entry, indirect, inlined, kernel, spring_law_at
from evolvent.kernels.rigid import DRIVEN, add_wrench, point_kinematics
from evolvent.kernels.sides import ON_COORDINATES, add_product, add_turning, side_columns
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL, family_type

ON_BODY, ON_POINT = 0, 1


@entry(VECTOR, family_type("markers"), family_type("points"), family_type("bodies"), types.int64)
@inlined
def marker_kinematics(y, markers, points, bodies, k):
    """Position and velocity of marker k, inertial axes: (x, y, z, vx, vy, vz)."""
    i = markers[k].index
    if markers[k].kind == ON_POINT:
        q, v = points[i].iq, points[i].iv
        return y[q], y[q + 1], y[q + 2], y[v], y[v + 1], y[v + 2]
    dx, dy, dz, vx, vy, vz = point_kinematics(bodies, i, markers[k].local[0], markers[k].local[1], markers[k].local[2])
    return bodies[i].x[0] + dx, bodies[i].x[1] + dy, bodies[i].x[2] + dz, vx, vy, vz


@inlined
def push_marker(markers, points, bodies, k, x, y, z, fx, fy, fz):
    """Apply a force at marker k, which stands at (x, y, z)."""
    i = markers[k].index
    if markers[k].kind == ON_POINT:
        points[i].f[0] += fx
        points[i].f[1] += fy
        points[i].f[2] += fz
    else:
        add_wrench(bodies[i].F, x - bodies[i].x[0], y - bodies[i].x[1], z - bodies[i].x[2], fx, fy, fz)


@entry(family_type("springs"), types.int64, REAL, REAL, REAL, VECTOR)
@inlined
def spring_tension(springs, k, extension, rate, t, parameters):
    """Elastic (or law) part and damping part of the tension of spring k, N."""
    if springs[k].law != 0:
        p = parameters[springs[k].first : springs[k].last]
        return spring_law_at(springs[k].law)(extension, rate, t, p), 0.0
    return springs[k].stiffness * extension, springs[k].damping * rate


@inlined
def spring_energy(stiffness, extension):
    """U = k e^2 / 2, J; the tension is dU/de = k e, its derivative k."""
    return 0.5 * stiffness * extension * extension


@kernel
def lateral_force(springs, k, ex, ey, ez, vx, vy, vz):
    """Force of spring k on its end b across the axis of its mount on the ground, and the power it dissipates.

    Notes
    -----
    Of the part s of the spring's vector across the axis u: -(k_l s + c_l s'), with the energy k_l s^2 / 2.
    """
    u, stiffness, damping = springs[k].axis, springs[k].lateral_stiffness, springs[k].lateral_damping
    along = ex * u[0] + ey * u[1] + ez * u[2]
    rate = vx * u[0] + vy * u[1] + vz * u[2]
    wx, wy, wz = vx - rate * u[0], vy - rate * u[1], vz - rate * u[2]
    return (
        -stiffness * (ex - along * u[0]) - damping * wx,
        -stiffness * (ey - along * u[1]) - damping * wy,
        -stiffness * (ez - along * u[2]) - damping * wz,
        damping * (wx * wx + wy * wy + wz * wz),
    )


@inlined
def lateral_energy(springs, k, ex, ey, ez):
    """k_l s^2 / 2, J."""
    u = springs[k].axis
    along = ex * u[0] + ey * u[1] + ez * u[2]
    return 0.5 * springs[k].lateral_stiffness * (ex * ex + ey * ey + ez * ez - along * along)


@indirect(REAL(VECTOR, MODEL))
def springs_energy(y, model):
    """Energy of all springs that have a stiffness (a user's law has none that is known), J."""
    springs, markers, points, bodies = model.springs, model.markers, model.points, model.bodies
    energy = 0.0
    for k in range(springs.size):
        if springs[k].law == 0:
            a = marker_kinematics(y, markers, points, bodies, springs[k].a)
            b = marker_kinematics(y, markers, points, bodies, springs[k].b)
            dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            extension = math.sqrt(dx * dx + dy * dy + dz * dz) - springs[k].length
            energy += spring_energy(springs[k].stiffness, extension)
            energy += lateral_energy(springs, k, dx, dy, dz)
    return energy


@indirect(types.UniTuple(REAL, 2)(REAL, VECTOR, MODEL))
def spring_forces(t, y, model):
    """Forces of all springs onto bodies and points; returns (power dissipated, power of the laws), W."""
    springs, markers, points, bodies = model.springs, model.markers, model.points, model.bodies
    parameters = model.parameters
    dissipated = 0.0
    law_power = 0.0
    for k in range(springs.size):
        a, b = springs[k].a, springs[k].b
        ax, ay, az, avx, avy, avz = marker_kinematics(y, markers, points, bodies, a)
        bx, by, bz, bvx, bvy, bvz = marker_kinematics(y, markers, points, bodies, b)
        ex, ey, ez = bx - ax, by - ay, bz - az
        length = math.sqrt(ex * ex + ey * ey + ez * ez)
        if length == 0.0:
            continue
        scale = 1.0 / length
        ex *= scale
        ey *= scale
        ez *= scale
        rate = ex * (bvx - avx) + ey * (bvy - avy) + ez * (bvz - avz)
        elastic, damping = spring_tension(springs, k, length - springs[k].length, rate, t, parameters)
        if springs[k].law != 0:
            law_power -= elastic * rate
        dissipated += damping * rate
        if springs[k].lateral_stiffness != 0.0 or springs[k].lateral_damping != 0.0:
            fx, fy, fz, power = lateral_force(springs, k, bx - ax, by - ay, bz - az, bvx, bvy, bvz)
            dissipated += power
            push_marker(markers, points, bodies, b, bx, by, bz, fx, fy, fz)
        T = elastic + damping
        push_marker(markers, points, bodies, a, ax, ay, az, T * ex, T * ey, T * ez)
        push_marker(markers, points, bodies, b, bx, by, bz, -T * ex, -T * ey, -T * ez)
    return dissipated, law_power


@indirect(void(REAL, VECTOR, REAL, MODEL, SPARSE))
def spring_tangents(t, y, c_rate, model, matrix):
    """Tangents of all springs; those of users' laws by central differences."""
    springs, bodies, points = model.springs, model.bodies, model.points
    Ja, Jb = model.flexible.J[0], model.flexible.J[1]
    for k in range(springs.size):
        ma, mb = springs[k].a, springs[k].b
        a = marker_kinematics(y, model.markers, points, bodies, ma)
        b = marker_kinematics(y, model.markers, points, bodies, mb)
        dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        if length == 0.0 and (springs[k].length != 0.0 or springs[k].law != 0):
            continue
        nx, ny, nz = (dx / length, dy / length, dz / length) if length > 0.0 else (0.0, 0.0, 0.0)
        rate = nx * (b[3] - a[3]) + ny * (b[4] - a[4]) + nz * (b[5] - a[5])
        extension = length - springs[k].length
        elastic, damped = spring_tension(springs, k, extension, rate, t, model.parameters)
        tension = elastic + damped
        along = springs[k].stiffness + c_rate * springs[k].damping
        if springs[k].law != 0:
            d = 1e-6 * length
            more, _ = spring_tension(springs, k, extension + d, rate, t, model.parameters)
            less, _ = spring_tension(springs, k, extension - d, rate, t, model.parameters)
            along = (more - less) / (2.0 * d)
            if c_rate != 0.0:
                e = 1e-6 * max(abs(rate), length)  # of a spring at rest: its length in a second
                faster, _ = spring_tension(springs, k, extension, rate + e, t, model.parameters)
                slower, _ = spring_tension(springs, k, extension, rate - e, t, model.parameters)
                along += c_rate * (faster - slower) / (2.0 * e)
        across = tension / length if length > 0.0 else springs[k].stiffness  # of a spring without length of its own
        p = along - across
        K00, K11, K22 = across + p * nx * nx, across + p * ny * ny, across + p * nz * nz
        K01, K02, K12 = p * nx * ny, p * nx * nz, p * ny * nz
        sideways = springs[k].lateral_stiffness + c_rate * springs[k].lateral_damping
        if sideways != 0.0:
            u = springs[k].axis
            K00 += sideways * (1.0 - u[0] * u[0])
            K11 += sideways * (1.0 - u[1] * u[1])
            K22 += sideways * (1.0 - u[2] * u[2])
            K01 -= sideways * u[0] * u[1]
            K02 -= sideways * u[0] * u[2]
            K12 -= sideways * u[1] * u[2]
        ra, na = _marker_columns(model, ma, Ja)
        rb, nb = _marker_columns(model, mb, Jb)
        add_product(matrix, ra, na, Ja, K00, K01, K02, K11, K12, K22, ra, na, Ja, 1.0)
        add_product(matrix, rb, nb, Jb, K00, K01, K02, K11, K12, K22, rb, nb, Jb, 1.0)
        add_product(matrix, ra, na, Ja, K00, K01, K02, K11, K12, K22, rb, nb, Jb, -1.0)
        add_product(matrix, rb, nb, Jb, K00, K01, K02, K11, K12, K22, ra, na, Ja, -1.0)
        for side in range(2):
            marker, sign = (ma, -1.0) if side == 0 else (mb, 1.0)
            if model.markers[marker].kind == ON_BODY:
                s = sign * tension
                gx, gy, gz = s * nx, s * ny, s * nz
                if side == 1 and sideways != 0.0:
                    fx, fy, fz, _ = lateral_force(springs, k, dx, dy, dz, b[3] - a[3], b[4] - a[4], b[5] - a[5])
                    gx, gy, gz = gx - fx, gy - fy, gz - fz
                add_turning(matrix, model, model.markers[marker].index, model.markers[marker].local, gx, gy, gz)


@inlined
def _marker_columns(model, marker, J):
    """Columns of a marker: its first unknown and their number."""
    index, local = model.markers[marker].index, model.markers[marker].local
    if model.markers[marker].kind == ON_POINT:
        return side_columns(model, ON_COORDINATES, -1, model.points[index].iv, local, True, J)
    return side_columns(model, ON_BODY, index, -1, local, True, J)


# ---------------------------------------------------------------------------------------------- bound; not compiled


def add_spring_bound(y, model, body, point):
    """Add diagonal blocks of stiffness and damping of all springs, tightened ones stiff across their line as well.

    Parameters
    ----------
    body, point : (2, nb, 6, 6), (2, np, 3, 3) float, stiffness and damping felt by bodies and points

    Notes
    -----
    k (x_a - x_b)^2 <= 2 k (x_a^2 + x_b^2): blocks count twice where both ends move. After `kinematics`.
    """
    markers, moves = model.markers, model.bodies["motion"] != DRIVEN
    for number, spring in enumerate(model.springs):
        ends = [int(spring["a"]), int(spring["b"])]
        x = [np.array(marker_kinematics(y, markers, model.points, model.bodies, k)[:3]) for k in ends]
        free = [markers["kind"][k] == ON_POINT or moves[markers["index"][k]] for k in ends]
        e = x[1] - x[0]
        length = float(np.linalg.norm(e))
        e = e / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
        along = np.outer(e, e)
        tight = max(1.0 - float(spring["length"]) / length, 0.0) if length > 0.0 else 0.0
        stiffness, damping = float(spring["stiffness"]), float(spring["damping"])
        if spring["law"] != 0:
            stiffness, damping = law_slopes(model, number, length - float(spring["length"]), max(length, 1e-3))
        across = np.eye(3) - np.outer(spring["axis"], spring["axis"])
        blocks = [
            stiffness * (along + tight * (np.eye(3) - along)) + float(spring["lateral_stiffness"]) * across,
            damping * along + float(spring["lateral_damping"]) * across,
        ]
        for k, position, moving in zip(ends, x, free, strict=True):
            index = markers["index"][k]
            for what in range(2):
                block = blocks[what] * (2.0 if all(free) else 1.0)
                if not moving:
                    continue
                if markers["kind"][k] == ON_POINT:
                    point[what, index] += block
                else:
                    d = position - model.bodies["x"][index]
                    arm = np.array([[0.0, -d[2], d[1]], [d[2], 0.0, -d[0]], [-d[1], d[0], 0.0]])
                    J = np.hstack([np.eye(3), -arm])
                    body[what, index] += J.T @ block @ J


def law_slopes(model, k, extension, scale):
    """Stiffness and damping of a spring with a law at the start, by central differences; never below zero."""

    def tension(e, rate):
        return float(spring_tension(model.springs, k, e, rate, 0.0, model.parameters)[0])

    d = 1e-6 * scale
    stiffness = (tension(extension + d, 0.0) - tension(extension - d, 0.0)) / (2.0 * d)
    damping = (tension(extension, d) - tension(extension, -d)) / (2.0 * d)
    return max(stiffness, 0.0), max(damping, 0.0)
