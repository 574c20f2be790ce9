"""Flattening of the section of a tape-spring or lenticular rod: its law, and the coordinates of the nodes.

The section is a shallow arc of the curvature k0, the width s and the thickness t; D is the bending stiffness of its
wall. With the bending curvature x of the rod about z, positive in opposite sense (the edges are on the inner side),
the deflection of the section is a q plus what the coordinate a, the transverse curvature, leaves free;
q = y^2/2 - s^2/24, y from the middle along the arc. The energy of bending and stretching of the wall, least over what
is free, is per length::

    W = s D/2 ((1 - nu^2) x^2 + N(u) (k0 + nu x - a)^2 + u/180 a^2),   u = 3 (1 - nu^2) s^4 x^2/t^2
    N = g (1 - F)/(g - 1 + F),  g = u/180,  F = 2/L (cosh L - cos L)/(sinh L + sin L),  L^4 = u

and dW/dx at the a of least W is the moment of Wuest and Mansfield. A lenticular section is two arcs, edge to edge, with
the same a, q = y^2/2 - s^2/8 from the plane of the edges, and without Poisson's coupling, which cancels::

    W = s D (x^2 + N (k0 - a)^2 + g a^2),   g = u/30,  F = 1/L (sinh L + sin L)/(cosh L + cos L)

Along the rod s D (1 - nu) s^2/12 a'^2 of twisting
of each wall is added; an element has W at both of its ends, half each, by the curvature of its helix. The mass of a is
that of a q. Over an interval the strains x, k0 + nu x - a and a x change as in `rod`: products by the means of
their factors, N by its secant in u. Filter and damping act on these strains with the stiffness of N = 1.

Literature: Wuest 1954; Mansfield 1973; Seffen, Pellegrino 1999 (tape springs); Guinot, Bourgeois, Cochelin,
Blanchard 2012 (rods with flexible sections). Derivation: `docs/theory/tape-spring-rod.md`.
"""

import math
from fractions import Fraction

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block, add_entry
from evolvent.compiled.jit import MATRIX, REAL, VECTOR, entry, indirect, inlined, kernel
from evolvent.families.rods.rod_strains import STRAIN
from evolvent.kernels.viscoelastic import excess_of, relax_strains, relaxed_one
from evolvent.model import MODEL

USED_FOR = "tapes"
_I = types.int64
_TERMS = 16
#: u/g of a strip with free edges, and of two that are joined edge to edge.
OF_OPEN, OF_CLOSED = 180, 30
#: u below which N is a series: it converges below 500, the fourth power of the first pole's L.
_NEAR = 16.0
#: Strains of an element that relax.
RELAXING = 6
#: Change of u, beside 1 + u, below which secants are derivatives.
_SMALL = 1e-4


def _quotient(a, b):
    """Coefficients of a power series over another one."""
    found = []
    for k in range(min(len(a), len(b))):
        found.append((a[k] - sum((found[j] * b[k - j] for j in range(k)), Fraction(0))) / b[0])
    return found


def _series(closed):
    """Coefficients of N in powers of u."""
    n = _TERMS + 2
    part, first, factor = (OF_CLOSED, 1, 1) if closed else (OF_OPEN, 2, 2)
    above = [Fraction(factor, math.factorial(4 * k + first)) for k in range(n)]
    below = [Fraction(1, math.factorial(4 * k + first - 1)) for k in range(n)]
    F = _quotient(above, below)
    S = [-part * F[k + 1] for k in range(n - 1)]  # (1 - F)/g
    T = [-part * S[k + 1] for k in range(n - 2)]  # (1 - S)/g
    return tuple(float(c) for c in _quotient(S, T))


_N_OPEN, _N_CLOSED = _series(False), _series(True)


@entry(REAL, _I)
@kernel
def profile(u, closed):
    """N of u and its first two derivatives; closed: 1 of a lenticular section."""
    if u < _NEAR:
        p = q = r = 0.0
        for k in range(_TERMS - 1, -1, -1):
            r = q + u * r
            q = p + u * q
            p = (_N_CLOSED[k] if closed else _N_OPEN[k]) + u * p
        return p, q, 2.0 * r
    L = math.sqrt(math.sqrt(u))
    e = math.exp(-L)
    sh, ch, s, c = 0.5 * (1.0 - e * e), 0.5 * (1.0 + e * e), e * math.sin(L), e * math.cos(L)
    if closed:
        d, slope = ch + c, 1.0 / OF_CLOSED
        F, P = (sh + s) / (L * d), 0.5 * (e * e + ch * c) / (d * d)
        P_L = (0.5 * (sh * c - ch * s) - (e * e + ch * c) * (sh - s) / d) / (d * d)
    else:
        d, slope = sh + s, 1.0 / OF_OPEN
        F, P = 2.0 / L * (ch - c) / d, sh * s / (d * d)
        P_L = ((ch * s + sh * c) - 2.0 * sh * s * (ch + c) / d) / (d * d)
    F2 = 0.25 * F - P  # -u dF/du
    g, A, A1 = u * slope, 1.0 - F, F2 / u
    A2 = -(0.25 * F2 / u + 0.25 * L / u * P_L) / u - F2 / (u * u)
    left = g - A
    top = A1 * g * g - A * A * slope
    second = (A2 * g * g + 2.0 * slope * A1 * left) / (left * left) - 2.0 * top * (slope - A1) / (left * left * left)
    return A * g / left, top / (left * left), second


@inlined
def profile_secant(u0, u1, closed):
    """Mean of N over an interval, its secant in u, and at the end the derivatives of the secant and of N by u."""
    N1, d1, dd1 = profile(u1, closed)
    change = u1 - u0
    if change == 0.0:
        return N1, d1, 0.5 * dd1, d1
    N0, _, _ = profile(u0, closed)
    if abs(change) > _SMALL * (1.0 + u1):
        secant = (N1 - N0) / change
        return 0.5 * (N0 + N1), secant, (d1 - secant) / change, d1
    _, secant, second = profile(0.5 * (u0 + u1), closed)
    return 0.5 * (N0 + N1), secant, 0.5 * second, d1


@inlined
def _relax(k, h, x0, x1, model, out):
    """What relaxation adds to the strains of element k, into out; returns the factor of stiffnesses.

    The strains are those of which the energy is a sum of squares: x, sqrt(N) (k0 + nu x - a) and a x at both nodes, and
    the difference of a.
    """
    row, nodes, work = model.rod_elements[k], model.tape_nodes, model.work
    own, mean, end = model.tapes[row.tape - 1], work[:RELAXING], work[RELAXING : 2 * RELAXING]
    N0, _, _ = profile(own.slenderness * x0 * x0, own.closed)
    N1, _, _ = profile(own.slenderness * x1 * x1, own.closed)
    root0, root1 = math.sqrt(N0), math.sqrt(N1)
    mean[0], end[0], mean[5], end[5] = 0.5 * (x0 + x1), x1, 0.0, 0.0
    for j in range(2):
        a1 = nodes[row.tape_node + j].value
        a0, sign = a1, 1.0 if j == 1 else -1.0
        if h != 0.0:
            a0, a1 = nodes[row.tape_node + j].value0, nodes[row.tape_node + j].value1
        end[1 + j] = root1 * (own.transverse + own.poisson * x1 - a1)
        mean[1 + j] = 0.5 * (root0 * (own.transverse + own.poisson * x0 - a0) + end[1 + j])
        mean[3 + j], end[3 + j] = 0.5 * (x0 * a0 + x1 * a1), x1 * a1
        mean[5], end[5] = mean[5] + sign * 0.5 * (a0 + a1), end[5] + sign * a1
    return relax_strains(row.prony, row.prony_end, row.flat_branch, RELAXING, h, mean, end, model, out)


@inlined
def _add_relaxed(j, x, bent, added, more, slender, nu, x0, x1, closed, f, T):
    """Force of relaxation on the coordinate a of node j, and derivatives; returns those of the curvature.

    Parameters
    ----------
    bent : float, mean of k0 + nu x - a; added : float, what relaxation adds to the mean of sqrt(N) (k0 + nu x - a)
    more : float, factor of the stiffness less 1

    Notes
    -----
    sqrt(N) (k0 + nu x - a) changes by the mean of sqrt(N) times the change of the second factor, and so on: the work is
    what its branches take. Derivatives are those of the mean.
    """
    N, d, dd = profile(slender * x * x, closed)
    N0, _, _ = profile(slender * x0 * x0, closed)
    N1, _, _ = profile(slender * x1 * x1, closed)
    root, first = math.sqrt(N), 0.5 * d / math.sqrt(N)
    mean, change, turn = 0.5 * (math.sqrt(N0) + math.sqrt(N1)), slender * (x1 * x1 - x0 * x0), 2.0 * slender * x
    secant = first
    if abs(change) > _SMALL * (1.0 + slender * x1 * x1):
        secant = (math.sqrt(N1) - math.sqrt(N0)) / change
    second = 0.5 * dd / root - 0.25 * d * d / (root * N)
    by_x = bent * first * turn + root * nu
    bend = 2.0 * nu * first * turn + bent * (second * turn * turn + 2.0 * first * slender)
    f[1 + j] -= 0.5 * added * mean
    cross = -0.5 * (more * by_x * root + added * first * turn)
    T[0, 1 + j] += cross
    T[1 + j, 0] += cross
    T[1 + j, 1 + j] += 0.5 * more * N
    return 0.5 * added * (bent * secant * turn + mean * nu), 0.5 * (more * by_x * by_x + added * bend)


@inlined
def relaxed_tape(k, h, model):
    """What relaxation of element k takes over a step of length h that is accepted, J."""
    row = model.rod_elements[k]
    own, first, last, branch = model.tapes[row.tape - 1], row.prony, row.prony_end, row.flat_branch
    found = (1.0 - own.poisson * own.poisson) * relaxed_one(first, last, branch, RELAXING, 0, h, model)
    for j in range(2):
        found += 0.5 * relaxed_one(first, last, branch, RELAXING, 1 + j, h, model)
        stretched = relaxed_one(first, last, branch, RELAXING, 3 + j, h, model)
        found += 0.5 * own.slenderness * own.stretching * stretched
    along = own.twisting / (row.length * row.length)
    return own.bending * row.length * (found + along * relaxed_one(first, last, branch, RELAXING, 5, h, model))


@indirect(REAL(_I, REAL, REAL, REAL, REAL, REAL, MODEL))
def evaluate_tape(k, h, chi, ratio, c_rate, rate, model):
    """Forces of element k on its curvature and on both coordinates a, with their derivatives, into its record.

    Parameters
    ----------
    h, chi, ratio : as of `rod.add_rods`; c_rate : as of `rod_tangent.add_rod_tangents`
    rate : float, 1/(m s), rate of the curvature of a state

    Returns
    -------
    power that damping takes, W

    Notes
    -----
    Derivatives are by the state, or twice those by the end of a step.
    """
    rows, nodes = model.rod_elements, model.tape_nodes
    own = model.tapes[rows[k].tape - 1]
    beta, length, f, T = rows[k].beta, rows[k].length, rows[k].flattening, rows[k].flattening_slope
    B, nu, k0, slender = own.bending, own.poisson, own.transverse, own.slenderness
    m1 = rows[k].m1
    m0 = m1 if h == 0.0 else rows[k].m0
    x0, x1 = m0[STRAIN + 5], m1[STRAIN + 5]
    x = 0.5 * (x0 + x1)
    x_rate = rate if h == 0.0 else (x1 - x0) / h
    x_extra = 0.5 * chi * (x1 - x0 - ratio * rows[k].before[5]) + beta * x_rate
    N, secant, secant1, slope1 = profile_secant(slender * x0 * x0, slender * x1 * x1, own.closed)
    out, factor = model.work[2 * RELAXING : 3 * RELAXING], 1.0
    for i in range(RELAXING):
        out[i] = 0.0
    if rows[k].prony_end > rows[k].prony:
        factor = _relax(k, h, x0, x1, model, out)
    stretching, more = slender * own.stretching, factor + chi + c_rate * beta
    plate, filtered = 1.0 - nu * nu, N + chi + c_rate * beta
    f0, T00, lost = plate * (x + out[0] + x_extra), plate * more, plate * x_rate * x_rate
    gradient = gradient_rate = 0.0
    for j in range(2):
        node = nodes[rows[k].tape_node + j]
        a1, a_rate = node.value, node.rate
        a0 = a1
        if h != 0.0:
            a0, a1 = node.value0, node.value1
            a_rate = (a1 - a0) / h
        a = 0.5 * (a0 + a1)
        a_extra = 0.5 * chi * (a1 - a0 - ratio * node.before) + beta * a_rate
        bent0, bent1 = k0 + nu * x0 - a0, k0 + nu * x1 - a1
        mean, squares = 0.5 * (bent0 + bent1), 0.5 * (bent0 * bent0 + bent1 * bent1)
        bend = N * mean + nu * x_extra - a_extra
        p0, p1 = x0 * a0, x1 * a1
        p_rate = x_rate * a1 + x1 * a_rate if h == 0.0 else (p1 - p0) / h
        stretch = 0.5 * (p0 + p1) + out[3 + j] + beta * p_rate
        stretch += 0.5 * chi * (p1 - p0 - ratio * rows[k].before_product[j])
        f0 += 0.5 * (nu * bend + squares * secant * slender * x + stretching * stretch * a)
        f[1 + j] = 0.5 * (stretching * stretch * x - bend)
        by_x = 2.0 * mean * slope1 * slender * x1
        T00 += 0.5 * nu * (nu * filtered + by_x + 2.0 * bent1 * secant * slender * x)
        T00 += 0.5 * slender * squares * (4.0 * secant1 * slender * x1 * x + secant)
        T00 += 0.5 * stretching * more * a1 * a
        T[0, 1 + j] = 0.5 * (
            -nu * filtered - 2.0 * bent1 * secant * slender * x + stretching * (more * x1 * a + stretch)
        )
        T[1 + j, 0] = 0.5 * (-nu * filtered - by_x + stretching * (more * a1 * x + stretch))
        T[1 + j, 1 + j] = 0.5 * (filtered + stretching * more * x1 * x)
        T[1 + j, 2 - j] = 0.0
        if rows[k].prony_end > rows[k].prony:
            on_x, by_x = _add_relaxed(j, x, mean, out[1 + j], factor - 1.0, slender, nu, x0, x1, own.closed, f, T)
            f0, T00 = f0 + on_x, T00 + by_x
        bend_rate = nu * x_rate - a_rate
        lost += 0.5 * (bend_rate * bend_rate + stretching * p_rate * p_rate)
        sign = 1.0 if j == 1 else -1.0
        gradient += sign * (a + a_extra)
        gradient_rate += sign * a_rate
    gradient += out[5]
    f[0], T[0, 0] = f0, T00
    along = own.twisting / (length * length)
    lost += along * gradient_rate * gradient_rate
    f[1] -= along * gradient
    f[2] += along * gradient
    for j in range(2):
        T[1 + j, 1 + j] += along * more
        T[1 + j, 2 - j] -= along * more
    for i in range(3):
        f[i] *= B * length
        for j in range(3):
            T[i, j] *= B * length
    rows[k].curvature_rate = rate
    return beta * B * length * lost


@inlined
def push_nodes(k, model):
    """Add the forces of element k to those of its nodes' coordinates."""
    rows, nodes = model.rod_elements, model.tape_nodes
    for j in range(2):
        nodes[rows[k].tape_node + j].force += rows[k].flattening[1 + j]


@inlined
def _energy(k, model):
    """Energy of bending about z and of flattening of element k in a state, J."""
    rows, nodes = model.rod_elements, model.tape_nodes
    own = model.tapes[rows[k].tape - 1]
    x, length = rows[k].m1[STRAIN + 5], rows[k].length
    u = own.slenderness * x * x
    N, _, _ = profile(u, own.closed)
    a, b = nodes[rows[k].tape_node].value, nodes[rows[k].tape_node + 1].value
    p, q = own.transverse + own.poisson * x - a, own.transverse + own.poisson * x - b
    plate, along, stretching = 1.0 - own.poisson * own.poisson, own.twisting / (length * length), own.stretching
    found = plate * x * x + 0.5 * N * (p * p + q * q) + 0.5 * stretching * u * (a * a + b * b)
    found += along * (b - a) * (b - a)
    if rows[k].prony_end > rows[k].prony:
        first, last, at = rows[k].prony, rows[k].prony_end, rows[k].flat_branch
        found += plate * excess_of(first, last, at, RELAXING, 0, x, model)
        found += 0.5 * excess_of(first, last, at, RELAXING, 1, math.sqrt(N) * p, model)
        found += 0.5 * excess_of(first, last, at, RELAXING, 2, math.sqrt(N) * q, model)
        found += 0.5 * stretching * own.slenderness * excess_of(first, last, at, RELAXING, 3, x * a, model)
        found += 0.5 * stretching * own.slenderness * excess_of(first, last, at, RELAXING, 4, x * b, model)
        found += along * excess_of(first, last, at, RELAXING, 5, b - a, model)
    return 0.5 * own.bending * length * found


# ---------------------------------------------------------------------------------------------- coordinates of nodes


@indirect(void(VECTOR, MODEL))
def measure_nodes(y, model):
    """Coordinates of all nodes in a state, and their rates, into the records; forces reset."""
    nodes = model.tape_nodes
    for i in range(nodes.size):
        nodes[i].value, nodes[i].rate, nodes[i].force = y[nodes[i].iq], y[nodes[i].iv], 0.0


@indirect(void(_I, MODEL))
def keep_nodes(end, model):
    """Take the coordinates as those at the start (0) or the end (1) of a step."""
    nodes = model.tape_nodes
    for i in range(nodes.size):
        if end == 0:
            nodes[i].value0 = nodes[i].value
        else:
            nodes[i].value1 = nodes[i].value


@indirect(void(MODEL))
def note_flattening(model):
    """Keep the changes of coordinates and of products over the last step, for the filter of the next one."""
    rows, nodes = model.rod_elements, model.tape_nodes
    for i in range(nodes.size):
        nodes[i].before = nodes[i].value1 - nodes[i].value0
    for k in range(rows.size):
        if rows[k].tape > 0:
            for j in range(2):
                node = nodes[rows[k].tape_node + j]
                x0, x1 = rows[k].m0[STRAIN + 5], rows[k].m1[STRAIN + 5]
                rows[k].before_product[j] = x1 * node.value1 - x0 * node.value0


@indirect(REAL(VECTOR, REAL, REAL, MODEL, VECTOR))
def add_nodes(a, factor, h, model, F):
    """Forces and inertia of all coordinates on the left of the equations, after `rod.add_rods`.

    Parameters
    ----------
    a : (nv,) float, accelerations times 1/factor; h : float, s, length of the step, 0 of a state

    Returns
    -------
    power that damping by mass takes, W
    """
    nodes, n_q, lost = model.tape_nodes, model.info.nq, 0.0
    for i in range(nodes.size):
        at, rate = nodes[i].iv - n_q, nodes[i].rate
        if h != 0.0:
            rate = (nodes[i].value1 - nodes[i].value0) / h
        F[at] += nodes[i].force + nodes[i].mass * (factor * a[at] + nodes[i].alpha * rate)
        lost += nodes[i].alpha * nodes[i].mass * rate * rate
    return lost


@indirect(REAL(VECTOR, MODEL, VECTOR))
def node_rates(y, model, dy):
    """Rates of all coordinates of a state, after `rod.add_rods`; returns the power that damping by mass takes, W."""
    nodes, lost = model.tape_nodes, 0.0
    for i in range(nodes.size):
        rate, damping = y[nodes[i].iv], nodes[i].alpha
        dy[nodes[i].iq] = rate
        dy[nodes[i].iv] = -nodes[i].force / nodes[i].mass - damping * rate
        lost += damping * nodes[i].mass * rate * rate
    return lost


@indirect(void(VECTOR, MODEL, VECTOR, _I))
def add_kinetic_energy(y, model, out, at):
    """Add the kinetic energy of all coordinates to out[at], J."""
    for t in range(model.tapes.size):
        out[at] += kinetic_energy(t, y, model)


@indirect(REAL(_I, VECTOR, MODEL))
def kinetic_energy(t, y, model):
    """Kinetic energy of the coordinates of tape t, J."""
    nodes, found = model.tape_nodes, 0.0
    for i in range(model.tapes[t].first_node, model.tapes[t].first_node + model.tapes[t].nodes):
        found += 0.5 * nodes[i].mass * y[nodes[i].iv] * y[nodes[i].iv]
    return found


@indirect(REAL(_I, MODEL))
def evaluate_results(k, model):
    """Add bending about z to the results of element k in a state; returns its energy, J."""
    rows = model.rod_elements
    evaluate_tape(k, 0.0, 0.0, 0.0, 0.0, 0.0, model)
    energy, length = _energy(k, model), rows[k].length
    rows[k].bending_moment_z = rows[k].flattening[0] / length
    rows[k].curvature_z = rows[k].m1[STRAIN + 5]
    rows[k].energy_density += energy / length
    rows[k].stored += energy
    rows[k].bent += energy
    return energy


# ---------------------------------------------------------------------------------------------- tangents


@indirect(void(REAL, REAL, MODEL, SPARSE))
def add_node_tangents(c_mass, c_rate, model, matrix):
    """c_mass M + c_rate alpha M of all coordinates into a matrix."""
    nodes, n_q = model.tape_nodes, model.info.nq
    for i in range(nodes.size):
        at = nodes[i].iv - n_q
        add_entry(matrix, at, at, (c_mass + c_rate * nodes[i].alpha) * nodes[i].mass)


@indirect(void(_I, MATRIX, MATRIX, MODEL, MATRIX))
def add_curvature(k, D0, D1, model, A):
    """Add D0^T T D1 of the curvature to A : (7, 7), after `evaluate_tape`; D0, D1 of `rod_strains.strain_columns`."""
    own = model.rod_elements[k].flattening_slope[0, 0]
    for i in range(7):
        for j in range(7):
            A[i, j] += D0[5, i] * own * D1[5, j]


@inlined
def _turned(J, D, i, P, Q):
    """Derivative of the curvature by the velocity i of both bodies, turns in the axes P and Q."""
    found, c = 0.0, i % 3
    if i % 6 < 3:
        for r in range(4, 7):  # not of s and c
            found += D[5, r] * J[r, i]
        return found
    for m in range(3):
        part, at = 0.0, i - c + m
        for r in range(7):
            part += D[5, r] * J[r, at]
        found += (P[m, c] if i < 6 else Q[m, c]) * part
    return found


@indirect(void(_I, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX, MODEL, MATRIX, SPARSE))
def couple_nodes(k, J0, D0, A0, B0, J1, D1, P, Q, model, K, matrix):
    """Derivatives of element k by its nodes' coordinates and of their forces into a matrix, after `evaluate_tape`.

    Parameters
    ----------
    J0, D0, J1, D1 : derivatives of measures and strains, of rows and columns
    A0, B0, P, Q : (3, 3) float, axes of turns of both bodies, of rows and columns
    K : (12, 12) float, scratch
    """
    rows, nodes, n_q = model.rod_elements, model.tape_nodes, model.info.nq
    T, bodies = rows[k].flattening_slope, model.bodies
    at = bodies[rows[k].a].iv - n_q
    bt = bodies[rows[k].b].iv - n_q
    for i in range(12):
        row = _turned(J0, D0, i, A0, B0)
        for j in range(2):
            K[i, j] = row * T[0, 1 + j]
    for j in range(2):
        own = nodes[rows[k].tape_node + j].iv - n_q
        add_block(matrix, at, own, K, 0, j, 6, 1, 1.0)
        add_block(matrix, bt, own, K, 6, j, 6, 1, 1.0)
    for i in range(12):
        column = _turned(J1, D1, i, P, Q)
        for j in range(2):
            K[j, i] = T[1 + j, 0] * column
    for j in range(2):
        own = nodes[rows[k].tape_node + j].iv - n_q
        add_block(matrix, own, at, K, j, 0, 1, 6, 1.0)
        add_block(matrix, own, bt, K, j, 6, 1, 6, 1.0)
        for m in range(2):
            add_entry(matrix, own, nodes[rows[k].tape_node + m].iv - n_q, T[1 + j, 1 + m])
