"""Tangents of the elements of shells (`shell`).

With the derivatives B of the products by the vectors of an element at both ends of an interval, and G of the strains by
the products, the derivative of the forces on the vectors is B0^T (G0^T K G1 + S . d2E) B1 + p . d2I; those on bodies
follow by the weights of the nodes and the turns of their directors.
"""

from numba import void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import REAL, indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.families.shells.shell import evaluate_element, filtered_mean
from evolvent.families.shells.shell_strains import (
    _R,
    _S,
    _U,
    _X,
    DRILLING,
    FIRST,
    G0,
    G1,
    KM,
    KN,
    POSES,
    PRODUCTS,
    RELAX,
    SECOND,
    STRAINS,
    V0,
    V1,
    VECTORS,
    A,
    C,
    H,
    K,
    P,
    T,
    add_curved_strains,
    fill_vectors,
    gather,
    node_weight,
    slopes,
    surface_slopes,
)
from evolvent.kernels.damping import add_damping_tangents
from evolvent.kernels.poses import add_double, add_skew, end_axes
from evolvent.kernels.rotations import cross, turn_back
from evolvent.kernels.viscoelastic import stiffness_factor
from evolvent.model import MODEL

USED_FOR = "shells"


@kernel
def _fill_stiffness(k, h, factor, model, K):
    """K : (15, 15), stiffness of element k over an interval of length h, with what relaxes, divided by `factor`."""
    row, parts = model.shell_elements[k], model.shell_relaxations
    for i in range(STRAINS):
        for j in range(STRAINS):
            K[i, j] = row.stiffness[i, j]  # which `factor` multiplies later
    for p in range(row.relaxation, row.relaxation_end):
        change = (stiffness_factor(parts[p].prony, parts[p].prony_end, h, model) - 1.0) / factor
        for i in range(STRAINS):
            for j in range(STRAINS):
                K[i, j] += change * parts[p].stiffness[i, j]


@kernel
def multiply_slopes(K, factor, G0, G1, C, A):
    """A : (20, 20) = factor G0^T K G1; C : (15, 20), scratch. Most of G0 and G1 is zero."""
    for i in range(STRAINS):
        for j in range(PRODUCTS):
            C[i, j] = 0.0
    for m in range(STRAINS):
        for j in range(PRODUCTS):
            g = factor * G1[m, j]
            if g != 0.0:
                for i in range(STRAINS):
                    C[i, j] += K[m, i] * g
    for i in range(PRODUCTS):
        for j in range(PRODUCTS):
            A[i, j] = 0.0
    for m in range(STRAINS):
        for i in range(PRODUCTS):
            g = G0[m, i]
            if g != 0.0:
                for j in range(PRODUCTS):
                    A[i, j] += g * C[m, j]


@kernel
def multiply_products(A, p, V0, V1, T, M):
    """M : (21, 21) = B0^T A B1 + p . (second derivatives of the products); T : (20, 21), scratch."""
    for m in range(PRODUCTS):
        for j in range(3 * VECTORS):
            T[m, j] = 0.0
    for n in range(PRODUCTS):
        r, s = FIRST[n], SECOND[n]
        for m in range(PRODUCTS):
            a = A[m, n]
            for c in range(3):
                T[m, 3 * r + c] += a * V1[s, c]
                T[m, 3 * s + c] += a * V1[r, c]
    for i in range(3 * VECTORS):
        for j in range(3 * VECTORS):
            M[i, j] = 0.0
    for m in range(PRODUCTS):
        r, s = FIRST[m], SECOND[m]
        for c in range(3):
            v, w = V0[s, c], V0[r, c]
            for j in range(3 * VECTORS):
                t = T[m, j]
                M[3 * r + c, j] += v * t
                M[3 * s + c, j] += w * t
        for c in range(3):
            M[3 * r + c, 3 * s + c] += p[m]
            M[3 * s + c, 3 * r + c] += p[m]


@kernel
def to_nodes(M, N, K):
    """K : (24, 24), by positions and directors of nodes, from M : (21, 21), by the vectors; N : (21, 24), scratch."""
    for i in range(3 * VECTORS):
        for c in range(3):
            a, b, d = 0.25 * M[i, c], 0.25 * M[i, 3 + c], 0.25 * M[i, 6 + c]
            N[i, c], N[i, 6 + c], N[i, 12 + c], N[i, 18 + c] = d - a - b, a - b - d, a + b + d, b - a - d
            o, a, b, d = 0.25 * M[i, 9 + c], 0.25 * M[i, 12 + c], 0.25 * M[i, 15 + c], 0.25 * M[i, 18 + c]
            N[i, 3 + c], N[i, 9 + c] = o - a - b + d, o + a - b - d
            N[i, 15 + c], N[i, 21 + c] = o + a + b + d, o - a + b - d
    for c in range(3):
        for j in range(24):
            a, b, d = 0.25 * N[c, j], 0.25 * N[3 + c, j], 0.25 * N[6 + c, j]
            K[c, j], K[6 + c, j], K[12 + c, j], K[18 + c, j] = d - a - b, a - b - d, a + b + d, b - a - d
            o, a, b, d = 0.25 * N[9 + c, j], 0.25 * N[12 + c, j], 0.25 * N[15 + c, j], 0.25 * N[18 + c, j]
            K[3 + c, j], K[9 + c, j] = o - a - b + d, o + a - b - d
            K[15 + c, j], K[21 + c, j] = o + a + b + d, o - a + b - d


@kernel
def turn_directors(K, R0, R1):
    """From derivatives by directors, in K : (24, 24), to those by turns: rows of R0, columns of R1 (inertial axes)."""
    for a in range(4):
        at, r = 6 * a + 3, 3 * a
        for i in range(24):
            x, y, z = cross(R1[r, 2], R1[r + 1, 2], R1[r + 2, 2], K[i, at], K[i, at + 1], K[i, at + 2])
            K[i, at], K[i, at + 1], K[i, at + 2] = x, y, z
    for a in range(4):
        at, r = 6 * a + 3, 3 * a
        for j in range(24):
            x, y, z = cross(R0[r, 2], R0[r + 1, 2], R0[r + 2, 2], K[at, j], K[at + 1, j], K[at + 2, j])
            K[at, j], K[at + 1, j], K[at + 2, j] = x, y, z


@inlined
def _drilling_columns(rows, k, a, U, R, B):
    """Derivatives B : (15,) of the drilling strain of node a by the nodes' positions and the node's turn."""
    r = 3 * a
    for b in range(4):
        one, two = 0.5 * rows[k].slopes[2 * a, b], 0.5 * rows[k].slopes[2 * a + 1, b]
        for c in range(3):
            B[3 * b + c] = one * R[r + c, 1] - two * R[r + c, 0]
    tx, ty, tz = cross(R[r, 1], R[r + 1, 1], R[r + 2, 1], U[0, 0], U[0, 1], U[0, 2])
    ux, uy, uz = cross(R[r, 0], R[r + 1, 0], R[r + 2, 0], U[1, 0], U[1, 1], U[1, 2])
    B[12], B[13], B[14] = 0.5 * (tx - ux), 0.5 * (ty - uy), 0.5 * (tz - uz)


@kernel
def add_drilling(rows, k, a, stiffness, stress, x0, R0, x1, R1, U, B, K, torque):
    """Add derivatives of the forces of the drilling strain of node a to K : (24, 24), and its torque to `torque`."""
    B0, B1, at, r, half = B[:15], B[15:30], 6 * a + 3, 3 * a, 0.5 * stress
    surface_slopes(rows, k, a, x1, U)
    _drilling_columns(rows, k, a, U, R1, B1)
    surface_slopes(rows, k, a, x0, U)
    _drilling_columns(rows, k, a, U, R0, B0)
    for i in range(15):
        row = 6 * (i // 3) + i % 3 if i < 12 else at + i - 12
        for j in range(15):
            column = 6 * (j // 3) + j % 3 if j < 12 else at + j - 12
            K[row, column] += stiffness * B0[i] * B1[j]
    for c in range(3):
        torque[c] += stress * B0[12 + c]
    for b in range(4):
        one, two = half * rows[k].slopes[2 * a, b], half * rows[k].slopes[2 * a + 1, b]
        add_skew(K, at, 6 * b, one, R0[r, 1], R0[r + 1, 1], R0[r + 2, 1])
        add_skew(K, at, 6 * b, -two, R0[r, 0], R0[r + 1, 0], R0[r + 2, 0])
        add_skew(K, 6 * b, at, -one, R1[r, 1], R1[r + 1, 1], R1[r + 2, 1])
        add_skew(K, 6 * b, at, two, R1[r, 0], R1[r + 1, 0], R1[r + 2, 0])
    add_double(
        K, at, at, half, U[0, 0], U[0, 1], U[0, 2], R1[r, 1], R1[r + 1, 1], R1[r + 2, 1],
    )  # fmt: skip
    add_double(
        K, at, at, -half, U[1, 0], U[1, 1], U[1, 2], R1[r, 0], R1[r + 1, 0], R1[r + 2, 0],
    )  # fmt: skip


@inlined
def _turn_axes(K, a, Q, S):
    """Turns of node a in the rows of K : (24, 24) into axes Q, in its columns into S."""
    at = 6 * a + 3
    for c in range(24):
        x, y, z = turn_back(Q, K[at, c], K[at + 1, c], K[at + 2, c])
        K[at, c], K[at + 1, c], K[at + 2, c] = x, y, z
    for r in range(24):
        x, y, z = turn_back(S, K[r, at], K[r, at + 1], K[r, at + 2])
        K[r, at], K[r, at + 1], K[r, at + 2] = x, y, z


@inlined
def _add_to_bodies(k, model, K, matrix):
    """Add the derivatives K : (24, 24) of element k to a matrix; nodes that are held have no unknowns."""
    rows, bodies, n_q = model.shell_elements, model.bodies, model.info.nq
    for a in range(4):
        i = bodies[rows[k].nodes[a]].iv
        for b in range(4):
            j = bodies[rows[k].nodes[b]].iv
            if i >= 0 and j >= 0:
                add_block(matrix, i - n_q, j - n_q, K, 6 * a, 6 * b, 6, 6, 1.0)


@kernel
def fill_tangent(k, h, c_rate, chi, ratio, model, K):
    """Derivatives K : (24, 24) of the forces of element k by displacements and turns, as of `add_shell_tangents`."""
    rows, bodies, work = model.shell_elements, model.bodies, model.shells[0].work
    S, p = work[_S : _S + STRAINS], work[P : P + PRODUCTS]
    x0, R0, U = matrix_view(work, _X, 4, 3), matrix_view(work, _R, 12, 3), matrix_view(work, _U, 2, 3)
    W0, W1 = matrix_view(work, V0, VECTORS, 3), matrix_view(work, V1, VECTORS, 3)
    D0, D1 = matrix_view(work, G0, STRAINS, PRODUCTS), matrix_view(work, G1, STRAINS, PRODUCTS)
    left, right = matrix_view(work, POSES + 12, 12, 3), matrix_view(work, POSES + 48, 12, 3)
    x1, R1, B = matrix_view(work, POSES, 4, 3), matrix_view(work, POSES + 84, 12, 3), work[POSES + 120 : POSES + 150]
    M = matrix_view(work, A, PRODUCTS, PRODUCTS)
    evaluate_element(k, h, chi, ratio, model)
    m1 = rows[k].m1
    m0 = m1 if h == 0.0 else rows[k].m0
    gather(k, model, -0.5 * h, x1, left)
    gather(k, model, 0.5 * h, x1, R1)
    fill_vectors(x1, R1, W1)
    slopes(m1, m1, D1)
    factor, stiff = 1.0 + chi + c_rate * rows[k].beta, matrix_view(work, RELAX, STRAINS, STRAINS)
    _fill_stiffness(k, h, factor, model, stiff)
    multiply_slopes(stiff, factor, D0, D1, matrix_view(work, C, STRAINS, PRODUCTS), M)
    add_curved_strains(m0, m1, S, M)
    modes = matrix_view(work, KM, 3 * VECTORS, 3 * VECTORS)
    multiply_products(M, p, W0, W1, matrix_view(work, T, PRODUCTS, 3 * VECTORS), modes)
    to_nodes(modes, matrix_view(work, KN, 3 * VECTORS, 24), K)
    turn_directors(K, R0, R1)
    torque = work[H : H + 12]
    for a in range(4):
        gx = gy = gz = 0.0
        for m in range(6, PRODUCTS):
            i, j = FIRST[m], SECOND[m]
            w = p[m] * node_weight(j, a)
            if m > 17:
                w *= 2.0
            gx, gy, gz = gx + w * W0[i, 0], gy + w * W0[i, 1], gz + w * W0[i, 2]
        r, at = 3 * a, 6 * a + 3
        torque[r], torque[r + 1], torque[r + 2] = cross(R0[r, 2], R0[r + 1, 2], R0[r + 2, 2], gx, gy, gz)
        add_double(K, at, at, 1.0, gx, gy, gz, R1[r, 2], R1[r + 1, 2], R1[r + 2, 2])
    for a in range(4):
        w = rows[k].drilling * filtered_mean(rows, k, DRILLING + a, m0, m1, chi, ratio)
        stiffness = (1.0 + chi) * rows[k].drilling
        add_drilling(rows, k, a, stiffness, w, x0, R0, x1, R1, U, B, K, torque[3 * a : 3 * a + 3])
    for a in range(4):
        own = left[3 * a : 3 * a + 3]
        end_axes(own, bodies[rows[k].nodes[a]].w, h, right[3 * a : 3 * a + 3])
        _turn_axes(K, a, own, right[3 * a : 3 * a + 3])
        x, y, z = turn_back(own, torque[3 * a], torque[3 * a + 1], torque[3 * a + 2])
        add_skew(K, 6 * a + 3, 6 * a + 3, 1.0, x, y, z)  # torques in axes that turn: R^T t x dtheta


@indirect(void(REAL, REAL, REAL, REAL, MODEL, SPARSE))
def add_shell_tangents(h, c_rate, chi, ratio, model, matrix):
    """Derivatives of the forces of all shells by displacements and turns; over a step twice those by its end.

    Parameters
    ----------
    h, chi, ratio : as of `shell.add_shells`; c_rate : float, 1/s, 2/h over a step

    Notes
    -----
    Left out is how the damping's stresses follow the positions at given velocities. Rows of torques are in axes that
    turn with the bodies.
    """
    own = matrix_view(model.shells[0].work, K, 24, 24)
    for k in range(model.shell_elements.size):
        fill_tangent(k, h, c_rate, chi, ratio, model, own)
        _add_to_bodies(k, model, own, matrix)
    shells, mass = model.shells, matrix_view(model.shells[0].work, K, 6, 6)
    for k in range(shells.size):
        if shells[k].alpha != 0.0:
            first = shells[k].first_body
            add_damping_tangents(
                shells[k].alpha, c_rate, model.bodies, first, first + shells[k].nodes, model.info.nq, mass, matrix
            )
