"""Elastic forces and tangents of ANCF elements as quadratic forms in the inner products of their nodal vectors.

A beam's coordinates are e = (r_p, r_p,x, r_p,y, r_p,z, r_q, r_q,x, r_q,y, r_q,z), a cable's its positions and
slopes. Translation leaves n vectors v, those of e without r_p and with d = r_q - r_p in the place of r_q: n = 7 for the
beam, 3 for the cable. The strain energy depends on their products v_i . v_j alone and, with Green strain, is quadratic
in them. `evolvent.elements` builds the constants H, h, U0 of each formulation.

Notes
-----
With g the products, i <= j, row by row (28, or 6), and J = dg/dv:

- energy U = 1/2 g^T H g - h^T g + U0;
- force J^T s = A v, s = H g - h, A symmetric with A_ii = 2 s_ii, A_ij = s_ij;
- tangent A (x) I3 + J^T H J;
- damping b times the stiffness, objective since it knows nothing but the rate of g: J^T b H g'. With it s becomes
  H (g + b g') - h, and the derivative with respect to e plus c times that to e' is
  A (x) I3 + J(v)^T H J(w), w = (1 + b c) v + b v';
- over an interval of length h between two states, the force acts along the mean v of both ends, w its rate: g changes
  by h g' = h J(v) w exactly, and the mean of its values at both ends is g(v) + (h/2)^2 g(w). With the stress of that
  mean the work is the change of U. A step of energy-momentum adds chi/2 (h g' - ratio dg_p) to it, dg_p the change over
  the step before. A state is an interval of length 0;
- damping b K_e e' of Yi et al. (2017), with the secant stiffness K_e = K1 + K2(e) that F = K_e e: K1 is A of -h, and
  K2 = 1/2 J^T H J (the symmetric parts of its S_ab). It is not objective: K1 v' is not zero in a rigid rotation, and
  negative where nothing is strained. s becomes H (g + b g'/2) - h, to the
  force comes -b A(h) v', and the derivative is A (x) I3 + J(v)^T H J(w) with s - b c h in the place of s and
  w = (1 + b c/2) v + b v'/2.
"""

from numba import types

from evolvent.compiled.jit import REAL, VECTOR, entry, inlined, kernel
from evolvent.compiled.views import matrix_view

#: Vectors and products of the beam.
N, PRODUCTS = 7, 28
#: Length of the scratch memory `work` that an element's force or tangent needs; its contents mean nothing.
WORK = 704
#: Largest number of consecutive elements that are evaluated together: the scratch memory holds twelve numbers of each.
GROUP = 56
#: An interval: its length h (s), the filter's chi of strains and of velocities, and ratio; a state.
INTERVAL, STATE = types.UniTuple(REAL, 4), (0.0, 0.0, 0.0, 0.0)
#: What `line_strains` writes, in this order.
STRAINS = ("axial", "shear_y", "shear_z", "twist", "bend_y", "bend_z", "thick_y", "thick_z", "shear_yz")


# ---------------------------------------------------------------------------------------------- any number of vectors


@inlined
def pair(i, j, n):
    """Index of v_i . v_j among the products of n vectors."""
    a, b = min(i, j), max(i, j)
    return a * n - a * (a - 1) // 2 + b - a


@inlined
def nodal_vectors(e, n, v):
    """v : (3 n,) = e[3:], with d = r_q - r_p in the place of r_q."""
    m = 3 * (n // 2)
    for i in range(3 * n):
        v[i] = e[i + 3]
    for c in range(3):
        v[m + c] -= e[c]


@inlined
def products(v, n, g):
    """g = v_i . v_j, i <= j."""
    k = 0
    for i in range(n):
        for j in range(i, n):
            g[k] = v[3 * i] * v[3 * j] + v[3 * i + 1] * v[3 * j + 1] + v[3 * i + 2] * v[3 * j + 2]
            k += 1


@inlined
def add_product_rates(v, w, b, n, g):
    """g += b J(v) w, that is b (v_i . w_j + w_i . v_j)."""
    k = 0
    for i in range(n):
        for j in range(i, n):
            for c in range(3):
                g[k] += b * (v[3 * i + c] * w[3 * j + c] + w[3 * i + c] * v[3 * j + c])
            k += 1


@inlined
def multiply(H, g, n, s):
    """s = H g.

    Two rows of H at a time: half the loads and stores of s; 210 ns against 430 for the force of a beam.
    """
    m = n * (n + 1) // 2
    for i in range(m):
        s[i] = 0.0
    for j in range(0, m, 2):
        for i in range(m):
            s[i] += H[j, i] * g[j] + H[j + 1, i] * g[j + 1]


@inlined
def stresses(H, h, g, n, s):
    """s = H g - h."""
    multiply(H, g, n, s)
    for i in range(n * (n + 1) // 2):
        s[i] -= h[i]


@inlined
def add_force(s, v, n, f):
    """f += J^T s; r_p takes the reaction to the force on d."""
    m = 3 * (n // 2) + 3
    for c in range(3):
        f[c] += f[m + c]
    k = 0
    for i in range(n):
        for j in range(i, n):
            for c in range(3):
                f[3 * i + 3 + c] += s[k] * v[3 * j + c]
                f[3 * j + 3 + c] += s[k] * v[3 * i + c]
            k += 1
    for c in range(3):
        f[c] -= f[m + c]


@inlined
def write_tangent(H, s, v, w, n, T, K):
    """K = A (x) I3 + J(v)^T H J(w); T : (3 n, n (n + 1) / 2) scratch."""
    m = n * (n + 1) // 2
    for i in range(n):  # T = (H J(v))^T
        for r in range(m):
            T[3 * i, r] = T[3 * i + 1, r] = T[3 * i + 2, r] = 0.0
        for j in range(n):
            k = pair(i, j, n)
            twice = 2.0 if i == j else 1.0
            x, y, z = twice * v[3 * j], twice * v[3 * j + 1], twice * v[3 * j + 2]
            for r in range(m):
                T[3 * i, r] += H[k, r] * x
                T[3 * i + 1, r] += H[k, r] * y
                T[3 * i + 2, r] += H[k, r] * z
    for q in range(3 * n):  # T J(w)
        for i in range(n):
            x = y = z = 0.0
            for j in range(n):
                t = (2.0 if i == j else 1.0) * T[q, pair(i, j, n)]
                x += t * w[3 * j]
                y += t * w[3 * j + 1]
                z += t * w[3 * j + 2]
            K[q + 3, 3 * i + 3] = x
            K[q + 3, 3 * i + 4] = y
            K[q + 3, 3 * i + 5] = z
    k = 0
    for i in range(n):
        for j in range(i, n):
            for c in range(3):
                K[3 * i + 3 + c, 3 * j + 3 + c] += s[k]
                K[3 * j + 3 + c, 3 * i + 3 + c] += s[k]
            k += 1
    d = 3 * (n // 2) + 3
    for c in range(3):
        for q in range(3, 3 * n + 3):
            K[c, q] = -K[d + c, q]
    for q in range(3 * n + 3):
        for c in range(3):
            K[q, c] = -K[q, d + c]


@inlined
def energy_of(e, H, h, U0, n, work):
    """U, J."""
    m = n * (n + 1) // 2
    v, g, s = work[: 3 * n], work[3 * n : 3 * n + m], work[3 * n + m : 3 * n + 2 * m]
    nodal_vectors(e, n, v)
    products(v, n, g)
    stresses(H, h, g, n, s)
    U = U0
    for k in range(m):
        U += 0.5 * g[k] * (s[k] - h[k])
    return U


@inlined
def _write_products(e, u, interval, is_moving, n, changes, v, w, g, rate):
    """Vectors v and w of e and u, products g whose stress acts over an interval, and their rates where they are used.

    Parameters
    ----------
    is_moving : bool, whether a state's rates are used
    changes : (2 PRODUCTS,) float, changes of the products over the step before, and output over this one
    """
    h, chi, _, ratio = interval
    nodal_vectors(e, n, v)
    products(v, n, g)
    if h == 0.0 and not is_moving:
        return
    m = n * (n + 1) // 2
    nodal_vectors(u, n, w)
    for k in range(m):
        rate[k] = 0.0
    add_product_rates(v, w, 1.0, n, rate)
    if h != 0.0:
        add_product_rates(w, w, 0.125 * h * h, n, g)
        for k in range(m):
            d = h * rate[k]
            changes[PRODUCTS + k] = d
            g[k] += 0.5 * chi * (d - ratio * changes[k])


@inlined
def force_of(e, u, interval, b, H, h, n, changes, work, f):
    """f += dU/de + J^T b H g' of an element over an interval; returns the power that the damping takes, W.

    Parameters
    ----------
    e, u : coordinates, of a step their means, and rates, of a step the increments over its length
    interval : see `INTERVAL`
    b : float, s
    H, h : form of the element; n : its number of vectors
    changes : as of `_write_products`
    work : (WORK,) float, scratch
    """
    m = n * (n + 1) // 2
    v, g, s = work[: 3 * n], work[3 * n : 3 * n + m], work[3 * n + m : 3 * n + 2 * m]
    w, rate = work[3 * n + 2 * m : 6 * n + 2 * m], work[6 * n + 2 * m : 6 * n + 3 * m]
    t, power = work[6 * n + 3 * m : 6 * n + 4 * m], 0.0
    _write_products(e, u, interval, b != 0.0, n, changes, v, w, g, rate)
    stresses(H, h, g, n, s)
    if b != 0.0:
        multiply(H, rate, n, t)
        for k in range(m):
            power += b * t[k] * rate[k]
            s[k] += b * t[k]
    add_force(s, v, n, f)
    return power


@inlined
def tangent_of(e, u, interval, b, c, H, h, n, changes, work, K):
    """K = d/de + c d/de' of the force of `force_of`; over a step twice that by its end's coordinates, with c = 2/h."""
    m = n * (n + 1) // 2
    v, g, s = work[: 3 * n], work[3 * n : 3 * n + m], work[3 * n + m : 3 * n + 2 * m]
    a, (h_e, chi, _, _) = 6 * n + 2 * m, interval
    w = work[3 * n + 2 * m : a]
    _write_products(e, u, interval, b != 0.0, n, changes, v, w, g, work[a : a + m])
    if b != 0.0:
        add_product_rates(v, w, b, n, g)
    stresses(H, h, g, n, s)
    if h_e == 0.0 and b == 0.0:
        for i in range(3 * n):
            w[i] = v[i]
    else:
        own = b if h_e == 0.0 else 0.0
        for i in range(3 * n):
            w[i] = (1.0 + chi + b * c) * (v[i] + 0.5 * h_e * w[i]) + own * w[i]
    write_tangent(H, s, v, w, n, matrix_view(work, a, 3 * n, m), K)


@inlined
def note_changes(elements):
    """Keep what elements have changed by over the last step, for the filter of the next one."""
    for k in range(elements.size):
        changes = elements[k].changes
        for i in range(PRODUCTS):
            changes[i] = changes[PRODUCTS + i]


@inlined
def paper_damped_force_of(e, u, b, H, h, n, work, f):
    """f += dU/de + b K_e e'; returns the power that the damping takes, W."""
    m = n * (n + 1) // 2
    v, g, s = work[: 3 * n], work[3 * n : 3 * n + m], work[3 * n + m : 3 * n + 2 * m]
    w, rate = work[3 * n + 2 * m : 6 * n + 2 * m], work[6 * n + 2 * m : 6 * n + 3 * m]
    t = work[6 * n + 3 * m : 6 * n + 4 * m]
    nodal_vectors(e, n, v)
    nodal_vectors(u, n, w)
    for k in range(m):
        rate[k] = 0.0
    add_product_rates(v, w, 1.0, n, rate)
    products(v, n, g)
    stresses(H, h, g, n, s)
    multiply(H, rate, n, t)
    products(w, n, g)
    power = 0.0
    for k in range(m):
        power += b * (0.5 * t[k] * rate[k] - 2.0 * h[k] * g[k])
        s[k] += 0.5 * b * t[k]
        t[k] = -b * h[k]
    add_force(s, v, n, f)
    add_force(t, w, n, f)
    return power


@inlined
def paper_damped_tangent_of(e, u, b, c, H, h, n, work, K):
    """K = d/de + c d/de' of the force of `paper_damped_force_of`."""
    m = n * (n + 1) // 2
    v, g, s = work[: 3 * n], work[3 * n : 3 * n + m], work[3 * n + m : 3 * n + 2 * m]
    a = 6 * n + 2 * m
    w = work[3 * n + 2 * m : a]
    nodal_vectors(e, n, v)
    nodal_vectors(u, n, w)
    products(v, n, g)
    add_product_rates(v, w, 0.5 * b, n, g)
    stresses(H, h, g, n, s)
    for k in range(m):
        s[k] -= b * c * h[k]
    for i in range(3 * n):
        w[i] = (1.0 + 0.5 * b * c) * v[i] + 0.5 * b * w[i]
    write_tangent(H, s, v, w, n, matrix_view(work, a, 3 * n, m), K)


# ---------------------------------------------------------------------------------------------- the beam


@entry(REAL, REAL, REAL, REAL, VECTOR)
@kernel
def beam_shape(length, xi, y, z, S):
    """Shape functions at x = xi length and (y, z) of the section: r = sum_i S_i e_i; S : (8,).

    Notes
    -----
    S = (1 - 3 xi^2 + 2 xi^3, l (xi - 2 xi^2 + xi^3), y (1 - xi), z (1 - xi),
    3 xi^2 - 2 xi^3, l (xi^3 - xi^2), y xi, z xi)
    """
    S[0] = 1.0 - xi * xi * (3.0 - 2.0 * xi)
    S[1] = length * xi * (1.0 - xi) * (1.0 - xi)
    S[2] = y * (1.0 - xi)
    S[3] = z * (1.0 - xi)
    S[4] = xi * xi * (3.0 - 2.0 * xi)
    S[5] = -length * xi * xi * (1.0 - xi)
    S[6] = y * xi
    S[7] = z * xi


@inlined
def cubic(length, xi):
    """Hermite's cubic: factors of position, slope, position and slope of an element's two nodes."""
    return (
        1.0 - xi * xi * (3.0 - 2.0 * xi),
        length * xi * (1.0 - xi) * (1.0 - xi),
        xi * xi * (3.0 - 2.0 * xi),
        length * xi * xi * (xi - 1.0),
    )


@inlined
def cubic_slopes(length, xi):
    """Derivatives of `cubic` along the element."""
    d = (6.0 * xi * xi - 6.0 * xi) / length
    return d, 1.0 - 4.0 * xi + 3.0 * xi * xi, -d, 3.0 * xi * xi - 2.0 * xi


@inlined
def cubic_bends(length, xi):
    """Derivatives of `cubic_slopes` along the element."""
    d = (12.0 * xi - 6.0) / (length * length)
    return d, (6.0 * xi - 4.0) / length, -d, (6.0 * xi - 2.0) / length


@inlined
def line_vectors(e, length, xi, i):
    """Component i of a = r,x, b = r,y, b', c = r,z and c' on the beam's axis at x = xi length."""
    p, q = 1.0 - xi, xi
    a = (
        6.0 * p * q / length * (e[12 + i] - e[i])
        + (1.0 - 4.0 * xi + 3.0 * xi * xi) * e[3 + i]
        + (3.0 * xi * xi - 2.0 * xi) * e[15 + i]
    )
    b, b1 = p * e[6 + i] + q * e[18 + i], (e[18 + i] - e[6 + i]) / length
    c, c1 = p * e[9 + i] + q * e[21 + i], (e[21 + i] - e[9 + i]) / length
    return a, b, b1, c, c1


@entry(VECTOR, REAL, REAL, VECTOR)
@kernel
def line_strains(e, length, xi, strains):
    """Strains of the beam's axis at x = xi length, without those of its rest shape; strains : (9,).

    Notes
    -----
    In the order of `STRAINS`, with a = r,x, b = r,y, c = r,z on the axis and ' = d/dx: (a.a - 1)/2, a.b, a.c,
    (b'.c - c'.b)/2, a.b', a.c', (b.b - 1)/2, (c.c - 1)/2, b.c. Green's E_xx = axial + y bend_y + z bend_z + ...
    """
    aa = ab = ac = ab1 = ac1 = bb = cc = bc = b1c = bc1 = 0.0
    for i in range(3):
        a, b, b1, c, c1 = line_vectors(e, length, xi, i)
        aa += a * a
        ab += a * b
        ac += a * c
        ab1 += a * b1
        ac1 += a * c1
        bb += b * b
        cc += c * c
        bc += b * c
        b1c += b1 * c
        bc1 += b * c1
    strains[0] = 0.5 * (aa - 1.0)
    strains[1] = ab
    strains[2] = ac
    strains[3] = 0.5 * (b1c - bc1)
    strains[4] = ab1
    strains[5] = ac1
    strains[6] = 0.5 * (bb - 1.0)
    strains[7] = 0.5 * (cc - 1.0)
    strains[8] = bc


# ---------------------------------------------------------------------------------------------- mass and shape


@kernel
def kinetic_energy(M, u):
    """1/2 u^T (M (x) I3) u, J."""
    T = 0.0
    for i in range(u.size // 3):
        for j in range(u.size // 3):
            T += 0.5 * M[i, j] * (u[3 * i] * u[3 * j] + u[3 * i + 1] * u[3 * j + 1] + u[3 * i + 2] * u[3 * j + 2])
    return T


@kernel
def interpolate(S, e):
    """sum_i S_i e_i: position (or velocity, from the rates) where S are the shape functions, (x, y, z)."""
    x = y = z = 0.0
    for i in range(S.size):
        x += S[i] * e[3 * i]
        y += S[i] * e[3 * i + 1]
        z += S[i] * e[3 * i + 2]
    return x, y, z
