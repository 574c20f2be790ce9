"""Loads: distributed over a thread (force per length) and concentrated at a marker."""

import math

from evolvent.jit import REAL, VECTOR, force_law_at, indirect, inlined
from evolvent.kernels.profile import profile, window
from evolvent.kernels.rigid import DRIVEN, FREE
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.springs import marker_kinematics, push_marker
from evolvent.model import MODEL

UNIFORM, RADIATION, LAW, AT_MARKER, TORQUE = 0, 1, 2, 3, 4
#: Parameters of a force or torque: the vector, its frame, start, end and ramp (s); a profile may follow.
FRAME, START, END, RAMP, PROFILE = 3, 4, 5, 6, 7


@inlined
def radiation(pressure_width, reflectivity, sx, sy, sz, nx, ny, nz):
    """Force per length of sunlight on a flat strip, N/m.

    Notes
    -----
    f = p w |s.n| [(1 - R) s + 2 R (s.n) n], s the direction in which the light travels, n the strip's unit normal,
    R its specular reflectivity, the rest absorbed.
    """
    c = sx * nx + sy * ny + sz * nz
    k = pressure_width * abs(c)
    a, d = k * (1.0 - reflectivity), 2.0 * k * reflectivity * c
    return a * sx + d * nx, a * sy + d * ny, a * sz + d * nz


@inlined
def thread_load(t, loads, parameters, bodies, k, body, chord, x, v, e):
    """Force per length of load k at a thread's node, inertial axes, N/m.

    Parameters
    ----------
    x, v, e : (3,) float, node's position, velocity and outward tangent, inertial axes
    body : int, the body that carries the reel
    chord : (3,) float, direction of the blade's chord (the spool's axis), body axes
    """
    p = parameters[loads[k].first : loads[k].last]
    if loads[k].kind == LAW:
        return force_law_at(loads[k].law)(x, v, t, p)
    if loads[k].kind == UNIFORM:
        if p[3] != 0.0:
            return turn(bodies[body].R, p[0], p[1], p[2])
        return p[0], p[1], p[2]
    cx, cy, cz = turn(bodies[body].R, chord[0], chord[1], chord[2])
    nx, ny, nz = cross(e[0], e[1], e[2], cx, cy, cz)
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return radiation(p[0], p[1], p[2], p[3], p[4], nx / length, ny / length, nz / length)


@indirect(REAL(REAL, VECTOR, MODEL))
def concentrated_loads(t, y, model):
    """Forces and torques at markers; returns their power, W."""
    loads, markers, points, bodies = model.loads, model.markers, model.points, model.bodies
    parameters = model.parameters
    power = 0.0
    for k in range(loads.size):
        if loads[k].kind < AT_MARKER:
            continue
        p = parameters[loads[k].first : loads[k].last]
        value = window(t, p[START], p[END], p[RAMP])
        if value == 0.0:
            continue
        if p.size > PROFILE:
            value *= profile(t, loads[k].first + PROFILE, model)
        m = loads[k].target
        i = markers[m].index
        fx, fy, fz = value * p[0], value * p[1], value * p[2]
        if p[FRAME] != 0.0:
            fx, fy, fz = turn(bodies[i].R, fx, fy, fz)
        if loads[k].kind == AT_MARKER:
            x, yy, z, vx, vy, vz = marker_kinematics(y, markers, points, bodies, m)
            push_marker(markers, points, bodies, m, x, yy, z, fx, fy, fz)
            power += fx * vx + fy * vy + fz * vz
        else:
            bodies[i].F[3] += fx
            bodies[i].F[4] += fy
            bodies[i].F[5] += fz
            power += fx * bodies[i].w[0] + fy * bodies[i].w[1] + fz * bodies[i].w[2]
    return power


@inlined
def weight(y, bodies, points, gravity):
    """Gravity (or any uniform inertial acceleration) on bodies and points; returns its power, W."""
    gx, gy, gz = gravity[0], gravity[1], gravity[2]
    power = 0.0
    for b in range(bodies.size):
        m = bodies[b].mass
        if bodies[b].motion == DRIVEN or m == 0.0:
            continue
        if bodies[b].motion == FREE:
            bodies[b].F[0] += m * gx
            bodies[b].F[1] += m * gy
            bodies[b].F[2] += m * gz
            power += m * (gx * bodies[b].v[0] + gy * bodies[b].v[1] + gz * bodies[b].v[2])
    for i in range(points.size):
        m, v = points[i].mass, points[i].iv
        points[i].f[0] += m * gx
        points[i].f[1] += m * gy
        points[i].f[2] += m * gz
        power += m * (gx * y[v] + gy * y[v + 1] + gz * y[v + 2])
    return power
