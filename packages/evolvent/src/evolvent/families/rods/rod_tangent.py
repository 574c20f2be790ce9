"""Tangents of the elements of rods (`rod`).

With the derivatives J of s, c and v at both ends of an interval, and D of the strains by these, the derivative of the
forces is J0^T (D0^T C D1 + S . d2E) J1, and p . (second derivatives of s, c and v) by the turns of the bodies.
"""

from numba import void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import REAL, indirect, inlined, kernel
from evolvent.compiled.views import matrix_view
from evolvent.families.rods import tape
from evolvent.families.rods.rod import _conjugate_director, evaluate_element
from evolvent.families.rods.rod_strains import (
    _A,
    _B,
    _D0,
    _D1,
    _J0,
    _J1,
    _K,
    _P,
    _Q,
    _S,
    COSINE,
    PSI,
    angle_slopes,
    end_vectors,
    fill_columns,
    secants,
    strain_columns,
)
from evolvent.families.rods.strip import add_fibre_tangent
from evolvent.kernels.damping import add_damping_tangents
from evolvent.kernels.poses import add_double, add_skew, end_axes, pose_after
from evolvent.kernels.rotations import turn, turn_back
from evolvent.kernels.viscoelastic import stiffness_factor
from evolvent.model import MODEL

USED_FOR = "rods"


@inlined
def _column(R, i):
    return R[0, i], R[1, i], R[2, i]


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


@kernel
def add_turned_forces(k, model, p, A0, B0, v0, A1, B1, v1, K):
    """Add p . (second derivatives of s, c and v) to K : (12, 12), displacements and turns in inertial axes.

    The second factor of each product has the positions with 1, which move; the first those with 0 (the same, or means).
    """
    scale = 0.5 / model.rod_elements[k].length
    px, py, pz = scale * p[4], scale * p[5], scale * p[6]
    ga, gb, ha, hb = turn(A0, px, py, pz), turn(B0, px, py, pz), turn(A1, px, py, pz), turn(B1, px, py, pz)
    f = (ga[0] + gb[0], ga[1] + gb[1], ga[2] + gb[2])
    a0, b0, d0 = (v0[0], v0[1], v0[2]), (v0[3], v0[4], v0[5]), (v0[6], v0[7], v0[8])
    a1, b1 = (v1[0], v1[1], v1[2]), (v1[3], v1[4], v1[5])
    for side in range(2):  # forces on b and a
        row, sign = (6, -1.0) if side == 0 else (0, 1.0)
        add_skew(K, row, 3, sign, ha[0], ha[1], ha[2])
        add_skew(K, row, 9, sign, hb[0], hb[1], hb[2])
    for side in range(2):  # torques on a and b
        row = 3 if side == 0 else 9
        g, h, arm0, arm1 = (ga, ha, a0, a1) if side == 0 else (gb, hb, b0, b1)
        sign = 1.0 if side == 0 else -1.0
        add_double(K, row, row, 1.0, d0[0], d0[1], d0[2], h[0], h[1], h[2])
        add_skew(K, row, 6, 1.0, g[0], g[1], g[2])
        add_skew(K, row, 0, -1.0, g[0], g[1], g[2])
        add_double(K, row, 9, -1.0, g[0], g[1], g[2], b1[0], b1[1], b1[2])
        add_double(K, row, 3, 1.0, g[0], g[1], g[2], a1[0], a1[1], a1[2])
        add_double(K, row, row, -sign, f[0], f[1], f[2], arm1[0], arm1[1], arm1[2])
        add_double(K, row, 3, sign, arm0[0], arm0[1], arm0[2], ha[0], ha[1], ha[2])
        add_double(K, row, 9, sign, arm0[0], arm0[1], arm0[2], hb[0], hb[1], hb[2])
    for j in range(3):
        x0, y0, z0 = _conjugate_director(A0, p, j)
        x1, y1, z1 = _conjugate_director(A1, p, j)
        bx0, by0, bz0 = _column(B0, j)
        bx1, by1, bz1 = _column(B1, j)
        for side in range(2):
            row, sign = (3, 1.0) if side == 0 else (9, -1.0)
            add_double(K, row, 3, sign, bx0, by0, bz0, x1, y1, z1)
            add_double(K, row, 9, -sign, x0, y0, z0, bx1, by1, bz1)


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
    rows, bodies, n_q = model.rod_elements, model.bodies, model.info.nq
    at, bt = bodies[rows[k].a].iv - n_q, bodies[rows[k].b].iv - n_q
    add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)
    add_block(matrix, at, bt, K, 0, 6, 6, 6, 1.0)
    add_block(matrix, bt, at, K, 6, 0, 6, 6, 1.0)
    add_block(matrix, bt, bt, K, 6, 6, 6, 6, 1.0)


@indirect(void(REAL, MODEL, SPARSE))
def add_mass_damping_tangents(c_rate, model, matrix):
    """c_rate times the derivatives of the forces of `add_mass_damping` by velocities."""
    rods, bodies, n_q = model.rods, model.bodies, model.info.nq
    K = matrix_view(model.rod, _K, 6, 6)
    for r in range(rods.size):
        alpha = rods[r].alpha
        if alpha == 0.0:
            continue
        first = rods[r].first_body
        add_damping_tangents(alpha, c_rate, bodies, first, first + rods[r].elements + 1, n_q, K, matrix)


@indirect(void(REAL, REAL, REAL, REAL, MODEL, SPARSE))
def add_rod_tangents(h, c_rate, chi, ratio, model, matrix):
    """Derivatives of the forces of all rods by displacements and turns; over a step twice those by what its end moves.

    Parameters
    ----------
    h, chi, ratio : as of `rod.add_rods`; c_rate : float, 1/s, 2/h over a step

    Notes
    -----
    Left out is how the damping's stresses follow the positions at given velocities. Rows of torques are in axes that
    turn with the bodies.
    """
    rows, bodies, work = model.rod_elements, model.bodies, model.rod
    S, p = work[_S : _S + 6], work[_P : _P + 7]
    J0, D0 = matrix_view(work, _J0, 7, 12), matrix_view(work, _D0, 6, 7)
    A, B, K = matrix_view(work, _A, 7, 7), matrix_view(work, _B, 7, 12), matrix_view(work, _K, 12, 12)
    A0, A1, P = matrix_view(work, _Q, 3, 3), matrix_view(work, _Q + 9, 3, 3), matrix_view(work, _Q + 18, 3, 3)
    B0, B1, Q = matrix_view(work, _Q + 27, 3, 3), matrix_view(work, _Q + 36, 3, 3), matrix_view(work, _Q + 45, 3, 3)
    for k in range(rows.size):
        a, b, length, J1, D1 = rows[k].a, rows[k].b, rows[k].length, J0, D0
        dphi, dpsi, _, _, v0 = evaluate_element(k, h, chi, ratio, model, S, p)
        m1 = rows[k].m1
        m0 = m1 if h == 0.0 else rows[k].m0
        Ra, Rb = bodies[a].R, bodies[b].R
        pose_after(bodies, a, -0.5 * h, A0)
        pose_after(bodies, b, -0.5 * h, B0)
        xa, xb = pose_after(bodies, a, 0.5 * h, A1), pose_after(bodies, b, 0.5 * h, B1)
        v1 = end_vectors(rows, k, A1, B1, xa, xb)
        fill_columns(k, model, Ra, Rb, v0, J0)
        strain_columns(m0, m1, dphi, dpsi, length, D0)
        if h != 0.0:
            J1, D1 = matrix_view(work, _J1, 7, 12), matrix_view(work, _D1, 6, 7)
            fill_columns(k, model, A1, B1, v1, J1)
            dphi, dpsi = secants(m1, m1)
            strain_columns(m1, m1, dphi, dpsi, length, D1)
        factor = stiffness_factor(rows[k].prony, rows[k].prony_end, h, model)
        multiply_columns(rows, k, length * (factor + chi + c_rate * rows[k].beta), D0, D1, B, A)
        add_fibre_tangent(rows[k], m0, m1, D0, D1, A)
        if rows[k].tape > 0:
            tape.evaluate_tape(k, h, chi, ratio, c_rate, rows[k].curvature_rate, model)
            tape.add_curvature(k, D0, D1, model, A)
        add_curved_strains(m1, S, length, A)
        project_columns(J0, A, J1, B, K)
        add_turned_forces(k, model, p, Ra, Rb, v0, A1, B1, v1, K)
        end_axes(A0, bodies[a].w, h, P)
        end_axes(B0, bodies[b].w, h, Q)
        to_body_axes(K, A0, B0, P, Q)
        for side in range(2):  # torques in axes that turn: R^T t x dtheta
            row, x, y, z = 3 + 6 * side, 0.0, 0.0, 0.0
            for i in range(7):
                x, y, z = x + p[i] * J0[i, row], y + p[i] * J0[i, row + 1], z + p[i] * J0[i, row + 2]
            x, y, z = turn_back(A0 if side == 0 else B0, x, y, z)
            add_skew(K, row, row, 1.0, x, y, z)
        add_to_bodies(k, model, K, matrix)
        if rows[k].tape > 0:
            tape.couple_nodes(k, J0, D0, A0, B0, J1, D1, P, Q, model, K, matrix)
    add_mass_damping_tangents(c_rate, model, matrix)
