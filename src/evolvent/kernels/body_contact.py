"""Contacts between two rigid bodies over an interval: gaps, forces, tangents and what a step leaves behind.

Body a has a sphere or a capsule, a segment with a radius; body b has one as well, or a plane. The force acts at the
point of contact on both bodies, so that momenta are kept. Friction follows the displacement of one surface along the
other: of a's material at the point of contact against b's, over a step from where it was in the axes of b at its start.
A sphere that rolls does not slide.

With d from the middle of b's segment to that of a's, the axes e of a and g of b, u = d.e, v = d.g, w = e.g and the
closest places s and t, the squared distance is

    p^2 = d.d + s^2 + t^2 + 2 s u - 2 t v - 2 s t w

and changes over a step, with means m of both ends, by

    2 dm.dd + 2 sm du - 2 tm dv - 2 (s t)m dw + rho,
    rho = 2 (sm + um - wm tm) ds + 2 (tm - vm - wm sm) dt

where s and t depend on u, v and w alone: rho, of third order where s and t lie inside, is shared among du, dv and dw in
proportion to them. u, v and w are quadratic in vectors that are fixed to the bodies, whose changes are
theta x mean. So the force lam times this over p0 + p1 does the work of the gap's change exactly; it depends on the
bodies' points against each other alone, and keeps both momenta. The distance from a plane is v.
"""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.kernels import contact_laws, rigid
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_turning, body_columns, turn_axis
from evolvent.kernels.sparse import SPARSE, first_entry
from evolvent.kernels.surfaces import END, PLANE, START, STATE, closest_positions
from evolvent.model import MODEL

_I = types.int64
_PAIR = types.UniTuple(REAL, 2)


@inlined
def _axes_of(row, bodies):
    """Of the bodies' current positions: arms of both middles, and the axes of both, inertial axes."""
    A, B, p, q, e, g = bodies[row.a].R, bodies[row.b].R, row.place_a, row.place_b, row.axis_a, row.axis_b
    return (
        turn(A, p[0], p[1], p[2]), turn(B, q[0], q[1], q[2]), turn(A, e[0], e[1], e[2]), turn(B, g[0], g[1], g[2])
    )  # fmt: skip


@inlined
def _apart(row, bodies, p, q):
    """d, from the middle of b to that of a."""
    x, z = bodies[row.a].x, bodies[row.b].x
    return x[0] + p[0] - z[0] - q[0], x[1] + p[1] - z[1] - q[1], x[2] + p[2] - z[2] - q[2]


@indirect(void(_I, MODEL))
def measure_bodies(what, model):
    """Gaps by the bodies' current positions, as `surfaces.measure_points`."""
    rows = model.body_contacts
    for k in range(rows.size):
        row = rows[k]
        p, q, e, g = _axes_of(row, model.bodies)
        d = _apart(row, model.bodies, p, q)
        u = d[0] * e[0] + d[1] * e[1] + d[2] * e[2]
        v = d[0] * g[0] + d[1] * g[1] + d[2] * g[2]
        w = e[0] * g[0] + e[1] * g[1] + e[2] * g[2]
        distance, s, t, (nx, ny, nz) = v, 0.0, 0.0, g
        if row.surface != PLANE:
            s, t = closest_positions(u, v, w, row.half_a, row.half_b)
            x, y, z = d[0] + s * e[0] - t * g[0], d[1] + s * e[1] - t * g[1], d[2] + s * e[2] - t * g[2]
            distance = math.sqrt(x * x + y * y + z * z)
            scale = 1.0 / distance if distance > 0.0 else 0.0
            nx, ny, nz = scale * x, scale * y, scale * z
        gap = distance - row.radius
        if what == START:
            row.gap, row.distance0, row.u0, row.v0, row.w0, row.s0, row.t0 = gap, distance, u, v, w, s, t
            continue
        row.gap1, row.distance, row.u1, row.v1, row.w1, row.s1, row.t1 = gap, distance, u, v, w, s, t
        n = row.n1
        n[0], n[1], n[2] = nx, ny, nz
        if what == END:
            row.energy = contact_laws.contact_energy(gap, row.stiffness, row.exponent)


@inlined
def _shares(row):
    """Changes of the distance by d, u, v and w over a step: factors of 2 dm.dd, du, dv and dw."""
    if row.surface == PLANE:
        return 0.0, 0.0, 1.0, 0.0
    s, t = 0.5 * (row.s0 + row.s1), 0.5 * (row.t0 + row.t1)
    u, v, w = 0.5 * (row.u0 + row.u1), 0.5 * (row.v0 + row.v1), 0.5 * (row.w0 + row.w1)
    ds, dt = row.s1 - row.s0, row.t1 - row.t0
    rho = 2.0 * ((s + u - w * t) * ds + (t - v - w * s) * dt)
    by_u, by_v, by_w = 2.0 * s, -2.0 * t, -(row.s0 * row.t0 + row.s1 * row.t1)
    length = min(row.half_a, row.half_b)
    du = row.u1 - row.u0 if row.half_a > 0.0 else 0.0
    dv = row.v1 - row.v0 if row.half_b > 0.0 else 0.0
    dw = length * (row.w1 - row.w0)
    total = du * du + dv * dv + dw * dw
    if rho != 0.0 and total > 0.0:
        by_u, by_v, by_w = by_u + rho * du / total, by_v + rho * dv / total, by_w + rho * length * dw / total
    scale = 1.0 / (row.distance0 + row.distance)
    return scale, scale * by_u, scale * by_v, scale * by_w


@indirect(_PAIR(VECTOR, REAL, REAL, REAL, REAL, REAL, MODEL))
def add_bodies(y, h, step, soft, chi, ratio, model):
    """`contact.add_contacts` of two bodies."""
    rows, bodies, lost, rubbed = model.body_contacts, model.bodies, 0.0, 0.0
    explicit, h = h < 0.0, max(h, 0.0)
    if h == 0.0:
        measure_bodies(STATE, model)
    for k in range(rows.size):
        row = rows[k]
        contact_laws.clear_point(row)
        n, c, rubbing, slide, on_a, on_b, n1 = row.n, row.c, row.rubbing, row.slide, row.on_a, row.on_b, row.n1
        for i in range(3):
            on_a[i] = on_a[3 + i] = on_b[i] = on_b[3 + i] = rubbing[i] = slide[i] = 0.0
            n[i] = n1[i]
        A, B, stiffness, exponent = bodies[row.a], bodies[row.b], row.stiffness, row.exponent
        p, q, e, g = _axes_of(row, bodies)
        d, s, size, by_u, by_v, by_w = _apart(row, bodies, p, q), row.s1, 1.0, 0.0, 0.0, 0.0
        if h != 0.0:
            by_d, by_u, by_v, by_w = _shares(row)
            for i in range(3):
                n[i] = 2.0 * by_d * d[i] + by_u * e[i] + by_v * g[i]
            s, size = 0.5 * (row.s0 + row.s1), math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        unit, r, xa, xb = (n[0] / size, n[1] / size, n[2] / size), row.radius_a, A.x, B.x
        c[0] = xa[0] + p[0] + s * e[0] - r * unit[0]  # where a's surface touches b
        c[1] = xa[1] + p[1] + s * e[1] - r * unit[1]
        c[2] = xa[2] + p[2] + s * e[2] - r * unit[2]
        before = contact_laws.contact_energy(row.gap, stiffness, exponent)
        stored = contact_laws.contact_energy(row.gap1, stiffness, exponent)
        row.energy, row.power = stored, 0.0
        if h == 0.0 and row.gap1 >= 0.0:
            continue
        arm_a, arm_b = (c[0] - xa[0], c[1] - xa[1], c[2] - xa[2]), (c[0] - xb[0], c[1] - xb[1], c[2] - xb[2])
        v = _relative_velocity(A, B, arm_a, arm_b)
        rate = n[0] * v[0] + n[1] * v[1] + n[2] * v[2]
        lam, filtered = contact_laws.press(row, row, row.gap, row.gap1, rate, h, soft, chi, ratio)
        if h == 0.0:
            row.power = -row.damper1 * rate
            lost += row.power
        elif lam == 0.0:
            lost += before - stored
            rubbed += contact_laws.bristle_energy(row, row)
            continue
        else:
            lost += (lam - filtered) * (row.gap - row.gap1) - (stored - before)
        f = (lam * n[0], lam * n[1], lam * n[2])
        if h == 0.0:
            rigid.add_wrench(on_a, arm_a[0], arm_a[1], arm_a[2], f[0], f[1], f[2])
            rigid.add_wrench(on_b, arm_b[0], arm_b[1], arm_b[2], -f[0], -f[1], -f[2])
        else:  # forces at the middles, and moments by the axes
            rigid.add_wrench(on_a, p[0], p[1], p[2], f[0], f[1], f[2])
            rigid.add_wrench(on_b, q[0], q[1], q[2], -f[0], -f[1], -f[2])
            ax, ay, az = cross(
                e[0], e[1], e[2],
                lam * (by_u * d[0] + by_w * g[0]), lam * (by_u * d[1] + by_w * g[1]), lam * (by_u * d[2] + by_w * g[2]),
            )  # fmt: skip
            bx, by, bz = cross(
                g[0], g[1], g[2],
                lam * (by_v * d[0] + by_w * e[0]), lam * (by_v * d[1] + by_w * e[1]), lam * (by_v * d[2] + by_w * e[2]),
            )  # fmt: skip
            on_a[3], on_a[4], on_a[5] = on_a[3] + ax, on_a[4] + ay, on_a[5] + az
            on_b[3], on_b[4], on_b[5] = on_b[3] + bx, on_b[4] + by, on_b[5] + bz
        if row.friction > 0.0:
            f, slip, held = _rub(y, row, A, B, arm_a, arm_b, v, unit, lam, h, step, row.account if explicit else -1)
            rubbed += slip if h != 0.0 else 0.0
            row.energy += held
            rubbing[0], rubbing[1], rubbing[2] = f
            rigid.add_wrench(on_a, arm_a[0], arm_a[1], arm_a[2], f[0], f[1], f[2])
            rigid.add_wrench(on_b, arm_b[0], arm_b[1], arm_b[2], -f[0], -f[1], -f[2])
        for i in range(6):
            A.F[i] += on_a[i]
            B.F[i] += on_b[i]
    return lost, rubbed


@inlined
def _relative_velocity(A, B, arm_a, arm_b):
    """Velocity of a's material at a point against that of b's."""
    va, vb, wa, wb = A.v, B.v, A.w, B.w
    ax, ay, az = cross(wa[0], wa[1], wa[2], arm_a[0], arm_a[1], arm_a[2])
    bx, by, bz = cross(wb[0], wb[1], wb[2], arm_b[0], arm_b[1], arm_b[2])
    return va[0] + ax - vb[0] - bx, va[1] + ay - vb[1] - by, va[2] + az - vb[2] - bz


@inlined
def _rub(y, row, A, B, arm_a, arm_b, v, n, lam, h, step, at):
    """`contact_laws.rub` of two bodies: the bristle's axes are those of b; it stands in the state at `at` >= 0."""
    axes, s, slide, X = contact_laws.body_axes(B.R), (h * v[0], h * v[1], h * v[2]), row.slide, row.X
    if h == 0.0 and step > 0.0:
        x, yy, z = turn_back(A.R, arm_a[0], arm_a[1], arm_a[2])
        qx, qy, qz = turn(row.Q, x, yy, z)
        x, yy, z = turn_back(B.R, arm_b[0], arm_b[1], arm_b[2])
        s = turn(B.R, x - X[0] - qx, yy - X[1] - qy, z - X[2] - qz)
    f, slip, held, moved = contact_laws.rub(y, at, row, row, axes, n, s, v, lam, step)
    slide[0], slide[1], slide[2] = moved
    return f, slip, held


@indirect(void(REAL, REAL, MODEL, SPARSE))
def add_body_tangents(h, c_rate, model, matrix):
    """`contact.add_tangents` of two bodies.

    Left out is how a turn of a capsule moves the point on its axis from which the distance is measured.
    """
    rows, bodies, K, factor = model.body_contacts, model.bodies, model.K12, 1.0 if h == 0.0 else 2.0
    for k in range(rows.size):
        row, lam = rows[k], rows[k].force
        if lam == 0.0:
            continue
        _, _, e, g = _axes_of(row, bodies)
        n, n1, t, c, r, rubbing = row.n, row.n1, row.t, row.c, row.radius_a, row.rubbing
        slope, size, part = row.d_gap + c_rate * row.d_rate, 1.0, 1.0
        if h != 0.0:
            size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
            part = row.distance / (row.distance0 + row.distance)
        unit = (n[0] / size, n[1] / size, n[2] / size)
        on_a = 1.0 if abs(row.s1) < row.half_a else 0.0
        on_b = 1.0 if abs(row.t1) < row.half_b else 0.0
        bent = 1.0 / row.distance if row.surface != PLANE and row.distance > 0.0 else 0.0
        if on_a * on_b != 0.0:  # of two axes that cross the distance is one from a plane
            bent = 0.0
        for i in range(3):
            for j in range(3):
                same = 1.0 if i == j else 0.0
                H = bent * (same - n1[i] * n1[j] - on_a * e[i] * e[j] - on_b * g[i] * g[j])
                K[i, j] = -factor * (slope * n[i] * n1[j] + lam * (H * part))
        at = (c[0] + r * unit[0], c[1] + r * unit[1], c[2] + r * unit[2])
        add_pair(matrix, model, row.a, row.b, at, (-lam * n[0], -lam * n[1], -lam * n[2]), K)
        if row.along == 0.0 and row.across == 0.0 and row.by_normal == 0.0:
            continue
        for i in range(3):
            for j in range(3):
                K[i, j] = factor * (contact_laws.drag_slope(row, i, j) + row.by_normal * slope * t[i] * n1[j])
        f = (-rubbing[0], -rubbing[1], -rubbing[2])
        add_pair(matrix, model, row.a, row.b, (c[0], c[1], c[2]), f, K)


@indirect(void(SPARSE, MODEL, _I, _I, types.UniTuple(REAL, 3), types.UniTuple(REAL, 3), MATRIX))
def add_pair(matrix, model, a, b, at, f, K):
    """Couple two bodies by a force on a at a point `at` fixed to it, and its opposite on b, that b alone sees.

    Parameters
    ----------
    f : 3 floats, the force on the left of the equations, inertial axes
    K : (3, 3) float, its derivative by the point as seen from b

    Notes
    -----
    A displacement r of the point against b, and a turn t of b, change f by t x f + K r, and the moment about b's origin
    by r x f + arm x K r in the axes of b. A turn of a beside that moves f against its arm: `sides.add_turning`.
    """
    bodies, J, local = model.bodies, model.J, model.e
    la, lb = local[1], local[2]
    xa, xb = bodies[a].x, bodies[b].x
    la[0], la[1], la[2] = turn_back(bodies[a].R, at[0] - xa[0], at[1] - xa[1], at[2] - xa[2])
    arm = (at[0] - xb[0], at[1] - xb[1], at[2] - xb[2])
    lb[0], lb[1], lb[2] = turn_back(bodies[b].R, arm[0], arm[1], arm[2])
    first_a, size_a = body_columns(model, a, la, True, J[0])
    first_b, size_b = body_columns(model, b, lb, True, J[1])
    if size_a > 0:
        add_turning(matrix, model, a, la, f[0], f[1], f[2])
    for side in range(2):
        size, first = (size_a, first_a) if side == 0 else (size_b, first_b)
        for c in range(size):
            turned = (0.0, 0.0, 0.0)
            if side == 0:
                rx, ry, rz = J[0, 0, c], J[0, 1, c], J[0, 2, c]
            else:
                rx, ry, rz = -J[1, 0, c], -J[1, 1, c], -J[1, 2, c]
                nx, ny, nz = turn_axis(bodies, b, bodies[b].motion, c)
                nx, ny, nz = turn(bodies[b].R, nx, ny, nz)
                turned = cross(nx, ny, nz, f[0], f[1], f[2])
            px = K[0, 0] * rx + K[0, 1] * ry + K[0, 2] * rz
            py = K[1, 0] * rx + K[1, 1] * ry + K[1, 2] * rz
            pz = K[2, 0] * rx + K[2, 1] * ry + K[2, 2] * rz
            mx, my, mz = cross(rx, ry, rz, f[0], f[1], f[2])
            sx, sy, sz = cross(arm[0], arm[1], arm[2], px, py, pz)
            mx, my, mz = turn_back(bodies[b].R, mx + sx, my + sy, mz + sz)
            px, py, pz = px + turned[0], py + turned[1], pz + turned[2]
            if size_a > 0:
                to, _, down = first_entry(matrix, first_a, first + c)
                for r in range(size_a):
                    matrix.values[to + r * down] += J[0, 0, r] * px + J[0, 1, r] * py + J[0, 2, r] * pz
            if size_b > 0:
                to, _, down = first_entry(matrix, first_b, first + c)
                for r in range(size_b):
                    nx, ny, nz = turn_axis(bodies, b, bodies[b].motion, r)
                    value = nx * mx + ny * my + nz * mz
                    if size_b == 6 and r < 3:
                        value += px if r == 0 else (py if r == 1 else pz)
                    matrix.values[to + r * down] -= value


@indirect(_PAIR(MODEL))
def end_bodies(model):
    """`contact.end_contacts` of two bodies."""
    bodies, rows, slip, damped = model.bodies, model.body_contacts, 0.0, 0.0
    for k in range(rows.size):
        row = rows[k]
        by_slip, by_damping = contact_laws.end_point(row, row, row.gap, row.gap1, row.slide)
        slip, damped = slip + by_slip, damped + by_damping
        A, B, X, Q, xa, xb = bodies[row.a].R, bodies[row.b].R, row.X, row.Q, bodies[row.a].x, bodies[row.b].x
        X[0], X[1], X[2] = turn_back(B, xa[0] - xb[0], xa[1] - xb[1], xa[2] - xb[2])
        for i in range(3):
            for j in range(3):
                Q[i, j] = B[0, i] * A[0, j] + B[1, i] * A[1, j] + B[2, i] * A[2, j]
    return slip, damped


def add_body_contact_bound(model, blocks):
    """Add the stiffness and damping of all contacts to blocks (2, bodies, 6, 6) of the bodies' unknowns. Not compiled.

    Of every contact as if its bodies touched, in any direction, and twice as of springs (`solvers.stability`).
    """
    for row in model.body_contacts:
        own = contact_laws.bound_of(row, "radius_a")
        both = 2.0 if np.all(model.bodies["motion"][[row["a"], row["b"]]] != rigid.DRIVEN) else 1.0
        for body, place, axis, half in (
            (row["a"], row["place_a"], row["axis_a"], row["half_a"]),
            (row["b"], row["place_b"], row["axis_b"], row["half_b"]),
        ):
            x, y, z = model.bodies["R"][body] @ (place + half * axis)
            J = np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
            for k in range(2):
                blocks[k, body] += both * own[k] * (J.T @ J)
