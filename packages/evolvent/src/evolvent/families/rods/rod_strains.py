"""Elements of geometrically exact rods between two bodies: strains.

With the directors d_i of the sections at both ends a and b, T_ij = d_i^a . d_j^b and the vector d from end to end::

    s_k = (T_ij - T_ji)/2 (i, j, k cyclic: T_21 - T_12 for k = 0),  c = (tr T - 1)/2,  v_i = (d_i^a + d_i^b)/2 . d/L

that is s = sin(angle) e and c = cos(angle) of the turn of one end relative to the other about the axis e. The strains
of force, Gamma, and of moment, K, are those of the helix through both ends::

    phi = angle/sin(angle),   psi = (1 - phi)/sin(angle)^2
    Gamma = phi v + psi (s . v) s - Gamma_0,   K = phi s/L - K_0

exact where the strains are constant along the element; they do not change in a rigid motion. s, c and v are quadratic
in vectors that are fixed to the bodies. With Gamma_0 = (1, 0, 0) and K_0 = 0 the rod is straight without stress.
Forces: `rod`.

Literature: Reissner 1981; Simo 1985; Crisfield & Jelenic 1999 (helical strains).
"""

import math
from fractions import Fraction

from numba import types, void

from evolvent.compiled.jit import indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.kernels.rotations import cross, rotation_from_quaternion, turn, turn_back
from evolvent.model import MODEL

USED_FOR = "rods"
_I = types.int64
#: Numbers of an element that `measure_element` writes: s, c, v, phi, psi, then the strains.
COSINE, CHORD, PHI, PSI, STRAIN, MEASURES = 3, 4, 7, 8, 9, 15
#: Change of the cosine below which secants are tangents: their difference is 1e-2 of its square.
_SMALL = 1e-6
#: Cosine of the largest angle between the ends of an element, 120 degrees; beyond it strains are not a number.
LEAST_COSINE = -0.5
# indices in the scratch `Model.rod`
_J0, _J1, _D0, _D1, _A, _B, _K, _P, _S, _Q, WORK = 0, 84, 168, 210, 252, 301, 385, 529, 536, 542, 596

#: Largest u = 1 - cos(angle) at which polynomials give psi and its derivatives; numbers of their coefficients, with
#: which errors are round-off; number of terms of the power series from which the polynomials are economized.
_NEAR, _COUNTS, _TERMS = Fraction(1, 10), (9, 10, 10), 24


def _economize(series, count):
    """Coefficients of a power series on [0, _NEAR], economized by Chebyshev polynomials to `count` terms."""
    powers = [a * _NEAR**k for k, a in enumerate(series)]  # in x = u/_NEAR
    shifted = [[Fraction(1)], [Fraction(-1), Fraction(2)]]
    while len(shifted) < len(powers):  # T_n+1 = 2 (2 x - 1) T_n - T_n-1
        last, found = shifted[-1], [Fraction(0)] * (len(shifted) + 1)
        for k, a in enumerate(last):
            found[k] -= 2 * a
            found[k + 1] += 4 * a
        for k, a in enumerate(shifted[-2]):
            found[k] -= a
        shifted.append(found)
    while len(powers) > count:
        own = shifted[len(powers) - 1]
        factor = powers[-1] / own[-1]
        powers = [a - factor * b for a, b in zip(powers[:-1], own[:-1], strict=True)]
    return tuple(float(a / _NEAR**k) for k, a in enumerate(powers))


def _polynomials():
    """Coefficients of psi and its first two derivatives by u = 1 - cos(angle).

    They follow from the series of phi, a_k = a_(k-1) k/(2 k + 1).
    """
    a = [Fraction(1)]
    for k in range(1, _TERMS + 2):
        a.append(a[-1] * k / (2 * k + 1))
    series = [-a[1] / 2]
    for k in range(1, _TERMS):
        series.append((series[-1] - a[k + 1]) / 2)
    found = []
    for count in _COUNTS:
        found.append(_economize(series, count))
        series = [k * a for k, a in enumerate(series)][1:]
    return tuple(found)


_PSI, _PSI_U, _PSI_UU = _polynomials()
_LARGEST = float(_NEAR)


@inlined
def _polynomial(coefficients, u):
    """Value of a polynomial at u, by Horner's scheme."""
    total = 0.0
    for k in range(len(coefficients) - 1, -1, -1):
        total = coefficients[k] + u * total
    return total


@inlined
def angle_factors(c):
    """Phi and psi of the cosine of an angle; not a number beyond `LEAST_COSINE`."""
    u = 1.0 - c
    square = u * (2.0 - u)
    if u < _LARGEST:
        psi = _polynomial(_PSI, u)
        return 1.0 - square * psi, psi
    if not c >= LEAST_COSINE:
        return math.nan, math.nan
    phi = math.acos(c) / math.sqrt(square)
    return phi, (1.0 - phi) / square


@inlined
def first_slopes(c, phi, psi):
    """First derivatives of phi and psi by the cosine c, from their values at c."""
    u = 1.0 - c
    square = u * (2.0 - u)
    if u < _LARGEST:
        q = -_polynomial(_PSI_U, u)
        return 2.0 * c * psi - square * q, q
    p = (c * phi - 1.0) / square
    return p, (2.0 * c * psi - p) / square


@kernel
def angle_slopes(c):
    """First derivatives of phi and psi by the cosine, then the second ones."""
    u = 1.0 - c
    square = u * (2.0 - u)
    phi, psi = angle_factors(c)
    p, q = first_slopes(c, phi, psi)
    if u < _LARGEST:
        qq = _polynomial(_PSI_UU, u)
        return p, q, 2.0 * psi + 4.0 * c * q - square * qq, qq
    pp = (phi + 3.0 * c * p) / square
    return p, q, pp, (2.0 * psi + 4.0 * c * q - pp) / square


@inlined
def end_vectors(rows, k, A, B, xa, xb):
    """Arms of the ends of element k and the vector between them, inertial axes: 9 floats.

    Parameters
    ----------
    A, B : (3, 3) float, rotations of its bodies; xa, xb : (3,) float, m, their positions
    """
    la, lb = rows[k].arm_a, rows[k].arm_b
    ax, ay, az = turn(A, la[0], la[1], la[2])
    bx, by, bz = turn(B, lb[0], lb[1], lb[2])
    return ax, ay, az, bx, by, bz, xb[0] + bx - xa[0] - ax, xb[1] + by - xa[1] - ay, xb[2] + bz - xa[2] - az


@inlined
def element_vectors(rows, k, bodies):
    """`end_vectors` at the bodies' current positions."""
    a, b = rows[k].a, rows[k].b
    return end_vectors(rows, k, bodies[a].R, bodies[b].R, bodies[a].x, bodies[b].x)


@inlined
def measure_element(k, model, out):
    """Write s, c, v, phi, psi and strains of element k at the bodies' current positions; out : (MEASURES,) float.

    Returns
    -------
    9 floats, `element_vectors`
    """
    rows, bodies = model.rod_elements, model.bodies
    A, B = bodies[rows[k].a].R, bodies[rows[k].b].R
    ax, ay, az, bx, by, bz, dx, dy, dz = element_vectors(rows, k, bodies)
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
    return ax, ay, az, bx, by, bz, dx, dy, dz


@indirect(void(_I, MODEL))
def measure_rods(end, model):
    """Measures of all elements at the start (0) or the end (1) of a step."""
    rows = model.rod_elements
    for k in range(rows.size):
        measure_element(k, model, rows[k].m0 if end == 0 else rows[k].m1)


@inlined
def note_strains(rows):
    """Keep the changes of the strains over the last step, for the filter of the next one."""
    for k in range(rows.size):
        for i in range(6):
            rows[k].before[i] = rows[k].m1[STRAIN + i] - rows[k].m0[STRAIN + i]


@inlined
def secants(m0, m1):
    """Changes of phi and psi over that of the cosine; their derivatives where it does not change."""
    change = m1[COSINE] - m0[COSINE]
    if abs(change) > _SMALL:
        return (m1[PHI] - m0[PHI]) / change, (m1[PSI] - m0[PSI]) / change
    return first_slopes(0.5 * (m0[COSINE] + m1[COSINE]), 0.5 * (m0[PHI] + m1[PHI]), 0.5 * (m0[PSI] + m1[PSI]))


@kernel
def fill_columns(k, model, A, B, v, J):
    """Derivatives J : (7, 12) of s, c and v by displacements and turns (inertial axes) of both bodies.

    Parameters
    ----------
    A, B : (3, 3) float, rotations of the bodies; v : 9 floats, `element_vectors`
    """
    ax, ay, az, bx, by, bz, dx, dy, dz = v
    length = model.rod_elements[k].length
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


@inlined
def rates_of_state(k, model, m, J, D, moves, rate):
    """Rates of the strains of element k with the measures m by the velocities of a state, into rate : (6,).

    Parameters
    ----------
    J, D, moves : (7, 12), (6, 7) and (7,) float, scratch
    """
    rows, bodies = model.rod_elements, model.bodies
    a, b = rows[k].a, rows[k].b
    dphi, dpsi = secants(m, m)
    fill_columns(k, model, bodies[a].R, bodies[b].R, element_vectors(rows, k, bodies), J)
    strain_columns(m, m, dphi, dpsi, rows[k].length, D)
    for i in range(7):
        total = 0.0
        for c in range(3):
            total += J[i, c] * bodies[a].v[c] + J[i, 3 + c] * bodies[a].w[c]
            total += J[i, 6 + c] * bodies[b].v[c] + J[i, 9 + c] * bodies[b].w[c]
        moves[i] = total
    for i in range(6):
        total = 0.0
        for j in range(7):
            total += D[i, j] * moves[j]
        rate[i] = total


# --------------------------------------------------------------------------------------- states between those of steps


@kernel
def _chord(rows, k, y, bodies, A, B):
    """Rotations of the bodies of element k in the state y into A and B; returns the vector between its ends."""
    a, b = bodies[rows[k].a].iq, bodies[rows[k].b].iq
    rotation_from_quaternion(y[a + 3], y[a + 4], y[a + 5], y[a + 6], A)
    rotation_from_quaternion(y[b + 3], y[b + 4], y[b + 5], y[b + 6], B)
    found = end_vectors(rows, k, A, B, y[a : a + 3], y[b : b + 3])
    return found[6], found[7], found[8]


@inlined
def _mean_turned_back(A, B, d):
    """(A + B)^T d/2."""
    p, q = turn_back(A, d[0], d[1], d[2]), turn_back(B, d[0], d[1], d[2])
    return 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2])


@inlined
def keep_chords(theta, y0, y1, model, y):
    """Move the nodes of rods in a state y between y0 and y1 to where v of all elements is on a straight line."""
    bodies = model.bodies
    rows = model.rod_elements
    A, B = matrix_view(model.rod, _Q, 3, 3), matrix_view(model.rod, _Q + 9, 3, 3)
    for r in range(model.rods.size):
        ox = oy = oz = 0.0  # what the nodes so far have been moved by
        grown0, grown1 = 1.0, 1.0
        if model.rods[r].payout != 0:
            grown0, grown1 = model.rods[r].grown0, model.rods[r].grown1
        for k in range(model.rods[r].first_element, model.rods[r].first_element + model.rods[r].elements):
            u = _mean_turned_back(A, B, _chord(rows, k, y0, bodies, A, B))
            v = _mean_turned_back(A, B, _chord(rows, k, y1, bodies, A, B))
            dx, dy, dz = _chord(rows, k, y, bodies, A, B)
            w = _mean_turned_back(A, B, (dx + ox, dy + oy, dz + oz))  # the node before has been moved already
            ex = grown0 * u[0] + theta * (grown1 * v[0] - grown0 * u[0]) - w[0]
            ey = grown0 * u[1] + theta * (grown1 * v[1] - grown0 * u[1]) - w[1]
            ez = grown0 * u[2] + theta * (grown1 * v[2] - grown0 * u[2]) - w[2]
            px, py, pz = turn(A, ex, ey, ez)
            qx, qy, qz = turn(B, ex, ey, ez)
            ox, oy, oz = ox + 0.5 * (px + qx), oy + 0.5 * (py + qy), oz + 0.5 * (pz + qz)
            q = bodies[rows[k].b].iq
            y[q], y[q + 1], y[q + 2] = y[q] + ox, y[q + 1] + oy, y[q + 2] + oz
