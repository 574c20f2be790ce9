"""Elements over a step that conserves energy: stresses of the mean strains, forces along the mean shape.

The products g of an element's nodal vectors (`kernels.ancf`) are quadratic in its coordinates, so that their change over
a step is dg = J(vm) dq exactly, vm the mean of both ends; and the energy is quadratic in g, so that its change is
dg . s exactly, s = H (g0 + g1)/2 - h. The step adds chi/2 H (dg - ratio dg_p), dg_p the change over the step before,
which dissipates what it does not resolve, and damping, b H dg/h.
"""

from evolvent.jit import inlined, matrix_view
from evolvent.kernels.ancf import add_force, multiply, nodal_vectors, products, write_tangent


@inlined
def _mean_stress(e0, e1, h, chi, ratio, b, H, hh, n, before, change, work):
    """Mean vectors into work[:3 n], those of the end after them, the stress s after these; returns the damping's loss."""
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
