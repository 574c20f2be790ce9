"""Turns of beams that lie on one another, over a step that conserves energy.

A contact point p of the upper beam has below it the nearest point r of the lower beam's cubic, as seen along the axis a
(`kernels.layers`): direction e there, normal n = e x a outwards, gap g = (p - r) . n less the thickness. The gap is a
function of the coordinates alone: that of a step's end is that of the next one's start, wherever r has moved to. Over a
step the normal force lam m acts on p, and -lam m on the lower beam at the point midway between those of both ends; what
p lies off it makes a couple, which the body takes, and both momenta are kept. With the displacement u of p against that
point and the body, and the normals n0 and n1 of both ends,

    m = k + u (g1 - g0 - k . u)/u.u,      k = (n0 + n1)/(1 + n0 . n1)

so that m . u is the change of the gap exactly (Gonzalez, 1996); k alone does it where r stays at its point on the beam.

A point that comes to lie on the lower beam over the beam's end or side keeps the depth that it then has (`rest`), until
it is lifted: it brings no energy. A point that leaves over an end loses the energy of its contact.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, matrix_view
from evolvent.kernels import contact_laws
from evolvent.kernels.contact_step import _pressed
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.kernels.layers import FAR, _angles, _between, _combined, _frame, _shape, nearest, side_vector
from evolvent.kernels.rotations import cross
from evolvent.kernels.sparse import SPARSE, add_block, add_inner, first_entry, inner
from evolvent.model import MODEL

_I = types.int64
#: Displacement, of an element's length, below which the work of k, whose error is of third order, is exact.
_SMALL = 1e-4
#: Share of the displacement by which the work of the mean normal may differ from the change of the gap, and least
#: 1 + n0 . n1; beyond them a point is one that has moved to another part of the beam.
_LARGEST_MISS, _LEAST_TURN = 0.5, 0.5


@inlined
def _slopes(length, xi):
    """Derivatives of `layers._shape` along the element."""
    d = (6.0 * xi * xi - 6.0 * xi) / length
    return d, 1.0 - 4.0 * xi + 3.0 * xi * xi, -d, 3.0 * xi * xi - 2.0 * xi


@indirect(types.UniTuple(REAL, 4)(VECTOR, MODEL, _I, _I, _I, REAL, types.UniTuple(REAL, 3), types.UniTuple(REAL, 3)))
def gap_below(y, model, k, upper, c, xi, p, a):
    """Gap of the point p of element `upper` above the point (c, xi) of cylinder k's lower beam, and the normal there.

    The gap is infinite beyond the beam's sides.
    """
    flexible = model.flexible
    elements, row = flexible.elements, flexible.cylinders[k]
    half, at, length = NODE_VECTORS[flexible.beams[row.under].kind], elements[c].iq, elements[c].length
    x, yy, z = _combined(y, at, half, _shape(length, xi))
    tx, ty, tz = _combined(y, at, half, _slopes(length, xi))
    nx, ny, nz = cross(tx, ty, tz, a[0], a[1], a[2])
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not size > 0.0:
        return math.inf, 0.0, 0.0, 0.0
    size *= row.sense
    nx, ny, nz = nx / size, ny / size, nz / size
    wx, wy, wz = p[0] - x, p[1] - yy, p[2] - z
    if abs(wx * a[0] + wy * a[1] + wz * a[2]) > row.half_length:
        return math.inf, nx, ny, nz
    return wx * nx + wy * ny + wz * nz - 0.5 * (elements[upper].thickness + elements[c].thickness), nx, ny, nz


@inlined
def _is_far(y, elements, c, half, xi, p, a):
    """Whether p lies farther from the point (c, xi), as seen along the axis, than any contact."""
    length = elements[c].length
    x, yy, z = _combined(y, elements[c].iq, half, _shape(length, xi))
    wx, wy, wz = p[0] - x, p[1] - yy, p[2] - z
    off = wx * a[0] + wy * a[1] + wz * a[2]
    return wx * wx + wy * wy + wz * wz - off * off > (FAR * length) ** 2


@indirect(void(VECTOR, _I, MODEL, _I))
def measure_layer(y, end, model, k):
    """Points below the contact points of cylinder k's layer, gaps and normals: of a step's end (1), or its start (0).

    Fills the energy of the layer too, but for bristles.

    Notes
    -----
    The search begins at the contact point's angle about the axis, counted along the beams from their roots on, less the
    angle `shift` by which the upper beam's turns are ahead.
    """
    flexible = model.flexible
    cylinders, contacts, elements, angles = (
        flexible.cylinders, flexible.contact_points, flexible.elements, flexible.angles,
    )  # fmt: skip
    row, low = cylinders[k], flexible.beams[cylinders[k].under]
    under, sense, energy = row.under, row.sense, 0.0
    cx, cy, cz, ax, ay, az = _frame(model.bodies, cylinders, k)
    over = elements[contacts[row.first].element].beam
    _angles(y, flexible, over, sense, cx, cy, cz, ax, ay, az)
    if under != over:
        _angles(y, flexible, under, sense, cx, cy, cz, ax, ay, az)
    own, half, j = flexible.beams[over].first_node - flexible.beams[over].first_element, NODE_VECTORS[low.kind], 0
    for i in range(row.first, row.last):
        q, c, xi, gap, nx, ny, nz = contacts[i].iq[0], -1, 0.0, math.inf, 0.0, 0.0, 0.0
        p = contact_laws.point_position(y, contacts[i].iq, contacts[i].S)
        angle = angles[own + contacts[i].element] - row.shift + sense * _between(
            y[q] - cx, y[q + 1] - cy, y[q + 2] - cz, p[0] - cx, p[1] - cy, p[2] - cz, ax, ay, az
        )  # fmt: skip
        if 0.0 <= angle <= angles[low.first_node + low.elements]:
            while j > 0 and angles[low.first_node + j] > angle:
                j -= 1
            while j < low.elements - 1 and angles[low.first_node + j + 1] < angle:
                j += 1
            a, b = angles[low.first_node + j], angles[low.first_node + j + 1]
            c, xi = low.first_element + j, min(max((angle - a) / (b - a), 0.0), 1.0) if b > a else 0.5
            if not _is_far(y, elements, c, half, xi, p, (ax, ay, az)):
                c, xi = nearest(y, model, under, c, xi, p[0], p[1], p[2], ax, ay, az)
            if c >= 0:
                gap, nx, ny, nz = gap_below(y, model, k, contacts[i].element, c, xi, p, (ax, ay, az))
        energy += contact_laws.contact_energy(gap + contacts[i].rest, row.stiffness, row.exponent)
        if end == 1:
            contacts[i].carrier1, contacts[i].xi1, contacts[i].gap1 = c, xi, gap
            n = contacts[i].n1
        else:
            contacts[i].carrier, contacts[i].xi, contacts[i].gap = c, xi, gap
            n = contacts[i].n0
        n[0], n[1], n[2] = nx, ny, nz
    cylinders[k].energy = energy


@inlined
def _point_between(point):
    """Element and point midway between those below a point at both ends of a step."""
    if point.carrier == point.carrier1:
        return point.carrier, 0.5 * (point.xi + point.xi1)
    s = 0.5 * (point.carrier + point.carrier1 + point.xi + point.xi1)
    c = min(int(s), max(point.carrier, point.carrier1))
    return c, s - c


@inlined
def _direction(point, ux, uy, uz, small):
    """m of the module's notes for the displacement u, unit vector along k, and whether it is the same contact."""
    a, b, m = point.n0, point.n1, point.n
    both = 1.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if not both > _LEAST_TURN:
        return 0.0, 0.0, 0.0, False
    kx, ky, kz = (a[0] + b[0]) / both, (a[1] + b[1]) / both, (a[2] + b[2]) / both
    miss = point.gap1 - point.gap - (kx * ux + ky * uy + kz * uz)
    square = max(ux * ux + uy * uy + uz * uz, small * small)
    if abs(miss) > _LARGEST_MISS * math.sqrt(square):
        return 0.0, 0.0, 0.0, False
    part, size = miss / square, math.sqrt(2.0 / both)
    m[0], m[1], m[2] = kx + part * ux, ky + part * uy, kz + part * uz
    return kx / size, ky / size, kz / size, True


@inlined
def _rub(point, row, u, n, axis, lam, h):
    """Friction on a point over a step, and the energies of slip and of the bristle at the end: (x, y, z, slip, U1).

    Parameters
    ----------
    u : displacement against what is below; n : unit normal; axis : of the cylinder; inertial axes

    Notes
    -----
    The bristle has coordinates along the lower beam and the axis, which turn with the coil.
    """
    sx, sy, sz = contact_laws.tangential(u[0], u[1], u[2], n[0], n[1], n[2])
    ex, ey, ez = cross(axis[0], axis[1], axis[2], n[0], n[1], n[2])
    size = math.sqrt(ex * ex + ey * ey + ez * ez)
    ex, ey, ez = ex / size, ey / size, ez / size
    bx, by, bz = cross(n[0], n[1], n[2], ex, ey, ez)
    q, q1, t = point.stick, point.stick1, point.t
    found = contact_laws.friction(
        q[0] * ex + q[1] * bx, q[0] * ey + q[1] * by, q[0] * ez + q[1] * bz, sx, sy, sz, lam, row.friction,
        row.stick_stiffness, row.stick_damping, h,
    )  # fmt: skip
    before = 0.5 * row.stick_stiffness * (q[0] * q[0] + q[1] * q[1])
    q1[0] = found[3] * ex + found[4] * ey + found[5] * ez
    q1[1] = found[3] * bx + found[4] * by + found[5] * bz
    after = 0.5 * row.stick_stiffness * (q1[0] * q1[0] + q1[1] * q1[1])
    t[0], t[1], t[2] = found[8], found[9], found[10]
    point.along, point.across, point.by_normal = found[11], found[12], found[13]
    slip = -(found[0] * sx + found[1] * sy + found[2] * sz) - (after - before)
    return found[0], found[1], found[2], slip, after


@indirect(types.UniTuple(REAL, 2)(VECTOR, VECTOR, REAL, REAL, REAL, REAL, MODEL, _I, VECTOR))
def add_layer_step(y0, y1, h, soft, chi, ratio, model, k, F):
    """Forces of cylinder k's layer over a step into F, and their couple into the body's wrench, at its mean position.

    Returns the energies that normal forces and friction take, J. Gaps are those of `measure_layer`; `soft` times the
    stiffness is taken; chi and ratio are those of the filter, whose loss is not a contact's.
    """
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    cylinders, contacts, elements = flexible.cylinders, flexible.contact_points, flexible.elements
    body, half, G = cylinders[k].body, NODE_VECTORS[flexible.beams[cylinders[k].under].kind], cylinders[k].F
    w, stiffness, exponent = bodies[body].w, cylinders[k].stiffness, cylinders[k].exponent
    _, _, _, ax, ay, az = _frame(bodies, cylinders, k)
    lost = rubbed = normal = energy = touching = 0.0
    for c in range(6):
        G[c] = 0.0
    for i in range(cylinders[k].first, cylinders[k].last):
        gap0, gap1, rest, q, f = contacts[i].gap, contacts[i].gap1, contacts[i].rest, contacts[i].stick, contacts[i].f
        contacts[i].force, contacts[i].along, contacts[i].across, contacts[i].by_normal = 0.0, 0.0, 0.0, 0.0
        contacts[i].stick1[0] = contacts[i].stick1[1] = contacts[i].stick1[2] = 0.0
        contacts[i].rest1 = max(-gap1, 0.0)
        before = contact_laws.contact_energy(gap0 + rest, stiffness, exponent)
        held = 0.5 * cylinders[k].stick_stiffness * (q[0] * q[0] + q[1] * q[1])
        stays = math.isfinite(gap0) and math.isfinite(gap1)
        lam = slope = stored = filtered = 0.0
        if stays:
            lam, slope, filtered = _pressed(
                cylinders[k], 0.0, gap0 + rest, gap1 + rest, h, soft, chi, ratio * contacts[i].sank
            )
        if not stays or lam == 0.0:
            if stays:
                stored = contact_laws.contact_energy(gap1 + rest, stiffness, exponent)
                contacts[i].rest1 = min(rest, contacts[i].rest1)
            energy += stored
            lost += before - stored
            rubbed += held
            continue
        c, xi = _point_between(contacts[i])
        S, L, at = contacts[i].S, _shape(elements[c].length, xi), elements[c].iq
        p0, p1 = contact_laws.point_position(y0, contacts[i].iq, S), contact_laws.point_position(y1, contacts[i].iq, S)
        r0, r1 = _combined(y0, at, half, L), _combined(y1, at, half, L)
        wx, wy, wz = 0.5 * (p0[0] + p1[0] - r0[0] - r1[0]), 0.5 * (p0[1] + p1[1] - r0[1] - r1[1]), 0.5 * (
            p0[2] + p1[2] - r0[2] - r1[2]
        )  # fmt: skip
        tx, ty, tz = cross(w[0], w[1], w[2], wx, wy, wz)
        ux, uy, uz = (
            p1[0] - p0[0] - r1[0] + r0[0] - h * tx,
            p1[1] - p0[1] - r1[1] + r0[1] - h * ty,
            p1[2] - p0[2] - r1[2] + r0[2] - h * tz,
        )
        nx, ny, nz, same = _direction(contacts[i], ux, uy, uz, _SMALL * elements[c].length)
        if not same:
            lost += before
            rubbed += held
            continue
        stored = contact_laws.contact_energy(gap1 + rest, stiffness, exponent)
        contacts[i].rest1 = min(rest, contacts[i].rest1)
        contacts[i].force, contacts[i].d_gap = lam, slope
        m = contacts[i].n
        f[0], f[1], f[2] = lam * m[0], lam * m[1], lam * m[2]
        lost -= f[0] * ux + f[1] * uy + f[2] * uz + stored - before + filtered * (gap0 - gap1)
        if cylinders[k].friction > 0.0:
            found = _rub(contacts[i], cylinders[k], (ux, uy, uz), (nx, ny, nz), (ax, ay, az), lam, h)
            f[0], f[1], f[2] = f[0] + found[0], f[1] + found[1], f[2] + found[2]
            rubbed += found[3]
            energy += found[4]
        energy += stored
        normal += lam
        if gap1 + rest < 0.0:
            touching += 1.0
        for j in range(4):
            to, s = contacts[i].iv[j] - n_q, S[j]
            F[to] -= s * f[0]
            F[to + 1] -= s * f[1]
            F[to + 2] -= s * f[2]
            to, s = elements[c].iv + 3 * (j % 2 + half * (j // 2)) - n_q, L[j]
            F[to] += s * f[0]
            F[to + 1] += s * f[1]
            F[to + 2] += s * f[2]
        tx, ty, tz = cross(wx, wy, wz, f[0], f[1], f[2])
        G[3] -= tx
        G[4] -= ty
        G[5] -= tz
    for c in range(3, 6):
        bodies[body].F[c] += G[c]
    cylinders[k].normal, cylinders[k].energy, cylinders[k].touching = normal, energy, touching
    return lost, rubbed


@inlined
def _turning(y, elements, c, half, xi, n):
    """How the normal turns at a point on the lower beam: e / |t|, slope's factors, and curvature times |t|.

    Notes
    -----
    dn = e/|t| (curvature |t| e . u - n . dt) of a displacement u of the point against the beam, t the slope.
    """
    length, at, T = elements[c].length, elements[c].iq, _slopes(elements[c].length, xi)
    d2 = (12.0 * xi - 6.0) / (length * length)
    tx, ty, tz = _combined(y, at, half, T)
    bx, by, bz = _combined(y, at, half, (d2, (6.0 * xi - 4.0) / length, -d2, (6.0 * xi - 2.0) / length))
    square = tx * tx + ty * ty + tz * tz
    return (tx / square, ty / square, tz / square), T, -(n[0] * bx + n[1] * by + n[2] * bz)


@indirect(void(VECTOR, MODEL, _I, SPARSE))
def add_layer_step_tangents(y1, model, k, matrix):
    """Add twice the derivative of `add_layer_step`, of the last call, with respect to the step's end.

    Notes
    -----
    Turns that the pattern of the matrix does not couple are coupled through inner unknowns, as in
    `layers.add_layer_tangents`, which costs more, and without the part by which the normal turns.
    """
    flexible, n_q = model.flexible, model.info.nq
    cylinders, contacts, elements = flexible.cylinders, flexible.contact_points, flexible.elements
    half, W = NODE_VECTORS[flexible.beams[cylinders[k].under].kind], flexible.K24
    K, B, C = matrix_view(flexible.work, 0, 3, 24), flexible.work[72:80], flexible.work[80:88]
    upper, lower, coupled = -1, -1, False  # elements whose sum is in W
    for r in range(24):
        for s in range(24):
            W[r, s] = 0.0
    for i in range(cylinders[k].first, cylinders[k].last):
        if contacts[i].force == 0.0:
            continue
        c, xi = _point_between(contacts[i])
        if contacts[i].element != upper or c != lower:
            if coupled:
                _add_sum(matrix, elements[upper].iv - n_q, elements[lower].iv - n_q, half, W)
            upper, lower = contacts[i].element, c
            coupled = _couples(matrix, elements[upper].iv - n_q, elements[c].iv - n_q, 3 * half)
        if not coupled:
            _add_inner(model, k, i, c, xi, matrix)
            continue
        S, L = contacts[i].S, _shape(elements[c].length, xi)
        D = _shape(elements[c].length, contacts[i].xi1) if contacts[i].carrier1 == c else L
        for q in range(4):
            B[q], C[q], B[4 + q], C[4 + q] = S[q], S[q], -L[q], -D[q]
        n, n1, t = contacts[i].n, contacts[i].n1, contacts[i].t
        size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        along, across = 2.0 * contacts[i].along, 2.0 * contacts[i].across
        e, T, bent = _turning(y1, elements, contacts[i].carrier1, half, contacts[i].xi1, n1)
        lam = contacts[i].force if contacts[i].carrier1 == c else 0.0
        for a in range(3):
            for b in range(3):
                tt = t[a] * t[b]
                drag = along * tt + across * ((1.0 if a == b else 0.0) - n[a] * n[b] / (size * size) - tt)
                pressed = -2.0 * contacts[i].d_gap * (n[a] - contacts[i].by_normal * t[a]) * n1[b]
                pressed -= lam * bent * e[a] * e[b]
                turned = lam * e[a] * n1[b]
                for q in range(8):
                    K[a, 3 * q + b] = pressed * C[q] + drag * B[q]
                for q in range(4):
                    K[a, 12 + 3 * q + b] += turned * T[q]
        for p in range(8):
            s = B[p]
            for a in range(3):
                for q in range(24):
                    W[3 * p + a, q] += s * K[a, q]
    if coupled:
        _add_sum(matrix, elements[upper].iv - n_q, elements[lower].iv - n_q, half, W)


@inlined
def _couples(matrix, a, b, size):
    """Whether the pattern of a matrix couples the nodes, of `size` unknowns, of two elements from a and b on."""
    return (
        first_entry(matrix, a, b)[0] >= 0
        and first_entry(matrix, a, b + size)[0] >= 0
        and first_entry(matrix, a + size, b)[0] >= 0
        and first_entry(matrix, a + size, b + size)[0] >= 0
    )


@inlined
def _node(p, upper, lower, half):
    """First unknown of the nodes of an upper element (0, 1) and a lower one (2, 3)."""
    return upper + p * half if p < 2 else lower + (p - 2) * half


@inlined
def _add_sum(matrix, upper, lower, half, W):
    """Add the sum of the tangents of contact points between two elements, and clear it."""
    for p in range(4):
        for q in range(4):
            a, b = _node(p, upper, lower, 3 * half), _node(q, upper, lower, 3 * half)
            add_block(matrix, a, b, W, 6 * p, 6 * q, 6, 6, 1.0)
    for r in range(24):
        for s in range(24):
            W[r, s] = 0.0


@inlined
def _add_inner(model, k, i, c, xi, matrix):
    """Add the tangent of contact point i, above the point (c, xi), through inner unknowns."""
    flexible, n_q = model.flexible, model.info.nq
    cylinders, contacts, elements = flexible.cylinders, flexible.contact_points, flexible.elements
    half, L = NODE_VECTORS[flexible.beams[cylinders[k].under].kind], _shape(elements[c].length, xi)
    n, n1, t = contacts[i].n, contacts[i].n1, contacts[i].t
    along, across, normal = 2.0 * contacts[i].along, 2.0 * contacts[i].across, -2.0 * contacts[i].d_gap
    rubs, square = cylinders[k].friction > 0.0, n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    size = math.sqrt(abs(normal) + along + across)
    if not size > 0.0:
        return
    q = inner(matrix, 3 if rubs else 1)
    for j in range(8):
        row, s = side_vector(j, contacts[i], L, elements[c].iv, half, n_q)
        for a in range(3):
            if rubs:
                for b in range(3):
                    tt = t[a] * t[b]
                    drag = along * tt + across * ((1.0 if a == b else 0.0) - n[a] * n[b] / square - tt)
                    value = drag + normal * (n[a] - contacts[i].by_normal * t[a]) * n1[b]
                    add_inner(matrix, row + a, q + b, s * value / size, size * s if a == b else 0.0)
            else:
                add_inner(matrix, row + a, q, s * n[a] * normal / size, size * s * n1[a])
