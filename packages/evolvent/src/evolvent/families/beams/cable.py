"""The thin ANCF cable: position and slope, e = (r_p, r_p,x, r_q, r_q,x); Green strain at 3 points, constant bending.

A second one, `stretch_force` and its like, has engineering strain and the curvature of a stretched axis.

Its energy is a quadratic form like the beam's (`kernels.ancf`), in the 6 products of r_p,x, r_q - r_p and r_q,x. Mass
and loads are those of `kernels.ancf` with 4 shape functions.

Notes
-----
U = 1/2 int EA eps^2 dx (3 Gauss points) + 1/2 int EI r,xx . r,xx dx, eps = (r,x . r,x - 1)/2. Two points would leave
a motion without stiffness; more lock where an element spans a large angle. The second integral is the bending energy as
long as the stretch is small: the curvature is |r,x x r,xx|/|r,x|^3.

Damping proportional to the stiffness takes b H g' of the membrane, as the beam's does. Bending is linear in g and would
not be damped by it, so its damping acts on the rate of the curvature k = |r,xx|: power b int EI k'^2 dx, at 2 points
(exact for r,xx, which is linear in x). With q = B_p v, the root of the weight times EI and r,xx at a point p, the
force is B_p^T q b (q . q')/(q . q + eps_p). That is objective and keeps both momenta. A cable knows no directors, so
that a curvature which only turns about the tangent is not damped, as it is not in a rigid rotation. eps_p keeps the
direction q/|q| defined near the straight shape; it belongs to an element bent by `evolvent.elements.STRAIGHT` rad.
"""

import math

from evolvent.compiled.jit import inlined
from evolvent.compiled.views import matrix_view
from evolvent.kernels import ancf
from evolvent.kernels.ancf import GROUP
from evolvent.kernels.rotations import dot

#: Vectors and products of the cable.
N, PRODUCTS = 3, 6


@inlined
def slope_factors(length, xi):
    """Factors of the vectors of an element of which r,x at x = xi length is the sum."""
    return 1.0 - 4.0 * xi + 3.0 * xi * xi, 6.0 * xi * (1.0 - xi) / length, 3.0 * xi * xi - 2.0 * xi


@inlined
def curvature(B, p, e):
    """q = B_p v : (x, y, z)."""
    x = B[p, 0] * e[3] + B[p, 1] * (e[6] - e[0]) + B[p, 2] * e[9]
    y = B[p, 0] * e[4] + B[p, 1] * (e[7] - e[1]) + B[p, 2] * e[10]
    z = B[p, 0] * e[5] + B[p, 1] * (e[8] - e[2]) + B[p, 2] * e[11]
    return x, y, z


@inlined
def add_bending_damping(e, u, b, B, f):
    """f += objective damping of the bending, proportional to its stiffness; returns the power that it takes, W.

    Parameters
    ----------
    e, u : (12,) float, coordinates and their rates
    b : float, s
    B : (2, 4) float, curvature at two points and eps (`evolvent.elements.cable_bending`)
    f : (12,) float
    """
    power = 0.0
    for p in range(2):
        q, qt = curvature(B, p, e), curvature(B, p, u)
        rate = q[0] * qt[0] + q[1] * qt[1] + q[2] * qt[2]
        k = b * rate / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + B[p, 3])
        power += k * rate
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for i in range(4):
            for c in range(3):
                f[3 * i + c] += k * a[i] * q[c]
    return power


@inlined
def add_bending_damping_tangent(e, u, b, c, B, K):
    """K += derivative of `add_bending_damping` with respect to e plus c (1/s) times that with respect to u : (12, 12).

    Notes
    -----
    Sum over p of B_p^T D B_p, D = b/Q (q . q' I + q (q' + c q - 2 (q . q')/Q q)^T), Q = q . q + eps_p.
    """
    for p in range(2):
        q, qt = curvature(B, p, e), curvature(B, p, u)
        rate = q[0] * qt[0] + q[1] * qt[1] + q[2] * qt[2]
        Q = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + B[p, 3]
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for r in range(3):
            for s in range(3):
                D = q[r] * (qt[s] + (c - 2.0 * rate / Q) * q[s])
                if r == s:
                    D += rate
                for i in range(4):
                    for j in range(4):
                        K[3 * i + r, 3 * j + s] += b / Q * D * a[i] * a[j]


@inlined
def add_bending_filter(u, interval, B, changes, f):
    """Add the filter's force on the bending of a cable element, whose energy contains none of its changes.

    Parameters
    ----------
    u : (12,) float, increments over the length of the step
    B : (2, 4) float (`evolvent.elements.cable_bending`)
    changes : (2 ancf.PRODUCTS,) float, behind those of products changes of the root of the energy times the curvature
        at two points, over the step before, and output over this one

    Notes
    -----
    The vectors of curvature do not turn with the element, so that this is for systems that something holds.
    """
    h, _, chi, ratio = interval
    for p in range(2):
        q = curvature(B, p, u)
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for c in range(3):
            at = PRODUCTS + 3 * p + c
            changes[ancf.PRODUCTS + at] = h * q[c]
            force = 0.5 * chi * (h * q[c] - ratio * changes[at])
            for i in range(4):
                f[3 * i + c] += a[i] * force


@inlined
def add_bending_filter_tangent(chi, B, K):
    """Add twice the derivative of `add_bending_filter` by the end's coordinates."""
    for p in range(2):
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for i in range(4):
            for j in range(4):
                for c in range(3):
                    K[3 * i + c, 3 * j + c] += chi * a[i] * a[j]


@inlined
def add_bending_losses(e, u, interval, b, B, changes, f):
    """Damping and filter of the bending of any cable; returns the power that the damping takes, W."""
    if interval[2] != 0.0:
        add_bending_filter(u, interval, B, changes, f)
    return add_bending_damping(e, u, b, B, f) if b != 0.0 else 0.0


@inlined
def add_bending_losses_tangent(e, u, interval, b, c, B, K):
    """Tangent of `add_bending_losses`."""
    if b != 0.0:
        add_bending_damping_tangent(e, u, b, c, B, K)
    if interval[2] != 0.0:
        add_bending_filter_tangent(interval[2], B, K)


# ---------------------------------------------------------------------------------------------- engineering strain


@inlined
def _derivative(H, p, first, v):
    """r,x (first = 0) or r,xx (first = 3) at point p : (x, y, z)."""
    i, j, k = H[p, first], H[p, first + 1], H[p, first + 2]
    return i * v[0] + j * v[3] + k * v[6], i * v[1] + j * v[4] + k * v[7], i * v[2] + j * v[5] + k * v[8]


@inlined
def _vectors(e, i):
    """Nodal vectors (`ancf.nodal_vectors`) of the coordinates that begin at index i, as tuples."""
    d = (e[i + 6] - e[i], e[i + 7] - e[i + 1], e[i + 8] - e[i + 2])
    return (e[i + 3], e[i + 4], e[i + 5]), d, (e[i + 9], e[i + 10], e[i + 11])


@inlined
def _combined(i, j, k, v):
    """Sum of three vectors, each times its factor."""
    a, b, c = v
    return i * a[0] + j * b[0] + k * c[0], i * a[1] + j * b[1] + k * c[1], i * a[2] + j * b[2] + k * c[2]


@inlined
def _plane(i, a, j, b):
    """i a + j b."""
    return i * a[0] + j * b[0], i * a[1] + j * b[1], i * a[2] + j * b[2]


@inlined
def stretch_energy(e, H, h, U0, work):
    """Strain energy of a cable element with engineering strain, J.

    Parameters
    ----------
    e : (12,) float, coordinates (module docstring); m and 1
    H : (6, 6) float; h : (6,) float; U0 : float, the element's form (`evolvent.elements.cable_stretch_form`): row p
        of H makes r,x (first three columns) and r,xx (last three) at point p of the vectors, H[3] holds weight times EA
        and weight times EI of the points, h the |r,x| without stress
    work : not used

    Notes
    -----
    U = 1/2 int EA (|r,x| - 1)^2 + EI k^2 dx, both at the same 3 Gauss points. k = |r,x x r,xx|/|r,x|^2 is the turn of
    the tangent per length without stress, so that N = EA (|r,x| - 1) and M = EI k whatever the stretch (Gerstmayr &
    Irschik 2008). An element that spans 2 rad of a circle is 1.6 % too stiff; more points would lock it.
    """
    return U0 + _strain_energy(_vectors(e, 0), H, h)


@inlined
def _strain_energy(v, H, h):
    """Strain energy as of `stretch_energy`, by the nodal vectors of the element."""
    U = 0.0
    for p in range(3):
        a, q = _combined(H[p, 0], H[p, 1], H[p, 2], v), _combined(H[p, 3], H[p, 4], H[p, 5], v)
        aa = dot(a, a)
        strain = math.sqrt(aa) - h[p]
        x, y, z = a[1] * q[2] - a[2] * q[1], a[2] * q[0] - a[0] * q[2], a[0] * q[1] - a[1] * q[0]
        U += 0.5 * H[3, p] * strain * strain + 0.5 * H[3, 3 + p] * (x * x + y * y + z * z) / (aa * aa)
    return U


@inlined
def _stressed(H, h, p, b, v, w):
    """Of point p at a state: a = r,x and q = r,xx; factors of a for a, of both for the other, of q for q; lost."""
    a, q = _combined(H[p, 0], H[p, 1], H[p, 2], v), _combined(H[p, 3], H[p, 4], H[p, 5], v)
    aa, aq, EA = dot(a, a), dot(a, q), H[3, p]
    stretch = math.sqrt(aa)
    i = 1.0 / stretch
    N, power = EA * (stretch - h[p]), 0.0
    if b != 0.0:
        rate = dot(a, _combined(H[p, 0], H[p, 1], H[p, 2], w)) * i
        N += b * EA * rate
        power = b * EA * rate * rate
    ii = i * i
    EI = H[3, 3 + p] * (ii * ii)
    return a, q, N * i + EI * (2.0 * aq * aq * ii - dot(q, q)), -EI * aq, EI * aa, power


@inlined
def _ends(H, p, first, h, v, w):
    """r,x (first = 0) or r,xx (first = 3) at point p: at the start and the end of a step, and their mean."""
    i, j, k, half = H[p, first], H[p, first + 1], H[p, first + 2], 0.5 * h
    m, d = _combined(i, j, k, v), _combined(half * i, half * j, half * k, w)
    return (m[0] - d[0], m[1] - d[1], m[2] - d[2]), (m[0] + d[0], m[1] + d[1], m[2] + d[2]), m


@inlined
def _stretched(H, hh, p, b, interval, changes, a0, a1):
    """Axial force at point p over a step, the mean of the stretch, the stretch at its end, and lost power."""
    h, chi, _, ratio = interval
    l0, l1, EA = math.sqrt(dot(a0, a0)), math.sqrt(dot(a1, a1)), H[3, p]
    d, mean = l1 - l0, 0.5 * (l0 + l1)
    changes[ancf.PRODUCTS + p] = d
    N = EA * (mean - hh[p] + 0.5 * chi * (d - ratio * changes[p]) + b * d / h)
    return N, mean, l1, b * EA * (d / h) * (d / h)


@inlined
def _stressed_between(H, hh, p, b, interval, changes, v, w):
    """As `_stressed`, over a step.

    Notes
    -----
    With w = 1/(a.a) the stretch |a| changes by am . da over its mean, and the square of the curvature,
    q.q w - (a.q)^2 w^2, by wm d(q.q) + ((q.q)m - 2 wm ((a.q)^2)m) dw - 2 (w^2)m (a.q)m d(a.q), where
    dw = -w0 w1 d(a.a). The filter acts on the stretch.
    """
    a0, a1, a = _ends(H, p, 0, interval[0], v, w)
    q0, q1, q = _ends(H, p, 3, interval[0], v, w)
    N, mean, _, lost = _stretched(H, hh, p, b, interval, changes, a0, a1)
    w0, w1, aq0, aq1 = 1.0 / dot(a0, a0), 1.0 / dot(a1, a1), dot(a0, q0), dot(a1, q1)
    wm, ww, EI = 0.5 * (w0 + w1), 0.5 * (w0 * w0 + w1 * w1), H[3, 3 + p]
    aq, qq = 0.5 * (aq0 + aq1), 0.5 * (dot(q0, q0) + dot(q1, q1))
    on_a = N / mean - EI * (qq - wm * (aq0 * aq0 + aq1 * aq1)) * w0 * w1
    return a, q, on_a, -EI * ww * aq, EI * wm, lost


@inlined
def _nodal_forces(H, p, a, q, on_a, both, on_q):
    """Generalized forces of point p on the nodal vectors r_p,x, r_q - r_p and r_q,x."""
    x = _plane(H[p, 0] * on_a + H[p, 3] * both, a, H[p, 0] * both + H[p, 3] * on_q, q)
    d = _plane(H[p, 1] * on_a + H[p, 4] * both, a, H[p, 1] * both + H[p, 4] * on_q, q)
    z = _plane(H[p, 2] * on_a + H[p, 5] * both, a, H[p, 2] * both + H[p, 5] * on_q, q)
    return x, d, z


@inlined
def _add_stress(H, p, a, q, on_a, both, on_q, f):
    """Add the force of point p."""
    x, d, z = _nodal_forces(H, p, a, q, on_a, both, on_q)
    f[0], f[1], f[2] = f[0] - d[0], f[1] - d[1], f[2] - d[2]
    f[3], f[4], f[5] = f[3] + x[0], f[4] + x[1], f[5] + x[2]
    f[6], f[7], f[8] = f[6] + d[0], f[7] + d[1], f[8] + d[2]
    f[9], f[10], f[11] = f[9] + z[0], f[10] + z[1], f[11] + z[2]


@inlined
def stretch_force(e, u, interval, b, H, h, B, changes, work, f):
    """f += dU/de + damping proportional to the stiffness; f : (12,). Returns the power that the damping takes, W.

    Parameters
    ----------
    e, u, interval, b, changes : as of `ancf.force_of`; the changes are those of the stretch at three points
    B : (2, 4) float, for `add_bending_damping`
    H, h, work
        As of `stretch_energy`.

    Notes
    -----
    The damping adds b EA |r,x|' to the axial force and, to the bending, what `add_bending_damping` does. With
    a = r,x and q = r,xx, the derivative of 1/2 EI k^2 to a is
    EI/(a.a)^2 ((2 (a.q)^2/a.a - q.q) a - a.q q), and to q it is EI/(a.a)^2 (a.a q - a.q a).
    """
    v, w = _vectors(e, 0), _vectors(u, 0)
    if interval[0] != 0.0:
        power = 0.0
        for p in range(3):
            a, q, on_a, both, on_q, lost = _stressed_between(H, h, p, b, interval, changes, v, w)
            _add_stress(H, p, a, q, on_a, both, on_q, f)
            power += lost
        return power + add_bending_losses(e, u, interval, b, B, changes, f)
    # all points before any force, so that their roots and divisions overlap
    a0, q0, on_a0, both0, on_q0, power0 = _stressed(H, h, 0, b, v, w)
    a1, q1, on_a1, both1, on_q1, power1 = _stressed(H, h, 1, b, v, w)
    a2, q2, on_a2, both2, on_q2, power2 = _stressed(H, h, 2, b, v, w)
    _add_stress(H, 0, a0, q0, on_a0, both0, on_q0, f)
    _add_stress(H, 1, a1, q1, on_a1, both1, on_q1, f)
    _add_stress(H, 2, a2, q2, on_a2, both2, on_q2, f)
    return power0 + power1 + power2 + add_bending_losses(e, u, interval, b, B, changes, f)


@inlined
def _mass_row_product(M, i, a, b, c, d):
    """Row i of a (4, 4) mass matrix times four vectors."""
    m0, m1, m2, m3 = M[i, 0], M[i, 1], M[i, 2], M[i, 3]
    x = m0 * a[0] + m1 * b[0] + m2 * c[0] + m3 * d[0]
    y = m0 * a[1] + m1 * b[1] + m2 * c[1] + m3 * d[1]
    z = m0 * a[2] + m1 * b[2] + m2 * c[2] + m3 * d[2]
    return x, y, z


@inlined
def stretch_forces(y, a, scale, n, H, h, M, work, F):
    """F += elastic and inertia forces of n consecutive elements with equal constants at a state; see `stretch_force`.

    Parameters
    ----------
    y : (6 n + 6,) float, nodal coordinates
    a : (6 n + 6,) float, nodal accelerations divided by `scale`
    n : int, at most `GROUP`
    M : (4, 4) float, kg, kg m and kg m2, mass matrix of an element
    F : (6 n + 6,) float, nodal forces, added to

    Notes
    -----
    The first loop has no branches and writes to consecutive memory, so that compilers vectorize it over elements.
    """
    for k in range(n):
        i = 6 * k
        v = _vectors(y, i)
        a0, q0, on_a0, both0, on_q0, _ = _stressed(H, h, 0, 0.0, v, v)
        a1, q1, on_a1, both1, on_q1, _ = _stressed(H, h, 1, 0.0, v, v)
        a2, q2, on_a2, both2, on_q2, _ = _stressed(H, h, 2, 0.0, v, v)
        x0, d0, z0 = _nodal_forces(H, 0, a0, q0, on_a0, both0, on_q0)
        x1, d1, z1 = _nodal_forces(H, 1, a1, q1, on_a1, both1, on_q1)
        x2, d2, z2 = _nodal_forces(H, 2, a2, q2, on_a2, both2, on_q2)
        b0 = (scale * a[i], scale * a[i + 1], scale * a[i + 2])
        b1 = (scale * a[i + 3], scale * a[i + 4], scale * a[i + 5])
        b2 = (scale * a[i + 6], scale * a[i + 7], scale * a[i + 8])
        b3 = (scale * a[i + 9], scale * a[i + 10], scale * a[i + 11])
        m = _mass_row_product(M, 0, b0, b1, b2, b3)
        work[k] = m[0] - d0[0] - d1[0] - d2[0]
        work[GROUP + k] = m[1] - d0[1] - d1[1] - d2[1]
        work[2 * GROUP + k] = m[2] - d0[2] - d1[2] - d2[2]
        m = _mass_row_product(M, 1, b0, b1, b2, b3)
        work[3 * GROUP + k] = m[0] + x0[0] + x1[0] + x2[0]
        work[4 * GROUP + k] = m[1] + x0[1] + x1[1] + x2[1]
        work[5 * GROUP + k] = m[2] + x0[2] + x1[2] + x2[2]
        m = _mass_row_product(M, 2, b0, b1, b2, b3)
        work[6 * GROUP + k] = m[0] + d0[0] + d1[0] + d2[0]
        work[7 * GROUP + k] = m[1] + d0[1] + d1[1] + d2[1]
        work[8 * GROUP + k] = m[2] + d0[2] + d1[2] + d2[2]
        m = _mass_row_product(M, 3, b0, b1, b2, b3)
        work[9 * GROUP + k] = m[0] + z0[0] + z1[0] + z2[0]
        work[10 * GROUP + k] = m[1] + z0[1] + z1[1] + z2[1]
        work[11 * GROUP + k] = m[2] + z0[2] + z1[2] + z2[2]
    for c in range(6):
        F[c] += work[c * GROUP]
        F[6 * n + c] += work[(6 + c) * GROUP + n - 1]
    for k in range(1, n):
        for c in range(6):
            F[6 * k + c] += work[c * GROUP + k] + work[(6 + c) * GROUP + k - 1]


@inlined
def _quadratic_form(M, a, b, c, d):
    """Sum of x^T M x over the components x of four vectors; M : (4, 4), symmetric."""
    x = M[0, 0] * dot(a, a) + M[1, 1] * dot(b, b) + M[2, 2] * dot(c, c) + M[3, 3] * dot(d, d)
    y = M[0, 1] * dot(a, b) + M[0, 2] * dot(a, c) + M[0, 3] * dot(a, d)
    return x + 2.0 * (y + M[1, 2] * dot(b, c) + M[1, 3] * dot(b, d) + M[2, 3] * dot(c, d))


@inlined
def stretch_energies(y, u, n, H, h, bending_H, bending_h, M, work, out):
    """out : (3,) += kinetic, strain and bending energy, J, of n consecutive elements with equal constants.

    Parameters
    ----------
    y, u : (6 n + 6,) float, nodal coordinates and their rates
    bending_H, bending_h : as H and h of `stretch_energy`, for bending alone
    """
    for k in range(n):
        i = 6 * k
        v = _vectors(y, i)
        a, b = (u[i], u[i + 1], u[i + 2]), (u[i + 3], u[i + 4], u[i + 5])
        c, d = (u[i + 6], u[i + 7], u[i + 8]), (u[i + 9], u[i + 10], u[i + 11])
        work[k] = 0.5 * _quadratic_form(M, a, b, c, d)
        work[GROUP + k] = _strain_energy(v, H, h)
        work[2 * GROUP + k] = _strain_energy(v, bending_H, bending_h)
    for c in range(3):
        for k in range(n):
            out[c] += work[c * GROUP + k]


@inlined
def stretch_tangent(e, u, interval, b, c, H, h, B, changes, work, K):
    """K : (12, 12), of `stretch_force` as `ancf.tangent_of`; the bending over a step is that of its mean shape.

    Notes
    -----
    With t = a/|a|, to a: N/|a| (I - t t^T) + EA t ((1 + b c) t + b (a' - t.a' t)/|a|)^T. The second derivatives of
    1/2 EI k^2 are, over EI/(a.a)^2 and with z = a.q/a.a,

    - to a and a: (2 z a.q - q.q) I + (4 q.q/a.a - 12 z^2) a a^T + 4 z (a q^T + q a^T) - q q^T;
    - to a and q: -a.q I + 4 z a a^T - 2 a q^T - q a^T;
    - to q and q: a.a I - a a^T.
    """
    v, w, chi = _vectors(e, 0), _vectors(u, 0), interval[1]
    for p in range(3):
        EA = H[3, p]
        if interval[0] != 0.0:
            a0, a1, a = _ends(H, p, 0, interval[0], v, w)
            q = _combined(H[p, 3], H[p, 4], H[p, 5], v)
            N, mean, size, _ = _stretched(H, h, p, b, interval, changes, a0, a1)
            pull, factor = N / mean, (EA * (1.0 + chi + b * c) - N / mean) / (mean * size)
            right = (factor * a1[0], factor * a1[1], factor * a1[2])
        else:
            a, q = _combined(H[p, 0], H[p, 1], H[p, 2], v), _combined(H[p, 3], H[p, 4], H[p, 5], v)
            rate, aa = _combined(H[p, 0], H[p, 1], H[p, 2], w), dot(a, a)
            stretch = math.sqrt(aa)
            grows = dot(a, rate) / stretch
            N = EA * (stretch - h[p] + b * grows)
            square = (EA * (1.0 + b * c) - (N + b * EA * grows) / stretch) / aa
            pull, right = N / stretch, _plane(square, a, b * EA / aa, rate)
        write_stretch_columns(H, p, a, q, pull, right, matrix_view(work, 72 * p, 6, 12))
    write_stretch_tangent(H, work, K)
    add_bending_losses_tangent(e, u, interval, b, c, B, K)


@inlined
def write_stretch_columns(H, p, a, q, pull, right, T):
    """Derivatives of the forces of point p on a and on q by the coordinates.

    T : (6, 12) float, output; the first three rows belong to a, the others to q.


    Bending as in `stretch_tangent`; the derivative of the force on a by a also has the term pull I + a right^T.
    """
    aa, aq, qq = dot(a, a), dot(a, q), dot(q, q)
    EI, z = H[3, 3 + p] / (aa * aa), aq / aa
    one, square = pull + EI * (2.0 * z * aq - qq), EI * (4.0 * qq / aa - 12.0 * z * z)
    zz, mixed = 4.0 * EI * z, -EI * aq
    for r in range(3):
        x, y = square * a[r] + zz * q[r], zz * a[r] - EI * q[r]
        u, w, d = zz * a[r] - EI * q[r], -2.0 * EI * a[r], -EI * a[r]
        e, f = zz * a[r] - 2.0 * EI * q[r], -EI * a[r]
        for s in range(3):
            by_aa, by_aq = x * a[s] + y * q[s] + a[r] * right[s], u * a[s] + w * q[s]
            by_qa, by_qq = e * a[s] + f * q[s], d * a[s]
            if r == s:
                by_aa, by_aq, by_qa, by_qq = by_aa + one, by_aq + mixed, by_qa + mixed, by_qq + EI * aa
            for j in range(3):
                i, k = H[p, j], H[p, 3 + j]
                T[r, 3 + 3 * j + s] = i * by_aa + k * by_aq
                T[3 + r, 3 + 3 * j + s] = i * by_qa + k * by_qq
            T[r, s], T[3 + r, s] = -T[r, 6 + s], -T[3 + r, 6 + s]


@inlined
def write_stretch_tangent(H, T, K):
    """Tangent K from the derivatives that `write_stretch_columns` has written to T for each of the three points."""
    T0, T1, T2 = matrix_view(T, 0, 6, 12), matrix_view(T, 72, 6, 12), matrix_view(T, 144, 6, 12)
    for j in range(3):
        i0, k0, i1, k1, i2, k2 = H[0, j], H[0, 3 + j], H[1, j], H[1, 3 + j], H[2, j], H[2, 3 + j]
        for r in range(3):
            for c in range(12):
                x = i0 * T0[r, c] + k0 * T0[3 + r, c] + i1 * T1[r, c] + k1 * T1[3 + r, c]
                K[3 + 3 * j + r, c] = x + i2 * T2[r, c] + k2 * T2[3 + r, c]
    for r in range(3):
        for c in range(12):
            K[r, c] = -K[6 + r, c]


@inlined
def fill_first_position(K):
    """Rows and columns of the first node's position in K, of those of the vectors without it."""
    for k in range(3):
        for j in range(3, 12):
            K[k, j] = -K[6 + k, j]
    for i in range(12):
        for k in range(3):
            K[i, k] = -K[i, 6 + k]
