"""The thin ANCF cable: position and slope, e = (r_p, r_p,x, r_q, r_q,x); Green strain at 3 points, constant bending.

A second one, `cable_stretch_force` and its like, has engineering strain and the curvature of a stretched axis.

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
from evolvent.kernels.ancf import (
    damped_force_of,
    damped_tangent_of,
    energy_of,
    force_of,
    nodal_vectors,
    paper_damped_force_of,
    paper_damped_tangent_of,
    tangent_of,
)

#: Vectors and products of the cable.
N, PRODUCTS = 3, 6


@inlined
def cable_energy(e, H, h, U0, work):
    """Strain energy of a cable element, J.

    Parameters
    ----------
    e : (12,) float, coordinates (module docstring); m and 1
    H : (6, 6) float; h : (6,) float; U0 : float, the element's form (`evolvent.elements.cable_form`)
    work : (ancf.WORK,) float, scratch
    """
    return energy_of(e, H, h, U0, N, work)


@inlined
def cable_force(e, H, h, work, f):
    """f += dU/de, the force that the element resists with; f : (12,). Arguments as of `cable_energy`."""
    force_of(e, H, h, N, work, f)


@inlined
def cable_tangent(e, H, h, work, K):
    """K = d2U/de2 : (12, 12). Arguments as of `cable_energy`."""
    tangent_of(e, H, h, N, work, K)


@inlined
def cable_damped_force(e, u, b, H, h, work, f):
    """f += dU/de + b J^T H J u, damping of the membrane alone; returns the power that it takes, W.

    `add_bending_damping` adds that of the bending.

    Parameters
    ----------
    u : (12,) float, rates of the coordinates
    b : float, s
    """
    return damped_force_of(e, u, b, H, h, N, work, f)


@inlined
def cable_damped_tangent(e, u, b, c, H, h, work, K):
    """K = derivative of `cable_damped_force` with respect to e plus c (1/s) times that with respect to u : (12, 12)."""
    damped_tangent_of(e, u, b, c, H, h, N, work, K)


@inlined
def _curvature(B, p, e):
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
        q, qt = _curvature(B, p, e), _curvature(B, p, u)
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
        q, qt = _curvature(B, p, e), _curvature(B, p, u)
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
def cable_paper_damped_force(e, u, b, H, h, work, f):
    """f += dU/de + b K_e(e) u, damping by the secant stiffness, bending included; returns the power it takes, W.

    For comparison, not objective: as of `ancf.beam_paper_damped_force`.
    """
    return paper_damped_force_of(e, u, b, H, h, N, work, f)


@inlined
def cable_paper_damped_tangent(e, u, b, c, H, h, work, K):
    """K = derivative of `cable_paper_damped_force` with respect to e plus c (1/s) times that to u : (12, 12)."""
    paper_damped_tangent_of(e, u, b, c, H, h, N, work, K)


# ---------------------------------------------------------------------------------------------- engineering strain


@inlined
def _derivative(H, p, first, v):
    """r,x (first = 0) or r,xx (first = 3) at point p : (x, y, z)."""
    i, j, k = H[p, first], H[p, first + 1], H[p, first + 2]
    return i * v[0] + j * v[3] + k * v[6], i * v[1] + j * v[4] + k * v[7], i * v[2] + j * v[5] + k * v[8]


@inlined
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _vectors(e):
    """As `ancf.nodal_vectors`, as tuples."""
    return (e[3], e[4], e[5]), (e[6] - e[0], e[7] - e[1], e[8] - e[2]), (e[9], e[10], e[11])


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
def cable_stretch_energy(e, H, h, U0, work):
    """Strain energy of a cable element with engineering strain, J.

    Parameters
    ----------
    e : (12,) float, coordinates (module docstring); m and 1
    H : (6, 6) float; h : (6,) float; U0 : float, the element's form (`evolvent.elements.cable_stretch_form`): row p
        of H makes r,x (first three columns) and r,xx (last three) at point p of the vectors, H[3] holds weight times EA
        and weight times EI of the points, h the |r,x| without stress
    work : (ancf.WORK,) float, scratch

    Notes
    -----
    U = 1/2 int EA (|r,x| - 1)^2 + EI k^2 dx, both at the same 3 Gauss points. k = |r,x x r,xx|/|r,x|^2 is the turn of
    the tangent per length without stress, so that N = EA (|r,x| - 1) and M = EI k whatever the stretch (Gerstmayr &
    Irschik 2008). An element that spans 2 rad of a circle is 1.6 % too stiff; more points would lock it.
    """
    v = work[:9]
    nodal_vectors(e, 3, v)
    U = U0
    for p in range(3):
        a, q = _derivative(H, p, 0, v), _derivative(H, p, 3, v)
        aa = _dot(a, a)
        strain = math.sqrt(aa) - h[p]
        x, y, z = a[1] * q[2] - a[2] * q[1], a[2] * q[0] - a[0] * q[2], a[0] * q[1] - a[1] * q[0]
        U += 0.5 * H[3, p] * strain * strain + 0.5 * H[3, 3 + p] * (x * x + y * y + z * z) / (aa * aa)
    return U


@inlined
def _stressed(H, h, p, b, v, w):
    """Of point p: a = r,x and q = r,xx; factors of a for a, of both for the other, of q for q; power of the damping."""
    a, q = _combined(H[p, 0], H[p, 1], H[p, 2], v), _combined(H[p, 3], H[p, 4], H[p, 5], v)
    aa, aq, EA = _dot(a, a), _dot(a, q), H[3, p]
    stretch = math.sqrt(aa)
    i = 1.0 / stretch
    N, power = EA * (stretch - h[p]), 0.0
    if b != 0.0:
        rate = _dot(a, _combined(H[p, 0], H[p, 1], H[p, 2], w)) * i
        N += b * EA * rate
        power = b * EA * rate * rate
    ii = i * i
    EI = H[3, 3 + p] * (ii * ii)
    return a, q, N * i + EI * (2.0 * aq * aq * ii - _dot(q, q)), -EI * aq, EI * aa, power


@inlined
def _add_stress(H, p, a, q, on_a, both, on_q, f):
    """Add the force of point p."""
    x = _plane(H[p, 0] * on_a + H[p, 3] * both, a, H[p, 0] * both + H[p, 3] * on_q, q)
    d = _plane(H[p, 1] * on_a + H[p, 4] * both, a, H[p, 1] * both + H[p, 4] * on_q, q)
    z = _plane(H[p, 2] * on_a + H[p, 5] * both, a, H[p, 2] * both + H[p, 5] * on_q, q)
    f[0], f[1], f[2] = f[0] - d[0], f[1] - d[1], f[2] - d[2]
    f[3], f[4], f[5] = f[3] + x[0], f[4] + x[1], f[5] + x[2]
    f[6], f[7], f[8] = f[6] + d[0], f[7] + d[1], f[8] + d[2]
    f[9], f[10], f[11] = f[9] + z[0], f[10] + z[1], f[11] + z[2]


@inlined
def cable_stretch_force(e, u, b, H, h, B, work, f):
    """f += dU/de + damping proportional to the stiffness; f : (12,). Returns the power that the damping takes, W.

    Parameters
    ----------
    e, u : (12,) float, coordinates and their rates
    b : float, s
    B : (2, 4) float, for `add_bending_damping`
    H, h, work
        As of `cable_stretch_energy`.

    Notes
    -----
    The damping adds b EA |r,x|' to the axial force and, to the bending, what `add_bending_damping` does. With
    a = r,x and q = r,xx, the derivative of 1/2 EI k^2 to a is
    EI/(a.a)^2 ((2 (a.q)^2/a.a - q.q) a - a.q q), and to q it is EI/(a.a)^2 (a.a q - a.q a).
    """
    v, w = _vectors(e), _vectors(u)
    # all points before any force, so that their roots and divisions overlap
    a0, q0, on_a0, both0, on_q0, power0 = _stressed(H, h, 0, b, v, w)
    a1, q1, on_a1, both1, on_q1, power1 = _stressed(H, h, 1, b, v, w)
    a2, q2, on_a2, both2, on_q2, power2 = _stressed(H, h, 2, b, v, w)
    _add_stress(H, 0, a0, q0, on_a0, both0, on_q0, f)
    _add_stress(H, 1, a1, q1, on_a1, both1, on_q1, f)
    _add_stress(H, 2, a2, q2, on_a2, both2, on_q2, f)
    power = power0 + power1 + power2
    if b != 0.0:
        power += add_bending_damping(e, u, b, B, f)
    return power


@inlined
def cable_stretch_tangent(e, u, b, c, H, h, B, work, K):
    """K = derivative of `cable_stretch_force` with respect to e plus c (1/s) times that with respect to u : (12, 12).

    Notes
    -----
    With t = a/|a|, to a: N/|a| (I - t t^T) + EA t ((1 + b c) t + b (a' - t.a' t)/|a|)^T. The second derivatives of
    1/2 EI k^2 are, over EI/(a.a)^2 and with z = a.q/a.a,

    - to a and a: (2 z a.q - q.q) I + (4 q.q/a.a - 12 z^2) a a^T + 4 z (a q^T + q a^T) - q q^T;
    - to a and q: -a.q I + 4 z a a^T - 2 a q^T - q a^T;
    - to q and q: a.a I - a a^T.
    """
    v, w = work[:9], work[9:18]
    nodal_vectors(e, 3, v)
    nodal_vectors(u, 3, w)
    for i in range(3, 12):
        for j in range(3, 12):
            K[i, j] = 0.0
    for p in range(3):
        a, q, rate = _derivative(H, p, 0, v), _derivative(H, p, 3, v), _derivative(H, p, 0, w)
        aa, EA = _dot(a, a), H[3, p]
        stretch = math.sqrt(aa)
        grows = _dot(a, rate) / stretch
        N = EA * (stretch - h[p] + b * grows)
        square = (EA * (1.0 + b * c) - (N + b * EA * grows) / stretch) / aa
        add_stretch_tangent(H, p, a, q, N / stretch, _plane(square, a, b * EA / aa, rate), K)
    fill_first_position(K)
    if b != 0.0:
        add_bending_damping_tangent(e, u, b, c, B, K)


@inlined
def add_stretch_tangent(H, p, a, q, pull, right, K):
    """Tangent of point p by its vectors a and q: bending (`cable_stretch_tangent`), and pull I + a right^T to a."""
    aa, aq, qq = _dot(a, a), _dot(a, q), _dot(q, q)
    EI, z = H[3, 3 + p] / (aa * aa), aq / aa
    one, square = pull + EI * (2.0 * z * aq - qq), EI * (4.0 * qq / aa - 12.0 * z * z)
    S = (H[p, 0], H[p, 1], H[p, 2], H[p, 3], H[p, 4], H[p, 5])
    for i in range(3):
        for j in range(3):
            ss, sk, ks, kk = S[i] * S[j], S[i] * S[3 + j], S[3 + i] * S[j], S[3 + i] * S[3 + j]
            unit = ss * one - EI * ((sk + ks) * aq - kk * aa)
            by_aa = ss * square + EI * (4.0 * z * (sk + ks) - kk)
            by_aq, by_qa = EI * (4.0 * z * ss - 2.0 * sk - ks), EI * (4.0 * z * ss - sk - 2.0 * ks)
            for r in range(3):
                x, y, d = by_aa * a[r] + by_qa * q[r], by_aq * a[r] - EI * ss * q[r], ss * a[r]
                for s in range(3):
                    K[3 * i + 3 + r, 3 * j + 3 + s] += x * a[s] + y * q[s] + d * right[s]
                K[3 * i + 3 + r, 3 * j + 3 + r] += unit


@inlined
def fill_first_position(K):
    """Rows and columns of the first node's position in K, of those of the vectors without it."""
    for k in range(3):
        for j in range(3, 12):
            K[k, j] = -K[6 + k, j]
    for i in range(12):
        for k in range(3):
            K[i, k] = -K[i, 6 + k]
