"""Compliance of redundant constraints in a step: it acts on the multipliers that make no force, and on no others."""

from __future__ import annotations

from evolvent.algebra import sparse_lu
from evolvent.compiled.jit import inlined


@inlined
def add_compliance(scale, factor, model, matrix, la, x, r):
    """Subtract from the residual of redundant constraints, g, what they yield by multipliers that make no force, c w.

    Parameters
    ----------
    scale : float, of the constraints in the factored `matrix`
    factor : 1, or 2 where the tangent is twice the derivative by a multiplier
    la : (nj,) float, multipliers
    x : (nv + nj,) float, scratch

    Notes
    -----
    With K u + G^T w = 0 and G u - c w = -c la, c the compliance, w is the part of la that makes no force, G^T w = 0,
    and some 1e-5 of the rest; of that w the same leaves 1e-10. Where the constraints agree (g is in the range of G),
    they hold to round-off, and so small is the part of la that makes no force: the multipliers are those of least norm.
    Where they do not agree, g = c w.
    """
    rows, n_j, compliance = model.constraints, la.size, model.info.compliance
    first = x.size - n_j
    for i in range(first):
        x[i] = 0.0
    for k in range(n_j):
        x[first + k] = -scale * factor * rows[k].slack * compliance * la[k]
    sparse_lu.solve(matrix, x)
    for i in range(first):
        x[i] = 0.0
    for k in range(n_j):
        x[first + k] *= -scale * scale * rows[k].slack * compliance
    sparse_lu.solve(matrix, x)
    for k in range(n_j):
        r[first + k] -= scale * rows[k].slack * compliance * x[first + k]
