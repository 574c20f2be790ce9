"""Elements of geometrically exact rods between two bodies: strains, forces, energy, tangent.

With the directors d_i of the sections at both ends a and b, T_ij = d_i^a . d_j^b and the vector d from end to end::

    s_k = (T_ij - T_ji)/2 (i, j, k cyclic: T_21 - T_12 for k = 0),  c = (tr T - 1)/2,  v_i = (d_i^a + d_i^b)/2 . d/L

that is s = sin(angle) e and c = cos(angle) of the turn of one end relative to the other about the axis e. The strains
of force, Gamma, and of moment, K, are those of the helix through both ends::

    phi = angle/sin(angle),   psi = (1 - phi)/sin(angle)^2
    Gamma = phi v + psi (s . v) s - Gamma_0,   K = phi s/L - K_0

exact where the strains are constant along the element; they do not change in a rigid motion. s, c and v are quadratic
in vectors that are fixed to the bodies, of which `kernels.rod_step` makes use. With Gamma_0 = (1, 0, 0) and K_0 = 0 the
rod is straight without stress. The energy is E . C E L/2, E = (Gamma, K). The compliance 1/C contains the bending by
moments that vary linearly along the element (`evolvent.elements.rods`), so that an element neither locks nor needs more
points than one.

Literature: Reissner 1981; Simo 1985; Crisfield & Jelenic 1999 (helical strains); MacNeal 1978 (residual bending
flexibility).
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel, matrix_view
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sparse import SPARSE, add_block
from evolvent.model import MODEL

_I = types.int64
#: Numbers of an element that `measure_element` writes: s, c, v, phi, psi, then the strains.
COSINE, CHORD, PHI, PSI, STRAIN, MEASURES = 3, 4, 7, 8, 9, 15
#: Cosine of the largest angle between the ends of an element, 120 degrees; beyond it strains are not a number.
LEAST_COSINE = -0.5
# indices in the scratch `Flexible.rod`
_J0, _J1, _D0, _D1, _A, _B, _K, _P, _S, _M, _Q, WORK = 0, 84, 168, 210, 252, 301, 385, 529, 536, 542, 557, 600

_TERMS = 13


def _series():
    """Coefficients of phi and psi in powers of u = 1 - cos(angle): a_k = a_(k-1) k/(2 k + 1)."""
    a = [1.0]
    for k in range(1, _TERMS + 1):
        a.append(a[-1] * k / (2.0 * k + 1.0))
    b = [-0.5 * a[1]]
    for k in range(1, _TERMS):
        b.append(0.5 * (b[-1] - a[k + 1]))
    return tuple(a[:_TERMS]), tuple(b)


_PHI, _PSI = _series()
_NEAR = 0.1


@inlined
def angle_factors(c):
    """Phi and psi of the cosine of an angle; not a number beyond `LEAST_COSINE`."""
    u = 1.0 - c
    if u < _NEAR:
        p = q = 0.0
        for k in range(_TERMS - 1, -1, -1):
            p = _PHI[k] + u * p
            q = _PSI[k] + u * q
        return p, q
    if not c >= LEAST_COSINE:
        return math.nan, math.nan
    square = u * (2.0 - u)
    phi = math.acos(c) / math.sqrt(square)
    return phi, (1.0 - phi) / square


@kernel
def angle_slopes(c):
    """First derivatives of phi and psi by the cosine, then the second ones."""
    u = 1.0 - c
    if u < _NEAR:
        p = q = pp = qq = 0.0
        for k in range(_TERMS - 1, 0, -1):
            p = k * _PHI[k] + u * p
            q = k * _PSI[k] + u * q
        for k in range(_TERMS - 1, 1, -1):
            pp = k * (k - 1.0) * _PHI[k] + u * pp
            qq = k * (k - 1.0) * _PSI[k] + u * qq
        return -p, -q, pp, qq
    phi, psi = angle_factors(c)
    square = u * (2.0 - u)
    p = (c * phi - 1.0) / square
    q = (2.0 * c * psi - p) / square
    pp = (phi + 3.0 * c * p) / square
    qq = (2.0 * psi + 4.0 * c * q - pp) / square
    return p, q, pp, qq


@inlined
def _column(R, i):
    return R[0, i], R[1, i], R[2, i]


@inlined
def element_vectors(rows, k, bodies):
    """Arms of the ends of element k and the vector between them, inertial axes: 9 floats."""
    a, b, la, lb = rows[k].a, rows[k].b, rows[k].arm_a, rows[k].arm_b
    ax, ay, az = turn(bodies[a].R, la[0], la[1], la[2])
    bx, by, bz = turn(bodies[b].R, lb[0], lb[1], lb[2])
    xa, xb = bodies[a].x, bodies[b].x
    return ax, ay, az, bx, by, bz, xb[0] + bx - xa[0] - ax, xb[1] + by - xa[1] - ay, xb[2] + bz - xa[2] - az


@inlined
def measure_element(k, model, out):
    """Write s, c, v, phi, psi and strains of element k at the bodies' current positions; out : (MEASURES,) float."""
    rows, bodies = model.flexible.rod_elements, model.bodies
    A, B = bodies[rows[k].a].R, bodies[rows[k].b].R
    _, _, _, _, _, _, dx, dy, dz = element_vectors(rows, k, bodies)
    trace = 0.0
    for i in range(3):
        j, m = (i + 1) % 3, (i + 2) % 3
        one = A[0, m] * B[0, j] + A[1, m] * B[1, j] + A[2, m] * B[2, j]
        two = A[0, j] * B[0, m] + A[1, j] * B[1, m] + A[2, j] * B[2, m]
        out[i] = 0.5 * (one - two)
        trace += A[0, i] * B[0, i] + A[1, i] * B[1, i] + A[2, i] * B[2, i]
        out[CHORD + i] = (
            0.5 * ((A[0, i] + B[0, i]) * dx + (A[1, i] + B[1, i]) * dy + (A[2, i] + B[2, i]) * dz) / rows[k].length
        )
    out[COSINE] = c = 0.5 * (trace - 1.0)
    phi, psi = angle_factors(c)
    out[PHI], out[PSI] = phi, psi
    w = psi * (out[0] * out[4] + out[1] * out[5] + out[2] * out[6])
    rest = rows[k].rest
    for i in range(3):
        out[STRAIN + i] = phi * out[CHORD + i] + w * out[i] - rest[i]
        out[STRAIN + 3 + i] = phi * out[i] / rows[k].length - rest[3 + i]


@inlined
def stress(rows, k, strain, at, scale, S):
    """S = scale C E of the strains at strain[at:]; added."""
    C = rows[k].stiffness
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += C[i, j] * strain[at + j]
        S[i] += scale * total


@inlined
def conjugate(m0, m1, dphi, dpsi, S, length, p):
    """p : (7,) such that p . d(s, c, v) = S . dE over a step from the measures m0 to m1, exactly.

    Parameters
    ----------
    dphi, dpsi : float, derivatives of phi and psi by the cosine, or their changes over that of the cosine
    S : (6,) float, forces and moments times the length

    Notes
    -----
    Products change by the mean of one factor times the change of the other.
    """
    phi, psi = 0.5 * (m0[PHI] + m1[PHI]), 0.5 * (m0[PSI] + m1[PSI])
    w0 = m0[0] * m0[4] + m0[1] * m0[5] + m0[2] * m0[6]
    w1 = m1[0] * m1[4] + m1[1] * m1[5] + m1[2] * m1[6]
    w = 0.5 * (w0 + w1)
    along = by_c = by_psi = 0.0
    for i in range(3):
        s, v, M = 0.5 * (m0[i] + m1[i]), 0.5 * (m0[4 + i] + m1[4 + i]), S[3 + i] / length
        along += S[i] * s
        by_c += S[i] * v + M * s
        by_psi += S[i] * 0.5 * (w0 * m0[i] + w1 * m1[i])
    p[COSINE] = dphi * by_c + dpsi * by_psi
    for i in range(3):
        s, v, M = 0.5 * (m0[i] + m1[i]), 0.5 * (m0[4 + i] + m1[4 + i]), S[3 + i] / length
        p[i] = phi * M + psi * (w * S[i] + along * v)
        p[CHORD + i] = phi * S[i] + psi * along * s


@inlined
def _crossed(A, B, p):
    """Sum of P_ij d_i^a x d_j^b, P the derivative of p . (s, c) by T."""
    x = y = z = 0.0
    for j in range(3):
        bx, by, bz = _conjugate_director(A, p, j)
        cx, cy, cz = cross(bx, by, bz, B[0, j], B[1, j], B[2, j])
        x, y, z = x + cx, y + cy, z + cz
    return x, y, z


@inlined
def _conjugate_director(A, p, j):
    """Sum over i of P_ij d_i^a."""
    k, m = (j + 1) % 3, (j + 2) % 3
    c, above, below = 0.5 * p[COSINE], 0.5 * p[m], 0.5 * p[k]  # P_kj = p_m/2 and P_mj = -p_k/2 by the order of T
    return (
        c * A[0, j] + above * A[0, k] - below * A[0, m],
        c * A[1, j] + above * A[1, k] - below * A[1, m],
        c * A[2, j] + above * A[2, k] - below * A[2, m],
    )


@inlined
def push_ends(k, p, model):
    """Add the forces -p . d(s, c, v) of element k to the wrenches of its bodies, at the bodies' current positions."""
    rows, bodies = model.flexible.rod_elements, model.bodies
    a, b, scale = rows[k].a, rows[k].b, 0.5 / rows[k].length
    A, B, Fa, Fb = bodies[a].R, bodies[b].R, bodies[a].F, bodies[b].F
    ax, ay, az, bx, by, bz, dx, dy, dz = element_vectors(rows, k, bodies)
    gx, gy, gz = turn(A, scale * p[4], scale * p[5], scale * p[6])
    hx, hy, hz = turn(B, scale * p[4], scale * p[5], scale * p[6])
    fx, fy, fz = gx + hx, gy + hy, gz + hz
    x, y, z = _crossed(A, B, p)
    ux, uy, uz = cross(gx, gy, gz, dx, dy, dz)
    mx, my, mz = cross(ax, ay, az, fx, fy, fz)
    Fa[0] += fx
    Fa[1] += fy
    Fa[2] += fz
    Fa[3] -= x + ux - mx
    Fa[4] -= y + uy - my
    Fa[5] -= z + uz - mz
    ux, uy, uz = cross(hx, hy, hz, dx, dy, dz)
    mx, my, mz = cross(bx, by, bz, fx, fy, fz)
    Fb[0] -= fx
    Fb[1] -= fy
    Fb[2] -= fz
    Fb[3] -= ux - x + mx
    Fb[4] -= uy - y + my
    Fb[5] -= uz - z + mz


@kernel
def fill_columns(k, model, A, B, v, J):
    """Derivatives J : (7, 12) of s, c and v by displacements and turns (inertial axes) of both bodies.

    Parameters
    ----------
    A, B : (3, 3) float, rotations of the bodies; v : 9 floats, `element_vectors`
    """
    ax, ay, az, bx, by, bz, dx, dy, dz = v
    length = model.flexible.rod_elements[k].length
    for i in range(4):
        for j in range(12):
            J[i, j] = 0.0
    for i in range(3):
        j, m = (i + 1) % 3, (i + 2) % 3
        x, y, z = cross(A[0, m], A[1, m], A[2, m], B[0, j], B[1, j], B[2, j])
        u, v1, w = cross(A[0, j], A[1, j], A[2, j], B[0, m], B[1, m], B[2, m])
        J[i, 3], J[i, 4], J[i, 5] = 0.5 * (x - u), 0.5 * (y - v1), 0.5 * (z - w)
        J[i, 9], J[i, 10], J[i, 11] = -J[i, 3], -J[i, 4], -J[i, 5]
        x, y, z = cross(A[0, i], A[1, i], A[2, i], B[0, i], B[1, i], B[2, i])
        J[3, 3] += 0.5 * x
        J[3, 4] += 0.5 * y
        J[3, 5] += 0.5 * z
        half = 0.5 / length
        nx, ny, nz = half * (A[0, i] + B[0, i]), half * (A[1, i] + B[1, i]), half * (A[2, i] + B[2, i])
        r = 4 + i
        J[r, 0], J[r, 1], J[r, 2], J[r, 6], J[r, 7], J[r, 8] = -nx, -ny, -nz, nx, ny, nz
        x, y, z = cross(half * A[0, i], half * A[1, i], half * A[2, i], dx, dy, dz)
        u, v1, w = cross(ax, ay, az, nx, ny, nz)
        J[r, 3], J[r, 4], J[r, 5] = x - u, y - v1, z - w
        x, y, z = cross(half * B[0, i], half * B[1, i], half * B[2, i], dx, dy, dz)
        u, v1, w = cross(bx, by, bz, nx, ny, nz)
        J[r, 9], J[r, 10], J[r, 11] = x + u, y + v1, z + w
    for c in range(3):
        J[3, 9 + c] = -J[3, 3 + c]


@kernel
def strain_columns(m0, m1, dphi, dpsi, length, D):
    """Derivatives D : (6, 7) of the strains by s, c and v; over a step as of `conjugate`, which is S . D."""
    phi, psi = 0.5 * (m0[PHI] + m1[PHI]), 0.5 * (m0[PSI] + m1[PSI])
    w0 = m0[0] * m0[4] + m0[1] * m0[5] + m0[2] * m0[6]
    w1 = m1[0] * m1[4] + m1[1] * m1[5] + m1[2] * m1[6]
    w = 0.5 * (w0 + w1)
    for i in range(3):
        s, v = 0.5 * (m0[i] + m1[i]), 0.5 * (m0[4 + i] + m1[4 + i])
        for j in range(3):
            same = 1.0 if i == j else 0.0
            D[i, j] = psi * (w * same + s * 0.5 * (m0[4 + j] + m1[4 + j]))
            D[i, 4 + j] = phi * same + psi * s * 0.5 * (m0[j] + m1[j])
            D[3 + i, j] = phi * same / length
            D[3 + i, 4 + j] = 0.0
        D[i, 3] = dphi * v + dpsi * 0.5 * (w0 * m0[i] + w1 * m1[i])
        D[3 + i, 3] = dphi * s / length


@kernel
def add_curved_strains(m, S, length, A):
    """Add S . (second derivatives of the strains by s, c and v) to A : (7, 7)."""
    dphi, dpsi, ddphi, ddpsi = angle_slopes(m[COSINE])
    psi = m[PSI]
    by_v = by_s = w = along = 0.0
    for i in range(3):
        by_v += S[i] * m[4 + i]
        by_s += S[3 + i] * m[i] / length
        w += m[i] * m[4 + i]
        along += S[i] * m[i]
    A[3, 3] += ddphi * (by_v + by_s) + ddpsi * w * along
    for i in range(3):
        on_v = dphi * S[i] + dpsi * along * m[i]
        on_s = dphi * S[3 + i] / length + dpsi * (along * m[4 + i] + w * S[i])
        A[3, 4 + i] += on_v
        A[4 + i, 3] += on_v
        A[3, i] += on_s
        A[i, 3] += on_s
        A[i, 4 + i] += psi * along
        A[4 + i, i] += psi * along
        for j in range(3):
            A[i, j] += psi * (S[i] * m[4 + j] + m[4 + i] * S[j])
            A[i, 4 + j] += psi * S[i] * m[j]
            A[4 + j, i] += psi * S[i] * m[j]


@inlined
def _add_skew(K, row, column, scale, x, y, z):
    """Add scale [x]x."""
    K[row, column + 1] -= scale * z
    K[row, column + 2] += scale * y
    K[row + 1, column] += scale * z
    K[row + 1, column + 2] -= scale * x
    K[row + 2, column] -= scale * y
    K[row + 2, column + 1] += scale * x


@inlined
def _add_double(K, row, column, scale, ax, ay, az, bx, by, bz):
    """Add scale [a]x [b]x = scale (b a^T - (a . b) 1)."""
    a, b = (ax, ay, az), (bx, by, bz)
    dot = ax * bx + ay * by + az * bz
    for i in range(3):
        for j in range(3):
            K[row + i, column + j] += scale * b[i] * a[j]
        K[row + i, column + i] -= scale * dot


@kernel
def add_turned_forces(k, model, p, A0, B0, v0, A1, B1, v1, K):
    """Add p . (second derivatives of s, c and v) to K : (12, 12), displacements and turns in inertial axes.

    The second factor of each product has the positions with 1, which move; the first those with 0 (the same, or means).
    """
    scale = 0.5 / model.flexible.rod_elements[k].length
    px, py, pz = scale * p[4], scale * p[5], scale * p[6]
    ga, gb, ha, hb = turn(A0, px, py, pz), turn(B0, px, py, pz), turn(A1, px, py, pz), turn(B1, px, py, pz)
    f = (ga[0] + gb[0], ga[1] + gb[1], ga[2] + gb[2])
    a0, b0, d0 = (v0[0], v0[1], v0[2]), (v0[3], v0[4], v0[5]), (v0[6], v0[7], v0[8])
    a1, b1 = (v1[0], v1[1], v1[2]), (v1[3], v1[4], v1[5])
    for side in range(2):  # forces on b and a
        row, sign = (6, -1.0) if side == 0 else (0, 1.0)
        _add_skew(K, row, 3, sign, ha[0], ha[1], ha[2])
        _add_skew(K, row, 9, sign, hb[0], hb[1], hb[2])
    for side in range(2):  # torques on a and b
        row = 3 if side == 0 else 9
        g, h, arm0, arm1 = (ga, ha, a0, a1) if side == 0 else (gb, hb, b0, b1)
        sign = 1.0 if side == 0 else -1.0
        _add_double(K, row, row, 1.0, d0[0], d0[1], d0[2], h[0], h[1], h[2])
        _add_skew(K, row, 6, 1.0, g[0], g[1], g[2])
        _add_skew(K, row, 0, -1.0, g[0], g[1], g[2])
        _add_double(K, row, 9, -1.0, g[0], g[1], g[2], b1[0], b1[1], b1[2])
        _add_double(K, row, 3, 1.0, g[0], g[1], g[2], a1[0], a1[1], a1[2])
        _add_double(K, row, row, -sign, f[0], f[1], f[2], arm1[0], arm1[1], arm1[2])
        _add_double(K, row, 3, sign, arm0[0], arm0[1], arm0[2], ha[0], ha[1], ha[2])
        _add_double(K, row, 9, sign, arm0[0], arm0[1], arm0[2], hb[0], hb[1], hb[2])
    for j in range(3):
        x0, y0, z0 = _conjugate_director(A0, p, j)
        x1, y1, z1 = _conjugate_director(A1, p, j)
        bx0, by0, bz0 = _column(B0, j)
        bx1, by1, bz1 = _column(B1, j)
        for side in range(2):
            row, sign = (3, 1.0) if side == 0 else (9, -1.0)
            _add_double(K, row, 3, sign, bx0, by0, bz0, x1, y1, z1)
            _add_double(K, row, 9, -sign, x0, y0, z0, bx1, by1, bz1)


@kernel
def to_body_axes(K, P, Q, S, T):
    """Turns in the rows of K : (12, 12) into axes P and Q, in its columns into S and T."""
    for c in range(12):
        x, y, z = turn_back(P, K[3, c], K[4, c], K[5, c])
        K[3, c], K[4, c], K[5, c] = x, y, z
        x, y, z = turn_back(Q, K[9, c], K[10, c], K[11, c])
        K[9, c], K[10, c], K[11, c] = x, y, z
    for r in range(12):
        x, y, z = turn_back(S, K[r, 3], K[r, 4], K[r, 5])
        K[r, 3], K[r, 4], K[r, 5] = x, y, z
        x, y, z = turn_back(T, K[r, 9], K[r, 10], K[r, 11])
        K[r, 9], K[r, 10], K[r, 11] = x, y, z


@kernel
def multiply_columns(rows, k, factor, D0, D1, B, A):
    """A : (7, 7) = factor D0^T C D1; B : (6, 7), scratch."""
    C = rows[k].stiffness
    for i in range(6):
        for j in range(7):
            total = 0.0
            for m in range(6):
                total += C[i, m] * D1[m, j]
            B[i, j] = factor * total
    for i in range(7):
        for j in range(7):
            total = 0.0
            for m in range(6):
                total += D0[m, i] * B[m, j]
            A[i, j] = total


@kernel
def project_columns(J0, A, J1, B, K):
    """K : (12, 12) = J0^T A J1; B : (7, 12), scratch. The first four rows of J0 and J1 have turns alone."""
    for i in range(7):
        for j in range(12):
            total = A[i, 4] * J1[4, j] + A[i, 5] * J1[5, j] + A[i, 6] * J1[6, j]
            if j % 6 > 2:
                total += A[i, 0] * J1[0, j] + A[i, 1] * J1[1, j] + A[i, 2] * J1[2, j] + A[i, 3] * J1[3, j]
            B[i, j] = total
    for i in range(12):
        for j in range(12):
            total = J0[4, i] * B[4, j] + J0[5, i] * B[5, j] + J0[6, i] * B[6, j]
            if i % 6 > 2:
                total += J0[0, i] * B[0, j] + J0[1, i] * B[1, j] + J0[2, i] * B[2, j] + J0[3, i] * B[3, j]
            K[i, j] = total


@inlined
def add_to_bodies(k, model, K, matrix):
    """Add the derivatives K : (12, 12) of element k to a matrix."""
    rows, bodies, n_q = model.flexible.rod_elements, model.bodies, model.info.nq
    at, bt = bodies[rows[k].a].iv - n_q, bodies[rows[k].b].iv - n_q
    add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)
    add_block(matrix, at, bt, K, 0, 6, 6, 6, 1.0)
    add_block(matrix, bt, at, K, 6, 0, 6, 6, 1.0)
    add_block(matrix, bt, bt, K, 6, 6, 6, 6, 1.0)


@inlined
def add_mass_damping(model):
    """Forces -alpha M v of all rods' nodes; returns the power that they take, W."""
    rods, bodies, lost = model.flexible.rods, model.bodies, 0.0
    for r in range(rods.size):
        alpha = rods[r].alpha
        if alpha == 0.0:
            continue
        for b in range(rods[r].first_body, rods[r].first_body + rods[r].elements + 1):
            J, F, v, w, m = bodies[b].inertia, bodies[b].F, bodies[b].v, bodies[b].w, alpha * bodies[b].mass
            x, y, z = turn_back(bodies[b].R, w[0], w[1], w[2])
            hx = alpha * (J[0, 0] * x + J[0, 1] * y + J[0, 2] * z)
            hy = alpha * (J[1, 0] * x + J[1, 1] * y + J[1, 2] * z)
            hz = alpha * (J[2, 0] * x + J[2, 1] * y + J[2, 2] * z)
            lost += m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + hx * x + hy * y + hz * z
            hx, hy, hz = turn(bodies[b].R, hx, hy, hz)
            F[0] -= m * v[0]
            F[1] -= m * v[1]
            F[2] -= m * v[2]
            F[3] -= hx
            F[4] -= hy
            F[5] -= hz
    return lost


@indirect(void(REAL, MODEL, SPARSE))
def add_mass_damping_tangents(c_rate, model, matrix):
    """c_rate times the derivatives of the forces of `add_mass_damping` by velocities."""
    rods, bodies, n_q = model.flexible.rods, model.bodies, model.info.nq
    K = matrix_view(model.flexible.rod, _K, 6, 6)
    for r in range(rods.size):
        alpha = rods[r].alpha
        if alpha == 0.0:
            continue
        for b in range(rods[r].first_body, rods[r].first_body + rods[r].elements + 1):
            for i in range(6):
                for j in range(6):
                    K[i, j] = 0.0
            for i in range(3):
                K[i, i] = c_rate * alpha * bodies[b].mass
                for j in range(3):
                    K[3 + i, 3 + j] = c_rate * alpha * bodies[b].inertia[i, j]
            at = bodies[b].iv - n_q
            add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)


@inlined
def _add_thermal_stress(rows, k, change, S):
    """Subtract the stresses times the length of the free strains of element k from S; returns their power.

    Parameters
    ----------
    change : (6,) float, changes of the strains, or their rates, by which the thermal stresses do work
    """
    C, free, length, given = rows[k].stiffness, rows[k].free, rows[k].length, 0.0
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += C[i, j] * free[j]
        S[i] -= length * total
        given += length * total * change[i]
    return given


@inlined
def _add_rates(k, m, dphi, dpsi, model, S):
    """Add stresses of damping, beta C dE/dt, and of free strains to S; returns powers lost and given, W."""
    rows, bodies, work = model.flexible.rod_elements, model.bodies, model.flexible.rod
    a, b, length = rows[k].a, rows[k].b, rows[k].length
    J, D = matrix_view(work, _J0, 7, 12), matrix_view(work, _D0, 6, 7)
    fill_columns(k, model, bodies[a].R, bodies[b].R, element_vectors(rows, k, bodies), J)
    strain_columns(m, m, dphi, dpsi, length, D)
    rates, strain, viscous = work[_A : _A + 7], work[_B : _B + 6], work[_B + 6 : _B + 12]
    for i in range(7):
        total = 0.0
        for c in range(3):
            total += J[i, c] * bodies[a].v[c] + J[i, 3 + c] * bodies[a].w[c]
            total += J[i, 6 + c] * bodies[b].v[c] + J[i, 9 + c] * bodies[b].w[c]
        rates[i] = total
    for i in range(6):
        total = 0.0
        for j in range(7):
            total += D[i, j] * rates[j]
        strain[i], viscous[i] = total, 0.0
    stress(rows, k, strain, 0, rows[k].beta * length, viscous)
    lost = 0.0
    for i in range(6):
        S[i] += viscous[i]
        lost += viscous[i] * strain[i]
    given = _add_thermal_stress(rows, k, strain, S) if rows[k].heated != 0 else 0.0
    return lost, given


@inlined
def _stressed(k, model, m, S, p):
    """Measures, stresses times the length, and `conjugate` of element k; returns powers of damping and heating, W."""
    rows, length, lost, given = model.flexible.rod_elements, model.flexible.rod_elements[k].length, 0.0, 0.0
    measure_element(k, model, m)
    dphi, dpsi, _, _ = angle_slopes(m[COSINE])
    for i in range(6):
        S[i] = 0.0
    stress(rows, k, m, STRAIN, length, S)
    if rows[k].beta != 0.0 or rows[k].heated != 0:
        lost, given = _add_rates(k, m, dphi, dpsi, model, S)
    conjugate(m, m, dphi, dpsi, S, length, p)
    return lost, given


@indirect(types.UniTuple(REAL, 3)(MODEL))
def add_rod_forces(model):
    """Forces of all rods onto their bodies; returns powers that damping by mass and by stiffness takes, and of heat, W.

    The power of heat is that of the forces by which free strains act, as loads; elastic energies are those of the
    whole strain.
    """
    work, lost, given = model.flexible.rod, 0.0, 0.0
    m, S, p = work[_M : _M + MEASURES], work[_S : _S + 6], work[_P : _P + 7]
    for k in range(model.flexible.rod_elements.size):
        viscous, heat = _stressed(k, model, m, S, p)
        lost, given = lost + viscous, given + heat
        push_ends(k, p, model)
    return add_mass_damping(model), lost, given


@indirect(void(MODEL, VECTOR))
def add_rod_energies(model, out):
    """Add the strain energy of all rods to out[1], that of moments to out[2], J; at the bodies' current positions."""
    rows, work = model.flexible.rod_elements, model.flexible.rod
    m, S = work[_M : _M + MEASURES], work[_S : _S + 6]
    for k in range(rows.size):
        measure_element(k, model, m)
        for i in range(6):
            S[i] = 0.0
        stress(rows, k, m, STRAIN, rows[k].length, S)
        for i in range(6):
            out[1] += 0.5 * S[i] * m[STRAIN + i]
            if i > 2:
                out[2] += 0.5 * S[i] * m[STRAIN + i]


@indirect(void(REAL, MODEL, SPARSE))
def add_rod_tangents(c_rate, model, matrix):
    """Derivatives of the forces of all rods by displacements and turns of their bodies.

    Left out is how the damping's stresses follow the positions at given velocities.
    """
    rows, bodies, work = model.flexible.rod_elements, model.bodies, model.flexible.rod
    m, S, p = work[_M : _M + MEASURES], work[_S : _S + 6], work[_P : _P + 7]
    J, D = matrix_view(work, _J0, 7, 12), matrix_view(work, _D0, 6, 7)
    A, B, K = matrix_view(work, _A, 7, 7), matrix_view(work, _B, 7, 12), matrix_view(work, _K, 12, 12)
    for k in range(rows.size):
        a, b, length = rows[k].a, rows[k].b, rows[k].length
        Ra, Rb, v = bodies[a].R, bodies[b].R, element_vectors(rows, k, bodies)
        _stressed(k, model, m, S, p)
        dphi, dpsi, _, _ = angle_slopes(m[COSINE])
        fill_columns(k, model, Ra, Rb, v, J)
        strain_columns(m, m, dphi, dpsi, length, D)
        multiply_columns(rows, k, length * (1.0 + c_rate * rows[k].beta), D, D, B, A)
        add_curved_strains(m, S, length, A)
        project_columns(J, A, J, B, K)
        add_turned_forces(k, model, p, Ra, Rb, v, Ra, Rb, v, K)
        for side in range(2):  # torques in axes that turn: R^T t x dtheta
            row, x, y, z = 3 + 6 * side, 0.0, 0.0, 0.0
            for i in range(7):
                x, y, z = x + p[i] * J[i, row], y + p[i] * J[i, row + 1], z + p[i] * J[i, row + 2]
            _add_skew(K, row, row, 1.0, x, y, z)
        to_body_axes(K, Ra, Rb, Ra, Rb)
        add_to_bodies(k, model, K, matrix)
    add_mass_damping_tangents(c_rate, model, matrix)
