"""Contacts between two rigid bodies: their forces, tangents and what a step leaves behind.

Body a has a sphere or a capsule, a segment with a radius; body b has one as well, or a plane. The force acts at the
point of contact on both bodies, so that momenta are kept. Friction follows the displacement of one surface along the
other over the step: of a's material at the point of contact, from where it was in the axes of b at the step's start.
A sphere that rolls does not slide.
"""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import MATRIX, REAL, indirect, inlined
from evolvent.kernels import contact_laws, rigid, surfaces
from evolvent.kernels.contact import DEPTH
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_turning, body_columns, turn_axis
from evolvent.kernels.sparse import SPARSE, first_entry
from evolvent.model import MODEL

_I = types.int64


@inlined
def axes_of(row, bodies):
    """Of the bodies' current positions: d from the middle of b to that of a, and the axes of both, inertial axes."""
    a, b, p, q = row.a, row.b, row.place_a, row.place_b
    px, py, pz = turn(bodies[a].R, p[0], p[1], p[2])
    qx, qy, qz = turn(bodies[b].R, q[0], q[1], q[2])
    xa, xb, e, g = bodies[a].x, bodies[b].x, row.axis_a, row.axis_b
    ex, ey, ez = turn(bodies[a].R, e[0], e[1], e[2])
    gx, gy, gz = turn(bodies[b].R, g[0], g[1], g[2])
    d = (xa[0] + px - xb[0] - qx, xa[1] + py - xb[1] - qy, xa[2] + pz - xb[2] - qz)
    return d, (ex, ey, ez), (gx, gy, gz)


@inlined
def measure(row, d, e, g):
    """Gap and normal (from b to a): (gap, distance, normal, u, v, w, s, t), of `surfaces.closest_positions`."""
    u = d[0] * e[0] + d[1] * e[1] + d[2] * e[2]
    v = d[0] * g[0] + d[1] * g[1] + d[2] * g[2]
    w = e[0] * g[0] + e[1] * g[1] + e[2] * g[2]
    if row.surface == surfaces.PLANE:
        return v - row.radius, v, g, u, v, w, 0.0, 0.0
    s, t = surfaces.closest_positions(u, v, w, row.half_a, row.half_b)
    x, y, z = d[0] + s * e[0] - t * g[0], d[1] + s * e[1] - t * g[1], d[2] + s * e[2] - t * g[2]
    distance = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / distance if distance > 0.0 else 0.0
    return distance - row.radius, distance, (scale * x, scale * y, scale * z), u, v, w, s, t


@inlined
def position_of(row, bodies, e, s, n):
    """Where a's surface touches b, inertial axes: on the line from its axis along the normal n."""
    p, x = row.place_a, bodies[row.a].x
    px, py, pz = turn(bodies[row.a].R, p[0], p[1], p[2])
    r = row.radius_a
    return x[0] + px + s * e[0] - r * n[0], x[1] + py + s * e[1] - r * n[1], x[2] + pz + s * e[2] - r * n[2]


@inlined
def push(row, bodies, at, f):
    """Add the force f on a, and -f on b, both at the point `at`, to the bodies' wrenches and the contact's moments."""
    A, B, xa, xb = bodies[row.a].F, bodies[row.b].F, bodies[row.a].x, bodies[row.b].x
    rigid.add_wrench(A, at[0] - xa[0], at[1] - xa[1], at[2] - xa[2], f[0], f[1], f[2])
    rigid.add_wrench(B, at[0] - xb[0], at[1] - xb[1], at[2] - xb[2], -f[0], -f[1], -f[2])
    x, y, z = cross(at[0] - xa[0], at[1] - xa[1], at[2] - xa[2], f[0], f[1], f[2])
    m = row.moment_a
    m[0], m[1], m[2] = m[0] + x, m[1] + y, m[2] + z
    x, y, z = cross(at[0] - xb[0], at[1] - xb[1], at[2] - xb[2], -f[0], -f[1], -f[2])
    m = row.moment_b
    m[0], m[1], m[2] = m[0] + x, m[1] + y, m[2] + z
    m = row.f
    m[0], m[1], m[2] = m[0] + f[0], m[1] + f[1], m[2] + f[2]


@inlined
def clear(row):
    """Clear what a contact holds of the last forces."""
    contact_laws.clear_point(row)
    f, g, m, k, s = row.f, row.rubbing, row.moment_a, row.moment_b, row.slide
    for i in range(3):
        f[i] = g[i] = m[i] = k[i] = s[i] = 0.0
    row.energy, row.power = 0.0, 0.0


@indirect(void(REAL, MODEL))
def add_body_contacts(step, model):
    """Forces of all contacts between bodies into the bodies' wrenches, by the bodies' current positions.

    Parameters
    ----------
    step : float, s, as of `contact.add_contacts`
    """
    bodies, rows = model.bodies, model.flexible.body_contacts
    for k in range(rows.size):
        row = rows[k]
        clear(row)
        d, e, g = axes_of(row, bodies)
        gap, distance, n, _, _, _, s, t = measure(row, d, e, g)
        row.gap1, row.distance, row.s1, row.t1 = gap, distance, s, t
        normal = row.n
        normal[0], normal[1], normal[2] = n
        at = position_of(row, bodies, e, s, n)
        c = row.c
        c[0], c[1], c[2] = at
        if gap >= 0.0:
            continue
        vx, vy, vz = _relative_velocity(row, bodies, at)
        rate = n[0] * vx + n[1] * vy + n[2] * vz
        force, d_gap, d_rate = contact_laws.pushing_force(
            row.law, gap, rate, row.gap, row.stiffness, row.exponent, row.damping, row.viscous
        )
        row.force, row.d_gap, row.d_rate = force, d_gap, d_rate
        push(row, bodies, at, (force * n[0], force * n[1], force * n[2]))
        row.energy = contact_laws.contact_energy(gap, row.stiffness, row.exponent)
        row.damper1 = force - contact_laws.elastic_force(gap, row.stiffness, row.exponent)[0]
        row.power = -row.damper1 * rate
        if row.friction > 0.0:
            row.energy += _rub(row, bodies, at, n, force, step)


@inlined
def _relative_velocity(row, bodies, at):
    """Velocity of a's material at a point against that of b's."""
    xa, xb, wa, wb = bodies[row.a].x, bodies[row.b].x, bodies[row.a].w, bodies[row.b].w
    ax, ay, az = cross(wa[0], wa[1], wa[2], at[0] - xa[0], at[1] - xa[1], at[2] - xa[2])
    bx, by, bz = cross(wb[0], wb[1], wb[2], at[0] - xb[0], at[1] - xb[1], at[2] - xb[2])
    va, vb = bodies[row.a].v, bodies[row.b].v
    return va[0] + ax - vb[0] - bx, va[1] + ay - vb[1] - by, va[2] + az - vb[2] - bz


@inlined
def _slide(row, bodies, at):
    """How far a's material at a point has moved against b since the step's start, body axes of b."""
    xa, xb, X, Q = bodies[row.a].x, bodies[row.b].x, row.X, row.Q
    lx, ly, lz = turn_back(bodies[row.a].R, at[0] - xa[0], at[1] - xa[1], at[2] - xa[2])
    mx, my, mz = turn_back(bodies[row.b].R, at[0] - xb[0], at[1] - xb[1], at[2] - xb[2])
    qx, qy, qz = turn(Q, lx, ly, lz)
    return mx - X[0] - qx, my - X[1] - qy, mz - X[2] - qz


@inlined
def _rub(row, bodies, at, n, force, step):
    """Friction of a contact onto the bodies; returns the energy of its bristle, J."""
    R, s, q = bodies[row.b].R, row.slide, row.stick
    sx = sy = sz = 0.0
    if step > 0.0:
        sx, sy, sz = _slide(row, bodies, at)
        sx, sy, sz = turn(R, sx, sy, sz)
        sx, sy, sz = contact_laws.tangential(sx, sy, sz, n[0], n[1], n[2])
        s[0], s[1], s[2] = turn_back(R, sx, sy, sz)
    ux, uy, uz = turn(R, q[0], q[1], q[2])
    ux, uy, uz = contact_laws.tangential(ux, uy, uz, n[0], n[1], n[2])
    found = contact_laws.friction(
        ux, uy, uz, sx, sy, sz, force, row.friction, row.stick_stiffness, row.stick_damping if step > 0.0 else 0.0, step
    )
    f = (found[0], found[1], found[2])
    q, d, t, g = row.stick1, row.drag1, row.t, row.rubbing
    q[0], q[1], q[2] = turn_back(R, found[3], found[4], found[5])
    d[0], d[1], d[2] = turn_back(R, f[0], f[1], f[2])
    t[0], t[1], t[2] = found[8], found[9], found[10]
    g[0], g[1], g[2] = f
    row.along, row.across, row.by_normal = found[11], found[12], found[13]
    push(row, bodies, at, f)
    return 0.5 * row.stick_stiffness * (found[3] ** 2 + found[4] ** 2 + found[5] ** 2)


@indirect(void(REAL, MODEL, SPARSE))
def add_body_contact_tangents(c_rate, model, matrix):
    """Tangents of all contacts between bodies, c_rate times the derivatives by velocity included.

    Left out is how a turn of a capsule moves the point on its axis from which the distance is measured.
    """
    f, bodies = model.flexible, model.bodies
    rows, K = f.body_contacts, f.K12
    for k in range(rows.size):
        row = rows[k]
        if row.force == 0.0:
            continue
        _, e, g = axes_of(row, bodies)
        n, t, c = row.n, row.t, row.c
        normal = row.d_gap + c_rate * row.d_rate
        H = curvature(row, n, e, g)
        for i in range(3):
            for j in range(3):
                K[i, j] = -normal * n[i] * n[j] - row.force * H[3 * i + j]
        r = row.radius_a
        at = (c[0] + r * n[0], c[1] + r * n[1], c[2] + r * n[2])
        add_pair(matrix, model, row.a, row.b, at, (-row.force * n[0], -row.force * n[1], -row.force * n[2]), K)
        if row.along == 0.0 and row.across == 0.0 and row.by_normal == 0.0:
            continue
        for i in range(3):
            for j in range(3):
                same = 1.0 if i == j else 0.0
                tt = t[i] * t[j]
                K[i, j] = row.along * tt + row.across * (same - n[i] * n[j] - tt)
                K[i, j] += row.by_normal * normal * t[i] * n[j]
        q = row.rubbing
        add_pair(matrix, model, row.a, row.b, (c[0], c[1], c[2]), (-q[0], -q[1], -q[2]), K)


@inlined
def curvature(row, n, e, g):
    """d2 gap / dx2 of a point of a, 1/m: 9 numbers, row by row."""
    f = 1.0 / row.distance if row.surface != surfaces.PLANE and row.distance > 0.0 else 0.0
    along_a = 1.0 if abs(row.s1) < row.half_a else 0.0
    along_b = 1.0 if abs(row.t1) < row.half_b else 0.0
    if along_a * along_b != 0.0:  # of two axes that cross the distance is one from a plane
        f = 0.0
    xx = f * (1.0 - n[0] * n[0] - along_a * e[0] * e[0] - along_b * g[0] * g[0])
    yy = f * (1.0 - n[1] * n[1] - along_a * e[1] * e[1] - along_b * g[1] * g[1])
    zz = f * (1.0 - n[2] * n[2] - along_a * e[2] * e[2] - along_b * g[2] * g[2])
    xy = -f * (n[0] * n[1] + along_a * e[0] * e[1] + along_b * g[0] * g[1])
    xz = -f * (n[0] * n[2] + along_a * e[0] * e[2] + along_b * g[0] * g[2])
    yz = -f * (n[1] * n[2] + along_a * e[1] * e[2] + along_b * g[1] * g[2])
    return xx, xy, xz, xy, yy, yz, xz, yz, zz


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
    bodies, J, local = model.bodies, model.flexible.J, model.flexible.e
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


@indirect(types.UniTuple(REAL, 2)(MODEL))
def end_body_contacts(model):
    """Make the end of a step the start of the next; returns what friction and normal damping took, J.

    As `contact.end_contact_step`.
    """
    bodies, rows = model.bodies, model.flexible.body_contacts
    slip = damped = 0.0
    for k in range(rows.size):
        row = rows[k]
        if math.isfinite(row.gap):
            damped -= 0.5 * (row.damper + row.damper1) * (row.gap1 - row.gap)
        row.gap, row.damper = row.gap1, row.damper1
        if row.friction == 0.0:
            continue
        half, u, u1, d, d1, s = 0.5 * row.stick_stiffness, row.stick, row.stick1, row.drag, row.drag1, row.slide
        for i in range(3):
            slip -= 0.5 * (d[i] + d1[i]) * s[i]
            new = u1[i] if row.force > 0.0 else 0.0
            slip += half * (u[i] * u[i] - new * new)
            u[i], d[i] = new, d1[i]
        A, B, X, Q = bodies[row.a], bodies[row.b], row.X, row.Q
        xa, xb = A.x, B.x
        X[0], X[1], X[2] = turn_back(B.R, xa[0] - xb[0], xa[1] - xb[1], xa[2] - xb[2])
        for i in range(3):
            for j in range(3):
                total = 0.0
                for m in range(3):
                    total += B.R[m, i] * A.R[m, j]
                Q[i, j] = total
    return slip, damped


@inlined
def count_body_contacts(model):
    """A number that encodes which bodies touch, as `contact.count_touching`."""
    rows, total = model.flexible.body_contacts, 0
    for k in range(rows.size):
        if rows[k].gap1 < 0.0:
            total += 1 + 104729 * (k + 1)
    return total


def add_body_contact_bound(model, blocks):
    """Add the stiffness and damping of all contacts to blocks (2, bodies, 6, 6) of the bodies' unknowns. Not compiled.

    Of every contact as if its bodies touched, in any direction, and twice as of springs (`solvers.stability`).
    """
    for row in model.flexible.body_contacts:
        own = (row["exponent"] * row["stiffness"] * (DEPTH * row["radius_a"]) ** (row["exponent"] - 1.0), 0.0)
        if row["law"] == contact_laws.PAPER:
            own = (own[0], row["damping"])
        both = 2.0 if np.all(model.bodies["motion"][[row["a"], row["b"]]] != rigid.DRIVEN) else 1.0
        for body, place, axis, half in (
            (row["a"], row["place_a"], row["axis_a"], row["half_a"]),
            (row["b"], row["place_b"], row["axis_b"], row["half_b"]),
        ):
            arm = model.bodies["R"][body] @ (place + half * axis)
            x, y, z = arm
            J = np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
            for k in range(2):
                blocks[k, body] += both * own[k] * (J.T @ J)


@inlined
def write_contact(row, out):
    """Force on a, moments, friction, point, normal force, gap and energy of a contact: the first 18 numbers of out."""
    f, p, q, g, c = row.f, row.moment_a, row.moment_b, row.rubbing, row.c
    for i in range(3):
        out[i], out[3 + i], out[6 + i], out[9 + i], out[12 + i] = f[i], p[i], q[i], g[i], c[i]
    out[15], out[16], out[17] = row.force, row.gap1, row.energy


def contact_values(rows):
    """Numbers (n, 18) of all contacts, those of `write_contact`. Not compiled."""
    vectors = [np.array(rows[name]) for name in ("f", "moment_a", "moment_b", "rubbing", "c")]
    return np.concatenate([*vectors, np.stack([rows["force"], rows["gap1"], rows["energy"]], axis=1)], axis=1)
