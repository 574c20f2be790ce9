"""Tangents of loads on beams that follow the section or a law (`node_loads`).

With the angular velocity w = B v of a section, v the rates of its vectors, a moment M has the generalised forces B^T M:
they change by dB^T M + B^T dM.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.families.loads.node_loads import (
    GAUSS,
    LINE,
    POINT,
    USED_FOR as USED_FOR,
    couple_on,
    follows,
    line_point,
    node_vector,
    section_axes,
    section_duals,
)
from evolvent.kernels.ancf_beams import BEAM, NODE_VECTORS
from evolvent.kernels.law_means import force_gradient, moment_gradient
from evolvent.kernels.rotations import cross, dot
from evolvent.model import MODEL

_I = types.int64
_NONE = (0.0, 0.0, 0.0)


@inlined
def _cross(a, b):
    return cross(a[0], a[1], a[2], b[0], b[1], b[2])


@inlined
def _plus(a, s, b):
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@inlined
def _at(y, i):
    """The vector of y from i on."""
    return y[i], y[i + 1], y[i + 2]


@inlined
def add_following_tangents(t, y, c_rate, model, matrix):
    """Tangents of all loads on beams that follow their beam or a law."""
    for k in range(model.beam_loads.size):
        if follows(model.beam_loads, k):
            add_following_tangent(t, y, k, c_rate, model, matrix)


@indirect(void(REAL, VECTOR, _I, REAL, MODEL, SPARSE))
def add_following_tangent(t, y, k, c_rate, model, matrix):
    """Add what load k changes with its beam's position, and c_rate times with its velocity, at its last value."""
    n_q = model.info.nq
    row = model.beam_loads[k]
    if row.now == 0.0:
        return
    if row.kind == LINE:
        _add_line_tangent(t, y, k, c_rate, model, matrix)
        return
    is_cable = model.beams[row.beam].kind != BEAM
    half = 3 * NODE_VECTORS[model.beams[row.beam].kind]
    K, A = model.K12, model.K24
    M = node_vector(t, y, k, model)
    if row.law != 0:
        p = model.parameters[row.first : row.last]
        rate = y[row.iv : row.iv + 3]
        moment_gradient(row.law, p, t, model.scratch[1], rate, model.scratch[2], 1.0, 0.0, A, 0, model)
        moment_gradient(row.law, p, t, model.scratch[1], rate, model.scratch[2], 0.0, 1.0, A, 3, model)
    for j in range(half):
        d = (1.0 * (j % 3 == 0), 1.0 * (j % 3 == 1), 1.0 * (j % 3 == 2))
        for i in range(half):
            K[i, j] = 0.0
        if is_cable and j < 6:
            _cable_column(y, k, j, d, M, c_rate, model)
        elif not is_cable:
            _section_column(y, k, j, d, M, c_rate, model)
    add_block(matrix, row.iv - n_q, row.iv - n_q, K, 0, 0, half, half, -row.now)


@inlined
def _law_change(law, A, dx, dv):
    """Change of a law with the derivatives A[:3, :3] by x and A[3:6, :3] by v."""
    if law == 0:
        return 0.0, 0.0, 0.0
    return (
        A[0, 0] * dx[0] + A[0, 1] * dx[1] + A[0, 2] * dx[2] + A[3, 0] * dv[0] + A[3, 1] * dv[1] + A[3, 2] * dv[2],
        A[1, 0] * dx[0] + A[1, 1] * dx[1] + A[1, 2] * dx[2] + A[4, 0] * dv[0] + A[4, 1] * dv[1] + A[4, 2] * dv[2],
        A[2, 0] * dx[0] + A[2, 1] * dx[1] + A[2, 2] * dx[2] + A[5, 0] * dv[0] + A[5, 1] * dv[1] + A[5, 2] * dv[2],
    )


@inlined
def _cable_column(y, k, j, d, M, c_rate, model):
    """Column j of the tangent of load k on a cable's node into K12: by the vector d of its position or its tangent.

    Notes
    -----
    w = s t x t' and Q = s M x t, s = 1/t.t, ds = -2 s^2 t . dt.
    """
    row, K, A = model.beam_loads[k], model.K12, model.K24
    on_place = j < 3
    dx = d if on_place else _NONE
    if row.kind == POINT:
        f = _law_change(row.law, A, dx, (c_rate * dx[0], c_rate * dx[1], c_rate * dx[2]))
        K[0, j], K[1, j], K[2, j] = f
        return
    a, b = _at(y, row.iq + 3), _at(y, row.iv + 3)
    s, e = 1.0 / dot(a, a), _NONE if on_place else d
    ds = -2.0 * s * s * dot(a, e)
    u = _plus(_plus(_NONE, ds, _cross(a, b)), s, _cross(e, b))
    f = _law_change(row.law, A, dx, _plus(u, c_rate * s, _cross(a, e)))
    q = _plus(_plus(_plus(_NONE, ds, _cross(M, a)), s, _cross(M, e)), s, _cross(f, a))
    K[3, j], K[4, j], K[5, j] = q


@inlined
def _section_column(y, k, j, d, M, c_rate, model):
    """Column j of the tangent of load k on a node of 24-coordinate elements into K12: by the vector d of j // 3."""
    row, K, A, at = model.beam_loads[k], model.K12, model.K24, j // 3
    found = section_duals(y, row.iq)
    n, p, q = (found[0], found[1], found[2]), (found[3], found[4], found[5]), (found[6], found[7], found[8])
    dn, dp, dq = _dual_slopes(y, row.iq, d, at, n, p, q)
    dx = d if at == 0 else _NONE
    dv = (c_rate * dx[0], c_rate * dx[1], c_rate * dx[2])
    if row.kind != POINT:
        dv = _turn_change(y, row.iv, at, d, c_rate, n, p, q, dn, dp, dq)
    f = _law_change(row.law, A, dx, dv)
    if row.frame != 0:
        f = _turned_change(y, row.iq, at, d, dn, f, M)
    if row.kind == POINT:
        K[0, j], K[1, j], K[2, j] = f
        return
    x, y_, z = couple_on(n[0], n[1], n[2], p[0], p[1], p[2], f[0], f[1], f[2])
    K[6, j], K[7, j], K[8, j] = _plus((x, y_, z), 1.0, _couple_change(n, p, dn, dp, M))
    x, y_, z = couple_on(n[0], n[1], n[2], q[0], q[1], q[2], f[0], f[1], f[2])
    K[9, j], K[10, j], K[11, j] = _plus((x, y_, z), 1.0, _couple_change(n, q, dn, dq, M))


@inlined
def _dual_slopes(y, iq, d, at, n, p, q):
    """Derivatives of the normal n and of the dual vectors p and q by the vector d of slope b (at = 2) or c (3)."""
    b, c = _at(y, iq + 6), _at(y, iq + 9)
    e, g = d if at == 2 else _NONE, d if at == 3 else _NONE
    N, dN = _cross(b, c), _plus(_cross(e, c), 1.0, _cross(b, g))
    a, da = math.sqrt(dot(N, N)), dot(n, dN)
    s = 1.0 / a
    dn = _plus(_plus(_NONE, s, dN), -s * da, n)
    dp = _plus(_plus(_plus(_NONE, s, _cross(g, n)), s, _cross(c, dn)), -s * da, p)
    dq = _plus(_plus(_plus(_NONE, s, _cross(dn, b)), s, _cross(n, e)), -s * da, q)
    return dn, dp, dq


@inlined
def _turn_change(y, iv, at, d, c_rate, n, p, q, dn, dp, dq):
    """Change of the section's angular velocity (n x n' + p x b' + q x c')/2, n' = -(n . b') p - (n . c') q."""
    u, v = _at(y, iv + 6), _at(y, iv + 9)
    du, dv = d if at == 2 else _NONE, d if at == 3 else _NONE
    rate = _plus(_plus(_NONE, -dot(n, u), p), -dot(n, v), q)
    change = _plus(_plus(_NONE, -dot(dn, u) - c_rate * dot(n, du), p), -dot(dn, v) - c_rate * dot(n, dv), q)
    change = _plus(_plus(change, -dot(n, u), dp), -dot(n, v), dq)
    w = _plus(_cross(dn, rate), 1.0, _cross(n, change))
    w = _plus(_plus(w, 1.0, _cross(dp, u)), 1.0, _cross(dq, v))
    w = _plus(_plus(w, c_rate, _cross(p, du)), c_rate, _cross(q, dv))
    return 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]


@inlined
def _turned_change(y, iq, at, d, dn, f, M):
    """Change of a vector M that stands in the section's axes: of its components by f, and of the axes."""
    found = section_axes(y, iq)
    e1, e2, e3 = (found[0], found[1], found[2]), (found[3], found[4], found[5]), (found[6], found[7], found[8])
    b = _at(y, iq + 6)
    s, g = 1.0 / math.sqrt(dot(b, b)), d if at == 2 else _NONE
    d2 = _plus(_plus(_NONE, s, g), -s * dot(e2, g), e2)
    d3 = _plus(_cross(dn, e2), 1.0, _cross(e1, d2))
    moved = _plus(_plus(_plus(_NONE, dot(e1, M), dn), dot(e2, M), d2), dot(e3, M), d3)
    return _plus(_plus(_plus(moved, f[0], e1), f[1], e2), f[2], e3)


@inlined
def _couple_change(n, p, dn, dp, M):
    """Change of the force (M x p - (M . (n x p)) n)/2 on a slope with its dual vector p and with n."""
    side = dot(M, _plus(_cross(dn, p), 1.0, _cross(n, dp)))
    found = _plus(_plus(_cross(M, dp), -side, n), -dot(M, _cross(n, p)), dn)
    return 0.5 * found[0], 0.5 * found[1], 0.5 * found[2]


@inlined
def _add_line_tangent(t, y, k, c_rate, model, matrix):
    """The tangent of a force per length by a law."""
    n_q = model.info.nq
    row = model.beam_loads[k]
    K, A = model.K24, model.K12
    half = 3 * NODE_VECTORS[model.beams[row.beam].kind]
    p, first = model.parameters[row.first : row.last], model.beams[row.beam].first_element
    for element in range(first, first + model.beams[row.beam].elements):
        at, length = model.elements[element].iv - n_q, model.elements[element].length
        for i in range(2 * half):
            for j in range(2 * half):
                K[i, j] = 0.0
        for xi, weight in GAUSS:
            S = line_point(y, element, xi, model)
            force_gradient(row.law, p, t, model.scratch[1], model.scratch[2], 1.0, c_rate, A, 0, model)
            for i in range(4):
                for j in range(4):
                    s = row.now * weight * length * S[i] * S[j]
                    to, of = (i // 2) * half + 3 * (i % 2), (j // 2) * half + 3 * (j % 2)
                    for c in range(3):
                        for d in range(3):
                            K[to + c, of + d] -= s * A[c, d]
        for r in range(0, 2 * half, half):
            for c in range(0, 2 * half, half):
                add_block(matrix, at + r, at + c, K, r, c, half, half, 1.0)
