"""Viscoelastic memory of strains: generalized Maxwell, one strain of its spring a branch.

A strain x of an instantaneous stiffness K carries the stress

    s = K (x + sum_i g_i (w_i - x)),    dw_i/dt = dx/dt - w_i/tau_i

with the shares g_i and relaxation times tau_i of a Prony series, and the strain w_i of the spring of branch i, whose
dashpot has the rest of x. The energy is K (1 - sum g_i) x^2/2 + sum_i g_i K w_i^2/2, the power dissipated
sum_i g_i K w_i^2/tau_i. Over a step of length h in which x changes by dx at a constant rate, with u = h/tau_i,

    w_1 = w_0 exp(-u) + phi_1 dx,          phi_1 = (1 - exp(-u))/u,
    mean of w = w_0 phi_1 + phi_2 dx,      phi_2 = (1 - phi_1)/u

exactly, for steps of any length (Taylor, Pister & Goudreau 1970; Simo & Hughes 1998, section 10.3).

A force over a step takes the means; in a state that ends a step (generalized-alpha, statics after a time) it takes the
end; in a state of an explicit method or at a sample, the strains that stand among the accounts. What a record of the
family `branch_strains` holds: x0, w0 of the last state that was accepted, x, w of the last evaluation, and under
explicit methods the rate of x.
"""

import math

from numba import types

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.model import MODEL

USED_FOR = "branch_strains"
_I = types.int64
#: Steps beside a relaxation time below which the functions of their ratio are series.
_SERIES = 1e-3


@inlined
def decay(u):
    """exp(-u), phi_1 and phi_2 of a step that is u relaxation times long; of an infinite one 0."""
    if u < _SERIES:
        first = 1.0 - u * (0.5 - u * (1.0 / 6.0 - u / 24.0))
        return math.exp(-u), first, 0.5 - u * (1.0 / 6.0 - u * (1.0 / 24.0 - u / 120.0))
    first = -math.expm1(-u) / u
    return math.exp(-u), first, (1.0 - first) / u


@inlined
def decay_of(term, h, model):
    """`decay` of a Prony term over a step of length h, or over the time that ends in a state (h = 0)."""
    terms = model.prony_terms
    if h == 0.0:
        h = terms[term].span if terms[term].span >= 0.0 else max(model.interval.rub, 0.0)
    return decay(h / terms[term].time)


@inlined
def is_kept(h, model):
    """Whether branch strains are those among the accounts of a state; never over a step of length h > 0."""
    return h == 0.0 and model.interval.span < 0.0


@inlined
def branch_strain(rows, k, h, kept, change, x1):
    """Strain of branch k that acts, its mean over a step; x1: the whole strain at the end; change: of `decay_of`."""
    rows[k].x = x1
    if kept:
        return rows[k].w
    left, first, second = change
    dx = x1 - rows[k].x0
    rows[k].w = rows[k].w0 * left + first * dx
    return rows[k].w0 * first + second * dx if h != 0.0 else rows[k].w


@indirect(types.UniTuple(REAL, 2)(_I, _I, _I, REAL, REAL, REAL, MODEL))
def relax(first, last, branch, h, mean, x1, model):
    """What relaxation adds to a strain of which the stress is K times it, and the factor of its stiffness.

    Parameters
    ----------
    first, last : int, range of Prony terms; branch : int, of the strain's first branch
    h : float, s, of a step, 0 of a state
    mean, x1 : float, mean of the strain over the step, and its end

    Returns
    -------
    added : float; factor : float, derivative of the stress, over a step twice that of its mean by the end, beside K
    """
    rows, added, factor, kept = model.branch_strains, 0.0, 1.0, is_kept(h, model)
    for i in range(last - first):
        share = model.prony_terms[first + i].share
        change = (1.0, 1.0, 0.5) if kept else decay_of(first + i, h, model)
        added += share * (branch_strain(rows, branch + i, h, kept, change, x1) - mean)
        factor += share * ((change[1] if h == 0.0 else 2.0 * change[2]) - 1.0)
    return added, factor


@indirect(REAL(_I, _I, _I, _I, REAL, VECTOR, VECTOR, MODEL, VECTOR))
def relax_strains(first, last, branch, n, h, mean, x1, model, out):
    """`relax` of n strains of one stiffness matrix: adds to `out` what relaxation does; returns the factor.

    Parameters
    ----------
    branch : int, of the first strain's first branch; those of a term stand together
    mean, x1, out : (n,) float
    """
    rows, factor, kept = model.branch_strains, 1.0, is_kept(h, model)
    for i in range(last - first):
        share = model.prony_terms[first + i].share
        change = (1.0, 1.0, 0.5) if kept else decay_of(first + i, h, model)
        factor += share * ((change[1] if h == 0.0 else 2.0 * change[2]) - 1.0)
        for j in range(n):
            at = branch + i * n + j
            out[j] += share * (branch_strain(rows, at, h, kept, change, x1[j]) - mean[j])
    return factor


@inlined
def stiffness_factor(first, last, h, model):
    """Factor of a stiffness, as `relax` returns it, without an evaluation."""
    factor, kept = 1.0, is_kept(h, model)
    for i in range(first, last):
        change = (1.0, 1.0, 0.5) if kept else decay_of(i, h, model)
        factor += model.prony_terms[i].share * ((change[1] if h == 0.0 else 2.0 * change[2]) - 1.0)
    return factor


@inlined
def excess_square(first, last, branch, x, model):
    """Sum of g (w^2 - x^2): twice what the energy of a strain x differs by from K x^2/2, over K."""
    found = 0.0
    for i in range(last - first):
        w = model.branch_strains[branch + i].w
        found += model.prony_terms[first + i].share * (w * w - x * x)
    return found


@inlined
def excess_of(first, last, branch, n, j, x, model):
    """`excess_square` of strain j of n."""
    found = 0.0
    for i in range(last - first):
        w = model.branch_strains[branch + i * n + j].w
        found += model.prony_terms[first + i].share * (w * w - x * x)
    return found


@inlined
def lost_square(first, last, branch, model):
    """Sum of g w^2/tau in a state: the power that is dissipated, over K."""
    found = 0.0
    for i in range(last - first):
        w = model.branch_strains[branch + i].w
        found += model.prony_terms[first + i].share * w * w / model.prony_terms[first + i].time
    return found


@indirect(REAL(_I, _I, _I, REAL, MODEL))
def relaxed_over(first, last, branch, h, model):
    """What relaxation takes over an accepted step of length h, over K: sum of g (mean w dx - (w1^2 - w0^2)/2)."""
    rows, found = model.branch_strains, 0.0
    if h <= 0.0:
        return 0.0
    for i in range(last - first):
        k = branch + i
        left, one, two = decay(h / model.prony_terms[first + i].time)
        dx, w0 = rows[k].x - rows[k].x0, rows[k].w0
        w1 = w0 * left + one * dx
        found += model.prony_terms[first + i].share * ((w0 * one + two * dx) * dx - 0.5 * (w1 - w0) * (w1 + w0))
    return found


@inlined
def add_branches(first, last, branch, n, at, x, model, out):
    """out += sum of g (w - x) of n strains x, from x[at] on, at the last evaluation of their branches."""
    for i in range(last - first):
        share = model.prony_terms[first + i].share
        for j in range(n):
            out[j] += share * (model.branch_strains[branch + i * n + j].w - x[at + j])


@inlined
def branch_energy(share, rows, at, C, first, last):
    """Energy g w . C w/2 of strains first to last of a branch, from row `at` on, at the last evaluation."""
    found = 0.0
    for i in range(first, last):
        force = 0.0
        for j in range(C.shape[0]):
            force += C[i, j] * rows[at + j].w
        found += 0.5 * share * force * rows[at + i].w
    return found


@inlined
def relaxed_by(first, last, branch, n, C, h, model):
    """`relaxed_over` of n strains of the stiffness matrix C: energy, J, of a unit of what C is per."""
    rows, found = model.branch_strains, 0.0
    for i in range(last - first):
        left, one, two = decay(h / model.prony_terms[first + i].time)
        at = branch + i * n
        for j in range(n):
            force = change = 0.0
            for k in range(n):
                w0, dx = rows[at + k].w0, rows[at + k].x - rows[at + k].x0
                w1 = w0 * left + one * dx
                force += C[j, k] * (w0 * one + two * dx)
                change += C[j, k] * (w1 + w0)
            w0, dx = rows[at + j].w0, rows[at + j].x - rows[at + j].x0
            w1 = w0 * left + one * dx
            found += model.prony_terms[first + i].share * (force * dx - 0.5 * change * (w1 - w0))
    return found


@inlined
def relaxed_one(first, last, branch, n, j, h, model):
    """`relaxed_over` of strain j of n."""
    rows, found = model.branch_strains, 0.0
    for i in range(last - first):
        k = branch + i * n + j
        left, one, two = decay(h / model.prony_terms[first + i].time)
        dx, w0 = rows[k].x - rows[k].x0, rows[k].w0
        w1 = w0 * left + one * dx
        found += model.prony_terms[first + i].share * ((w0 * one + two * dx) * dx - 0.5 * (w1 - w0) * (w1 + w0))
    return found


@inlined
def note_rate(first, last, branch, rate, model):
    """Rate of a strain in a state of an explicit method, into the records of its branches."""
    for k in range(branch, branch + last - first):
        model.branch_strains[k].rate = rate
