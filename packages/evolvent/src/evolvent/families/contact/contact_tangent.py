"""Tangents of contacts: of points of beams on surfaces and on turns of beams, and of two bodies.

With f the force on the first side, on the left of the equations, a displacement r of its point against the second side
and a turn t of that one change it by t x f + df(r): both are summed up per element, or per pair of bodies, in
`Model.K24`, whose columns are vectors of elements and unknowns of bodies (`_add_column`).
"""

import math

import numpy as np
from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block, add_inner, first_entry, inner
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.kernels import ancf, body_gaps, contact_laws, rigid, surfaces
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.rotations import cross, dot, turn, turn_back
from evolvent.kernels.sides import body_columns, turn_axis
from evolvent.model import MODEL

USED_FOR = contact_laws.CONTACTS
_I = types.int64


@inlined
def _clear(W, size):
    """Clear the sum of tangents."""
    for r in range(size):
        for c in range(size):
            W[r, c] = 0.0


@kernel
def _add_sum(matrix, first, size, count, W):
    """Add the sum W between `count` blocks of unknowns, six columns each, by their first and their number; clear it."""
    for p in range(count):
        for q in range(count if size[p] > 0 else 0):
            if size[q] > 0:
                add_block(matrix, first[p], first[q], W, 6 * p, 6 * q, size[p], size[q], 1.0)
    _clear(W, 6 * count)


@inlined
def _write_side(model, body, arm, sign, at, J, T):
    """Write columns of a body's point at `arm`, and its turns; returns its first unknown and their number."""
    local, R = model.e[2], model.bodies[body].R
    local[0], local[1], local[2] = turn_back(R, arm[0], arm[1], arm[2])
    first, size = body_columns(model, body, local, True, model.J[1])
    for c in range(size):
        x, y, z = turn_axis(model.bodies, body, model.bodies[body].motion, c)
        T[0, at + c], T[1, at + c], T[2, at + c] = turn(R, x, y, z)
        for r in range(3):
            J[r, at + c] = sign * model.J[1, r, c]
    return first, size


@inlined
def _add_column(W, c, n_a, b, n_b, J, T, arm_a, arm_b, f, k, df):
    """Add what unknown c changes in the generalised forces of f on side a, and of the reaction on side b, to W.

    Parameters
    ----------
    n_a, b, n_b : number of unknowns of a, and place and number of those of b
    J, T : (3, ...) displacements of a's point against b's, and turns, inertial axes
    arm_a, arm_b : m, of the point from the bodies' origins
    f, df : N, force and its change; k : m, by how much the point moves along the material of a
    """
    r, t = (J[0, c] + k[0], J[1, c] + k[1], J[2, c] + k[2]), cross(f[0], f[1], f[2], T[0, c], T[1, c], T[2, c])
    ax, ay, az = cross(k[0], k[1], k[2], f[0], f[1], f[2])
    bx, by, bz = cross(r[0], r[1], r[2], f[0], f[1], f[2])
    if c < b:
        x, y, z = cross(arm_a[0], arm_a[1], arm_a[2], t[0], t[1], t[2])
        ax, ay, az = ax + x, ay + y, az + z
    else:
        x, y, z = cross(arm_b[0], arm_b[1], arm_b[2], t[0], t[1], t[2])
        bx, by, bz = bx + x, by + y, bz + z
    for i in range(n_a):
        W[i, c] += J[0, i] * df[0] + J[1, i] * df[1] + J[2, i] * df[2] + T[0, i] * ax + T[1, i] * ay + T[2, i] * az
    for i in range(b, b + n_b):
        W[i, c] += J[0, i] * df[0] + J[1, i] * df[1] + J[2, i] * df[2] - T[0, i] * bx - T[1, i] * by - T[2, i] * bz


# ------------------------------------------------------------------------------------------------ beams on surfaces


@indirect(void(VECTOR, VECTOR, REAL, REAL, MODEL, SPARSE), used_for="contact_surfaces")
def add_point_tangents(y0, y1, h, c_rate, model, matrix):
    """Derivatives of `contact.add_points` by y1, twice those of a step; with c_rate times those by velocity."""
    bodies, n_q, none = model.bodies, model.info.nq, (0.0, 0.0, 0.0)
    contact_surfaces, contacts = model.contact_surfaces, model.contact_points
    W, K, H, factor = model.K24, model.K12, model.K12[3:6], 1.0 if h == 0.0 else 2.0
    J, T = matrix_view(model.work, 0, 3, 24), matrix_view(model.work, 72, 3, 24)
    for k in range(contact_surfaces.size):
        if contact_surfaces[k].under >= 0:
            add_turn_tangents(y1, h, c_rate, model, k, matrix)
            continue
        _clear(W, 18)
        row, b = contact_surfaces[k], contact_surfaces[k].body
        moves, (o, a) = bodies[b].motion != rigid.DRIVEN, surfaces.frame(bodies, row)
        element, count, size, nodes = -1, 2, 6, (0, 0, 0, 0)  # whose sum is in W
        for i in range(row.first, row.last):
            point, lam = contacts[i], contacts[i].force
            if lam == 0.0:
                continue
            S, n = point.S, point.n
            p, q, X = surfaces.point_position(y0, point.iq, S), surfaces.point_position(y1, point.iq, S), bodies[b].x
            x = (0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2]))
            d, arm = (q[0] - p[0], q[1] - p[1], q[2] - p[2]), (x[0] - X[0], x[1] - X[1], x[2] - X[2])
            if h == 0.0:
                d = (x[0] - o[0], x[1] - o[1], x[2] - o[2])
            g, share, part, total = surfaces.end_slope(row, point, d, a, h)
            for p in range(3):
                for q in range(3):
                    H[p, q] = part * ((1.0 if p == q else 0.0) - share * a[p] * a[q] - n[p] * g[q]) / total
            slope = point.d_gap
            if h == 0.0:
                u, v, w = surfaces.point_position(y1, point.iv, S), bodies[b].v, bodies[b].w
                x = cross(w[0], w[1], w[2], arm[0], arm[1], arm[2])
                x = turn(H, u[0] - v[0] - x[0], u[1] - v[1] - x[1], u[2] - v[2] - x[2])
                slope, g = 1.0, _sum(g, slope + c_rate * point.d_rate, point.d_rate, x, 0.0, x)
            for p in range(3):
                for q in range(3):
                    K[p, q] = factor * (contact_laws.slope_by(point, slope, g, p, q) - lam * H[p, q])
            if element >= 0 and element != point.element:
                _add_sum(matrix, nodes, (6, 6, size, 0), count, W)
            element, nodes = point.element, (point.iv[0] - n_q, point.iv[2] - n_q, 0, 0)
            if not moves:
                for p in range(4):
                    for q in range(4):
                        s = S[p] * S[q]
                        for r in range(3):
                            for c in range(3):
                                W[3 * p + r, 3 * q + c] += s * K[r, c]
                continue
            for c in range(12):
                for r in range(3):
                    J[r, c], T[r, c] = S[c // 3] if c % 3 == r else 0.0, 0.0
            first, size = _write_side(model, b, arm, -1.0, 12, J, T)
            count, nodes = 3, (nodes[0], nodes[1], first, 0)
            f = (-point.f[0], -point.f[1], -point.f[2])
            for c in range(12 + size):
                x, df = cross(T[0, c], T[1, c], T[2, c], f[0], f[1], f[2]), turn(K, J[0, c], J[1, c], J[2, c])
                df = (df[0] + x[0], df[1] + x[1], df[2] + x[2])
                _add_column(W, c, 12, 12, size, J, T, none, arm, f, none, df)
        if element >= 0:
            _add_sum(matrix, nodes, (6, 6, size, 0), count, W)


@indirect(void(VECTOR, REAL, REAL, MODEL, _I, SPARSE), used_for=contact_laws.TURNS)
def add_turn_tangents(y1, h, c_rate, model, k, matrix):
    """Tangents of cylinder k's layer, within the pattern of the matrix or through inner unknowns.

    Notes
    -----
    Any part of a turn may lie on any part of the next. Where the pattern does not couple them, inner unknowns do, which
    costs more, and without the part by which the normal turns: with u the displacement of p against r, as columns U of
    the coordinates, and K = -df/du, the forces add U K U^T to the matrix, as eliminating z = U^T x does from
    A x + U K z and U^T x - z = 0: along n alone without friction.
    """
    n_q = model.info.nq
    row, contacts, elements = model.contact_surfaces[k], model.contact_points, model.elements
    half, W, factor = NODE_VECTORS[model.beams[row.under].kind], model.K24, 1.0 if h == 0.0 else 2.0
    K, B, C = matrix_view(model.work, 0, 3, 24), model.work[72:80], model.work[80:88]
    upper, lower, coupled, nodes = -1, -1, False, (0, 0, 0, 0)  # whose sum is in W
    _clear(W, 24)
    for i in range(row.first, row.last):
        point = contacts[i]
        if point.force == 0.0:
            continue
        c, xi = surfaces.below(point, h)
        if point.element != upper or c != lower:
            if coupled:
                _add_sum(matrix, nodes, (6, 6, 6, 6), 4, W)
            upper, lower = point.element, c
            q, at = elements[upper].iv - n_q, elements[c].iv - n_q
            nodes = (q, q + 3 * half, at, at + 3 * half)
            coupled = _couples(matrix, nodes)
        S, L = point.S, ancf.cubic(elements[c].length, xi)
        D = ancf.cubic(elements[c].length, point.xi1) if point.carrier1 == c else L
        for q in range(4):
            B[q], C[q], B[4 + q], C[4 + q] = S[q], S[q], -L[q], -D[q]
        slope = point.d_gap + c_rate * point.d_rate
        if not coupled:
            _add_inner(matrix, point, row, factor, slope, elements[c].iv, half, n_q, B)
            continue
        n1, lam = point.n1, point.force if point.carrier1 == c else 0.0
        e, T, bent = surfaces.turning(y1, elements, point.carrier1, half, point.xi1, n1)
        for a in range(3):
            for b in range(3):
                drag = factor * contact_laws.drag_slope(point, a, b)
                normal = factor * contact_laws.normal_slope(point, slope, n1, a, b) - lam * bent * e[a] * e[b]
                for q in range(8):
                    K[a, 3 * q + b] = normal * C[q] + drag * B[q]
                for q in range(4):
                    K[a, 12 + 3 * q + b] += lam * e[a] * n1[b] * T[q]
        for p in range(8):
            for a in range(3):
                for q in range(24):
                    W[3 * p + a, q] += B[p] * K[a, q]
    if coupled:
        _add_sum(matrix, nodes, (6, 6, 6, 6), 4, W)


@inlined
def _couples(matrix, nodes):
    """Whether the pattern of a matrix couples the first two of four nodes with the others."""
    a, b = first_entry(matrix, nodes[0], nodes[2])[0], first_entry(matrix, nodes[0], nodes[3])[0]
    return min(a, b, first_entry(matrix, nodes[1], nodes[2])[0], first_entry(matrix, nodes[1], nodes[3])[0]) >= 0


@inlined
def _add_inner(matrix, point, row, factor, slope, lower, half, n_q, B):
    """Add the tangent of a contact point through inner unknowns, B: factors of its 8 vectors."""
    n, n1, rubs = point.n, point.n1, row.friction > 0.0
    size = math.sqrt(factor * (abs(slope) + point.along + point.across))
    if not size > 0.0:
        return
    q = inner(matrix, 3 if rubs else 1)
    for j in range(8):
        at, s = point.iv[j] if j < 4 else lower + 3 * (j % 2 + half * (j // 2 - 2)), B[j]
        for a in range(3):
            if rubs:
                for b in range(3):
                    value = factor * contact_laws.slope_by(point, slope, n1, a, b)
                    add_inner(matrix, at - n_q + a, q + b, s * value / size, size * s * (1.0 if a == b else 0.0))
            else:
                add_inner(matrix, at - n_q + a, q, -s * n[a] * factor * slope / size, size * s * n1[a])


# ------------------------------------------------------------------------------------------------ two bodies


@indirect(void(REAL, REAL, MODEL, SPARSE), used_for="body_contacts")
def add_body_tangents(h, c_rate, model, matrix):
    """Derivatives of `contact.add_bodies`, as of `add_point_tangents`.

    Those of a state are exact; over a step the place on a's axis stays.

    Notes
    -----
    The gap is least by the place s on a's axis e: a displacement p of this axis against b, and a turn z of a against b,
    move it by ds = -(e . H p + n . (z x e))/(e . H e). As seen from b the normal then turns by dn = H (p + ds e), and
    the point of contact moves along a's material by k = ds e + radius (z x n - dn). The displacement of friction is
    that of a's material, less the turn D of a in the step: r + k - D k of the point's r.
    """
    bodies, W, H, zero = model.bodies, model.K24, model.K12, (0.0, 0.0, 0.0)
    J, T = matrix_view(model.work, 0, 3, 24), matrix_view(model.work, 72, 3, 24)
    factor = 1.0 if h == 0.0 else 2.0
    for i in range(model.body_contacts.size):
        row, lam = model.body_contacts[i], model.body_contacts[i].force
        if lam == 0.0:
            continue
        n, c, f, A, B = row.n, row.c, row.rubbing, bodies[row.a], bodies[row.b]
        size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) if h != 0.0 else 1.0
        unit, least = (n[0] / size, n[1] / size, n[2] / size), _write_bend(row, bodies, h, H)
        _, _, e, _ = body_gaps.body_axes(row, bodies)
        arm_a = (c[0] - A.x[0], c[1] - A.x[1], c[2] - A.x[2])
        arm_b = (c[0] - B.x[0], c[1] - B.x[1], c[2] - B.x[2])
        v = rigid.relative_velocity(A, B, arm_a, arm_b)
        rubs = row.along != 0.0 or row.across != 0.0 or row.by_normal != 0.0
        whole = (-lam * n[0] - f[0], -lam * n[1] - f[1], -lam * n[2] - f[2])
        _clear(W, 12)
        first_a, n_a = _write_side(model, row.a, arm_a, 1.0, 0, J, T)
        first_b, n_b = _write_side(model, row.b, arm_b, -1.0, 6, J, T)
        for j in range(6 + n_b):
            if n_a <= j < 6:
                continue
            r, t, of_a = (J[0, j], J[1, j], J[2, j]), (T[0, j], T[1, j], T[2, j]), j < 6
            z = t if of_a else (-t[0], -t[1], -t[2])
            x, ds = cross(row.radius_a * z[0], row.radius_a * z[1], row.radius_a * z[2], unit[0], unit[1], unit[2]), 0.0
            p = (r[0] + x[0], r[1] + x[1], r[2] + x[2])
            if least > 0.0:
                ds = -(dot(e, turn(H, p[0], p[1], p[2])) + dot(unit, cross(z[0], z[1], z[2], e[0], e[1], e[2])))
                ds /= least
            dn = turn(H, p[0] + ds * e[0], p[1] + ds * e[1], p[2] + ds * e[2])
            k = _sum(x, 1.0, ds, e, -row.radius_a, dn)
            change = factor * (row.d_gap + c_rate * row.d_rate) * dot(row.n1, p)
            if row.d_rate != 0.0:
                tb = zero if of_a else t
                dv = _velocity_change(A, B, arm_a, arm_b, r, t if of_a else zero, tb, k)
                x = cross(tb[0], tb[1], tb[2], unit[0], unit[1], unit[2])
                change += row.d_rate * (dot(dn, v) + dot(x, v) + dot(n, dv))
            df = _sum(zero, 0.0, change, (n[0], n[1], n[2]), lam, dn)
            if rubs:
                s = _slid(row, A, B, r, k) if h == 0.0 else (factor * r[0], factor * r[1], factor * r[2])
                df = _sum(df, 1.0, 1.0, _friction_change(row, unit, s, dn, change), 0.0, dn)
            x = zero if of_a else cross(t[0], t[1], t[2], whole[0], whole[1], whole[2])
            df = (x[0] - df[0], x[1] - df[1], x[2] - df[2])
            _add_column(W, j, n_a, 6, n_b, J, T, arm_a, arm_b, whole, k, df)
        _add_sum(matrix, (first_a, first_b, 0, 0), (n_a, n_b, 0, 0), 2, W)


@inlined
def _write_bend(row, bodies, h, H):
    """Write H = dn/dp, of a step twice that by its end; returns e . H e where a state's place on a's axis can move."""
    n, (_, _, e, g) = row.n1, body_gaps.body_axes(row, bodies)
    on_a, on_b = abs(row.s1) < row.half_a, abs(row.t1) < row.half_b
    bent, along = 0.0, 0.0
    if row.surface != surfaces.PLANE and row.distance > 0.0:
        bent = 1.0 / row.distance if h == 0.0 else 2.0 / (row.distance0 + row.distance)
    if h != 0.0:
        along = 1.0 if on_a else 0.0
        if on_a and on_b:  # of two axes that cross the distance is one from a plane
            bent = 0.0
    w, across = dot(e, g), 1.0 if on_b else 0.0
    for i in range(3):
        for j in range(3):
            same = 1.0 if i == j else 0.0
            H[i, j] = bent * (same - n[i] * n[j] - along * e[i] * e[j] - across * g[i] * g[j])
    if row.surface == body_gaps.BOX:  # the normal does not turn by what lies between the faces
        R, sides = bodies[row.b].R, row.sides
        for c in range(3):
            inside = abs(row.u1 if c == 0 else row.v1 if c == 1 else row.w1) <= sides[c]
            for i in range(3 if inside else 0):
                for j in range(3):
                    H[i, j] -= bent * R[i, c] * R[j, c]
        return 0.0
    least = 1.0 - across * w * w
    return bent * least if h == 0.0 and on_a and least > 1e-12 else 0.0


@inlined
def _sum(x, a, b, y, c, z):
    """The sum a x + b y + c z of vectors."""
    return a * x[0] + b * y[0] + c * z[0], a * x[1] + b * y[1] + c * z[1], a * x[2] + b * y[2] + c * z[2]


@inlined
def _velocity_change(A, B, arm_a, arm_b, r, ta, tb, k):
    """Change of a's velocity against b's at the point of contact as bodies keep their rates in their own axes."""
    wa, wb = A.w, B.w
    ax, ay, az = cross(ta[0], ta[1], ta[2], arm_a[0], arm_a[1], arm_a[2])
    ax, ay, az = cross(wa[0], wa[1], wa[2], ax + k[0], ay + k[1], az + k[2])
    px, py, pz = cross(ta[0], ta[1], ta[2], wa[0], wa[1], wa[2])
    px, py, pz = cross(px, py, pz, arm_a[0], arm_a[1], arm_a[2])
    bx, by, bz = cross(tb[0], tb[1], tb[2], arm_b[0], arm_b[1], arm_b[2])
    bx, by, bz = cross(wb[0], wb[1], wb[2], bx + r[0] + k[0], by + r[1] + k[1], bz + r[2] + k[2])
    qx, qy, qz = cross(tb[0], tb[1], tb[2], wb[0], wb[1], wb[2])
    qx, qy, qz = cross(qx, qy, qz, arm_b[0], arm_b[1], arm_b[2])
    return ax + px - bx - qx, ay + py - by - qy, az + pz - bz - qz


@inlined
def _slid(row, A, B, r, k):
    """Change of the displacement of friction as seen from b."""
    x, y, z = turn_back(A.R, k[0], k[1], k[2])
    x, y, z = turn(row.Q, x, y, z)
    x, y, z = turn(B.R, x, y, z)
    return r[0] + k[0] - x, r[1] + k[1] - y, r[2] + k[2] - z


@inlined
def _friction_change(row, n, s, dn, change):
    """Change of friction as seen from b: by its displacement s, the turn dn of the normal, and the normal force."""
    t, f, off = row.t, row.rubbing, dot(n, s)
    x = _sum(s, 1.0, -off, n, -row.tilt, dn)
    along = (row.across - row.along) * dot(t, x) - row.by_normal * change
    return _sum(_sum(x, -row.across, along, t, 0.0, n), 1.0, -dot(dn, f), n, 0.0, n)


# ---------------------------------------------------------------------------------- bound; not compiled


def add_body_contact_bound(model, blocks):
    """Add the stiffness and damping of all contacts to blocks (2, bodies, 6, 6) of the bodies' unknowns. Not compiled.

    Of every contact as if its bodies touched, in any direction, and twice as of springs
    (`solvers.time.explicit.stability`); of boxes the `share` of the points that can touch at the same time.
    """
    for row in model.body_contacts:
        own = contact_laws.bound_of(row, "extent")
        both = 2.0 if np.all(model.bodies["motion"][[row["a"], row["b"]]] != rigid.DRIVEN) else 1.0
        for body, place, axis, half in (
            (row["a"], row["place_a"], row["axis_a"], row["half_a"]),
            (row["b"], row["place_b"], row["axis_b"], row["half_b"]),
        ):
            x, y, z = model.bodies["R"][body] @ (place + half * axis)
            J = np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
            for k in range(2):
                blocks[k, body] += both * row["share"] * own[k] * (J.T @ J)
