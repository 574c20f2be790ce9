"""Loads: distributed over a thread (force per length) and concentrated at a marker."""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.compiled.lookups import force_law_at
from evolvent.kernels.law_means import add_mean_gradient, force_of, mean_force, turned_share
from evolvent.kernels.law_slopes import force_law_gradient, torque_law_turns
from evolvent.kernels.markers import ON_POINT, marker_kinematics, push_marker
from evolvent.kernels.profile import factor_at, profile, window
from evolvent.kernels.rigid import DRIVEN, FREE
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import ON_BODY, add_turning, side_columns, turn_axis
from evolvent.kernels.work import note_load
from evolvent.model import MODEL

USED_FOR = "loads"
_I = types.int64
#: Kinds of loads: a force on a node of a thread, forces per length of threads, a force, a torque and
#: light on a panel at markers.
NODE, UNIFORM, RADIATION, LAW, AT_MARKER, TORQUE, PANEL = -1, 0, 1, 2, 3, 4, 5
#: Parameters of a force or torque: the vector, its frame, start, end and ramp (s); a profile may follow. Of a force by
#: a law the vector is (1, 1, 1), which multiplies what the law returns. Of a panel the vector is pressure times area
#: along the light, and its normal (body axes), specular and diffuse reflectivity of the side to which it points and of
#: the other one follow. Of light on a thread: pressure
#: times width along the light, specular and diffuse reflectivity.
FRAME, START, END, RAMP, PROFILE, TOP_SIDE, BOTTOM_SIDE = 3, 4, 5, 6, 7, 10, 12
#: `attitude` of a torque that depends on the rotation of its body: over an interval its work is that of the angle.
FOLLOWS = 2


@inlined
def vector_size(kind):
    """Number of first parameters of a load that multiply it: of a thread's law none."""
    return 0 if kind == LAW else 3


@inlined
def panel_force(px, py, pz, nx, ny, nz, specular, diffuse):
    """Force of light on a flat panel or strip: p : pressure times area (N) or width (N/m) along the light, n : normal.

    Notes
    -----
    The unit normal n is that of either side.

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
def lit_side(p, nx, ny, nz):
    """Index among the parameters p of the reflectivities of the side of a panel that is lit; n : normal."""
    return TOP_SIDE if p[0] * nx + p[1] * ny + p[2] * nz <= 0.0 else BOTTOM_SIDE


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
            gx, gy, gz = force_of(loads[k].law, x, v, t, q, model)
            fx, fy, fz = fx * gx, fy * gy, fz * gz
        if p[FRAME] != 0.0:
            return turn(bodies[body].R, fx, fy, fz)
        return fx, fy, fz
    if loads[k].kind == LAW:
        fx, fy, fz = force_of(loads[k].law, x, v, t, p, model)
        return loads[k].scale * fx, loads[k].scale * fy, loads[k].scale * fz
    if loads[k].kind == UNIFORM:
        if p[3] != 0.0:
            return turn(bodies[body].R, p[0], p[1], p[2])
        return p[0], p[1], p[2]
    cx, cy, cz = turn(bodies[body].R, chord[0], chord[1], chord[2])
    nx, ny, nz = cross(e[0], e[1], e[2], cx, cy, cz)
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return panel_force(p[0], p[1], p[2], nx / length, ny / length, nz / length, p[3], p[4])


@inlined
def node_share(loads, k, i, span):
    """Length of thread, m, on which load k acts at node i: `span`; of a force on a node 1, and 0 at the others."""
    if loads[k].kind == NODE:
        return 1.0 if loads[k].node == i else 0.0
    return span


@inlined
def _note_state(y, k, model):
    """What the law of load k is called with: position and velocity of its marker, of a torque angular velocity.

    With `attitude` the position is a pose: the rotation matrix of the body, whose columns are its axes, follows it, row
    after row. Returns the velocity of the marker as well.
    """
    m, x, v, rate = model.loads[k].target, model.scratch[1], model.scratch[2], model.scratch[0]
    px, py, pz, rate[0], rate[1], rate[2] = marker_kinematics(y, model.markers, model.points, model.bodies, m)
    v[0], v[1], v[2] = rate[0], rate[1], rate[2]
    if model.loads[k].kind == TORQUE:
        w = model.bodies[model.markers[m].index].w
        v[0], v[1], v[2] = w[0], w[1], w[2]
    if model.loads[k].attitude != 0:
        x, R = model.pose, model.bodies[model.markers[m].index].R
        for r in range(3):
            for c in range(3):
                x[3 + 3 * r + c] = R[r, c]
    x[0], x[1], x[2] = px, py, pz
    return x, v, rate


@inlined
def panel_slopes(px, py, pz, nx, ny, nz, specular, diffuse, G):
    """Derivative G : (3, 3) of `panel_force` by the normal."""
    size = math.sqrt(px * px + py * py + pz * pz)
    c = (px * nx + py * ny + pz * nz) / size if size > 0.0 else 0.0
    a, sign = abs(c), 1.0 if c > 0.0 else -1.0
    across = c * size * (2.0 * specular * a + 2.0 / 3.0 * diffuse)
    along, turned = sign * (1.0 - specular), size * (4.0 * specular * a + 2.0 / 3.0 * diffuse)
    p, n = (px, py, pz), (nx, ny, nz)
    for i in range(3):
        for j in range(3):
            G[i, j] = (along * p[i] + turned * n[i]) * (p[j] / size if size > 0.0 else 0.0)
        G[i, i] += across


@inlined
def _profile_of(k, model):
    """Index of the profile of load k at its marker among the parameters, or -1."""
    row = model.loads[k]
    return row.first + PROFILE if row.last - row.first > PROFILE and row.kind != PANEL else -1


@inlined
def _factor(t, k, model):
    """Factor of load k at its marker that its times, its profile and the length of its rod make."""
    p = model.parameters[model.loads[k].first : model.loads[k].last]
    return _share(k, model) * factor_at(t, p[START], p[END], p[RAMP], _profile_of(k, model), model)


@inlined
def _share(k, model):
    """Part of the length of its rod that is out, on which load k acts; 1 of other loads."""
    rod = model.loads[k].rod - 1
    return model.rods[rod].out / model.rods[rod].length if rod >= 0 else 1.0


@inlined
def _load_at_marker(t, y, k, value, model):
    """Force or torque of load k at its marker, inertial axes: three floats.

    Parameters
    ----------
    value : float, `_factor`
    """
    loads, bodies = model.loads, model.bodies
    p = model.parameters[loads[k].first : loads[k].last]
    i = model.markers[loads[k].target].index
    fx, fy, fz = value * p[0], value * p[1], value * p[2]
    if loads[k].law != 0:
        x, v, rate = _note_state(y, k, model)
        q = model.parameters[loads[k].law_first : loads[k].law_last]
        if model.info.over == 0.0:
            gx, gy, gz = force_law_at(loads[k].law)(x, v, t, q)
        else:
            share = turned_share(model.info.over, v) if loads[k].attitude == FOLLOWS else 1.0
            gx, gy, gz = mean_force(loads[k].law, x, rate, v, t, q, model)
            gx, gy, gz = share * gx, share * gy, share * gz
        fx, fy, fz = fx * gx, fy * gy, fz * gz
    if p[FRAME] != 0.0:
        fx, fy, fz = turn(bodies[i].R, fx, fy, fz)
    if loads[k].kind == PANEL:
        nx, ny, nz = turn(bodies[i].R, p[7], p[8], p[9])
        side = lit_side(p, nx, ny, nz)
        fx, fy, fz = panel_force(fx, fy, fz, nx, ny, nz, p[side], p[side + 1])
    return fx, fy, fz


@indirect(REAL(REAL, VECTOR, MODEL))
def concentrated_loads(t, y, model):
    """Forces and torques at markers; returns their power, W."""
    loads, markers, points, bodies = model.loads, model.markers, model.points, model.bodies
    power = 0.0
    for k in range(loads.size):
        if loads[k].kind < AT_MARKER:
            continue
        value = _factor(t, k, model)
        if value == 0.0:
            continue
        fx, fy, fz = _load_at_marker(t, y, k, value, model)
        m = loads[k].target
        i = markers[m].index
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


@indirect(void(_I, VECTOR, VECTOR, REAL, MODEL))
def evaluate_loads(n, times, y, factor, model):
    """Evaluate loads at markers, times `factor`, at sample n, after `kinematics`, into their records."""
    loads, markers, bodies = model.loads, model.markers, model.bodies
    for k in range(loads.size):
        if loads[k].kind < AT_MARKER:
            continue
        row, f, m = loads[k], _load_at_marker(times[n], y, k, _share(k, model), model), loads[k].target
        x, yy, z, vx, vy, vz = marker_kinematics(y, markers, model.points, bodies, m)
        if row.kind == TORQUE:
            w = bodies[markers[m].index].w
            vx, vy, vz = w[0], w[1], w[2]
        p = model.parameters[row.first : row.last]
        keeps = row.law == 0 and row.kind == AT_MARKER and p[FRAME] == 0.0  # its direction
        rate, along = f[0] * vx + f[1] * vy + f[2] * vz, f[0] * x + f[1] * yy + f[2] * z if keeps else math.nan
        value = note_load(row, n, times, factor, rate, along, p[START], p[END], p[RAMP], _profile_of(k, model), model)
        vector, middle = row.vector, row.middle
        vector[0], vector[1], vector[2] = value * f[0], value * f[1], value * f[2]
        middle[0], middle[1], middle[2] = x, yy, z


# ---------------------------------------------------------------------------------------------- tangent


@inlined
def add_load_tangents(t, y, c_rate, model, matrix):
    """Tangents of all forces and torques at markers; see `add_load_tangent`."""
    for k in range(model.loads.size):
        on_body = model.loads[k].kind >= AT_MARKER and model.markers[model.loads[k].target].kind == ON_BODY
        if on_body or (model.loads[k].kind >= AT_MARKER and model.loads[k].law != 0):
            add_load_tangent(t, y, k, c_rate, model, matrix)


@inlined
def _law_slopes(t, y, k, value, c_rate, model, G):
    """Derivatives of load k, a law: by position, G[:3, :3], velocity, G[3:6, :3], and turn of a torque, G[6:9, :3]."""
    loads = model.loads
    p = model.parameters[loads[k].first : loads[k].last]
    q = model.parameters[loads[k].law_first : loads[k].law_last]
    x, v, rate = _note_state(y, k, model)
    if model.info.over != 0.0:
        for c in range(9):
            G[c, 0] = G[c, 1] = G[c, 2] = 0.0
        add_mean_gradient(loads[k].law, q, t, x, rate, v, 1.0, 0.0, 1.0, G, 0, model)
        add_mean_gradient(loads[k].law, q, t, x, rate, v, 0.0, 1.0, 1.0, G, 3, model)
    else:
        force_law_gradient(loads[k].law, q, t, x, v, 1.0, 0.0, G, 0)
        moves = c_rate != 0.0 or v[0] != 0.0 or v[1] != 0.0 or v[2] != 0.0
        force_law_gradient(loads[k].law, q, t, x, v, 0.0, 1.0 if moves else 0.0, G, 3)
        if loads[k].attitude != 0:
            torque_law_turns(loads[k].law, q, t, x, v, G, 6)
    for c in range(3):
        for d in range(3):
            G[c, d] *= value * p[c]
            G[3 + c, d] *= value * p[c]
            G[6 + c, d] *= value * p[c]


@inlined
def _add_change(K, scale, G, row, J, n):
    """K[18:21, :n] += scale G[row : row + 3, :3] J."""
    for a in range(3):
        for c in range(n):
            K[18 + a, c] += scale * (G[row + a, 0] * J[0, c] + G[row + a, 1] * J[1, c] + G[row + a, 2] * J[2, c])


@inlined
def _fixed_columns(model, i, x, y, z, J):
    """Columns J of a vector (x, y, z), inertial axes, that is fixed to body i."""
    local = model.e[2]
    local[0], local[1], local[2] = turn_back(model.bodies[i].R, x, y, z)
    side_columns(model, ON_BODY, i, -1, local, False, J)


@inlined
def _turn_columns(bodies, i, n, J):
    """Columns J of the turn of body i, inertial axes."""
    for c in range(n):
        ax, ay, az = turn_axis(bodies, i, bodies[i].motion, c)
        J[0, c], J[1, c], J[2, c] = turn(bodies[i].R, ax, ay, az)


@indirect(void(REAL, VECTOR, _I, REAL, MODEL, SPARSE))
def add_load_tangent(t, y, k, c_rate, model, matrix):
    """Add what load k changes with position and turn of its marker, and c_rate times with its velocity.

    Notes
    -----
    A force f at a point with the columns J has the generalised forces J^T f, a torque L^T f with those L of the turn.
    f changes with the columns of the position, with those of the velocity, c_rate J and w x d that turns with the body,
    and with those of the axes or of the normal that it depends on. What J and L change is `add_turning` of a force, and
    (R^T f) x dtheta of a torque in the axes of a free body.
    """
    loads, markers, bodies = model.loads, model.markers, model.bodies
    p = model.parameters[loads[k].first : loads[k].last]
    value, m = _factor(t, k, model), loads[k].target
    if value == 0.0:
        return
    fx, fy, fz = _load_at_marker(t, y, k, value, model)
    i, by_law, is_torque, G, K, J, L = (
        markers[m].index, loads[k].law != 0, loads[k].kind == TORQUE, model.K12, model.K24, model.J[0], model.J[1]
    )  # fmt: skip
    if by_law:
        _law_slopes(t, y, k, value, c_rate, model, G)
    if markers[m].kind == ON_POINT:
        at = model.points[i].iv - model.info.nq
        add_block(matrix, at, at, G, 0, 0, 3, 3, -1.0)
        add_block(matrix, at, at, G, 3, 0, 3, 3, -c_rate)
        return
    local, R = markers[m].local, bodies[i].R
    at, n = side_columns(model, ON_BODY, i, -1, local, True, J)
    if n == 0:
        return
    for a in range(3):
        for c in range(n):
            K[18 + a, c] = 0.0
    if p[FRAME] != 0.0:
        if by_law:
            for row in range(0, 9, 3):
                for d in range(3):
                    G[row, d], G[row + 1, d], G[row + 2, d] = turn(R, G[row, d], G[row + 1, d], G[row + 2, d])
        _fixed_columns(model, i, fx, fy, fz, L)
        for a in range(3):
            for c in range(n):
                K[18 + a, c] += L[a, c]
    if by_law:
        _add_change(K, 1.0, G, 0, J, n)
        if loads[k].attitude != 0:
            _turn_columns(bodies, i, n, L)
            _add_change(K, 1.0, G, 6, L, n)
        w = bodies[i].w
        wx, wy, wz = w[0], w[1], w[2]
        if not is_torque:
            dx, dy, dz = turn(R, local[0], local[1], local[2])
            wx, wy, wz = cross(w[0], w[1], w[2], dx, dy, dz)
        _fixed_columns(model, i, wx, wy, wz, L)
        _add_change(K, 1.0, G, 3, L, n)
        if is_torque:
            _turn_columns(bodies, i, n, L)
            _add_change(K, c_rate, G, 3, L, n)
        else:
            _add_change(K, c_rate, G, 3, J, n)
    elif loads[k].kind == PANEL:
        nx, ny, nz = turn(R, p[7], p[8], p[9])
        side = lit_side(p, nx, ny, nz)
        panel_slopes(value * p[0], value * p[1], value * p[2], nx, ny, nz, p[side], p[side + 1], G)
        _fixed_columns(model, i, nx, ny, nz, L)
        _add_change(K, 1.0, G, 0, L, n)
    if is_torque:
        _turn_columns(bodies, i, n, J)
    for r in range(n):
        for c in range(n):
            K[r, c] = -(J[0, r] * K[18, c] + J[1, r] * K[19, c] + J[2, r] * K[20, c])
    if not is_torque:
        add_turning(matrix, model, i, local, -fx, -fy, -fz)
    elif bodies[i].motion == FREE:  # a torque turns with its axes
        tx, ty, tz = turn_back(R, fx, fy, fz)
        for c in range(3):
            ux, uy, uz = cross(tx, ty, tz, 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2))
            K[3, 3 + c] -= ux
            K[4, 3 + c] -= uy
            K[5, 3 + c] -= uz
    add_block(matrix, at, at, K, 0, 0, n, n, 1.0)


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
