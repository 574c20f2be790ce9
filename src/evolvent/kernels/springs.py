"""Markers (points fixed to the ground, to a body or to a point mass) and spring-dampers between two of them."""

import math

from evolvent.jit import inlined, kernel, spring_law_at
from evolvent.kernels.rigid import add_wrench, point_kinematics

ON_BODY, ON_POINT = 0, 1


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


@kernel
def springs_energy(y, springs, markers, points, bodies):
    """Energy of all springs that have a stiffness (a user's law has none that is known), J."""
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


@inlined
def spring_forces(t, y, springs, markers, points, bodies, parameters):
    """Forces of all springs onto bodies and points; returns (power dissipated, power of the laws), W."""
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
