"""Loads: distributed over a thread (force per length) and concentrated at a marker."""

import math

from numba import types, void

from evolvent.jit import REAL, VECTOR, force_law_at, indirect, inlined
from evolvent.kernels.node_loads import law_gradient
from evolvent.kernels.profile import profile, window
from evolvent.kernels.rigid import DRIVEN, FREE
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.sides import ON_BODY, add_turning, side_columns
from evolvent.kernels.sparse import SPARSE, add_block
from evolvent.kernels.springs import ON_POINT, marker_kinematics, push_marker
from evolvent.model import MODEL

#: Kinds of loads: a force on a node of a thread, forces per length of threads, a force, a torque and
#: light on a panel at markers.
NODE, UNIFORM, RADIATION, LAW, AT_MARKER, TORQUE, PANEL = -1, 0, 1, 2, 3, 4, 5
#: Parameters of a force or torque: the vector, its frame, start, end and ramp (s); a profile may follow. Of a force by
#: a law the vector is (1, 1, 1), which multiplies what the law returns. Of a panel the vector is pressure times area
#: along the light, and its normal (body axes), specular and diffuse reflectivity follow.
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
def panel_force(px, py, pz, nx, ny, nz, specular, diffuse):
    """Force of light on a flat panel, N; p : pressure times area along the light, n : unit normal of either side.

    Notes
    -----
    F = p A |c| [(1 - specular) s + (2 specular |c| + 2/3 diffuse) m], s the direction in which the light travels, c =
    s.n, m the normal on the dark side (McInnes, 1999, eq. 2.17): what is neither reflected specularly nor diffusely, by
    Lambert's law, is absorbed.
    """
    size = math.sqrt(px * px + py * py + pz * pz)
    if size == 0.0:
        return 0.0, 0.0, 0.0
    c = (px * nx + py * ny + pz * nz) / size
    a, sign = abs(c), 1.0 if c > 0.0 else -1.0
    along, across = a * (1.0 - specular), sign * a * size * (2.0 * specular * a + 2.0 / 3.0 * diffuse)
    return along * px + across * nx, along * py + across * ny, along * pz + across * nz


@inlined
def thread_load(t, loads, model, bodies, k, body, chord, x, v, e):
    """Force per length of load k at a thread's node, N/m; of a force on that node, N; inertial axes.

    Parameters
    ----------
    x, v, e : (3,) float, node's position, velocity and outward tangent, inertial axes
    body : int, the body that carries the reel
    chord : (3,) float, direction of the blade's chord (the spool's axis), body axes
    """
    p = model.parameters[loads[k].first : loads[k].last]
    if loads[k].kind == NODE:
        value = window(t, p[START], p[END], p[RAMP])
        if value != 0.0 and p.size > PROFILE:
            value *= profile(t, loads[k].first + PROFILE, model)
        fx, fy, fz = value * p[0], value * p[1], value * p[2]
        if loads[k].law != 0 and value != 0.0:
            q = model.parameters[loads[k].law_first : loads[k].law_last]
            gx, gy, gz = force_law_at(loads[k].law)(x, v, t, q)
            fx, fy, fz = fx * gx, fy * gy, fz * gz
        if p[FRAME] != 0.0:
            return turn(bodies[body].R, fx, fy, fz)
        return fx, fy, fz
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


@inlined
def node_share(loads, k, i, span):
    """Length of thread, m, on which load k acts at node i: `span`; of a force on a node 1, and 0 at the others."""
    if loads[k].kind == NODE:
        return 1.0 if loads[k].node == i else 0.0
    return span


@inlined
def _note_state(y, k, model):
    """Position and velocity, of a torque angular velocity, of the marker of load k into model.scratch[1:]."""
    m, x, v = model.loads[k].target, model.scratch[1], model.scratch[2]
    x[0], x[1], x[2], v[0], v[1], v[2] = marker_kinematics(y, model.markers, model.points, model.bodies, m)
    if model.loads[k].kind == TORQUE:
        w = model.bodies[model.markers[m].index].w
        v[0], v[1], v[2] = w[0], w[1], w[2]


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
        if p.size > PROFILE and loads[k].kind != PANEL:
            value *= profile(t, loads[k].first + PROFILE, model)
        m = loads[k].target
        i = markers[m].index
        fx, fy, fz = value * p[0], value * p[1], value * p[2]
        if loads[k].law != 0:
            _note_state(y, k, model)
            q = parameters[loads[k].law_first : loads[k].law_last]
            gx, gy, gz = force_law_at(loads[k].law)(model.scratch[1], model.scratch[2], t, q)
            fx, fy, fz = fx * gx, fy * gy, fz * gz
        if p[FRAME] != 0.0:
            fx, fy, fz = turn(bodies[i].R, fx, fy, fz)
        if loads[k].kind == PANEL:
            nx, ny, nz = turn(bodies[i].R, p[7], p[8], p[9])
            fx, fy, fz = panel_force(fx, fy, fz, nx, ny, nz, p[10], p[11])
        if loads[k].kind != TORQUE:
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
def add_law_tangents(t, y, c_rate, model, matrix):
    """Tangents of all forces and torques by laws at markers."""
    for k in range(model.loads.size):
        if model.loads[k].kind >= AT_MARKER and model.loads[k].law != 0:
            add_law_tangent(t, y, k, c_rate, model, matrix)


@indirect(void(REAL, VECTOR, types.int64, REAL, MODEL, SPARSE))
def add_law_tangent(t, y, k, c_rate, model, matrix):
    """Add what the law of load k change with position, and c_rate times with velocity, but for turns of its axes."""
    loads, markers, bodies, f = model.loads, model.markers, model.bodies, model.flexible
    p = model.parameters[loads[k].first : loads[k].last]
    scale = window(t, p[START], p[END], p[RAMP]) * p[0]
    if scale == 0.0:
        return
    m = loads[k].target
    i, A, K, J, L = markers[m].index, f.K12, f.K24, f.J[0], f.J[1]
    _note_state(y, k, model)
    q = model.parameters[loads[k].law_first : loads[k].law_last]
    gx, gy, gz = force_law_at(loads[k].law)(model.scratch[1], model.scratch[2], t, q)
    law_gradient(loads[k].law, q, t, model, 0.0, A)
    for c in range(3):
        for d in range(3):
            K[12 + c, d] = A[c, d]
    law_gradient(loads[k].law, q, t, model, c_rate, A)
    for c in range(3):
        for d in range(3):
            K[15 + c, d] = A[c, d] - K[12 + c, d]  # by velocity
    if markers[m].kind == ON_POINT:
        at = model.points[i].iv - model.info.nq
        add_block(matrix, at, at, A, 0, 0, 3, 3, -scale)
        return
    if p[FRAME] != 0.0:
        gx, gy, gz = turn(bodies[i].R, gx, gy, gz)
        for row in range(12, 18, 3):
            for d in range(3):
                K[row, d], K[row + 1, d], K[row + 2, d] = turn(bodies[i].R, K[row, d], K[row + 1, d], K[row + 2, d])
    at, n = side_columns(model, ON_BODY, i, -1, markers[m].local, True, J)
    is_torque = loads[k].kind == TORQUE
    if is_torque:  # columns of the turn
        for r in range(3):
            for c in range(6):
                L[r, c] = 0.0
        if bodies[i].motion == FREE:
            for r in range(3):
                for c in range(3):
                    L[r, 3 + c] = bodies[i].R[r, c]
        elif n > 0:
            a = bodies[i].axis
            L[0, 0], L[1, 0], L[2, 0] = turn(bodies[i].R, a[0], a[1], a[2])
    for r in range(n):
        for c in range(n):
            value = 0.0
            for a in range(3):
                left = L[a, r] if is_torque else J[a, r]
                for b in range(3):
                    right = L[b, c] if is_torque else J[b, c]
                    value += left * (K[12 + a, b] * J[b, c] + K[15 + a, b] * right)
            K[r, c] = value
    if n > 0:
        add_block(matrix, at, at, K, 0, 0, n, n, -scale)
        if not is_torque and p[FRAME] == 0.0:
            add_turning(matrix, model, i, markers[m].local, -scale * gx, -scale * gy, -scale * gz)


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
