"""Elements of geometrically exact shells between four bodies: strains.

The nodes are bodies: positions x_a and directors d_a, the third axes of their rotations. Both are interpolated
bilinearly, x = x_0 + xi x_1 + eta x_2 + xi eta x_3 and d = d_0 + .. + xi eta d_3, and all strains follow from the
scalar products I of x_1, x_2, x_3 with one another and with d_0 to d_3. The membrane strains are those of four edges
and two diagonals, each as long as the arc that its chord and the directors at its ends make: with the chord c and the
difference e of the directors, c.c + (c.e)^2/12 of the arc. Where an element is warped or its mesh distorted, bending
without stretching then leaves no membrane strain up to fourth order in its size, so that nothing locks:

    M_1 = (x_1.x_1 + x_3.x_3)/2 + (p_1^2 + q_1^2)/6,   T_1 = x_1.x_3 + p_1 q_1/3,   and 2 for 1,
    S = x_1.x_2 + (x_1.d_1 + x_2.d_2)(x_1.d_2 + x_2.d_1)/3,   p_1 = x_1.d_1 + x_3.d_3,   q_1 = x_1.d_3 + x_3.d_1

The strains of bending are products x_i.d_j, those with d_1 and d_2 times phi(d_j.d_j), by which the angle between
directors counts in place of its sine: phi = (asin(s)/s)^2 of s^2 = d_j.d_j; those of transverse shear are the products
in the middles of the edges (MITC4, Dvorkin & Bathe 1984):

    K_1 = phi_1 x_1.d_1,  K_2 = phi_2 x_2.d_2,  K_12 = phi_2 x_1.d_2 + phi_1 x_2.d_1,
    B_1 = x_1.d_3 + phi_1 x_3.d_1,  B_2 = x_2.d_3 + phi_2 x_3.d_2,  B_3 = x_3.d_3,
    x_1.d_0 + x_3.d_2,  x_1.d_2 + x_3.d_0,  x_2.d_0 + x_3.d_1,  x_2.d_1 + x_3.d_0

`stiffness` has how stress resultants that are assumed in the element weight these 15 measures. A drilling strain of
each node of the element is half of the rotation of its in-plane axes against the deformed surface.

The measures do not change in a rigid motion. They are polynomials of products of vectors that are fixed to the bodies,
so that their changes over a step are exactly those by means of the factors (`slopes`). Forces: `shell`.

Literature: Simo & Fox 1989 (strains of a surface with a director); MacNeal 1982 and Ko, Lee & Bathe 2017 (membrane
strains of edges).
"""

from numba import types, void

from evolvent.compiled.jit import MATRIX, VECTOR, entry, indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.kernels.poses import pose_after
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL

USED_FOR = "shells"
_I = types.int64
#: Vectors of an element: x_1, x_2, x_3, then d_0 to d_3; its products I, then the squares of d_1 and d_2.
VECTORS, PRODUCTS, STRAINS = 7, 20, 15
#: Factors of each product, indices of vectors.
FIRST = (0, 1, 2, 0, 0, 1, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 4, 5)
SECOND = (0, 1, 2, 1, 2, 2, 3, 4, 5, 6, 3, 4, 5, 6, 3, 4, 5, 6, 4, 5)
#: Numbers of an element that `measure_element` writes: products, strains, drilling strains of its nodes.
STRAIN, DRILLING, MEASURES = 20, 35, 39
#: Terms of strains that are products times phi: strain, product, and 0 or 1 of d_1 or d_2.
BENT = ((5, 7, 0), (6, 12, 1), (7, 8, 1), (7, 11, 0), (8, 15, 0), (9, 16, 1))
#: Signs of the nodes in the interpolation, of 1, xi, eta and xi eta.
SIGNS = ((1.0, 1.0, 1.0, 1.0), (-1.0, 1.0, 1.0, -1.0), (-1.0, -1.0, 1.0, 1.0), (1.0, -1.0, 1.0, -1.0))
#: Coefficients of phi in powers of the square of the sine of half the angle.
_PHI1, _PHI2, _PHI3 = 1.0 / 3.0, 8.0 / 45.0, 4.0 / 35.0
# indices in the scratch `shells[0].work`
_X, _R, _U, V0, V1, _S, P, FORCE, G0, G1, C, A, T, H, KM, KN, K, POSES, RATES, RELAX, WORK = (
    0, 12, 48, 60, 81, 102, 119, 139, 160, 500, 840, 1180, 1580, 2000, 2400, 2841, 3417, 3993, 4143, 4262, 4487,
)  # fmt: skip


@inlined
def bend_factor(u):
    """Phi of a square of a director's half difference, and its derivative."""
    return (
        1.0 + u * (_PHI1 + u * (_PHI2 + u * _PHI3)),
        _PHI1 + u * (2.0 * _PHI2 + u * 3.0 * _PHI3),
    )


@inlined
def _secant(u, w):
    """Change of phi from u to w over that of its argument, and twice the derivative of this by w."""
    return (
        _PHI1 + _PHI2 * (u + w) + _PHI3 * (u * u + u * w + w * w),
        2.0 * _PHI2 + 2.0 * _PHI3 * (u + 2.0 * w),
    )


@inlined
def node_weight(p, a):
    """Weight of node a in vector p."""
    return 0.25 * SIGNS[p + 1][a] if p < 3 else 0.25 * SIGNS[p - 3][a]


@kernel
def gather(k, model, h, x, R):
    """Positions x : (4, 3), rotations R : (12, 3) of the nodes of element k at the half interval h after the mean."""
    rows, bodies = model.shell_elements, model.bodies
    for a in range(4):
        b = rows[k].nodes[a]
        own = R[3 * a : 3 * a + 3]
        x[a, 0], x[a, 1], x[a, 2] = pose_after(bodies, b, h, own)


@kernel
def fill_vectors(x, R, V):
    """Vectors V : (7, 3) of an element from the positions and rotations of its nodes (`gather`)."""
    for c in range(3):
        a, b, d, e = x[0, c], x[1, c], x[2, c], x[3, c]
        V[0, c], V[1, c], V[2, c] = 0.25 * (b + d - a - e), 0.25 * (d + e - a - b), 0.25 * (a + d - b - e)
        a, b, d, e = R[c, 2], R[3 + c, 2], R[6 + c, 2], R[9 + c, 2]
        V[3, c] = 0.25 * (a + b + d + e)
        V[4, c], V[5, c], V[6, c] = 0.25 * (b + d - a - e), 0.25 * (d + e - a - b), 0.25 * (a + d - b - e)


@inlined
def surface_slopes(rows, k, a, x, U):
    """Derivatives of the position along the in-plane axes of node a without stress, in its element: U : (2, 3)."""
    for i in range(2):
        for c in range(3):
            total = 0.0
            for b in range(4):
                total += rows[k].slopes[2 * a + i, b] * x[b, c]
            U[i, c] = total


@entry(MATRIX, VECTOR)
@kernel
def measure_vectors(V, out):
    """Write products and strains, those without stress included, of an element with the vectors V into out."""
    for m in range(PRODUCTS):
        p, q = FIRST[m], SECOND[m]
        out[m] = V[p, 0] * V[q, 0] + V[p, 1] * V[q, 1] + V[p, 2] * V[q, 2]
    p1, q1, p2, q2 = out[7] + out[17], out[9] + out[15], out[12] + out[17], out[13] + out[16]
    out[STRAIN] = 0.5 * (out[0] + out[2]) + (p1 * p1 + q1 * q1) / 6.0
    out[STRAIN + 1] = 0.5 * (out[1] + out[2]) + (p2 * p2 + q2 * q2) / 6.0
    out[STRAIN + 2] = out[3] + (out[7] + out[12]) * (out[8] + out[11]) / 3.0
    out[STRAIN + 3], out[STRAIN + 4] = out[4] + p1 * q1 / 3.0, out[5] + p2 * q2 / 3.0
    one, two = bend_factor(out[18])[0], bend_factor(out[19])[0]
    out[STRAIN + 5], out[STRAIN + 6] = one * out[7], two * out[12]
    out[STRAIN + 7] = two * out[8] + one * out[11]
    out[STRAIN + 8], out[STRAIN + 9] = out[9] + one * out[15], out[13] + two * out[16]
    out[STRAIN + 10] = out[17]
    out[STRAIN + 11], out[STRAIN + 12] = out[6] + out[16], out[8] + out[14]
    out[STRAIN + 13], out[STRAIN + 14] = out[10] + out[15], out[11] + out[14]


@inlined
def measure_element(k, model, out):
    """Write products, strains and drilling strains of element k at the bodies' current positions; out : (MEASURES,)."""
    rows, work = model.shell_elements, model.shells[0].work
    x, R, U = matrix_view(work, _X, 4, 3), matrix_view(work, _R, 12, 3), matrix_view(work, _U, 2, 3)
    V = matrix_view(work, V0, VECTORS, 3)
    gather(k, model, 0.0, x, R)
    fill_vectors(x, R, V)
    measure_vectors(V, out)
    for i in range(STRAINS):
        out[STRAIN + i] -= rows[k].rest[i]
    for a in range(4):
        surface_slopes(rows, k, a, x, U)
        r, w = 3 * a, 0.0
        for c in range(3):
            w += U[0, c] * R[r + c, 1] - U[1, c] * R[r + c, 0]
        out[DRILLING + a] = 0.5 * w - rows[k].untwisted[a]


@indirect(void(_I, MODEL))
def measure_shells(end, model):
    """Measures of all elements at the start (0) or the end (1) of a step."""
    rows = model.shell_elements
    for k in range(rows.size):
        measure_element(k, model, rows[k].m0 if end == 0 else rows[k].m1)


@inlined
def note_strains(rows):
    """Keep the changes of the measures over the last step, for the filter of the next one."""
    for k in range(rows.size):
        for i in range(STRAIN, MEASURES):
            rows[k].before[i - STRAIN] = rows[k].m1[i] - rows[k].m0[i]


@kernel
def slopes(m0, m1, G):
    """Derivatives G : (15, 20) of the strains by the products: over a step G d(products) = d(strains), exactly.

    Parameters
    ----------
    m0, m1 : measures at both ends; the same for the derivatives in a state
    """
    for i in range(STRAINS):
        for j in range(PRODUCTS):
            G[i, j] = 0.0
    p1, q1 = 0.5 * (m0[7] + m0[17] + m1[7] + m1[17]), 0.5 * (m0[9] + m0[15] + m1[9] + m1[15])
    p2, q2 = 0.5 * (m0[12] + m0[17] + m1[12] + m1[17]), 0.5 * (m0[13] + m0[16] + m1[13] + m1[16])
    b, c = 0.5 * (m0[7] + m0[12] + m1[7] + m1[12]), 0.5 * (m0[8] + m0[11] + m1[8] + m1[11])
    G[0, 0] = G[0, 2] = G[1, 1] = G[1, 2] = 0.5
    G[2, 3] = G[3, 4] = G[4, 5] = 1.0
    G[0, 7] = G[0, 17] = G[3, 9] = G[3, 15] = p1 / 3.0
    G[0, 9] = G[0, 15] = G[3, 7] = G[3, 17] = q1 / 3.0
    G[1, 12] = G[4, 13] = G[4, 16] = p2 / 3.0
    G[1, 17] += p2 / 3.0
    G[1, 13] = G[1, 16] = G[4, 12] = G[4, 17] = q2 / 3.0
    G[2, 7] = G[2, 12] = c / 3.0
    G[2, 8] = G[2, 11] = b / 3.0
    G[8, 9] = G[9, 13] = G[10, 17] = 1.0
    G[11, 6] = G[11, 16] = G[12, 8] = G[12, 14] = G[13, 10] = G[13, 15] = G[14, 11] = G[14, 14] = 1.0
    for t in range(6):
        i, m, j = BENT[t][0], BENT[t][1], 18 + BENT[t][2]
        G[i, m] = 0.5 * (bend_factor(m0[j])[0] + bend_factor(m1[j])[0])
        G[i, j] += _secant(m0[j], m1[j])[0] * 0.5 * (m0[m] + m1[m])


@inlined
def write_rates(k, h, m0, m1, model, V, G, rate):
    """Rates of the strains of element k: changes over a step over its length h, or by the velocities of a state.

    Parameters
    ----------
    V, G : (7, 3) and (15, 20) float, vectors of the element, and `slopes`
    rate : (15,) float, filled
    """
    bodies, nodes, work = model.bodies, model.shell_elements[k].nodes, model.shells[0].work
    if h != 0.0:
        for i in range(STRAINS):
            rate[i] = (m1[STRAIN + i] - m0[STRAIN + i]) / h
        return
    moves = work[RATES + 15 : RATES + 35]
    x, R = matrix_view(work, RATES + 35, 4, 3), matrix_view(work, RATES + 47, 12, 3)
    W = matrix_view(work, RATES + 83, VECTORS, 3)
    for a in range(4):
        v, w, D, r = bodies[nodes[a]].v, bodies[nodes[a]].w, bodies[nodes[a]].R, 3 * a
        x[a, 0], x[a, 1], x[a, 2] = v[0], v[1], v[2]
        R[r, 2], R[r + 1, 2], R[r + 2, 2] = cross(w[0], w[1], w[2], D[0, 2], D[1, 2], D[2, 2])
    fill_vectors(x, R, W)
    for m in range(PRODUCTS):
        p, q, total = FIRST[m], SECOND[m], 0.0
        for c in range(3):
            total += V[p, c] * W[q, c] + W[p, c] * V[q, c]
        moves[m] = total
    for i in range(STRAINS):
        rate[i] = 0.0
        for m in range(PRODUCTS):
            rate[i] += G[i, m] * moves[m]


@inlined
def _add_pair(H, value, i, j):
    H[i, j] += value
    H[j, i] += value


@kernel
def add_curved_strains(m0, m1, S, H):
    """Add S . (second derivatives of the strains by the products) to H : (20, 20), twice those of `slopes` by m1."""
    one, two, three, four, five = S[0] / 3.0, S[1] / 3.0, S[2] / 3.0, S[3] / 3.0, S[4] / 3.0
    for i in (7, 17):
        for j in (7, 17):
            H[i, j] += one
        for j in (9, 15):
            _add_pair(H, four, i, j)
    for i in (9, 15):
        for j in (9, 15):
            H[i, j] += one
    for i in (12, 17):
        for j in (12, 17):
            H[i, j] += two
        for j in (13, 16):
            _add_pair(H, five, i, j)
    for i in (13, 16):
        for j in (13, 16):
            H[i, j] += two
    for i in (7, 12):
        for j in (8, 11):
            _add_pair(H, three, i, j)
    for t in range(6):
        i, m, j = BENT[t][0], BENT[t][1], 18 + BENT[t][2]
        secant, curved = _secant(m0[j], m1[j])
        H[m, j] += S[i] * bend_factor(m1[j])[1]
        H[j, m] += S[i] * secant
        H[j, j] += S[i] * curved * 0.5 * (m0[m] + m1[m])
