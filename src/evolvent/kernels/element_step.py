"""Elements over a step that conserves energy: stresses of the mean strains, forces along the mean shape.

The products g of an element's nodal vectors (`kernels.ancf`) are quadratic in its coordinates, so that their change
over a step is dg = J(vm) dq exactly, vm the mean of both ends; and the energy is quadratic in g, so that its change is
dg . s exactly, s = H (g0 + g1)/2 - h. The step adds chi/2 H (dg - ratio dg_p), dg_p the change over the step before,
which dissipates what it does not resolve, and damping, b H dg/h.
"""

import math

from evolvent.compiled.jit import inlined, matrix_view
from evolvent.kernels.ancf import add_force, multiply, nodal_vectors, products, write_tangent
from evolvent.kernels.cable import _add_stress, _curvature, _derivative, _dot, add_stretch_tangent, fill_first_position


@inlined
def _mean_stress(e0, e1, h, chi, ratio, b, H, hh, n, before, change, work):
    """Mean vectors into work[:3 n], then those of the end, then the stress s; returns the loss by damping."""
    m = n * (n + 1) // 2
    v, w, s = work[: 3 * n], work[3 * n : 6 * n], work[6 * n : 6 * n + m]
    g, x = work[6 * n + m : 6 * n + 2 * m], work[6 * n + 2 * m : 6 * n + 3 * m]
    nodal_vectors(e0, n, v)
    nodal_vectors(e1, n, w)
    products(v, n, g)
    products(w, n, x)
    for k in range(m):
        d = x[k] - g[k]
        change[k] = d
        x[k] = 0.5 * (x[k] + g[k]) + 0.5 * chi * (d - ratio * before[k])
    for i in range(3 * n):
        v[i] = 0.5 * (v[i] + w[i])
    lost = 0.0
    if b != 0.0:
        multiply(H, change, n, g)
        for k in range(m):
            lost += b / h * g[k] * change[k]
    multiply(H, x, n, s)
    for k in range(m):
        s[k] -= hh[k]
        if b != 0.0:
            s[k] += b / h * g[k]
    return lost


@inlined
def step_force(e0, e1, h, chi, ratio, b, H, hh, n, before, change, work, f):
    """Add the force of an element over a step to f; returns the energy that its damping takes, J.

    Parameters
    ----------
    e0, e1 : coordinates at both ends; n : number of nodal vectors, 3 of a cable and 7 of a beam
    h : float, s, length of the step; chi, ratio : float, of the filter; b : float, s, damping by the stiffness
    H, hh : form of the element
    before : changes of the products over the step before; change : output, over this one
    work : (ancf.WORK,) float, scratch
    """
    lost = _mean_stress(e0, e1, h, chi, ratio, b, H, hh, n, before, change, work)
    m = n * (n + 1) // 2
    add_force(work[6 * n : 6 * n + m], work[: 3 * n], n, f)
    return lost


@inlined
def step_tangent(e0, e1, h, chi, ratio, b, H, hh, n, before, change, work, K):
    """K = twice the derivative of `step_force` with respect to e1."""
    _mean_stress(e0, e1, h, chi, ratio, b, H, hh, n, before, change, work)
    m = n * (n + 1) // 2
    w = work[3 * n : 6 * n]
    factor = 1.0 + chi + 2.0 * b / h
    for i in range(3 * n):
        w[i] *= factor
    write_tangent(H, work[6 * n : 6 * n + m], work[: 3 * n], w, n, matrix_view(work, 6 * n + m, 3 * n, m), K)


@inlined
def stretch_step_force(e0, e1, h, chi, ratio, b, H, hh, before, change, work, f):
    """As `step_force` of a cable with engineering strain (`cable.cable_stretch_energy`), without the bending's damping.

    Notes
    -----
    With a = r,x, q = r,xx and w = 1/(a.a) the stretch |a| changes by am . da over its mean, and the square of the
    curvature, q.q w - (a.q)^2 w^2, by wm d(q.q) + ((q.q)m - 2 wm ((a.q)^2)m) dw - 2 (w^2)m (a.q)m d(a.q), where
    dw = -w0 w1 d(a.a). The filter acts on the stretch, whose changes are `change`.
    """
    v0, v1, lost = work[:9], work[9:18], 0.0
    nodal_vectors(e0, 3, v0)
    nodal_vectors(e1, 3, v1)
    for p in range(3):
        a0, q0, a1, q1 = (
            _derivative(H, p, 0, v0),
            _derivative(H, p, 3, v0),
            _derivative(H, p, 0, v1),
            _derivative(H, p, 3, v1),
        )
        aa0, aa1, aq0, aq1 = _dot(a0, a0), _dot(a1, a1), _dot(a0, q0), _dot(a1, q1)
        l0, l1, w0, w1 = math.sqrt(aa0), math.sqrt(aa1), 1.0 / aa0, 1.0 / aa1
        d, mean = l1 - l0, 0.5 * (l0 + l1)
        change[p] = d
        N = H[3, p] * (mean - hh[p] + 0.5 * chi * (d - ratio * before[p]) + b * d / h)
        lost += b / h * H[3, p] * d * d
        wm, ww, aq, qq = (
            0.5 * (w0 + w1),
            0.5 * (w0 * w0 + w1 * w1),
            0.5 * (aq0 + aq1),
            0.5 * (_dot(q0, q0) + _dot(q1, q1)),
        )
        EI = H[3, 3 + p]
        on_a = N / mean - EI * (qq - wm * (aq0 * aq0 + aq1 * aq1)) * w0 * w1
        am = (0.5 * (a0[0] + a1[0]), 0.5 * (a0[1] + a1[1]), 0.5 * (a0[2] + a1[2]))
        qm = (0.5 * (q0[0] + q1[0]), 0.5 * (q0[1] + q1[1]), 0.5 * (q0[2] + q1[2]))
        _add_stress(H, p, am, qm, on_a, -EI * ww * aq, EI * wm, f)
    return lost


@inlined
def stretch_step_tangent(e0, e1, h, chi, ratio, b, H, hh, before, work, K):
    """K = twice the derivative of `stretch_step_force` with respect to e1; of the bending that at the mean shape."""
    v0, v1 = work[:9], work[9:18]
    nodal_vectors(e0, 3, v0)
    nodal_vectors(e1, 3, v1)
    for i in range(3, 12):
        for j in range(3, 12):
            K[i, j] = 0.0
    for p in range(3):
        a0, q0 = _derivative(H, p, 0, v0), _derivative(H, p, 3, v0)
        a1, q1 = _derivative(H, p, 0, v1), _derivative(H, p, 3, v1)
        l0, l1, EA = math.sqrt(_dot(a0, a0)), math.sqrt(_dot(a1, a1)), H[3, p]
        d, mean = l1 - l0, 0.5 * (l0 + l1)
        N = EA * (mean - hh[p] + 0.5 * chi * (d - ratio * before[p]) + b * d / h)
        factor = (EA * (1.0 + chi + 2.0 * b / h) - N / mean) / (mean * l1)
        am = (0.5 * (a0[0] + a1[0]), 0.5 * (a0[1] + a1[1]), 0.5 * (a0[2] + a1[2]))
        qm = (0.5 * (q0[0] + q1[0]), 0.5 * (q0[1] + q1[1]), 0.5 * (q0[2] + q1[2]))
        add_stretch_tangent(H, p, am, qm, N / mean, (factor * a1[0], factor * a1[1], factor * a1[2]), K)
    fill_first_position(K)


@inlined
def add_bending_filter(dq, chi, ratio, B, before, change, f):
    """Add the filter's force on the bending of a cable element, whose energy contains none of its changes.

    Parameters
    ----------
    dq : (12,) float, increments; chi, ratio : float, of the filter
    B : (2, 4) float (`evolvent.elements.cable_bending`)
    before, change : (6,) float, changes of the root of the energy times the curvature at two points, over the step
        before, and output over this one

    Notes
    -----
    The vectors of curvature do not turn with the element, so that this is for systems that something holds.
    """
    for p in range(2):
        d = _curvature(B, p, dq)
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for c in range(3):
            change[3 * p + c] = d[c]
            force = 0.5 * chi * (d[c] - ratio * before[3 * p + c])
            for i in range(4):
                f[3 * i + c] += a[i] * force


@inlined
def add_bending_filter_tangent(chi, B, K):
    """Add twice the derivative of `add_bending_filter`."""
    for p in range(2):
        a = (-B[p, 1], B[p, 0], B[p, 1], B[p, 2])
        for i in range(4):
            for j in range(4):
                for c in range(3):
                    K[3 * i + c, 3 * j + c] += chi * a[i] * a[j]
